"""Searches in which the known model alone diverges, or its parameters are not determined."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

import udd
import unmodelled
from udd.discovery.curve_effects import fit_curve
from udd.discovery.score_rounds import score_round
from udd.discovery.scoring.candidates import library
from udd.discovery.scoring.look_alikes import look_alikes
from udd.errors import FitError
from udd.fitting import (
    Fit,
    Goal,
    at_level,
    extend,
    fit_record,
    record_of,
    released,
    released_anew,
    solve,
    started_at,
)


def noisy(model: udd.Model, start: list[float], share: float) -> udd.Measurement:
    """A run of 10 s with noise that grows with what is read."""
    t = np.linspace(0.0, 10.0, 512)
    run = udd.simulate(model, t, start).state
    read = run * (1.0 + share * np.random.default_rng(0).standard_normal(run.shape))
    return udd.Measurement(t, dict(zip(model.state_names, read.T, strict=True)))


def test_a_form_is_found_whose_score_ranks_below_those_of_others_like_it() -> None:
    """Around a laser model without its inversion's decay eight other products score higher than x*y."""
    baseline = {"x": "a*(y - x)", "y": "b*(x*z - y)", "z": "c - d*z"}
    values = {"a": 0.1, "b": 0.21, "c": 0.34 * 4.1, "d": 0.34}
    truth = udd.Model(list("xyz"), baseline | {"z": baseline["z"] + " - k*x*y"}, values | {"k": 1.054})
    result = udd.discover(noisy(truth, [1.3, 1.1, 0.89], 0.01), udd.Model(list("xyz"), baseline, values))
    names = [s.candidate.effect.name for s in result.scans[0]]
    assert names.index("x_y_in_z") > 6
    assert [f.effect.name for f in result.effects] == ["x_y_in_z"]
    assert abs(result.fit.parameters["x_y_in_z.c1"] + 1.054) < 4 * result.fit.errors["x_y_in_z.c1"]


def test_what_does_nearly_the_same_along_a_motion_is_listed_whatever_its_score() -> None:
    """Lorenz' equations near rest, where z hardly changes: x*z^2 does what x*z does."""
    baseline = udd.Model(
        list("xyz"), {"x": "10*(y - x)", "y": "14*x - y", "z": "x*y - b*z"}, {"b": 8.0 / 3.0}
    )
    wrong = baseline.with_effects([udd.effects.formula("y'", "c*x*z^2", c=-0.07)])
    t = np.linspace(0.0, 10.0, 512)
    run = udd.simulate(wrong, t, [6.0, 6.3, 13.5]).state  # around rest, where z is 13
    fitted = udd.fit(udd.Measurement(t, dict(zip("xyz", run.T, strict=True))), wrong)
    result = look_alikes(baseline, fitted, library(baseline))
    names = [candidate.effect.name for candidate, _amplitude in result]
    at = names.index("x_z_in_y")
    assert 0 <= at < 4
    assert abs(result[at][1] + 0.07 * fitted.states[:, 2].mean()) < 0.02
    assert "y_in_z" not in names


def test_all_data_are_fitted_from_where_the_fit_of_the_first_part_ended() -> None:
    """Fitted to all data the known model loses turns, and from there no better one finds back."""
    baseline = {"x": "k + sin(y)*cos(x)", "y": "sin(y)*cos(x)"}
    values = {"k": 1.53}
    truth = udd.Model(["x", "y"], baseline | {"y": "m + " + baseline["y"]}, {"k": 1.432, "m": 0.972})
    model = udd.Model(["x", "y"], baseline, values, angles=["x", "y"])
    result = udd.discover(noisy(truth, [2.2, 0.67], 0.02), model)
    # A dry friction of x', which never turns, would be a constant too.
    titles = {"1 in y'", "dry friction of x' in y'"}
    assert {f.title for f in result.effects} | {a.title for a in result.alternatives} == titles
    assert result.fit.scatter < 1.2


def test_parameters_that_the_data_do_not_determine_are_held_near_what_was_stated() -> None:
    """Two constants that stand only in a product, and a drag that is missing."""
    t = np.arange(0.0, 40.0, 0.05)
    baseline = {"q": "w", "w": "-a*b*sin(q) - g*w"}
    truth = udd.Model(
        ["q", "w"], baseline | {"w": baseline["w"] + " - 0.05*abs(w)*w"}, {"a": 2.0, "b": 3.0, "g": 0.02}
    )
    run = udd.simulate(truth, t, [1.2, 0.0]).state[:, 0]
    measured = udd.Measurement(t, {"q": run + 2e-3 * np.random.default_rng(1).standard_normal(len(t))})
    stated = udd.Model(["q", "w"], baseline, {"a": 2.2, "b": 2.8, "g": 0.05}, angles=["q"])
    result = udd.discover(measured, stated)
    assert [f.effect.name for f in result.effects] == ["abs_w_w_in_w"]
    assert result.undetermined == ("a", "b")
    assert any("do not determine a, b" in said for said in result.remarks)
    values = result.fit.parameters
    assert abs(values["a"] * values["b"] - 6.0) < 0.02  # their product is
    assert result.fit.errors["a"] > 0.3 * values["a"]


