"""Score tests of penalised splines: in which equation something is missing, as a function of what."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd._util.one_line import OneLine
from udd._util.parallel import parallel_map
from udd.discovery.scoring.coordinates import Slot, coordinates, slots
from udd.discovery.scoring.forcing import Responses, Score, responses, score_forcings
from udd.fitting import Fit
from udd.models import Model
from udd.models.profile import Coordinate

from .bsplines import Spline, along, product, rough_product
from .penalized_curves import Confounding, chance, smooth

Array = NDArray[np.float64]

#: Explanations whose likelihoods differ by less, in units of their logarithm, are not told apart.
EVIDENCE_MARGIN = 10.0
#: Intervals between knots along one coordinate, and along each of two.
INTERVALS, INTERVALS_OF_TWO = 14, 3
#: The same along an angle that goes round: five waves per turn are seen.
ROUND, ROUND_OF_TWO = 24, 6
_FINER = 2  # times as many knots for the curve that is kept
_FEW = 6  # of the best curves, tried with the momentum that goes with them too


@dataclass(frozen=True, eq=False, repr=False)
class Curve(OneLine):
    """A curve that one equation may lack, with the evidence for it.

    Attributes
    ----------
    slot : Slot
        Where it enters.
    coordinates : tuple of Coordinate
        What it is a function of, one or two.
    splines : tuple of Spline
    coefficients : ndarray (k,)
        Of the splines, under the smoothness prior; SI units.
    covariance : ndarray (k, k)
    precision : float
        Of the smoothness prior, chosen by evidence.
    df : float
        Effective degrees of freedom.
    evidence : float
        Logarithm of the evidence over that for no curve, nats.
    p : float
        Probability that the best of the numbers of directions looks so good by chance, for this curve alone.
    chi2, directions : float, int
        By how much chi2 would fall in that many directions.
    places : tuple of ndarray
        Where the record visits the coordinates, every frame's first place.
    score : Score
    absorbed : Confounding or None
        What of it is agreed upon, where `covariance` is what remains then.
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
        """What a reader calls it."""
        return f"{self.slot.title} as a function of {' and '.join(c.name for c in self.coordinates)}"

    @property
    def name(self) -> tuple[str, ...]:
        """Slot, momentum and coordinates, to compare by."""
        return (self.slot.title, *(c.name for c in self.coordinates))

    @property
    def kin(self) -> tuple[str, ...]:
        """Slot and coordinates: what is the same with its momentum and without."""
        return _kin(self.slot, self.coordinates)

    def design(self, *x: Array) -> Array:
        """The basis functions at places, (..., k)."""
        designs = [s.design(np.asarray(v, dtype=np.float64)) for s, v in zip(self.splines, x, strict=True)]
        return designs[0] if len(designs) == 1 else product(*designs)

    def values(self, *x: Array) -> Array:
        """The curve at places, in the slot's unit."""
        result: Array = self.design(*x) @ self.coefficients
        return result

    def errors(self, *x: Array) -> Array:
        """Standard errors of the curve at places."""
        design = self.design(*x)
        result: Array = np.sqrt(
            np.maximum(np.einsum("...k,kl,...l->...", design, self.covariance, design), 0.0)
        )
        return result

    def beside(self, values: Array, *x: Array) -> Array:
        """Another curve's values at places, as they compare: with as much of what is agreed upon as this."""
        if self.absorbed is None:
            return values
        design = self.design(*x)
        weak = 1e-9 * np.trace(design.T @ design) / np.trace(self.roughness) * self.roughness
        own = np.linalg.solve(design.T @ design + weak, design.T @ values)
        result: Array = values + design @ (self.absorbed.aligned(own, self.coefficients) - own)
        return result

    @property
    def roughness(self) -> Array:
        """What the smoothness prior charges."""
        return _roughness(self.splines)


@dataclass(frozen=True)
class CurveScan:
    """Every curve that was tried, the one with the highest evidence first.

    Attributes
    ----------
    curves : list of Curve
    comparisons : int
        How many curves could have been the best.
    """

    curves: list[Curve]
    comparisons: int

    @property
    def p(self) -> float:
        """Probability that any of them looks as good as the least likely one by chance."""
        return min(min((c.p for c in self.curves), default=1.0) * self.comparisons, 1.0)


def scan_curves(
    fit: Fit,
    *,
    pairs: bool = False,
    only: Callable[[Slot, tuple[Coordinate, ...]], bool] | None = None,
) -> CurveScan:
    """Score a smooth curve in every equation as a function of every coordinate.

    Around the fit, with everything else optimal. Curves are cubic B-splines whose second differences are held
    small; how small, the evidence says. What the free parameters do already counts for nothing.

    Parameters
    ----------
    fit : Fit
    pairs : bool
        Surfaces over two coordinates as well.
    only : callable, optional
        ``(slot, coordinates) -> bool``: which of them to try.

    Examples
    --------
    A pendulum in air, whose model knows viscous friction only; a wrong model that is held loosely shows best
    what it lacks.

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
    found = responses(fit)
    groups = [
        (slot, own)
        for slot in slots(fit.model)
        for own in _choices(fit.model, pairs)
        if _sensible(slot, own) and (only is None or only(slot, own))
    ]
    # A velocity of the contact with its momentum or without looks nearly the same: where the first is nowhere
    # near the best, the second need not be tried.
    first = [(slot, own) for slot, own in groups if slot.momentum != "consistent"]
    curves = sorted(_score(found, first), key=lambda c: -c.evidence)
    near = {c.kin for c in curves[:_FEW]}
    second = [
        (slot, own)
        for slot, own in groups
        if slot.momentum == "consistent" and (not first or _kin(slot, own) in near)
    ]
    curves = sorted(curves + _score(found, second), key=lambda c: -c.evidence)
    return CurveScan(curves, len(groups))


def _kin(slot: Slot, own: tuple[Coordinate, ...]) -> tuple[str, ...]:
    return (slot.name, *(c.name for c in own))


def _score(found: Responses, groups: Sequence[tuple[Slot, tuple[Coordinate, ...]]]) -> list[Curve]:
    """Every slot's curve over the same coordinates at once: what the splines are there is the same."""
    over: dict[tuple[str, ...], tuple[tuple[Coordinate, ...], list[Slot]]] = {}
    for slot, own in groups:
        over.setdefault(tuple(c.name for c in own), (own, []))[1].append(slot)

    def one(item: tuple[tuple[Coordinate, ...], list[Slot]]) -> list[Curve]:
        own, slots = item
        splines = _splines(found, own)
        scores = score_splines(found, slots, own, splines)
        return [_curve(found, slot, own, splines, score) for slot, score in zip(slots, scores, strict=True)]

    return [curve for part in parallel_map(one, over.values()) for curve in part]


