"""Bifurcation diagrams: periods, attractors and hysteresis against numbers from elsewhere."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.typing import NDArray

import udd
from interrupting import interrupting_progress
from udd.attractors.attractor import Attractor, alike
from udd.attractors.matching import AttractorMatcher, intervals
from udd.chaos.recurrence import periods, tightness
from udd.cli import main
from udd.errors import ModelError, UddError

xr = pytest.importorskip("xarray", reason="diagrams need the extra 'scale'")

Floats = NDArray[np.float64]
TIGHT = tightness(1e-12)


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    plt.close("all")


# --- what comes back, with the logistic map, whose bifurcations are known exactly


def logistic(r: float, n: int, transient: int, x: float = 0.3) -> Floats:
    """Points (n, 2) of x -> r x (1 - x), on a parabola so that they have two coordinates."""
    points = np.empty(n)
    for k in range(transient + n):
        x = r * x * (1 - x)
        if k >= transient:
            points[k - transient] = x
    return np.stack([points, points**2], axis=1)


@pytest.mark.parametrize(
    ("r", "period"),
    [(2.9, 1), (3.2, 2), (3.5, 4), (3.55, 8), (3.84, 3), (3.7, 0), (4.0, 0)],
)
def test_the_periods_of_the_logistic_map(r: float, period: int) -> None:
    assert periods(logistic(r, 120, 2000)[None], TIGHT).tolist() == [period]


@pytest.mark.parametrize("r", [3.0, 1 + np.sqrt(6)])
def test_at_a_period_doubling_the_motion_is_said_to_settle(r: float) -> None:
    # There it comes closer like 1/sqrt(steps), so that no number of points shows where to.
    assert periods(logistic(r, 120, 2000)[None], TIGHT).tolist() == [-1]


@pytest.mark.parametrize("below", [1e-3, 1e-4])
def test_a_slow_transient_is_not_taken_for_its_end(below: float) -> None:
    # Just below the doubling the multiplier is 2 - r = -(1 - below): after 200 steps a tenth of the transient
    # is left at the most, and the points still lie on two sides of the fixed point.
    r = 3.0 - below
    assert periods(logistic(r, 120, 200)[None], TIGHT).tolist() == [-1]
    long = int(25 / below)
    assert periods(logistic(r, 120, long)[None], TIGHT).tolist() == [1]


def test_an_unstable_orbit_that_is_being_left_is_no_attractor() -> None:
    # From nearly the fixed point 1 - 1/r, whose multiplier is -1.02.
    r = 3.02
    assert periods(logistic(r, 60, 0, 1 - 1 / r + 1e-6)[None], TIGHT).tolist() == [-1]
    assert periods(logistic(r, 60, 5000, 1 - 1 / r + 1e-6)[None], TIGHT).tolist() == [2]


def test_many_motions_are_told_at_once() -> None:
    drives = [2.9, 3.2, 3.5, 3.7]
    together = periods(np.stack([logistic(r, 120, 2000) for r in drives]), TIGHT)
    assert together.tolist() == [1, 2, 4, 0]


# --- which records are of one attractor


def aperiodic(points: Floats) -> Attractor:
    return Attractor("aperiodic", points, points)


def test_chaos_is_known_again_from_another_start() -> None:
    one = aperiodic(logistic(3.9, 100, 500, 0.3))
    other = aperiodic(logistic(3.9, 100, 500, 0.41))
    assert alike(one, other, TIGHT)


def test_chaos_elsewhere_is_another_attractor() -> None:
    one = logistic(3.9, 100, 500)
    assert not alike(aperiodic(one), aperiodic(one + np.array([1.2, 0.0])), TIGHT)


def test_chaos_in_two_bands_is_not_that_in_one() -> None:
    # Above 3.6785735 the bands of the logistic map are one; at 3.58 there are four narrow ones.
    one, other = aperiodic(logistic(3.58, 100, 3000)), aperiodic(logistic(3.75, 100, 3000))
    assert not alike(one, other, TIGHT)


def test_labels_follow_what_moves_little() -> None:
    def orbit(*places: float) -> Attractor:
        points = np.array(places)[:, None]
        return Attractor("periodic", points, points)

    tracks = AttractorMatcher(0.25)
    assert tracks.label([orbit(0.0, 1.0), orbit(3.0)]) == [1, 2]
    assert tracks.label([orbit(3.1), orbit(0.05, 1.05)]) == [2, 1]
    assert tracks.label([orbit(0.1, 1.0, 0.15, 1.1)]) == [1]  # doubled
    assert tracks.label([orbit(3.2), orbit(6.0)]) == [2, 3]  # one is back, one is new


def test_stretches_of_values() -> None:
    where = np.array([True, False, False, True, True, False, True])
    never, values = np.zeros(7, dtype=bool), np.arange(7.0)
    assert intervals(where, never, values).tolist() == [[0, 0], [3, 4], [6, 6]]
    assert intervals(where, np.arange(7) == 5, values).tolist() == [[0, 0], [3, 6]]
    assert intervals(where, np.arange(7) == 1, values).tolist() == [[0, 0], [3, 4], [6, 6]]
    assert intervals(never, never, values).shape == (0, 2)


# --- the equations


def grown(result: xr.Dataset, square: Floats, degree: int) -> float:
    """Where a square that grows from zero begins, by a polynomial through its values."""
    w = result["w"].to_numpy()
    # w as a function of the square: at zero it is the bifurcation.
    return float(np.polynomial.Polynomial.fit(square, w, degree)(0.0))


def test_the_period_doubles_where_it_should() -> None:
    # physics.md: the first period doubling of the asymmetric pair is at w = 5.394713224.
    w = 5.394713224 - np.array([0.16, 0.12, 0.09, 0.06, 0.04, 0.02])
    diagram = udd.bifurcation(udd.DLE(1.0), "w", w, n=60)
    assert (diagram["period"] == 4).all()
    above = udd.bifurcation(udd.DLE(1.0), "w", [5.41, 5.45], n=60)
    assert (above["period"] == 2).all()
    omega = diagram["omega"].to_numpy()[0, 0]
    square = (omega[:, -1] - omega[:, -3]) ** 2
    # A cubic in the square: what it leaves is measured by leaving out the farthest points, below 1e-5.
    assert grown(diagram, square, 3) == pytest.approx(5.394713224, abs=2e-5)


def kinds(result: Any) -> list[str]:
    names = str(result["kind"].attrs["flag_meanings"]).split()
    return [names[k] for k in result["kind"].to_numpy().ravel()]


def test_attractors_have_a_kind() -> None:
    result = udd.bifurcation(udd.DLE(1.0), "w", [1.0, 6.0, 9.0])
    assert kinds(result) == ["chaos", "cycle", "cycle"]
    # Rotation is stable from w = 10/3 on at B = 0.2; at B = 0.9 the disk comes to rest at z = 1/B.
    steady = udd.bifurcation(udd.DLE(1.0, B=0.2), "w", [3.7, 5.0], initial_states=[2.0, 2.0, 0.1])
    assert kinds(steady) == ["rotating_state"] * 2
    calm = udd.bifurcation(udd.DLE(1.0, B=0.9), "w", [5.0], initial_states=[0.0, 0.0, 0.1])
    assert kinds(calm) == ["equilibrium"]
    # From the edge of the wheels at W = 0.055 the disk leaves.
    assert kinds(udd.bifurcation(udd.Disk(0.06), "W", [0.055, 0.088])) == ["left", "cycle"]


def test_a_motion_of_two_frequencies_is_a_torus() -> None:
    model = udd.Model(
        ["x", "y", "u", "v"],
        {
            "x": "x*(1 - x^2 - y^2) - y",
            "y": "y*(1 - x^2 - y^2) + x",
            "u": "mu*u - s*v - u*(u^2 + v^2)",
            "v": "mu*v + s*u - v*(u^2 + v^2)",
        },
        {"mu": 0.2, "s": 0.3037},
    )
    result = udd.bifurcation(model, "mu", [-0.2, 0.2], initial_states=[0.5, 0.2, 0.3, 0.1])
    assert kinds(result) == ["cycle", "torus"]


def test_the_symmetry_breaks_where_it_should() -> None:
    # physics.md: w = 7.09642643066. The section points of a symmetric orbit are mirror images of each other.
    w = 7.09642643066 - np.array([0.3, 0.24, 0.18, 0.12, 0.08, 0.04])
    diagram = udd.bifurcation(udd.DLE(1.0), "w", w)
    assert (diagram["period"] == 2).all()
    assert (diagram["symmetric"] == 0).all()
    omega = diagram["omega"].to_numpy()[0, 0]
    assert grown(diagram, (omega[:, -1] + omega[:, -2]) ** 2, 3) == pytest.approx(7.09642643066, abs=2e-4)
    above = udd.bifurcation(udd.DLE(1.0), "w", [7.15, 7.2])
    assert (above["symmetric"] == 1).all()


def test_the_duration_of_periods() -> None:
    # physics.md: T at w = 0.25 (to six decimals) and at w = 10. At w = 0.25 the transient falls by
    # 0.995 from point to point; after 1000 it is below the digits given.
    result = udd.bifurcation(udd.DLE(1.0), "w", [0.25, 10.0], transient=1000)
    assert result["period_time"].to_numpy().ravel() == pytest.approx([22.737375, 3.35832224912], abs=6e-7)


def test_the_transient_near_the_symmetry_breaking_is_seen_through() -> None:
    # physics.md: at w = 7.1 transients decay with time 2250, more than 400 points take.
    short = udd.bifurcation(udd.DLE(1.0), "w", [7.1], max_extension=1)
    assert short["period"].to_numpy().ravel().tolist() == [-1]
    assert short["outcome"].attrs["flag_meanings"].split()[int(short["outcome"].squeeze())] == "undecided"
    long = udd.bifurcation(udd.DLE(1.0), "w", [7.1], max_extension=64)
    assert long["period"].to_numpy().ravel().tolist() == [2]
    assert long["symmetric"].to_numpy().ravel().tolist() == [1]
    assert float(long["period_time"].squeeze()) == pytest.approx(3.98808575286, abs=1e-5)


def second_orbit() -> Floats:
    """A state on one of the orbits that exist beside the figure-eight between w = 7.445 and 7.829."""
    axis = np.linspace(-4, 4, 10)
    basins = udd.basins(udd.DLE(7.6), {"omega": axis, "z": axis}, state0=[0, 0.5, 0], n=48)
    beside = basins["number"].to_numpy()[basins["mirror"] != basins["number"]]
    assert len(beside)
    one = basins.sel(number=beside[0]).isel(point=0)
    return np.array([float(one[f"orbit_{name}"]) for name in ("omega", "y", "z")])


def test_hysteresis_where_a_second_attractor_lives() -> None:
    # physics.md: several attractors coexist at w = 7.445-7.829 (given to the last digit shown).
    start = second_orbit()
    step = 0.01
    up = udd.bifurcation(udd.DLE(1.0), "w", np.arange(7.6, 7.9, step), path="both", initial_states=start)
    ((first, last),) = up["hysteresis_interval"].to_numpy()
    assert first == 7.6
    assert last == pytest.approx(7.829, abs=step)
    assert up["hysteresis"].sum() == round((last - first) / step) + 1
    down = udd.bifurcation(udd.DLE(1.0), "w", np.arange(7.4, 7.605, step), path="both", initial_states=start)
    ((first, last),) = down["hysteresis_interval"].to_numpy()
    assert first == pytest.approx(7.445, abs=step)
    # Both ways have the figure-eight in common, under one label.
    eight = up.sel(path="down")
    assert (eight["period"] == 2).all()
    assert len(np.unique(eight["attractor"])) == 1


def test_mirror_images_are_no_hysteresis() -> None:
    result = udd.bifurcation(udd.DLE(1.0), "w", np.linspace(6.1, 7.4, 14), path="both")
    assert result.sizes["interval"] == 0
    assert not result["hysteresis"].any()
    assert (result["period"] == 2).all()


def test_a_symmetry_that_breaks_on_the_way_down_is_not_missed() -> None:
    # The symmetric orbit persists, unstable; a state exactly on it would stay for long.
    result = udd.bifurcation(udd.DLE(1.0), "w", [6.9, 7.0, 7.05, 7.2], path="down")
    assert result["symmetric"].to_numpy().ravel().tolist() == [0, 0, 0, 1]


def test_the_disk_has_the_period_that_the_full_model_should() -> None:
    # physics.md: W = 0.071 m/s, an asymmetric pair with T = 1.384045926 s.
    result = udd.bifurcation(udd.Disk(0.07, edge="ignore"), "W", [0.071], n=60)
    assert result["symmetric"].to_numpy().ravel().tolist() == [0]
    assert float(result["period_time"].squeeze()) == pytest.approx(1.384045926, abs=1e-8)
    assert (result["Y"].attrs["units"], result["W"].attrs["units"]) == ("m", "m/s")


def test_a_disk_that_leaves_the_wheels_is_an_outcome() -> None:
    starts = [[0.0, 1e-3, 0.04, 0.0], [0.0, 0.08, 0.01, 0.0]]
    diagram = udd.bifurcation(udd.Disk(0.039), "W", [0.036, 0.039], initial_states=starts, n=40)
    names = diagram["outcome"].attrs["flag_meanings"].split()
    assert {names[k] for k in diagram["outcome"].sel(start=0).to_numpy().ravel()} == {"ejected"}
    assert {names[k] for k in diagram["outcome"].sel(start=1).to_numpy().ravel()} == {"start_outside"}
    assert (diagram["attractor"] == 0).all()


# --- the result as data


def test_the_points_follow_one_another() -> None:
    result = udd.bifurcation(udd.DLE(1.0), "w", [1.0, 3.0], n=20, transient=50, attractors=False)
    for k, w in enumerate(result["w"].to_numpy()):
        states = np.stack([result[name].to_numpy()[0, 0, k] for name in ("omega", "y", "z")], axis=1)
        assert np.abs(states[:, 2]).max() <= 1e-12
        assert (udd.DLE(w).rates(0.0, states)[:, 2] > 0).all()
        for one, following in pairwise(states):
            run = udd.simulate(udd.DLE(w), np.linspace(0, 20, 20001), one, rtol=1e-11)
            # The next upward crossing, within the samples' distance.
            crossings = np.flatnonzero((run.z[1:-1] < 0) & (run.z[2:] >= 0)) + 2
            assert np.abs(run.state[crossings[0]] - following).max() < 0.02 * max(
                1.0, np.abs(following).max()
            )


def test_the_threads_do_not_matter() -> None:
    w = np.linspace(0.5, 8, 40)
    one, two = (udd.bifurcation(udd.DLE(1.0), "w", w, n=40, path="both", threads=k) for k in (1, 2))
    assert one.identical(two)


def test_it_says_what_it_is_of() -> None:
    diagram = udd.bifurcation(udd.DLE(1.0, 0.1), "w", [2.0, 3.0], n=20, component="omega")
    assert diagram.attrs["model"] == "DLE(w=1.0, B=0.1)"
    assert (diagram.attrs["parameter"], diagram.attrs["n"], diagram.attrs["section"]) == ("w", 20, "z")
    assert diagram["omega"].dims == ("path", "start", "w", "point")
    assert "y" not in diagram
    assert {"udd_version", "rtol", "atol", "transient", "complete"} <= set(diagram.attrs)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"parameter": "W"}, "DLE has no parameter 'W'; it has w, B"),
        ({"values": [2.0, 1.0]}, "must increase"),
        ({"values": [-1.0, 1.0]}, "w must not be below 0"),
        ({"values": []}, "at least one number"),
        ({"n": 5}, "n must be a whole number of at least 12"),
        ({"transient": -1}, "transient must be a whole number of at least 0"),
        ({"path": "sideways"}, "path must be one of"),
        ({"component": "x"}, "the state has no 'x'"),
        ({"initial_states": [[1.0, 2.0]]}, "must have the 3 components"),
        ({"section": "z +"}, "section"),
        ({"section": "q"}, "section"),
        ({"section": ["z", "y"]}, "section must be one expression"),
        ({"direction": "sideways"}, 'direction must be "up", "down" or "both"'),
        ({"threads": 0}, "threads must be"),
        ({"rtol": 0.0}, "rtol must not be below"),
    ],
)
def test_bad_input_is_named(options: dict[str, object], words: str) -> None:
    given = {"parameter": "w", "values": [1.0, 2.0], **options}
    parameter, values = given.pop("parameter"), given.pop("values")
    with pytest.raises(ModelError, match=words):
        udd.bifurcation(udd.DLE(1.0), parameter, values, **given)  # type: ignore[arg-type]


def test_without_xarray_one_sentence_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(UddError, match=r"pip install 'udd\[scale\]'"):
        udd.bifurcation(udd.DLE(1.0), "w", [1.0])


@pytest.mark.skipif(os.name == "nt", reason="signals to a process of its own")
@pytest.mark.parametrize("path", ["independent", "both"])
def test_ctrl_c_gives_what_is_finished(path: str) -> None:
    with pytest.warns(udd.IncompleteWarning, match="stopped by Ctrl-C"):
        diagram = udd.bifurcation(
            udd.DLE(1.0),
            "w",
            np.linspace(0.5, 4, 5000),
            n=20,
            transient=3000,
            path=path,  # type: ignore[arg-type]
            component="y",
            threads=1,
            partial=True,
            progress=interrupting_progress(),
        )
    names = diagram["outcome"].attrs["flag_meanings"].split()
    finished = diagram["outcome"] != names.index("interrupted")
    assert 0 < int(finished.sum()) < finished.size
    assert set(np.unique(diagram["outcome"])) <= {
        names.index(n) for n in ("finished", "undecided", "interrupted")
    }
    assert np.array_equal(np.isfinite(diagram["y"].to_numpy()).all(axis=-1), finished.to_numpy())
    assert diagram.attrs["complete"] == 0


# --- the picture and the command


def test_the_picture_shows_the_points_and_the_hysteresis() -> None:
    diagram = udd.bifurcation(udd.DLE(1.0), "w", np.linspace(6, 8, 5), n=20, path="both")
    ax = udd.plot.bifurcation(diagram, component="y")
    drawn = sum(len(line.get_xdata()) for line in ax.lines)
    assert drawn == diagram["y"].size
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("w [1]", "y [1]")
    assert udd.plot.bifurcation(diagram, ax, colour="attractor") is ax
    with pytest.raises(UddError, match="has no 'Z'"):
        udd.plot.bifurcation(diagram, component="Z")
    with pytest.raises(UddError, match="no bifurcation diagram"):
        udd.plot.bifurcation(xr.Dataset())
    ax.figure.canvas.draw()


def test_the_command_writes_data_and_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data, store, picture = (tmp_path / f"out{end}" for end in (".nc", ".zarr", ".png"))
    argv = "bifurcation w --from 5.3 --to 7.5 --n 4 --points 40 --path both --json"
    assert main([*argv.split(), *(f"--out={path}" for path in (data, store, picture))]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["complete"]
    assert said["outcomes"] == {"finished": 8}
    assert [s["period"] for s in said["stretches"] if s["path"] == "up"] == [4, 2, 2]
    kept = xr.open_dataset(data, engine="scipy").load()
    assert kept["period"].to_numpy()[0, 0].tolist() == [4, 2, 2, 2]
    assert np.array_equal(xr.open_zarr(store, consolidated=False)["omega"], kept["omega"])
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.nc", "out.png", "out.zarr"]


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        ("bifurcation w --from 1 --to 2 --out a.txt", "the name must end in"),
        ("bifurcation w --from 1 --to 2 --out no/such/a.nc", "there is no folder"),
        ("bifurcation B --from 0 --to 0.2", "say which model"),
        ("bifurcation R --from 1 --to 2 --w 1", "DLE has no parameter 'R'"),
        ("bifurcation w --from 1 --to nan", "must be finite"),
        ("bifurcation w --from 2 --to 1", "must increase"),
        ("bifurcation w --from 1 --to 2 --component Q", "the state has no component 'Q'"),
        ("bifurcation w --from 1 --to 2 --transient -1", "--transient must be at least 0, not -1"),
    ],
)
def test_the_command_refuses_in_one_sentence(
    argv: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(argv.split()) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert words in err
    assert len(err.splitlines()) == 1


@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_the_command_keeps_what_is_finished_on_ctrl_c(tmp_path: Path) -> None:
    path = tmp_path / "part.nc"
    argv = f"-m udd bifurcation w --from 0.5 --to 4 --points 20 --transient 4000 --out {path} --json --n"
    began = time.monotonic()
    subprocess.run([sys.executable, *argv.split(), "8"], check=True, capture_output=True)
    short = time.monotonic() - began  # most of it for the imports
    process = subprocess.Popen(
        [sys.executable, *argv.split(), "20000"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(2 * short)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 130, err
    assert "stopped by Ctrl-C" in err
    said = json.loads(out)
    assert not said["complete"]
    assert 0 < said["outcomes"]["finished"] < 20000
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert xr.open_dataset(path, engine="scipy").sizes["w"] == 20000