def filmed(truth: udd.Disk, seconds: float) -> udd.Measurement:
    """A disk's film whose noise grows with the speed."""
    t = np.arange(0.0, seconds, 0.04)
    run = udd.simulate(truth, t, [0.0, 0.01, 0.0, 0.0]).state
    sd = np.array([5e-4, 5e-4, 0.01])
    read = run[:, 1:] + (1.0 + 0.1 * np.abs(run[:, :1])) * sd * np.random.default_rng(1).standard_normal(
        (len(t), 3)
    )
    return udd.Measurement(t, read, sigma=np.tile(sd, (len(t), 1)))


def test_scores_around_a_looser_fit_name_what_a_model_far_astray_lacks() -> None:
    """A slip half as strong as gravity: the known model's largest model error is far too small for it."""
    truth = udd.Disk(0.07, effects=[udd.effects.radial_slip(c=0.07, momentum="constraint")])
    measured = filmed(truth, 72.0)
    fitted = fit_record(measured, record_of(measured), udd.Disk(0.0704), ["k0"], camera=False, search=True)
    loosest = at_level(fitted, 0)
    scores = score_round(fitted)
    assert loosest.scatter > 10.0
    assert scores.fit.scatter < 3.0
    best = [s for s in scores.usable() if s.candidate.effect.name == "radial_slip"]
    others = [s for s in scores.usable() if s.candidate.effect.name != "radial_slip"]
    assert best[0].chi2 > 2 * others[0].chi2


def stronger(law: unmodelled.Law) -> unmodelled.Law:
    return lambda *at: tuple(3 * v for v in law(*at))  # type: ignore[return-value]


LEADING = [case for case in unmodelled.CASES if case.name in ("five waves", "one-sided bump")]


@pytest.mark.parametrize(
    ("law", "leads"),
    [
        *((stronger(case.law), True) for case in LEADING),
        (lambda t, o, y, z, b: (-0.01 * abs(o) * o, 0.0, 0.0), False),
        (lambda t, o, y, z, b: (0.0, 0.0, -0.5 * z), False),
    ],
    ids=[*(case.name for case in LEADING), "quadratic drag", "slip"],
)
def test_a_curve_leads_where_the_library_has_no_law_like_it(law: unmodelled.Law, leads: bool) -> None:
    fitted = udd.fit(unmodelled.record(law, 1, 40.0), udd.Disk(0.045))
    assert score_round(fitted).curve_leads() == leads


def test_what_leads_is_located_before_the_library_is_fitted() -> None:
    (waves,) = (case for case in unmodelled.CASES if case.name == "five waves")
    reported: list[str] = []
    result = udd.discover(
        unmodelled.record(stronger(waves.law), 1, 40.0), udd.Disk(0.045), progress=reported.append
    )
    assert (
        next(line for line in reported if line.startswith("trying")) == "trying torque as a function of beta"
    )
    (effect,) = result.effects
    assert effect.title == "torque = a * sin(5 * beta)"
    assert effect.effect.parameters["a"] == pytest.approx(0.06, rel=0.02)


def test_what_dies_down_slowly_is_scored_where_it_is_held_tightly() -> None:
    """A cubic drag on a pendulum, which shows over minutes: with a large model error it is hardly visible."""
    truth = udd.Pendulum(0.65, k0=0.002, effects=[udd.effects.cubic_drag(c=0.003)])
    t = np.arange(0.0, 120.0, 0.05)
    theta = udd.simulate(truth, t, [0.0, 0.8]).state[:, 1]
    read = theta + 2.5e-3 * np.random.default_rng(1).standard_normal(len(t))
    baseline = udd.Pendulum(0.65, k0=0.004)
    measured = udd.Measurement(t, {"theta": read})
    fitted = fit_record(measured, record_of(measured), baseline, search=True)
    assert fitted.scatter > 3.0
    scores = score_round(fitted)
    assert scores.fit is fitted
    drags = {"quadratic_drag", "cubic_drag", "power_drag", "threshold_drag", "warming_friction"}
    assert scores.usable()[0].candidate.effect.name in drags


