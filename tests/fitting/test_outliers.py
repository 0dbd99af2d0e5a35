"""A few gross outliers, such as glitches of a tracker or codes for missing values, change no result."""

from __future__ import annotations

import numpy as np
import pytest

import udd

T = np.arange(0, 20, 0.05)
SPRING = udd.Model(["x", "v"], ["v", "-k*x - c*v"], {"k": 4.0, "c": 0.1})
FRAMES = [50, 180, 300, 396]


def spring(size: float, frames: list[int] = FRAMES) -> udd.Measurement:
    x = np.array(udd.simulate(SPRING, T, [1.0, 0.0]).x) + 0.01 * np.random.default_rng(1).normal(size=len(T))
    x[frames] += size
    return udd.Measurement(T, {"x": x})


def swing(size: float) -> udd.Measurement:
    theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), T, [0.0, 0.5]).state[:, 1]
    theta = theta + 1e-3 * np.random.default_rng(1).normal(size=len(T))
    theta[FRAMES] += size
    return udd.Measurement(T, {"theta": theta})


@pytest.mark.parametrize("size", [0.2, 1.0, 30.0, 1e6])
def test_outliers_of_a_models_own_column_do_not_hurt(size: float) -> None:
    clean, result = (udd.fit(spring(s), SPRING) for s in (0.0, size))
    assert not result.doubts.missing
    assert 0.8 < result.scatter < 1.3
    for name, error in clean.errors.items():
        # Four of 400 frames are left out.
        assert abs(result.parameters[name] - clean.parameters[name]) < 0.5 * error
        assert 0.9 < result.errors[name] / error < 1.2
    assert 0.9 < result.noise_sd[0, 0] / clean.noise_sd[0, 0] < 1.1


@pytest.mark.parametrize("size", [0.3, 1.5, 100.0])
def test_outliers_of_a_filmed_pendulum_do_not_hurt(size: float) -> None:
    clean, result = (udd.fit(swing(s), udd.Pendulum(1.0, k0=0.03)) for s in (0.0, size))
    assert not result.doubts.missing
    assert 0.8 < result.scatter < 1.3
    assert abs(result.parameters["k0"] - clean.parameters["k0"]) < 0.5 * clean.errors["k0"]
    assert 0.9 < result.errors["k0"] / clean.errors["k0"] < 1.2


def test_an_outlier_at_the_end_that_the_fit_alone_shows_does_not_hurt() -> None:
    """It is no longer than 20 steps from the frames before."""
    measured = swing(0.0)
    theta = measured["theta"].copy()
    theta[-1] += 0.4
    clean, ahead = (
        udd.forecast(m, udd.Pendulum(1.0, k0=0.03), 2.0, members=40)
        for m in (measured, udd.Measurement(T, {"theta": theta}))
    )
    assert not ahead.fit.record.odd.any()
    assert ahead.fit.noise.weight[-1] == 0.0
    assert 0.8 < ahead.fit.scatter < 1.3
    assert np.abs(ahead.median - clean.median).max() < 2e-3


@pytest.mark.parametrize("size", [1.0, 1e6])
def test_a_forecast_ignores_an_outlier_in_its_window(size: float) -> None:
    clean, result = (udd.forecast(spring(s), SPRING, 4.0, start=19.95, members=60) for s in (0.0, size))
    width, median = (result.high - result.low)[-1, 0], result.median[-1, 0]
    assert 0.7 < width / (clean.high - clean.low)[-1, 0] < 1.6
    assert abs(median - clean.median[-1, 0]) < 0.02
    # The unit of the error is the spread of the motion.
    assert result.valid_time == clean.valid_time


@pytest.mark.parametrize("frames", [[0], [1], [-2], [-1], [0, -1]])
def test_outliers_at_an_end_do_not_hurt(frames: list[int]) -> None:
    clean, result = (udd.forecast(spring(size, frames), SPRING, 2.0, members=60) for size in (0.0, 30.0))
    assert not result.fit.doubts.missing
    assert 0.8 < result.fit.scatter < 1.3
    for name, error in clean.fit.errors.items():
        assert abs(result.fit.parameters[name] - clean.fit.parameters[name]) < 0.5 * error
    assert np.abs(result.median - clean.median).max() < 0.02
    assert np.flatnonzero(result.fit.record.odd).tolist() == sorted(k % len(T) for k in frames)


@pytest.mark.parametrize("rate", [1.0, 2.0, 3.0])
def test_a_fast_transient_is_no_outlier(rate: float) -> None:
    decay = udd.Model(["x"], ["-k*x"], {"k": rate})
    t = np.arange(0, 40, 1.0)
    x = np.array(udd.simulate(decay, t, [100.0]).x) + 0.01 * np.random.default_rng(0).normal(size=len(t))
    result = udd.fit(udd.Measurement(t, {"x": x}), decay.with_parameters({"k": 0.8 * rate}))
    assert abs(result.parameters["k"] - rate) < 4 * result.errors["k"] < 0.1
