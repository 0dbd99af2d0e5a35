"""The criterion: log evidence, priors, containment and rivals, on small tables of ready fits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import udd
from udd.discovery import hypotheses
from udd.discovery.hypotheses import (
    Hypothesis,
    contains,
    lead,
    log_evidence,
    log_prior,
    named,
    ranked,
    rivals,
    simplest,
)
from udd.discovery.results import AddedEffect
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.symbolic.expressions import is_single_term, length, read
from udd.discovery.thresholds import EVIDENCE_MARGIN
from udd.discovery.verdict import doubts_of, has_size, undetermined, verdict_of
from udd.fitting import at_level, extend, fit_record, most_probable, record_of, refit

QUADRATIC = udd.effects.quadratic_drag(c=0.01)
CUBIC = udd.effects.cubic_drag(c=0.01)
COULOMB = udd.effects.coulomb(c=0.002)


def power(n: float, a: float = 0.01) -> udd.effects.Effect:
    return udd.effects.formula("friction", "a*abs(Omega)^n", amplitudes=["a"], name="power", a=a, n=n)


def node(text: str) -> Any:
    return read(text, {"x": ("x",)})[0]


@dataclass
class Trial:
    """The attributes of a trial that :mod:`udd.discovery.hypotheses` reads."""

    candidates: list[Candidate]
    names: list[str]
    formula: Any = None
    curve: Any = None
    cost: float = 0.0

    @property
    def is_curve(self) -> bool:
        return self.curve is not None and self.formula is None


def trial(*laws: udd.effects.Effect, formula: str = "", curve: Any = None) -> Trial:
    names = [f"{law.name}.{p}" for law in laws for p in law.amplitudes]
    written = SimpleNamespace(node=node(formula)) if formula else None
    return Trial([Candidate(law, law.title) for law in laws], names, written, curve)


def motion(*laws: udd.effects.Effect) -> Any:
    """A swing with laws, as a fit of it shows it."""
    t = np.arange(0, 20, 0.02)
    states = np.column_stack([3.0 * np.exp(-t / 20) * np.sin(4.4 * t), np.exp(-t / 20) * np.cos(4.4 * t)])
    model = udd.Pendulum(0.5, k0=0.01, effects=list(laws))
    record = SimpleNamespace(film=np.zeros(len(t), int), t=t)
    fitted = {name: value for name, value in model.parameters.items() if not name.endswith("eps")}
    return SimpleNamespace(model=model, record=record, states=states, parameters=fitted)


def hypothesis(log_z: float, *laws: udd.effects.Effect, **written: Any) -> Hypothesis:
    """A hypothesis with a given log evidence."""
    proposed: Any = trial(*laws, **written)
    result = Hypothesis(proposed, proposed, motion(*laws), 0.0)
    result.__dict__["log_z"] = log_z
    return result


KNOWN = ["k0", "length", "inertia"]


@pytest.mark.parametrize(
    ("law", "other", "expected"),
    [
        (power(1.2), QUADRATIC, True),  # |Omega|^1 |Omega|
        (QUADRATIC, power(1.2), False),
        (CUBIC, QUADRATIC, False),
        (COULOMB, QUADRATIC, False),
        (udd.effects.stribeck(c=0.002, fade=3.7), COULOMB, True),  # where it fades at 20 rad/s
        (udd.effects.stribeck(c=0.0035, fade=2.8), COULOMB, True),
        (COULOMB, udd.effects.stribeck(c=0.002, fade=3.7), False),
    ],
)
def test_a_free_power_contains_a_drag_and_no_drag_another(law, other, expected):
    assert contains(hypothesis(0.0, law), hypothesis(0.0, other), KNOWN) is expected


def test_two_drags_contain_each_of_them():
    both = hypothesis(0.0, QUADRATIC, COULOMB)
    assert contains(both, hypothesis(0.0, QUADRATIC), KNOWN)
    assert not contains(hypothesis(0.0, QUADRATIC), both, KNOWN)


def test_what_the_known_model_can_do_is_left_out():
    """Friction that is constant is the known one: a power of it can be anything."""
    assert contains(hypothesis(0.0, QUADRATIC), hypothesis(0.0, power(0.0)), ["k0"]) is False
    shifted = udd.effects.formula("friction", "a*(abs(Omega) + 3)", amplitudes=["a"], a=0.01)
    assert contains(hypothesis(0.0, QUADRATIC), hypothesis(0.0, shifted), ["k0"])
    assert not contains(hypothesis(0.0, QUADRATIC), hypothesis(0.0, shifted), [])


def test_hypotheses_come_in_order_of_their_log_evidence():
    table = [hypothesis(z, QUADRATIC) for z in (3.0, 8.0, 8.2, -1.0)]
    assert [h.log_z for h in ranked(table)] == [8.0, 8.2, 3.0, -1.0]  # ties as they came in


def test_a_law_comes_before_a_formula_that_is_as_probable():
    curve, law = hypothesis(3.3, QUADRATIC, formula="2.0*x*tanh(3.0*x)", curve=1), hypothesis(3.0, CUBIC)
    assert ranked([curve, law]) == [law, curve]


def test_rivals_are_what_lies_within_ten_nats():
    chosen = hypothesis(100.0, QUADRATIC)
    close, far = hypothesis(91.0, CUBIC), hypothesis(89.0, COULOMB)
    assert rivals(chosen, [chosen, close, far], KNOWN) == [close]


def test_a_wider_law_is_a_rival_only_if_it_gains():
    chosen = hypothesis(100.0, QUADRATIC)
    wider = hypothesis(97.0, QUADRATIC, COULOMB)
    assert rivals(chosen, [wider], KNOWN) == []
    little = hypothesis(100.4, QUADRATIC, COULOMB)
    assert rivals(chosen, [little], KNOWN) == []
    gains = hypothesis(101.0, QUADRATIC, COULOMB)
    assert rivals(chosen, [gains], KNOWN) == [gains]


def test_the_chosen_law_in_other_words_is_no_rival():
    again = udd.effects.formula("friction", "a*abs(Omega)", amplitudes=["a"], a=0.01)
    assert rivals(hypothesis(100.0, QUADRATIC), [hypothesis(99.0, again, formula="1*x")], KNOWN) == []


def test_a_rival_in_another_notation_is_listed_once():
    written = udd.effects.formula("friction", "a*abs(Omega)^2", amplitudes=["a"], a=0.01)
    again = udd.effects.formula("friction", "a*Omega^2", amplitudes=["a"], a=0.01)
    table = [hypothesis(99.0, written, formula="1*abs(x)^2"), hypothesis(98.0, again, formula="1*x^2")]
    assert rivals(hypothesis(100.0, QUADRATIC), table, KNOWN) == table[:1]


def test_the_law_of_the_library_comes_before_the_same_in_other_words():
    formula = hypothesis(100.0, power(1.0), formula="1.0*x^1.0")
    law, other = hypothesis(95.0, QUADRATIC), hypothesis(97.0, CUBIC)
    assert named([formula, other, law], KNOWN) == [law, formula, other]
    far = hypothesis(85.0, QUADRATIC)
    assert named([formula, far], KNOWN) == [formula, far]


def test_a_spline_is_a_rival_of_splines_alone():
    spline = hypothesis(99.0, QUADRATIC, curve=SimpleNamespace())
    assert rivals(hypothesis(100.0, CUBIC), [spline], KNOWN) == []
    assert rivals(hypothesis(100.0, CUBIC, curve=SimpleNamespace()), [spline], KNOWN) == [spline]


def test_an_effect_that_gains_less_than_ten_nats_is_left_out():
    both, law, other = (
        hypothesis(100.0, QUADRATIC, COULOMB),
        hypothesis(93.0, QUADRATIC),
        hypothesis(95.0, CUBIC),
    )
    assert simplest([both, other, law]) == [law, both, other]
    assert simplest([both, other]) == [both, other]
    clear = hypothesis(104.0, QUADRATIC, COULOMB)
    assert simplest([clear, law]) == [clear, law]


def test_a_spline_over_another_coordinate_is_a_rival_of_a_formula():
    def over(name: str) -> Any:
        return SimpleNamespace(coordinates=[SimpleNamespace(name=name)])

    formula = hypothesis(100.0, power(0.3), formula="2.0*tanh(3.0*x)", curve=over("load"))
    speed, same = (hypothesis(86.0, QUADRATIC, curve=over(name)) for name in ("|Omega|", "load"))
    far = hypothesis(79.0, QUADRATIC, curve=over("|Omega|"))
    assert rivals(formula, [formula, speed, same, far], KNOWN) == [speed]
    assert lead(formula, speed) == 4.0  # without the ten nats that a spline costs more
    assert lead(formula, same) == 14.0
    of_speed = hypothesis(100.0, power(0.3), formula="2.0*tanh(3.0*x)", curve=over("|Omega|"))
    torque = hypothesis(86.0, QUADRATIC, curve=over("Omega"))  # the same coordinate, with its sign
    assert rivals(of_speed, [torque], KNOWN) == []


def test_priors_count_terms_symbols_and_splines():
    single = -math.log(30)
    over_speed, over_time = (
        SimpleNamespace(
            slot=SimpleNamespace(name="friction"), coordinates=[SimpleNamespace(name=name)], log_prior=prior
        )
        for name, prior in (("|Omega|", 0.0), ("t", -20.0))
    )
    assert log_prior(trial(QUADRATIC), 30) == single  # type: ignore[arg-type]
    assert log_prior(trial(QUADRATIC, COULOMB), 30) == 2 * single  # type: ignore[arg-type]
    assert log_prior(trial(QUADRATIC, curve=over_speed), 30) == single - 10.0  # type: ignore[arg-type]
    assert log_prior(trial(QUADRATIC, curve=over_time), 30) == single - 30.0  # type: ignore[arg-type]
    free = trial(power(1.2), formula="1.0*x^1.2", curve=over_speed)
    assert log_prior(free, 30) == single - 3 * math.log(12)  # type: ignore[arg-type]
    wave = trial(power(1.2), formula="1.0*sin(2.0*x)", curve=over_speed)
    assert log_prior(wave, 30) == pytest.approx(single - 4 * math.log(12))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "single", "symbols"),
    [
        ("2.0*x^1.5", True, 3),
        ("2.0*exp(3.0*x)", True, 4),
        ("2.0*x + 1.0*x^3", False, 6),
        ("1.0 + 2.0*tanh(3.0*x)", False, 5),
        ("2.0*sin(0.3*x)*abs(tanh(1.5*x) - 0.27*x)", False, 12),
        ("2.0*x*abs(x)", True, 5),
        ("2.0*x*abs(x)^1.5", True, 6),
        ("2.0*x*tanh(3.0*x)", False, 6),
    ],
)
def test_a_single_term_has_its_coordinate_on_one_side(text, single, symbols):
    assert is_single_term(node(text)) is single
    assert length(node(text)) == symbols


@pytest.mark.parametrize(("n", "single"), [(3.0, True), (2.0, False)])
def test_the_sine_and_the_cosine_of_one_angle_are_one_term(n, single):
    def wave(name: str, factor: float, number: int) -> Any:
        return ("*", ("c", number), (name, ("*", ("n", factor), ("x",))))

    assert is_single_term(("+", wave("sin", 3.0, 0), wave("cos", n, 1))) is single


def test_log_evidence_of_a_fit_with_a_drag_is_near_the_information_criterion():
    """Kass and Wasserman: with unit information the evidence is BIC's, up to terms of order one."""
    t = np.arange(0, 30, 0.05)
    truth = udd.Pendulum(1.0, k0=0.01, effects=[udd.effects.quadratic_drag(c=0.02)])
    theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1]
    noise = 3e-3 * np.random.default_rng(3).standard_normal(len(t))
    measured = udd.Measurement(t, {"theta": theta + noise})
    record = record_of(measured)
    plain = fit_record(measured, record, udd.Pendulum(1.0, k0=0.01), search=True)
    right = extend(plain, [udd.effects.quadratic_drag()], [0.0])
    idle = extend(right, [udd.effects.constant_torque()], [0.0])
    names = ["quadratic_drag.c"]
    without, item, two = refit(plain), refit(right), refit(idle)
    assert log_evidence(item, names) > log_evidence(without, []) + 50
    lost = log_evidence(item, names) - log_evidence(two, [*names, "constant_torque.c"])
    # Cost of a needless number: half the logarithm of the record's numbers, less a chi2 of 1.
    assert math.log(len(t)) / 2 - 3.5 < lost < math.log(len(t)) / 2 + 1.0


