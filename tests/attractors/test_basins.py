"""Basins: attractors, fractions and exponents against what is known otherwise."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.typing import NDArray

import udd
from interrupting import interrupting_progress
from udd.attractors.basin_statistics import basin_fractions, uncertainty
from udd.cli import main
from udd.errors import ModelError, UddError

xr = pytest.importorskip("xarray", reason="basins need the extra 'scale'")


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    plt.close("all")


def square(half: float, n: int) -> dict[str, NDArray[np.float64]]:
    """Initial states that are mirror images of each other, to the last bit."""
    axis = np.linspace(-half, half, n)
    return {"omega": (axis - axis[::-1]) / 2, "z": axis}


# --- fractions and their errors, on basins that are known


def disc(n: int, shift: NDArray[np.float64]) -> NDArray[np.int32]:
    """A grid on the unit square; 1 within a circle of radius 0.3."""
    x = (np.arange(n) + shift[0]) / n - 0.5
    y = (np.arange(n) + shift[1]) / n - 0.5
    return (np.hypot(x[:, None], y[None, :]) < 0.3).astype(np.int32)


def test_the_error_of_a_fraction_is_that_of_a_grid() -> None:
    rng = np.random.default_rng(3)
    results = [basin_fractions(disc(40, rng.random(2)), 2) for _ in range(300)]
    misses = np.array([share[1] - np.pi * 0.09 for share, _ in results])
    said = np.mean([error[1] for _, error in results])
    # Cell by cell on its own the scatter is that of the cells at the edge; collapsed strata of four
    # overestimate it (Cochran, Sampling Techniques, section 5A.12), here by less than 4.
    assert np.std(misses) < said < 4 * np.std(misses)
    # A sample of as many random points would have 0.0113.
    assert said < 0.3 * np.sqrt(0.09 * np.pi * (1 - 0.09 * np.pi) / 1600)


def test_where_neighbours_are_unrelated_the_error_is_binomial() -> None:
    ends = (np.random.default_rng(4).random((200, 200)) < 0.3).astype(np.int32)
    share, error = basin_fractions(ends, 2)
    assert share.sum() == 1.0
    assert error[1] == pytest.approx(np.sqrt(0.3 * 0.7 / 40000), rel=0.03)


def test_points_without_an_ending_are_left_out() -> None:
    ends = np.array([[0, 0, -1], [1, 0, -1], [-1, -1, -1]], dtype=np.int32)
    share, _ = basin_fractions(ends, 2)
    assert share.tolist() == [0.75, 0.25]
    assert np.isnan(basin_fractions(-np.ones((3, 3), dtype=np.int32), 1)[0]).all()


def test_a_smooth_boundary_has_exponent_one() -> None:
    result = uncertainty(disc(256, np.array([0.3, 0.7])))
    assert abs(result.exponent - 1.0) < 3 * result.standard_error
    assert result.standard_error < 0.1


def cantor(x: NDArray[np.float64], levels: int = 12) -> NDArray[np.int32]:
    """The middle third that is taken out at an odd step, or an even one: their boundary is Cantor's set."""
    step = np.full(x.shape, levels)
    rest = x.copy()
    for k in range(levels):
        rest = 3 * rest
        digit = np.floor(rest)
        step = np.where((step == levels) & (digit == 1), k, step)
        rest -= digit
    return (step % 2).astype(np.int32)


def test_a_fractal_boundary_has_its_exponent() -> None:
    # The dimension of Cantor's set is ln 2 / ln 3, so that of the exponent 1 - ln 2 / ln 3.
    result = uncertainty(cantor((np.arange(6561) + 0.5) / 6561))
    # The law holds in steps of three only; over the four octaves here the slope is within 0.05 of it.
    assert result.exponent == pytest.approx(1 - np.log(2) / np.log(3), abs=0.05)
    assert 0 < result.standard_error < 0.15


def test_unrelated_neighbours_have_no_exponent() -> None:
    ends = np.random.default_rng(5).integers(0, 2, (128, 128)).astype(np.int32)
    assert np.isnan(uncertainty(ends).exponent)


# --- the equations


def test_mirror_images_have_mirrored_basins() -> None:
    # omega, y -> -omega, -y is a symmetry to the last bit, and so is the grid.
    basins = udd.basins(udd.DLE(6.2), square(3, 24), state0=[0, 0, 0], n=48)
    assert basins["kind"].to_numpy().tolist() == [1, 1]
    assert basins["period"].to_numpy().tolist() == [2, 2]
    assert basins["mirror"].to_numpy().tolist() == [2, 1]
    labels = basins["attractor"].to_numpy()
    assert np.array_equal(labels[::-1], 3 - labels)
    assert basins["fraction"].to_numpy().tolist() == [0.5, 0.5]
    assert basins["attractor"].dims == ("omega", "z")


