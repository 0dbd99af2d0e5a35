"""The top of a verdict, as the page shows it."""

from __future__ import annotations

import re

import pytest

import discovered
from udd.app import result


def test_a_verdict_has_constants_its_origin_and_a_single_spelling(monkeypatch: pytest.MonkeyPatch) -> None:
    answer, origin = discovered.disk(), "This film was rendered."
    rendered = answer.measurement.with_meta(origin=origin)
    monkeypatch.setattr(type(answer), "measurement", property(lambda _: rendered))
    shown = result.of(answer)
    assert [row["name"] for row in shown["constants"]][:4] == ["k0", "k1", "k2", "W"]
    for row in shown["constants"]:
        assert re.fullmatch(r"\d+\.\d+\(\d+(\.\d+)?\)", row["value"]) and row["meaning"] and row["unit"]
    assert shown["limits"][0] == origin
    text = " ".join([shown["effects"][0]["equation"], *shown["limits"]])
    first, *others = [row["chi2"] for row in shown["evidence"]]
    assert first == answer.effects[0].chi2 and others == sorted(others, reverse=True)  # as in the report
    assert text.count("W_c") == 2 and "Wc" not in text and " - " not in text
