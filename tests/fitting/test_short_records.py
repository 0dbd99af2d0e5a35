"""Many short records: what a fit needs, all of them need together."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.errors import FitError

SPRING = udd.Model(["x", "v"], ["v", "-k*x - c*v"], {"k": 9.0, "c": 0.1})


def records(number: int, frames: int, noise: float = 1e-2) -> list[udd.Measurement]:
    random, t = np.random.default_rng(1), 0.1 * np.arange(frames)
    result = []
    for _ in range(number):
        start = [random.uniform(-1, 1), random.uniform(-3, 3)]
        x = udd.simulate(SPRING, t, start).state[:, 0]
        result.append(udd.Measurement(t, {"x": x + noise * random.standard_normal(frames)}))
    return result


def test_many_short_records_are_fitted_together():
    many = records(20, 8)
    result = udd.fit(many, SPRING.with_parameters({"k": 8.0, "c": 0.2}))
    for name, value in (("k", 9.0), ("c", 0.1)):
        assert abs(result.parameters[name] - value) < 3.5 * result.errors[name] and result.errors[name] < 0.1
    assert not result.doubts.missing and 0.5 < result.scatter < 1.6
    # The noise is that of all, not what eight frames happen to show.
    sd = result.noise.sd(result.record, result.blurring)[:, 0]
    assert np.ptp(sd) < 1e-9 and sd.mean() == pytest.approx(1e-2, rel=0.3)


def test_short_records_of_a_pendulum_and_one_at_rest():
    t = 0.1 * np.arange(8)
    random = np.random.default_rng(2)
    many = []
    for amplitude in random.uniform(-1, 1, 12):
        theta = udd.simulate(udd.Pendulum(0.8, k0=0.01), t, [0.0, amplitude]).state[:, 1]
        many.append(udd.Measurement(t, {"theta": theta + 1e-3 * random.standard_normal(8)}))
    result = udd.fit(many, udd.Pendulum(0.82), camera=False)
    pace = result.parameters["length"] / result.parameters["inertia"]
    assert pace == pytest.approx(1 / 0.8, rel=0.01)
    still = udd.Measurement(t, {"x": np.zeros(8)})
    assert udd.fit([*records(6, 8), still], SPRING).converged


def test_what_is_too_short_together_or_alone_is_refused():
    with pytest.raises(FitError, match="the measurement holds 8 usable frames; a fit needs at least 10"):
        udd.fit(records(1, 8)[0], SPRING)
    with pytest.raises(FitError, match="the measurements hold 8 usable frames; a fit needs at least 10"):
        udd.fit(records(2, 4), SPRING)
    with pytest.raises(
        FitError, match=r"holds 3 usable frames; in a joint fit each measurement needs at least 4"
    ):
        udd.fit(records(20, 3), SPRING)
    with pytest.raises(FitError, match="all values are constant"):
        udd.fit([udd.Measurement(np.arange(8.0), {"x": np.zeros(8)})] * 3, SPRING)
