"""Equilibria of models of any size, and cycles of models without parameters."""

from __future__ import annotations

import numpy as np
import pytest

import udd


def ring(dim: int) -> udd.Model:
    """Each state is driven by the next: at rest all are 0.5, or 2 where that is on the other branch."""
    names = [f"x{k}" for k in range(dim)]
    return udd.Model(names, [f"(x{(k + 1) % dim} - 0.5)*(2 - x{k})" for k in range(dim)])


@pytest.mark.parametrize("dim", range(1, 7))
def test_equilibria_of_models_of_all_sizes(dim: int) -> None:
    found = udd.equilibria(ring(dim))
    states = np.array([rest.state for rest in found])
    assert states.shape[1] == dim
    for wanted in (0.5, 2.0):
        assert np.abs(states - wanted).max(axis=1).min() < 1e-9
    near = udd.equilibria(ring(dim), near=np.full(dim, 0.5), starts=1)
    assert np.abs(np.array([rest.state for rest in near]) - 0.5).max(axis=1).min() < 1e-9
    # Of d/dx at 0.5: a ring of 1.5, whose eigenvalues are 1.5 times the roots of one.
    rest = min(found, key=lambda rest: float(np.abs(rest.state - 0.5).max()))
    roots = 1.5 * np.exp(2j * np.pi * np.arange(dim) / dim)
    far = np.abs(rest.eigenvalues[:, None] - roots).min(axis=0)
    assert far.max() < 1e-9


def test_a_search_says_where_it_was() -> None:
    none = udd.equilibria(udd.Model(["x", "v"], ["v", "1 + x^2"]), near=[3.0, 30.0], starts=16)
    assert none == []
    wanted = "Powell's method from 16 states within |x| <= 30, |v| <= 300 and 1 given: others may exist"
    assert none.search == wanted and wanted in repr(none)


def test_a_cycle_of_a_model_without_parameters() -> None:
    oscillator = udd.Model(["x", "v"], ["v", "(1 - x^2)*v - x"])
    orbit = udd.periodic_orbit(oscillator, [2.0, 0.0], settle=50.0)
    # Of Van der Pol's oscillator at mu = 1: period and multiplier as integrated with 30 digits elsewhere.
    assert orbit.period == pytest.approx(6.6632868593231301, abs=1e-9)
    with_one = udd.periodic_orbit(
        udd.Model(["x", "v"], ["v", "m*(1 - x^2)*v - x"], {"m": 1.0}), [2.0, 0.0], settle=50.0
    )
    assert orbit.multipliers == pytest.approx(with_one.multipliers, rel=1e-6)
    with pytest.raises(udd.UddError, match="no parameter 'm'"):
        udd.continuation(orbit, "m", (0.5, 2.0))
