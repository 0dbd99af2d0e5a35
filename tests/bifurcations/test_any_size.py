"""Equilibria of models of any size, and cycles of models without parameters."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate

import udd
from udd import _core


def ring(dim: int) -> udd.Model:
    """Each state is driven by the next: at rest all are 0.5, or 2 where that is on the other branch."""
    names = [f"x{k}" for k in range(dim)]
    return udd.Model(names, [f"(x{(k + 1) % dim} - 0.5)*(2 - x{k})" for k in range(dim)])


@pytest.mark.parametrize("dim", range(1, 7))
def test_equilibria_of_models_of_all_sizes(dim: int) -> None:
    equilibria = udd.equilibria(ring(dim))
    states = np.array([rest.state for rest in equilibria])
    assert states.shape[1] == dim
    for wanted in (0.5, 2.0):
        assert np.abs(states - wanted).max(axis=1).min() < 1e-9
    near = udd.equilibria(ring(dim), near=np.full(dim, 0.5), initial_states=1)
    assert np.abs(np.array([rest.state for rest in near]) - 0.5).max(axis=1).min() < 1e-9
    # The slope at 0.5 is a ring of 1.5, whose eigenvalues are 1.5 times the roots of one.
    rest = min(equilibria, key=lambda rest: float(np.abs(rest.state - 0.5).max()))
    roots = 1.5 * np.exp(2j * np.pi * np.arange(dim) / dim)
    far = np.abs(rest.eigenvalues[:, None] - roots).min(axis=0)
    assert far.max() < 1e-9


def test_a_search_says_where_it_was() -> None:
    none = udd.equilibria(udd.Model(["x", "v"], ["v", "exp(x)"]), near=[3.0, 30.0], initial_states=16)
    assert none == []
    wanted = "Powell's method from 16 states within |x| <= 30, |v| <= 300 and 1 given: others may exist"
    assert none.search == wanted and wanted in repr(none)


def test_a_cycle_of_a_model_without_parameters() -> None:
    oscillator = udd.Model(["x", "v"], ["v", "(1 - x^2)*v - x"])
    orbit = udd.periodic_orbit(oscillator, [2.0, 0.0], settle=50.0)
    # Period and multiplier of Van der Pol's oscillator at mu = 1, from an integration with 30 digits.
    assert orbit.period == pytest.approx(6.6632868593231301, abs=1e-9)
    with_one = udd.periodic_orbit(
        udd.Model(["x", "v"], ["v", "m*(1 - x^2)*v - x"], {"m": 1.0}), [2.0, 0.0], settle=50.0
    )
    assert orbit.multipliers == pytest.approx(with_one.multipliers, rel=1e-6)
    with pytest.raises(udd.UddError, match="no parameter 'm'"):
        udd.continuation(orbit, "m", (0.5, 2.0))


def three_oscillators(k: float = 0.5) -> udd.Model:
    """Van der Pol's oscillators in a chain of springs."""
    equations = [
        "a",
        "(1-x^2)*a - x + k*(y-x)",
        "b",
        "(1-y^2)*b - y + k*(x+z-2*y)",
        "c",
        "(1-z^2)*c - z + k*(y-z)",
    ]
    return udd.Model(["x", "a", "y", "b", "z", "c"], equations, {"k": k})


def variations(t: float, s: np.ndarray, k: float = 0.5) -> np.ndarray:
    """The chain's rates, with those of the derivatives (6, 6) by the start and (6,) by k."""
    x, v, d = s[0:6:2], s[1:6:2], s[6:].reshape(6, 7)
    springs = np.array([[-1.0, 1.0, 0.0], [1.0, -2.0, 1.0], [0.0, 1.0, -1.0]])
    rates, jacobian, by_k = np.zeros(6), np.zeros((6, 6)), np.zeros((6, 7))
    rates[0::2], rates[1::2] = v, (1 - x**2) * v - x + k * springs @ x
    jacobian[0::2, 1::2] = np.eye(3)
    jacobian[1::2, 0::2] = k * springs - np.diag(1 + 2 * x * v)
    jacobian[1::2, 1::2] = np.diag(1 - x**2)
    by_k[1::2, 6] = springs @ x
    return np.append(rates, (jacobian @ d + by_k).ravel())


