"""Constants of a law that have no natural zero: places and phases."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from udd.discovery.scoring.coordinates import coordinates
from udd.effects import Effect
from udd.fitting import Fit

_TURN = 2 * np.pi


def shift_ranges(effect: Effect, final: Fit) -> dict[str, float]:
    """Return the places and phases of an effect, each with the range of its coordinate in the motion.

    Such a constant shifts a law along the motion: it is added to a linear function of a place, an angle or
    the time. A law is no simpler if it is zero, in contrast to an amplitude, a rate or a speed. The range of
    an angle is at most a turn.
    """
    result = {p.name: _TURN for p in effect.spec.parameters if p.along == "angle"}
    tree = _tree(getattr(effect.spec, "text", ""))
    if tree is None:
        return result
    moving = _moving(final)
    constants = effect.parameters
    names = [node.id for node in ast.walk(tree) if isinstance(node, ast.Name)]
    for angle, sum_ in _inner_sums(tree):
        summands = list(_summands(sum_))
        shifts = [s.id for s in summands if isinstance(s, ast.Name) and s.id in constants]
        rest = [s for s in summands if not (isinstance(s, ast.Name) and s.id in constants)]
        if len(shifts) != 1 or names.count(shifts[0]) != 1 or shifts[0] in effect.amplitudes or not rest:
            continue
        spans = [_span(s, moving, constants) for s in rest]
        if None not in spans:
            span = sum(s for s in spans if s is not None)
            result[shifts[0]] = min(span, _TURN) if angle else span
    return result


def _tree(text: str) -> ast.expr | None:
    """Parse a formula; None if it is no single expression."""
    try:
        return ast.parse(text.replace("^", "**"), mode="eval").body
    except SyntaxError:
        return None


def _moving(final: Fit) -> dict[str, float]:
    """Return the ranges of places, angles and the time by name; speeds have a natural zero."""
    model, record = final.model, final.record
    placed = set(model.kinematic) or {name for name in model.state_names if name != "Omega"}
    result = {}
    for coordinate in coordinates(model):
        if coordinate.text in placed or coordinate.text == "t":
            result[coordinate.text] = float(np.ptp(coordinate.of(record.t, final.states)))
    return result


def _inner_sums(tree: ast.expr, angle: bool = False, inside: bool = False) -> Iterator[tuple[bool, ast.expr]]:
    """List the sums inside a law, and whether each is within a sine or a cosine."""
    is_sum = isinstance(tree, ast.BinOp) and isinstance(tree.op, (ast.Add, ast.Sub))
    if is_sum and inside:
        yield angle, tree
    is_wave = (
        isinstance(tree, ast.Call) and isinstance(tree.func, ast.Name) and tree.func.id in ("sin", "cos")
    )
    within = inside or not is_sum
    for child in _summands(tree) if is_sum else ast.iter_child_nodes(tree):
        if isinstance(child, ast.expr):
            yield from _inner_sums(child, angle or is_wave, within)


def _summands(node: Any) -> Iterator[ast.expr]:
    """List the summands of a sum, without their signs."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        yield from _summands(node.left)
        yield from _summands(node.right)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.UAdd, ast.USub)):
        yield from _summands(node.operand)
    else:
        yield node


def _span(node: ast.expr, moving: Mapping[str, float], constants: Mapping[str, float]) -> float | None:
    """Return the range of a coordinate times constants; None for anything else."""
    if isinstance(node, ast.Name):
        return moving.get(node.id)
    if not isinstance(node, ast.BinOp) or not isinstance(node.op, (ast.Mult, ast.Div)):
        return None
    for part, factor in ((node.left, node.right), (node.right, node.left)):
        span, value = _span(part, moving, constants), _number(factor, constants)
        if span is not None and value and (part is node.left or isinstance(node.op, ast.Mult)):
            return span * value if isinstance(node.op, ast.Mult) else span / value
    return None


def _number(node: ast.expr, constants: Mapping[str, float]) -> float | None:
    """Return the absolute value of a number or a constant; None for anything else."""
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return abs(float(node.value))
    return abs(constants[node.id]) if isinstance(node, ast.Name) and node.id in constants else None
