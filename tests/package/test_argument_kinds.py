"""Arguments of a wrong kind: the sentence names the argument; what worked goes on to work."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import udd
from udd._util.arguments import checked_arguments

START = [1.0, 1.0, 0.1]
RECORD = udd.Measurement(np.arange(20.0), {"theta": 0.1 * np.arange(20.0)}, sigma=np.full((20, 1), 0.1))
SIGNAL = udd.InputSignal([0.0, 1.0], [0.0, 1.0])
SPRING = udd.Model(["x", "v"], ["v", "-k*x"], {"k": 1.0})
NOTHING = np.zeros(0)  # whose comparison with a text is neither true nor false
HUGE = 10**400


@functools.cache
def points() -> udd.Section:
    return udd.poincare(udd.DLE(1.0), "z", 5, transient=1, state0=START)


@functools.cache
def branch() -> udd.Branch:
    rest = udd.equilibria(udd.DLE(2.5, B=0.2), initial_states=8)[0]
    return udd.continuation(rest, "w", (2.4, 2.6), max_points=3)


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
        (lambda: points().of(NOTHING), "which"),  # type: ignore[arg-type]
        (lambda: points().return_map(NOTHING), "name"),  # type: ignore[arg-type]
        (lambda: branch().at("2.5"), "value"),  # type: ignore[arg-type]
        (lambda: branch().solution(2**31), "points, counted from 0"),
        (lambda: udd.Disk(0.04, edge=NOTHING), "edge"),  # type: ignore[arg-type]
        (lambda: udd.Model(["x"], ["-x"], mass=np.ones((3, 3))), "mass"),  # type: ignore[arg-type]
        (lambda: SPRING.with_parameters([["k"]]), "values"),  # type: ignore[arg-type]
        (lambda: SPRING.with_term(NOTHING, "x", c=1.0), "equation"),  # type: ignore[attr-defined]
        (lambda: udd.pendulum_chain([HUGE], [1], [1], [1]), "m1 is too large"),
        (lambda: udd.effects.curve([], "Omega", 0, 1, [0] * 4), "slot"),  # type: ignore[arg-type]
        (lambda: udd.effects.formula("torque", "a", amplitudes=True, a=1), "amplitudes"),  # type: ignore[arg-type]
        (lambda: udd.effects.relaxation(b=1.0, momentum=NOTHING), "momentum"),  # type: ignore[arg-type]
        (lambda: udd.related_systems.walking_droplet(1.0, NOTHING), "memory"),  # type: ignore[arg-type]
        (lambda: udd.Measurement([0, HUGE], [[0.0], [1.0]]), "t must be numbers"),
        (lambda: RECORD.slice(0.0, np.datetime64("2026")), "t1"),  # type: ignore[arg-type]
        (lambda: RECORD.rows([70]), "mask"),
        (lambda: RECORD.on_rows([]), "name"),  # type: ignore[arg-type]
        (lambda: RECORD.to_csv(3), "path"),  # type: ignore[arg-type]
        (lambda: RECORD.to_csv("\0"), "cannot be written"),
        (lambda: RECORD.to_csv("a" * 5000), "cannot be written"),
        (lambda: udd.InputSignal([0, 1], [0, 1], NOTHING), "hold"),  # type: ignore[arg-type]
        (lambda: SIGNAL(["now"]), "t must be numbers"),
        (lambda: SIGNAL.shifted("1"), "by"),  # type: ignore[arg-type]
        (lambda: udd.smooth(RECORD, angles=3), "angles"),  # type: ignore[arg-type]
        (lambda: udd.smooth(RECORD, gap=5e-324), "gap is"),
        (lambda: udd.film.Defects(lens=None), "lens"),  # type: ignore[arg-type]
        (lambda: udd.film.Defects(off_axis=("a", 0)), "off_axis"),  # type: ignore[arg-type]
        (lambda: udd.film.Defects(clock=1), "clock"),  # type: ignore[arg-type]
        (lambda: udd.SweepSpec.from_json(None), "text"),  # type: ignore[arg-type]
        (lambda: udd.tracking.TrackOptions(sigma=None), "sigma"),  # type: ignore[arg-type]
        (lambda: udd.plot.geometry(True), "ax"),  # type: ignore[arg-type]
        (lambda: udd.plot.geometry(state=["a"]), "state"),
        (lambda: udd.plot.geometry(R=1e308), "R"),
        (lambda: udd.plot.friction(udd.Disk(0.04), fastest="9"), "fastest"),  # type: ignore[arg-type]
    ],
)
def test_a_wrong_kind_is_named(call: Callable[[], object], name: str) -> None:
    with pytest.raises(udd.UddError) as refused:
        call()
    assert name in str(refused.value) or name == "attractors"
    assert len(str(refused.value)) <= 300


Size = Literal["small", "large"] | float


@checked_arguments
def sized(of: Size, path: Path | None, names: Sequence[str] = ()) -> float:
    """Return a size, whatever its annotation calls it."""
    return {"small": 1.0}.get(of) or of + len(path.parts) + len("".join(names))  # type: ignore


def test_names_of_annotations_are_resolved() -> None:
    with pytest.raises(udd.ModelError, match=r"of must be 'small' or 'large' or a number, not 'tiny'"):
        sized("tiny", None)  # type: ignore[arg-type]
    with pytest.raises(udd.ModelError, match=r"path must be a path, not 'a'"):
        sized(2.0, "a")  # type: ignore[arg-type]
    with pytest.raises(AttributeError):
        sized(2.0, None)  # all arguments are of their kinds
    with pytest.raises(udd.ModelError, match=r"names must be a list of texts, not array"):
        sized(2.0, Path("a"), np.arange(2))  # type: ignore[arg-type]
    assert sized(2.0, Path("a"), ()) == 3.0


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
