"""Gross outliers, single or in blocks, such as glitches of a tracker or codes, change no result."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.fitting.outliers import odd_frames

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


def block(frames: list[int], inside: str, size: float) -> udd.Measurement:
    """Return the film of a swing whose tracker was wrong in these frames."""
    theta = swing(0.0)["theta"].copy()
    rng, t = np.random.default_rng(2), np.arange(len(frames))
    theta[frames] = {
        "reflection": theta[frames] + size,
        "code": np.full(len(frames), size),
        "lost": size * rng.choice([-1, 1], len(frames)) * rng.uniform(1, 2, len(frames)),
        "another mark": size + 0.3 * size * np.sin(0.2 * t),
    }[inside]
    return udd.Measurement(T, {"theta": theta})


@pytest.mark.parametrize(
    ("frames", "inside", "size"),
    [
        ([120, 121], "reflection", 0.6),
        ([300, 301, 302], "reflection", 30.0),
        ([50, 51, 52, 53, 200, 204], "reflection", 1.0),
        (list(range(200, 220)), "another mark", 2.0),
        (list(range(60, 68)), "lost", 2.0),
        (list(range(150, 210)), "code", 9999.0),
        (list(range(20)), "code", -999.0),
    ],
)
def test_blocks_of_outliers_of_a_film_do_not_hurt(frames: list[int], inside: str, size: float) -> None:
    model = udd.Pendulum(1.0, k0=0.03)
    clean, result = (udd.fit(measured, model) for measured in (swing(0.0), block(frames, inside, size)))
    assert not result.doubts.missing
    assert np.flatnonzero(result.noise.weight == 0.0).tolist() == frames
    share = np.sqrt(len(T) / (len(T) - len(frames)))
    assert abs(result.parameters["k0"] - clean.parameters["k0"]) < 1.2 * clean.errors["k0"]
    assert 0.9 < result.errors["k0"] / clean.errors["k0"] < 1.3 * share


def test_a_block_in_one_of_two_columns_with_gaps_and_uneven_stamps() -> None:
    rng = np.random.default_rng(4)
    t = np.delete(T + rng.uniform(-0.01, 0.01, len(T)), [100, 101, 251])
    t -= t[0]
    motion = udd.simulate(SPRING, t, [1.0, 0.0]).state
    seen = motion + 0.01 * rng.normal(size=motion.shape)
    wrong = seen.copy()
    wrong[200:215, 1] = -8.0 + 0.01 * rng.normal(size=15)
    clean, result = (udd.fit(udd.Measurement(t, {"x": s[:, 0], "v": s[:, 1]}), SPRING) for s in (seen, wrong))
    record = result.record
    assert not clean.record.odd.any()
    assert record.row[record.odd].tolist() == list(range(200, 215))
    for name, error in clean.errors.items():
        assert abs(result.parameters[name] - clean.parameters[name]) < error


def bouncing(t: np.ndarray) -> np.ndarray:
    """Return the height of a ball that keeps 0.8 of its speed."""
    x = np.empty(len(t))
    start, speed = 0.0, 4.0
    for k, now in enumerate(t):
        while now > start + 2 * speed / 9.81:
            start, speed = start + 2 * speed / 9.81, 0.8 * speed
        x[k] = speed * (now - start) - 9.81 * (now - start) ** 2 / 2
    return x


KICKS = np.where(np.arange(0, 12, 0.02) < 5.0, 0.0, np.arange(0, 12, 0.02) - 5.0)
EVENTS = {
    "bounces": bouncing(np.arange(0, 3, 0.01)),
    "a kick": np.sin(2 * np.arange(0, 12, 0.02)) + 3 * KICKS * np.exp(-KICKS),
    "a step": 0.02 * np.sin(np.arange(0, 12, 0.02)) + np.where(KICKS > 0, 1.0, 0.0),
    "a stop": np.where(KICKS > 0, np.cos(5.0), np.cos(np.arange(0, 12, 0.02))),
}


@pytest.mark.parametrize("noise", [1e-5, 1e-3])
@pytest.mark.parametrize("name", EVENTS)
def test_events_of_a_motion_are_no_outliers(name: str, noise: float) -> None:
    x = EVENTS[name] + noise * np.random.default_rng(0).normal(size=len(EVENTS[name]))
    t, linked = 0.02 * np.arange(len(x)), np.ones(len(x) - 1, dtype=bool)
    # A weak kick in this noise cannot be distinguished from an outlier.
    most = 1 if (name, noise) == ("a kick", 1e-3) else 0
    assert odd_frames(t, x[:, None], np.array([noise]), linked).sum() <= most


def test_an_outlier_on_a_curved_motion_is_no_kick() -> None:
    """Between the lines through its two sides lies an outlier, too, if both sides are curved."""
    phase = 0.6 * np.arange(600)
    linked, rng = np.ones(599, dtype=bool), np.random.default_rng(2)
    steep = np.flatnonzero(np.abs(np.sin(phase)) < 0.15)[5:-5]
    detected = []
    for place in steep:
        x = 60 * np.sin(phase) + rng.normal(size=600)
        x[place] += 16.0
        detected.append(odd_frames(0.04 * np.arange(600), x[:, None], np.ones(1), linked)[place])
    assert np.mean(detected) > 0.9


LONG = np.arange(0, 20, 0.02)
SINCE = np.maximum(LONG - 5.0, 0.0)
LEVELS = np.round(2 * np.exp(-LONG / 3) * np.sin(2 * LONG)) / 2
#: Motions with their noise, that a detector of jumps or of codes must leave alone.
CLEAN = {
    "two pulses": (sum(np.exp(-(((LONG - c) / 0.04) ** 2) / 2) for c in (5.0, 12.3)), 1e-7),
    "two narrow pulses": (sum(np.exp(-(((LONG - c) / 0.02) ** 2) / 2) for c in (5.006, 12.314)), 1e-4),
    "a burst": (np.sin(30 * SINCE) * np.exp(-SINCE / 0.03), 1e-7),
    "a few levels": (LEVELS, 0.0),
}


@pytest.mark.parametrize("name", CLEAN)
def test_a_block_that_begins_gradually_is_a_part_of_the_motion(name: str) -> None:
    x, noise = CLEAN[name]
    x = x + noise * np.random.default_rng(0).normal(size=len(x))
    odd = odd_frames(LONG, x[:, None], np.array([noise + 1e-7]), np.ones(len(x) - 1, dtype=bool))
    # The narrowest part of a motion may lose a frame on each side.
    assert odd.sum() <= {"two narrow pulses": 4, "a burst": 1}.get(name, 0)


@pytest.mark.parametrize("rest", [300, 500, 800])
@pytest.mark.parametrize("is_first", [True, False])
def test_a_level_at_which_the_motion_rests_is_no_code(rest: int, is_first: bool) -> None:
    x = 5 + 0.1 * np.sin(2 * LONG) + 0.01 * np.random.default_rng(0).normal(size=len(LONG))
    x[:rest] = -9.0
    x = x if is_first else x[::-1].copy()
    # An exact rest does not show the noise.
    assert not odd_frames(LONG, x[:, None], np.array([1e-5]), np.ones(len(x) - 1, dtype=bool)).any()


@pytest.mark.parametrize("noise", [1e-7, 1e-3])
def test_fast_switches_that_recur_are_no_outliers(noise: float) -> None:
    """Some last as long as a block of outliers, others are longer."""
    relaxing = udd.Model(["x", "v"], ["v", "mu*(1 - x^2)*v - x"], {"mu": 50.0})
    t = np.arange(0, 400, 2.0)
    x = udd.simulate(relaxing, t, [2.0, 0.0]).state[:, 0]
    x = x + noise * np.random.default_rng(0).normal(size=len(t))
    odd = odd_frames(t, x[:, None], np.array([noise]), np.ones(len(t) - 1, dtype=bool))
    assert not odd.any()


@pytest.mark.parametrize("step", [0.1, 0.15])
def test_spikes_of_a_motion_are_no_outliers(step: float) -> None:
    relaxing = udd.Model(["x", "v"], ["v", "mu*(1 - x^2)*v - x"], {"mu": 10.0})
    t = np.arange(0, 100, step)
    x = udd.simulate(relaxing, t, [1.0, 1.0]).state[:, 0]
    noise = 0.01 * np.random.default_rng(0).normal(size=len(t))
    result = udd.fit(udd.Measurement(t, {"x": x + noise}), relaxing.replace(mu=9.0))
    assert abs(result.parameters["mu"] - 10.0) < 4 * result.errors["mu"] < 0.01


def test_uneven_stamps_are_no_outliers() -> None:
    rng = np.random.default_rng(5)
    t = np.sort(T + rng.uniform(-0.04, 0.04, len(T)))
    linked = np.ones(len(t) - 1, dtype=bool)
    for phase in np.linspace(0, 3, 20):
        x = 0.5 * np.sin(3 * t + phase) + 1e-3 * rng.normal(size=len(t))
        assert not odd_frames(t, x[:, None], np.array([1e-3]), linked).any()
