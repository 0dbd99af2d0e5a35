"""Films seen from outside: decoded pictures against the trajectory, with none of the drawing code."""

from __future__ import annotations

import os
import stat
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.ndimage import map_coordinates

from udd.errors import UddError
from udd.film import render

av = pytest.importorskip("av", reason="films need the extra 'track'")
pytest.importorskip("cv2", reason="films need the extra 'track'")

SCALE, PIVOT, R = 1750.0, (275.0, 330.0), 0.08
COLOURS = ("red", "orange", "blue", "green")  # clockwise
# No codec loss, no noise, no support, nothing behind: what is left is the drawing itself.
BARE: dict[str, Any] = {"noise": 0.0, "quality": 0.0, "support": 0.0, "background": (0, 0, 0)}


class Run(NamedTuple):
    t: NDArray[np.float64]
    state: NDArray[np.float64]
    model: Any = None


class Plain:
    """The paper's model, written down here once more (physics.md): what `udd.Disk` should be."""

    R = R

    def __init__(self, W: float) -> None:
        self.W = W

    def rates(self, t: Any, state: NDArray[np.float64]) -> NDArray[np.float64]:
        omega, y, z, _ = np.moveaxis(state, -1, 0)
        k = np.maximum(0.103 - 0.055 * np.abs(omega), 0.012)
        torque = 9.81 * y - (k + self.W * z) * omega
        rates = [torque / (R**2 / 2 + y**2 + z**2), z * omega, self.W - y * omega, omega]
        return np.stack(rates, axis=-1)


def plain_run(seconds: float, rate: float = 200.0) -> Run:
    """From near the top, so that within 1.5 s the disk falls through at more than 10 rad/s."""
    model = Plain(0.039)
    t = np.arange(round(seconds * rate) + 1) / rate
    start = [1.0, 0.012, 0.05, 0.4]
    solution = solve_ivp(
        model.rates, (0, t[-1]), start, t_eval=t, rtol=1e-10, atol=1e-12, method="DOP853", max_step=0.01
    )
    return Run(t, solution.y.T)


def uniform(omega: float = 0.0, speed: float = 0.0, beta: float = 0.0, seconds: float = 0.3) -> Run:
    """A disk that turns, or moves sideways, uniformly; at t = 0.12 its centre is at (0, -4 cm)."""
    t = np.linspace(0, seconds, 61)
    y = speed * (t - 0.12)
    return Run(t, np.stack([np.full_like(t, omega), y, np.full_like(t, -0.04), beta + omega * (t - 0.12)], 1))


def decode(path: Path) -> tuple[NDArray[np.uint8], list[Fraction]]:
    """All pictures (n, height, width, 3) and their time stamps."""
    with av.open(str(path)) as container:
        frames = list(container.decode(video=0))
        return (
            np.stack([f.to_ndarray(format="rgb24") for f in frames]),
            [f.pts * Fraction(f.time_base) for f in frames],
        )


def luma(path: Path) -> NDArray[np.float64]:
    """The brightness planes (n, height, width), which the codec keeps at full resolution."""
    with av.open(str(path)) as container:
        return np.stack([f.to_ndarray()[: f.height].astype(float) for f in container.decode(video=0)])


def linear(codes: NDArray[Any]) -> NDArray[np.float64]:
    v = np.asarray(codes, dtype=float) / 255
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def place(y: float, z: float, tilt: float = 0.0) -> NDArray[np.float64]:
    """Pixel of a point of the laboratory, turned clockwise about the pivot by tilt."""
    turn = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]])
    return np.asarray(np.array(PIVOT) + turn @ np.array([y, -z]) * SCALE)


def marks(state: NDArray[np.float64], tilt: float = 0.0) -> list[NDArray[np.float64]]:
    _, y, z, beta = state
    angles = beta + np.arange(4) * np.pi / 2
    return [place(y + 0.065 * np.sin(a), z + 0.065 * np.cos(a), tilt) for a in angles]


def centroid(plane: NDArray[np.float64], expected: NDArray[np.float64], paper: float) -> NDArray[np.float64]:
    """Centre of what is darker than the disk within 23 pixels: a mark's corner is 19.8 away, the rim 26."""
    left, top = (expected - 26).astype(int)
    plane = plane[top : top + 53, left : left + 53]
    y, x = np.indices(plane.shape) + np.array([top, left])[:, None, None]
    weight = np.where(np.hypot(x - expected[0], y - expected[1]) < 23, paper - plane, 0.0)
    return np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()


