"""Times of a constant rate that a container or a table rounds, and rates that truly vary."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import udd
from udd._util.steady_clock import steady_clock

RATES = [24000 / 1001, 25, 30000 / 1001, 30, 50, 60000 / 1001, 60, 120000 / 1001, 120, 240, 61.7]


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("rounding", [1e-3, 1e-4, 1 / 600])
@pytest.mark.parametrize("lost", [0.0, 0.05])
@pytest.mark.parametrize("n", [20, 400])
def test_a_rounded_constant_rate_is_recognised(rate, rounding, lost, n):
    random = np.random.default_rng(n)
    number = np.flatnonzero(random.random(n) >= lost)
    exact = number / rate
    t = np.round(exact / rounding) * rounding
    clock = steady_clock(t, rounding)
    if clock is None:  # no rounding shows: 25 Hz in ms; or it is too coarse to know how many are missing
        line = np.polyval(np.polyfit(number, t, 1), number)
        assert np.abs(t - line).max() < 1e-9 or (lost and rounding * rate > 0.25)
        return
    result = clock.all_at(t)
    assert np.abs(result - t).max() <= 0.51 * rounding
    assert np.ptp(result - exact) < rounding / 2 or n < 50
    assert 1 / clock.period == pytest.approx(rate, rel=4 * rounding / exact[-1])


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("rate", [25, 30, 60])
def test_a_rate_that_varies_stays(seed, rate):
    """A phone whose frames take longer in the dark, one that shakes by 2 ms, one that drifts."""
    random, n = np.random.default_rng(seed), 200
    even = np.arange(n) / rate
    for truth in (
        even + 2e-3 * random.standard_normal(n),
        np.cumsum(np.where(np.arange(n) < 120, 1 / rate, 1.1 / rate)),
        even + 5e-3 * np.sin(2 * np.pi * even / 3),
    ):
        assert steady_clock(np.sort(np.round(truth, 3))) is None


@pytest.mark.parametrize(
    "t",
    [np.arange(50) / 60, np.arange(50) * 0.04, np.round(np.arange(50) / 60, 6), np.arange(9) // 2 * 0.5, []],
)
def test_exact_times_stay(t):
    assert steady_clock(np.array(t, dtype=float)) is None


def swing(t: np.ndarray) -> udd.Measurement:
    theta = udd.simulate(udd.Pendulum(0.8, k0=0.01), t, [0.0, 0.5]).state[:, 1]
    noise = 1e-4 * np.random.default_rng(7).standard_normal(len(t))
    return udd.Measurement(t, {"theta": theta + noise}, sigma=np.full((len(t), 1), 1e-4))


def test_nothing_is_missing_in_a_table_whose_times_are_rounded(tmp_path: Path):
    exact = swing(np.arange(240) / 60)
    rows = np.column_stack([exact.t, exact.values, exact.sigma])
    np.savetxt(tmp_path / "ms.csv", rows, fmt=["%.3f", "%.7f", "%.1e"], delimiter=",",
               header="t,theta,sigma_theta", comments="")  # fmt: skip
    read = udd.read_measurement(tmp_path / "ms.csv")
    assert np.abs(read.t - exact.t).max() < 1e-9
    assert read.meta["clock"] == "times are rounded to 1 ms: they are taken as those of 60 Hz"
    right, result = udd.fit(exact, udd.Pendulum(0.8)), udd.fit(read, udd.Pendulum(0.8))
    assert not result.doubts.missing and read.meta["clock"] in result.summary()
    assert result.parameters["k0"] == pytest.approx(right.parameters["k0"], abs=0.1 * right.errors["k0"])
    assert result.errors["k0"] == pytest.approx(right.errors["k0"], rel=0.05)
    # A table that the package writes is read back unchanged.
    read.to_csv(tmp_path / "again.csv")
    assert np.array_equal(udd.read_measurement(tmp_path / "again.csv").t, read.t)


def test_arrays_with_rounded_times_are_fitted_as_they_were_taken():
    """An input that was sampled with the rows goes with them."""
    exact = swing(np.arange(240) / 60)
    baseline = udd.Model(
        ["theta", "v"],
        ["v", "-k*sin(theta) - c*v + u"],
        {"k": 12.0, "c": 0.02},
        angles=["theta"],
        inputs=["u"],
    )
    rounded = udd.Measurement(np.round(exact.t, 3), {"theta": exact["theta"]}, exact.sigma,
                              inputs={"u": np.zeros(240)})  # fmt: skip
    result = udd.fit(rounded, baseline)
    assert not result.doubts.missing
    assert np.abs(result.measurement.t - exact.t).max() < 1e-9
    assert result.measurement.on_rows("u")
