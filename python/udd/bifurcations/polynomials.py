"""Systems of polynomials: a model's rates as such, their values, derivatives and deflation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd.models.formula_model import FormulaModel

from .equilibrium_curve import expansion
from .flow_map import Floats, FlowMap

__all__ = ["Polynomials", "numerators_of", "taylor_at"]

_MOST_TERMS = 5000
_MOST_DEGREE = 60
_EPS = float(np.finfo(float).eps)
_SAME = 1e-9  # relative: rates and their Taylor polynomial that differ by less are the same
_PROBES = 6

#: By its exponents, a monomial's coefficient and the sum of the absolute values that it was added up from.
_Terms = dict[tuple[int, ...], tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Polynomials:
    """A system of polynomials.

    Attributes
    ----------
    exponents : ndarray of int, shape (k, n)
        The exponents of the monomials of n variables.
    coefficients : ndarray, shape (m, k)
        Of m equations.
    """

    exponents: NDArray[np.intp]
    coefficients: NDArray[Any]

    @classmethod
    def of(cls, equations: list[Mapping[tuple[int, ...], float]], variables: int) -> Polynomials:
        """Return the system of equations given by their terms."""
        every = sorted({exponents for equation in equations for exponents in equation}) or [(0,) * variables]
        place = {exponents: k for k, exponents in enumerate(every)}
        table = np.zeros((len(equations), len(every)))
        for row, equation in zip(table, equations, strict=True):
            for exponents, coefficient in equation.items():
                row[place[exponents]] += coefficient
        return cls(np.array(every, dtype=np.intp).reshape(-1, variables), table)

    @property
    def variables(self) -> int:
        """The number of variables."""
        return int(self.exponents.shape[1])

    @cached_property
    def degrees(self) -> NDArray[np.intp]:
        """The degree of each equation, 0 for constants."""
        total = self.exponents.sum(axis=1)
        degrees: NDArray[np.intp] = np.where(self.coefficients != 0.0, total, 0).max(axis=1)
        return degrees

    @cached_property
    def _slopes(self) -> tuple[NDArray[np.intp], NDArray[Any]]:
        """Monomials of the derivatives, and their coefficients (m, n, k)."""
        n = self.variables
        lower, factors = [], []
        for j in range(n):
            less = self.exponents.copy()
            less[:, j] -= 1
            lower.append(np.maximum(less, 0))
            factors.append(self.exponents[:, j])
        every, place = np.unique(np.concatenate(lower), axis=0, return_inverse=True)
        place = place.reshape(n, -1)
        table = np.zeros((len(self.coefficients), n, len(every)), dtype=self.coefficients.dtype)
        for j in range(n):
            for k, (where, factor) in enumerate(zip(place[j], factors[j], strict=True)):
                table[:, j, where] += factor * self.coefficients[:, k]
        return every, table

    def values(self, x: NDArray[Any]) -> NDArray[Any]:
        """Values (..., m) at points (..., n)."""
        values: NDArray[Any] = _monomials(self.exponents, x) @ self.coefficients.T
        return values

    def slopes(self, x: NDArray[Any]) -> NDArray[Any]:
        """Derivatives (..., m, n) at points (..., n)."""
        every, table = self._slopes
        slopes: NDArray[Any] = np.einsum("...k,mnk->...mn", _monomials(every, x), table)
        return slopes

    def sizes(self, x: NDArray[Any]) -> NDArray[Any]:
        """Return the sums of the absolute values of the terms (..., m), of which rounding leaves a part."""
        sizes: NDArray[Any] = _monomials(self.exponents, np.abs(x)) @ np.abs(self.coefficients).T
        return sizes

    def scaled(self, size: Floats) -> Polynomials:
        """Return the system in units of `size`, each equation in units of its largest coefficient."""
        table = self.coefficients * np.prod(size**self.exponents, axis=1)
        largest = np.abs(table).max(axis=1, keepdims=True)
        return Polynomials(self.exponents, table / np.where(largest > 0.0, largest, 1.0))

    def shifted(self, x: Floats) -> Polynomials:
        """Return the system as polynomials of the distance from a point, in the same units."""
        equations: list[Mapping[tuple[int, ...], float]] = []
        for row in self.coefficients:
            whole: dict[tuple[int, ...], float] = {}
            for exponents, coefficient in zip(self.exponents, row, strict=True):
                if coefficient == 0.0:
                    continue
                # The binomials of each variable, multiplied out.
                for lower in product(*(range(e + 1) for e in exponents.tolist())):
                    ways = math.prod(map(math.comb, exponents.tolist(), lower))
                    factor = float(np.prod(x ** (exponents - np.array(lower))))
                    whole[lower] = whole.get(lower, 0.0) + coefficient * ways * factor
            equations.append(whole)
        return Polynomials.of(equations, self.variables)

    def homogeneous(self) -> Polynomials:
        """Return the homogeneous system: a variable in front gives all terms the same degree."""
        equations: list[Mapping[tuple[int, ...], float]] = []
        for row, degree in zip(self.coefficients, self.degrees, strict=True):
            terms = {}
            for exponents, coefficient in zip(self.exponents, row, strict=True):
                if coefficient != 0.0:
                    terms[(int(degree - exponents.sum()), *map(int, exponents))] = coefficient
            equations.append(terms)
        return Polynomials.of(equations, self.variables + 1)

    def deflated(self, matrix: Floats, row: Floats) -> Polynomials:
        """These equations with those of a null vector of their derivatives.

        The vector is ``matrix @ v``, with new variables v and ``row @ v = 1``: at a multiple root of the
        system the new one has a root of lower multiplicity (A. Leykin, J. Verschelde and A. Zhao,
        Theoretical Computer Science 359 (2006) 111).
        """
        n, added = matrix.shape
        equations: list[Mapping[tuple[int, ...], float]] = []
        none = (0,) * added
        for own in self.coefficients:
            equations.append({(*map(int, e), *none): c for e, c in zip(self.exponents, own, strict=True)})
        every, table = self._slopes
        units = [tuple(int(i == k) for i in range(added)) for k in range(added)]
        for slope in table:
            terms: dict[tuple[int, ...], float] = {}
            for exponents, along in zip(every, slope.T @ matrix, strict=True):
                for unit, coefficient in zip(units, along, strict=True):
                    terms[(*map(int, exponents), *unit)] = float(coefficient)
            equations.append(terms)
        last = {(*(0,) * n, *unit): float(c) for unit, c in zip(units, row, strict=True)}
        equations.append(last | {(0,) * (n + added): -1.0})
        return Polynomials.of(equations, n + added)


def _monomials(exponents: NDArray[np.intp], x: NDArray[Any]) -> NDArray[Any]:
    """Return the monomials (..., k) at points (..., n)."""
    powers = np.ones((int(exponents.max(initial=0)) + 1, *x.shape), dtype=x.dtype)
    for d in range(1, len(powers)):
        powers[d] = powers[d - 1] * x
    result = np.ones((*x.shape[:-1], len(exponents)), dtype=x.dtype)
    for j in range(exponents.shape[1]):
        result = result * np.moveaxis(powers[exponents[:, j], ..., j], 0, -1)
    return result


def numerators_of(flow: FlowMap) -> tuple[Polynomials, Polynomials] | None:
    """Return the rates' numerators and denominators as polynomials of the reduced state, or None."""
    model = flow.model
    if any(model.state_names[k] in model.angles for k in flow.kept):
        return None
    if not isinstance(model, FormulaModel):
        own = _cubic(flow)
        return None if own is None else (own, _ones(flow.dim))
    if model.inputs or model.names_time:
        return None
    text = model._own
    values = list(model.parameters.values())
    places = {name: flow.kept.tolist().index(k) for k, name in enumerate(text.states) if k in flow.kept}
    pairs = []
    for k in flow.kept:
        operations = _core.formula_operations(text.equations[k], text.states, text.parameters)
        pair = _fraction(operations, [places.get(name, -1) for name in text.states], values, flow.dim)
        if pair is None:
            return None
        pairs.append(pair)
    above, below = (
        [{e: c for e, (c, _) in one.items()} for one in side] for side in zip(*pairs, strict=True)
    )
    return Polynomials.of(list(above), flow.dim), Polynomials.of(list(below), flow.dim)


