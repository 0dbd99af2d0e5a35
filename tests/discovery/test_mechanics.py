"""Missing terms of users' mechanical models: dry friction first, and no drive at their own modes."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.discovery.hypotheses import log_prior
from udd.discovery.scoring.candidates import library
from udd.discovery.scoring.natural_modes import belongs, modes
from udd.discovery.trial_fits import TrialFit

SPRING = udd.Model(["x", "v"], {"x": "v", "v": "-k*x - c*v"}, {"k": 39.0, "c": 0.1})


def sliding(t: np.ndarray, x: float, w: float, dry: float) -> np.ndarray:
    """A mass on a spring with dry friction: half a cosine around the pull's end, until friction holds it."""
    result, begin, hold = np.empty(len(t)), 0.0, dry / w**2
    while abs(x) > hold and begin <= t[-1]:
        centre = np.sign(x) * hold
        each = t >= begin
        result[each] = centre + (x - centre) * np.cos(w * (t[each] - begin))
        begin, x = begin + np.pi / w, 2 * centre - x
    result[t >= begin] = x
    return result


def test_dry_friction_is_in_the_library_of_every_speed():
    state = udd.simulate(SPRING, np.arange(0, 5, 0.05), [1.0, 0.0]).state
    dry = [c for c in library(SPRING, (), state) if c.effect.name == "dry_v_in_v"]
    widths = [c.effect.parameters["eps"] for c in dry]
    assert len(dry) == 4 and max(widths) < state[:, 1].std() and all(c.usual for c in dry)
    # Friction takes energy out.
    assert dry[0].effect.spec.parameters[0].range == (-np.inf, 0.0)
    carts = udd.Model(["x", "y", "v", "w"], {"x": "v", "y": "w", "v": "-x", "w": "-y"})
    run = udd.simulate(carts, np.arange(0, 5, 0.05), [1.0, 0.5, 0.0, 0.0]).state
    titles = {c.title for c in library(carts, (), run)}
    assert {"dry friction of v in v'", "dry friction of v - w in w'"} <= titles


def test_forces_come_before_products_of_states():
    usual = {c.title: c.usual for c in library(SPRING)}
    assert all(usual[f"{text} in v'"] for text in ("1", "x", "v", "abs(v)*v", "v^3", "x^3"))
    assert not any(usual[f"{text} in v'"] for text in ("x*v", "v^2", "x^2", "x*v^2"))
    # Models other than mechanical ones have no prior on their terms.
    lorenz = udd.Model(list("xyz"), {"x": "y - x", "y": "-x*z", "z": "x*y"})
    assert all(c.usual for c in library(lorenz))


def test_a_mass_that_slides_on_metal_has_dry_friction():
    t = np.arange(0, 12, 1 / 50)
    x = sliding(t, 0.1, 6.3, 0.1)
    assert np.ptp(x[-50:]) == 0.0  # it rests at last, off the middle
    seen = x + 2e-4 * np.random.default_rng(0).standard_normal(len(t))
    result = udd.discover(udd.Measurement(t, {"x": seen}), SPRING)
    assert result.verdict == "effect identified"
    assert [f.effect.name for f in result.effects] == ["dry_v_in_v"]
    assert result.effects[0].parameters["c1"] == pytest.approx(-0.1, rel=0.05)
    assert result.ratio[2] < 1.0


def test_modes_are_those_of_the_linearised_model_and_the_motions_own():
    t = np.arange(0, 60, 0.05)
    carts = udd.Model(["x", "y", "v", "w"], {"x": "v", "y": "w", "v": "-2*x + y", "w": "-2*y + x"})
    run = udd.simulate(carts, t, [1.0, 0.3, 0.0, 0.0]).state
    assert modes(carts, t, run) == pytest.approx(np.array([1.0, np.sqrt(3.0)]) / (2 * np.pi), rel=1e-6)
    swing = udd.Model(["a", "v"], {"a": "v", "v": "-9*sin(a)"}, angles=["a"])
    wide = udd.simulate(swing, t, [1.5, 0.0]).state
    result = modes(swing, t, wide)
    # A swing of 1.5 rad takes 1.16 times as long as a small one; a line of the record is 1/60 s.
    assert len(result) == 2 and result[0] == pytest.approx(result[1] / 1.16, abs=1 / 60 / 2)


def test_no_drive_is_told_at_a_systems_own_frequencies_or_the_mains():
    t = np.arange(0, 30, 0.02)
    run = udd.simulate(SPRING, t, [0.1, 0.0]).state
    seen = run[:, 0] + 1e-4 * np.random.default_rng(0).standard_normal(len(t))
    fit = udd.fit(udd.Measurement(t, {"x": seen}), SPRING)
    each = np.sqrt(39.0) / (2 * np.pi)
    # Hum of 60 Hz at 50 frames a second is seen at 10 Hz.
    asked = np.array(
        [each, 2 * each, 4 * each, 50.0, 60.0, 10.0, 1.5 * each, 0.5 * each, 7 * each, 48.0, 9.0]
    )
    assert belongs(asked, fit).tolist() == [True] * 6 + [False] * 5


def test_two_frictions_are_found_together_where_one_would_do_for_the_first_part():
    t = np.arange(0, 60, 1 / 25)
    step = 2 * np.pi / 14400
    drags = [udd.effects.quadratic_drag(c=0.02), udd.effects.coulomb(c=0.01)]
    truth = udd.Pendulum(0.8, k0=0.004, effects=drags)
    theta = udd.simulate(truth, t, [0.0, 0.8]).state[:, 1]
    result = udd.discover(
        udd.Measurement(t, {"theta": np.round(theta / step) * step}), udd.Pendulum(0.8, k0=0.004)
    )
    assert {f.effect.name for f in result.effects} == {"quadratic_drag", "coulomb"}
    values = {f.effect.name: f.parameters["c"] for f in result.effects}
    assert values == pytest.approx({"quadratic_drag": 0.02, "coulomb": 0.01}, rel=0.1)
    assert result.error_after.whole < 2 * result.error_after.floor[-1]


def test_mere_products_and_several_terms_pay_more():
    """A product of states pays five nats, and each further term the choice of it."""
    usual, odd = (c for c in library(SPRING) if c.title in ("v^3 in v'", "x*v^2 in v'"))
    order = sorted([usual, odd], key=lambda c: not c.usual)

    def prior(candidates):
        return log_prior(TrialFit(candidates, None, [], 0.0), 20)  # type: ignore[arg-type]

    assert [prior([c]) for c in order] == pytest.approx([-np.log(20), -np.log(20) - 5.0])
    assert prior(order) == pytest.approx(-2 * np.log(20) - 5.0)
