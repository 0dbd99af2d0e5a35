"""Every picture names its axes with units, keeps the Axes it is given, and shows the numbers it is about."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes

import discovered
import udd
from udd.errors import UddError
from udd.plot import fits
from udd.plot.fits import pattern
from udd.plot.friction import coefficient


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    plt.close("all")


def run(W: float = 0.039) -> udd.Trajectory:
    return udd.simulate(udd.Disk(W), np.arange(0, 4, 0.01), [0.0, 1e-3, 0.04, 0.0])


def has_units(ax: Axes) -> bool:
    labels = [ax.get_xlabel(), ax.get_ylabel()] + ([ax.get_zlabel()] if hasattr(ax, "get_zlabel") else [])
    return all("[" in label and label.endswith("]") for label in labels)


@functools.cache
def sensors() -> udd.Fit:
    """A fit of a model of one's own, seen by two sensors at rates of their own."""
    model = udd.Model(
        ["q", "w"],
        ["w", "-k*sin(q) - c*w"],
        {"k": 20.0, "c": 0.2, "bias": 0.0},
        angles=["q"],
        observe={"volts": "2*q", "gyro": "w + bias"},
    )
    t = np.arange(0, 8, 0.02)
    seen = model.observed(t, udd.simulate(model, t, [1.0, 0.0]).state)
    seen += 0.02 * np.random.default_rng(1).normal(size=seen.shape)
    seen[::3, 1] = np.nan
    return udd.fit(udd.Measurement(t, {"volts": seen[:, 0], "gyro": seen[:, 1]}), model)


DRAWN: dict[str, Callable[[], Axes]] = {
    "series of a run": lambda: udd.plot.time_series(run()),
    "series of a measurement": lambda: udd.plot.time_series(discovered.disk().measurement),
    "series of a fit": lambda: udd.plot.time_series(discovered.disk().fit),
    "series of a speed": lambda: udd.plot.time_series(run(), coordinates=["Omega"]),
    "series of a pendulum": lambda: udd.plot.time_series(discovered.pendulum().fit),
    "series of the DLE": lambda: udd.plot.time_series(udd.simulate(udd.DLE(1.0), 5.0, [1, 1, 0.01])),
    "orbit of a run": lambda: udd.plot.orbit(run()),
    "orbit of a measurement": lambda: udd.plot.orbit(discovered.disk().measurement),
    "orbit of a fit": lambda: udd.plot.orbit(discovered.disk().fit),
    "orbit of a pendulum": lambda: udd.plot.orbit(discovered.pendulum().fit),
    "phase space of a run": lambda: udd.plot.phase_space(run()),
    "phase space of a fit": lambda: udd.plot.phase_space(discovered.disk().fit),
    "phase space of the DLE": lambda: udd.plot.phase_space(udd.simulate(udd.DLE(1.0), 5.0, [1, 1, 0.01])),
    "friction of a model": lambda: udd.plot.friction(udd.Disk(0.039)),
    "friction of a fit": lambda: udd.plot.friction(discovered.disk().fit),
    "friction of a pendulum": lambda: udd.plot.friction(discovered.pendulum().fit),
    "residuals": lambda: udd.plot.residuals(discovered.disk().baseline),
    "residuals of a pendulum": lambda: udd.plot.residuals(discovered.pendulum().baseline),
    "residuals in time": lambda: udd.plot.residuals(discovered.disk().fit, equation="Z", against="t"),
    "residuals of an own model": lambda: udd.plot.residuals(sensors()),
    "misfit of a sensor": lambda: udd.plot.misfit(sensors(), channel="gyro"),
    "misfit": lambda: udd.plot.misfit(discovered.disk().fit),
    "misfit of the orientation": lambda: udd.plot.misfit(discovered.disk().fit, channel="beta"),
    "misfit of a pendulum": lambda: udd.plot.misfit(discovered.pendulum().fit),
    "errors": lambda: udd.plot.errors(discovered.disk()),
    "errors of nothing": lambda: udd.plot.errors(discovered.nothing()),
    "errors of a pendulum": lambda: udd.plot.errors(discovered.pendulum()),
}


@pytest.mark.parametrize("name", DRAWN)
def test_axes_come_back_with_units(name: str) -> None:
    ax = DRAWN[name]()
    assert isinstance(ax, Axes)
    assert has_units(ax), (ax.get_xlabel(), ax.get_ylabel())
    ax.figure.canvas.draw()  # what cannot be drawn shows only now


