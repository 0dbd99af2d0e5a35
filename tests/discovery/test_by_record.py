"""Several records: what all of them want, what only one wants, and records that no fit sees."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import udd
from udd.discovery.validation.by_record import RecordAnswer, belief, by_record, sentence
from udd.errors import FitError
from udd.fitting import extend, fit_record, record_of

NOISE = 2e-3
FORCED = {"x": "v", "v": "-k*x - c*v + u"}


def oscillator() -> Any:
    return udd.Model(["x", "v"], FORCED, {"k": 4.0, "c": 0.1}, inputs=["u"])


def records(drags: list[float], seed: int = 0) -> list[udd.Measurement]:
    """A driven oscillator's records, each with a quadratic drag of its own."""
    rng = np.random.default_rng(seed)
    result = []
    for k, drag in enumerate(drags):
        t = np.arange(0, 20, 0.06)
        force = np.sin((1.1 + 0.3 * k) * t) + 0.6 * np.sin(2.3 * t + k)
        truth = oscillator().with_term("v", "abs(v)*v", drag=-drag)
        run = udd.simulate(truth, t, [1.0, 0.0], inputs={"u": force}, method="auto").state
        seen = run[:, 0] + NOISE * rng.standard_normal(len(t))
        result.append(udd.Measurement(t, {"x": seen}, inputs={"u": force}))
    return result


def test_what_all_records_want_is_found_and_confirmed_on_one_that_no_fit_saw(tmp_path: Path) -> None:
    given = records([0.08, 0.08, 0.08, 0.08])
    result = udd.discover(given, oscillator(), held_out=[1])
    assert result.verdict == "effect identified" and result.held_out == (1,)
    (effect,) = result.effects
    assert effect.title == "abs(v)*v in v'" and effect.witness == "held"
    assert [a.record for a in effect.by_record] == [0, 2, 3]
    for answer in effect.by_record:
        (value,), (error,) = answer.parameters.values(), answer.errors.values()
        assert answer.answer == "wants it" and abs(value + 0.08) < 4 * error
    assert result.remarks[0] == "abs(v)*v in v': significant in 3 of 3 records."
    # The record held out is in no fit: neither its frames nor what it lowers.
    assert set(result.fit.record.film.tolist()) == set(result.baseline.record.film.tolist()) == {0, 1, 2}
    np.testing.assert_array_equal(result.fit.measurements[3]["x"], given[1]["x"])
    assert result.ratio[2] < 0.5
    udd.save(result, tmp_path / "found.npz")
    again = udd.load(tmp_path / "found.npz")
    assert isinstance(again, udd.Discovery)
    assert again.by_record == result.by_record and again.held_out == (1,)
    result.report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert page.index("Supported by all records: abs(v)*v in v") < page.index("<img")
    assert "Whole records, by number 1, were not used for the fit." in page


@pytest.mark.nightly
def test_what_only_one_record_wants_is_told_apart() -> None:
    result = udd.discover(records([0.0, 0.12, 0.0]), oscillator())
    assert result.verdict == "effect present, form not identified" and not result.effects
    nearest = result.rejected[0]
    assert nearest.title == "abs(v)*v in v'" and nearest.why == "records"
    assert [a.answer for a in nearest.by_record] == ["does not want it", "wants it", "does not want it"]
    assert result.remarks[0] == "abs(v)*v in v': significant only in record 1."


@pytest.mark.parametrize(
    ("drags", "expected"),
    [
        ([0.08, 0.08, 0.08], ["wants it"] * 3),
        ([0.0, 0.12, 0.0], ["does not want it", "wants it", "does not want it"]),
    ],
)
def test_each_record_has_its_own_amplitude(drags: list[float], expected: list[str]) -> None:
    given, model = records(drags), oscillator()
    baseline = fit_record(given, record_of(given, model), model, search=True)
    drag = udd.effects.formula("v'", "-c*abs(v)*v", name="drag", c=0.0)
    answers, _chi2 = by_record(baseline, extend(baseline, [drag], [0.0]), drag, [5, 6, 7])
    assert [a.answer for a in answers] == expected and [a.record for a in answers] == [5, 6, 7]
    for answer, truth in zip(answers, drags, strict=True):
        assert abs(answer.parameters["c"] - truth) < 4 * answer.errors["c"]
        assert answer.errors["c"] < 0.01


@pytest.mark.parametrize("held_out", [None, [2]])
def test_nothing_is_found_where_nothing_is_missing(held_out: list[int] | None) -> None:
    result = udd.discover(records([0.0, 0.0, 0.0], seed=3), oscillator(), held_out=held_out)
    assert result.verdict == "nothing missing" and not result.effects


def test_the_sentences() -> None:
    def answers(*said: Any) -> list[RecordAnswer]:
        return [RecordAnswer(k, item, {}, {}) for k, item in enumerate(said)]

    wants, not_, silent = "wants it", "does not want it", "cannot tell"
    assert sentence("drag", answers(wants, silent, wants)) == (
        "drag: significant in 2 of 3 records; record 1 cannot show it."
    )
    both = [("drag", answers(wants, wants)), ("slip", answers(not_, wants))]
    assert belief(both) == ("Supported by all records: drag. Not by all: slip: significant only in record 1.")
    assert belief([]) == ""


@pytest.mark.parametrize(
    ("held_out", "said"),
    [([2], "measurements 0 to 1"), ([0, 1], "not all"), ([], "some of"), (["a"], "numbers"), (1, "numbers")],
)
def test_what_cannot_be_held_out(held_out: Any, said: str) -> None:
    with pytest.raises(FitError, match=said):
        udd.discover(records([0.0, 0.0]), oscillator(), held_out=held_out)
    with pytest.raises(FitError, match="several measurements"):
        udd.discover(records([0.0])[0], oscillator(), held_out=[0])
