"""If only the last part of a record shows an effect, the parts exchange their roles."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import udd
from discovered import in_air
from udd.discovery.search_data import known_model_fits, prepared
from udd.discovery.validation.held_out_errors import held_out_errors
from udd.fitting import fit_record
from udd.report.discovery_report import held_back


def test_the_last_part_trains_and_the_first_part_tests():
    measured, model = in_air()
    data = prepared(measured, model, None, None, 0.6)
    other = data.exchanged(0.6)
    n = len(measured.t)
    assert data.split == measured.t[int(0.6 * n)] and not data.train[int(0.6 * n) :].any()
    assert other.split == measured.t[0] and other.train[int(0.4 * n) :].all()
    assert other.train.sum() == data.train.sum()


def test_free_runs_over_the_first_part_start_there():
    """A fit of the last part knows no state before it: the first second shows where the run starts."""
    t = np.arange(0, 40, 0.05)
    truth = udd.Pendulum(0.6, k0=0.01)
    theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1]
    measured = udd.Measurement(t, {"theta": theta + 2e-3 * np.random.default_rng(3).standard_normal(len(t))})
    data = prepared(measured, udd.Pendulum(0.6, k0=0.02), None, None, 0.6).exchanged(0.6)
    fitted = fit_record(measured, data.record.part(data.train), data.model, search=True)
    errors = held_out_errors(fitted, data.record, ~data.train)
    assert errors.whole < 3 * 2e-3  # of a right model: the noise, and that of the start
    assert errors.median[-1] < 3 * errors.floor[-1]


def test_the_last_part_keeps_its_name_if_the_disk_comes_to_rest():
    """The frames at rest are no part of the record: its end is before the film's."""
    trained = SimpleNamespace(record=SimpleNamespace(clock=[0.0]))
    film = SimpleNamespace(t=[0.0, 100.0], duration=100.0)
    result: Any = SimpleNamespace(measurement=film, held_out=(), held_out_span=(50.0, 80.0), trained=trained)
    assert held_back(result) == "The last 30 % of the record"


def test_undetermined_parameters_are_named_again_with_the_parts_exchanged():
    """A record of an oscillator determines only the product of two factors."""
    t = np.arange(0, 20, 0.05)
    seen = np.cos(2 * t) + 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    model = udd.Model(["x", "v"], ["v", "-a*b*x"], {"a": 2.0, "b": 2.0})
    options = {"free": None, "camera": True, "priors": None, "each": None}
    data = prepared(udd.Measurement(t, {"x": seen}), model, None, None, 0.6)
    first = known_model_fits(data, options)[2]
    assert first and known_model_fits(data.exchanged(0.6), options)[2] == first
    assert options["priors"] is None


@pytest.mark.slow
def test_two_effects_that_balance_in_the_first_part_are_seen_in_the_last():
    """Dry friction and quadratic drag: around the mean friction of the first part they cancel."""
    t = np.arange(0, 90, 1 / 25)
    both = [udd.effects.coulomb(c=0.0015), udd.effects.quadratic_drag(c=0.0005)]
    theta = udd.simulate(udd.Pendulum(0.5, k0=0.006, effects=both), t, [0.0, 0.8]).state[:, 1]
    measured = udd.Measurement(t, {"theta": theta + 3e-3 * np.random.default_rng(0).standard_normal(len(t))})
    result = udd.discover(measured, udd.Pendulum(0.5, k0=0.01))
    assert result.verdict == "effect present, form not identified"
    assert [effect.title for effect in result.effects] == ["Stribeck friction"]
    assert result.held_out_span == (0.0, 36.0)
    assert held_back(result) == "The first 40 % of the record"
    assert result.to_dict()["held_out_to_s"] == 36.0
