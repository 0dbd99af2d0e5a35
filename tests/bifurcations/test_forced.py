"""Cycles of forced models, against exact solutions and another integrator with Newton's method."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate, optimize

import udd
from udd.errors import ModelError

FORCED = {"c": 0.1, "F": 0.3, "w": 1.2}


def duffing(linear: str = "-x", **values: float) -> udd.Model:
    return udd.Model(["x", "v"], ["v", f"{linear} - x^3 - c*v + F*cos(w*t)"], FORCED | values)


def stroboscopic(
    state: np.ndarray, linear: float, c: float, F: float, w: float
) -> tuple[np.ndarray, np.ndarray]:
    """The state a period of the forcing later, and its derivatives (2, 2)."""

    def rates(t: float, s: np.ndarray) -> np.ndarray:
        x, v, d = s[0], s[1], s[2:].reshape(2, 2)
        jacobian = np.array([[0.0, 1.0], [linear - 3 * x**2, -c]])
        return np.append([v, linear * x - x**3 - c * v + F * np.cos(w * t)], (jacobian @ d).ravel())

    start = np.append(state, np.eye(2).ravel())
    run = integrate.solve_ivp(rates, [0.0, 2 * np.pi / w], start, "DOP853", rtol=1e-12, atol=1e-13)
    return run.y[:2, -1], run.y[2:, -1].reshape(2, 2)


def test_a_linear_oscillator_is_the_exact_one() -> None:
    model = udd.Model(["x", "v"], ["v", "-k*x - c*v + F*cos(w*t)"], FORCED | {"k": 2.0})
    orbit = udd.periodic_orbit(model, [0.0, 0.0], period="2*pi/w")
    c, k, w = 0.1, 2.0, 1.2
    answer = 0.3 / (k - w**2 + 1j * c * w)
    assert orbit.state == pytest.approx([answer.real, -w * answer.imag], abs=1e-13)
    roots = np.exp(np.roots([1.0, c, k]) * orbit.period)
    assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(roots), abs=1e-12)
    assert orbit.period == 2 * np.pi / w and orbit.stable
    # Its answer half a period later is the negative.
    assert orbit.symmetric


def test_duffing_is_that_of_another_integrator() -> None:
    orbit = udd.periodic_orbit(duffing(), [0.0, 0.0], period=2 * np.pi / 1.2, settle=200.0)

    def gap(state: np.ndarray) -> np.ndarray:
        return stroboscopic(state, -1.0, **FORCED)[0] - state

    wanted = optimize.fsolve(gap, orbit.state + 1e-3, xtol=1e-13)
    assert orbit.state == pytest.approx(wanted, abs=1e-11)
    round_ = stroboscopic(wanted, -1.0, **FORCED)[1]
    assert np.sort_complex(orbit.multipliers) == pytest.approx(
        np.sort_complex(np.linalg.eigvals(round_)), abs=1e-10
    )
    # Over a period areas shrink by the friction alone.
    assert np.prod(orbit.multipliers).real == pytest.approx(np.exp(-0.1 * orbit.period), rel=1e-13)


def test_jumps_over_the_frequency_are_where_another_integrator_has_them() -> None:
    orbit = udd.periodic_orbit(duffing(), [0.0, 0.0], period="2*pi/w", settle=200.0)
    branch = udd.continuation(orbit, "w", (0.8, 2.5))
    assert [point.kind for point in branch.points] == ["fold", "fold"]

    def fold(unknowns: np.ndarray) -> np.ndarray:
        *state, w = unknowns
        end, by_state = stroboscopic(np.array(state), -1.0, 0.1, 0.3, w)
        return np.append(end - state, np.linalg.det(by_state - np.eye(2)))

    for point in branch.points:
        start = np.append(point.solution.state, point.value) + 1e-5
        wanted = optimize.fsolve(fold, start, xtol=1e-13)
        assert point.value == pytest.approx(wanted[-1], abs=1e-9)
        assert point.error < 1e-11
    # The period goes along with the frequency.
    assert branch.periods * branch.values == pytest.approx(2 * np.pi, abs=1e-12)


def test_two_wells_double_their_period() -> None:
    orbit = udd.periodic_orbit(duffing("x", c=0.3, F=0.2), [1.0, 0.0], period="2*pi/w", settle=200.0)
    assert not orbit.symmetric
    branch = udd.continuation(orbit, "F", (0.1, 0.35))
    (first,) = branch.points
    _, by_state = stroboscopic(first.solution.state, 1.0, 0.3, first.value, 1.2)
    assert first.kind == "period doubling"
    assert np.linalg.det(by_state + np.eye(2)) == pytest.approx(0.0, abs=1e-9)
    born = udd.continuation(first, bounds=(0.1, 0.35))
    second = born.points[0]
    # At F = 0.28 the answer is known to take two periods, at 0.29 four (and 0.2 one).
    assert first.value < 0.28 < second.value < 0.29
    assert second.solution.period == pytest.approx(2 * first.solution.period, rel=1e-13)
    state = second.solution.state
    for _ in range(2):
        state, _ = stroboscopic(state, 1.0, 0.3, second.value, 1.2)
    assert state == pytest.approx(second.solution.state, abs=1e-9)


def test_the_least_multiple_of_the_period_is_found() -> None:
    orbit = udd.periodic_orbit(duffing(), [0.0, 0.0], period="6*pi/w", settle=200.0)
    assert orbit.period == pytest.approx(2 * np.pi / 1.2, rel=1e-14)


def test_what_has_no_period_is_refused() -> None:
    model = duffing()
    with pytest.raises(ModelError, match="the forcing's period is needed"):
        udd.periodic_orbit(model, [0.0, 0.0])
    with pytest.raises(ModelError, match="do not repeat after the period 1"):
        udd.periodic_orbit(model, [0.0, 0.0], period=1.0)
    with pytest.raises(ModelError, match="the unknown name q"):
        udd.periodic_orbit(model, [0.0, 0.0], period="2*pi/q")
    with pytest.raises(ModelError, match="is -1, not above zero"):
        udd.periodic_orbit(model, [0.0, 0.0], period="-1")
    orbit = udd.periodic_orbit(model, [0.0, 0.0], period=2 * np.pi / 1.2, settle=200.0)
    with pytest.raises(ModelError, match="period depends on w: give it as a formula"):
        udd.continuation(orbit, "w", (0.8, 2.5))
