"""Families of cycles where energy is kept, against elliptic functions and another integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate, optimize, special

import udd
from udd.bifurcations.branch_switching import doubled
from udd.errors import ModelError

ENERGY = "(u^2 + v^2 + x^2 + y^2)/2 + x^2*y - y^3/3"


def henon_heiles() -> udd.PeriodicOrbit:
    """The orbit along the axis of symmetry, at energy 0.05."""
    model = udd.Model(["x", "y", "u", "v"], ["u", "v", "-x - 2*x*y", "-y - x^2 + y^2"])
    return udd.periodic_orbit(model, [0.0, 0.0, 0.0, np.sqrt(0.1)], period=6.4)


@pytest.mark.parametrize(("over", "bounds"), [("period", (6.3, 20.0)), ("v^2/2 - cos(x)", (-0.999, 0.999))])
def test_a_pendulum_swings_as_elliptic_integrals_say(over: str, bounds: tuple[float, float]) -> None:
    swing = udd.periodic_orbit(udd.Model(["x", "v"], ["v", "-sin(x)"]), [1.0, 0.0])
    family = udd.continuation(swing, over, bounds)
    energy = family.states[:, 1] ** 2 / 2 - np.cos(family.states[:, 0])
    assert family.periods == pytest.approx(4 * special.ellipk((1 + energy) / 2), abs=1e-10)
    assert family.values == pytest.approx(family.periods if over == "period" else energy, abs=1e-12)
    assert (family.values.min(), family.values.max()) == pytest.approx(bounds, abs=1e-12)
    assert not family.points


def test_henon_heiles_bifurcates_where_it_is_known_to() -> None:
    family = udd.continuation(henon_heiles(), ENERGY, (0.04, 0.1666))
    kinds = [point.kind for point in family.points]
    assert kinds == ["period doubling"] * 2 + ["branch point"] * 2 + ["period doubling"] * 2 + [
        "branch point"
    ]
    # The first isochronous pitchforks in units of the saddle's energy (M. Brack, Found. Phys. 31 (2001) 209).
    energies = [6 * point.value for point in family.points if point.kind == "branch point"]
    assert energies[:2] == pytest.approx([0.969309, 0.986709], abs=1e-6)
    # The same by power series with 42 digits.
    exact = [0.13528591930035279812, 0.15253573548213440877, 0.16155151511081361069]
    for point, value in zip(family.points, exact, strict=False):
        assert abs(point.value - value) <= point.error < 1e-13
    for point in family.points:
        # The motion along the axis, and the derivatives across it.
        def rates(t: float, s: np.ndarray) -> np.ndarray:
            y, v, d = s[0], s[1], s[2:].reshape(2, 2)
            return np.append([v, -y + y**2], (np.array([[0, 1], [-1 - 2 * y, 0]]) @ d).ravel())

        start = np.append([0.0, np.sqrt(2 * point.value)], np.eye(2).ravel())
        span = [0.0, point.solution.period]
        end = integrate.solve_ivp(rates, span, start, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        assert end[:2] == pytest.approx(start[:2], abs=1e-9)
        trace = 2.0 if point.kind == "branch point" else -2.0
        assert end[2] + end[5] == pytest.approx(trace, abs=1e-7)


def test_new_orbits_of_henon_heiles() -> None:
    family = udd.continuation(henon_heiles(), ENERGY, (0.04, 0.163))
    (point,) = (point for point in family.points if point.kind == "branch point")
    born = udd.continuation(point, bounds=(0.16, 0.166))
    state, period = born.states[-1], born.periods[-1]
    x, y, u, v = state
    assert (u**2 + v**2 + x**2 + y**2) / 2 + x**2 * y - y**3 / 3 == pytest.approx(0.166, abs=1e-12)
    assert abs(x) + abs(u) > 0.01  # no longer along the axis

    def rates(t: float, s: np.ndarray) -> list[float]:
        x, y, u, v = s
        return [u, v, -x - 2 * x * y, -y - x**2 + y**2]

    end = integrate.solve_ivp(rates, [0.0, period], state, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    assert end == pytest.approx(state, abs=1e-8)


def test_three_pendulums_on_springs() -> None:
    k = 0.2
    equations = ["p", "q", "r", "-sin(a)+k*(b-a)", "-sin(b)+k*(a+c-2*b)", "-sin(c)+k*(b-c)"]
    model = udd.Model(["a", "b", "c", "p", "q", "r"], equations, {"k": k})
    family = udd.continuation(
        udd.periodic_orbit(model, [1.0] * 3 + [0.0] * 3, max_period=6.7), "period", (6.3, 9.0)
    )
    # All as one: each swings as a pendulum alone.
    energy = family.states[:, 3] ** 2 / 2 - np.cos(family.states[:, 0])
    assert family.periods == pytest.approx(4 * special.ellipk((1 + energy) / 2), abs=1e-10)
    assert [point.kind for point in family.points] == ["branch point"] * 2
    for point, spring in zip(family.points, (k, 3 * k), strict=True):
        # Out of step: of outer ones against each other, then of the middle one against both.
        def rates(t: float, s: np.ndarray, spring: float = spring) -> np.ndarray:
            x, v, d = s[0], s[1], s[2:].reshape(2, 2)
            return np.append([v, -np.sin(x)], (np.array([[0, 1], [-np.cos(x) - spring, 0]]) @ d).ravel())

        start = np.append(point.solution.state[[0, 3]], np.eye(2).ravel())
        span = [0.0, point.solution.period / 2]
        end = integrate.solve_ivp(rates, span, start, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        assert abs(end[2] + end[5]) == pytest.approx(2.0, abs=1e-7)


def test_what_is_not_kept_is_refused() -> None:
    with pytest.raises(ModelError, match="no quantity is kept"):
        udd.continuation(udd.periodic_orbit(udd.DLE(10.0)), "period", (3.0, 4.0))
    orbit = henon_heiles()
    with pytest.raises(ModelError, match=r"x\^2 is not kept"):
        udd.continuation(orbit, "x^2", (0.0, 1.0))
    with pytest.raises(ModelError, match="has no parameter 'q'; it has none"):
        udd.continuation(orbit, "q", (0.0, 1.0))
    (point,) = udd.continuation(orbit, "period", (6.6, 8.0)).points
    with pytest.raises(ModelError, match="over a second parameter"):
        udd.locus(point, "q", (-0.1, 0.1))
    # Twice the period, twice the value.
    born = udd.continuation(point, max_points=20)
    assert born.values[0] == pytest.approx(2.0 * point.value, abs=0.1)
    # A member of a family: its period has no bound.
    assert np.isnan(orbit.period_error)
    swing = udd.periodic_orbit(udd.Model(["x", "v"], ["v", "-sin(x)"]), [1.0, 0.0])
    assert np.isnan(swing.period_error)
    # The map of two rounds keeps two quantities to first order: the energy and the bifurcating one.
    curve, base, _ = doubled(point._curve, point._place)
    x, y, u, v = curve.nodes(base)[0]
    slope = curve.flow.size * np.array([x + 2 * x * y, y + x**2 - y**2, u, v])
    assert abs(curve.free @ slope) == pytest.approx(np.linalg.norm(slope), rel=1e-9)


def test_pairs_of_multipliers_leave_the_unit_circle_where_another_integrator_has_it() -> None:
    # A pendulum whose swing couples two others: where the sum of their frequencies is its own, both grow.
    equations = ["v", "-sin(x) + c*y*z", "p", "-0.09*y + c*x*z", "q", "-0.3364*z + c*x*y"]
    model = udd.Model(["x", "v", "y", "p", "z", "q"], equations, {"c": 0.15})
    swing = udd.periodic_orbit(model, [0.6, 0.0, 0.0, 0.0, 0.0, 0.0], period=6.43)
    family = udd.continuation(swing, "period", (6.4, 8.2))
    (point,) = family.points
    assert point.kind == "Krein collision"

    def discriminant(energy: float) -> float:
        """Return the discriminant of the two pairs' sums, at a swing of this energy."""
        start = np.arccos(-energy)
        lasts = 4 * special.ellipk((1 + energy) / 2)

        def rates(t: float, s: np.ndarray) -> np.ndarray:
            y, p, z, q = s[2:].reshape(4, 4)
            x = s[0]
            return np.concatenate(
                [[s[1], -np.sin(x)], p, -0.09 * y + 0.15 * x * z, q, -0.3364 * z + 0.15 * x * y]
            )

        begin = np.concatenate([[start, 0.0], np.eye(4).ravel()])
        end = integrate.solve_ivp(rates, [0.0, lasts], begin, "DOP853", rtol=1e-12, atol=1e-13).y[2:, -1]
        m = end.reshape(4, 4)
        trace = float(np.trace(m))
        products = 0.5 * (trace**2 - float(np.trace(m @ m))) - 2.0
        return trace**2 - 4.0 * products

    energy = float(2 * optimize.brentq(lambda m: 4 * special.ellipk(m) - point.value, 1e-6, 0.9) - 1)
    known = float(optimize.brentq(discriminant, energy - 1e-3, energy + 1e-3, xtol=1e-14))
    # The other integrator's tolerance, over the slope of the discriminant.
    assert point.value == pytest.approx(4 * special.ellipk((1 + known) / 2), abs=1e-9)
    assert 0.0 < point.error < 1e-11
    with pytest.raises(ModelError):
        udd.continuation(point)
