"""Pairs of effects: which fits are abandoned, and which widths of dry friction are tried."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from udd.discovery import proposals
from udd.discovery.proposals import Proposals
from udd.discovery.thresholds import EVIDENCE_MARGIN


def candidate(title: str, width: float = 0.0) -> Any:
    return SimpleNamespace(title=title, width=width)


def trial(*candidates: Any, chi2: float) -> Any:
    fit = SimpleNamespace(chi2=chi2, level=4)
    return SimpleNamespace(candidates=list(candidates), fit=fit, curve=None, rank=(-4, chi2))


class Clock:
    def trying(self, _titles: Any) -> None:
        pass

    def each(self, work: Any, some: Any) -> list[Any]:
        return [work(entry) for entry in some]


QUADRATIC, CUBIC, POWER = candidate("quadratic"), candidate("cubic"), candidate("power")
NARROW, WIDE = candidate("dry", 0.05), candidate("dry", 0.5)
OFFSET = candidate("offset")


@pytest.fixture
def fits(monkeypatch):
    """Replace the fits of pairs by a table; a fit above its goal fails."""
    made: list[tuple[list[Any], float]] = []
    pairs = [
        ([CUBIC, QUADRATIC], 1000.0 + EVIDENCE_MARGIN),
        ([OFFSET, WIDE], 5000.0),
        ([OFFSET, NARROW], 900.0),
    ]

    def fit(_current: Any, group: Any, goal: Any = None, _first: Any = None) -> Any:
        limit = goal.chi2 if goal else float("inf")
        made.append((list(group), limit))
        value = next(chi2 for pair, chi2 in pairs if pair == list(group))
        return trial(*group, chi2=value) if value < limit else None

    monkeypatch.setattr(proposals, "of_several", fit)
    return made


def table(*scored: Any) -> Proposals:
    scores: Any = SimpleNamespace(
        library=SimpleNamespace(scored=[SimpleNamespace(candidate=c) for c in scored])
    )
    fit: Any = SimpleNamespace(level=4)
    clock: Any = Clock()
    return Proposals(fit, scores, clock)


def test_a_pair_slightly_behind_a_single_effect_stays_its_rival(fits):
    pairs = table(QUADRATIC, CUBIC)._together([[CUBIC, QUADRATIC]], [trial(POWER, chi2=1000.0)])
    assert [t.fit.chi2 for t in pairs] == [1000.0 + EVIDENCE_MARGIN]
    assert fits[0][1] == 1000.0 + 2 * EVIDENCE_MARGIN


def test_a_pair_far_behind_is_abandoned(fits):
    assert table(QUADRATIC, CUBIC)._together([[CUBIC, QUADRATIC]], [trial(POWER, chi2=900.0)]) == []


def test_the_best_pair_is_fitted_with_each_width_of_its_dry_friction(fits):
    pairs = table(OFFSET, WIDE, NARROW)._together([[OFFSET, WIDE]])
    assert [t.fit.chi2 for t in pairs] == [5000.0, 900.0]


def test_a_curve_far_behind_a_law_is_abandoned(monkeypatch):
    limits: list[float] = []
    monkeypatch.setattr(proposals, "of_curve", lambda _fit, _curve, most: limits.append(most))
    curve: Any = SimpleNamespace(title="friction as a function of Omega")
    law = trial(POWER, chi2=1000.0)
    table().curves([curve], proposals.far_behind([law, trial(CUBIC, chi2=3000.0)]))
    assert limits == [1000.0 + 2 * EVIDENCE_MARGIN]
    assert proposals.far_behind([]) == float("inf")
