"""Friction with a place, a power, a time or a load of its own: named if it is there, silent if it is not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import udd
from udd.discovery.proposals import Proposals
from udd.discovery.score_rounds import ScoreRound, score_round
from udd.discovery.scoring.candidates import library
from udd.discovery.scoring.shape_scan import strongest_shapes
from udd.discovery.time_budget import Clock
from udd.discovery.trial_fits import of_library
from udd.fitting import fit_record, record_of

E = udd.effects


def seen(truth: Any, duration: float = 60.0, start: float = 1.0, noise: float = 5e-3) -> udd.Measurement:
    """A pendulum's angle 30 times a second, with noise of this size."""
    t = np.arange(0, duration, 1 / 30)
    theta = udd.simulate(truth, t, [0.0, start]).state[:, 1]
    return udd.Measurement(t, {"theta": theta + noise * np.random.default_rng(0).standard_normal(len(t))})


def scored(measured: udd.Measurement, model: Any) -> ScoreRound:
    """The scores around the known model's fit, as a search begins with it."""
    return score_round(fit_record(measured, record_of(measured, model), model, search=True))


def scores(law: udd.effects.Effect) -> ScoreRound:
    plain = udd.Pendulum(0.5, k0=0.01)
    return scored(seen(plain.with_effects([law]), noise=1e-3), plain)


#: Weak, so that scores are exact, and seen with little noise.
LAWS = [
    E.local_brake(a=0.005, c=0.15, s=0.08),
    E.power_drag(a=0.001, n=0.5),
    E.threshold_drag(a=0.001, c=1.5),
    E.warming_friction(a=0.001, tau=30.0),
    E.warming_friction(a=-0.001, tau=15.0),
    E.load_coulomb(f=0.0004),
    E.formula(
        "torque",
        "-a*exp(-((beta - 0.1)/0.15)^2)*tanh(Omega/0.01)",
        name="dry_brake",
        amplitudes=["a"],
        a=0.001,
    ),
    E.formula("torque", "-a*tanh(Omega/0.8)", name="saturating", a=0.002),
    E.formula("torque", "-a*abs(Omega)", name="one_way", a=0.001),
    E.formula("torque", "-a*Omega^2", name="one_way_drag", a=0.001),
]


def best_of(answer: ScoreRound, name: str) -> float:
    """The score of a law, in units of the best score."""
    usable = answer.usable()
    most = max(s.chi2 for s in usable)
    return (
        max((s.chi2 for s in usable if name in (s.candidate.effect.name, s.candidate.title)), default=0.0)
        / most
    )


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_the_law_scores_as_high_as_any(law):
    assert best_of(scores(law), law.name) > 0.99


@pytest.mark.parametrize(
    "law",
    [E.quadratic_drag(c=8e-4), E.cubic_drag(c=2e-4), E.coulomb(c=3e-4), E.stribeck(c=6e-4, fade=1.0)],
    ids=repr,
)
def test_a_free_number_does_not_come_before_the_right_law(law):
    assert scores(law).usable()[0].candidate.effect.name == law.name


def test_laws_with_a_scanned_number_compete_with_plain_ones():
    """In the first part a plain drag often explains as much; all data decide."""
    plain, truth = udd.Pendulum(0.5, k0=0.01), E.quadratic_drag(c=0.008)
    result = scored(seen(plain.with_effects([truth]), duration=20.0), plain)
    proposals = Proposals(result.fit, result, Clock(None, lambda _text: None))
    tried = {t.candidates[0].effect.name for t in proposals._singles(result.passing())}
    assert {"quadratic_drag", "power_drag", "warming_friction"} <= tried


def test_curves_far_below_the_best_term_are_not_located(monkeypatch):
    """Friction over the speed is: powers, thresholds and drags are its rivals."""
    plain = udd.Pendulum(0.5, k0=0.01)
    result = scored(seen(plain.with_effects([E.quadratic_drag(c=0.008)]), duration=20.0), plain)
    names = {name for slot, name in located(result)}
    assert {"|Omega|", "theta", "t"} <= names
    best = max(curve.evidence for curve in result.curves)
    monkeypatch.setattr(ScoreRound, "strongest", lambda _scores: best + 31.0)
    assert located(result) == {("friction", "|Omega|")}


