"""Short formulas in one variable: read, evaluated, simplified, written in the text grammar of effects.

A formula is a nested tuple: ``("x",)``, a literal ``("n", value)``, a constant to be fitted
``("c", number)``, a function ``("tanh", argument)`` or an operation ``("+", a, b)``. The core reads
text.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd._core import formula_operations

Array = NDArray[np.float64]
Node = tuple[Any, ...]

_BINARY: dict[str, Callable[[Any, Any], Any]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "^": np.power,
}
_UNARY: dict[str, Callable[[Any], Any]] = {
    "sin": np.sin,
    "cos": np.cos,
    "tanh": np.tanh,
    "exp": np.exp,
    "ln": np.log,
    "abs": np.abs,
    "sqrt": np.sqrt,
    "ramp": lambda value: np.maximum(value, 0.0),
}
_RANK = {"+": 1, "-": 1, "*": 2, "/": 2, "^": 4}

X: Node = ("x",)


def read(text: str, names: dict[str, Node]) -> tuple[Node, list[float]]:
    """Parse a formula by the core's grammar; its numbers become constants to fit, with these start values.

    Whole exponents stay literal, and arithmetic on numbers alone is done at once. A square root becomes a
    power with an exponent that can be fitted.

    Raises
    ------
    ValueError
        The text has a name or an operation that such formulas do not have.
    """
    values: list[float] = []
    stack: list[Node] = []
    nodes = list(names.values())

    def constant(value: float) -> Node:
        values.append(value)
        return ("c", len(values) - 1)

    for name, takes, number in formula_operations(text, list(names)):
        taken = stack[len(stack) - takes :]
        del stack[len(stack) - takes :]
        match name, taken:
            case "state", []:
                made = nodes[int(number)]
            case "number", []:
                made = constant(number)
            case "-", [operand]:
                made = ("*", ("n", -1.0), operand)
            case "^", [operand]:
                made = ("^", operand, ("n", number))
            case "sqrt", [operand]:
                made = ("^", operand, constant(0.5))
            case _ if name in (_UNARY if takes == 1 else _BINARY):
                made = (name, *taken)
            case _:
                raise ValueError(f"the formula has {name}, which cannot be fitted to a curve")
        stack.append(made)
    return stack[0], values


def evaluate(node: Node, x: Array, values: Sequence[float | Array]) -> Array:
    """Evaluate the formula; not finite where it is undefined.

    Constants may be columns (rows, 1): each row of the result then has its own values.
    """
    with np.errstate(all="ignore"):
        value = _value(node, x, values)
    result: Array = np.array(np.broadcast_to(value, np.broadcast_shapes(np.shape(value), x.shape)))
    return result


def _value(node: Node, x: Array, values: Sequence[float | Array]) -> Any:
    """Evaluate a part of the formula; a number if it is constant."""
    kind = node[0]
    if kind == "x":
        return x
    if kind in ("n", "c"):
        return node[1] if kind == "n" else values[node[1]]
    inner = [_value(part, x, values) for part in node[1:]]
    return (_UNARY.get(kind) or _BINARY[kind])(*inner)


def constants(node: Node) -> list[int]:
    """Return the numbers of its constants, in order of appearance."""
    return list(dict.fromkeys(part[1] for part in parts(node) if part[0] == "c"))


def parts(node: Node) -> Iterator[Node]:
    """Yield the formula and all of its parts."""
    yield node
    if node[0] not in ("x", "n", "c"):
        for part in node[1:]:
            yield from parts(part)


def exponents(node: Node) -> set[int]:
    """Return the numbers of the constants that are exponents."""
    return {part[2][1] for part in parts(node) if part[0] == "^" and part[2][0] == "c"}


def amplitudes(node: Node) -> set[int]:
    """Return the numbers of constants to which the formula is jointly proportional; none if it is not."""
    if node[0] == "c":
        return {node[1]}
    if node[0] in "+-":
        left, right = amplitudes(node[1]), amplitudes(node[2])
        return left | right if left and right else set()
    if node[0] == "*":
        return amplitudes(node[1]) or amplitudes(node[2])
    return amplitudes(node[1]) if node[0] == "/" else set()


def rewritten(node: Node, rule: Callable[[Node], Node | None]) -> Node:
    """Replace parts of the formula by what a rule returns for them; if that is None, try their parts."""
    made = rule(node)
    if made is not None or node[0] in ("x", "n", "c"):
        return node if made is None else made
    return (node[0], *(rewritten(part, rule) for part in node[1:]))


def scaled(node: Node, scale: float, values: list[float]) -> Node:
    """Rewrite the formula for ``x / scale``, every scale a constant; new ones are appended to `values`."""

    def multiple(part: Node) -> Node | None:
        if part != X:
            return None
        values.append(1.0 / scale)
        return ("*", ("c", len(values) - 1), X)

    return rewritten(node, multiple)


def sensible(node: Node, angle: bool = False) -> bool:
    """Return True if a reader would accept the formula as a law.

    It has no nested functions, no variable in an exponent, and no dimensional variable alone in a function.
    The sine and cosine of an angle are its coordinates, so functions may contain them.
    """
    curved = ("sin", "cos", "tanh", "exp", "ln")

    def nested(inner: Node) -> bool:
        coordinate = inner[0] in ("sin", "cos") and all(part[0] in "xc+-" for part in parts(inner[1]))
        return inner[0] in curved and not (angle and coordinate)

    for part in parts(node):
        if part[0] == "^" and any(inner[0] == "x" for inner in parts(part[2])):
            return False
        if part[0] in curved and any(nested(inner) for inner in parts(part[1])):
            return False
        if part[0] in curved and part[1] == X and not angle:
            return False
    return True


def without_sign(node: Node) -> Node:
    """Rewrite the formula for a variable that is never negative."""
    return rewritten(node, lambda part: X if part == ("abs", X) else None)


def softened(node: Node, width: float) -> Node:
    """Round off broken powers within a width of zero, where their slope is infinite."""

    def soft(part: Node) -> Node | None:
        if part[0] != "^" or (part[2][0] == "n" and float(part[2][1]).is_integer()):
            return None
        base = part[1][1] if part[1][0] == "abs" else part[1]
        return ("^", ("sqrt", ("+", ("^", softened(base, width), ("n", 2.0)), ("n", width**2))), part[2])

    return rewritten(node, soft)


def put(node: Node, number: int, value: float) -> Node:
    """Replace a constant by a literal."""
    return rewritten(node, lambda part: ("n", value) if part == ("c", number) else None)


def simplify(node: Node, values: list[float]) -> Node:
    """Simplify the formula; constants that only appear together are merged.

    New constants are appended to `values`.
    """
    if node[0] in ("x", "n", "c"):
        return node
    inner = [simplify(part, values) for part in node[1:]]
    if all(part[0] in ("n", "c") for part in inner):
        value = float(evaluate((node[0], *inner), np.zeros(1), values)[0])
        if all(part[0] == "n" for part in inner):
            return ("n", value)
        values.append(value)
        return ("c", len(values) - 1)
    if node[0] in _UNARY:
        return inner[0] if node[0] == "abs" and inner[0][0] == "abs" else (node[0], *inner)
    return _shorter(node[0], inner[0], inner[1], values)


def _is(node: Node, value: float) -> bool:
    return node[0] == "n" and bool(node[1] == value)


def _shorter(kind: str, a: Node, b: Node, values: list[float]) -> Node:
    """Simplify an operation on simple parts."""
    if (kind in "+-" and _is(b, 0.0)) or (kind in "*/^" and _is(b, 1.0)):
        return a
    if (kind == "+" and _is(a, 0.0)) or (kind == "*" and _is(a, 1.0)):
        return b
    if (kind in "*/" and _is(a, 0.0)) or (kind == "*" and _is(b, 0.0)):
        return ("n", 0.0)
    if kind == "^" and _is(b, 0.0):
        return ("n", 1.0)
    if kind == a[0] == "^" and all(part[0] == "n" and float(part[1]).is_integer() for part in (a[2], b)):
        return ("^", a[1], ("n", a[2][1] * b[1]))
    number = ("n", "c")
    if kind in "+*" and b[0] in number:
        a, b = b, a  # numbers come first
    if kind in "+*" and a[0] in number and b[0] == kind and b[1][0] in number:
        return _shorter(kind, simplify((kind, a, b[1]), values), b[2], values)
    if kind == "-" and b[0] in number:
        return _shorter("+", simplify(("*", ("n", -1.0), b), values), a, values)
    if kind == "/" and b[0] in number:
        return _shorter("*", simplify(("/", ("n", 1.0), b), values), a, values)
    return (kind, a, b)


def description_length(node: Node) -> float:
    """Compute the formula's description length in nats, without its constants' values.

    Each of its k operations, functions and variables is one of the n different ones in it: k ln n.
    """
    kinds = ["*" if part[0] == "/" else "+" if part[0] == "-" else part[0] for part in parts(node)]
    operations = [kind for kind in kinds if kind not in ("n", "c")]
    return len(operations) * math.log(max(len(set(operations)), 2))


def length(node: Node) -> int:
    """Count operations, functions and variables."""
    return sum(part[0] not in ("n", "c") for part in parts(node))


def is_single_term(node: Node) -> bool:
    """Return True if a formula is one term: a factor times one function of its coordinate, or one wave.

    No operation joins two parts that both depend on the coordinate, except the sine and the cosine of one
    angle, and products that are a power, as ``x*abs(x)``. No constant is added to the term.
    """
    if node[0] in ("+", "-"):
        waves = {_wave(part) for part in node[1:]}
        return any(waves == {("sin", angle), ("cos", angle)} for angle in _angles(node))
    joined = (part for part in parts(node) if len(part) == 3 and all(_varies(p) for p in part[1:]))
    return all(_is_power(part) for part in joined)


def _is_power(node: Node) -> bool:
    """Return True for a product of powers of the coordinate, of its absolute value, and of constants."""
    if node[0] == "^":
        return _is_power(node[1]) and not _varies(node[2])
    return node[0] in ("x", "n", "c") or (node[0] in ("abs", "*", "/") and all(map(_is_power, node[1:])))


def _varies(node: Node) -> bool:
    return X in parts(node)


def _angles(node: Node) -> list[Node]:
    return [part[1] for part in parts(node) if part[0] in ("sin", "cos")]


def _wave(node: Node) -> tuple[str, Node] | None:
    """Return the function and the angle of a constant times a sine or a cosine."""
    if node[0] == "*" and not _varies(node[1]) and node[2][0] in ("sin", "cos"):
        return node[2][0], node[2][1]
    return None


def shape(node: Node) -> str:
    """Write the formula without its constants' values, for comparison."""
    return write(node, "x", dict.fromkeys(constants(node), "c"))


def write(node: Node, variable: str, names: Mapping[int, str]) -> str:
    """Write the formula in the text grammar, its constants by these names."""
    return _text(node, variable, names)[0]


def _text(node: Node, variable: str, names: Mapping[int, str]) -> tuple[str, int]:
    """Write text and return its operator precedence."""
    kind = node[0]
    if kind == "x":
        return variable, 5
    if kind == "n":
        return f"{node[1]:.10g}", 5 if node[1] >= 0 else 0
    if kind == "c":
        return names[node[1]], 5
    if kind == "ramp":
        return f"max({_text(node[1], variable, names)[0]}, 0)", 5
    if kind in _UNARY:
        return f"{kind}({_text(node[1], variable, names)[0]})", 5
    rank = _RANK[kind]
    left, right = (_text(part, variable, names) for part in node[1:])
    # Operators of equal rank bind to the left, but powers are bracketed on both sides.
    a = left[0] if left[1] >= rank + (kind == "^") else f"({left[0]})"
    b = right[0] if right[1] > rank - (kind in "+*") else f"({right[0]})"
    gap = "" if kind == "^" else " "
    return f"{a}{gap}{kind}{gap}{b}", rank
