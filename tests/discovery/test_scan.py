"""Candidates together: what a pair explains follows from one solve's gradient and information."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from udd import effects
from udd.discovery.scoring import score_scan
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.score_scan import Scan, Scored


def candidate(k: int) -> Candidate:
    return Candidate(effects.quadratic_drag(), str(k))


def test_a_pair_lowers_chi2_as_least_squares_do() -> None:
    rng = np.random.default_rng(4)
    columns = [[0], [1, 2], [3], [4], [5]]
    design = rng.standard_normal((60, 6))
    design[:, 5] = design[:, 4] + 1e-7 * rng.standard_normal(60)  # two candidates that act alike
    data = design @ [0.0, 2.0, -1.0, 0.5, 0.3, 0.0] + rng.standard_normal(60)
    scored = [Scored(candidate(k), 0.0, 1.0, (), (), k == 2, True) for k in range(5)]
    result, number = Scan(scored, design.T @ data, design.T @ design, columns, 2.0).pairs()
    assert number == len(result)

    usable = [0, 1, 3, 4]  # the third is absorbed
    expected = {}
    for group in itertools.combinations(usable, 2):
        if {3, 4} <= set(group):
            continue
        each = design[:, [c for k in group for c in columns[k]]]
        left = data - each @ np.linalg.lstsq(each, data, rcond=None)[0]
        expected[tuple(str(k) for k in group)] = (data @ data - left @ left) / 2.0
    falls = [fall for _group, fall in result]
    assert falls == sorted(falls, reverse=True)
    # Normal equations of well-conditioned columns lose a few digits.
    assert {tuple(s.candidate.title for s in group): fall for group, fall in result} == pytest.approx(
        expected, rel=1e-9
    )


def test_of_millions_of_pairs_those_of_the_strongest_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(score_scan, "_MOST_PAIRS", 10)
    strength = [3.0, 9.0, 1.0, 7.0, 5.0, 8.0]
    scored = [Scored(candidate(k), chi2, 1.0, (), (), False, True) for k, chi2 in enumerate(strength)]
    columns = [[k] for k in range(6)]
    result, number = Scan(scored, np.sqrt(strength), np.eye(6), columns, 1.0).pairs()
    # Five candidates make ten pairs, six make fifteen, which all count.
    assert len(result) == 10 and number == 15
    assert [s.candidate.title for s in result[0][0]] == ["1", "5"]
    assert "2" not in {s.candidate.title for group, _ in result for s in group}