@pytest.mark.parametrize(
    ("w", "attractors"),
    [
        (7.40, [(2, True)]),
        (7.60, [(2, True), (6, False), (6, False)]),  # physics.md: several at 7.445-7.829
        (7.88, [(2, True)]),
        (5.98, [(2, False), (2, False), (3, False), (3, False)]),  # and at 5.93-6.03
        (6.10, [(2, False), (2, False)]),
    ],
)
def test_attractors_coexist_where_they_should(w: float, attractors: list[tuple[int, bool]]) -> None:
    basins = udd.basins(udd.DLE(w), square(4, 20), state0=[0, 0.5, 0], n=48, transient=200)
    own = basins["mirror"] == basins["number"]
    assert sorted(zip(basins["period"].to_numpy().tolist(), own.to_numpy().tolist(), strict=True)) == sorted(
        attractors
    )
    assert float(basins["fraction"].sum()) == pytest.approx(1.0)


def test_above_the_hopf_bifurcation_rotation_has_a_finite_basin() -> None:
    # physics.md: B = 0.2, w_H = 10/3; above it the rotation omega = y = +-sqrt(w), z = 0 is stable.
    model = udd.DLE(3.7, 0.2)
    # The chaotic set is a transient with a mean lifetime of 26800. A sixth of the 1024 orbits begin in it
    # and are followed from 400 points to 900, through 1600 time units, before it could pass for an attractor:
    # ten are expected to end meanwhile, and that none does has a probability of 3e-5.
    basins = udd.basins(model, square(3, 32), state0=[0, 1, 0], transient=300, max_extension=4)
    assert basins["kind"].to_numpy().tolist() == [0, 0]
    orbits = np.stack([basins[f"orbit_{name}"].to_numpy()[:, 0] for name in ("omega", "y", "z")], axis=1)
    expected = np.sqrt(3.7) * np.array([[1, 1, 0], [-1, -1, 0]])
    assert np.abs(np.sort(orbits, axis=0) - np.sort(expected, axis=0)).max() < 1e-3
    # No attractor, and never called one.
    endings = basins["ending"].to_numpy().tolist()
    assert endings == ["attractor 1", "attractor 2", "undecided"]
    assert 0.05 < float(basins["fraction"].sel(ending="undecided")) < 0.5


def test_below_the_hopf_bifurcation_nothing_comes_to_rest() -> None:
    result = udd.basins(udd.DLE(3.0, 0.2), {"omega": np.linspace(-2, 2, 6), "z": [-1.0, 1.0]})
    assert (result["kind"] != 0).all()


def test_the_trap_at_4_5_is_no_attractor() -> None:
    # physics.md: a window 3e-5 wide, after a chaotic transient of mean length 8200.
    result = udd.basins(udd.DLE(4.5), square(2, 8), state0=[0, 0.5, 0], max_extension=16)
    assert (result["kind"] == 1).all()
    assert float(result["fraction"].sel(ending="undecided")) > 0


def test_chaos_is_an_attractor() -> None:
    result = udd.basins(udd.DLE(1.0), square(2, 8), state0=[0, 0.5, 0])
    assert result["kind"].to_numpy().tolist() == [2]
    assert result["mirror"].to_numpy().tolist() == [1]
    assert result["fraction"].to_numpy().tolist() == [1.0]


def test_what_leaves_the_disk_is_ejected() -> None:
    axis = np.linspace(-0.09, 0.09, 13)
    model = udd.Disk(0.039)
    basins = udd.basins(model, {"Y": axis, "Z": axis}, state0=[0, 0, 0, 0], n=24, transient=24)
    names = np.array(basins["outcome"].attrs["flag_meanings"].split())[basins["outcome"].to_numpy()]
    outside = np.hypot(axis[:, None], axis[None, :]) >= model.R
    assert np.array_equal(names == "start_outside", outside)
    ejected = names == "ejected"
    # physics.md: of random starts at 3.9 cm/s about half or more leave within two minutes.
    assert ejected.sum() > 0.4 * (~outside).sum()
    share = float(basins["fraction"].sel(ending="ejected"))
    assert share == pytest.approx(ejected.sum() / (~outside).sum())
    assert (basins["Y"].attrs["units"], basins["orbit_Omega"].attrs["units"]) == ("m", "rad/s")


# --- the result as data


def test_the_threads_do_not_matter() -> None:
    grid = square(3, 12)
    one, two = (udd.basins(udd.DLE(6.2), grid, n=24, threads=k) for k in (1, 2))
    assert one.identical(two)