def colour_name(rgb: NDArray[np.float64]) -> str:
    r, g, b = rgb
    if b > r and b > g:
        return "blue"
    if g > r:
        return "green"
    return "orange" if g > 2 * b else "red"


@pytest.mark.parametrize("tilt", [0.0, 0.1])
def test_marks_are_where_the_trajectory_says(tmp_path: Path, tilt: float) -> None:
    # A millisecond of exposure: at 2 m/s a streak of 3.5 pixels, whose centroid differs from the place at
    # mid-exposure by the curvature alone, Omega^2 r T^2 / 24 < 0.01 pixels.
    film = render(plain_run(1.5), tmp_path / "run.mp4", exposure=1e-3, tilt=tilt, **BARE)
    pictures, planes = decode(film.path)[0], luma(film.path)
    assert np.abs(film.state[:, 0]).max() > 10  # else the test would not see fast motion
    off = []
    for picture, plane, state in zip(pictures, planes, film.state, strict=True):
        centre = place(state[1], state[2], tilt).round().astype(int)
        paper = plane[centre[1], centre[0]]
        for name, expected in zip(COLOURS, marks(state, tilt), strict=True):
            off.append(centroid(plane, expected, paper) - expected)
            x, y = expected.round().astype(int)
            assert colour_name(picture[y - 3 : y + 4, x - 3 : x + 4].mean((0, 1))) == name
    # Rounding to 8 bits and to the grid of the warp (1/64 pixel) leaves 0.009 at most over some 140 marks.
    assert np.abs(off).max() < 0.03
    assert np.abs(np.mean(off, axis=0)).max() < 0.003


def test_the_disk_has_its_radius_and_its_centre(tmp_path: Path) -> None:
    film = render(uniform(), tmp_path / "still.mp4", exposure=1e-3, **BARE)
    picture = decode(film.path)[0][0]
    light = linear(picture[..., 1])
    # The marks lie inside: fill them by what is left of the disk's largest light.
    disk = light / light.max()
    y, x = np.indices(disk.shape)
    inside = np.hypot(x - PIVOT[0], y - PIVOT[1] - 70) < 135
    disk = np.where(inside, 1.0, disk)
    assert np.sqrt(disk.sum() / np.pi) == pytest.approx(R * SCALE, abs=0.05)
    assert (disk * x).sum() / disk.sum() == pytest.approx(PIVOT[0], abs=0.02)
    assert (disk * y).sum() / disk.sum() == pytest.approx(PIVOT[1] + 0.04 * SCALE, abs=0.02)


def test_a_moving_edge_is_smeared_by_exposure_times_speed(tmp_path: Path) -> None:
    # The slope of the light across an edge is a box of width v T, blurred by the lens: a variance of
    # (v T)^2 / 12 comes to that of the lens.
    def spread(speed: float) -> float:
        run = uniform(speed=speed, beta=np.pi / 4)  # the marks lie on the diagonals, none on this row
        film = render(run, tmp_path / f"{speed}.mp4", exposure=0.020, **BARE)
        row = linear(decode(film.path)[0][3][400, 275 + 80 : 275 + 200, 1])  # mid-exposure at 0.12 s
        slope = -np.diff(row)
        x = np.arange(slope.size)
        mean = (slope * x).sum() / slope.sum()
        assert mean + 0.5 + 275 + 80 == pytest.approx(275 + R * SCALE, abs=0.1)
        return float((slope * (x - mean) ** 2).sum() / slope.sum())

    length = np.sqrt(12 * (spread(1.0) - spread(0.0)))
    assert length == pytest.approx(0.020 * 1.0 * SCALE, rel=0.01)  # 35 pixels; 8-bit codes leave some 0.1


