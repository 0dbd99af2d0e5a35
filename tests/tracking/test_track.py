"""The tracker against films with known motion: drawn here, and the shared ones where they are."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import av

import tracked
from film_for_tests import (
    FPS,
    HALF,
    HEIGHT,
    PIVOT,
    RADIUS,
    REACH,
    SCALE,
    WIDTH,
    Motion,
    frame,
    rolling,
    still,
    write,
)
from udd.errors import UddError
from udd.measurement import Measurement, read_measurement
from udd.tracking import pictures_at, pixels, track, track_disk
from udd.tracking.geometry.contact_point import pivot
from udd.tracking.geometry.lens import Lens, calibrate
from udd.tracking.geometry.pose import DiskAppearance, Mark, Pose
from udd.tracking.geometry.pose import Motion as Blur
from udd.tracking.marks.localization import Sighting, coverage, locate
from udd.tracking.marks.rigid_fit import solve
from udd.tracking.metric.pixels_to_metres import recount
from udd.video.reader import light_of_codes

SHARED = Path(__file__).parents[3] / "shared" / "video"
FRAMES, EXPOSURE = 75, 0.008
Array = NDArray[np.float64]


@pytest.fixture(scope="session")
def motion() -> Motion:
    return rolling(4.0)


@pytest.fixture(scope="session")
def shots(motion: Motion) -> list[NDArray[np.uint8]]:
    rng = np.random.default_rng(3)
    return [frame(motion, i / FPS, EXPOSURE, rng) for i in range(FRAMES)]


@pytest.fixture(scope="session")
def film(shots: list[NDArray[np.uint8]], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("film") / "plain.mp4", shots)


@pytest.fixture(scope="session")
def measured(film: Path) -> Measurement:
    return tracked.track(film, disk_radius=RADIUS)


def errors(m: Measurement, truth: Array) -> Array:
    """Errors of the seen rows [m, m, rad], after a constant offset and a factor of the lengths."""
    out = np.empty((int(m.seen.sum()), 3))
    for k in range(2):
        design = np.column_stack([np.ones(len(out)), truth[m.seen, k]])
        fit = np.linalg.lstsq(design, m.values[m.seen, k], rcond=None)[0]
        out[:, k] = (m.values[m.seen, k] - design @ fit) / fit[1]
    turn = m["beta"][m.seen] - truth[m.seen, 2]
    out[:, 2] = turn - 2 * np.pi * np.round(np.median(turn) / (2 * np.pi))
    return out


def true(motion: Motion, t: Array) -> Array:
    return np.array([motion.at(x) for x in t])


def test_positions_and_angle(measured: Measurement, motion: Motion) -> None:
    e = errors(measured, true(motion, measured.t))
    rms = np.sqrt((e**2).mean(axis=0))
    assert measured.seen.all()
    # one pixel is 1 mm; grain of 1.5 codes on edges of 100 codes over about 60 edge pixels per mark gives
    # 0.01 pixel; three times that for compression and half-hidden marks
    assert rms[0] < 3e-5 and rms[1] < 3e-5
    assert rms[2] < 3e-5 / REACH
    assert np.abs(e).max() < 5e-3


def test_scale_and_contact_come_out_of_the_film(measured: Measurement) -> None:
    meta = measured.meta
    # the rim is drawn to about 0.05 pixel of 80
    assert float(meta["px_per_m"]) == pytest.approx(SCALE, rel=1e-3)
    assert meta["pivot_from"] == "rolling constraint"
    # 0.3 mm is what the fit can be given without harm; a camera pixel is 1 mm here
    assert abs(float(meta["pivot_u"]) - PIVOT[0]) < 0.1 and abs(float(meta["pivot_v"]) - PIVOT[1]) < 0.1
    # of the picture's middle, in metres from the contact, Z upward; half a pixel is a matter of words
    middle = (WIDTH / 2 - PIVOT[0]) / SCALE, (PIVOT[1] - HEIGHT / 2) / SCALE
    assert meta["middle"] == pytest.approx(middle, abs=1e-3)
    assert float(meta["drive_seen"]) == pytest.approx(0.012, rel=0.02)
    # measured again in the second pass; edges are known to 0.12 pixels of streaks of some twenty
    assert float(meta["exposure"]) == pytest.approx(EXPOSURE, rel=0.06)


def test_errors_are_honest(measured: Measurement, motion: Motion) -> None:
    e = errors(measured, true(motion, measured.t))
    assert measured.sigma is not None
    z = e / measured.sigma
    rms = np.sqrt((z**2).mean(axis=0))
    # 75 frames fix an rms to 8 %; what compression repeats from frame to frame widens that
    assert np.all(rms > 0.6) and np.all(rms < 1.7)
    full = np.einsum("ni,nij,nj->n", e, np.linalg.inv(measured.covariance()), e).mean() / 3
    assert 0.4 < full < 2.5


def test_a_tracked_measurement_survives_its_file(measured: Measurement, tmp_path: Path) -> None:
    measured.to_csv(tmp_path / "m.csv")
    back = read_measurement(tmp_path / "m.csv")
    assert np.array_equal(back.values, measured.values) and dict(back.meta) == dict(measured.meta)
    drawn, before = pixels(back), pixels(measured)
    assert np.array_equal(drawn.marks, before.marks)


def test_pixels_lie_on_the_marks(measured: Measurement, shots: list[NDArray[np.uint8]], film: Path) -> None:
    where = pixels(measured)
    assert where.radius == pytest.approx(80, abs=0.1)
    reach = np.hypot(*(where.rim - where.centre[:, None]).T)
    assert np.allclose(reach, where.radius)
    picture = pictures_at(film, [10])[0]
    assert picture.shape == (HEIGHT, WIDTH, 3)
    assert np.abs(picture.astype(int) - shots[10]).mean() < 4  # the same frame, in the same colours
    u, v = np.round(where.marks[10, 0]).astype(int)
    red = picture[v, u].astype(int)
    assert red[0] > 2 * red[1] and red[0] > 2 * red[2]


def test_same_film_same_bits(film: Path, measured: Measurement) -> None:
    again = track(film, disk_radius=RADIUS)
    assert np.array_equal(again.values, measured.values)
    assert np.array_equal(again.covariance(), measured.covariance())


def test_repeated_and_black_frames_are_flagged(
    shots: list[NDArray[np.uint8]], motion: Motion, tmp_path: Path
) -> None:
    bad = [*shots]
    bad[30], bad[31], bad[50] = bad[29], bad[29], np.zeros_like(bad[0])
    m = track(write(tmp_path / "bad.mp4", bad), disk_radius=RADIUS)
    assert m.flag[30].startswith("dup") and m.flag[31].startswith("dup")
    assert m.flag[50].startswith("black")
    assert m.seen.sum() == FRAMES - 3
    e = errors(m, true(motion, m.t))
    assert np.sqrt((e**2).mean(axis=0)).max() < 1e-3


def test_uneven_frame_times_are_kept(motion: Motion, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    times = (np.arange(40) + 0.3 * rng.uniform(-1, 1, 40)) / FPS
    times -= times[0]
    times = np.round(times * 1e4) / 1e4
    frames = [frame(motion, t, 0.0, rng) for t in times]
    m = track(write(tmp_path / "uneven.mp4", frames, lambda i: float(times[i])), disk_radius=RADIUS)
    assert np.allclose(m.t, times, atol=1e-4)  # the container's clock
    e = errors(m, true(motion, m.t))
    # at 0.3 m/s a frame time wrong by a third of an interval would be 4 mm
    assert np.sqrt((e[:, :2] ** 2).mean()) < 6e-5


def test_two_marks_suffice(motion: Motion, tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    frames = [frame(motion, i / FPS, 0.0, rng) for i in range(50)]
    for picture in frames[25:]:
        picture[:, :158] = (25, 25, 28)  # a board slides in front and covers the left half
    m = track(write(tmp_path / "half.mp4", frames), disk_radius=RADIUS)
    e = errors(m, true(motion, m.t))
    late = e[m.seen[:25].sum() :]
    assert len(late) >= 15  # the other frames have one whole mark or less on the right
    assert m.sigma is not None
    # fewer marks: larger errors, said so
    assert np.abs(late[:, :2]).max() < 1e-3 and np.abs(late[:, 2]).max() < 0.02
    assert np.median(m["sigma_Y"][25:][m.seen[25:]]) > 1.2 * np.median(m["sigma_Y"][:25])


def test_frames_after_the_disk_has_gone_are_not_invented(motion: Motion, tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    frames = [frame(motion, i / FPS, 0.0, rng) for i in range(40)]
    wall = np.full_like(frames[0], 140)
    wall[::7, ::5] = 150
    m = track(write(tmp_path / "gone.mp4", [*frames, *[wall] * 15]), disk_radius=RADIUS)
    assert m.seen[:40].all() and not m.seen[40:].any()
    assert np.isnan(m.values[40:]).all() and all(flag != "" for flag in m.flag[40:])


def test_beta_keeps_count_at_39_degrees_a_frame(tmp_path: Path) -> None:
    t = np.linspace(-0.1, 2, 21001)
    beta = 17.0 * t
    spinning = Motion(
        t, np.column_stack([0 * t + 0.01, 0 * t + 0.005, beta])
    )  # 17 rad/s about a fixed centre
    rng = np.random.default_rng(8)
    frames = [frame(spinning, i / FPS, 0.004, rng) for i in range(30)]
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        m = track(write(tmp_path / "spin.mp4", frames), disk_radius=RADIUS)
    assert m.seen.sum() >= 28
    step = np.diff(m["beta"][m.seen]) / np.diff(m.t[m.seen])
    assert np.allclose(step, 17.0, atol=0.2)
    # steady rotation about one point does not tell where the contact is: said, and taken from the support
    assert m.meta["pivot_from"] == "support" and any("contact point" in str(w.message) for w in said)


# ---- bad input ---------------------------------------------------------------------------------------------


def says(path: Path, words: str, **options: float) -> None:
    with pytest.raises(UddError) as error:
        track(path, **options)  # type: ignore[arg-type]
    text = str(error.value)
    assert words in text and "\n" not in text, text


def test_files_that_are_no_film(tmp_path: Path) -> None:
    says(tmp_path / "nothing.mp4", "there is no such file")
    says(tmp_path, "is a folder")
    (tmp_path / "empty.mp4").touch()
    says(tmp_path / "empty.mp4", "is empty")
    (tmp_path / "text.mp4").write_text("this is not a film\n" * 100)
    says(tmp_path / "text.mp4", "not a film that can be decoded")
    (tmp_path / "noise.mp4").write_bytes(np.random.default_rng(0).bytes(50_000))
    says(tmp_path / "noise.mp4", "not a film that can be decoded")


def test_a_film_cut_off_in_its_data(shots: list[NDArray[np.uint8]], motion: Motion, tmp_path: Path) -> None:
    whole = write(tmp_path / "whole.avi", shots).read_bytes()
    (tmp_path / "cut.avi").write_bytes(whole[: int(0.7 * len(whole))])
    with pytest.warns(UserWarning, match="cut off"):
        m = track(tmp_path / "cut.avi", disk_radius=RADIUS)
    assert 40 < len(m) < FRAMES
    assert np.sqrt((errors(m, true(motion, m.t)) ** 2).mean(axis=0)).max() < 1e-3


def test_a_film_cut_off_before_its_index(film: Path, tmp_path: Path) -> None:
    data = film.read_bytes()
    (tmp_path / "cut.mp4").write_bytes(data[: len(data) // 2])  # the index is at the end
    says(tmp_path / "cut.mp4", "cut off")


def test_a_film_with_a_damaged_middle_neither_crashes_nor_lies(
    film: Path, motion: Motion, tmp_path: Path
) -> None:
    data = bytearray(film.read_bytes())
    rng = np.random.default_rng(1)
    middle = len(data) // 3
    data[middle : middle + 4000] = rng.bytes(4000)
    (tmp_path / "hurt.mp4").write_bytes(bytes(data))
    with pytest.warns(UserWarning, match="do not decode"):
        m = track(tmp_path / "hurt.mp4", disk_radius=RADIUS)
    assert any(flag.startswith("damaged") for flag in m.flag)
    assert m.seen.sum() > FRAMES // 2  # whole again from the next key frame, 12 frames apart
    e = errors(m, true(motion, m.t))
    assert np.abs(e[:, :2]).max() < 3e-4 and np.abs(e[:, 2]).max() < 5e-3


def test_a_film_without_marks(motion: Motion, tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    path = write(tmp_path / "bare.mp4", [frame(motion, i / FPS, 0.0, rng, marks=False) for i in range(15)])
    says(path, "no disk with marks in red, orange, blue and green")


def test_a_film_too_short(shots: list[NDArray[np.uint8]], tmp_path: Path) -> None:
    says(write(tmp_path / "short.mp4", shots[:6]), "too short: 6 frames")


@pytest.mark.parametrize("radius", [-0.08, 0.0, float("nan"), float("inf")])
def test_radius_must_be_a_length(film: Path, radius: float) -> None:
    says(film, "disk_radius must be a positive number of metres", disk_radius=radius)


# ---- the parts ---------------------------------------------------------------------------------------------


def a_mark(offset: complex, hide: float | None) -> tuple[Array, NDArray[np.bool_], Mark]:
    """A picture (codes) of one mark off its expected place (40, 40), hidden left of a column."""
    mark = Mark(0j, (10.0, 10.0), 0.3, -120.0)
    picture = 180.0 + mark.level * coverage(mark, 40 + 40j + offset, 0.0, Blur(), 0.7, (0, 80, 0, 80))
    view = np.ones((80, 80), dtype=bool)
    if hide is not None:
        picture[:, : int(hide)] = 20.0
        view[:, : int(hide)] = False
    return picture, view, mark


def a_look(mark: Mark) -> DiskAppearance:
    return DiskAppearance([mark], 0.7, 1.0, np.arange(256.0), 200.0)


@pytest.mark.parametrize("hide", [None, 35, 40, 44])
def test_a_half_hidden_mark_is_not_taken_for_a_whole_one(hide: float | None) -> None:
    truth = 0.4 - 0.3j
    picture, view, mark = a_mark(truth, hide)
    result, complete = 0j, 0.0
    for _ in range(6):
        pose = Pose(40 + 40j + result, 0.0)
        s = locate(np.round(picture).astype(np.uint8), view, a_look(mark), pose, Blur())[1][0]
        assert s is not None
        result, complete = result + complex(s.offset[0], s.offset[1]), s.complete
    # rounding to whole codes is 0.3 of 120: a thousandth of a pixel on some forty edge pixels; a centroid
    # of the visible part would be off by 2 to 7 pixels
    assert abs(result - truth) < 0.01
    if hide is None:
        assert complete == pytest.approx(1.0, abs=1e-6)
    else:
        assert complete < 0.95


def test_one_visible_edge_informs_across_itself_only() -> None:
    mark = Mark(0j, (10.0, 10.0), 0.0, -120.0)
    picture = 180.0 + mark.level * coverage(mark, 40 + 40j, 0.0, Blur(), 0.7, (0, 80, 0, 80))
    view = np.zeros((80, 80), dtype=bool)
    view[34:47, 45:] = True  # a stretch of the right edge
    s = locate(np.round(picture).astype(np.uint8), view, a_look(mark), Pose(40 + 40j, 0.0), Blur())[1][0]
    assert s is not None
    assert s.information[0, 0] > 1e4 * abs(s.information[1, 1])


def test_the_mean_of_a_streak_is_where_the_mark_is() -> None:
    mark = Mark(0j, (6.0, 6.0), 0.2, -120.0)
    blur = Blur(shift=9 + 5j, turn=0.2)
    cover = coverage(mark, 60 + 60j, 0.5, blur, 0.7, (0, 120, 0, 120))
    v, u = np.mgrid[0:120, 0:120]
    assert cover.sum() == pytest.approx(144.0, rel=1e-3)  # area is kept
    assert (u * cover).sum() / cover.sum() == pytest.approx(60, abs=0.01)
    assert (v * cover).sum() / cover.sum() == pytest.approx(60, abs=0.01)


def test_rigid_step_from_two_marks_is_exact() -> None:
    marks = [Mark(complex(p), (8.0, 8.0), 0.0, -100.0) for p in (-60j, 60, 60j, -60)]
    change, angle = np.array([0.3, -0.2, 0.004]), 0.7
    picture, view, mark = a_mark(0j, None)
    seen = locate(picture.astype(np.uint8), view, a_look(mark), Pose(40 + 40j, 0.0), Blur())[1][0]
    assert seen is not None
    sightings: list[Sighting | None] = []
    for m in marks[:2]:
        arm = 1j * m.place * np.exp(1j * angle)
        offset = np.array([change[0] + arm.real * change[2], change[1] + arm.imag * change[2]])
        sightings.append(replace(seen, offset=offset))
    step = solve(marks, [*sightings, None, None], angle, np.ones(4))
    assert step is not None and np.allclose(step.change, change, atol=1e-12)
    assert solve(marks, [sightings[0], None, None, None], angle, np.ones(4)) is None  # one mark: no pose


def test_lens_and_tilt_come_out_of_rigidity() -> None:
    rng = np.random.default_rng(4)
    true_lens = Lens(275 + 350j, float(np.hypot(700, 550) / 2), 0.014, -0.04, -0.004, 0.015, 0.0)
    centres = 270 + 330j + 60 * (rng.uniform(-1, 1, 60) + 1j * rng.uniform(-1, 1, 60))
    arms = np.exp(1j * rng.uniform(0, 2 * np.pi, 60))[:, None] * np.array([-114j, 114, 114j, -114])
    plane = centres[:, None] + arms
    points = true_lens.picture(plane)
    assert np.allclose(true_lens.plane(points), plane, atol=1e-8)
    noisy = points + 0.03 * (rng.normal(size=points.shape) + 1j * rng.normal(size=points.shape))
    noisy[::3, 1] = np.nan
    bent = calibrate(noisy, (700, 550))
    assert bent.is_significant
    result = bent.lens
    # the standard error of the curve covers, to 4 of them
    assert 0 < bent.sigma[0] < 0.01 and abs(result.curve - true_lens.curve) < 4 * bent.sigma[0]
    # the distances between the marks, in the frames' own unit of length, must be the same everywhere again
    back = result.plane(points)
    spread = np.abs(back[:, 0] - back[:, 2])
    before = np.abs(points[:, 0] - points[:, 2])
    assert spread.std() < 0.15 * before.std() and spread.std() < 0.1
    flat = plane + 0.03 * (rng.normal(size=points.shape) + 1j * rng.normal(size=points.shape))
    left = calibrate(flat, (700, 550))
    assert left.lens.plain and not left.is_significant  # nothing to mend is left alone
    given = calibrate(noisy, (700, 550), curve=0.014, tilt=0.0)
    assert (given.lens.curve, given.lens.tilt_u, given.sigma.tolist()) == (0.014, 0.0, [0.0] * 5)


def test_lens_terms_left_at_zero_widen_the_errors_of_the_others() -> None:
    size, middle = float(np.hypot(700, 550) / 2), 275 + 350j
    for seed in (5, 8):  # a disk that hardly moves at the picture's side: curve and tilt are left at 0
        rng = np.random.default_rng(seed)
        true = np.array([0.1, 0.15, 0.15, 0.1, 0.05]) * rng.normal(size=5)
        centres = middle + 120 + 3 * (rng.normal(size=60) + 1j * rng.normal(size=60))
        arms = 110 * np.exp(3j * rng.normal(size=60))[:, None] * np.array([-1j, 1, 1j, -1])
        points = Lens(middle, size, *true).picture(centres[:, None] + arms)
        points += 1.5 * (rng.normal(size=points.shape) + 1j * rng.normal(size=points.shape))
        bent = calibrate(points, (700, 550))
        kept = np.array(bent.lens.row[3:])
        assert bent.is_significant and not kept[:2].any() and kept[2:].all()
        # the tilt that is left out makes the aspect wrong by 8 to 11 of the noise's standard errors
        assert (np.abs(kept - true)[2:] < 2 * bent.sigma[2:]).all()


def test_turns_across_a_gap_follow_the_rates_around_it() -> None:
    t = np.arange(60) / 25
    angle = 12.0 * t
    shown = angle.copy()
    shown[20:29] = np.nan
    shown[29:] -= 2 * np.pi  # what a count without the rate after the gap may give
    counted, doubtful = recount(t, shown)
    assert doubtful == 0 and np.allclose(counted[29:], angle[29:])


def test_contact_from_exact_kinematics() -> None:
    m = rolling(6.0, drive=0.01)
    t = np.arange(150) / 25
    state = true(m, t)
    rng = np.random.default_rng(0)
    centre = np.asarray(1000 * (state[:, 0] - 1j * state[:, 1]) + (300 + 200j))
    noisy = centre + 0.02 * (rng.normal(size=150) + 1j * rng.normal(size=150))
    result = pivot(t, noisy.astype(np.complex128), state[:, 2], np.ones(150, dtype=bool), 60.0)
    assert result is not None
    # noise of 0.02 pixel over 150 frames, times about 2 for the free constants and drive
    assert abs(result.place - (300 + 200j)) < 0.02
    assert np.conj(result.drive) / 1000 == pytest.approx(0.01j, abs=2e-4)


def test_steady_rotation_gives_no_contact() -> None:
    t = np.arange(100) / 25
    rng = np.random.default_rng(0)
    centre = 300 + 200j + 0.02 * (rng.normal(size=100) + 1j * rng.normal(size=100))
    # the centre at rest: any contact explains it, with the drive that goes with it
    assert pivot(t, centre.astype(np.complex128), 5.0 * t, np.ones(100, dtype=bool), 60.0) is None


def test_light_of_codes_is_the_inverse_of_the_srgb_curve() -> None:
    light = light_of_codes(full_range=True)
    assert light[0] == 0 and light[255] == pytest.approx(255)
    assert light[128] == pytest.approx(255 * 0.21586, rel=1e-4)  # IEC 61966-2-1
    assert light_of_codes(full_range=False)[[16, 235]] == pytest.approx([0, 255])


def test_the_test_film_itself_is_drawn_to_scale() -> None:
    image = still(0.0, 0.0, 0.0, support=False)
    dark = image[..., 2] < 0.2  # blue channel: red, orange and green marks
    assert dark.sum() / 9 == pytest.approx(3 * (2 * HALF * SCALE) ** 2, rel=0.02)


# ---- the shared films --------------------------------------------------------------------------------------


def beginning(film: Path, frames: int, out: Path) -> Path:
    """The film's first frames, copied as they are."""
    with av.open(str(film)) as source, av.open(str(out), "w") as copy:
        stream = copy.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(video=0):
            if packet.dts is None or frames == 0:
                break
            packet.stream, frames = stream, frames - 1
            copy.mux(packet)
    return out