def bump(momentum: str) -> udd.effects.Effect:
    """A narrow push to the side at one place."""
    return udd.effects.formula("lateral", "a*exp(-((Y - 0.014)/0.0054)^2)", a=0.02, momentum=momentum)


@pytest.mark.parametrize("momentum", ["consistent", "constraint"])
def test_fits_of_a_narrow_bump_show_its_momentum(momentum: str) -> None:
    measured = filmed(udd.Disk(0.03, effects=[bump(momentum)]), 30.0)
    base = fit_record(measured, record_of(measured), udd.Disk(0.03), search=True)
    curves = score_round(base).curves
    both = [curve for curve in curves if curve.key_without_momentum == curves[0].key_without_momentum]
    right, wrong = sorted(both, key=lambda curve: curve.slot.momentum != momentum)
    fits = [fit_curve(base, curve).fit for curve in (right, wrong)]
    assert right.name == (f"lateral ({momentum})", "Y") and fits[0].level == fits[1].level
    # Ten nats part two forms.
    assert fits[1].chi2 - fits[0].chi2 > 20.0


@pytest.mark.nightly  # test_fits_of_a_narrow_bump_show_its_momentum asks the same of the fits
@pytest.mark.parametrize("momentum", ["consistent", "constraint"])
def test_a_narrow_bump_is_told_with_its_momentum_or_without(momentum: str) -> None:
    result = udd.discover(filmed(udd.Disk(0.03, effects=[bump(momentum)]), 30.0), udd.Disk(0.03))
    (effect,) = result.effects
    assert effect.title == f"lateral ({momentum}) = a * exp((-1) * (b * (c + Y))^2)"
    assert result.verdict == "effect identified"


def test_a_fit_goes_on_from_another_with_as_much_free() -> None:
    measured = filmed(udd.Disk(0.07), 20.0)
    fixed = fit_record(measured, record_of(measured), udd.Disk(0.07), ["k0"], camera=False, search=True)
    all_free = udd.fit(measured, udd.Disk(0.07)).problem.free
    more = extend(released(fixed, all_free), [udd.effects.constant_torque()], [0.0])
    back = started_at(fixed, more)
    assert {f.name for f in back.problem.free} == set(more.parameters) - {"constant_torque.c"}
    assert solve(back.problem, back.problem.schedule, back.point).converged


@pytest.fixture(scope="module")
def astray() -> Fit:
    """A drive that gives way to the load by far more than the known model, without it, can follow."""
    measured = filmed(udd.Disk(0.08, effects=[udd.effects.load_drive(a=1.8)]), 40.0)
    return fit_record(measured, record_of(measured), udd.Disk(0.079), ["k0"], camera=False, search=True)


def test_what_does_not_converge_is_given_up_beside_what_fits(astray: Fit) -> None:
    right = extend(astray, [udd.effects.load_drive(a=1.8)], [1.0])
    goal = Goal(lost=2 * right.chi2, rival=right.level)
    problem, start = astray.problem, started_at(astray, right).point
    there = solve(problem, problem.schedule, start, goal=goal)
    assert there.converged and there.chi2 > goal.lost
    with pytest.raises(FitError, match="explains less than another one"):
        solve(problem, problem.schedule, start, steps=1, goal=goal)


def test_where_misfits_show_the_models_faults_no_noise_is_sought_at_tighter_levels(
    astray: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = importlib.import_module("udd.fitting.noise_estimation")
    asked: list[str] = []
    estimate = module._estimate_noise

    def watched(*given: object) -> object:
        result = estimate(*given)
        asked.append(result[0])
        return result

    monkeypatch.setattr(module, "_estimate_noise", watched)
    again = fit_record(astray.measurements, astray.record, astray.models, ["k0"], camera=False, search=True)
    assert asked == ["faults"]
    assert again.chi2 == pytest.approx(astray.chi2, rel=1e-6)  # 0.01 is where a fit ends


def test_once_a_strong_effect_is_found_the_noise_is_estimated_anew(astray: Fit) -> None:
    """Around the known model it is hidden by the remaining misfit, and stays at its given value."""
    result = extend(astray, [udd.effects.load_drive(a=1.8)], [1.8])
    free = fit_record(
        astray.measurements, astray.record, astray.models, ["k0", "W"], camera=False, search=True
    )
    kept, anew = (work(result, free.problem.free) for work in (released, released_anew))
    assert abs(anew.parameters["W"] - 0.08) < 4 * anew.errors["W"]
    assert kept.scatter > 1.5
    assert 0.9 < anew.scatter < 1.1