def test_a_cycle_of_six_states_has_the_multipliers_of_another_integrator() -> None:
    orbit = udd.periodic_orbit(three_oscillators(), [2.0, 0.0, 2.0, 0.0, 2.0, 0.1], settle=100.0)
    # All three as one: the period of Van der Pol's oscillator, as integrated with 30 digits elsewhere.
    assert orbit.period == pytest.approx(6.6632868593231301, abs=1e-11)
    start = np.append(orbit.state, np.eye(6, 7).ravel())
    run = integrate.solve_ivp(variations, [0, orbit.period], start, "DOP853", rtol=1e-12, atol=1e-13)
    round_ = run.y[6:, -1].reshape(6, 7)
    wanted = np.linalg.eigvals(round_[:, :6])
    wanted = np.delete(wanted, np.argmin(np.abs(wanted - 1.0)))
    assert np.abs(wanted[:, None] - orbit.multipliers).min(axis=0).max() < 1e-9
    # Derivatives by a parameter take a run of their own there.
    pieces = _core.shoot(
        orbit.model,
        np.array([[0.5]]),
        orbit.state[None],
        np.zeros(1),
        np.array([orbit.period]),
        [0],
        1e-13,
        1e-14,
    )
    np.testing.assert_allclose(pieces["by_parameter"][0, :, 0], round_[:, 6], atol=1e-9)
    np.testing.assert_allclose(pieces["by_state"][0], round_[:, :6], atol=1e-9)
    branch = udd.continuation(orbit, "k", (0.1, 1.0))
    assert branch.periods == pytest.approx(orbit.period, abs=1e-9)  # which does not depend on the springs


def test_the_exponents_of_five_states_are_those_of_the_parts() -> None:
    both = udd.Model(
        ["x", "y", "z", "u", "v"],
        ["10*(y-x)", "28*x - y - x*z", "x*y - 8/3*z", "v", "(1-u^2)*v - u"],
    )
    spectrum = udd.lyapunov_spectrum(both, state0=[1.0, 1.0, 1.0, 2.0, 0.0], t=400.0, tol=1.0)
    # Lorenz's, 0 and the logarithm of Van der Pol's multiplier, 8.5969507e-4, by the period.
    known = np.array([0.9056, 0.0, 0.0, np.log(8.5969507e-4) / 6.6632868593, -14.5723])
    assert np.all(np.abs(spectrum.exponents - known) < 5.0 * spectrum.standard_errors)
    vectors = udd.covariant_vectors(both, state0=[1.0, 1.0, 1.0, 2.0, 0.0]).vectors
    # The most contracting direction is Lorenz's: nothing of it is in the other oscillator.
    assert np.abs(vectors[:500, 4, 3:]).max() < 1e-6
    points = udd.poincare(both, "v", 5, state0=[1.0, 1.0, 1.0, 2.0, 0.0], direction="up", transient=30)
    assert np.diff(points.t) == pytest.approx(6.6632868593, abs=1e-6)


def test_one_state_alone() -> None:
    line = udd.Model(["x"], ["r*x - x^3"], {"r": 1.0})
    t, starts = np.array([0.0, 0.5, 2.0]), np.array([[0.5], [-0.2], [1.7]])
    exact = starts / np.sqrt(starts**2 + (1 - starts**2) * np.exp(-2 * t))
    assert udd.ensemble(line, t, starts).state[..., 0] == pytest.approx(exact, abs=1e-8)
    assert udd.lyapunov_spectrum(line, state0=[0.5]).exponents == pytest.approx([-2.0], abs=1e-8)
    basins = udd.basins(line, {"x": np.linspace(-2.0, 2.0, 8)}, t_max=500.0)
    np.testing.assert_allclose(basins.fraction, [0.5, 0.5])
    assert udd.poincare(udd.Model(["x"], ["cos(t)"]), "x", 4, state0=[0.0], transient=0).t == pytest.approx(
        2.0 * np.pi * np.arange(1, 5), abs=1e-8
    )