def added(effect: udd.effects.Effect, **more: Any) -> AddedEffect:
    values: dict[str, Any] = {
        "effect": effect,
        "title": effect.title,
        "equation": effect.equation,
        "expression": effect.expression,
        "parameters": dict(effect.parameters),
        "errors": dict.fromkeys(effect.amplitudes, 0.1),
        "chi2": 100.0,
        "p": 1e-9,
        "ratio": (0.5, 0.4, 0.6),
        "witness": "held",
    }
    return AddedEffect(**(values | more))


def final(*, tight: bool = True, **values: tuple[float, float]) -> Any:
    """A fit of which only the numbers count."""
    order = {name.replace("__", "."): value for name, (value, _sd) in values.items()}
    covariance = np.diag([sd**2 for _value, sd in values.values()])
    t = np.linspace(0.0, 10.0, 500)
    record = SimpleNamespace(film=np.zeros(500, int), t=t)
    states = np.column_stack([np.sin(t), 0.01 * np.sin(t), 0.04 + 0.01 * np.cos(t), t])
    return SimpleNamespace(
        parameters=order,
        covariance=covariance,
        model=udd.Disk(0.04),
        record=record,
        states=states,
        doubts=SimpleNamespace(tight=tight),
        widened=1.0,
    )


def test_a_law_with_memory_is_compared_at_its_most_probable_model_error():
    """Fits of the search end at the smallest model error; there quadratic drag was 40 nats too low."""
    t = np.arange(0, 60, 1 / 25)
    rates = ["-9.81 / 0.5 * sin(x) - 4 * (0.01 * v + s)", "v", "(0.008 * abs(v) * v - s) / 0.3"]
    theta = udd.simulate(udd.Model(["v", "x", "s"], rates), t, [0.0, 1.0, 0.0]).state[:, 1]
    seen = udd.Measurement(t, {"theta": theta + 5e-3 * np.random.default_rng(1).standard_normal(len(t))})
    plain = fit_record(seen, record_of(seen), udd.Pendulum(0.5, k0=0.01), search=True)
    drag = extend(plain, [udd.effects.quadratic_drag()], [0.0])
    tight, likeliest = refit(drag), most_probable(drag)
    assert likeliest.level < tight.level == len(tight.problem.schedule) - 1
    assert most_probable(tight).level == likeliest.level  # from wherever the search comes
    assert log_evidence(likeliest, ()) > log_evidence(at_level(likeliest, tight.level), ()) + EVIDENCE_MARGIN


