"""Held-out data that refute the most probable hypothesis leave room for the next one."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from udd.discovery.acceptance import Acceptance
from udd.discovery.hypotheses import Hypothesis

UNTESTED = (math.nan, math.nan, math.nan)


class Located:
    """A curve: each fit has one of its own."""

    def __init__(self, name: str) -> None:
        self.name = (name,)


def trial(name: str, curve: str = "") -> Any:
    fit = SimpleNamespace(level=4)
    title = SimpleNamespace(title=name, effect=SimpleNamespace(name=name))
    located = Located(curve) if curve else None
    return SimpleNamespace(
        candidates=[title], curve=located, formula=None, fit=fit, names=[], needed=True, is_curve=bool(curve)
    )


class Table(Acceptance):
    """Acceptance that reads log evidence and held-out cost ratios from a table."""

    def __init__(self, rows: dict[str, tuple[float, tuple[float, float, float]]]) -> None:
        self.rows, self.free = rows, ()

    def hypotheses(self, _current: Any, trials: Any, _scores: Any) -> list[Hypothesis]:
        result = []
        for each in trials:
            entry = Hypothesis(each, each, SimpleNamespace(), 0.0)
            entry.__dict__["log_z"] = self.rows[each.candidates[0].title][0]
            result.append(entry)
        return result

    def judged(self, _current: Any, tried: Any, *_others: Any) -> Any:
        ratio = self.rows[tried.candidates[0].title][1]
        witness = "held" if ratio[2] < 1 else None
        return SimpleNamespace(whole=tried.fit, chi2=100.0, p=0.0, ratio=ratio, witness=witness)

    def errors_or_none(self, fitted: Any) -> Any:
        return fitted

    def worse(self, _before: Any, _after: Any) -> bool:
        return False

    def _alternatives(self, *_arguments: Any) -> list[Any]:
        return []


CURRENT: Any = SimpleNamespace(part=SimpleNamespace(level=4), errors=None)
SCORES: Any = SimpleNamespace(library=None)


@pytest.mark.parametrize(
    ("curve_ratio", "expected"),
    [
        ((17.0, 11.0, 23.0), "drag"),  # refuted: a curve that follows a camera's errors
        ((1.1, 0.7, 1.6), None),  # not confirmed: it may be true, so nothing less probable is added
        (UNTESTED, None),  # a slow drift of the sensor explains it
        ((0.4, 0.3, 0.6), "curve"),
    ],
)
def test_a_refuted_hypothesis_leaves_room_for_the_next(curve_ratio, expected):
    rows = {"curve": (3000.0, curve_ratio), "drag": (2700.0, (0.2, 0.1, 0.3))}
    added = Table(rows).best(CURRENT, [trial("curve", curve="friction"), trial("drag")], SCORES)
    assert (added and added[0].candidates[0].title) == expected


def test_all_refuted_hypotheses_add_nothing():
    rows = {"curve": (3000.0, (17.0, 11.0, 23.0)), "drag": (2700.0, (2.0, 1.5, 3.0))}
    assert Table(rows).best(CURRENT, [trial("curve", curve="friction"), trial("drag")], SCORES) is None


def test_a_refuted_formula_takes_its_curve_with_it():
    """Formulas come from the curve of the fit of all data, not from a trial's."""

    class Written(Table):
        def hypotheses(self, current: Any, trials: Any, scores: Any) -> list[Hypothesis]:
            formulas = [trial("formula", curve=t.curve.name[0]) for t in trials if t.curve]
            return super().hypotheses(current, [*trials, *formulas], scores)

    refuted, confirmed = (17.0, 11.0, 23.0), (0.2, 0.1, 0.3)
    rows = {"formula": (3000.0, refuted), "curve": (2900.0, refuted), "drag": (2700.0, confirmed)}
    added = Written(rows).best(CURRENT, [trial("curve", curve="friction"), trial("drag")], SCORES)
    assert added and added[0].candidates[0].title == "drag"
