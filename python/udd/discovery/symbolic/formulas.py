"""Short formulas for a curve, compared with the curve itself."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import least_squares

from udd.discovery.nonparametric.curve_scan import Curve
from udd.discovery.thresholds import EVIDENCE_MARGIN

from .expressions import (
    Node,
    amplitudes,
    constants,
    description_length,
    evaluate,
    exponents,
    put,
    rewritten,
    sensible,
    shape,
    simplify,
    without_sign,
    write,
)
from .formula_proposals import powers, regression, usual

Array = NDArray[np.float64]

_MOST = 12  # formulas that are shortened
# Share of the curve's evidence that a formula must have: the score's linearisation may cost the rest.
_SHARE = 0.95
_FAR = 40.0  # nats below that share, beyond which shortening cannot rescue a formula
_HUGE = 1e6
_STEP = math.sqrt(np.finfo(float).eps)  # relative step of a constant in difference quotients
# places of the curve at which formulas are fitted, and at which they are tested
_POSITIONS, _BETWEEN = 160, 223
_MOST_CONSTANTS = 12
_NAMES = "abcdpqrsuvwzfghjklmn"  # names of constants; enough even if a model's states use some
_EXPONENTS = (1.0, 1.5, 2.0, 2.5, 3.0, 0.5, -1.0)
#: Coordinates that are never negative.
_POSITIVE = ("|Omega|", "R")


@dataclass(frozen=True)
class Formula:
    """Formula for a curve.

    Attributes
    ----------
    text : str
        Formula in the grammar of effects. Its constants have names.
    parameters : dict of str to float
        Values of the constants. They are in SI units.
    amplitudes : tuple of str
        Constants to which the formula is jointly proportional.
    nats : float
        Log evidence relative to the smooth curve, minus the cost of its length and constants.
    node : tuple
        See :mod:`udd.discovery.symbolic.expressions`.
    variable : str
        Name of its coordinate.
    """

    text: str
    parameters: dict[str, float]
    amplitudes: tuple[str, ...]
    nats: float
    node: Node
    variable: str

    def values(self, x: Array) -> Array:
        """Evaluate the formula at places of the curve's coordinate."""
        return evaluate(self.node, np.asarray(x, dtype=np.float64), list(self.parameters.values()))


def formulas_for(
    curve: Curve, observations: int, seed: int = 0, taken: Collection[str] = ()
) -> list[Formula]:
    """Search short formulas for a curve of one coordinate by regression and by usual forms.

    Usual forms (powers, steps, bumps, waves) and those from symbolic regression (pyoperon, if installed) are
    fitted to the curve's coefficients with their full information, which accounts for confounding with the
    free parameters. Each constant has its cost in the Bayesian information criterion, each operation its
    description length. Needless constants are removed. Constants get none of the names that are `taken`:
    those of a model's states. The most probable formula comes first; those that are less probable by
    `EVIDENCE_MARGIN` are dropped.
    """
    if len(curve.coordinates) != 1:
        return []
    target = _Target(curve, observations)
    regressed = regression(curve, _MOST_CONSTANTS, seed)
    trials = []
    for node, values in itertools.chain(usual(curve), regressed):
        node = simplify(without_sign(node) if curve.coordinates[0].name in _POSITIVE else node, values)
        fitted = target.fit(node, values) if target.takes(node) else None
        if fitted is not None:
            trials.append(fitted)
    least = _SHARE * curve.evidence - _FAR
    shortlist = [candidate for candidate in _different(trials, target.x) if candidate.nats > least][:_MOST]
    ranked = _different([target.shorten(candidate) for candidate in shortlist], target.x)
    formulas = [_formula(curve, candidate, taken) for candidate in ranked]
    best = max((candidate.nats for candidate in formulas), default=-math.inf)
    return [candidate for candidate in formulas if candidate.nats > best - EVIDENCE_MARGIN]


def power_for(curve: Curve, observations: int, taken: Collection[str] = ()) -> Formula | None:
    """Fit a power with a free exponent to a curve; None if no fit succeeds, or over a periodic angle.

    It is the rival of every law that grows with its coordinate.
    """
    if curve.splines[0].periodic:
        return None
    target = _Target(curve, observations)
    positive = curve.coordinates[0].name in _POSITIVE
    trials = (target.fit(without_sign(node) if positive else node, values) for node, values in powers(curve))
    best = max(filter(None, trials), key=lambda candidate: candidate.nats, default=None)
    return None if best is None else _formula(curve, best, taken)


def without(formula: Formula, name: str) -> Formula | None:
    """Return a formula without the term of one of its amplitudes; None if nothing would remain."""
    names = list(formula.parameters)
    values = list(formula.parameters.values())
    if name not in formula.amplitudes:
        return None
    node = simplify(put(formula.node, names.index(name), 0.0), values)
    # Merged constants have no name.
    if not amplitudes(node) or max(constants(node)) >= len(names):
        return None
    return _called(dict(enumerate(names)), node, values, formula.nats, formula.variable)


@dataclass(frozen=True)
class _Fitted:
    """Formula with fitted constants and its log evidence relative to no curve."""

    nats: float
    node: Node
    values: list[float]


def _different(trials: list[_Fitted], x: Array) -> list[_Fitted]:
    """Sort formulas by evidence and drop equivalent ones."""
    kept: list[tuple[_Fitted, Array]] = []
    shapes: set[str] = set()
    for candidate in sorted(trials, key=lambda f: -round(f.nats, 2)):
        made = evaluate(candidate.node, x, candidate.values)
        with np.errstate(invalid="ignore"):  # a formula that is infinite somewhere is equivalent to no other
            same = any(np.abs(made - other).max() < 1e-3 * np.ptp(other) for _, other in kept)
        if not same and shape(candidate.node) not in shapes:
            kept.append((candidate, made))
            shapes.add(shape(candidate.node))
    return [candidate for candidate, _ in kept]