def test_a_constant_within_three_standard_errors_is_not_determined():
    effect = udd.effects.quadratic_drag(c=0.01)
    assert undetermined(added(effect), final(quadratic_drag__c=(0.01, 0.004))) == ["c"]
    assert undetermined(added(effect), final(quadratic_drag__c=(0.01, 0.002))) == []


def own(text: str, **values: float) -> udd.effects.Effect:
    return udd.effects.formula("friction", text, amplitudes=["a"], name="own", **values)


@pytest.mark.parametrize(
    ("text", "sd", "open_constants"),
    [
        ("a*exp(-((Y - c)/0.002)^2)", 1e-4, []),
        ("a*exp(-((Y - c)/0.002)^2)", 0.02, ["c"]),  # Y moves by 0.02
        ("a*exp(cos(beta + c))", 0.2, []),
        ("a*exp(cos(beta + c))", 2.0, ["c"]),
        ("a*sin(3*t + c)", 0.2, []),
        ("a*tanh((Omega - c)/0.1)", 0.01, ["c"]),  # a speed has a natural zero
        ("a*max(abs(Omega) - c, 0)", 0.01, ["c"]),
        ("a*(c + exp(Y))", 0.01, ["c"]),
        ("a*tanh(c*Y)", 0.01, ["c"]),
    ],
)
def test_places_and_phases_have_no_natural_zero(text, sd, open_constants):
    effect = own(text, a=0.01, c=0.001)
    numbers = final(own__a=(0.01, 0.001), own__c=(0.001, sd))
    assert undetermined(added(effect, errors={"a": 0.001, "c": sd}), numbers) == open_constants


