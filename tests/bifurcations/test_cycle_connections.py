"""Connections of equilibria with saddle cycles, against published values and another integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate

import udd
from udd.errors import ModelError


def branch_of(model: udd.Model, parameter: str, bounds: tuple[float, float], period: float) -> udd.Branch:
    rest = max(udd.equilibria(model), key=lambda one: one.state[0])
    hopf = udd.continuation(rest, parameter, bounds).find("Hopf")[0]
    return udd.continuation(hopf, max_period=period)


def saddle_of(model: udd.Model) -> udd.Equilibrium:
    return min(udd.equilibria(model), key=lambda one: abs(one.state[0]))


@pytest.mark.nightly  # test_the_damped_dle_has_one_and_another_integrator_agrees asks the same
def test_lorenz_has_the_one_where_his_chaos_becomes_an_attractor() -> None:
    lorenz = udd.Model(["x", "y", "z"], ["10*(y-x)", "r*x-y-x*z", "x*y-8/3*z"], {"r": 20.0})
    (one,) = udd.cycle_connections(branch_of(lorenz, "r", (18.0, 30.0), 3.0), saddle_of(lorenz))
    # Published: r_A = 24.06 (J. Kaplan and J. Yorke, 1979), with more digits 24.0579 (C. Sparrow, 1982).
    assert one.kind == "equilibrium to cycle"
    assert one.value == pytest.approx(24.0579, abs=1e-4)
    assert 0.0 < one.error < 1e-10


@pytest.mark.nightly
def test_backward_in_time_a_cycle_leads_to_the_equilibrium() -> None:
    forward = ["10*(y-x)", "r*x-y-x*z", "x*y-8/3*z"]
    lorenz, reversed_ = (
        udd.Model(["x", "y", "z"], rates, {"r": 20.0})
        for rates in (forward, [f"-({rate})" for rate in forward])
    )
    there, back = (
        udd.cycle_connections(branch_of(model, "r", (18.0, 30.0), 3.0), saddle_of(model))
        for model in (lorenz, reversed_)
    )
    assert [one.kind for one in there + back] == ["equilibrium to cycle", "cycle to equilibrium"]
    # The same orbit, seen backward; its stable manifold has the multipliers' reciprocals.
    assert abs(there[0].value - back[0].value) <= there[0].error + back[0].error < 1e-10
    assert back[0].cycle.period == pytest.approx(there[0].cycle.period, rel=1e-9)
    product = there[0].cycle.multipliers[0] * back[0].cycle.multipliers[-1]
    assert product == pytest.approx(1.0, rel=1e-7)


def test_the_damped_dle_has_one_and_another_integrator_agrees() -> None:
    model = udd.DLE(2.5, B=0.2)
    (one,) = udd.cycle_connections(branch_of(model, "w", (1.0, 9.0), 16.0), saddle_of(model))
    assert 0.0 < one.error < 1e-10

    def turns(w: float) -> float:
        """How large the turns about the rotating state are in the end, relative to the saddle cycle's."""
        growing = (-1.0 + np.sqrt(1.0 + 4.0 / 0.2)) / 2.0
        run = integrate.solve_ivp(
            lambda t, s: [s[1] - s[0], s[0] * s[2], w - s[0] * s[1] - 0.2 * w * s[2]],
            [0.0, 150.0],
            np.array([0.0, 0.0, 5.0]) + 1e-8 * np.array([1.0, 1.0 + growing, 0.0]),
            "DOP853",
            rtol=1e-12,
            atol=1e-13,
            max_step=0.2,
        )
        # The first passage at the cycle is over after some 30, nothing leaves it within 60.
        late = run.y[2][run.t > 110.0]
        return float(np.ptp(late))

    cycle = np.ptp(one.cycle.trajectory(200).state[:, 2])
    inside, outside = (turns(one.value + d) / cycle for d in (1e-5, -1e-5))
    assert min(inside, outside) < 0.998 < 1.002 < max(inside, outside)


def test_what_it_does_not_serve_is_told() -> None:
    model = udd.DLE(2.5, B=0.2)
    branch = branch_of(model, "w", (1.0, 9.0), 16.0)
    with pytest.raises(ModelError, match="a branch of cycles"):
        udd.cycle_connections(saddle_of(model), branch)  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="an equilibrium is needed"):
        udd.cycle_connections(branch, branch)  # type: ignore[arg-type]
    circle = udd.Model(["x", "v"], ["v", "-sin(x)"])
    family = udd.continuation(udd.periodic_orbit(circle, [1.0, 0.0]), "period", (6.6, 7.0))
    with pytest.raises(ModelError, match="over a parameter of a model"):
        udd.cycle_connections(family, saddle_of(model))


def test_a_passage_at_another_part_of_the_cycle_counts() -> None:
    rates = ["y", "(1 - z)*x - lam*y", "-0.4*z + x^2"]
    model = udd.Model(["x", "y", "z"], rates, {"lam": 1.2})
    branch = branch_of(model, "lam", (0.3, 2.0), 20.0)
    # The manifold passes the mirror image of the cycle in its last fifth, and leaves before a whole round.
    (connection,) = udd.cycle_connections(branch, saddle_of(model))
    # By shooting to the nearest of 288 states of the cycle.
    assert connection.value == pytest.approx(1.1967406163676289, abs=connection.error + 2e-14)
    assert 0.0 < connection.error < 1e-12