class _Target:
    """The curve's coefficients with their information from the score, as target of formula fits."""

    def __init__(self, curve: Curve, observations: int) -> None:
        places, spline = curve.places[0], curve.splines[0]
        where = np.mod(places, 2 * np.pi) if spline.periodic else places
        information, vectors = eigh(curve.score.information)
        keep = information > 1e-9 * information[-1]
        root = np.sqrt(information[keep])

        def asked(positions: int) -> tuple[Array, Array]:
            """Return places of the curve, and the matrix from values there to coefficients."""
            x = np.quantile(where, (np.arange(positions) + 0.5) / positions)
            design = spline.design(x)
            # Without data the coefficients continue smoothly.
            weak = 1e-6 * np.trace(design.T @ design) / np.trace(curve.roughness)
            to_coefficients = np.linalg.solve(design.T @ design + weak * curve.roughness, design.T)
            return x, (root[:, None] * vectors[:, keep].T) @ to_coefficients

        self.x, self.matrix = asked(_POSITIONS)
        self.between = asked(_BETWEEN)
        self.target: Array = vectors[:, keep].T @ curve.score.gradient / root
        self.angle = curve.coordinates[0].angle
        self.cost = math.log(observations) / 2

    def takes(self, node: Node) -> bool:
        """Return True if the formula can be a law, which vanishes with its amplitudes."""
        return bool(amplitudes(node)) and sensible(node, self.angle)

    def fit(self, node: Node, values: list[float]) -> _Fitted | None:
        """Fit the formula's constants; None if the fit fails."""
        numbers = constants(node)
        start = np.array([values[k] for k in numbers])
        if len(numbers) > len(self.target) or not np.isfinite(start).all():
            return None

        def residuals(thetas: Array, x: Array, matrix: Array) -> Array:
            """Compute residuals at these places, one row for each column of constants."""
            given: list[float | Array] = list(values)
            for k, column in zip(numbers, thetas, strict=True):
                given[k] = column[:, None]
            made = evaluate(node, x, given)
            there = np.isfinite(made).all(axis=1, keepdims=True)
            off = np.where(there, made, 0.0) @ matrix.T - self.target
            result: Array = np.clip(np.where(there, off, _HUGE), -_HUGE, _HUGE)
            return result

        def residual(theta: Array) -> Array:
            result: Array = residuals(theta[:, None], self.x, self.matrix)[0]
            return result

        def slopes(theta: Array) -> Array:
            """Compute all derivatives from one evaluation."""
            steps = np.where(theta < 0, -_STEP, _STEP) * np.maximum(1.0, np.abs(theta))
            thetas = np.column_stack([theta, theta[:, None] + np.diag(steps)])
            here, *moved = residuals(thetas, self.x, self.matrix)
            return np.column_stack([(there - here) / step for there, step in zip(moved, steps, strict=True)])

        solved = least_squares(
            residual, start, jac=slopes, method="lm", x_scale="jac", max_nfev=40 * len(numbers)
        )
        result = list(values)
        for k, value in zip(numbers, solved.x, strict=True):
            result[k] = float(value)
        gain = float(self.target @ self.target - solved.fun @ solved.fun) / 2
        # A wave that fits only at the fitted places deviates between them.
        between = residuals(solved.x[:, None], *self.between)[0]
        lost = float(between @ between - solved.fun @ solved.fun) / 2
        if lost >= max(gain / 2, EVIDENCE_MARGIN):
            return None
        return _Fitted(gain - self.cost * len(numbers) - description_length(node), node, result)

    def shorten(self, fitted: _Fitted) -> _Fitted:
        """Remove constants one by one while that pays."""
        while shorter := next(self._shorter(fitted), None):
            fitted = shorter
        return fitted

    def _shorter(self, fitted: _Fitted) -> Iterator[_Fitted]:
        """Yield more probable formulas with one constant fewer."""
        powers = exponents(fitted.node)
        for number in constants(fitted.node):
            for value in _EXPONENTS if number in powers else (0.0, 1.0):
                values = list(fitted.values)
                node = simplify(put(fitted.node, number, value), values)
                trial = self.fit(node, values) if self.takes(node) else None
                # A factor has a unit: it may become 1 only if another one replaces it.
                least = self.cost - 0.1 if value == 1.0 and number not in powers else 0.0
                if trial is not None and trial.nats > fitted.nats + least:
                    yield trial


def _formula(curve: Curve, fitted: _Fitted, taken: Collection[str]) -> Formula:
    """Name the constants of a formula for a curve."""
    unused = (name for name in _NAMES if name not in taken)
    names = dict(zip(constants(fitted.node), unused, strict=False))
    variable = curve.coordinates[0].text
    return _called(names, fitted.node, fitted.values, fitted.nats - curve.evidence, variable)


def _called(
    names: Mapping[int, str], node: Node, values: Sequence[float], nats: float, variable: str
) -> Formula:
    """Make a formula whose constants have these names, and are numbered in order of appearance."""
    numbers = constants(node)
    order = {number: ("c", k) for k, number in enumerate(numbers)}
    return Formula(
        text=write(node, variable, names),
        parameters={names[number]: values[number] for number in numbers},
        amplitudes=tuple(names[number] for number in numbers if number in amplitudes(node)),
        nats=nats,
        node=rewritten(node, lambda part: order[part[1]] if part[0] == "c" else None),
        variable=variable,
    )