def test_given_axes_are_drawn_on() -> None:
    _, axes = plt.subplots(1, 2)
    assert udd.plot.orbit(run(), axes[1]) is axes[1]
    assert not axes[0].has_data()
    assert axes[1].has_data()
    assert len(plt.get_fignums()) == 1


def test_the_orbit_is_in_centimetres_within_its_circle() -> None:
    ax = udd.plot.orbit(run())
    y, z = ax.lines[0].get_data()
    np.testing.assert_allclose(z, 100 * run().state[:, 2])
    (circle,) = ax.patches
    assert circle.get_radius() == pytest.approx(8.0)
    assert np.hypot(y, z).max() < circle.get_radius()
    assert ax.get_aspect() == 1.0


def test_phase_space_shows_the_angular_momentum() -> None:
    trajectory = run()
    omega, y, z, _ = trajectory.state.T
    ax: Any = udd.plot.phase_space(trajectory)
    shown = ax.lines[0].get_data_3d()[0]
    # About the contact, per unit mass, with the disk's own moment of inertia R^2/2.
    np.testing.assert_allclose(shown, 1e4 * ((0.08**2 / 2 + y**2 + z**2) * omega - 0.039 * y))


def test_friction_is_the_models() -> None:
    omega = np.array([0.2, 1.0, 5.0])
    np.testing.assert_allclose(
        coefficient(udd.Disk(0.039), omega), [0.103 - 0.055 * 0.2, 0.103 - 0.055, 0.012]
    )
    drag = udd.Pendulum(0.5, k0=0.01, effects=[udd.effects.quadratic_drag(c=0.02)])
    np.testing.assert_allclose(coefficient(drag, omega), 0.01 + 0.02 * omega)


def test_a_torque_that_does_not_brake_is_no_friction() -> None:
    pushed = udd.Disk(0.039, effects=[udd.effects.constant_torque(c=0.01)])
    omega = np.linspace(0.1, 10, 20)
    np.testing.assert_allclose(coefficient(pushed, omega), coefficient(udd.Disk(0.039), omega))


def test_the_residual_of_a_right_model_has_no_pattern() -> None:
    result = discovered.disk()
    z = result.baseline.states[:-1, 2], result.baseline.defect[:, 2]
    assert pattern(*z) > 0.3  # the hidden effect: dZ/dT misses -b W Z
    null = discovered.nothing().baseline
    x, y = null.states[:-1, 2], null.defect[:, 2]
    rng = np.random.default_rng(0)
    by_chance = [pattern(rng.permutation(x), y) for _ in range(100)]
    assert abs(np.mean(by_chance)) < 0.01  # the share that chance explains is taken off


def test_evidence_stands_beside_what_chance_reaches() -> None:
    result = discovered.disk()
    ax = udd.plot.evidence(result)
    titles = [tick.get_text().replace("\n", " ") for tick in ax.get_yticklabels()]
    assert result.effects[0].title in titles
    (line,) = [x for x in ax.lines if x.get_linestyle() == "--"]
    limit = line.get_xdata()[0]
    # One amplitude, chance 1e-3 over some 20 to 1000 candidates: chi2 between 16 and 24.
    assert 15 < limit < 26
    widths = [bar.get_width() for bar in ax.patches]
    assert widths == sorted(widths, reverse=True)
    assert widths[titles.index(result.effects[0].title)] > limit
    calm = udd.plot.evidence(discovered.nothing())
    assert max(bar.get_width() for bar in calm.patches) < limit


def test_errors_show_intervals_and_the_floor() -> None:
    result = discovered.disk()
    ax = udd.plot.errors(result)
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert words == ["the known model", "with the added effect", "noise floor"]
    np.testing.assert_allclose(ax.lines[0].get_ydata(), 1e3 * result.error_before.median)
    assert ax.get_xscale() == ax.get_yscale() == "log"


def test_a_frame_with_the_disk_on_it() -> None:
    picture = np.full((70, 55, 3), 200, dtype=np.uint8)
    pixels = SimpleNamespace(
        centre=np.array([[20.0, 30.0], [np.nan, np.nan]]),
        marks=np.array([[[20.0, 20.0], [30.0, 30.0], [20.0, 40.0], [10.0, 30.0]]] * 2),
        colours=[(230, 120, 30), (60, 160, 60), (50, 90, 200), (220, 50, 50)],
        radius=14.0,
        pivot=np.array([25.0, 33.0]),
    )
    ax = udd.plot.overlay(picture, pixels, 0)
    (circle,) = ax.patches
    assert circle.center == (20.0, 30.0)
    assert circle.get_radius() == 14.0
    assert has_units(ax)
    assert ax.get_ylim()[0] > ax.get_ylim()[1]  # v points down
    assert not udd.plot.overlay(picture, pixels, 1).patches  # where it was not seen nothing is drawn
    with pytest.raises(UddError, match="no frame 2"):
        udd.plot.overlay(picture, pixels, 2)