def located(result: ScoreRound) -> set[tuple[str, str]]:
    """Slots and coordinates of the curves that a round fits in full."""
    curves = Proposals(result.fit, result, Clock(None, lambda _text: None))._near_curves()
    return {curve.name for curve in curves}


def test_scanned_values_score_as_their_full_derivatives_do():
    result = scores(E.local_brake(a=0.005, c=0.15, s=0.08))
    strongest, number = strongest_shapes(result.fit)
    listed = {s.candidate: s for s in result.library.scored}
    assert {s.candidate.effect.name for s in strongest} == {
        "local_brake",
        "power_drag",
        "threshold_drag",
        "warming_friction",
        "dry_brake",
        "two_brakes",
        "saturating",
        "eddy_brake",
    }
    assert len(strongest) == 10  # two places of each brake but the dry one
    assert number > 40
    for item in strongest:
        # Within a frame the motion is followed at a few places.
        assert item.chi2 == pytest.approx(listed[item.candidate].chi2, rel=1e-3, abs=1e-2)
    brake = next(s for s in strongest if s.candidate.effect.name == "local_brake")
    assert abs(brake.candidate.effect.parameters["c"] - 0.15) < 0.1


def test_a_fit_gives_a_brake_s_place_and_width():
    plain = udd.Pendulum(0.5, k0=0.01)
    result = scored(seen(plain.with_effects([E.local_brake(a=0.05, c=0.15, s=0.08)])), plain)
    # A place on the other side is tried too: a symmetric swing passes both alike.
    first, second = (s for s in result.usable() if s.candidate.effect.name == "local_brake")
    trials = [of_library(result.fit, [s.candidate], list(s.amplitudes)) for s in (first, second)]
    trial = min((t for t in trials if t), key=lambda t: t.rank)
    assert first.candidate.parameters == 3
    for name, value in (("a", 0.05), ("c", 0.15), ("s", 0.08)):
        error = trial.fit.errors[f"local_brake.{name}"]
        assert abs(trial.fit.parameters[f"local_brake.{name}"] - value) < 4 * error < 0.3 * max(value, 0.1), (
            name
        )


OWN = udd.Model(["theta", "v"], ["v", "-w2*sin(theta) - c*v"], {"w2": 19.62, "c": 0.04}, angles=["theta"])


@pytest.mark.parametrize(
    ("term", "size", "title"),
    [
        ("-exp(-((theta - 0.15)/0.08)^2)*v", 0.02, "friction near a place of theta in v'"),
        ("-exp(-t/20)*v", 0.005, "friction that settles with time in v'"),
        (
            "-(19.62*cos(theta) + v^2)*tanh(v/0.05)",
            1e-3,
            "dry friction growing with the load in v'",
        ),
        ("-tanh(v/0.05)", 0.01, "dry friction of v in v'"),
    ],
)
def test_the_same_laws_are_tried_in_models_of_one_s_own(term, size, title):
    truth = OWN.with_term("v", term, size=size)
    t = np.arange(0, 24, 0.05)
    theta = udd.simulate(truth, t, [1.0, 0.0]).theta
    noise = 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    result = scored(udd.Measurement(t, {"theta": theta + noise}), OWN)
    assert best_of(result, title) > 0.99


def test_a_cart_s_places_are_within_its_way():
    cart = udd.mechanism({"x": "u"}, [["m"]], ["-k*x - c*u"], {"m": 2.0, "k": 8.0, "c": 0.1})
    t = np.arange(0, 20, 0.04)
    x = udd.simulate(
        cart.with_effects([E.formula("force(x)", "-b*exp(-((x - 0.3)/0.1)^2)*u", b=1.0)]), t, [1.0, 0.0]
    ).x
    noise = 2e-3 * np.random.default_rng(0).standard_normal(len(t))
    fit = udd.fit(udd.Measurement(t, {"x": x + noise}), cart, free=["k", "c"])
    strongest, _number = strongest_shapes(fit)
    best = max(strongest, key=lambda s: s.chi2)
    assert best.candidate.title == "friction near a place of x in force(x)"
    assert abs(best.candidate.effect.parameters["b"] - 0.3) < 0.15
    assert not [s for s in strongest if not -1.1 < s.candidate.effect.parameters.get("b", 0.0) < 2.5]


