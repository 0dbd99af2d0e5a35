"""Sections against SciPy's events, closed orbits known from elsewhere, and what must not be asked."""

from __future__ import annotations

import json
import signal
import threading
from pathlib import Path
from types import FrameType

import numpy as np
import pytest
from matplotlib.axes import Axes
from scipy.integrate import solve_ivp

import udd
from udd.cli import main
from udd.errors import IncompleteWarning, ModelError

W = 3.4693


def dle(t: float, x: np.ndarray, w: float) -> list[float]:
    return [x[1] - x[0], x[0] * x[2], w - x[0] * x[1]]


def events(function: object, direction: float, end: float, w: float = W) -> tuple[np.ndarray, np.ndarray]:
    """Times and states of an event by SciPy's DOP853."""
    function.direction = direction  # type: ignore[attr-defined]
    run = solve_ivp(dle, (0, end), [1, 1, 0.01], "DOP853", args=(w,), events=function, rtol=3e-14, atol=1e-15)
    after = run.t_events[0] > 0  # a start on the surface is no crossing
    return run.t_events[0][after], run.y_events[0][after]


SURFACES = {
    "z": (lambda t, x, w: x[2], "z = 0"),
    "difference": (lambda t, x, w: x[0] - x[1], "omega = y"),
    "maximum": (lambda t, x, w: w - x[0] * x[1], "z'"),
    "circle": (lambda t, x, w: np.hypot(x[1], x[2]) - 2, "sqrt(y^2 + z^2) - 2"),
    "clock": (lambda t, x, w: np.sin(2 * t), "sin(2*t)"),
    "parameter": (lambda t, x, w: x[1] ** 2 - w, "y^2 = w"),
}


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize(("sign", "direction"), [(1, "up"), (-1, "down")])
def test_points_are_those_of_scipy(name: str, sign: int, direction: str) -> None:
    function, text = SURFACES[name]
    t, x = events(function, sign, 20.0)
    with pytest.warns(IncompleteWarning, match="time ran out"):
        section = udd.poincare(
            udd.DLE(W), text, 1000, direction=direction, transient=0, t_max=20.0, rtol=1e-13, atol=1e-15
        )
    assert section.found == len(t) >= 3
    # Over 20 units of time errors grow by exp(0.31 * 20) = 500, SciPy's from 1e-13 per step.
    np.testing.assert_allclose(section.t, t, atol=1e-9)
    np.testing.assert_allclose(section.state, x, atol=1e-8)
    residual = [abs(function(*point, W)) for point in zip(section.t, section.state, strict=True)]
    assert max(residual) <= 1e-12
    assert section.residual <= 1e-12


def test_the_periods_of_closed_orbits() -> None:
    # Half the symmetric orbit's period from one upward crossing of z = 0 to the next.
    result = udd.poincare(udd.DLE(10.0), n=50, transient=2000)
    np.testing.assert_allclose(result.return_times, 3.35832224912 / 2, atol=1e-9)
    # The asymmetric pair of the full model at W = 0.071.
    disk = udd.poincare(udd.Disk(0.071, edge="ignore"), n=40, transient=2000)
    y = disk.component("Y")
    period = next(p for p in range(1, 9) if abs(y[p:] - y[:-p]).max() < 1e-8)
    np.testing.assert_allclose(disk.t[period:] - disk.t[:-period], 1.384045926, atol=1e-9)


def test_reversals_at_zero_drive() -> None:
    # A swing about the contact: R0 = 0.058 m, 127 degrees from upright; |Y| shrinks from turn to turn.
    angle = np.deg2rad(127)
    start = [0.0, 0.058 * np.sin(angle), 0.058 * np.cos(angle), 0.0]
    section = udd.poincare(udd.Disk(0.0), "reversal", 6, state0=start, transient=0)
    expected = [0.353385, 0.699102, 1.041013, 1.381645, 1.725801, 2.198271]
    np.testing.assert_allclose(section.t, expected, atol=1e-6)
    heights = [-0.0355556, 0.0264675, -0.0191920, 0.0131979, -0.0051802, 0.000173]
    np.testing.assert_allclose(section.component("Y"), heights, atol=5e-7)
    # Z keeps its sign, so that Y turns where the disk does.
    turning = udd.poincare(udd.Disk(0.0), "turning points of Y", 6, state0=start, transient=0)
    np.testing.assert_allclose(turning.t, section.t, atol=1e-12)


