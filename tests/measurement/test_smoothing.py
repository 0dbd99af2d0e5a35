"""The smoother against runs with known noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import udd
from udd.cli import main
from udd.errors import UddError
from udd.measurement import Measurement

SIGMA = np.array([5e-4, 5e-4, 7e-3])  # m, m, rad: a frame measured by thresholds and centroids
Array = NDArray[np.float64]


def noisy(seed: int = 1, n: int = 500, fps: float = 50.0) -> tuple[Measurement, Array]:
    """A run of the paper's disk with correlated noise, and its truth."""
    t = np.arange(n) / fps
    truth = udd.simulate(udd.Disk(0.039), t, [0, -1e-3, 0.04, 0]).state[:, 1:]
    rho = np.array([0.3, -0.2, 0.4])  # Y-Z, Y-beta, Z-beta
    shape = np.array([[1, rho[0], rho[1]], [rho[0], 1, rho[2]], [rho[1], rho[2], 1]])
    rng = np.random.default_rng(seed)
    values = truth + rng.normal(size=(n, 3)) @ np.linalg.cholesky(shape).T * SIGMA
    return Measurement(t, values, np.tile(SIGMA, (n, 1)), np.tile(rho, (n, 1))), truth


def normalised(m: Measurement, truth: Array) -> Array:
    assert m.sigma is not None
    return np.asarray(np.sqrt((((m.values - truth) / m.sigma) ** 2).mean(axis=0)))


@pytest.mark.parametrize("slip", [None, 1e-3])
def test_errors_shrink_and_are_what_they_are_said_to_be(slip: float | None) -> None:
    m, truth = noisy()
    quiet = udd.smooth(m, slip=slip)
    before, after = (np.sqrt(((x.values - truth) ** 2).mean(axis=0)) for x in (m, quiet))
    # the motion is followed over 3 to 5 frames, whose mean has 0.45 to 0.6 of the error of one
    assert np.all(after < 0.7 * before), after / before
    ratio = normalised(quiet, truth)
    # one strength of the jerk for calm and for fast turns alike errs to the safe side, and so does a slip
    # allowed to a run that has none
    assert np.all(ratio < 1.2) and np.all(ratio > (0.8 if slip is None else 0.7)), ratio
    if slip is not None:
        alone = np.sqrt(((udd.smooth(m).values - truth) ** 2).mean(axis=0))
        assert after[1] < alone[1]  # Z = Y' / Omega: what the constraint can tell


def test_long_gaps_stay_empty_and_short_ones_are_filled_but_flagged() -> None:
    m, truth = noisy()
    values, flag = m.values.copy(), m.flag.astype("<U20")
    hidden = np.zeros(len(m), dtype=bool)
    hidden[[0, 499]] = hidden[100:103] = hidden[200:240] = True
    values[hidden], flag[hidden] = np.nan, "lost"
    flag[300] = "dup"  # has a value, which must not count
    values[300] += 1.0
    broken = Measurement(m.t, values, m.sigma, m.rho, flag)
    quiet = udd.smooth(broken)
    empty = np.isnan(quiet.values).any(axis=1)
    assert np.flatnonzero(empty).tolist() == [0, *range(200, 240), 499]
    assert quiet.flag.tolist() == flag.tolist() and quiet.seen.sum() == broken.seen.sum()
    assert quiet.sigma is not None and np.isnan(quiet.sigma[empty]).all()
    # what fills a gap is unsure, and says so
    assert np.all(quiet.sigma[101] > quiet.sigma[95])
    assert np.all(np.abs(quiet.values - truth)[[101, 300]] < 4 * quiet.sigma[[101, 300]])
    assert not np.isnan(udd.smooth(broken, gap=1.0).values[200:240]).any()
    # nothing passes through a long gap
    after = broken.values.copy()
    after[240:] += 0.5
    moved = udd.smooth(Measurement(m.t, after, m.sigma, m.rho, flag))
    np.testing.assert_allclose(moved.values[:200], quiet.values[:200], rtol=0, atol=1e-9)


def test_what_cannot_be_smoothed_is_refused() -> None:
    m, _ = noisy(n=20)
    with pytest.raises(UddError, match="no standard errors"):
        udd.smooth(Measurement(m.t, m.values))
    with pytest.raises(UddError, match="gap must be above 0"):
        udd.smooth(m, gap=0.0)
    with pytest.raises(UddError, match="slip is for a disk"):
        udd.smooth(Measurement(m.t, m["beta"], SIGMA[2] * np.ones(20)), slip=1e-3)


def test_the_command_smooths_what_it_tracked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    m, _ = noisy(n=60)
    monkeypatch.setattr("udd.tracking.pipeline.run_tracker", lambda *_, **__: m)
    out = tmp_path / "m.csv"
    assert main(["track", "film.mp4", "--smooth", "--slip", "1e-3", "--out", str(out)]) == 0
    written = udd.read_measurement(out)
    np.testing.assert_array_equal(written.values, udd.smooth(m, slip=1e-3).values)
    assert written.meta["smoothed_slip"] == 1e-3
    capsys.readouterr()
    assert main(["track", "film.mp4", "--slip", "1e-3"]) == 1
    assert "--slip is an option of --smooth" in capsys.readouterr().err
