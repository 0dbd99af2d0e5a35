"""What held-out data do not bear out is no finding, and a model that loses the motion is not complete."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import discovered
import udd
from udd.discovery.acceptance import Acceptance
from udd.discovery.validation import held_out_errors
from udd.discovery.validation.held_out_errors import confirmed, misses_the_motion
from udd.fitting import record_of
from udd.report import as_text, summary_of, wording


def in_air() -> tuple[udd.Measurement, udd.Pendulum]:
    """A pendulum in air, and the model that knows viscous friction only."""
    t = np.arange(0, 40, 0.05)
    truth = udd.Pendulum(0.6, k0=0.004, effects=[udd.effects.quadratic_drag(c=0.02)])
    theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1]
    noise = 2e-3 * np.random.default_rng(3).standard_normal(len(t))
    return udd.Measurement(t, {"theta": theta + noise}), udd.Pendulum(0.6, k0=0.01)


@pytest.mark.parametrize("ratio", [(0.9, 0.8, 1.02), (1.2, 1.1, 1.3), (0.5, math.nan, math.nan)])
def test_what_free_runs_do_not_confirm_is_no_finding(monkeypatch, tmp_path: Path, ratio):
    monkeypatch.setattr(Acceptance, "improvement", lambda *_: ratio)
    found = udd.discover(*in_air())
    assert found.verdict == "fits the first part, not confirmed"
    assert found.effects == [] and found.model.effects == ()
    assert [(near.title, near.why) for near in found.rejected] == [("quadratic drag", "unconfirmed")]
    first = as_text(summary_of(found)).splitlines()[0]
    assert first.startswith(
        "fits the first part, not confirmed: Not confirmed: quadratic drag fits the first"
    )
    found.report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<h1>Not confirmed: quadratic drag fits the first part" in page
    assert "<strong>fits the first part, not confirmed</strong>" in page
    assert json.loads(json.dumps(found.to_dict(), default=str))["refused"][0]["why"] == "unconfirmed"


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
    measured, known = in_air()
    found = udd.discover(measured, known)
    record = record_of(measured)
    held = ~record.first(0.6)
    assert not misses_the_motion(found.error_before, record, held)
    lost = replace(found.error_before, run=np.full(held.sum(), 1.5))
    assert misses_the_motion(lost, record, held)
    noisy = replace(lost, floor=np.full(len(lost.floor), 1.0))  # nothing can be told there
    assert not misses_the_motion(noisy, record, held)
    disk = discovered.nothing()
    assert not misses_the_motion(disk.error_before, disk.fit.record, ~disk.fit.record.first(0.6))
    # Nothing of the library passes, but the model loses the motion.
    monkeypatch.setattr("udd.discovery.validation.confirmation.ALPHA", 0.0)
    monkeypatch.setattr("udd.discovery.search.ALPHA", 0.0)
    monkeypatch.setattr("udd.discovery.acceptance.ALPHA", 0.0)
    monkeypatch.setattr("udd.discovery.score_rounds.ALPHA", 0.0)
    monkeypatch.setattr(held_out_errors, "_LOST", 0.0)
    said = udd.discover(measured, known)
    assert not said.effects and said.verdict == "effect present, form not identified"
    assert wording.verdict(said).startswith("The model lacks something")
