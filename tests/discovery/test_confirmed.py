"""Effects must be confirmed by held-out data, and a model that loses the motion is incomplete."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import discovered
import udd
from discovered import in_air
from udd.discovery.acceptance import Acceptance, SearchState
from udd.discovery.discover import TRAIN
from udd.discovery.score_rounds import score_round
from udd.discovery.search import Search
from udd.discovery.time_budget import Clock
from udd.discovery.trial_fits import fitted_ones, of_library
from udd.discovery.validation import held_out_errors
from udd.discovery.validation.held_out_errors import confirmed, misses_the_motion
from udd.fitting import fit_record, record_of
from udd.report import as_text, summary_of, wording


def test_what_free_runs_do_not_confirm_is_no_finding(monkeypatch, tmp_path: Path):
    monkeypatch.setattr(Acceptance, "improvement", lambda *_: (0.9, 0.8, 1.02))
    result = udd.discover(*in_air())
    assert result.verdict == "effect present, form not identified"  # the known model needs a random force
    assert result.effects == [] and result.model.effects == ()
    assert [(close.title, close.why) for close in result.rejected] == [("quadratic drag", "unconfirmed")]
    result = replace(result, verdict="fits the first part, not confirmed")
    first = as_text(summary_of(result)).splitlines()[0]
    assert first.startswith(
        "fits the first part, not confirmed: Not confirmed: quadratic drag fits the first"
    )
    result.report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<h1>Not confirmed: quadratic drag fits the first part" in page
    assert "<strong>fits the first part, not confirmed</strong>" in page
    assert json.loads(json.dumps(result.to_dict(), default=str))["refused"][0]["why"] == "unconfirmed"


@pytest.mark.parametrize(
    ("ratio", "steps"),
    [
        (None, 1),
        ((0.9, 0.8, 1.02), 0),
        ((1.2, 1.1, 1.3), 0),
        ((0.5, math.nan, math.nan), 0),
    ],
)
def test_only_steps_that_free_runs_confirm_are_kept(monkeypatch, ratio, steps):
    """A search's fits before and after its one step, with its own ratio of errors and with others."""
    result = discovered.pendulum()
    record = result.fit.record
    tests = Acceptance(record, ~record.first(TRAIN), Clock(None, lambda _text: None))
    states = [
        SearchState(result.baseline, result.baseline, result.error_before),
        SearchState(result.trained, result.fit, result.error_after),
    ]
    if ratio is not None:
        monkeypatch.setattr(Acceptance, "improvement", lambda *_: ratio)
    assert Search(tests)._confirmed_by_free_runs(states[0], states) == steps


@pytest.mark.parametrize("witness", [None, "held"])
def test_a_trial_that_held_out_frames_do_not_confirm_is_not_accepted(monkeypatch, witness):
    measured, baseline = in_air()
    record = record_of(measured)
    train = record.first(TRAIN)
    part, whole = (fit_record(measured, some, baseline, search=True) for some in (record.part(train), record))
    scores = score_round(part)
    (drag,) = (s for s in scores.library.scored if s.candidate.title == "quadratic drag")
    trials = fitted_ones([of_library(part, [drag.candidate], list(drag.amplitudes))])
    tests = Acceptance(record, ~train, Clock(None, lambda _text: None))
    monkeypatch.setattr("udd.discovery.acceptance.confirmed_by", lambda *_: ((0.9, 0.8, 1.02), witness))
    result = tests.best(SearchState(part, whole, tests.errors(part)), trials, scores)
    assert (result is not None) == (witness is not None)
    assert result is None or result[0].result.witness == witness


def test_an_interval_that_reaches_one_confirms_only_where_noise_hides_the_gain():
    errors = discovered.disk().error_before  # far above the floor
    at_floor = replace(errors, median=errors.floor, low=errors.floor, high=errors.floor)
    assert confirmed(errors, (0.8, 0.7, 0.9))
    for before, said in ((errors, False), (at_floor, True)):
        assert confirmed(before, (0.98, 0.95, 1.01)) == said
        assert not confirmed(before, (1.1, 1.01, 1.2))
        assert not confirmed(before, (0.5, math.nan, math.nan))
    # A pendulum's error adds up over the whole run.
    assert not confirmed(replace(at_floor, unit="rad"), (0.98, 0.95, 1.01))


def test_free_runs_that_lose_the_motion_are_never_complete(monkeypatch):
    result = discovered.pendulum()
    record = record_of(result.measurement)
    fixed = ~record.first(0.6)
    assert not misses_the_motion(result.error_before, record, fixed)
    lost = replace(result.error_before, run=np.full(fixed.sum(), 1.5))
    assert misses_the_motion(lost, record, fixed)
    noisy = replace(lost, floor=np.full(len(lost.floor), 1.0))  # no conclusion is possible there
    assert not misses_the_motion(noisy, record, fixed)
    disk = discovered.nothing()
    assert not misses_the_motion(disk.error_before, disk.fit.record, ~disk.fit.record.first(0.6))
    # Nothing of the library passes, but the model loses the motion.
    monkeypatch.setattr("udd.discovery.validation.confirmation.ALPHA", 0.0)
    monkeypatch.setattr("udd.discovery.search.ALPHA", 0.0)
    monkeypatch.setattr("udd.discovery.acceptance.ALPHA", 0.0)
    monkeypatch.setattr("udd.discovery.score_rounds.ALPHA", 0.0)
    monkeypatch.setattr(held_out_errors, "_LOST", 0.0)
    measured, baseline = in_air()
    said = udd.discover(measured.slice(0, 20), baseline)
    assert not said.effects and said.verdict == "effect present, form not identified"
    assert wording.verdict(said).startswith("The model lacks something")
