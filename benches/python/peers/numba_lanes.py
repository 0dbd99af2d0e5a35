"""numba: DOP853 hand-vectorised; LANES trajectories side by side, each with its own time and step.

The lanes' state is one flat array, LANES numbers per quantity, and a step of all lanes is one loop over them
with a straight-line body and selects instead of branches. With constant distances between the quantities the
compiler sees that nothing overlaps and turns the loop into SIMD code. A lane that has finished gets the next
piece of work from the caller.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

from numba import njit

from peers import dop853
from peers.numba_scalar import FAST, compiled, factor, tuple_of

LANES = 16
"""Two AVX-512 registers per quantity: two independent chains hide the latencies of one."""


@dataclass(frozen=True)
class Layout:
    """Where in the array the lanes' t, end, ... begin, and the compiled step."""

    step: Any
    """``step(s, rtol, atol)`` tries one step in every lane; how many crossed (with `level`)."""
    load: Any
    """``load(s, l)``: y, k, n, kn, stages, h, p of the step just made in lane l (only with `level`)."""
    dim: int
    size: int
    t: int
    end: int
    h: int
    most: int
    parameter: int
    crossed: int


@cache
def layout(
    rates: dop853.Rates, dim: int, parameters: int, controlled: int, level: int | None = None
) -> Layout:
    """The step of a system; `level` is a component whose upward passages through zero are marked."""
    names = dop853.names
    rows: dict[str, int] = {}

    def at(name: str) -> str:
        return f"s[{rows.setdefault(name, len(rows)) * LANES} + l]"

    inputs = [*names("y", dim), *names("k0_", dim), *names("p", parameters), "t", "end", "h", "most"]
    body = [f"{name} = {at(name)}" for name in inputs]
    body += ["h = min(h, end - t)"]
    body += dop853.step(rates, dim, parameters, controlled)
    body += [
        "change = factor(err2)",
        "ok = err2 < 1.0",
        f"{at('t')} = t + h if ok else t",
        f"{at('h')} = h * min(most, max(0.2, change))",
        f"{at('most')} = 5.0 if ok else 1.0",
    ]
    if level is not None:
        body += [
            f"hit = 1.0 if (ok and y{level} < 0.0 and n{level} >= 0.0) else 0.0",
            f"{at('crossed')} = hit",
            "hits += hit",
        ]
        stages = [f"k{i}_{c}" for i in range(1, 12) for c in range(dim)]
        body += [f"{at('last_' + name)} = {name}" for name in stages]
        body += [f"{at('last_y' + str(c))} = y{c}" for c in range(dim)]
        body += [f"{at('last_k' + str(c))} = k0_{c}" for c in range(dim)]
        body += [f"{at('last_h')} = h"]
    for c in range(dim):
        body += [
            f"{at(f'y{c}')} = n{c} if ok else y{c}",
            f"{at(f'k0_{c}')} = k12_{c} if ok else k0_{c}",
        ]
    source = (
        "def step(s, rtol, atol):\n    hits = 0.0\n"
        f"    for l in range({LANES}):\n{dop853.indented(body, 2)}\n    return hits\n"
    )
    scope: dict[str, Any] = {"factor": factor}
    exec(source, scope)
    load = None
    if level is not None:
        loaded = [
            [at(f"last_y{c}") for c in range(dim)],
            [at(f"last_k{c}") for c in range(dim)],
            [at(f"y{c}") for c in range(dim)],
            [at(f"k0_{c}") for c in range(dim)],
            [at("last_" + name) for name in stages],
        ]
        result = ", ".join(tuple_of(part) for part in loaded)
        parts = f"{result}, {at('last_h')}, {tuple_of([at(p) for p in names('p', parameters)])}"
        load = compiled("load", "s, l", [], parts)
    return Layout(
        step=njit(**FAST)(scope["step"]),
        load=load,
        dim=dim,
        size=len(rows) * LANES,
        t=rows["t"] * LANES,
        end=rows["end"] * LANES,
        h=rows["h"] * LANES,
        most=rows["most"] * LANES,
        parameter=rows["p0"] * LANES,
        crossed=rows.get("crossed", 0) * LANES,
    )


@cache
def starter(rates: dop853.Rates, dim: int, parameters: int) -> Any:
    """``begin(s, l, y, p)`` puts a trajectory into a lane: its state, rates and parameters."""
    names = dop853.names
    lines = [tuple_of(names("y", dim)) + " = y", tuple_of(names("p", parameters)) + " = p"]
    rows = [*names("y", dim), *rates(names("y", dim), names("p", parameters)), *names("p", parameters)]
    lines += [f"s[{row * LANES} + l] = {value}" for row, value in enumerate(rows)]
    return compiled("begin", "s, l, y, p", lines, "None")
