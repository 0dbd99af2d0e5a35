"""A disk that turns out of its plane is seen in its marks' foreshortening; one that does not is not."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("av", reason="the tracker's extra is not installed")
pytest.importorskip("cv2", reason="the tracker's extra is not installed")

import udd
from udd.film import Defects
from udd.tracking import track_disk
from udd.tracking.geometry.lens import calibrate
from udd.tracking.geometry.pose import DiskAppearance, Mark
from udd.tracking.passes.tracks import Tracks, lost_in
from udd.tracking.passes.wobble import wobble


def tracks(amplitude: float, noise: float, axis: float = 0.0, n: int = 400) -> tuple[Tracks, DiskAppearance]:
    """Residuals of four marks 100 pixels out on a disk that turns and wobbles, exactly and with noise."""
    rng = np.random.default_rng(2)
    t = np.arange(n) / 25
    angle = 3 * np.sin(2 * t) + t
    short = np.cos(amplitude * np.sin(2 * np.pi * t / 1.3)) - 1
    normal = np.exp(1j * axis)  # across the axis
    places = 100 * np.array([-1j, 1, 1j, -1])
    residuals = []
    for k in range(n):
        arm = places * np.exp(1j * angle[k])
        seen = arm + short[k] * normal * (arm * np.conj(normal)).real
        seen = seen + noise * (rng.normal(size=4) + 1j * rng.normal(size=4))
        turn = np.vdot(arm, seen - seen.mean())
        rest = seen - seen.mean() - arm * turn / abs(turn)
        residuals.append(np.column_stack([rest.real, rest.imag]))
    frames = [replace(lost_in(t[k], "", 1.0, 4), angle=angle[k], residuals=residuals[k]) for k in range(n)]
    out = Tracks.of(frames)
    marks = [Mark(complex(z), (10.0, 10.0), 0.0, -50.0) for z in places]
    return out, DiskAppearance(marks, 0.7, 1.0, np.arange(256.0), 140.0)


@pytest.mark.parametrize(("degrees", "axis"), [(10.0, 0.0), (5.0, 0.6), (3.0, -0.4)])
def test_amplitude_and_axis(degrees: float, axis: float) -> None:
    correction = wobble(*tracks(math.radians(degrees), 0.03, axis))
    assert abs(correction.amplitude - math.radians(degrees)) < 3 * correction.sigma < math.radians(1.5)
    assert abs(np.angle(np.exp(2j * (correction.axis - axis)))) / 2 < math.radians(6)  # tried 5 degrees apart
    assert correction.least < correction.amplitude


def test_noise_is_no_wobble() -> None:
    for noise in (0.01, 0.1, 1.0):
        correction = wobble(*tracks(0.0, noise))
        assert correction.amplitude == 0 and correction.least > 0


def test_too_few_marks_or_frames_say_nothing() -> None:
    few, look = tracks(0.17, 0.03, n=20)
    assert wobble(few, look).least == math.inf


def filmed(path: Path, degrees: float) -> udd.Measurement:
    run = udd.simulate(udd.Disk(0.039), np.arange(0, 4, 0.005), [1, 0.02, -0.02, 0.3], dense=True)
    film = udd.render(run, path, size=(276, 350), defects=Defects(wobble=math.radians(degrees)))
    return track_disk(film.path, refine=True).measurement


def test_a_films_wobble_is_told_with_its_uncertainty(tmp_path: Path) -> None:
    m = filmed(tmp_path / "wobble.mp4", 10)
    off = float(m.meta["wobble"]) - math.radians(10)
    assert abs(off) < 3 * float(m.meta["wobble_sigma"]) < math.radians(2)
    assert m.meta["calibration"]["wobble"][2] == "found"
    assert abs(np.angle(np.exp(2j * float(m.meta["wobble_axis"])))) < 0.35  # the maker's axis is the vertical


def test_a_film_without_says_none(tmp_path: Path) -> None:
    m = filmed(tmp_path / "flat.mp4", 0)
    assert m.meta["wobble"] == 0
    assert m.meta["calibration"]["wobble"][2].startswith("none seen (less than ")


def test_the_wobble_of_a_disk_that_hardly_moves_is_no_lens() -> None:
    """A lens with the curvature -0.45 was fitted, and made the scale 5 % wrong."""
    rng = np.random.default_rng(3)
    t = 0.04 * np.arange(17)
    place = 240 + 270j + 12 * np.sin(2 * np.pi * t / 1.3) * (1 + 0.2j)
    angle = 2.6 + 0.1 * np.sin(2 * np.pi * t / 1.3)
    short = np.cos(0.1 * np.sin(2 * np.pi * t / 1.3 + 0.4))
    arms = 110 * np.array([-1j, 1, 1j, -1]) * np.exp(1j * angle)[:, None]
    seen = place[:, None] + short[:, None] * arms.real + 1j * arms.imag
    seen += 0.02 * (rng.normal(size=seen.shape) + 1j * rng.normal(size=seen.shape))
    assert abs(calibrate(seen, (700, 550)).lens.curve) < 0.01