def test_the_place_of_a_brake_of_the_library_has_no_natural_zero():
    brake = udd.effects.local_brake(a=0.01, c=0.01, s=0.2)
    errors = {"a": (0.01, 0.001), "c": (0.01, 0.02), "s": (0.2, 0.02)}
    numbers = final(**{f"local_brake__{name}": value for name, value in errors.items()})
    assert undetermined(added(brake, errors={k: sd for k, (_v, sd) in errors.items()}), numbers) == []


def test_the_amplitudes_of_a_wave_count_together():
    wave = udd.effects.eccentric_mass(a=0.01, b=0.0)
    numbers = final(eccentric_mass__a=(0.01, 0.001), eccentric_mass__b=(0.0, 0.001))
    assert undetermined(added(wave), numbers) == []


@pytest.mark.parametrize(("frequency", "doubtful"), [(0.12, True), (0.5, False)])
def test_a_wave_of_fewer_than_two_periods_is_not_identified(monkeypatch, frequency, doubtful):
    monkeypatch.setattr("udd.discovery.verdict.readings", lambda _fit: [])
    ripple = udd.effects.drive_ripple(f=frequency, a=0.01, b=0.0)
    numbers = final(drive_ripple__a=(0.01, 0.001), drive_ripple__b=(0.0, 0.001))
    doubts = doubts_of([added(ripple)], numbers, (0.5, 0.4, 0.6), 1000)
    assert any("two of its periods" in doubt for doubt in doubts) is doubtful


