"""Straight-line source of one DOP853 step, as an expert would write it by hand for one system.

Every coefficient is a literal (taken from SciPy), zeros are left out, and the state is in scalars: nothing
of a step goes through memory. The same text serves as the body of a scalar function and as the body of a
loop over lanes, which the compiler then turns into SIMD instructions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as table

Rates = Callable[[Sequence[str], Sequence[str]], Sequence[str]]
"""Names of the states and of the parameters to the expressions of the derivatives."""


def dle(y: Sequence[str], p: Sequence[str]) -> list[str]:
    """The diffusionless Lorenz equations."""
    return [f"{y[1]} - {y[0]}", f"{y[0]} * {y[2]}", f"{p[0]} - {y[0]} * {y[1]}"]


def lorenz(y: Sequence[str], p: Sequence[str]) -> list[str]:
    """Lorenz's equations of 1963."""
    return [
        f"{p[0]} * ({y[1]} - {y[0]})",
        f"{y[0]} * ({p[1]} - {y[2]}) - {y[1]}",
        f"{y[0]} * {y[1]} - {p[2]} * {y[2]}",
    ]


def dle_tangent(count: int) -> Rates:
    """The same with this many tangent vectors after the state."""

    def rates(y: Sequence[str], p: Sequence[str]) -> list[str]:
        result = dle(y, p)
        for k in range(1, count + 1):
            u = y[3 * k : 3 * k + 3]
            result += [
                f"{u[1]} - {u[0]}",
                f"{u[0]} * {y[2]} + {y[0]} * {u[2]}",
                f"-({u[0]} * {y[1]} + {y[0]} * {u[1]})",
            ]
        return result

    return rates


def disk(y: Sequence[str], p: Sequence[str]) -> list[str]:
    """The disk; on one side of its kinks the friction coefficient k is p[1] + p[2] Omega."""
    return [
        f"(9.81 * {y[1]} - ({p[1]} + {p[2]} * {y[0]}) * {y[0]} - {y[2]} * {p[0]} * {y[0]})"
        f" / (0.0032 + {y[1]} * {y[1]} + {y[2]} * {y[2]})",
        f"{y[2]} * {y[0]}",
        f"{p[0]} - {y[1]} * {y[0]}",
        f"{y[0]}",
    ]


def names(prefix: str, count: int) -> list[str]:
    return [f"{prefix}{c}" for c in range(count)]


def combination(weights: np.ndarray, c: int) -> str:
    """The weighted sum of the stages' derivatives of component c."""
    return " + ".join(f"({w!r}) * k{i}_{c}" for i, w in enumerate(weights.tolist()) if w)


def step(rates: Rates, dim: int, parameters: int, controlled: int) -> list[str]:
    """From y*, k0_* = f(y), h, p* to n* = the new state, k12_* = f(n), and `err2` = the error's square.

    Only the first `controlled` components take part in the error, in SciPy's norm with rtol, atol.
    """
    p = names("p", parameters)
    lines: list[str] = []
    errors: list[str] = []
    for stage in range(1, 12):
        row = table.A[stage, :stage]
        lines += [f"s{c} = y{c} + h * ({combination(row, c)})" for c in range(dim)]
        lines += [f"k{stage}_{c} = {rate}" for c, rate in enumerate(rates(names("s", dim), p))]
    lines += [f"n{c} = y{c} + h * ({combination(table.B, c)})" for c in range(dim)]
    lines += [f"k12_{c} = {rate}" for c, rate in enumerate(rates(names("n", dim), p))]
    # With the scales multiplied out there is one division instead of one per component.
    for c in range(controlled):
        others = " * ".join([f"scale{j}" for j in range(controlled) if j != c])
        lines += [f"scale{c} = atol + rtol * max(abs(y{c}), abs(n{c}))"]
        five = f"e5_{c} = ({combination(table.E5, c)}) * ({others})"
        three = f"e3_{c} = ({combination(table.E3, c)}) * ({others})"
        errors += [five, three]
    all_scales = " * ".join(f"scale{c}" for c in range(controlled))
    lines += [
        *errors,
        "five = " + " + ".join(f"e5_{c} * e5_{c}" for c in range(controlled)),
        "three = " + " + ".join(f"e3_{c} * e3_{c}" for c in range(controlled)),
        f"scales = {all_scales}",
        f"err2 = h * h * five * five / ((five + 0.01 * three) * (scales * scales * {controlled}.0) + 1e-300)",
    ]
    return lines


def dense(rates: Rates, dim: int, parameters: int) -> list[str]:
    """After `step`: the coefficients f<i>_<c> of the interpolant of order 7 over the step."""
    p = names("p", parameters)
    lines = []
    for extra in range(3):
        stage = 13 + extra
        row = table.A[stage, :stage]
        lines += [f"s{c} = y{c} + h * ({combination(row, c)})" for c in range(dim)]
        lines += [f"k{stage}_{c} = {rate}" for c, rate in enumerate(rates(names("s", dim), p))]
    for c in range(dim):
        lines += [
            f"f0_{c} = n{c} - y{c}",
            f"f1_{c} = h * k0_{c} - f0_{c}",
            f"f2_{c} = 2.0 * f0_{c} - h * (k12_{c} + k0_{c})",
        ]
        lines += [f"f{3 + i}_{c} = h * ({combination(table.D[i], c)})" for i in range(4)]
    return lines


def interpolant(c: int, x: str = "x") -> str:
    """The value of component c at the fraction x of the step."""
    text = f"f6_{c}"
    for i in reversed(range(6)):
        factor = f"(1.0 - {x})" if i % 2 == 0 else x
        text = f"f{i}_{c} + {factor} * ({text})"
    return f"y{c} + {x} * ({text})"


def indented(lines: Sequence[str], depth: int) -> str:
    return "\n".join("    " * depth + line for line in lines)