@pytest.mark.parametrize(
    ("draw", "said"),
    [
        (lambda: udd.plot.time_series(3), "can be drawn, not int"),
        (lambda: udd.plot.time_series(run(), coordinates=["Y", "Omega"]), "share a unit"),
        (lambda: udd.plot.time_series(run(), coordinates=["theta"]), "has no theta"),
        (lambda: udd.plot.orbit(discovered.pendulum().measurement), "no angular velocity"),
        (lambda: udd.plot.phase_space(discovered.pendulum().fit), "use udd.plot.orbit"),
        (lambda: udd.plot.phase_space(discovered.disk().measurement), "no angular velocity"),
        (lambda: udd.plot.phase_space(run(), plt.figure().add_subplot()), "three-dimensional"),
        (lambda: udd.plot.friction(udd.DLE(1.0)), "not DLE"),
        (lambda: udd.plot.residuals(run()), "not Trajectory"),
        (lambda: udd.plot.residuals(discovered.disk().fit, equation="X"), "not for X"),
        (lambda: udd.plot.residuals(discovered.disk().fit, against="X"), "not X"),
        (lambda: udd.plot.misfit(discovered.disk().fit, channel="theta"), "not theta"),
        (lambda: udd.plot.evidence(discovered.disk(), stage=9), "no stage 9"),
        (lambda: udd.plot.errors(run()), "not Trajectory"),
    ],
)
def test_what_cannot_be_drawn_is_said(draw: Callable[[], Axes], said: str) -> None:
    with pytest.raises(UddError, match=said):
        draw()


def test_the_map_frames_the_cell_that_the_effect_is_in() -> None:
    """For a hidden relaxation -b W Z the known model's dZ/dT over Z is framed, and nothing after it."""
    from udd.plot.residual_map import _cells, beyond_chance
    from udd.report.loose_fit import loosest

    before, after = loosest(discovered.disk().baseline), loosest(discovered.disk().fit)
    names, places = before.model.state_names, list(fits.coordinates(before))
    cell = names.index("Z"), places.index("Z")
    n = len(names) * len(places)
    assert beyond_chance(_cells(before)[cell[0]][cell[1]], n)
    # A chance of 0.1 % over all cells, of which neighbours share their frames.
    assert sum(beyond_chance(each, n) for row in _cells(after) for each in row) == 0
    ax = udd.plot.residual_map(after, before=before)
    framed = [patch for patch in ax.patches if patch.get_linewidth() > 1.2]
    corners = {(round(p.get_x() - 0.01), round(p.get_y() - 0.02)) for p in framed}
    assert (cell[1], len(names) - 1 - cell[0]) in corners
    with pytest.raises(UddError, match="a fit leaves residuals"):
        udd.plot.residual_map(run())


@pytest.mark.parametrize("view", ["front", "side"])
def test_the_geometry_has_all_that_the_paper_names(view: str) -> None:
    ax = udd.plot.geometry(view=view)
    said = {text.get_text() for text in ax.texts}
    front = {"O", "C", "M", "R", "Y", "Z", "W", r"$\theta$", r"$\phi$", r"$\beta$", r"$\Omega > 0$"}
    assert (front if view == "front" else {"O", "W", "drive wheel", "support wheel"}) <= said


def test_the_geometry_of_a_state_puts_centre_and_mark_where_they_are() -> None:
    ax = udd.plot.geometry(state=[0.0, 0.02, -0.03, np.pi / 2], R=0.08)
    places = {text.get_text(): text.xy for text in ax.texts if hasattr(text, "xy")}
    assert places["C"] == pytest.approx((2.0, -3.0))
    # The mark sits at 0.8 radii, a quarter turn clockwise from upright: to the right of the centre.
    assert places["M"] == pytest.approx((2.0 + 6.4, -3.0))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"view": "top"}, "view"),
        ({"state": [1.0, 2.0]}, "four finite numbers"),
        ({"R": 0.0}, "R"),
    ],
)
def test_a_geometry_that_cannot_be_drawn_says_why(options: dict[str, Any], words: str) -> None:
    with pytest.raises(UddError, match=words):
        udd.plot.geometry(**options)
