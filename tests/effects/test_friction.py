"""Dry friction and its treatments, from Python."""

from __future__ import annotations

import itertools
import json
import pickle

import numpy as np
import pytest

import discovered
import udd
from udd import effects
from udd.cli import main
from udd.errors import IncompleteWarning, ModelError, UddError

TIGHT = {"rtol": 1e-12, "atol": 1e-14}
TREATMENTS = ("smoothed", "set-valued", "karnopp", "lugre")


def oscillator(mu: float, treatment: str, eps: float = 0.05) -> udd.Pendulum:
    """``theta'' + theta = -mu sgn theta'``: no weight, but a cable that turns it back."""
    dry = effects.coulomb(c=mu, eps=eps, treatment=treatment)
    return udd.Pendulum(1.0, g=0.0, effects=[effects.cable_torque(kappa=1.0), dry])


def test_the_amplitude_falls_by_2_mu_per_half_cycle() -> None:
    run = udd.simulate(oscillator(0.1, "set-valued"), 40.0, [0.0, 1.53], **TIGHT)
    assert run.events.kind == ("reversal",) * 7 + ("stick",)
    i = np.arange(1, 9)
    # Some hundred steps of 1e-12 each.
    np.testing.assert_allclose(run.events.t, i * np.pi, rtol=1e-10)
    np.testing.assert_allclose(np.abs(run.events.state[:, 1]), np.abs(1.53 - 0.2 * i), rtol=1e-9)
    assert run.outcome == "finished" and run.Omega[-1] == 0.0
    np.testing.assert_array_equal(run.state[-1], run.events[-1].state)


def test_what_is_lost_is_friction_times_the_way() -> None:
    """The weight of a real pendulum, viscous friction beside: the energy book over each half swing."""
    c, k0, length = 0.05, 0.004, 0.5
    dry = effects.coulomb(c=c, treatment="set-valued")
    run = udd.simulate(udd.Pendulum(length, k0=k0, effects=dry), 60.0, [0.0, 1.2], **TIGHT, dense=True)
    assert run.events.kind[-1] == "stick"

    def energy(state: np.ndarray) -> np.ndarray:
        return length**2 * state[..., 0] ** 2 / 2 - 9.81 * length * np.cos(state[..., 1])

    edges = np.concatenate([[0.0], run.events.t])
    nodes, weights = np.polynomial.legendre.leggauss(40)
    for start, end in itertools.pairwise(edges):
        ends = run(np.array([start, end]))
        t = start + (end - start) * (nodes + 1) / 2
        viscous = (end - start) / 2 * weights @ (k0 * run(t)[:, 0] ** 2)
        lost = energy(ends[0]) - energy(ends[1])
        # Between steps the polynomial is of order 4: 1e-8 of the state.
        assert abs(lost - viscous - c * abs(ends[1, 1] - ends[0, 1])) < 1e-6 * lost


def test_at_rest_it_stays_while_friction_holds() -> None:
    model = udd.Pendulum(0.5, effects=effects.coulomb(c=0.5, treatment="set-valued"))
    edge = np.arcsin(0.5 / (9.81 * 0.5))
    for theta, kinds in ((0.999 * edge, ()), (-0.999 * edge, ()), (1.2 * edge, ("stick",))):
        run = udd.simulate(model, 10.0, [0.0, theta])
        assert run.events.kind == kinds
        assert (run.Omega == 0.0).all() == (not kinds)
    np.testing.assert_array_equal(model.rates(0.0, [[0.0, 0.5 * edge]]), [[0.0, 0.0]])
    # Beyond, friction takes its part of the torque, on either side.
    torque = 9.81 * 0.5 * np.sin(0.3) - 0.5
    for sign in (-1, 1):
        np.testing.assert_allclose(model.rates(0.0, [0.0, sign * 0.3])[0], -sign * torque / 0.25, rtol=1e-13)


def test_a_stuck_disk_is_carried_to_the_edge() -> None:
    model = udd.Disk(0.05, effects=effects.coulomb(c=0.02, treatment="set-valued"))
    with pytest.warns(IncompleteWarning, match="left the wheels"):
        run = udd.simulate(model, 20.0, [0.0, 1e-3, 0.0, 0.3])
    assert run.outcome == "ejected" and run.events.kind == ("edge",)
    np.testing.assert_array_equal(run.state[:, [0, 1, 3]], [[0.0, 1e-3, 0.3]] * len(run.t))
    np.testing.assert_allclose(run.t[-1], np.sqrt(0.08**2 - 1e-6) / 0.05, rtol=1e-12)
    with pytest.warns(IncompleteWarning, match="left the wheels"):
        moving = udd.simulate(model, 20.0, [3.0, 1e-3, 0.0, 0.0])
    assert moving.events.kind[-2:] == ("stick", "edge")


def test_a_rippling_drive_lets_the_disk_go() -> None:
    c, y, ripple, f = 0.02, 1.7e-3, 0.9, 10.0
    dry = effects.coulomb(c=c, treatment="set-valued")
    model = udd.Disk(0.05, effects=[dry, effects.drive_ripple(a=-ripple, f=f)])
    run = udd.simulate(model, 0.1, [0.0, y, 0.0, 0.0])
    assert run.events.kind[:2] == ("slip", "stick")
    # Y (g + dW_c/dT) = c, with W_c = W (1 - a cos(2 pi f T)).
    rate = 0.05 * ripple * 2 * np.pi * f
    np.testing.assert_allclose(run.events.t[0], np.arcsin((c / y - 9.81) / rate) / (2 * np.pi * f), rtol=1e-9)