def test_one_component_is_enough_and_four_are_too_many() -> None:
    result = udd.basins(udd.DLE(9.0), {"z": np.linspace(-1, 1, 5)}, n=24)
    assert result["attractor"].to_numpy().tolist() == [1] * 5
    assert result.attrs["start_omega"] == 1.0
    with pytest.raises(ModelError, match="one to three components"):
        udd.basins(udd.DLE(9.0), {})


@pytest.mark.parametrize(
    ("grid", "options", "words"),
    [
        ({"Y": [1.0]}, {}, "the state has no 'Y'; it has omega, y, z"),
        ({"z": [2.0, 1.0]}, {}, "must increase"),
        ({"z": [np.nan]}, {}, "must be finite"),
        ({"z": [1.0]}, {"n": 3}, "n must be a whole number of at least 12"),
        ({"z": [1.0]}, {"max_extension": 0}, "max_extension must be a whole number of at least 1"),
        ({"z": [1.0]}, {"state0": [1.0]}, "must have the 3 components"),
    ],
)
def test_bad_input_is_named(grid: dict[str, list[float]], options: dict[str, object], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        udd.basins(udd.DLE(1.0), grid, **options)  # type: ignore[arg-type]


@pytest.mark.skipif(os.name == "nt", reason="signals to a process of its own")
def test_ctrl_c_gives_what_is_finished() -> None:
    with pytest.raises(udd.Interrupted, match="stopped by Ctrl-C") as stopped:
        udd.basins(
            udd.DLE(9.0),
            square(3, 300),
            n=24,
            transient=2000,
            threads=1,
            progress=interrupting_progress(),
        )
    partial = stopped.value.partial
    names = np.array(partial["outcome"].attrs["flag_meanings"].split())[partial["outcome"].to_numpy()]
    finished = names == "finished"
    assert 0 < finished.sum() < finished.size
    assert (finished | (names == "interrupted")).all()
    assert np.array_equal(partial["attractor"].to_numpy() > 0, finished)
    # Only what was run counts.
    assert float(partial["fraction"].sum()) == pytest.approx(1.0)
    assert partial.attrs["complete"] == 0


# --- the picture and the command


def test_the_picture_has_a_colour_for_each_ending() -> None:
    axis = np.linspace(-0.09, 0.09, 9)
    basins = udd.basins(udd.Disk(0.071), {"Y": axis, "Z": axis}, state0=[0, 0, 0, 0], n=24)
    ax = udd.plot.basins(basins)
    legend = ax.get_legend()
    assert legend is not None
    assert len(legend.get_texts()) == basins.sizes["ending"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "Y (to the right) at the start [cm]",
        "Z (up) at the start [cm]",
    )
    ax.figure.canvas.draw()
    with pytest.raises(UddError, match="no basins over two components"):
        udd.plot.basins(xr.Dataset())


def test_the_command_says_and_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data, picture = tmp_path / "out.nc", tmp_path / "out.png"
    argv = f"basins omega=-3:3:12 z=-3:3:12 --w 6.2 --points 24 --state 0,0.5,0 --out {data} --out {picture}"
    assert main([*argv.split(), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert [one["period"] for one in said["attractors"]] == [2, 2]
    assert sum(one["fraction"] for one in said["fractions"]) == pytest.approx(1.0)
    assert xr.open_dataset(data, engine="scipy")["attractor"].shape == (12, 12)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(argv.split()[:-4]) == 0
    text = capsys.readouterr().out
    assert "periodic 2, T = 4.2" in text
    assert "mirror image of" in text


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        ("basins omega=-3:3 --w 6", "NAME=FIRST:LAST:N"),
        ("basins omega=-3:3:4 omega=1:2:3 --w 6", "given twice"),
        ("basins omega=-3:3:4", "say which model"),
        ("basins omega=-3:3:0 --w 6", "at least one value"),
        ("basins omega=-3:3:9 --w 6 --out a.png", "a picture of basins needs a grid over two components"),
        ("basins omega=-3:3:9 --w 6 --points 3", "--points must be at least 12, not 3"),
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


def test_the_terminal_solves_for_the_cycles_of_attractors(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["basins", "omega=-3:3:6", "z=-3:3:6", "--w", "6.2", "--state", "0,0.5,0", "--cycles", "--json"]
    assert main(argv) == 0
    attractors = json.loads(capsys.readouterr().out)["attractors"]
    assert len(attractors) == 2
    known = udd.periodic_orbit(udd.DLE(6.2), settle=500.0)
    for one in attractors:
        cycle = one["cycle"]
        assert not cycle["symmetric"] and abs(cycle["period"] - known.period) < 1e-10
        assert 0.0 < cycle["period_error"] < 1e-11 and len(cycle["multipliers"]) == 2
