"""Pitchforks that are met along their side branches."""

from __future__ import annotations

import numpy as np
import pytest

import udd

PITCHFORKS = {
    "normal form": (udd.Model(["x"], ["mu*x - x^3"], {"mu": 1.0}), "mu", 0.0),
    "of a slave": (udd.Model(["x", "y"], ["mu*x - x*y", "x^2 - y"], {"mu": 1.0}), "mu", 0.0),
    "Lorenz": (
        udd.Model(["x", "y", "z"], ["10*(y - x)", "r*x - y - x*z", "x*y - 8/3*z"], {"r": 3.0}),
        "r",
        1.0,
    ),
}


@pytest.mark.parametrize("name", PITCHFORKS)
def test_a_side_branch_has_its_pitchfork_among_its_points(name: str) -> None:
    model, parameter, value = PITCHFORKS[name]
    side = max(udd.equilibria(model), key=lambda rest: float(rest.state[0]))
    branch = udd.continuation(side, parameter, (value - 1.0, value + 4.0))
    (point,) = branch.find("branch point")
    assert abs(point.value - value) <= max(point.error, 1e-12) and point.error < 1e-9
    assert "a branch point" in branch.ends[0]
    # The other branch, from there.
    other = udd.continuation(point, bounds=(value - 1.0, value + 4.0))
    assert len(other) > 3 and np.ptp(other.values) > 0.5


@pytest.mark.parametrize("start", [0.61, 0.7, 1.37])
def test_a_pitchfork_has_a_bound_wherever_the_branch_starts(start: float) -> None:
    model = udd.Model(["x"], ["(r - 0.6)*x - x^3"], {"r": start})
    side = max(udd.equilibria(model), key=lambda rest: float(rest.state[0]))
    for bounds in ((0.0, 3.0), (0.5, 2.5), (0.0, np.inf)):
        (point,) = udd.continuation(side, "r", bounds, direction="down").points
        assert abs(point.value - 0.6) <= point.error < 1e-12


def test_a_stirred_reactor_has_its_folds_and_hopf_points() -> None:
    # Uppal, Ray and Poore's reactor; values from its trace and determinant, by Brent's method.
    model = udd.Model(
        ["x1", "x2"],
        ["-x1 + Da*(1 - x1)*exp(x2)", "-x2 + B*Da*(1 - x1)*exp(x2) - beta*x2"],
        {"B": 7.06, "beta": 0.74, "Da": 0.15},
    )
    rest = udd.equilibria(model, near=[0.4, 2.0])[0]
    branch = udd.continuation(rest, "Da", (0.05, 0.3))
    folds, hopf = ([point.value for point in branch.find(kind)] for kind in ("fold", "Hopf"))
    assert sorted(folds) == pytest.approx([0.13120135299213, 0.13180269963844], abs=1e-11)
    assert sorted(hopf) == pytest.approx([0.13155128618053, 0.13250235640209], abs=1e-11)


def test_a_side_branch_of_cycles_has_its_symmetry_breaking_among_its_points() -> None:
    start = udd.periodic_orbit(udd.DLE(6.9), settle=600.0)
    assert not start.symmetric
    branch = udd.continuation(start, "w", (6.5, 7.5), direction="up")
    (point,) = branch.points
    assert point.kind == "symmetry breaking" and abs(point.value - 7.09642643066) <= point.error + 1e-11
    assert branch.ends[1] == "a symmetry breaking at 7.096426431"
    assert isinstance(point.solution, udd.PeriodicOrbit) and point.solution.symmetric
    # The same point along the symmetric cycles.
    (other,) = udd.continuation(udd.periodic_orbit(udd.DLE(7.3)), "w", (7.0, 7.5)).points
    assert abs(point.value - other.value) <= point.error + other.error


def test_a_branch_of_doubled_cycles_has_the_doubling_among_its_points() -> None:
    start = udd.periodic_orbit(udd.DLE(5.2), settle=600.0)
    branch = udd.continuation(start, "w", (5.15, 5.6), direction="up")
    (point,) = branch.points
    assert point.kind == "period doubling" and abs(point.value - 5.394713224) < 1e-9 and point.error < 1e-9
    assert isinstance(point.solution, udd.PeriodicOrbit)
    assert branch.periods[-1] == pytest.approx(2.0 * point.solution.period, rel=1e-3)
