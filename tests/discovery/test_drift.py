"""Drifts of a sensor, fits that come close to their minimum, and curves that lead."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import udd
from udd.discovery.results import AddedEffect
from udd.discovery.score_rounds import ScoreRound
from udd.discovery.scoring.score_scan import Scan
from udd.discovery.validation.sensor_drift import as_random, drift_gain
from udd.fitting import fit_record, model_error_schedule, record_of

KNOWN = udd.Pendulum(0.8, k0=0.013)


def drifting(size: float) -> udd.Measurement:
    """A pendulum whose sensor's zero drifts, with this amplitude."""
    rng = np.random.default_rng(5)
    t = np.arange(0, 30, 0.04)
    theta = udd.simulate(udd.Pendulum(0.82, k0=0.012), t, [0.0, 0.8]).state[:, 1]
    walk = np.cumsum(rng.standard_normal(len(t))) / np.sqrt(len(t))
    return udd.Measurement(t, {"theta": theta + size * walk + 2e-3 * rng.standard_normal(len(t))})


def test_a_drift_of_the_sensor_is_no_effect():
    measured = drifting(8e-3)
    assert udd.discover(measured, KNOWN).effects == []
    baseline = fit_record(measured, record_of(measured), KNOWN, search=True)
    assert drift_gain(baseline) > 150  # far beyond the price of its freedom


def test_a_steady_sensor_gains_nothing_by_a_drift():
    measured = drifting(0.0)
    assert drift_gain(fit_record(measured, record_of(measured), KNOWN, search=True)) == 0.0
    short = measured.rows(np.arange(150))  # too short to tell a drift from the swing
    assert drift_gain(fit_record(short, record_of(short), KNOWN, search=True)) == 0.0


def swinging(shake: float, drag: float) -> udd.Measurement:
    """A pendulum that hardly loses energy, with a support that shakes or a drag."""
    rng = np.random.default_rng(11)
    t = np.arange(0, 60, 0.02)
    waves = [(rng.normal(), f, rng.uniform(0, 6)) for f in np.linspace(0.3, 3.0, 60)]
    pushes = " + ".join(f"{a:.4f}*sin({2 * np.pi * f:.5f}*t + {phase:.3f})" for a, f, phase in waves)
    effects = [udd.effects.formula("torque", f"{shake}*({pushes})", name="pushes")] if shake else []
    effects += [udd.effects.quadratic_drag(c=drag)] if drag else []
    theta = udd.simulate(udd.Pendulum(0.8, k0=0.004, effects=effects), t, [0.0, 0.8]).state[:, 1]
    return udd.Measurement(t, {"theta": theta + 2e-3 * rng.standard_normal(len(t))})


@pytest.mark.parametrize(("shake", "drag"), [(2e-3, 0.0), (0.0, 3e-3)])
def test_what_forces_at_random_explain_as_well_is_told_from_a_drag(shake, drag):
    measured = swinging(shake, drag)
    record = record_of(measured)
    braked = udd.Pendulum(0.8, k0=0.004, effects=[udd.effects.quadratic_drag(c=1e-3)])
    baseline, result = (
        fit_record(measured, record, model, search=True) for model in (udd.Pendulum(0.8, k0=0.004), braked)
    )
    assert baseline.level == result.level and baseline.chi2 - result.chi2 > 30  # either looks like a finding
    assert (as_random(baseline, result) is not None) == bool(shake)


def test_a_search_takes_a_fit_that_is_near_its_minimum():
    measured = drifting(0.0)
    done = fit_record(measured, record_of(measured), KNOWN, search=True)
    unfinished = replace(done, converged=False)
    assert model_error_schedule._nearly(unfinished, model_error_schedule.STEPS).converged
    # A fit of its own must reach its minimum.
    alone = replace(unfinished, problem=replace(done.problem, likeliest=True))
    assert model_error_schedule._nearly(alone, model_error_schedule.STEPS) is alone
    # Nor of a formula, whose constants may trade for each other for ever.
    assert model_error_schedule._nearly(unfinished, model_error_schedule.FEW) is unfinished
    far = replace(done.point.without_cache(), states=done.states + np.array([0.0, 0.3]))
    away = replace(unfinished, point=far)
    assert (
        model_error_schedule._nearly(away, model_error_schedule.STEPS).chi2 < 1.01 * done.chi2
    )  # or a few steps bring it there


@pytest.mark.parametrize(("evidence", "leads"), [(400.0, True), (200.0, False)])
def test_a_curve_leads_that_says_far_more_than_the_library(evidence, leads):
    measured = drifting(0.0)
    fitted = fit_record(measured, record_of(measured), KNOWN, search=True)
    scored = SimpleNamespace(chi2=200.0, physical=True, candidate=SimpleNamespace(parameters=1))
    curve = SimpleNamespace(evidence=evidence, coordinates=("Z",))
    scan = Scan([scored], np.zeros(1), np.eye(1), [[0]], 1.0)  # type: ignore[list-item]
    look = ScoreRound(fitted, scan, [curve], 1)  # type: ignore[list-item]
    assert look.curve_leads() is leads


def test_a_curve_over_time_alone_is_like_a_drift_but_in_a_film_of_a_disk():
    def over(*names):
        return SimpleNamespace(curve=SimpleNamespace(coordinates=[SimpleNamespace(name=n) for n in names]))

    assert AddedEffect.like_a_drift(over("t"), KNOWN)
    assert not AddedEffect.like_a_drift(over("t"), udd.Disk(0.04))
    assert not AddedEffect.like_a_drift(over("theta"), KNOWN)
    assert not AddedEffect.like_a_drift(SimpleNamespace(curve=None), KNOWN)