def _ones(n: int) -> Polynomials:
    return Polynomials.of([{(0,) * n: 1.0} for _ in range(n)], n)


def _cubic(flow: FlowMap) -> Polynomials | None:
    """Return the rates as polynomials of at most the third degree, or None."""
    probes = flow.size * np.random.default_rng(9).uniform(-2.0, 2.0, (_PROBES, flow.dim))
    try:
        taylor = taylor_at(flow, flow.values, np.zeros(flow.dim))
        rates = flow.rates(flow.values, probes, np.zeros(_PROBES))
    except ValueError:
        return None
    if not (np.isfinite(taylor.coefficients).all() and np.isfinite(rates).all()):
        return None
    if len(expansion(flow, flow.values, probes[0]).surfaces):
        return None
    return taylor if (np.abs(taylor.values(probes) - rates) <= _SAME * taylor.sizes(probes)).all() else None


def taylor_at(flow: FlowMap, values: Floats, x: Floats) -> Polynomials:
    """Return the rates' Taylor polynomials of the third degree about a reduced state."""
    here, n = expansion(flow, values, x, higher=True), flow.dim
    equations: list[Mapping[tuple[int, ...], float]] = []
    for i in range(n):
        terms = {(0,) * n: float(here.rate[i])}
        for degree, table in ((1, here.by_state[i]), (2, here.second[i] / 2.0), (3, here.third[i] / 6.0)):
            for place in product(range(n), repeat=degree):
                key = tuple(place.count(j) for j in range(n))
                if table[place] != 0.0:
                    terms[key] = terms.get(key, 0.0) + float(table[place])
        equations.append(terms)
    return Polynomials.of(equations, n)


