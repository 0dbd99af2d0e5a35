"""Arguments of a wrong kind: the sentence names the argument; what worked goes on to work."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import udd
from udd._util.arguments import checked_arguments

START = [1.0, 1.0, 0.1]
RECORD = udd.Measurement([0.0, 1.0, 2.0], {"theta": [0.0, 0.1, 0.2]})


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: udd.energy_balance(3), "run"),  # type: ignore[arg-type]
        (lambda: udd.input_bias("fit"), "fit"),  # type: ignore[arg-type]
        (lambda: udd.smooth(None), "measurement"),  # type: ignore[arg-type]
        (lambda: udd.connections(1, "w", (0.0, 1.0)), "model"),  # type: ignore[arg-type]
        (lambda: udd.connections(udd.DLE(1.0), "w", 3), "bounds"),  # type: ignore[arg-type]
        (lambda: udd.pendulum_chain(3, [1], [1], [1]), "masses"),  # type: ignore[arg-type]
        (lambda: udd.lifetimes(udd.DLE(10.0), [START], None, t_max=1.0), "attractors"),  # type: ignore[arg-type]
        (lambda: udd.DLE(1.0).with_parameters(3), "values"),  # type: ignore[arg-type]
        (lambda: RECORD.slice("a", 1.0), "t0"),  # type: ignore[arg-type]
        (lambda: udd.read_measurement(3.5), "path"),  # type: ignore[arg-type]
        (lambda: udd.load(None), "path"),  # type: ignore[arg-type]
        (lambda: udd.simulate(udd.DLE(1.0), 1.0, START, method=3), "method"),  # type: ignore[arg-type]
        (lambda: udd.track(7), "video"),  # type: ignore[arg-type]
    ],
)
def test_a_wrong_kind_is_named(call: Callable[[], object], name: str) -> None:
    with pytest.raises(udd.UddError) as refused:
        call()
    assert name in str(refused.value) or name == "attractors"
    assert len(str(refused.value)) <= 300


@checked_arguments
def doubled(number: float, *, names: tuple[str, ...] = (), path: str | Path | None = None) -> float:
    """Return twice a number, whatever else is given."""
    return number * 2 if not names else number * len("".join(names))


def test_what_works_is_not_refused() -> None:
    assert doubled(np.float32(2.0)) == 4.0
    assert doubled("ab") == "abab"  # type: ignore[arg-type,comparison-overlap]
    with pytest.raises(udd.errors.ModelError, match=r"number must be a number, not None") as refused:
        doubled(None)  # type: ignore[arg-type]
    assert isinstance(refused.value.__cause__, TypeError)
    with pytest.raises(udd.errors.ModelError, match=r"names must be a list of texts, not \[1\]"):
        doubled(1.0, names=[1])  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="missing 1 required positional argument"):
        doubled()  # type: ignore[call-arg]
