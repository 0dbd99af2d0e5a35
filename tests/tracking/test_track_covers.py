"""Standard errors hold: light of mixed colours, uneven light, a wobble, frames unlike each other."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import udd
from udd.film import Defects
from udd.film.light import to_light
from udd.film.sprite import MARKS
from udd.markers.layout import BODY
from udd.tracking.calibration.exposure import again
from udd.tracking.detection.colour_blobs import Sight
from udd.tracking.detection.colour_mixing import mixed
from udd.tracking.detection.illumination import evenness
from udd.tracking.geometry.pose import DiskAppearance, Mark, Motion, Pose
from udd.tracking.marks.localization import Sighting, coverage
from udd.tracking.marks.pose_fit import Fit
from udd.tracking.marks.rigid_fit import solve
from udd.tracking.metric.common_errors import common_mode_errors
from udd.tracking.metric.pixels_to_metres import Camera
from udd.tracking.metric.pose_covariance import _belief, covariance
from udd.tracking.passes.copied_pixels import without_lag
from udd.tracking.passes.local_motion import to_mid_exposure
from udd.tracking.passes.tracks import FrameTrack, Tracks, found_in
from udd.video.reader import Picture, light_of_codes

WEIGHT = np.array([[0.299, 0.587, 0.114], [-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])


def code(light: np.ndarray) -> np.ndarray:
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize("mark", MARKS)
def test_a_mix_of_disk_and_mark_has_the_light_of_its_share(mark: tuple[int, int, int]) -> None:
    light = light_of_codes(True)
    white, full = np.full(3, 230 / 255), np.array(mark) / 255
    y, u, v = WEIGHT @ full
    ends = light[230], float(np.interp(255 * y, np.arange(256), light))
    table = mixed(light, *ends, 255 * np.array([u, v]), True)
    for share in (0.1, 0.3, 0.5, 0.8):
        mix = to_light(255 * white) * (1 - share) + to_light(255 * full) * share
        seen = float(np.interp(255 * (WEIGHT[0] @ code(mix)), np.arange(256), table))
        expected = ends[0] + share * (ends[1] - ends[0])
        assert abs(seen - expected) < 0.01 * abs(ends[1] - ends[0])  # 0.06 without; codes are whole numbers
    assert table[255] == light[255]


def test_a_mark_of_unknown_colour_or_as_bright_as_the_disk_keeps_its_light() -> None:
    light = light_of_codes(False)
    for mark, colour in ((200.0, (0.0, 0.0)), (100.0, (np.nan, np.nan))):
        assert mixed(light, 200.0, mark, np.array(colour), False) is light


def lit(slope: float) -> tuple[list[tuple[Picture, Sight]], np.ndarray]:
    """A white disk at many places under light that grows to the right, and that light."""
    rng = np.random.default_rng(0)
    u, v = np.meshgrid(np.arange(240.0), np.arange(200.0))
    shade = 1 + slope * (u / 240 - 0.5)
    light, half = light_of_codes(True), np.full((100, 120), 128, np.uint8)
    seen = []
    for k in range(40):
        centre = complex(rng.uniform(80, 160), rng.uniform(80, 120))
        here = np.abs(u + 1j * v - centre) < 70
        amount = np.where(here, 150 * rng.uniform(0.8, 1.1) * shade, 20)
        codes = np.searchsorted(light, amount) + rng.normal(0, 1, here.shape)
        picture = Picture(k, k / 25, np.clip(codes, 0, 255).astype(np.uint8), half, half)
        seen.append((picture, Sight(centre, rng.uniform(-3, 3), 50.0, 100.0)))
    return seen, shade


def test_uneven_light_is_evened_where_the_disk_comes() -> None:
    seen, shade = lit(0.4)
    even = evenness(seen, np.ones(shade.shape, dtype=bool), BODY, light_of_codes(True))
    assert even is not None
    flat = (even * shade)[60:140, 60:180]
    assert np.ptp(flat) / flat.mean() < 0.01 < 0.1 < np.ptp(shade[60:140, 60:180])


def test_even_light_is_left_alone() -> None:
    seen, shade = lit(0.0)
    assert evenness(seen, np.ones(shade.shape, dtype=bool), BODY, light_of_codes(True)) is None


def test_how_much_frames_differ_is_learned() -> None:
    rng = np.random.default_rng(1)
    spare = np.full(4000, 5)
    alike = rng.chisquare(5, 4000) / 5
    assert _belief(alike / alike.mean(), spare) > 50
    degrees = 12.0  # of the inverse variance: its mean counts as 10 coordinates
    variance = degrees / rng.chisquare(degrees, 4000)
    unlike = variance * rng.chisquare(5, 4000) / 5
    assert 7 < _belief(unlike / unlike.mean(), spare) < 14


def test_a_wobbling_disk_is_measured_as_if_it_did_not(tmp_path: Path) -> None:
    run = udd.simulate(udd.Disk(0.039), np.arange(0, 2, 0.005), [1, 0.02, -0.02, 0.3], dense=True)
    film = udd.render(run, tmp_path / "wobble.mp4", defects=Defects(wobble=math.radians(10)))
    m = udd.track(film.path)
    off = m.values[1:] - film.truth.values[1:]
    off[:, 2] -= 2 * np.pi * np.round(np.median(off[:, 2]) / (2 * np.pi))
    assert np.sqrt(np.nanmean(off[:, :2] ** 2)) < 40e-6  # 0.15 mm where the foreshortening is not undone
    assert np.sqrt(np.nanmean(off[:, 2] ** 2)) < 0.4e-3


ROLLING = udd.simulate(udd.Disk(0.039), np.arange(0, 14, 0.005), [1, 0.02, -0.02, 0.3], dense=True)
SCALE, PIVOT = 1000.0, 300 + 300j
MARKS = [Mark(60 * 1j**k, (10.0, 10.0), 0.0, -100.0) for k in range(4)]
LOOK = DiskAppearance(MARKS, 0.8, 1.0, light_of_codes(True), 100.0)


def rolled(rng: np.random.Generator, along: float, across: float, common: float) -> tuple[Tracks, np.ndarray]:
    """Poses of a rolling disk from marks with such errors [pixels], 0.01 being assumed; what they are off."""
    t = np.arange(0, 13.9, 0.04)
    state = ROLLING(t)
    frames: list[FrameTrack] = []
    off = []
    speed = SCALE * np.gradient(state[:, 1] - 1j * state[:, 2], t)
    for k in range(len(t)):
        centre, angle = PIVOT + SCALE * complex(state[k, 1], -state[k, 2]), float(state[k, 3])
        arms = LOOK.places * np.exp(1j * angle)
        moving = speed[k] + 1j * state[k, 0] * arms
        error = moving / np.abs(moving) * (along * rng.normal(size=4) + 1j * across * rng.normal(size=4))
        error = error + common * complex(*rng.normal(size=2))
        sightings = [
            Sighting(np.array([z.real, z.imag]), np.eye(2) / 0.01**2, 1.0, 1.0, 0.0, 1.0, (0, 0, 0, 0))
            for z in error
        ]
        step = solve(MARKS, sightings, angle, np.ones(4))
        assert step is not None
        off.append(step.change)
        pose = Pose(centre + complex(*step.change[:2]), angle + float(step.change[2]))
        streak = 0.01 * float(np.abs(moving).max())
        fit = Fit(step, sightings, np.ones(4, dtype=bool), 0.0)
        frames.append(found_in(float(t[k]), fit, pose, streak, "fast"))
    return Tracks.of(frames), np.array(off)


def covers(off: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Rms of normalised errors of u, v and beta, and of all three."""
    each = (off**2 / np.einsum("nii->ni", covariance)).mean(axis=0)
    whole = np.einsum("ni,nij,nj->n", off, np.linalg.inv(covariance), off).mean() / 3
    return np.sqrt([*each, whole])