def test_a_turning_mark_is_smeared_by_exposure_times_rotation(tmp_path: Path) -> None:
    def spread(omega: float) -> tuple[float, float]:
        film = render(uniform(omega=omega, beta=0.3), tmp_path / f"{omega}.mp4", exposure=0.020, **BARE)
        light = linear(
            decode(film.path)[0][3][..., 1]
        )  # green light: red, the mark looked at, has almost none
        angle = np.linspace(-0.7, 0.7, 1401)
        x = PIVOT[0] + 0.065 * SCALE * np.sin(0.3 + angle)
        y = PIVOT[1] + 0.04 * SCALE - 0.065 * SCALE * np.cos(0.3 + angle)
        ring = map_coordinates(light, [y, x], order=1)
        cover = 1 - ring / ring[0]
        mean = (cover * angle).sum() / cover.sum()
        return mean, float((cover * (angle - mean) ** 2).sum() / cover.sum())

    (mean, fast), (_, slow) = spread(20.0), spread(0.0)
    assert mean == pytest.approx(0.0, abs=1e-3)  # the streak is centred on mid-exposure
    # The codec halves the colours' resolution and its matrix rounds: some per cent of the faint ends.
    assert np.sqrt(12 * (fast - slow)) == pytest.approx(20.0 * 0.020, rel=0.02)


