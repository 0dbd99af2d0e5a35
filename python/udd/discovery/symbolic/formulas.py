"""A short formula for a curve: what could have made it, weighed against the curve itself."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import least_squares

from udd.discovery.nonparametric.curve_scan import EVIDENCE_MARGIN, Curve

from .expressions import (
    Node,
    amplitudes,
    constants,
    evaluate,
    exponents,
    price,
    put,
    sensible,
    shape,
    simplify,
    without_sign,
    write,
)
from .formula_proposals import powers, regression, usual

Array = NDArray[np.float64]

_MOST = 12  # formulas looked at closely
_FAR = 40.0  # nats below the curve, from which shortening does not bring a formula back
_HUGE = 1e6
_STEP = math.sqrt(np.finfo(float).eps)  # of a constant, to see what it does
_POSITIONS, _BETWEEN = 160, 223  # of the curve, where formulas are fitted, and where they are asked again
_MOST_CONSTANTS = 12
_NAMES = "abcdpqrsuvwzfghjklmn"  # of constants; enough where a model's states have taken some
_EXPONENTS = (1.0, 1.5, 2.0, 2.5, 3.0, 0.5, -1.0)
#: Coordinates that are never negative.
_POSITIVE = ("|Omega|", "R")


@dataclass(frozen=True)
class Formula:
    """A formula for a curve.

    Attributes
    ----------
    text : str
        In the grammar of effects, its constants by name.
    parameters : dict of str to float
        The constants' values, SI units.
    amplitudes : tuple of str
        Those to which it is proportional, taken together.
    nats : float
        By how much the formula, its length and constants paid for, is more likely than the smooth curve.
    node : tuple
        See :mod:`udd.discovery.symbolic.expressions`.
    variable : str
        What its coordinate is called.
    """

    text: str
    parameters: dict[str, float]
    amplitudes: tuple[str, ...]
    nats: float
    node: Node
    variable: str

    def values(self, x: Array) -> Array:
        """The formula at places of the curve's coordinate."""
        return evaluate(self.node, np.asarray(x, dtype=np.float64), list(self.parameters.values()))


@dataclass(frozen=True)
class Formulas:
    """What could have made a curve.

    Attributes
    ----------
    formulas : list of Formula
        The most likely first.
    identified : bool
        Whether the first is at most 10 nats less likely than the curve.
    note : str
        What could not be tried; empty otherwise.
    """

    formulas: list[Formula]
    identified: bool
    note: str


def formulas_for(curve: Curve, observations: int, seed: int = 0, taken: Collection[str] = ()) -> Formulas:
    """Short formulas for a curve of one coordinate.

    Usual forms (powers, steps, bumps, waves) and those that symbolic regression comes upon (pyoperon, where
    it is installed) are fitted to the curve's coefficients with their full information, which knows what the
    free parameters would take up; each constant is charged as the Bayesian information criterion does, and
    each operation by its description length. Needless constants are taken out again.

    Parameters
    ----------
    curve : Curve
    observations : int
        Numbers in the record.
    seed : int
        Of the regression.
    taken : collection of str
        Names that constants may not have: a model's states'.
    """
    if len(curve.coordinates) != 1:
        return Formulas([], False, "no formula is sought for a surface")
    target = _Target(curve, observations)
    found, note = regression(curve, _MOST_CONSTANTS, seed)
    trials = []
    for node, values in itertools.chain(usual(curve), found):
        node = simplify(without_sign(node) if curve.coordinates[0].name in _POSITIVE else node, values)
        fitted = target.fit(node, values) if target.takes(node) else None
        if fitted is not None:
            trials.append(fitted)
    near = [one for one in _different(trials, target.x) if one.nats > curve.evidence - _FAR][:_MOST]
    ranked = _different([target.shorten(one) for one in near], target.x)
    free = [name for name in _NAMES if name not in taken]
    formulas = [_formula(curve, one, free) for one in ranked]
    best = max((one.nats for one in formulas), default=-math.inf)
    return Formulas(
        [one for one in formulas if one.nats > best - EVIDENCE_MARGIN], best > -EVIDENCE_MARGIN, note
    )


def power_for(curve: Curve, observations: int, taken: Collection[str] = ()) -> Formula | None:
    """Fit a power with a free exponent to a curve; None where none can be fitted.

    It is the rival of every law that grows with its coordinate.

    Parameters
    ----------
    curve, observations, taken
        As for :func:`formulas_for`.
    """
    target = _Target(curve, observations)
    positive = curve.coordinates[0].name in _POSITIVE
    trials = []
    for node, values in powers(curve):
        fitted = target.fit(without_sign(node) if positive else node, values)
        if fitted is not None:
            trials.append(fitted)
    best = max(trials, key=lambda one: one.nats, default=None)
    if best is None:
        return None
    return _formula(curve, best, [name for name in _NAMES if name not in taken])