@pytest.mark.parametrize("treatment", ["smoothed", "karnopp", "lugre"])
def test_treatments_come_to_the_set_valued_law(treatment: str) -> None:
    def end(treatment: str, eps: float) -> np.ndarray:
        model = oscillator(0.1, treatment, eps)
        start = [0.5, 1.2, 0.0][: len(model.state_names)]
        return udd.simulate(model, [0.0, 8.0], start, **TIGHT).state[-1, :2]

    exact = end("set-valued", 0.05)
    far, close = (np.abs(end(treatment, eps) - exact).max() for eps in (4e-3, 2.5e-4))
    # In the root of the width at least.
    assert close < far / 3.5 + 1e-12 and close < 0.02


def test_stribeck_friction_sticks_by_its_size_at_rest() -> None:
    dry = effects.stribeck(c=0.3, fade=0.5, treatment="set-valued")
    run = udd.simulate(udd.Pendulum(0.5, k0=0.02, effects=dry), 60.0, [0.0, 1.0])
    assert run.events.kind[-1] == "stick"
    assert 9.81 * 0.5 * abs(np.sin(run.theta[-1])) < 0.3
    # Friction at speed is less, so that it swings on for longer than with Coulomb's of the same size.
    coulomb = udd.Pendulum(0.5, k0=0.02, effects=effects.coulomb(c=0.3, treatment="set-valued"))
    assert udd.simulate(coulomb, 60.0, [0.0, 1.0]).events.t[-1] < run.events.t[-1]


def test_bristles_are_a_state() -> None:
    model = oscillator(0.1, "lugre", 0.01)
    assert model.state_names == ("Omega", "theta", "bristle") and model.state_units[-1] == "rad"
    assert model.units["coulomb.eps"] == "rad"
    assert udd.Pendulum.state_names == ("Omega", "theta")
    assert model.with_effects([]).state_names == ("Omega", "theta")
    assert oscillator(0.1, "smoothed").with_effects(model.effects).state_names == model.state_names
    run = udd.simulate(model, 40.0, [0.0, 1.5, 0.0])
    np.testing.assert_allclose(run.bristle[-1] * 0.1 / 0.01, -run.theta[-1], rtol=1e-3)
    with pytest.raises(ModelError, match="3 components Omega, theta, bristle"):
        udd.simulate(model, 1.0, [0.0, 1.5])
    disk = udd.Disk(0.05, effects=effects.coulomb(c=0.02, treatment="lugre"))
    assert disk.rates(0.0, [[3.0, 1e-3, 0.0, 0.0, 0.0]] * 2).shape == (2, 5)
    with pytest.warns(IncompleteWarning, match="left the wheels"):
        assert udd.simulate(disk, 20.0, [0.0, 1e-3, 0.0, 0.0, 0.0]).outcome == "ejected"


@pytest.mark.parametrize("treatment", TREATMENTS)
def test_effects_keep_their_treatment(treatment: str) -> None:
    dry = effects.coulomb(c=0.1, treatment=treatment)
    assert dry.treatment == treatment and eval(repr(dry), {"coulomb": effects.coulomb}) == dry
    assert dry.replace(c=0.2).treatment == treatment
    model = udd.Pendulum(0.5, effects=dry)
    assert pickle.loads(pickle.dumps(model)) == model
    assert model.with_parameters({"coulomb.c": 0.2}).effects[0] == dry.replace(c=0.2)
    assert (model == udd.Pendulum(0.5, effects=effects.coulomb(c=0.1))) == (treatment == "smoothed")
    sign = {"smoothed": "tanh(Omega/0.05)", "set-valued": "Sgn(Omega)"}
    assert sign.get(treatment, "(Omega, 0.05)") in dry.expression


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: effects.coulomb(c=0.1, treatment="sticky"), "treatment of coulomb must be 'smoothed' or"),
        (lambda: effects.quadratic_drag(c=0.1, treatment="smoothed"), "it is not dry friction"),
        (
            lambda: udd.simulate(
                udd.Pendulum(0.5, effects=effects.stribeck(c=0.1, treatment="lugre")), 1.0, [0, 1, 0]
            ),
            "needs coulomb beside it",
        ),
        (
            lambda: udd.simulate(
                udd.Pendulum(
                    0.5, effects=[effects.coulomb(c=0.1, treatment="lugre"), effects.stribeck(c=0.1)]
                ),
                1.0,
                [0, 1, 0],
            ),
            "all dry friction must have it",
        ),
        (
            lambda: udd.lyapunov(
                udd.Pendulum(0.5, effects=effects.coulomb(c=0.1, treatment="lugre")), state0=[0, 1, 0]
            ),
            "is for udd.simulate",
        ),
    ],
)
def test_what_cannot_be_is_said(call, named) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ModelError) as caught:
        call()
    assert named in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("treatment", TREATMENTS[1:])
def test_fits_take_smoothed_friction_only(treatment: str) -> None:
    measured = discovered.pendulum().measurement
    model = udd.Pendulum(1.0, effects=effects.coulomb(c=0.1, treatment=treatment))
    with pytest.raises(UddError, match="a fit needs smoothed friction: give coulomb"):
        udd.fit(measured, model)


def test_the_command_line_has_the_choice(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["simulate", "--pendulum", "0.5", "--effect", "coulomb:c=0.05,treatment=set-valued", "--json"]
    assert main([*argv, "--state", "0,0.1", "--t", "20"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["state"][-1][0] == 0.0
