"""Missing terms of a machine with a measured input whose sensor has noise."""

from __future__ import annotations

import numpy as np
import pytest

import udd

T = np.arange(0.0, 12.0, 0.01)
ARM = udd.Model(
    ["q", "v"],
    ["v", "(torque - weight*sin(q) - viscous*v)/J"],
    {"J": 0.06, "weight": 1.0, "viscous": 0.04},
    angles=["q"],
    inputs=["torque"],
)


def record(seed: int, drag: float) -> udd.Measurement:
    """An arm with a drag of its own, an encoder of 4096 steps, a torque sensor with noise of 0.5 %."""
    rng = np.random.default_rng(seed)
    f, phase = rng.uniform(0.15, 1.2, 6), rng.uniform(0, 2 * np.pi, 6)
    torque = 0.4 * np.sin(2 * np.pi * np.multiply.outer(T, f) + phase).sum(axis=1)
    true = ARM.with_effects([udd.effects.formula("v'", "c*abs(v)*v", c=-drag)])
    run = udd.simulate(true, T, [0.0, 0.0], inputs={"torque": torque}, method="auto")
    step = 2 * np.pi / 4096
    noisy = torque + 0.005 * torque.std() * rng.normal(size=len(T))
    return udd.Measurement(T, {"q": step * np.round(run.q / step)}, inputs={"torque": noisy})


# Seed 1 asks the same.
@pytest.mark.parametrize("seed", [pytest.param(0, marks=pytest.mark.nightly), 1])
def test_a_drag_is_named_beside_the_noise_of_the_torque(seed: int) -> None:
    baseline = ARM.with_parameters({"J": 0.066, "weight": 0.95})
    result = udd.discover(record(seed, 0.25), baseline)
    (added,) = result.effects
    assert result.verdict == "effect identified"
    assert added.effect.name == "abs_v_v_in_v"
    # Within 5 %: noise of the torque is 0.5 %, and the arm's constants are free too.
    (value,) = added.effect.parameters.values()
    assert abs(value / -0.25 - 1.0) < 0.05
    assert result.ratio[2] < 0.2


def test_noise_of_the_torque_is_no_effect() -> None:
    result = udd.discover(record(2, 0.0), ARM.with_parameters({"J": 0.066, "weight": 0.95}))
    assert result.verdict == "nothing missing" and not result.effects