def test_errors_along_streaks_and_across_are_told_apart() -> None:
    tracks, off = rolled(np.random.default_rng(2), 0.03, 0.01, 0.0)
    # 350 frames tell an rms to 0.04; with one variance for both directions 1.3 for beta
    assert np.abs(covers(off, covariance(tracks, LOOK)) - 1).max() < 0.12


def test_marks_that_sit_elsewhere_are_no_noise() -> None:
    tracks, _ = rolled(np.random.default_rng(2), 0.02, 0.01, 0.0)
    placed_well = covariance(tracks, LOOK)
    elsewhere = 0.05 * np.array([1, -1, 1, -1]) * np.exp(1j * tracks.angle)[:, None]
    off = tracks.residuals + np.stack([elsewhere.real, elsewhere.imag], axis=-1)
    np.testing.assert_allclose(
        covariance(replace(tracks, residuals=off), LOOK), placed_well, rtol=1e-9, atol=1e-15
    )


def test_a_disk_at_rest_shows_no_smaller_errors() -> None:
    """Its frames all have one error, with which places of marks that are learned from them go along."""
    tracks, _ = rolled(np.random.default_rng(2), 0.02, 0.02, 0.0)
    moving = covariance(tracks, LOOK)
    last = len(tracks) - 1
    frames = [
        FrameTrack(*(getattr(tracks, f.name)[min(k, last)] for f in fields(tracks))) for k in range(3000)
    ]
    frames = [replace(f, t=0.04 * k) for k, f in enumerate(frames)]
    resting = Tracks.of(frames)
    # as if the marks' places had been learned from the disk at rest
    stays = resting.residuals[last] @ [1, 1j] * np.exp(-1j * resting.angle[last])
    learned = stays * np.exp(1j * resting.angle)[:, None]
    off = resting.residuals - np.stack([learned.real, learned.imag], axis=-1)
    said = covariance(replace(resting, residuals=off), LOOK)
    ratio = np.sqrt(np.einsum("nii->ni", said)[-1] / np.median(np.einsum("nii->ni", moving), axis=0))
    assert (ratio > 0.7).all() and (ratio < 1.5).all()


