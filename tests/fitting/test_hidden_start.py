"""Starts of states that no sensor shows."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.errors import FitError

T = 4.0 * np.arange(1024)
#: Cascaded tanks: the lower one's level is seen, the upper one's is not; a pump fills that.
TANKS = udd.Model(
    ["x1", "x2"],
    ["-k1*sqrt(x1) + k4*u", "k2*sqrt(x1) - k3*sqrt(x2)"],
    {"k1": 0.0544, "k2": 0.0443, "k3": 0.0471, "k4": 0.0504},
    inputs=["u"],
)
OFF = TANKS.with_parameters({"k1": 0.06, "k2": 0.06, "k3": 0.06})


def tanks(seed: int) -> udd.Measurement:
    rng = np.random.default_rng(seed)
    waves = [np.cos(2 * np.pi * k * np.arange(1024) / 1024 + rng.uniform(0, 6.28)) for k in range(1, 12)]
    pump = udd.InputSignal(T, np.clip(3 + 0.35 * np.sum(waves, axis=0), 0.5, 6.0), hold="zero")
    run = udd.simulate(TANKS, T, [4.0, 6.0], inputs={"u": pump}, method="auto")
    return udd.Measurement(T, {"x2": run.x2 + 0.02 * rng.normal(size=len(T))}, inputs={"u": pump})


def test_the_hidden_start_of_a_tank_is_found() -> None:
    pulls = []
    for seed in range(6):
        result = udd.fit(tanks(seed), OFF, ["k1", "k2", "k3"])
        each = [(result.parameters[n] - TANKS.parameters[n]) / result.errors[n] for n in ("k1", "k2", "k3")]
        pulls.append([*each, (result.states[0, 0] - 4.0) / np.sqrt(result.state_covariance[0, 0, 0])])
    # 24 pulls: the largest of as many normal ones exceeds 4.2 in 1 of 1000, their mean square 2 as rarely.
    assert np.abs(pulls).max() < 4.2
    assert 0.3 < np.square(pulls).mean() < 2.0


def test_what_the_data_cannot_say_is_told() -> None:
    """The upper level times a^2, k1 and k4 with it and k2 the other way, is the same motion of the lower."""
    with pytest.raises(FitError, match="k1 and k2 and k4 can change together"):
        udd.fit(tanks(0), OFF)


def test_a_state_that_is_asked_for_is_named() -> None:
    t = np.arange(0.0, 10.0, 0.05)
    separate = udd.Model(["x", "y"], ["-k*x", "-ln(y)"], {"k": 0.3})
    with pytest.raises(
        FitError, match=r"y is not observed: say where the motion starts, state0=\{'y': ...\}"
    ):
        udd.fit(udd.Measurement(t, {"x": np.exp(-0.3 * t) + 1e-3 * np.sin(77 * t)}), separate)
