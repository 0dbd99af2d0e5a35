"""A column with a single value does not show its noise."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.errors import FitError
from udd.fitting import record_of

T = np.arange(0, 10, 0.05)
STEP = 2 * np.pi / 1024
SPRING = udd.Model(["x", "v"], ["v", "-k*x - c*v"], {"k": 4.0, "c": 0.1})


def swing() -> np.ndarray:
    return np.asarray(udd.simulate(SPRING, T, [1.0, 0.0]).x) + 0.01 * np.random.default_rng(0).normal(
        size=len(T)
    )


def test_an_encoder_at_rest_is_refused_with_a_sentence() -> None:
    theta = udd.simulate(udd.Pendulum(1.0), T, [0.0, 0.5]).state[:, 1]
    moving, rest = (
        udd.Measurement(T, {"theta": STEP * np.round(angle / STEP)}, meta={"sensor": "encoder"})
        for angle in (theta, np.full(len(T), 0.1))
    )
    with pytest.raises(FitError, match="theta has a single value in all rows of measurement 1"):
        udd.fit([moving, rest], udd.Pendulum(1.0))


@pytest.mark.parametrize("value", [0.0, 0.3])
def test_a_sensor_that_shows_a_single_value_is_refused(value: float) -> None:
    stuck = np.full(len(T), value)
    with pytest.raises(FitError, match="x has a single value in all rows of measurement 1"):
        udd.fit([udd.Measurement(T, {"x": x}) for x in (swing(), stuck)], SPRING)
    with pytest.raises(FitError, match="v has a single value in all rows, which"):
        udd.fit(udd.Measurement(T, {"x": swing(), "v": stuck}), SPRING)
    sigma = np.full((len(T), 1), 0.01)
    stated = [udd.Measurement(T, x[:, None], sigma, names=("x",)) for x in (swing(), 0.0 * T)]
    assert abs(udd.fit(stated, SPRING).parameters["k"] - 4.0) < 0.1


def test_short_records_with_a_single_value_do_not_reduce_the_noise_of_the_others() -> None:
    some = slice(0, 25)
    moving, rest = (udd.Measurement(T[some], {"x": x[some]}) for x in (swing(), 0.0 * T))
    alone, both = record_of(moving, SPRING), record_of([moving, moving, rest], SPRING)
    assert both.sigma.min(where=both.observed, initial=1.0) == pytest.approx(
        np.median(alone.sigma[alone.observed])
    )
