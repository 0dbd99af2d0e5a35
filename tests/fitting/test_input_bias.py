"""Bias by an input's noise, and the warning of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import udd
from udd.errors import FitError

ARM = udd.Model(
    ["q", "v"], ["v", "-k*sin(q) - c*v + g*u"], {"k": 9.0, "c": 0.2, "g": 2.0}, angles=["q"], inputs=["u"]
)


def record(seed: int, noise: float, step: float = 0.02) -> udd.Measurement:
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 15.0, step)
    drive = np.sin(1.3 * t + rng.uniform(0, 6)) + 0.5 * np.sin(3.7 * t + rng.uniform(0, 6))
    run = udd.simulate(ARM, t, [0.3, 0.0], inputs={"u": drive}, method="auto")
    seen = run.q + 1e-3 * rng.normal(size=len(t))
    return udd.Measurement(t, {"q": seen}, inputs={"u": drive + noise * rng.normal(size=len(t))})


def test_extrapolation_takes_the_bias_of_the_gain_away() -> None:
    off = ARM.with_parameters({"k": 8.0, "c": 0.4, "g": 1.5})
    plain, corrected = [], []
    for seed in range(8):
        result = udd.fit(record(seed, 0.3, 0.05), off)
        plain.append(result.parameters["g"])
        corrected.append(udd.input_bias(result).corrected["g"])
    # Over eight records the plain gain is significantly too small; the corrected mean is the truth.
    error = np.std(plain, ddof=1) / np.sqrt(8)
    assert np.mean(plain) < 2.0 - 4.0 * error
    assert abs(np.mean(corrected) - 2.0) < 3.0 * np.std(corrected, ddof=1) / np.sqrt(8)
    assert abs(np.mean(corrected) - 2.0) < 0.5 * abs(np.mean(plain) - 2.0)


def test_an_input_that_scatters_is_told() -> None:
    noisy, clean = udd.fit(record(0, 0.3), ARM), udd.fit(record(0, 0.0), ARM)
    (reported,) = noisy.doubts.inputs
    assert reported.name == "u" and abs(reported.noise / 0.3 - 1.0) < 0.2
    assert "warning: the input u has noise of 0.2" in noisy.summary()
    assert not clean.doubts.inputs
    # That noise is no sign of a missing effect: it makes g sigma/sqrt(2) = 0.42 of v' or some more.
    assert not noisy.doubts.missing and noisy.doubts.factor == 1.0
    assert "the inputs' noise causes 0.5" in noisy.summary()
    for name in ("k", "c"):
        assert abs(noisy.parameters[name] - ARM.parameters[name]) < 4.0 * noisy.errors[name]


def test_a_model_without_inputs_has_no_such_bias() -> None:
    t = np.arange(0.0, 5.0, 0.02)
    swing = udd.Model(["q", "v"], ["v", "-k*q"], {"k": 4.0})
    fit = udd.fit(udd.Measurement(t, {"q": np.cos(2 * t) + 1e-3 * np.sin(77 * t)}), swing)
    with pytest.raises(FitError, match="the model has no inputs"):
        udd.input_bias(fit)


@pytest.mark.parametrize(
    ("hold", "search"),
    [
        ("zero", True),
        ("linear", False),
        # The fit of the known model asks the same: its verdict is what a search begins with.
        pytest.param("linear", True, marks=pytest.mark.nightly),
    ],
)
def test_a_drive_that_is_white_itself_is_not_taken_for_noise(hold: Any, search: bool) -> None:
    """A pseudo-random binary signal, or noise that was added on purpose and is known, has no noise."""
    rng = np.random.default_rng(0)
    t = np.arange(0.0, 20.0, 0.02)
    values = np.sign(rng.normal(size=len(t))) if hold == "zero" else rng.normal(size=len(t))
    drive = udd.InputSignal(t, 3.0 * values, hold=hold)
    baseline = udd.Model(["x", "v"], ["v", "-k*x - c*v + u"], {"k": 4.0, "c": 0.3}, inputs=["u"])
    run = udd.simulate(
        baseline.with_term("v", "x^3", q=-3.0), t[:-5], [0.5, 0.0], inputs={"u": drive}, method="auto"
    )
    measured = udd.Measurement(t[:-5], {"x": run.x + 1e-3 * rng.normal(size=len(run.x))}, inputs={"u": drive})
    assert udd.fit(measured, baseline).doubts.missing
    if not search:
        return
    result = udd.discover(measured, baseline)
    assert any("x^3" in effect.expression for effect in result.effects)