@pytest.mark.parametrize(
    ("law", "name"),
    [
        (E.formula("torque", "-0.008*tanh(Omega/0.5)", name="bounded"), "saturating"),
        (E.formula("torque", "-0.0054*abs(Omega)*Omega - 0.002*Omega^2", name="rough"), "one_way_drag"),
    ],
)
def test_a_law_of_the_speed_is_no_brake_near_an_angle_and_no_constant_torque(law, name):
    plain = udd.Pendulum(0.5, k0=0.01)
    discovery = udd.discover(seen(plain.with_effects([law]), noise=2e-3), plain, progress=False)
    assert name in [one.effect.name for one in discovery.effects]
    assert not {"local_brake", "constant_torque"} & {one.effect.name for one in discovery.effects}


@pytest.mark.parametrize(("offset", "listed"), [(0.0, True), (6.0, False)])
def test_only_a_motion_that_turns_back_shows_friction_in_one_direction(offset, listed):
    speed = 3.0 * np.sin(np.arange(0, 20, 0.1)) + offset
    states = np.column_stack([speed, np.zeros((len(speed), 3))])
    names = {one.effect.name for one in library(udd.Disk(0.04), states=states)}
    assert ({"one_way", "one_way_drag"} <= names) is listed


@pytest.mark.parametrize("seed", [0, 1])
def test_a_length_that_drifts_is_no_torque_over_the_angle(seed):
    # A swing decays while the length grows by 2 % a minute; "torque = a tanh(b theta)" was called identified.
    t, rng = np.arange(0, 70, 0.04), np.random.default_rng(seed)

    def rates(now, state):
        length, growth = 0.5 * (1 + 0.02 * now / 60), 0.5 * 0.02 / 60
        torque = -9.81 * length * np.sin(state[1]) - (0.01 + 2 * length * growth) * state[0]
        return [torque / length**2, state[0]]

    theta = solve_ivp(rates, (0.0, 70.0), [0.0, 1.0 + 0.2 * seed], "DOP853", t, rtol=1e-9, atol=1e-11).y[1]
    record = udd.Measurement(t, {"theta": theta + 5e-3 * rng.standard_normal(len(t))})
    discovery = udd.discover(record, udd.Pendulum(0.5, k0=0.012), progress=False)
    assert discovery.verdict == "effect present, form not identified"
    pull = next(one for one in discovery.effects if one.effect.name == "drifting_pull")
    # g L/L^2 falls by g/L times the growth: in the unit of the fit, an inertia of 0.25 m^2 at 0.5 m.
    assert pull.parameters["a"] == pytest.approx(-9.81 * 0.5 * 0.02 / 60, rel=0.1)
    assert "effects of time and of amplitude are confounded" in discovery.doubts[0]


def test_a_brake_on_both_sides_is_not_identified_on_one():
    """Two magnets take as much energy from each swing as one of twice their strength."""
    t = np.arange(0, 40, 0.05)
    text = "a*(exp(-((theta - 1.4)/0.2)^2) + exp(-((theta + 1.4)/0.2)^2))"
    truth = udd.Pendulum(0.67, k0=0.009, effects=[E.formula("friction", text, amplitudes=["a"], a=0.0158)])
    theta = udd.simulate(truth, t, [0.0, 2.0]).state[:, 1]
    measured = udd.Measurement(t, {"theta": theta + 5e-3 * np.random.default_rng(1).standard_normal(len(t))})
    result = udd.discover(measured, udd.Pendulum(0.67, k0=0.008))
    (both,) = result.effects
    assert both.effect.name == "two_brakes"
    assert both.parameters["c"] == pytest.approx(1.4, abs=0.02)
    assert "local_brake" in {rival.effect.name for rival in result.alternatives}
    assert result.verdict == "effect present, form not identified"
