"""Score tests of penalised splines: which equation lacks a term, and in which coordinate."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd._util.keywords import renamed_attribute
from udd._util.one_line import OneLine
from udd._util.parallel import parallel_map
from udd.discovery.scoring.coordinates import Slot, coordinates, slots
from udd.discovery.scoring.forcing import Responses, Score, responses, score_forcings
from udd.discovery.thresholds import EVIDENCE_MARGIN
from udd.fitting import Fit
from udd.models import Model
from udd.models.profile import Coordinate

from .bsplines import Spline, along, product, rough_product
from .penalized_curves import Confounding, chance, smooth

Array = NDArray[np.float64]

#: Intervals between knots along one coordinate, and along each of two.
INTERVALS, INTERVALS_OF_TWO = 14, 3
#: The same along a periodic angle: it resolves five waves per turn.
ROUND, ROUND_OF_TWO = 24, 6
_FINER = 2  # factor in the number of knots for the curve that is kept
_FEW = 6  # best curves, which are also tried with the momentum that goes with them


@dataclass(frozen=True, eq=False, repr=False)
class Curve(OneLine):
    """Curve that one equation may lack, with the evidence for it.

    Attributes
    ----------
    slot : Slot
        Equation that it enters.
    coordinates : tuple of Coordinate
        Coordinates that it depends on, one or two.
    splines : tuple of Spline
    coefficients : ndarray (k,)
        Spline coefficients under the smoothness prior; SI units.
    covariance : ndarray (k, k)
    precision : float
        Precision of the smoothness prior, chosen by evidence.
    df : float
        Effective degrees of freedom.
    evidence : float
        Log evidence relative to no curve, nats.
    p : float
        Probability of so large a decrease in chi2 by chance, for this curve alone and the best number of
        directions.
    chi2, directions : float, int
        Decrease in chi2 in that many directions.
    places : tuple of ndarray
        Places of the coordinates that the record visits: every frame's first.
    score : Score
    absorbed : Confounding or None
        Confounded part, if `covariance` is that of the rest; else None.

    See Also
    --------
    udd.plot.curve : draw it with its band.
    """

    slot: Slot
    coordinates: tuple[Coordinate, ...]
    splines: tuple[Spline, ...]
    coefficients: Array
    covariance: Array
    precision: float
    df: float
    evidence: float
    p: float
    chi2: float
    directions: int
    places: tuple[Array, ...]
    score: Score
    absorbed: Confounding | None = None

    @property
    def title(self) -> str:
        """Name of the curve for a reader."""
        return f"{self.slot.title} as a function of {' and '.join(c.name for c in self.coordinates)}"

    @property
    def name(self) -> tuple[str, ...]:
        """Slot, momentum and coordinates, for comparison."""
        return (self.slot.title, *(c.name for c in self.coordinates))

    @property
    def key_without_momentum(self) -> tuple[str, ...]:
        """Slot and coordinates, without the momentum, for comparison."""
        return _key(self.slot, self.coordinates)

    @property
    def log_prior(self) -> float:
        """Log prior probability of the coordinates and the momentum, nats.

        Curves over time absorb anything slow, and curves over the direction can imitate those over Y and Z. A
        velocity without its momentum is simpler than the same with it.
        """
        # Without this an uneven grip is written as a function of atan2(Y, Z), not of Y.
        first = self.coordinates[0]
        indirect = 2 if first.name == "t" else 1 if first.angle and first.text != first.name else 0
        return -EVIDENCE_MARGIN * (indirect + 0.5 * (self.slot.momentum == "consistent"))

    kin = renamed_attribute("kin", "key_without_momentum")
    beside = renamed_attribute("beside", "aligned_with")

    def design(self, *x: Array) -> Array:
        """Evaluate the basis functions at places, (..., k)."""
        designs = [s.design(np.asarray(v, dtype=np.float64)) for s, v in zip(self.splines, x, strict=True)]
        return designs[0] if len(designs) == 1 else product(*designs)

    def values(self, *x: Array) -> Array:
        """Evaluate the curve at places, in the slot's unit."""
        result: Array = self.design(*x) @ self.coefficients
        return result

    def errors(self, *x: Array) -> Array:
        """Compute standard errors of the curve at places."""
        design = self.design(*x)
        result: Array = np.sqrt(
            np.maximum(np.einsum("...k,kl,...l->...", design, self.covariance, design), 0.0)
        )
        return result

    def aligned_with(self, values: Array, *x: Array) -> Array:
        """Align another curve's values with this one in the confounded directions, for comparison."""
        if self.absorbed is None:
            return values
        design = self.design(*x)
        weak = 1e-9 * np.trace(design.T @ design) / np.trace(self.roughness) * self.roughness
        projection = np.linalg.solve(design.T @ design + weak, design.T @ values)
        result: Array = values + design @ (self.absorbed.aligned(projection, self.coefficients) - projection)
        return result

    @property
    def roughness(self) -> Array:
        """Matrix of the smoothness prior."""
        return _roughness(self.splines)