def test_a_chaotic_section_is_symmetric() -> None:
    section = udd.poincare(udd.DLE(1.0), n=20_000)
    assert section.residual <= 1e-12
    assert (1.0 - section.component("omega") * section.component("y") > 0).all()  # z' > 0
    for name in ("omega", "y"):
        means = section.component(name).reshape(100, 200).mean(axis=1)
        assert abs(means.mean()) < 4 * means.std(ddof=1) / 10
    # (omega, y) and (-omega, -y): the squares' means of both halves agree.
    squares = (section.component("y") ** 2 * np.sign(section.component("y"))).reshape(100, 200).mean(axis=1)
    assert abs(squares.mean()) < 4 * squares.std(ddof=1) / 10


def test_named_surfaces() -> None:
    model = udd.DLE(1.0)
    maxima = udd.poincare(model, "maxima of z", 200)
    omega, y, z = np.moveaxis(maxima.state, -1, 0)
    np.testing.assert_allclose(omega * y, 1.0, atol=1e-12)
    assert (-(y - omega) * y - omega**2 * z < 0).all()  # z'' < 0
    assert maxima.direction == ("down",)
    minima = udd.poincare(model, "minima of z", 200)
    turning = udd.poincare(model, "turning points of z", 400)
    assert minima.direction == ("up",)
    assert set(minima.t[:150]) | set(maxima.t[:150]) >= set(turning.t[100:200])
    assert (udd.poincare(model, "reversal", 20).component("omega") ** 2 < 1e-24).all()


def test_several_surfaces_at_once() -> None:
    model = udd.DLE(1.0)
    both = udd.poincare(model, ["z", "omega = y"], 300, direction=["up", "both"], transient=0)
    assert (np.diff(both.t) >= 0).all()
    up = udd.poincare(model, "z", 50, transient=0)
    np.testing.assert_array_equal(both.of(0).t[:50], up.t)
    assert both.of(0).found + both.of(1).found == both.found == 300
    with pytest.raises(ModelError, match=r"choose one of 2 by .of"):
        _ = both.return_times
    with pytest.raises(ModelError, match="there are 2 surfaces"):
        both.of(2)


def test_many_orbits_are_the_same_as_one_by_one() -> None:
    w = np.linspace(0.5, 9.5, 6)
    starts = np.array([[1.0, 1.0, 0.01], [-0.5, 2.0, 1.0]])
    model = udd.DLE(1.0)
    many = udd.poincare(model, n=30, parameters={"w": w[:, None]}, state0=starts, transient=5, threads=2)
    assert many.t.shape == (6, 2, 30)
    assert many.state.shape == (6, 2, 30, 3)
    assert (many.outcome == "finished").all()
    for i, j in np.ndindex(6, 2):
        one = udd.poincare(udd.DLE(w[i]), n=30, state0=starts[j], transient=5, threads=1)
        np.testing.assert_array_equal(one.t, many.t[i, j])
        np.testing.assert_array_equal(one.state, many.state[i, j])
        np.testing.assert_array_equal(one.end, one.state[-1])


def test_orbits_without_enough_crossings_say_why() -> None:
    starts = [[0.0, 0.0, -1.0], [1.0, 1.0, 0.01]]
    with pytest.warns(IncompleteWarning, match="1 of 2 orbits have fewer than 5 crossings: escaped 1"):
        section = udd.poincare(udd.DLE(1.0), n=5, state0=starts, transient=0, t_max=1e8)
    assert section.outcome.tolist() == ["escaped", "finished"]
    assert section.found.tolist() == [1, 5]
    assert section.t[0, 0] == 1.0  # the z-axis: z = -1 + t
    assert np.isnan(section.t[0, 1:]).all()
    assert (section.which[0, 1:] == -1).all()
    with pytest.warns(IncompleteWarning, match="the orbit has 0 crossings instead of 9: ejected"):
        off = udd.poincare(udd.Disk(0.05), n=9, state0=[0.0, 0.0, 0.0799, 0.0], transient=0)
    assert (off.found, off.outcome) == (0, "ejected")
    # To 1e-12 of the largest Y^2 + Z^2 in the step, a long one as the motion is uniform.
    assert abs(np.hypot(off.end[1], off.end[2]) - 0.08) < 1e-9


