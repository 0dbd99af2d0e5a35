"""A short seed of the campaign (`make fuzz`): hostile inputs end in a result or a clear refusal."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.strategies import DataObject

sys.path.insert(0, str(Path(__file__).parent))
from kinds import KINDS

# A film's decoder is a process of its own.
EXAMPLES = {"films": 4, "files": 15, "arguments": 60, "differential": 15}


@pytest.mark.parametrize("kind", KINDS)
def test_hostile_input_is_refused_clearly(kind: str) -> None:
    @seed(1)
    @settings(
        max_examples=EXAMPLES.get(kind, 40),
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.data())
    def run(data: DataObject) -> None:
        KINDS[kind](data)

    run()