def without(formula: Formula, name: str) -> Formula | None:
    """Return a formula without the term of one of its amplitudes; None where nothing would be left."""
    names = list(formula.parameters)
    values = list(formula.parameters.values())
    if name not in formula.amplitudes:
        return None
    node = simplify(put(formula.node, names.index(name), 0.0), values)
    left = [names[k] for k in constants(node) if k < len(names)]
    if not left or len(left) != len(constants(node)) or not amplitudes(node):
        return None
    order = {names.index(one): k for k, one in enumerate(left)}
    shorter = _renumbered(node, order)
    linear = tuple(one for one in left if order[names.index(one)] in amplitudes(shorter))
    variable = formula.variable
    text = write(shorter, variable, dict(enumerate(left)))
    return Formula(
        text, {one: formula.parameters[one] for one in left}, linear, formula.nats, shorter, variable
    )


@dataclass(frozen=True)
class _Fitted:
    """A formula with fitted constants and its nats over no curve."""

    nats: float
    node: Node
    values: list[float]


def _different(trials: list[_Fitted], x: Array) -> list[_Fitted]:
    """The best first; of those that say the same only the best."""
    kept: list[tuple[_Fitted, Array]] = []
    shapes: set[str] = set()
    for one in sorted(trials, key=lambda f: -round(f.nats, 2)):
        made = evaluate(one.node, x, one.values)
        with np.errstate(invalid="ignore"):  # one that is infinite somewhere is like no other
            same = any(np.abs(made - other).max() < 1e-3 * np.ptp(other) for _, other in kept)
        if not same and shape(one.node) not in shapes:
            kept.append((one, made))
            shapes.add(shape(one.node))
    return [one for one, _ in kept]


class _Target:
    """The curve's coefficients as the score knows them, for formulas to be fitted to."""

    def __init__(self, curve: Curve, observations: int) -> None:
        places, spline = curve.places[0], curve.splines[0]
        where = np.mod(places, 2 * np.pi) if spline.periodic else places
        information, vectors = eigh(curve.score.information)
        keep = information > 1e-9 * information[-1]
        root = np.sqrt(information[keep])

        def asked(positions: int) -> tuple[Array, Array]:
            """Places of the curve, and what takes values there to coefficients."""
            x = np.quantile(where, (np.arange(positions) + 0.5) / positions)
            design = spline.design(x)
            # Where there are no data the coefficients go on smoothly.
            weak = 1e-6 * np.trace(design.T @ design) / np.trace(curve.roughness)
            to_coefficients = np.linalg.solve(design.T @ design + weak * curve.roughness, design.T)
            return x, (root[:, None] * vectors[:, keep].T) @ to_coefficients

        self.x, self.matrix = asked(_POSITIONS)
        self.between = asked(_BETWEEN)
        self.target: Array = vectors[:, keep].T @ curve.score.gradient / root
        self.angle = curve.coordinates[0].angle
        self.price = math.log(observations) / 2

    def takes(self, node: Node) -> bool:
        """Whether it would make a law, which is absent where its amplitudes are zero."""
        return bool(amplitudes(node)) and sensible(node, self.angle)

    def fit(self, node: Node, values: list[float]) -> _Fitted | None:
        """The formula with fitted constants; none where it cannot be fitted."""
        numbers = constants(node)
        start = np.array([values[k] for k in numbers])
        if len(numbers) > len(self.target) or not np.isfinite(start).all():
            return None

        def residuals(thetas: Array, x: Array, matrix: Array) -> Array:
            """At these places, a row for each column of constants."""
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
            """All of them from one evaluation."""
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
        # A wave that fits only the places where it was fitted does otherwise between them.
        between = residuals(solved.x[:, None], *self.between)[0]
        lost = float(between @ between - solved.fun @ solved.fun) / 2
        if lost >= max(gain / 2, EVIDENCE_MARGIN):
            return None
        return _Fitted(gain - self.price * len(numbers) - price(node), node, result)

    def shorten(self, fitted: _Fitted) -> _Fitted:
        """Take out constants one by one as long as that pays."""
        improved = True
        while improved:
            improved = False
            for number in constants(fitted.node):
                for value in _EXPONENTS if number in exponents(fitted.node) else (0.0, 1.0):
                    values = list(fitted.values)
                    node = simplify(put(fitted.node, number, value), values)
                    trial = self.fit(node, values) if self.takes(node) else None
                    # A factor has a unit: it may become 1 only where another one does its work.
                    least = self.price - 0.1 if value == 1.0 and number not in exponents(fitted.node) else 0.0
                    if trial is not None and trial.nats > fitted.nats + least:
                        fitted, improved = trial, True
                        break
                if improved:
                    break
        return fitted


def _formula(curve: Curve, fitted: _Fitted, free: Sequence[str]) -> Formula:
    numbers = constants(fitted.node)
    order = {number: k for k, number in enumerate(numbers)}
    names = {number: free[k] for number, k in order.items()}
    own = curve.coordinates[0]
    text = write(fitted.node, own.text, names)
    parameters = {names[number]: fitted.values[number] for number in numbers}
    linear = tuple(names[number] for number in numbers if number in amplitudes(fitted.node))
    nats = fitted.nats - curve.evidence
    return Formula(text, parameters, linear, nats, _renumbered(fitted.node, order), own.text)


def _renumbered(node: Node, order: dict[int, int]) -> Node:
    if node[0] == "c":
        return ("c", order[node[1]])
    if node[0] in ("x", "n"):
        return node
    return (node[0], *(_renumbered(part, order) for part in node[1:]))