def test_maps() -> None:
    result = udd.poincare(udd.DLE(1.0), n=600)
    x, following = result.return_map("y")
    np.testing.assert_array_equal(x[1:], following[:-1])
    height, next_height = result.cusp_map()
    assert height.shape == next_height.shape == (599,)
    # The flow contracts so fast that one height nearly fixes the next: neighbours have near images.
    order = np.argsort(height)
    close = np.diff(height[order]) < 2e-3
    jumps = np.abs(np.diff(next_height[order]))[close]
    assert close.sum() > 100
    assert np.median(jumps) < 0.02 * np.ptp(next_height)


def test_friction_that_sticks_has_sections() -> None:
    swing = udd.Pendulum(0.25, k0=1e-4)
    plain = udd.poincare(swing, n=20, state0=[0.0, 1.0], transient=0)
    speeds = plain.component("Omega")
    assert (speeds[1:] < speeds[:-1]).all()
    dry = udd.Pendulum(0.25, effects=[udd.effects.coulomb(c=0.1, treatment="set-valued")])
    with pytest.warns(IncompleteWarning, match="time ran out"):
        section = udd.poincare(dry, n=100, state0=[0.0, 1.0], transient=0, t_max=60.0)
    run = udd.simulate(dry, [0.0, *section.t], [0.0, 1.0], rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(run.state[1:], section.state, atol=1e-7)
    # It stops and sticks: no crossing follows.
    rest = udd.simulate(dry, 60.0, [0.0, 1.0])
    assert rest.events.kind[-1] == "stick"
    assert 1 < section.found < 20
    assert section.t[-1] < rest.events.t[-1]
    np.testing.assert_allclose(section.end, rest.state[-1], atol=1e-6)
    lugre = udd.Pendulum(0.25, effects=[udd.effects.coulomb(c=0.1, treatment="lugre")])
    with pytest.raises(ModelError, match="lugre"):
        udd.poincare(lugre)


def test_ctrl_c_keeps_what_is_found() -> None:
    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, stop)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.5)
        with pytest.raises(udd.Interrupted, match="interrupted") as stopped:
            udd.poincare(udd.DLE(1.0), n=10_000_000, threads=1)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert threading.active_count() >= 1
    partial = stopped.value.partial
    assert 0 < partial.found < 10_000_000
    assert partial.outcome == "interrupted"
    assert partial.t.shape == (partial.found,)


