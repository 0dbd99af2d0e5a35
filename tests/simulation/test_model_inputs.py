"""Models with measured inputs: against SciPy piece by piece, and closed forms."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import udd
from udd.errors import ModelError

T = np.linspace(0.0, 6.0, 121)
U = np.cumsum(np.random.default_rng(1).normal(size=121)) * 0.2
SWING = udd.Model(
    ["theta", "v"],
    ["v", "-sin(theta) - c*v + g*u"],
    {"c": 0.1, "g": 1.0, "tau": 0.0},
    angles=["theta"],
    inputs=["u"],
    delays={"u": "tau"},
)
START = [0.3, 0.0]


def by_scipy(signal: udd.InputSignal, tau: float = 0.0) -> np.ndarray:
    """The end of the run, each piece of the input by itself."""
    pieces, x = signal.coefficients(), np.array(START)
    knots = np.unique(np.clip(np.concatenate([[0.0], T + tau, [6.0]]), 0.0, 6.0))
    for a, b in itertools.pairwise(knots):
        k = int(np.clip(np.searchsorted(T + tau, 0.5 * (a + b)) - 1, -1, len(pieces) - 1))
        c, at = (pieces[k], T[k] + tau) if k >= 0 else (np.array([U[0], 0, 0, 0]), 0.0)

        def rates(t: float, y: np.ndarray, c: np.ndarray = c, at: float = at) -> list[float]:
            return [y[1], -np.sin(y[0]) - 0.1 * y[1] + np.polyval(c[::-1], t - at)]

        x = solve_ivp(rates, (a, b), x, rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    return x


@pytest.mark.parametrize("hold", ["zero", "linear", "cubic"])
@pytest.mark.parametrize("method", ["dopri5", "dop853", "taylor", "rodas"])
def test_every_method_runs_through_the_samples(hold: Any, method: str) -> None:
    signal = udd.InputSignal(T, U, hold=hold)
    run = udd.simulate(SWING, [0, 6.0], START, inputs={"u": signal}, method=method, rtol=1e-11, atol=1e-13)
    # The lower orders add up their tolerance over some thousand steps.
    tight = 1e-12 if method in ("dop853", "taylor") else 1e-9
    np.testing.assert_allclose(run.state[-1], by_scipy(signal), atol=tight)


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_an_ensemble_and_a_delay(hold: Any) -> None:
    signal = udd.InputSignal(T, U, hold=hold)
    late = SWING.with_parameters({"tau": 0.123})
    many = udd.ensemble(late, [0.0, 6.0], [START, START], inputs={"u": signal}, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(many.end, [by_scipy(signal, 0.123)] * 2, atol=1e-11)


def test_samples_without_times_belong_to_those_of_the_run() -> None:
    force = udd.Model(["x"], ["u"], inputs=["u"])
    # The trapezoidal rule is exact for straight lines.
    run = udd.simulate(force, T, [0.0], inputs={"u": U})
    np.testing.assert_allclose(np.diff(run.x), 0.05 * (U[1:] + U[:-1]) / 2, atol=1e-12)


def test_dense_output_between_the_samples() -> None:
    run = udd.simulate(
        SWING, [0, 6.0], START, inputs={"u": udd.InputSignal(T, U)}, method="taylor", dense=True
    )
    h = 1e-4
    at = T[5:-5] + 0.02
    slope = (run(at + h) - run(at - h)) / (2 * h)
    rates = SWING.with_inputs({"u": udd.InputSignal(T, U)}).rates(at, run(at))
    # Central differences: h^2 times a third derivative of the order of one.
    np.testing.assert_allclose(slope, rates, atol=1e-6)


@pytest.mark.parametrize(
    ("inputs", "says"),
    [
        (None, 'need signals: give inputs={"u"'),
        ({"w": udd.InputSignal([0.0, 9.0], [0.0, 1.0])}, "no input 'w'; it has u"),
        ({}, "the input u needs a signal"),
        (
            {"u": udd.InputSignal([0.0, 5.0], [0.0, 1.0])},
            "known from t = 0 to 5, but the run goes",
        ),
        ({"u": "torque.csv"}, "the input u: an input's samples must be"),
        ([1.0], "inputs must be a table"),
    ],
)
def test_bad_inputs_are_named(inputs: Any, says: str) -> None:
    with pytest.raises(ModelError, match=says):
        udd.simulate(SWING, [0.0, 6.0], START, inputs=inputs)


def test_a_model_without_inputs_takes_none() -> None:
    with pytest.raises(ModelError, match="a DLE has no inputs"):
        udd.simulate(udd.DLE(1.0), 1.0, [1, 1, 0], inputs={"u": udd.InputSignal([0.0, 1.0], [0.0, 1.0])})


def test_exponents_of_a_measured_drive_are_refused() -> None:
    driven = SWING.with_inputs({"u": udd.InputSignal(T, U)})
    with pytest.raises(ModelError, match="as long as its record lasts"):
        udd.lyapunov_spectrum(driven, state0=START)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"inputs": ["c"]}, "the name c is given twice"),
        ({"inputs": ["sin"]}, "an? input cannot be called sin"),
        ({"inputs": ["u"], "delays": {"u": "late"}}, "the delay of u must be one of the parameters c"),
        ({"inputs": ["u"], "delays": {"w": "c"}}, "a delay of 'w', but the inputs are u"),
        ({"inputs": "u"}, "inputs must be a list of names"),
        ({"inputs": [f"u{k}" for k in range(9)]}, "at most 8 inputs, not 9"),
    ],
)
def test_bad_models_with_inputs_are_named(options: Any, says: str) -> None:
    with pytest.raises(ModelError, match=says):
        udd.Model(["x"], ["-c*x"], {"c": 1.0}, **options)


def test_models_with_inputs_are_written_down() -> None:
    from udd.models.serialization import model_from_dict, model_to_dict

    assert model_from_dict(model_to_dict(SWING)) == SWING
    assert "inputs=['u'], delays={'u': 'tau'}" in repr(SWING)