@pytest.mark.parametrize(("fps", "stamp"), [(25.0, Fraction(1, 25)), (30000 / 1001, Fraction(1001, 30000))])
def test_frames_have_exact_time_stamps(tmp_path: Path, fps: float, stamp: Fraction) -> None:
    film = render(plain_run(1.0), tmp_path / "run.mp4", fps=fps, size=(220, 280), exposure=0.004)
    pictures, stamps = decode(film.path)
    # The last exposure must end within the run of 1 s: the frame at 1 s itself would not.
    n = int((1 - 0.002) // float(stamp)) + 1
    assert pictures.shape == (n, 280, 220, 3)
    assert stamps == [k * stamp for k in range(n)]
    assert film.t == pytest.approx([float(s) for s in stamps], abs=1e-12)
    assert film.size == (220, 280)
    assert film.scale == pytest.approx(SCALE * 0.4)


def test_truth_is_the_state_in_the_middle_of_the_exposure(tmp_path: Path) -> None:
    run = plain_run(1.0)
    film = render(run, tmp_path / "run.mp4", size=(110, 140))
    assert film.state == pytest.approx(
        run.state[:: 200 // 25][: len(film.t)], abs=1e-12
    )  # 25/s fall on samples
    truth = film.truth
    assert truth.kind == "disk"
    assert np.array_equal(truth["beta"], film.state[:, 3])
    assert truth.meta["R"] == R


def test_a_run_that_starts_late_is_filmed_from_its_start(tmp_path: Path) -> None:
    run = plain_run(0.5)
    early = render(run, tmp_path / "early.mp4", size=(110, 140))
    late = render(Run(run.t + 100.0, run.state), tmp_path / "late.mp4", size=(110, 140))
    assert np.array_equal(early.t, late.t)
    assert late.state == pytest.approx(early.state, abs=1e-9)  # t + 100 is rounded to 1e-14 s


def test_the_rates_of_a_model_bridge_wider_gaps(tmp_path: Path) -> None:
    fine = plain_run(1.5)
    coarse = Run(fine.t[::8], fine.state[::8], Plain(0.039))  # 25 per second
    film = render(coarse, tmp_path / "run.mp4", size=(110, 140), fps=100, exposure=0.002)
    assert film.state[:, 1:3] == pytest.approx(fine.state[::2][: len(film.t), 1:3], abs=1.5e-4)  # 0.25 pixels
    with pytest.raises(UddError, match="too far apart"):
        render(Run(coarse.t[::3], coarse.state[::3]), tmp_path / "coarse.mp4")


def test_dense_output_bridges_any_gap(tmp_path: Path) -> None:
    fine = plain_run(1.5)
    curve = CubicSpline(fine.t, fine.state)

    class Dense(NamedTuple):
        t: NDArray[np.float64]
        state: NDArray[np.float64]

        def __call__(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
            if t.min() < 0 or t.max() > self.t[-1]:
                raise UddError("outside the run")  # the shutter opens before it: render must not ask for that
            return np.asarray(curve(t))

    run = Dense(fine.t[[0, -1]], fine.state[[0, -1]])
    film = render(run, tmp_path / "run.mp4", size=(110, 140))
    assert film.state == pytest.approx(fine.state[::8][: len(film.t)], abs=1e-12)


def test_the_same_seed_gives_the_same_film(tmp_path: Path) -> None:
    run = plain_run(0.3)
    films = [render(run, tmp_path / f"{i}.mp4", rng=seed).path for i, seed in enumerate((1, 1, 2))]
    assert films[0].read_bytes() == films[1].read_bytes()
    first, _, other = (decode(path)[0] for path in films)
    assert (first != other).mean() > 0.1


def test_noise_has_its_size(tmp_path: Path) -> None:
    kept: dict[str, Any] = {**BARE, "background": (128, 128, 128), "noise": 4.0}
    planes = luma(render(uniform(), tmp_path / "noise.mp4", **kept).path)
    corner = planes[:, :100, :100]  # wall only
    # Three independent colours, weighted as in ITU-R BT.601's luma, whose codes span 219 of 255; rounding
    # adds 1/12.
    expected = np.sqrt((4.0 * 219 / 255) ** 2 * (0.299**2 + 0.587**2 + 0.114**2) + 1 / 12)
    assert corner.std() == pytest.approx(
        expected, rel=0.02
    )  # 7e4 pixels: 0.3 %, and the colours' own rounding
    neighbours = np.corrcoef(corner[:, :, 1:].ravel(), corner[:, :, :-1].ravel())[0, 1]
    assert abs(neighbours) < 0.02  # independent from pixel to pixel
    following = np.corrcoef(corner[1:].ravel(), corner[:-1].ravel())[0, 1]
    assert abs(following) < 0.02  # and from frame to frame


def test_the_support_hides_the_middle_and_now_and_then_a_mark(tmp_path: Path) -> None:
    film = render(plain_run(1.5), tmp_path / "run.mp4", noise=0.0, quality=5.0)
    hidden = np.zeros(len(film.t), dtype=int)
    for i, (picture, state) in enumerate(zip(decode(film.path)[0], film.state, strict=True)):
        x, y = int(PIVOT[0]), int(PIVOT[1])
        assert picture[y, x].max() < 60  # the wheel
        for px, py in np.round(marks(state)).astype(int):
            hidden[i] += picture[py, px].max() < 60
    assert set(hidden) == {
        0,
        1,
        2,
    }  # two when the disk and two marks stand upright before the pillar, never three
    assert np.mean(hidden < 2) > 0.7


def test_an_own_background_stands_behind(tmp_path: Path) -> None:
    picture = np.zeros((280, 220, 3))
    picture[:, :110] = (200, 40, 40)
    film = render(uniform(), tmp_path / "own.mp4", size=(220, 280), background=picture, noise=0.0)
    shown = decode(film.path)[0][0]
    assert colour_name(shown[5, 5]) == "red"
    assert shown[5, 215].max() < 20


def test_a_film_beside_the_independent_one_shows_the_same_motion(tmp_path: Path, shared: Path) -> None:
    table = np.genfromtxt(shared / "video" / "plain.truth.csv", delimiter=",", names=True, usecols=range(6))
    state = np.stack([table[name] for name in ("Omega", "Y", "Z", "beta")], axis=1)[:150]
    film = render(Run(table["time"][:150], state, Plain(0.039)), tmp_path / "plain.mp4")
    ours = decode(film.path)[0]
    with av.open(str(shared / "video" / "plain.mp4")) as container:
        frames = container.decode(video=0)
        theirs = [next(frames).to_ndarray(format="rgb24") for _ in range(len(ours))]

    def blob(picture: NDArray[np.uint8], near: NDArray[np.float64]) -> NDArray[np.float64]:
        """Centre of the colourful (not grey) pixels near a mark."""
        left, top = (near - 30).astype(int)
        picture = picture[top : top + 60, left : left + 60]
        y, x = np.indices(picture.shape[:2]) + np.array([top, left])[:, None, None]
        colour = picture.max(-1).astype(float) - picture.min(-1)
        weight = np.where(np.hypot(x - near[0], y - near[1]) < 26, np.maximum(colour - 60, 0), 0.0)
        return np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()

    gap = []
    for mine, other, at in zip(ours, theirs, film.state, strict=True):
        for mark in marks(at):
            if abs(mark[0] - PIVOT[0]) > 60 and mark[1] < 580:  # clear of support and table
                gap.append(blob(mine, mark) - blob(other, mark))
    gaps = np.array(gap)
    assert len(gaps) > 300
    # The two cameras' pivots differ by a pixel or two; after that the marks agree, in motion and at rest.
    assert np.abs(gaps.mean(0)).max() < 3
    assert gaps.std(0).max() < 0.25


def refused(path: Path, words: str, run: Any = None, **keywords: Any) -> None:
    before = sorted(path.parent.iterdir()) if path.parent.is_dir() else None
    with pytest.raises(UddError, match=words) as caught:
        render(uniform() if run is None else run, path, **keywords)
    assert "\n" not in str(caught.value)
    if before is not None:
        assert sorted(path.parent.iterdir()) == before  # nothing left behind


def test_bad_values_are_named(tmp_path: Path) -> None:
    film = tmp_path / "film.mp4"
    for words, keywords in [
        ("exposure", {"exposure": 0.05}),
        ("exposure", {"exposure": 0.0}),
        ("exposure", {"exposure": float("nan")}),
        ("fps", {"fps": 0}),
        ("fps", {"fps": float("inf")}),
        ("size", {"size": (551, 700)}),
        ("size", {"size": (0, 0)}),
        ("size", {"size": (550,)}),
        ("scale", {"scale": -1.0}),
        ("scale", {"scale": float("nan")}),
        ("pivot", {"pivot": (1.0, float("nan"))}),
        ("tilt", {"tilt": float("inf")}),
        ("support", {"support": -1.0}),
        ("noise", {"noise": -1.0}),
        ("noise", {"noise": float("nan")}),
        ("quality", {"quality": 52.0}),
        ("rng", {"rng": -1}),
        ("background", {"background": np.zeros((3, 4, 3))}),
        ("background", {"background": (0, 0, 300)}),
    ]:
        refused(film, words, **keywords)


def test_bad_trajectories_are_named(tmp_path: Path) -> None:
    film, run = tmp_path / "film.mp4", uniform()
    hole = run.state.copy()
    hole[7, 2] = np.nan
    refused(film, "at least two samples", Run(np.empty(0), np.empty((0, 4))))
    refused(film, "not finite", Run(run.t, hole))
    refused(film, "nine samples", Run(run.t[:5], run.state[:5]))
    refused(film, "increase", Run(run.t[::-1], run.state))
    refused(film, "shows one disk", Run(run.t, run.state[:, :3]))
    refused(film, "with t and state", 7)
    refused(film, "too far apart", plain_run(2.0, rate=10.0))
    refused(film, "shorter than one exposure", Run(run.t / 100, run.state), exposure=0.02)


def test_places_that_cannot_be_written_are_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    (tmp_path / "folder.mp4").mkdir()
    refused(tmp_path / "nowhere" / "film.mp4", "no folder")
    refused(tmp_path / "file" / "film.mp4", "no folder")
    refused(tmp_path / "folder.mp4", "it is a folder")
    refused(tmp_path / "film.txt", r"\.mp4")


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="the superuser may write anywhere"
)
def test_a_closed_folder_is_named(tmp_path: Path) -> None:
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    try:
        refused(tmp_path / "film.mp4", "not writable")
    finally:
        tmp_path.chmod(stat.S_IRWXU)


def test_a_film_broken_off_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "film.mp4"
    render(uniform(), path, size=(110, 140))
    old = path.read_bytes()

    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("udd.film.rendering.Noise.on", interrupted)
    with pytest.raises(KeyboardInterrupt):
        render(uniform(), path, size=(110, 140))
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == old


def test_without_the_extra_the_sentence_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    refused(tmp_path / "film.mp4", r"udd\[track\]")


def test_a_generator_a_whole_number_and_the_name_of_before_give_the_same_film(tmp_path: Path) -> None:
    run = plain_run(0.1)
    films = [render(run, tmp_path / "0.mp4", rng=5).path]
    films.append(render(run, tmp_path / "1.mp4", rng=np.random.default_rng(5)).path)
    with pytest.warns(DeprecationWarning, match=r"seed=\.\.\.\) is called rng="):
        films.append(render(run, tmp_path / "2.mp4", seed=5).path)  # type: ignore[call-arg]
    assert len({path.read_bytes() for path in films}) == 1
    fresh = [render(run, tmp_path / f"{i}.mp4", rng=None).path.read_bytes() for i in (3, 4)]
    assert fresh[0] != fresh[1]