@dataclass(frozen=True)
class CurveScan:
    """Curves that were scored, the one with the highest evidence first, and the count of comparisons."""

    curves: list[Curve]
    comparisons: int


def scan_curves(
    fit: Fit,
    *,
    pairs: bool = False,
    only: Callable[[Slot, tuple[Coordinate, ...]], bool] | None = None,
) -> CurveScan:
    """Score a smooth curve in every equation as a function of every coordinate.

    The score is computed around the fit, with everything else optimal. Curves are cubic B-splines with a
    prior on their second differences, whose precision is chosen by evidence. Confounding with the free
    parameters is accounted for. With `pairs` surfaces over two coordinates are scored, too; `only` filters
    the curves to try.

    Examples
    --------
    A pendulum in air, whose model has viscous friction only. With a large model error the scores show best
    what a wrong model lacks.

    >>> import numpy as np, udd
    >>> from udd.discovery.nonparametric.curve_scan import scan_curves
    >>> from udd.fitting import with_larger_model_error
    >>> t = np.arange(0, 60, 0.05)
    >>> truth = udd.Pendulum(1.0, k0=0.01, effects=[udd.effects.quadratic_drag(c=0.05)])
    >>> theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1]
    >>> noise = 2e-3 * np.random.default_rng(0).standard_normal(len(t))
    >>> fit = udd.fit(udd.Measurement(t, {"theta": theta + noise}), udd.Pendulum(1.0, k0=0.03))
    >>> scan_curves(with_larger_model_error(fit, 3.0)).curves[0].title
    'friction as a function of |Omega|'
    """
    moved = responses(fit)
    groups = [
        (slot, coords)
        for slot in slots(fit.model)
        for coords in _choices(fit.model, pairs)
        if _sensible(slot, coords) and (only is None or only(slot, coords))
    ]
    # A velocity of the contact scores nearly the same with and without its momentum: only if the first is
    # close to the best is the second tried.
    first = [(slot, coords) for slot, coords in groups if slot.momentum != "consistent"]
    curves = sorted(_score(moved, first), key=lambda c: -c.evidence)
    best_keys = {c.key_without_momentum for c in curves[:_FEW]}
    second = [
        (slot, coords)
        for slot, coords in groups
        if slot.momentum == "consistent" and (not first or _key(slot, coords) in best_keys)
    ]
    curves = sorted(curves + _score(moved, second), key=lambda c: -c.evidence)
    return CurveScan(curves, len(groups))


def _key(slot: Slot, coords: tuple[Coordinate, ...]) -> tuple[str, ...]:
    return (slot.name, *(c.name for c in coords))


def _score(moved: Responses, groups: Sequence[tuple[Slot, tuple[Coordinate, ...]]]) -> list[Curve]:
    """Score the curves of every slot over the same coordinates at once, because they share the splines."""
    over: dict[tuple[str, ...], tuple[tuple[Coordinate, ...], list[Slot]]] = {}
    for slot, coords in groups:
        over.setdefault(tuple(c.name for c in coords), (coords, []))[1].append(slot)

    def score_group(item: tuple[tuple[Coordinate, ...], list[Slot]]) -> list[Curve]:
        coords, slots = item
        splines = _splines(moved, coords)
        scores = score_splines(moved, slots, coords, splines)
        return [
            _curve(moved, slot, coords, splines, score) for slot, score in zip(slots, scores, strict=True)
        ]

    return [curve for part in parallel_map(score_group, over.values()) for curve in part]