def _fraction(
    operations: list[tuple[str, int, float]], places: list[int], values: list[float], n: int
) -> tuple[_Terms, _Terms] | None:
    """Return a formula as one polynomial over another, or None."""
    zero: tuple[int, ...] = (0,) * n
    stack: list[tuple[_Terms, _Terms]] = []
    unit: _Terms = {zero: (1.0, 1.0)}
    for name, takes, number in operations:
        taken = [stack.pop() for _ in range(takes)][::-1]
        fraction: tuple[_Terms, _Terms] | None
        if name in ("number", "parameter"):
            value = number if name == "number" else values[int(number)]
            fraction = ({zero: (value, abs(value))} if value else {}), unit
        elif name == "state":
            k = places[int(number)]
            fraction = None if k < 0 else ({tuple(int(i == k) for i in range(n)): (1.0, 1.0)}, unit)
        else:
            fraction = _combined(name, taken, number, unit)
        if fraction is None or max(map(len, fraction)) > _MOST_TERMS:
            return None
        if any(sum(exponents) > _MOST_DEGREE for side in fraction for exponents in side):
            return None
        stack.append(fraction)
    return stack[-1]


def _combined(
    name: str, taken: list[tuple[_Terms, _Terms]], number: float, unit: _Terms
) -> tuple[_Terms, _Terms] | None:
    """Apply an operation to fractions."""
    if name == "^":
        power = number
        if len(taken) == 2:
            top, bottom = taken[1]
            if any(map(any, top)) or bottom != unit:
                return None
            power = next(iter(top.values()))[0] if top else 0.0
        if power != round(power) or abs(power) > _MOST_DEGREE:
            return None
        above, below = taken[0]
        if power < 0:
            above, below = below, above
        result = unit, unit
        for _ in range(abs(round(power))):
            result = _times(result[0], above), _times(result[1], below)
        return result if result[1] else None
    if len(taken) == 1:
        return (_times(taken[0][0], dict.fromkeys(unit, (-1.0, 1.0))), taken[0][1]) if name == "-" else None
    if len(taken) != 2 or name not in ("+", "-", "*", "/"):
        return None
    (a, b), (c, d) = taken
    if name == "*":
        return _times(a, c), _times(b, d)
    if name == "/":
        return (_times(a, d), _times(b, c)) if c else None
    if name == "-":
        c = {e: (-value, size) for e, (value, size) in c.items()}
    return (_plus(a, c), b) if b == d else (_plus(_times(a, d), _times(c, b)), _times(b, d))


def _plus(a: _Terms, b: _Terms) -> _Terms:
    result = dict(a)
    for e, (value, size) in b.items():
        before = result.get(e, (0.0, 0.0))
        result[e] = before[0] + value, before[1] + size
    # Terms that cancel but for rounding are zero.
    return {e: (value, size) for e, (value, size) in result.items() if abs(value) > 8.0 * _EPS * size}


def _times(a: _Terms, b: _Terms) -> _Terms:
    if len(a) * len(b) > _MOST_TERMS * 20:
        return {(_MOST_DEGREE + 1,) * len(next(iter(a))): (1.0, 1.0)}  # refused by the caller
    result: _Terms = {}
    for e, (x, size) in a.items():
        for f, (y, other) in b.items():
            key = tuple(map(sum, zip(e, f, strict=True)))
            before = result.get(key, (0.0, 0.0))
            result[key] = before[0] + x * y, before[1] + size * other
    return {e: (value, size) for e, (value, size) in result.items() if abs(value) > 8.0 * _EPS * size}