def score_splines(
    found: Responses,
    slots: Sequence[Slot],
    own: tuple[Coordinate, ...],
    splines: tuple[Spline, ...],
    known: bool = False,
) -> list[Score]:
    """Score the splines' coefficients of a curve in each of several slots, each curve as if it were alone."""
    designs = _designs(found, own, splines)
    return score_forcings(found.fit, [found.columns(slot, *designs) for slot in slots], known)


def refined(curve: Curve, fit: Fit) -> Curve:
    """The curve around a fit on finer knots, so that the smoothness prior alone says how much it bends.

    It reaches as far as the fit's data. A surface keeps its knots.
    """
    found = responses(fit)
    finer = _splines(found, curve.coordinates)
    if len(finer) == 1:
        finer = (replace(finer[0], intervals=_FINER * finer[0].intervals),)
    (score,) = score_splines(found, [curve.slot], curve.coordinates, finer)
    return _curve(found, curve.slot, curve.coordinates, finer, score)


def rescored(curve: Curve, fit: Fit, at: Array) -> Curve:
    """The curve from the score around another fit, whose model holds the curve with coefficients `at`."""
    found = responses(fit)
    (score,) = score_splines(found, [curve.slot], curve.coordinates, curve.splines)
    smoothed = smooth(score, curve.roughness, fit.observations, at)
    moved = replace(score, gradient=score.gradient + score.information @ at)
    return replace(
        curve,
        coefficients=smoothed.coefficients,
        covariance=smoothed.covariance,
        precision=smoothed.precision,
        df=smoothed.df,
        evidence=smoothed.evidence,
        score=moved,
        absorbed=None,
    )


def _choices(model: Model, pairs: bool) -> Iterable[tuple[Coordinate, ...]]:
    """The coordinates, and pairs of those that are not made of each other."""
    single = coordinates(model)
    yield from ((c,) for c in single)
    if not pairs:
        return
    made_of = {"|Omega|": {"Omega"}, "R": {"Y", "Z"}, "theta": {"Y", "Z"}, "load": {"Omega", "Y", "Z"}}
    for a, b in itertools.combinations((c for c in single if c.name != "t"), 2):
        parts = [made_of.get(c.name, {c.name}) for c in (a, b)]
        if not parts[0] & parts[1]:
            # What goes round comes last: a surface can begin anew along its second coordinate.
            yield (b, a) if a.angle else (a, b)


def _sensible(slot: Slot, own: tuple[Coordinate, ...]) -> bool:
    """Whether the curve is not another one written differently: friction over Omega is a torque over it."""
    return not (slot.name == "friction" and any(c.name == "Omega" for c in own))


def _splines(found: Responses, own: tuple[Coordinate, ...]) -> tuple[Spline, ...]:
    straight, round_ = (INTERVALS, ROUND) if len(own) == 1 else (INTERVALS_OF_TWO, ROUND_OF_TWO)
    result = []
    for c in own:
        spline = along(found.along(c)[found.linked], c.angle, round_)
        result.append(spline if spline.periodic else replace(spline, intervals=straight))
    return tuple(result)


def _designs(
    found: Responses, own: tuple[Coordinate, ...], splines: tuple[Spline, ...]
) -> tuple[Array, Array]:
    """The basis functions at the places of every link, and how fast they change there."""
    x = [found.along(c) for c in own]
    values = [s.design(v) for s, v in zip(splines, x, strict=True)]
    changes = [s.design(v, 1) * found.speed(c)[..., None] for s, v, c in zip(splines, x, own, strict=True)]
    if len(own) == 1:
        return values[0], changes[0]
    return product(*values), product(changes[0], values[1]) + product(values[0], changes[1])


def _curve(
    found: Responses,
    slot: Slot,
    own: tuple[Coordinate, ...],
    splines: tuple[Spline, ...],
    score: Score,
) -> Curve:
    roughness = _roughness(splines)
    smoothed = smooth(score, roughness, found.fit.observations)
    p, fall, number = chance(score, roughness)
    return Curve(
        slot,
        own,
        splines,
        smoothed.coefficients,
        smoothed.covariance,
        smoothed.precision,
        smoothed.df,
        smoothed.evidence,
        p,
        fall,
        number,
        tuple(found.along(c)[found.linked, 0] for c in own),
        score,
    )


def _roughness(splines: tuple[Spline, ...]) -> Array:
    return splines[0].roughness if len(splines) == 1 else rough_product(*splines)