@pytest.mark.parametrize(
    ("ratio", "size"), [((0.9, 0.8, 0.97), True), ((0.99, 0.985, 0.998), False), ((0.9, 0.7, 1.1), False)]
)
def test_a_gain_has_a_size_of_two_per_cent_at_least(ratio, size):
    assert has_size(ratio) is size


def test_each_doubt_leaves_the_form_open(monkeypatch):
    monkeypatch.setattr("udd.discovery.verdict.readings", lambda _fit: [])
    effect, numbers = udd.effects.quadratic_drag(c=0.01), final(quadratic_drag__c=(0.01, 0.001))
    clear, gain = added(effect), (0.5, 0.4, 0.6)
    assert doubts_of([clear], numbers, gain, 1000) == []
    assert "no law of one term" in doubts_of([added(effect, is_law=False)], numbers, gain, 1000)[0]
    weak = final(quadratic_drag__c=(0.01, 0.01))
    assert "do not determine c" in doubts_of([clear], weak, gain, 1000)[0]
    unclear = final(tight=False, quadratic_drag__c=(0.01, 0.001))
    assert "something else is missing" in doubts_of([clear], unclear, gain, 1000)[0]
    # Where free runs gain little the frames' own likelihood may show it: 1000 numbers at half their cost.
    assert doubts_of([clear], numbers, (0.99, 0.98, 1.01), 1000) == []
    little = added(effect, ratio=(0.99, 0.98, 1.01))
    assert "less than 10 nats" in doubts_of([little], numbers, (0.99, 0.98, 1.01), 1000)[0]


def test_friction_over_the_time_alone_leaves_the_form_open(monkeypatch):
    monkeypatch.setattr("udd.discovery.verdict.readings", lambda _fit: [])
    settles = udd.effects.warming_friction(a=0.01, tau=30.0)
    numbers = final(warming_friction__a=(0.01, 0.001))
    assert doubts_of([added(settles)], numbers, (0.5, 0.4, 0.6), 1000) == []  # a driven disk does not settle
    numbers.model = udd.Pendulum(0.5)
    (doubt,) = doubts_of([added(settles)], numbers, (0.5, 0.4, 0.6), 1000)
    assert "effects of time and of amplitude are confounded" in doubt


@pytest.mark.parametrize(
    ("effects", "unconfirmed", "doubts", "open_form", "stopped", "verdict"),
    [
        (True, False, [], False, False, "effect identified"),
        (True, False, ["a doubt"], False, False, "effect present, form not identified"),
        (True, False, [], True, False, "effect present, form not identified"),
        (False, False, [], True, False, "effect present, form not identified"),
        (False, True, [], False, False, "fits the first part, not confirmed"),
        (False, True, [], True, False, "effect present, form not identified"),
        (False, False, [], False, True, "search not finished"),
        (False, False, [], False, False, "nothing missing"),
    ],
)
def test_the_verdict_is_the_least_sure_that_holds(effects, unconfirmed, doubts, open_form, stopped, verdict):
    some = [added(QUADRATIC)] if effects else []
    assert verdict_of(some, unconfirmed, doubts, open_form, stopped) == verdict


def test_unit_information_has_a_covariance():
    """Collinear amplitudes are not determined: such a hypothesis is never the most probable."""
    fit: Any = SimpleNamespace(
        evidence=5.0,
        parameters={"a": 1.0, "b": 1.0},
        covariance=np.ones((2, 2)),
        widened=1.0,
        observations=99,
        problem=SimpleNamespace(has_smallest_model_error=True),
    )
    assert log_evidence(fit, ["a", "b"]) == -math.inf
    assert hypotheses.log_evidence(fit, []) == 5.0
    fit.problem.has_smallest_model_error = False
    assert hypotheses.log_evidence(fit, []) == 5.0 - EVIDENCE_MARGIN  # a random force
