"""Standard errors of a disk's fit cover, where the friction's kink lies within a frame too."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import udd
from simulated import Camera, film

NAMES = ("k0", "k1", "k2", "W")


@functools.cache
def fitted(seed):
    """A fit of a simulated record, with the truth."""
    rng = np.random.default_rng([seed, 77])
    drive = rng.uniform(0.02, 0.08)
    truth = udd.Disk(drive)
    camera = Camera(
        offset=tuple(rng.normal(0, 1e-3, 2)),
        tilt=rng.normal(0, 0.015),
        scale=rng.normal(0, 0.003),
        lag=rng.normal(0, 3e-3),
        clock=rng.normal(0, 1e-3),
        row=rng.normal(0, 0.01),
    )
    measured, _ = film(truth, rng, 60.0, camera)
    baseline = {n: truth.parameters[n] for n in NAMES} | {
        "y0": camera.offset[0], "z0": camera.offset[1], "tilt": camera.tilt, "scale": camera.scale,
        "lag": camera.lag, "row": camera.row, "clock": camera.clock,
    }  # fmt: skip
    return udd.fit(measured, udd.Disk(drive * (1 + 0.03 * rng.standard_normal()))), baseline


def z_scores(seed):
    fit, baseline = fitted(seed)
    return {name: (fit.parameters[name] - value) / fit.errors[name] for name, value in baseline.items()}


def test_errors_of_fast_disks_cover():
    """Records whose k1 and k2 were off by 5 to 15 standard errors."""
    z = np.array([[z_scores(seed)[name] for name in NAMES] for seed in (14, 25, 27, 30, 36, 38, 41)])
    # The root mean square of 7 scores exceeds 1.9 by chance once in 1000 times.
    assert np.sqrt((z**2).mean(axis=0)).max() < 1.9


@pytest.mark.parametrize(
    ("records", "least", "most"),
    [
        # 25 scores have an rms of 1 +- 0.14, 100 scores one of 1 +- 0.07.
        pytest.param(25, 0.65, 1.35, marks=pytest.mark.slow),
        pytest.param(100, 0.82, 1.18, marks=[pytest.mark.slow, pytest.mark.nightly]),
    ],
)
def test_errors_cover(records: int, least: float, most: float) -> None:
    z = [z_scores(seed) for seed in range(records)]
    for name in z[0]:
        rms = np.sqrt(np.mean([score[name] ** 2 for score in z]))
        assert least < rms < most, (name, rms)


def test_noise_that_remembers_itself_is_whitened():
    """Frames whose noise goes together are worth less: the model stays tight, and errors still cover."""
    scores, memory = [], []
    for seed in range(8):
        rng = np.random.default_rng([seed, 78])
        truth = udd.Disk(rng.uniform(0.02, 0.08))
        measured, _ = film(truth, rng, 60.0, Camera(memory=0.5))
        fit = udd.fit(measured, udd.Disk(1.02 * truth.W))
        scores.append([(fit.parameters[n] - truth.parameters[n]) / fit.errors[n] for n in NAMES])
        memory.append(fit.noise.memory)
    # One record's autocorrelation is known to 0.02 to 0.03; odd frames that are not weighted down dilute it.
    np.testing.assert_allclose(np.mean(memory, axis=0), 0.5, atol=0.1)
    # The rms of 32 scores exceeds 1.4 by chance once in 3000 times.
    assert np.sqrt(np.mean(np.square(scores))) < 1.4
    white, _ = film(udd.Disk(0.04), np.random.default_rng(5), 60.0)
    assert (udd.fit(white, udd.Disk(0.04)).noise.memory == 0.0).all()