def score_splines(
    moved: Responses,
    slots: Sequence[Slot],
    coords: tuple[Coordinate, ...],
    splines: tuple[Spline, ...],
    parameters_fixed: bool = False,
) -> list[Score]:
    """Score the spline coefficients of a curve in each slot, each curve as if it were alone."""
    designs = _designs(moved, coords, splines)
    return score_forcings(moved.fit, [moved.columns(slot, *designs) for slot in slots], parameters_fixed)


def refined(curve: Curve, fit: Fit) -> Curve:
    """Refit the curve on finer knots, so that only the smoothness prior limits its curvature.

    It covers the range of the fit's data. A surface keeps its knots.
    """
    moved = responses(fit)
    finer = _splines(moved, curve.coordinates)
    if len(finer) == 1:
        finer = (replace(finer[0], intervals=_FINER * finer[0].intervals),)
    (score,) = score_splines(moved, [curve.slot], curve.coordinates, finer)
    return _curve(moved, curve.slot, curve.coordinates, finer, score)


def rescored(curve: Curve, fit: Fit, at: Array) -> Curve:
    """Score the curve around another fit whose model has the curve with coefficients `at`."""
    flow = responses(fit)
    (score,) = score_splines(flow, [curve.slot], curve.coordinates, curve.splines)
    smoothed = smooth(score, curve.roughness, fit.observations, at)
    moved = replace(score, gradient=score.gradient + score.information @ at)
    return replace(curve, **vars(smoothed), score=moved, absorbed=None)


def _choices(model: Model, pairs: bool) -> Iterable[tuple[Coordinate, ...]]:
    """Yield the coordinates, and pairs of independent ones."""
    single = coordinates(model)
    yield from ((c,) for c in single)
    if not pairs:
        return
    made_of = {"|Omega|": {"Omega"}, "R": {"Y", "Z"}, "theta": {"Y", "Z"}, "load": {"Omega", "Y", "Z"}}
    for a, b in itertools.combinations((c for c in single if c.name != "t"), 2):
        parts = [made_of.get(c.name, {c.name}) for c in (a, b)]
        if not parts[0] & parts[1]:
            # A periodic coordinate comes last: a surface can be periodic along its second coordinate.
            yield (b, a) if a.angle else (a, b)


def _sensible(slot: Slot, coords: tuple[Coordinate, ...]) -> bool:
    """Return False for a curve equivalent to another, and for a torque that is no friction but has a load."""
    names = {c.name for c in coords}
    # Without this a torque over the load replaces the drag of a string pendulum.
    return not ((slot.name == "friction" and "Omega" in names) or (slot.name == "torque" and "load" in names))


def _splines(moved: Responses, coords: tuple[Coordinate, ...]) -> tuple[Spline, ...]:
    straight, round_ = (INTERVALS, ROUND) if len(coords) == 1 else (INTERVALS_OF_TWO, ROUND_OF_TWO)
    result = []
    for c in coords:
        spline = along(moved.along(c)[moved.linked], c.angle, round_)
        result.append(spline if spline.periodic else replace(spline, intervals=straight))
    return tuple(result)


def _designs(
    moved: Responses, coords: tuple[Coordinate, ...], splines: tuple[Spline, ...]
) -> tuple[Array, Array]:
    """Evaluate the basis functions at the places of every link, and their rates of change."""
    x = [moved.along(c) for c in coords]
    values = [s.design(v) for s, v in zip(splines, x, strict=True)]
    changes = [s.design(v, 1) * moved.speed(c)[..., None] for s, v, c in zip(splines, x, coords, strict=True)]
    if len(coords) == 1:
        return values[0], changes[0]
    return product(*values), product(changes[0], values[1]) + product(values[0], changes[1])


def _curve(
    moved: Responses,
    slot: Slot,
    coords: tuple[Coordinate, ...],
    splines: tuple[Spline, ...],
    score: Score,
) -> Curve:
    roughness = _roughness(splines)
    smoothed = smooth(score, roughness, moved.fit.observations)
    p, fall, number = chance(score, roughness)
    return Curve(
        slot,
        coords,
        splines,
        **vars(smoothed),
        p=p,
        chi2=fall,
        directions=number,
        places=tuple(moved.along(c)[moved.linked, 0] for c in coords),
        score=score,
    )


def _roughness(splines: tuple[Spline, ...]) -> Array:
    return splines[0].roughness if len(splines) == 1 else rough_product(*splines)