@pytest.mark.skipif(not (SHARED / "plain.mp4").is_file(), reason="the shared films are not here")
@pytest.mark.parametrize(
    ("name", "length", "angle", "lost", "frames"),
    # rms allowed: mm, mrad, share of frames lost. Exposure 10 ms, 1750 pixels per metre.
    # hard: exposure 32 ms (streaks of up to 120 pixels), tilt, lens, marks hidden.
    [
        ("plain", 0.02, 0.25, 0.005, 200),
        ("zero_drive", 0.02, 0.25, 0.0, 150),
        ("hard", 0.3, 6.0, 0.05, 200),
        # The beginnings ask the same of fewer frames.
        pytest.param("plain", 0.02, 0.25, 0.005, 1500, marks=pytest.mark.nightly),
        pytest.param("hard", 0.3, 6.0, 0.05, 350, marks=pytest.mark.nightly),
    ],
)
def test_shared_films(
    name: str, length: float, angle: float, lost: float, frames: int, tmp_path: Path
) -> None:
    film = beginning(SHARED / f"{name}.mp4", frames, tmp_path / f"{name}.mp4")
    m = track_disk(film, disk_radius=0.08).measurement
    truth = np.genfromtxt(SHARED / f"{name}.truth.csv", delimiter=",", skip_header=1, usecols=(2, 3, 4))
    truth = truth[:frames]
    assert len(m) == len(truth) == frames
    e = errors(m, truth)
    rms = np.sqrt((e**2).mean(axis=0))
    assert rms[0] * 1e3 < length and rms[1] * 1e3 < length and rms[2] * 1e3 < angle
    assert 1 - m.seen.mean() <= lost
    assert np.abs(e[:, :2]).max() < 2e-3 and np.abs(e[:, 2]).max() < 0.1  # no row is wrong without saying so
    # these films draw every edge 0.3 to 0.4 pixels inside its true place: 0.3 % of the radius
    assert float(m.meta["px_per_m"]) == pytest.approx(1750, rel=0.006)