BAD = {
    "unknown": (
        {"section": "q - 1"},
        'the section "q - 1" has the unknown name q; allowed are the state omega, y, z',
    ),
    "code": ({"section": "__import__('os')"}, "unknown name __import__"),
    "constant": ({"section": "w - 1"}, "never changes"),
    "empty": ({"section": ""}, "is empty"),
    "no list": ({"section": []}, "section must be an expression"),
    "number": ({"section": 3}, "section must be an expression"),
    "direction": ({"direction": "sideways"}, 'direction must be "up", "down" or "both"'),
    "directions": ({"direction": ["up", "down"]}, "1 sections but 2 directions"),
    "implied": ({"section": "maxima of z", "direction": "up"}, "say the direction themselves"),
    "component": ({"section": "maxima of Z"}, "the state has no component 'Z'"),
    "none": ({"n": 0}, "n must be a whole number of at least 1"),
    "fraction": ({"n": 2.5}, "n must be a whole number"),
    "transient": ({"transient": -1}, "transient must be a whole number of at least 0"),
    "time": ({"t_max": 0}, "t_max must be above 0"),
    "state": ({"state0": [1.0, 2.0]}, "state0 must have the 3 components"),
    "infinite": ({"state0": [1.0, 2.0, np.inf]}, "state0 must be finite"),
    "parameter": ({"parameters": {"W": [1.0]}}, "has no parameter 'W'"),
    "shapes": ({"parameters": {"w": [1.0, 2.0], "B": [0.1, 0.2, 0.3]}}, "do not fit together"),
    "nothing": ({"parameters": {"w": []}}, "there is no orbit to follow"),
    "threads": ({"threads": 0}, "threads must be a whole number from 1"),
    "tolerance": ({"rtol": 0.0}, "rtol must not be below"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_sentence(name: str) -> None:
    options, message = BAD[name]
    with pytest.raises(ModelError) as error:
        udd.poincare(udd.DLE(1.0), **options)  # type: ignore[arg-type]
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_no_model_and_no_room() -> None:
    with pytest.raises(ModelError, match="a model is needed"):
        udd.poincare(1.0)  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="off the wheels"):
        udd.poincare(udd.Disk(0.05), state0=[0.0, 0.0, 0.09, 0.0])
    with pytest.raises(MemoryError):
        udd.poincare(udd.DLE(1.0), n=10**17)


def test_pictures() -> None:
    section = udd.poincare(udd.DLE(1.0), n=200)
    ax = udd.plot.poincare(section)
    assert isinstance(ax, Axes)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("ω [1]", "y [1]")
    assert len(ax.lines[0].get_xdata()) == 200
    ax = udd.plot.return_map(udd.poincare(udd.DLE(1.0), "maxima of z", 200))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("z [1]", "next z [1]")
    disk = udd.poincare(udd.Disk(0.014), ["Z", "Omega"], 60)
    ax = udd.plot.poincare(disk)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("angular velocity Ω [rad/s]", "Y (to the right) [cm]")
    swing = udd.poincare(udd.Pendulum(0.25, k0=1e-4), n=20, transient=0)
    assert udd.plot.poincare(swing).get_xlabel() == "time T [s]"
    with pytest.raises(udd.UddError, match="this is no section"):
        udd.plot.poincare(3)  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="the state has no component 'Z'"):
        udd.plot.return_map(section, component="Z")


def test_the_command(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    picture = tmp_path / "section.png"
    given = ["poincare", "--w", "1", "--points", "25", "--transient", "3"]
    assert main([*given, "--json", "--picture", str(picture)]) == 0
    data = json.loads(capsys.readouterr().out)
    expected = udd.poincare(udd.DLE(1.0), n=25, transient=3)
    assert data["state"] == expected.state.tolist()
    assert data["outcome"] == "finished"
    assert data["residual"] <= 1e-12
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert main([*given, "--section", "maxima of z"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "t,omega,y,z"
    assert len(lines) == 26
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    np.testing.assert_allclose(table[:, 1] * table[:, 2], 1.0, atol=1e-12)
    out = tmp_path / "points.csv"
    assert main([*given, "--section", "z", "--section", "reversal", "--out", str(out)]) == 0
    assert out.read_text().splitlines()[0] == "t,omega,y,z,section"
    capsys.readouterr()
    for wrong, message in (
        (["poincare"], "say which model"),
        (["poincare", "--w", "1", "--section", "q"], "unknown name q"),
        (["poincare", "--w", "1", "--picture", "here.gif"], "the name must end in"),
        (["poincare", "--w", "1", "--points", "0"], "--points must be at least 1, not 0"),
        (["poincare", "--w", "1", "--map", "a.png", "--component", "Q"], "no component 'Q'"),
        (
            [*["poincare", "--w", "1", "--section", "z", "--section", "y", "--map", "a.png"]],
            "--map takes one --section",
        ),
    ):
        assert main(wrong) == 1
        assert message in capsys.readouterr().err


def test_an_equation_is_shown_as_it_was_written() -> None:
    assert repr(udd.poincare(udd.DLE(3.0), "z = 0.5", 3)).startswith("<Section z = 0.5 (up) of DLE")
