"""The uncertainty budget of a fit: shares that add up, and what they are when only one source is there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

import simulated
import udd
from udd.errors import FitError, UddError


@pytest.fixture(scope="module")
def fitted() -> udd.Fit:
    measured, _ = simulated.film(udd.Disk(0.042), np.random.default_rng(3), 30.0)
    return udd.fit(measured, udd.Disk(0.042))


def test_contributions_add_up_to_the_standard_errors(fitted: udd.Fit) -> None:
    result = fitted.budget(fixed={})
    assert result.sources[0] == "noise" and {"camera", "scale", "W"} <= set(result.sources)
    for name in ("k0", "k1", "k2", "W"):
        # C = C N C + C P C is exact.
        assert result.standard[name] == pytest.approx(fitted.errors[name], rel=1e-9)
        assert result.expanded[name] == 2 * result.standard[name]
    np.testing.assert_allclose(result.shares.sum(axis=1), 1.0, rtol=1e-12)


def test_a_number_that_the_frames_do_not_tell_is_its_prior(fitted: udd.Fit) -> None:
    measured = fitted.measurement
    fixed = udd.fit(measured, udd.Disk(0.042), free=["k0", "W"], priors={"W": (0.042, 1e-9)})
    result = fixed.budget(fixed={})
    k = result.sources.index("W")
    assert result.shares[list(result.values).index("W"), k] == pytest.approx(1.0, abs=1e-3)


def test_what_was_held_contributes_as_a_fit_with_another_value_moves(fitted: udd.Fit) -> None:
    result = fitted.budget(fixed={"g": 0.02})
    other = udd.fit(fitted.measurement, udd.Disk(0.042, g=9.81 + 0.02))
    k = result.sources.index("g")
    for i, name in enumerate(result.values):
        moved = abs(other.parameters[name] - fitted.parameters[name])
        # The other fit estimates its noise again, which moves it by a few hundredths of a standard error.
        assert result.contributions[i, k] == pytest.approx(moved, abs=0.1 * fitted.errors[name])
    # Gravity is a scale of length over time squared; it dominates the uncertainty of friction.
    assert result.standard["k0"] > fitted.errors["k0"]


def test_the_table_has_a_row_for_each_number_and_a_column_for_each_source(fitted: udd.Fit) -> None:
    head, *rows = str(fitted.budget()).splitlines()
    assert [row.split()[0] for row in rows] == ["k0", "k1", "k2", "W"]
    assert all(source in head for source in ("noise", "camera", "scale", "R", "g"))


@pytest.mark.parametrize(
    ("held", "k", "words"),
    [
        ({"W": 1e-3}, 2.0, "W was free"),
        ({"mass": 1.0}, 2.0, "no parameter 'mass'"),
        ({"g": -1.0}, 2.0, "g"),
        ({}, 0.0, "k"),
    ],
)
def test_a_budget_that_cannot_be_made_says_why(
    fitted: udd.Fit, held: Mapping[str, float], k: float, words: str
) -> None:
    with pytest.raises((FitError, UddError), match=words):
        fitted.budget(held, k)


def test_what_was_free_is_not_among_what_was_fixed(fitted: udd.Fit) -> None:
    fixed = udd.fit(fitted.measurement, udd.Disk(0.042), free=["k0", "g"])
    assert "g" in fitted.budget().sources and "g" not in fixed.budget().sources


def test_a_budget_of_what_a_search_found_says_what_the_model_may_miss() -> None:
    """As that of a fit: its errors contain the doubt, which the budget shows apart."""
    t = np.arange(0, 60, 0.05)
    truth = udd.Pendulum(1.0, k0=0.01, effects=[udd.effects.quadratic_drag(c=0.3)])
    theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1]
    noise = 1e-4 * np.random.default_rng(0).standard_normal(len(t))
    measured = udd.Measurement(t, {"theta": theta + noise}, sigma=np.full((len(t), 1), 1e-4))
    result = udd.discover(measured, udd.Pendulum(1.0, k0=0.03), budget=1e-3)
    assert result.stopped and result.fit.doubts.missing
    assert result.fit.widened == result.fit.doubts.factor > 10
    budget = result.fit.budget(fixed={})
    assert budget.standard["k0"] == pytest.approx(result.fit.errors["k0"], rel=1e-9)
    assert "model error" in budget.sources
    # Forecasts draw from what the frames say; what the model misses kicks their runs.
    ahead = udd.forecast(measured, udd.Pendulum(1.0, k0=0.03), start=30.0, t=2.0)
    assert np.isfinite(ahead.median).all()