def test_what_a_path_is_bent_by_has_errors_of_its_own() -> None:
    tracks, _ = rolled(np.random.default_rng(3), 0.01, 0.01, 0.0)
    own = np.tile(np.eye(3), (len(tracks), 1, 1))
    result = to_mid_exposure(tracks, own, 0.04**2 / 12)
    weights = np.array([-1 / 12, 4 / 3, -5 / 2, 4 / 3, -1 / 12]) / 24  # of a quartic's second derivative
    expected = ((np.array([0, 0, 1, 0, 0]) - weights) ** 2).sum()
    assert 1.2 < expected < 1.3
    np.testing.assert_allclose(result[5:-5], expected * own[5:-5], atol=1e-9)
    np.testing.assert_array_equal(to_mid_exposure(tracks, own, 0.0), own)


def test_what_all_marks_share_is_seen_where_the_disk_jumps() -> None:
    camera = Camera(SCALE, 1.0, "given", PIVOT, 0.0, "given", 0.039j)
    tracks, off = rolled(np.random.default_rng(4), 0.01, 0.01, 0.02)
    own = covariance(tracks, LOOK)
    result = common_mode_errors(tracks, own, camera)
    assert 0.015 < np.median(result) < 0.025  # 80 frames tell it to a tenth
    both = own + (result**2)[:, None, None] * np.diag([1.0, 1.0, 0.0])
    assert covers(off, own)[3] > 2.5
    assert abs(covers(off, both)[3] - 1) < 0.15


def test_slip_is_no_error_that_all_marks_share() -> None:
    camera = Camera(SCALE, 1.0, "given", PIVOT, 0.0, "given", 0.039j)
    tracks, _ = rolled(np.random.default_rng(5), 0.01, 0.01, 0.0)
    # 5 pixels to and fro, within a second; all that slips turns with the disk about the contact
    slip = 5 * np.sin(tracks.t) * np.exp(1j * tracks.angle)
    slipped = replace(tracks, centre=tracks.centre + slip)
    assert np.median(common_mode_errors(slipped, covariance(tracks, LOOK), camera)) < 0.003


@pytest.mark.parametrize(
    ("pivot", "drive"), [(PIVOT + 1.7, 0.034j), (PIVOT + 1.7j, 0.034j), (PIVOT - 2, 0.039j)]
)
def test_a_law_of_rolling_that_fails_is_no_noise(pivot: complex, drive: complex) -> None:
    # As where the wheels slip by a law of their own: no contact and no drive explain the motion.
    tracks, _ = rolled(np.random.default_rng(6), 0.01, 0.01, 0.0)
    result = common_mode_errors(
        tracks, covariance(tracks, LOOK), Camera(SCALE, 1.0, "given", pivot, 0.0, "given", drive)
    )
    assert result.max() < 0.008  # by second differences alone 0.1


def test_an_exposure_is_found_from_a_first_estimate_of_a_third() -> None:
    rng = np.random.default_rng(6)
    frames = []
    for _ in range(8):
        pose, rate = (
            Pose(complex(*rng.uniform(95, 105, 2)), rng.uniform(-3, 3)),
            complex(*rng.normal(0, 700, 2)),
        )
        spin, amount = rng.normal(0, 10), np.full((200, 200), LOOK.light[230])
        for mark in MARKS:
            seen = coverage(
                mark, pose.centre, pose.angle, Motion(0.01 * rate, 0.01 * spin), 0.8, (0, 200, 0, 200)
            )
            amount += mark.level * seen
        codes = np.searchsorted(LOOK.light, amount).astype(np.uint8)
        frames.append((codes, pose, lambda T, r=rate, s=spin: Motion(r * T, s * T)))
    result = again(frames, 0.003, LOOK, np.ones((200, 200), dtype=bool))
    assert result == pytest.approx(0.01, rel=0.03)  # codes are whole numbers, streaks ten pixels


def test_pixels_that_a_codec_copies_show_an_earlier_pose() -> None:
    """A codec refreshes an eighth of the marks in each frame of a slow disk, and once the disk jumps."""
    tracks, _ = rolled(np.random.default_rng(4), 0.0, 0.0, 0.0)
    step, n = 3e-4, len(tracks)
    angle = step * np.arange(n) + np.where(np.arange(n) > n // 2, 1.0, 0.0)
    slow = replace(tracks, centre=np.full(n, PIVOT), angle=angle - 3.5 * step, copied=np.full(n, 7 / 8))
    corrected, errors = without_lag(slow, LOOK.reach)
    settled = np.r_[60 : n // 2 - 1, n // 2 + 60 : n]
    np.testing.assert_allclose(corrected.angle[settled], angle[settled], atol=0.01 * step)
    np.testing.assert_allclose(errors[settled, 2], 7 * step / np.sqrt(12), rtol=0.01)
    assert (np.abs(corrected.angle - slow.angle) < 3.6 * step).all()  # a jump is no lag
    untouched, errors = without_lag(replace(slow, copied=np.zeros(n)), LOOK.reach)
    np.testing.assert_array_equal(untouched.angle, slow.angle)
    assert not errors.any()
