"""Fits of models with up to twelve states."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from many_states import ring
from udd import Measurement


def noisy(model: udd.Model, t: np.ndarray, start: np.ndarray, sd: float, seed: int) -> Measurement:
    run = udd.simulate(model, t, start, rtol=1e-10, atol=1e-10)
    values = run.state + sd * np.random.default_rng(seed).standard_normal(run.state.shape)
    return Measurement(t, dict(zip(model.state_names, values.T, strict=True)))


def drawn(n: int, seed: int) -> Measurement:
    """A record of Lorenz's ring with a noise of 0.2, from a state of the motion."""
    first = udd.simulate(ring(n), 5.0, 8.0 + np.random.default_rng(seed).normal(size=n)).state[-1]
    return noisy(ring(n), np.arange(0.0, 4.0, 0.02), first, 0.2, 1000 + seed)


@pytest.mark.parametrize("n", [8, 12])
def test_errors_are_as_large_as_they_say(n: int) -> None:
    """Pulls of the free numbers over twenty drawn records."""
    pulls = []
    for seed in range(20):
        result = udd.fit(drawn(n, seed), ring(n).replace(F=7.6, a=1.03))
        assert result.converged and result.states.shape == (200, n)
        assert result.state_covariance.shape == (200, n, n)
        pulls.append(
            [(result.parameters[k] - true) / result.errors[k] for k, true in (("F", 8.0), ("a", 1.0))]
        )
    # The mean square of 40 normal numbers is 1 +- 0.22; one exceeds 4.5 in one of 3000 draws.
    assert 0.5 < np.square(pulls).mean() < 2.0
    assert np.abs(pulls).max() < 4.5


@pytest.mark.parametrize("n", [5, 7, 9, 11])
def test_filled_up_numbers_of_states_are_fitted_and_foretold(n: int) -> None:
    """Each state has a coefficient of its own: more free numbers than are differentiated by at once."""
    names = [f"x{i}" for i in range(n)]
    texts = [f"F - c{i}*x{i} + x{(i + 1) % n}*x{i - 1 if i else n - 1}*0.1 - 0.2*x{i}^3" for i in range(n)]
    true = {"F": 2.0} | {f"c{i}": 0.5 + 0.1 * i for i in range(n)}
    model = udd.Model(names, texts, true)
    starts = [5.0 * np.random.default_rng(k).normal(size=n) for k in range(3)]
    t = np.arange(0.0, 3.0, 0.02)
    seen = [noisy(model, t, start, 0.02, 7 + k) for k, start in enumerate(starts)]
    guess = model.with_parameters({name: 1.1 * value for name, value in true.items()})
    result = udd.fit(seen, guess)
    assert result.converged and len(result.parameters) == n + 1
    pulls = np.array(
        [(result.parameters[name] - value) / result.errors[name] for name, value in true.items()]
    )
    # With n + 1 normal numbers one exceeds 4.5 in one of 10^4 draws.
    assert np.abs(pulls).max() < 4.5 and np.square(pulls).mean() < 3.0
    assert result.residuals.shape == (3 * len(t), n)
    ahead = udd.forecast(seen[0], result, np.arange(0.0, 0.81, 0.02), start=2.0, window=0.5, members=20)
    # Predictions are measured with a noise of 0.02; none of 400 normal numbers is above 5.
    assert np.abs(ahead.median - seen[0].values[100:141]).max() < 0.1
