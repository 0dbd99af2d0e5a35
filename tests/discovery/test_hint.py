"""Experiment design: a film is proposed if forms are in doubt, and its expected evidence is right."""

from __future__ import annotations

import functools
import json
from dataclasses import replace

import numpy as np
import pytest

import discovered
import udd
from simulated import film
from udd.discovery.experiment_design import _films, _ranked
from udd.discovery.thresholds import EVIDENCE_MARGIN
from udd.fitting import at_level, fit_record, record_of
from udd.report import as_text, summary_of

DRIVE = 0.042
RELAXED = udd.Disk(DRIVE, effects=[udd.effects.relaxation(b=1.5)])


@functools.cache
def relaxed():
    """A film of a disk whose constraint is relaxed a little, and the verdict: it may be a slip."""
    measured, _ = film(RELAXED, np.random.default_rng(5), 20.0)
    return measured, discovered.search(measured, udd.Disk(DRIVE))


def second(times, seed=6):
    """A film of the same disk at another drive."""
    return film(RELAXED.with_parameters({"W": times * DRIVE}), np.random.default_rng(seed), 20.0)[0]


def test_evidence_is_said_as_odds():
    (hint,) = _ranked([("for 40 s at twice the drive", {"slip": 23.1, "drag": 2.0})])
    assert hint.text == (
        "film for 40 s at twice the drive: it is expected to separate what was found from slip "
        "(odds of 10¹⁰ to 1); not from drag"
    )
    (hint,) = _ranked([("for 40 s", {"slip": 2.0})])
    assert "odds of 7.39 to 1, and 10⁴ to 1 are needed" in hint.text


def test_a_second_drive_is_proposed_for_slip_or_relaxation():
    _measured, result = relaxed()
    assert any("slip" in other.title for other in result.alternatives)
    assert result.hint is not None and "times the drive" in result.hint.design
    assert any("slip" in title for title in result.hint.parts)
    assert result.hint.nats >= EVIDENCE_MARGIN
    # Neither another start nor a longer film at the one drive would tell.
    telling = [hint for hint in result.hints if any("slip c Z" in title for title in hint.parts)]
    assert all("times the drive" in hint.design for hint in telling)
    assert result.hint.text.split(" (odds")[0] in as_text(summary_of(result))  # which writes powers with ^
    json.dumps([hint.to_dict() for hint in result.hints])


def test_the_proposed_film_parts_them():
    measured, result = relaxed()
    times = float(result.hint.design.split("with ")[1].split(" times")[0])
    both = udd.discover([measured, second(times)], [udd.Disk(DRIVE), udd.Disk(times * DRIVE)])
    assert [effect.effect.name for effect in both.effects] == ["relaxation"]
    assert not any("slip c Z" in other.title for other in both.alternatives)


def test_what_a_film_is_expected_to_tell_is_what_it_tells():
    measured, result = relaxed()
    slip = next(other for other in result.alternatives if "slip" in other.title)
    said, reported = [], []
    for times in (0.5, 0.7, 1.4, 2.0):
        hint = next(h for h in result.hints if f"with {times:g} times" in h.design)
        said.append(hint.each[slip.title])
        films = [measured, second(times)]
        record = record_of(films)
        record = record.part(record.first(0.6))
        fits = [
            fit_record(films, record, [udd.Disk(w, effects=[e]) for w in (DRIVE, times * DRIVE)], search=True)
            for e in (result.effects[0].effect, slip.effect)
        ]
        level = min(fitted.level for fitted in fits)
        right, wrong = (at_level(fitted, level) for fitted in fits)
        reported.append((wrong.chi2 - right.chi2) / 2 / max(right.scatter, 1.0))
    # Half a chi2's rise of n nats scatters by sqrt(2 n), and another start tells up to twice as much or half.
    assert 0.5 < sum(reported) / sum(said) < 2.0, (said, reported)


def test_nothing_is_proposed_where_nothing_is_in_doubt():
    assert discovered.nothing().hints == [] and discovered.nothing().hint is None


def test_a_weak_doubt_that_no_film_settles_is_said_so():
    """Forms so weak that no film tells them apart are left open in so many words."""
    _measured, result = relaxed()
    slip = next(other for other in result.alternatives if "slip" in other.title)
    trained, effect = result.trained, result.effects[0].effect
    weak = [m.with_parameters({f"{effect.name}.b": 0.02}) for m in trained.models]
    faint = replace(
        result,
        trained=replace(trained, models=tuple(weak)),
        alternatives=[replace(slip, effect=slip.effect.replace(c=0.02 * DRIVE))],
    )
    (hint,) = faint.hints
    assert hint.design == "" and hint.nats < EVIDENCE_MARGIN
    assert hint.text.startswith("no feasible film would separate them")


@pytest.mark.parametrize("model", [udd.Disk(DRIVE), udd.Disk(0.0), udd.Pendulum(0.6, k0=0.01)])
def test_designs_suit_the_device(model):
    """No multiples of a drive that is at rest, and no pendulum near the top."""

    class Fit:
        models = (model,)
        states = np.full((50, len(model.state_names)), 1.6)
        record = type("Record", (), {"film": np.zeros(50, dtype=int)})

    designs = [f.design for f in _films(Fit)]
    assert any("times the drive" in d for d in designs) == (getattr(model, "W", 0.0) != 0.0)
    assert not any("3.2 rad" in d for d in designs)
    assert designs[-1] == "on for as long again"
