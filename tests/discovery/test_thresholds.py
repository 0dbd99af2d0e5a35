"""Missing terms of a machine with a measured input that are not products: a delay, a dead zone."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.discovery.scoring.candidates import library
from udd.errors import ModelError

ARM = udd.Model(
    ["q", "v"],
    ["v", "(torque - weight*sin(q) - viscous*v)/J"],
    {"J": 0.05, "weight": 1.0, "viscous": 0.05},
    angles=["q"],
    inputs=["torque"],
)


def drive(t: np.ndarray, seed: int) -> np.ndarray:
    """Six waves from 0.15 to 1.2 Hz."""
    rng = np.random.default_rng(seed)
    f, phase = rng.uniform(0.15, 1.2, 6), rng.uniform(0, 2 * np.pi, 6)
    return np.asarray(np.sin(2 * np.pi * np.multiply.outer(t, f) + phase).sum(axis=1))


def test_a_delay_is_found() -> None:
    t = np.arange(0, 12, 0.02)
    late = ARM.with_effects([udd.effects.formula("delay(torque)", "tau", name="late", tau=0.03)])
    torque = 0.4 * drive(t, 1)
    run = udd.simulate(late, t, [0.3, 0.0], inputs={"torque": torque})
    seen = run.q + 1e-3 * np.random.default_rng(2).normal(size=len(t))
    baseline = ARM.replace(J=0.055, weight=0.95)
    result = udd.discover(udd.Measurement(t, {"q": seen}, inputs={"torque": torque}), baseline)
    assert result.verdict == "effect identified"
    (added,) = result.effects
    assert added.title == "delay of torque"
    (tau,) = added.effect.values
    error = result.fit.errors["delay_of_torque.tau"]
    # A pull of more than four standard errors happens by chance in 6 of 100,000 draws.
    assert abs(tau - 0.03) < 4 * error
    assert error < 1e-3


def test_a_spring_with_play_is_found() -> None:
    t = np.arange(0, 12, 0.025)
    baseline = udd.Model(
        ["x", "v"], ["v", "gain*u - k*x - c*v"], {"gain": 1.0, "k": 5.0, "c": 0.4}, inputs=["u"]
    )
    true = baseline.with_term("v", "max(x - 0.08, 0) + min(x + 0.08, 0)", stiff=-12.0)
    u = 0.8 * drive(t, 3)
    run = udd.simulate(true, t, [0.05, 0.0], inputs={"u": u})
    seen = run.x + 5e-4 * np.random.default_rng(4).normal(size=len(t))
    result = udd.discover(udd.Measurement(t, {"x": seen}, inputs={"u": u}), baseline.replace(gain=1.1, k=6.0))
    (added,) = result.effects
    assert added.title == "dead zone of x in v'"
    stiffness, play = added.effect.values
    assert abs(stiffness + 12.0) < 4 * result.fit.errors["dead_zone_of_x_in_v.c1"]
    assert abs(play - 0.08) < 4 * result.fit.errors["dead_zone_of_x_in_v.b"]


@pytest.mark.parametrize(
    ("kind", "gone"),
    [
        ("dead zone", "min(max(torque, -0.3), 0.3)"),
        ("limit", "(max(torque - 0.5, 0) + min(torque + 0.5, 0))"),
    ],
)
def test_what_a_motor_does_not_give_is_found(kind: str, gone: str) -> None:
    """Nothing within 0.3 N m, or nothing more than 0.5: what is missing takes the whole gain, 20, away."""
    t = np.arange(0, 9, 0.025)
    torque = 0.4 * drive(t, 5)
    run = udd.simulate(ARM.with_term("v", gone, less=-20.0), t, [0.3, 0.0], inputs={"torque": torque})
    seen = run.q + 1e-3 * np.random.default_rng(6).normal(size=len(t))
    baseline = ARM.replace(J=0.055, weight=0.95)
    result = udd.discover(udd.Measurement(t, {"q": seen}, inputs={"torque": torque}), baseline)
    (added,) = result.effects
    assert added.title == f"{kind} of torque in v'"
    errors = [result.fit.errors[f"{added.effect.name}.{name}"] for name in added.effect.parameters]
    for value, error, true in zip(
        added.effect.values, errors, (-20.0, 0.3 if kind == "dead zone" else 0.5), strict=True
    ):
        assert abs(value - true) < 4 * error < 0.1 * abs(true)


def test_a_delay_that_is_an_effect_is_the_parameter_s() -> None:
    t = np.linspace(0, 3, 301)
    named = ARM.replace(parameters=dict(ARM.parameters) | {"late": 0.03}, delays={"torque": "late"})
    added = ARM.with_effects([udd.effects.formula("delay(torque)", "tau", name="late", tau=0.03)])
    torque = drive(t, 0)
    runs = [udd.simulate(m, t, [0.3, 0.0], inputs={"torque": torque}).state for m in (named, added)]
    np.testing.assert_array_equal(*runs)
    assert "delay of torque" in [c.title for c in library(ARM)]
    for model in (named, added):
        assert "delay of torque" not in [c.title for c in library(model)]


@pytest.mark.parametrize(
    ("slot", "text", "said"),
    [
        ("delay(u)", "tau", "late delays u, but the model's inputs are torque"),
        ("delay(torque)", "2*tau", "the delay late must be one parameter, not a formula"),
    ],
)
def test_what_is_no_delay(slot: str, text: str, said: str) -> None:
    with pytest.raises(ModelError, match=said):
        ARM.with_effects([udd.effects.formula(slot, text, name="late", tau=0.01)])


def test_an_input_has_one_delay() -> None:
    late = udd.effects.formula("delay(torque)", "tau", name="late", tau=0.01)
    later = udd.effects.formula("delay(torque)", "tau", name="later", tau=0.01)
    with pytest.raises(ModelError, match="torque has a delay already"):
        ARM.with_effects([late, later])
