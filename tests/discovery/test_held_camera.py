"""A camera that was assumed to be perfect and is not; forms distinguished by a film's own scatter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import udd
from udd.discovery.thresholds import EVIDENCE_MARGIN
from udd.discovery.validation.held_camera import camera_shows
from udd.fitting import extend, fit_record, most_probable, record_of, refit
from udd.fitting.sensor import roughness


def filmed(
    zero: float, *drags: udd.effects.Effect, seconds: float = 30.0, sd: float = 1e-3
) -> udd.Measurement:
    """A pendulum's film, whose zero is elsewhere."""
    t = np.arange(0, seconds, 1 / 20)
    theta = udd.simulate(udd.Pendulum(0.6, k0=0.004, effects=list(drags)), t, [0.0, 0.9]).state[:, 1]
    noise = sd * np.random.default_rng(2).standard_normal(len(t))
    return udd.Measurement(t, {"theta": theta + zero + noise})


@pytest.mark.parametrize(
    ("zero", "laws", "excused"),
    [
        (0.01, [udd.effects.constant_torque(), udd.effects.quadratic_drag()], ["constant_torque"]),
        (0.0, [udd.effects.quadratic_drag()], None),
    ],
)
def test_effects_that_a_camera_explains_are_listed(zero, laws, excused) -> None:
    record = filmed(zero, udd.effects.quadratic_drag(c=0.006))
    model = udd.Pendulum(0.6, k0=0.008)
    baseline = fit_record(record, record_of(record), model, camera=False, search=True)
    assert camera_shows(baseline, extend(baseline, laws, [0.0] * len(laws))) == excused


# test_effects_that_a_camera_explains_are_listed asks both of the fits.
@pytest.mark.parametrize("zero", [0.01, pytest.param(0.0, marks=pytest.mark.nightly)])
def test_what_a_cameras_faults_explain_is_told(zero: float) -> None:
    """The zero of the angle passes for a constant torque; a camera that is perfect changes nothing."""
    record = filmed(zero, udd.effects.quadratic_drag(c=0.006))
    result = udd.discover(record, udd.Pendulum(0.6, k0=0.008), camera=False)
    said = [remark for remark in result.remarks if "camera=True" in remark]
    titles = {e.title for e in result.effects}
    if zero:
        assert titles == {"constant torque", "quadratic drag"}
        assert result.verdict == "effect present, form not identified"
        assert result.excused == ["constant torque"] and "constant torque" in said[0]
    else:
        assert titles == {"quadratic drag"} and result.verdict == "effect identified"
        assert result.excused is None and not said


def test_forms_are_compared_by_the_noise_that_shows() -> None:
    """A film's noise is assumed to be at least 2.5 mrad. By that a cubic drag alone ties with two drags."""
    drags = udd.effects.quadratic_drag(c=0.001), udd.effects.cubic_drag(c=0.0005)
    record = filmed(0.005, *drags, seconds=60.0, sd=6e-4)
    baseline = fit_record(record, record_of(record), udd.Pendulum(0.6, k0=0.008), search=True)
    alone = extend(baseline, [udd.effects.cubic_drag()], [0.0])
    both = extend(alone, [udd.effects.quadratic_drag()], [0.0])
    assumed, shown = (again(both).evidence - again(alone).evidence for again in (refit, most_probable))
    assert assumed < EVIDENCE_MARGIN < shown


@pytest.mark.nightly  # test_forms_are_compared_by_the_noise_that_shows asks the same of the fits
def test_two_drags_are_told_apart_by_the_scatter_that_shows() -> None:
    drags = udd.effects.quadratic_drag(c=0.001), udd.effects.cubic_drag(c=0.0005)
    record = filmed(0.005, *drags, seconds=100.0, sd=6e-4)
    result = udd.discover(record, udd.Pendulum(0.6, k0=0.008))
    assert {e.title for e in result.effects} == {"quadratic drag", "cubic drag"}
    assert result.fit.parameters["k0"] > 0


def test_a_signal_of_few_samples_a_turn_is_no_noise() -> None:
    """Third differences of nine samples a turn are a thirtieth of the signal, sixth ones a 500th."""
    t = np.arange(0, 1, 1 / 610)
    noise = 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    result = roughness(np.sin(2 * np.pi * 70 * t) + noise)
    assert 0.8e-3 < result < 4e-3  # 37e-3 by third differences alone


def test_a_formula_found_with_a_films_camera_held_is_not_identified() -> None:
    """A formula of the speed bends until it hides a zero that is elsewhere; an encoder has no such faults."""
    law = udd.effects.formula("torque", "a*tanh(b + Omega)", amplitudes=["a"], a=-0.01, b=0.2)
    for meta, reported in (({}, []), ({"sensor": "encoder"}, None)):
        measured = replace(filmed(0.0, udd.effects.quadratic_drag(c=0.006)), meta=meta)
        record, model = record_of(measured), udd.Pendulum(0.6, k0=0.004)
        baseline = fit_record(measured, record, model, ["k0"], camera=False, search=True)
        assert camera_shows(baseline, extend(baseline, [law], [-0.01])) == reported
