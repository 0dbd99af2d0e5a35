"""Fits of models with measured inputs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import udd
from udd.errors import FitError

T = np.arange(0.0, 15.0, 0.02)
TRUTH = {"k": 9.0, "c": 0.2, "g": 2.0, "tau": 0.05}
ARM = udd.Model(
    ["q", "v"],
    ["v", "-k*sin(q) - c*v + g*u"],
    TRUTH,
    angles=["q"],
    inputs=["u"],
    delays={"u": "tau"},
)


def record(seed: int, hold: Any = "linear", start: float = 0.0) -> udd.Measurement:
    """A drawn drive, the motion by it, and an encoder's noise of 1 mrad; the clock starts anywhere."""
    rng = np.random.default_rng(seed)
    drive = 1.5 * np.sin(1.3 * T + rng.uniform(0, 6)) + np.cumsum(rng.normal(size=len(T))) * 0.05
    signal = udd.InputSignal(T, drive, hold=hold)
    run = udd.simulate(ARM, T, [0.3, 0.0], inputs={"u": signal}, method="auto")
    seen = run.q + 1e-3 * rng.normal(size=len(T))
    return udd.Measurement(T + start, {"q": seen}, inputs={"u": signal.shifted(start)})


@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_gain_and_delay_of_an_input_are_found(hold: Any) -> None:
    off = ARM.with_parameters({"k": 7.0, "c": 0.4, "g": 1.5, "tau": 0.0})
    pulls = []
    for seed in range(6):
        result = udd.fit(record(seed, hold), off)
        pulls.append([(result.parameters[n] - value) / result.errors[n] for n, value in TRUTH.items()])
    # 24 pulls: the largest of as many normal ones exceeds 4.2 in 1 of 1000.
    assert np.abs(pulls).max() < 4.2
    # Their mean square is chi2/24: within 0.4 to 2 but in 1 of 1000.
    assert 0.4 < np.square(pulls).mean() < 2.0


def test_records_have_drives_and_clocks_of_their_own() -> None:
    off = ARM.with_parameters({"k": 7.0, "g": 1.5})
    result = udd.fit([record(1, start=100.0), record(2, start=-5.0)], off)
    for name, value in TRUTH.items():
        assert abs(result.parameters[name] - value) < 4.2 * result.errors[name]
    alone = udd.fit(record(1), off)
    assert result.errors["g"] < alone.errors["g"]
    # The second model's rates follow the second drive.
    drive = record(2).inputs["u"]
    model = result.models[1]
    assert isinstance(model, type(ARM))
    late = 3.0 - model.parameters["tau"]
    expected = model.parameters["g"] * drive(late)
    assert model.rates(3.0, [0.0, 0.0])[1] == pytest.approx(float(expected), rel=1e-9)


def test_what_is_lacking_is_named() -> None:
    measured = record(3)
    bare = udd.Measurement(measured.t, {"q": measured["q"]})
    with pytest.raises(FitError, match="lacks the model's input u; its inputs are: none"):
        udd.fit(bare, ARM)
    short = udd.Measurement(
        measured.t, {"q": measured["q"]}, inputs={"u": udd.InputSignal([0.0, 1.0], [0.0, 1.0])}
    )
    with pytest.raises(FitError, match="the input u is known from t = 0 to 1, but the measurement goes"):
        udd.fit(short, ARM)


def test_a_forecast_follows_the_input_of_its_own_measurement() -> None:
    result = udd.fit(record(1, start=100.0), ARM)
    other = record(2, start=-5.0)
    ahead = udd.forecast(other, result, 5.0, start=3.0, members=20)
    truth = np.interp(ahead.t, other.t, other["q"])
    # Straight lines through an encoder's 1 mrad, and what the state is known to at the start.
    assert np.sqrt(np.mean((ahead.median[:, 0] - truth) ** 2)) < 3e-3


def test_a_saved_fit_keeps_its_inputs(tmp_path: Path) -> None:
    result = udd.fit([record(1), record(2)], ARM)
    udd.save(result, tmp_path / "fit.npz")
    again = udd.load(tmp_path / "fit.npz")
    assert isinstance(again, udd.Fit)
    at = (3.0, [0.1, 0.2])
    for item, other in zip(again.models, result.models, strict=True):
        assert item.rates(*at).tolist() == other.rates(*at).tolist()
