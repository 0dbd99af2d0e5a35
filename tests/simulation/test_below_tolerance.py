"""Components that fall below `atol` and grow again."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import udd

PREY = udd.Model(["x", "y"], ["x*(a - b*y)", "y*(-c + d*x)"], {"a": 1.0, "b": 1.0, "c": 1.0, "d": 1.0})
START = [60.0, 1.0]
PREDATORS = udd.Model(["N", "P"], ["N*(1 - N/50) - N*P/(1 + N)", "P*(N/(1 + N) - 0.3)"])


def period() -> float:
    """The cycle's period, from the logarithms of both: x = e^u, y = e^v."""

    def rates(_t: float, s: np.ndarray) -> list[float]:
        return [1 - np.exp(s[1]), -1 + np.exp(s[0])]

    def crossing(_t: float, s: np.ndarray) -> float:
        return float(s[1])

    crossing.direction = -1.0  # type: ignore[attr-defined]
    begin = np.log(START) + np.array([0.0, 1e-9])
    run = solve_ivp(rates, (0, 200), begin, "DOP853", events=crossing, rtol=1e-12, atol=1e-12)
    return float(np.diff(run.t_events[0])[0])


@pytest.mark.parametrize(
    "call",
    [
        lambda: udd.poincare(PREY, n=3, state0=START, transient=0),
        lambda: udd.poincare(PREY, n=3, state0=START, transient=0, parameters={"a": [1.0, 1.1]}),
        lambda: udd.simulate(PREY, [0.0, 200.0], START),
        lambda: udd.simulate(PREY, 200.0, START),
        lambda: udd.ensemble(PREY, [0.0, 200.0], [START, START]),
        lambda: udd.lyapunov(PREY, state0=START, t=500.0, tol=10.0),
        lambda: udd.lyapunov_spectrum(PREY, state0=START, t=500.0, tol=10.0),
        lambda: udd.basins(PREDATORS, {"N": [5.0, 6.0]}, state0=[5.0, 1.0], n=12, transient=12),
        lambda: udd.bifurcation(PREY, "a", [1.0], initial_states=START, n=12, transient=12),
    ],
)
def test_a_population_that_is_lost_below_atol_is_said(call: Callable[[], object]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", udd.ToleranceWarning)
        with pytest.raises(udd.ToleranceWarning, match=r"falls to .* at atol = 1e-(12|10) and grows again"):
            call()


def test_a_smaller_atol_is_right_and_silent() -> None:
    section = udd.poincare(PREY, n=3, state0=START, transient=0, atol=1e-40)
    assert section.return_times == pytest.approx(period(), rel=1e-6)


@pytest.mark.parametrize(
    ("model", "start"),
    [
        (udd.Model(["x", "v"], ["v", "-x"]), [1.0, 0.0]),
        (udd.Model(["x", "v"], ["v", "-x - 0.5*v"]), [1.0, 0.0]),
        (udd.Model(["x"], ["-x"]), [1.0]),
        (udd.Model(["x"], ["x - x^3"]), [0.0]),
        # It falls to 1e-26, and a source brings it back.
        (udd.Model(["x"], ["-x*(1 + 0*t) + where(t > 60, 1, 0)"]), [1.0]),
        # A population that stays extinct next to one that does not.
        (udd.Model(["x", "y"], ["x*(1 - x)", "-y*(1 + x)"]), [0.1, 1.0]),
        (PREY, [1.5, 1.0]),
        (PREY, [1.5, 0.0]),
        (udd.Model(["q"], ["1.5 - sin(q)"], angles=["q"]), [0.0]),
    ],
)
def test_what_passes_through_zero_or_rests_there_is_fine(model: udd.Model, start: list[float]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", udd.ToleranceWarning)
        udd.simulate(model, np.linspace(0.0, 100.0, 1001), start)
        udd.simulate(model, [0.0, 100.0], start)


def test_results_are_those_without_the_look() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        few = udd.simulate(PREY, [0.0, 30.0], START).state[-1]
        many = udd.simulate(PREY, np.linspace(0.0, 30.0, 301), START).state[-1]
    np.testing.assert_allclose(few, many, rtol=1e-12)
