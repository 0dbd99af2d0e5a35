"""Fits of the user's own models: states seen as they are, or not seen at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import udd
from lorenz import lorenz
from udd.errors import FitError
from udd.measurement import Measurement, MeasurementError, read_measurement


def measured(
    model: udd.Model, t: np.ndarray, start: list[float], noise: list[float], seed: int
) -> np.ndarray:
    state = udd.simulate(model, t, start, method="taylor").state
    return state + np.array(noise) * np.random.default_rng(seed).standard_normal(state.shape)


def test_lorenz_is_fitted_from_noisy_states() -> None:
    t = np.arange(0.0, 12.0, 0.02)
    noise = [0.8, 0.9, 0.85]  # ten percent
    seen = Measurement(t, measured(lorenz(), t, [-5.0, -6.0, 22.0], noise, 1), names=("x", "y", "z"))
    assert seen.kind == "own"
    result = udd.fit(seen, lorenz(sigma=9.0, rho=26.0, beta=3.0))
    assert result.converged and set(result.parameters) == {"sigma", "rho", "beta"}
    for name, true in lorenz().parameters.items():
        # One of three parameters is off by four standard errors in one of 5000 records.
        assert abs(result.parameters[name] - true) < 4.0 * result.errors[name]
        assert result.errors[name] < 0.02 * true
    # The noise is found as it is, to a few percent of 600 frames.
    sd = result.noise.sd(result.record, np.zeros(len(result.record.t)))
    np.testing.assert_allclose(np.median(sd, axis=0), noise, rtol=0.15)
    assert set(result.to_dict()["noise"]) == {"x", "y", "z"}
    assert result.residuals.shape == (len(t), 3) and 0.7 < result.scatter < 1.3


def test_a_state_that_is_not_seen_is_found() -> None:
    t = np.arange(0.0, 8.0, 0.02)
    values = measured(lorenz(), t, [-5.0, -6.0, 22.0], [0.1, 0.1, 0.1], 2)
    result = udd.fit(Measurement(t, values[:, :2], names=("x", "y")), lorenz(rho=27.0), free=["rho"])
    assert abs(result.parameters["rho"] - 28.0) < 4.0 * result.errors["rho"]
    truth = udd.simulate(lorenz(), t, [-5.0, -6.0, 22.0], method="taylor").state
    error = (result.states - truth)[:, 2] / np.sqrt(result.state_covariance[:, 2, 2])
    # Errors in units of their own: neighbours share theirs, so that the mean of their squares varies.
    assert 0.3 < np.sqrt((error**2).mean()) < 2.0
    assert np.isnan(result.misfit[:, 2]).all() and result.to_dict()["noise"].keys() == {"x", "y", "z"}


def test_an_angle_counts_modulo_a_turn() -> None:
    driven = udd.Model(
        ["theta", "v"],
        ["v", "-sin(theta) - c*v + f*cos(w*t)"],
        {"c": 0.3, "f": 1.4, "w": 0.7},
        angles=["theta"],
    )
    t = np.arange(0.0, 60.0, 0.1)
    theta = measured(driven, t, [0.2, 0.0], [0.01, 0.0], 3)[:, 0]
    assert np.ptp(theta) > 2 * np.pi
    wrapped = Measurement(t, np.mod(theta + np.pi, 2 * np.pi) - np.pi, names=("theta",))
    result = udd.fit(wrapped, driven.replace(c=0.25, f=1.35), free=["c", "f"])
    for name in ("c", "f"):
        assert abs(result.parameters[name] - driven.parameters[name]) < 4.0 * result.errors[name]
    # Seen in either way it is the same to the fit.
    assert result.scatter == pytest.approx(1.0, abs=0.2)


def test_a_term_that_is_missing_is_fitted() -> None:
    t = np.arange(0.0, 40.0, 0.05)
    swing = udd.Model(["theta", "v"], ["v", "-k*sin(theta)"], {"k": 1.0}, angles=["theta"])
    damped = swing.with_term("v", "v*abs(v)", drag=-0.05)  # type: ignore[attr-defined]
    theta = udd.simulate(damped, t, [2.0, 0.0]).state[:, 0] + 0.005 * np.random.default_rng(
        4
    ).standard_normal(len(t))
    seen = Measurement(t, theta, names=("theta",))
    result = udd.fit(seen, swing.with_term("v", "v*abs(v)", drag=0.0))  # type: ignore[attr-defined]
    assert abs(result.parameters["drag"] + 0.05) < 4.0 * result.errors["drag"] < 0.01
    assert result.scatter < 1.2
    # The model without it has a large model error, with no larger misfits; its evidence distinguishes the
    # two.
    assert result.evidence > udd.fit(seen, swing).evidence + 10.0


def test_measurements_of_own_models_are_read_back(tmp_path: Path) -> None:
    t = np.arange(0.0, 2.0, 0.1)
    seen = Measurement(t, {"u": np.sin(t), "v": np.cos(t)}, sigma={"u": 0.1 + 0 * t, "v": 0.2 + 0 * t})
    file = tmp_path / "own.csv"
    seen.to_csv(file)
    again = read_measurement(file, states=["u", "v"])
    np.testing.assert_array_equal(again.values, seen.values)
    assert again.names == ("u", "v") and again.kind == "own"
    with pytest.raises(MeasurementError, match="no column w"):
        read_measurement(file, states=["u", "w"])


def test_what_does_not_belong_together_is_refused() -> None:
    t = np.arange(0.0, 2.0, 0.1)
    each = Measurement(t, {"u": np.sin(t)})
    with pytest.raises(FitError, match="columns u, but the model's states are x, y, z"):
        udd.fit(each, lorenz())
    with pytest.raises(FitError, match="columns u, which are neither a disk's"):
        udd.fit(each, udd.Pendulum(0.5))
