"""Score test (Rao) of every candidate effect, from one more solve of the fit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util import chi_squared
from udd._util.one_line import OneLine
from udd.fitting import Fit
from udd.fitting.time_scale import motion_time_scale

from .candidate import Candidate
from .candidates import ripples
from .coordinates import slots
from .forcing import responses, score_forcings
from .natural_modes import belongs
from .term_library import waves

#: Share of a candidate's information below which it counts as absorbed by the free parameters.
_ABSORBED = 1e-4
_ALIKE = 1e6  # condition number of the information above which candidates are not distinguishable
_STRONG = 4.0  # factor on the usual amplitudes, for effects that may have either sign
_AT_ONCE = 20_000  # evaluated together: some ten megabytes
_MOST_PAIRS = 700_000  # evaluated in all: a few seconds
_LINES = 24  # strongest lines of a frequency scan, whose neighbourhoods are scanned too


@dataclass(frozen=True, repr=False)
class Scored(OneLine):
    """Score of one candidate.

    Attributes
    ----------
    candidate : Candidate
    chi2 : float
        Decrease in chi2, in units of the fit's own scatter.
    p : float
        Probability of so large a decrease by chance, for this candidate alone.
    amplitudes, errors : tuple of float
        Estimates with standard errors, in SI units.
    absorbed : bool
        True if the free parameters already have the same effect on the data.
    physical : bool
        True if the amplitudes are in their physical range (friction dissipates energy).
    """

    candidate: Candidate
    chi2: float
    p: float
    amplitudes: tuple[float, ...]
    errors: tuple[float, ...]
    absorbed: bool
    physical: bool


@dataclass(frozen=True)
class Scan:
    """Scores of a list of candidates, with the matrices for their combinations."""

    scored: list[Scored]
    gradient: NDArray[np.float64]
    information: NDArray[np.float64]
    columns: list[list[int]]
    scatter: float

    def pairs(self, most: int | None = None) -> tuple[list[tuple[list[Scored], float]], int]:
        """Rank pairs of candidates by their joint decrease in chi2; at most so many, with the count of all.

        If there are millions, only pairs of the strongest candidates are evaluated; the others count, too,
        because the data made the choice. Scanned candidates are in no pair: combined with another law they
        imitate a third.
        """
        distinguishable = [k for k, s in enumerate(self.scored) if not (s.absorbed or s.candidate.scanned)]
        usable = self._strongest(distinguishable)
        # Indistinguishable candidates are not combined.
        unit = _unit(self.information)

        def alike(at: NDArray[np.intp]) -> NDArray[np.float64]:
            return np.asarray(np.linalg.cond(unit[at[:, :, None], at[:, None, :]]))

        def fall(at: NDArray[np.intp]) -> NDArray[np.float64]:
            g = self.gradient[at][:, :, None]
            gains = g.mT @ np.linalg.solve(self.information[at[:, :, None], at[:, None, :]], g)
            return np.asarray(gains[:, 0, 0]) / self.scatter

        pairs = np.array(list(itertools.combinations(usable, 2)), dtype=np.intp).reshape(-1, 2)
        pairs = pairs[self._each(pairs, alike) < _ALIKE]
        falls = self._each(pairs, fall)
        order = np.argsort(-falls, kind="stable")
        gains = [([self.scored[k] for k in pairs[i]], float(falls[i])) for i in order[:most]]
        return gains, len(order) + math.comb(len(distinguishable), 2) - math.comb(len(usable), 2)

    def _strongest(self, usable: list[int]) -> list[int]:
        """Return the strongest candidates, few enough to evaluate all their pairs."""
        many = len(usable)
        while math.comb(many, 2) > _MOST_PAIRS:
            many -= 1
        best = sorted(usable, key=lambda k: -self.scored[k].chi2)[:many]
        return sorted(best)

    def _each(
        self, pairs: NDArray[np.intp], value: Callable[[NDArray[np.intp]], NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Evaluate each pair from its columns, many pairs of the same widths at a time."""
        widths = np.array([len(columns) for columns in self.columns], dtype=np.intp)
        table = np.zeros((len(widths), widths.max(initial=1)), dtype=np.intp)
        for row, columns in zip(table, self.columns, strict=True):
            row[: len(columns)] = columns
        result = np.empty(len(pairs))
        # The widths of a pair as one number, which is faster to compare than a row.
        kinds = widths[pairs] @ (widths.max(initial=0) + 1) ** np.arange(pairs.shape[1])
        for kind_number in np.unique(kinds):
            rows = np.flatnonzero(kinds == kind_number)
            pair_widths = widths[pairs[rows[0]]]
            for some in np.array_split(rows, len(rows) // _AT_ONCE + 1):
                at = [table[pairs[some, k], :width] for k, width in enumerate(pair_widths)]
                result[some] = value(np.concatenate(at, axis=1))
        return result

    def likeness(self, i: int, j: int) -> float:
        """Return the likeness of two candidates on the data: the largest canonical correlation, 0 to 1."""
        a, b = self.columns[i], self.columns[j]
        block = self.information
        left = np.linalg.solve(block[np.ix_(a, a)], block[np.ix_(a, b)])
        right = np.linalg.solve(block[np.ix_(b, b)], block[np.ix_(b, a)])
        return float(np.sqrt(max(np.linalg.eigvals(left @ right).real.max(), 0.0)))


def scan(fit: Fit, candidates: Sequence[Candidate]) -> Scan:
    """Score candidates around a fit."""
    problem, model = fit.problem, fit.model
    scored_models = [c.scored_in(model) for c in candidates]
    gradient, information, alone = _core.score(problem.at(fit.point), scored_models)
    scatter = max(fit.scatter, 1.0)
    scored, columns, first = [], [], 0
    for candidate in candidates:
        indices = list(range(first, first + len(candidate.amplitude_names)))
        first += len(indices)
        columns.append(indices)
        block = information[np.ix_(indices, indices)]
        scored.append(score_of(candidate, gradient[indices], block, alone[indices], scatter))
    return Scan(scored, gradient, information, columns, scatter)


def strongest_ripple(fit: Fit) -> tuple[Scored | None, int]:
    """Periodogram of score tests: the strongest drive ripple, and the number of frequencies tested.

    The frequencies are half a line (1 / duration) apart. First every second one is scored. A ripple between
    two lines still has two fifths of its strength in both, so the frequencies between are only scored next to
    the strongest lines. For a model without a drive the result is the strongest harmonic force in any
    equation.
    """
    driven = fit.model.profile.dynamics.drive is not None
    candidates = ripples(fit.model, fit.record.t) if driven else _waves(fit)
    scored = scan_ripples if driven else _scan_waves
    lines = scored(fit, candidates[::2])
    best = sorted(range(len(lines)), key=lambda k: -lines[k].chi2)[:_LINES]
    between = sorted({2 * k + side for k in best for side in (-1, 1)} & set(range(len(candidates))))
    neighbours = scored(fit, [candidates[k] for k in between])
    return max(lines + neighbours, key=lambda s: s.chi2, default=None), len(candidates)


def scan_ripples(fit: Fit, candidates: Sequence[Candidate]) -> list[Scored]:
    """Score drive ripples."""
    if not candidates:
        return []
    frequencies = [c.effect.parameters["f"] for c in candidates]
    scores = _core.score_ripples(fit.problem.at(fit.point), frequencies)
    scatter = max(fit.scatter, 1.0)
    return [score_of(c, g, i, a, scatter) for c, g, i, a in zip(candidates, *scores, strict=True)]


def _waves(fit: Fit) -> list[Candidate]:
    """List harmonic forces of each equation, but at frequencies of the system or of the mains."""
    model, t = fit.model, fit.record.t
    # As for the disk's drive ripple: forces much faster than the motion have no effect.
    fastest = min(0.25 / float(np.median(np.diff(t)[fit.record.linked])), 6.0 / motion_time_scale(fit))
    frequencies = np.arange(2.0 / np.ptp(t), fastest, 0.5 / np.ptp(t))
    there = {effect.name for effect in model.effects}
    return [c for c in waves(model, frequencies[~belongs(frequencies, fit)]) if c.effect.name not in there]


def _scan_waves(fit: Fit, candidates: Sequence[Candidate]) -> list[Scored]:
    """Score harmonic forces."""
    moved = responses(fit)
    by_name = {slot.name: slot for slot in slots(fit.model)}

    def column(candidate: Candidate) -> NDArray[np.float64]:
        phase = 2 * np.pi * candidate.effect.values[-1] * moved.t
        value = np.stack([np.cos(phase), np.sin(phase)], axis=-1)
        return moved.columns(by_name[candidate.effect.slots[0]], value, np.zeros(value.shape))

    return scored_forcings(fit, candidates, column)


def scored_forcings(
    fit: Fit, candidates: Sequence[Candidate], column: Callable[[Candidate], NDArray[np.float64] | None]
) -> list[Scored]:
    """Score candidates by their forcings. `column` computes a forcing, or returns None if it is undefined."""
    scatter = max(fit.scatter, 1.0)
    defined: list[Candidate] = []

    def columns() -> Iterator[NDArray[np.float64]]:
        for candidate in candidates:
            if (values := column(candidate)) is not None:
                defined.append(candidate)
                yield values

    scores = score_forcings(fit, columns())
    return [
        score_of(c, scatter * s.gradient, scatter * s.information, scatter * s.alone, scatter)
        for c, s in zip(defined, scores, strict=True)
    ]


def score_of(
    candidate: Candidate,
    gradient: NDArray[np.float64],
    information: NDArray[np.float64],
    alone: NDArray[np.float64],
    scatter: float,
) -> Scored:
    """Make a candidate's score from gradient and information in units of chi2."""
    n = len(gradient)
    nothing = Scored(candidate, 0.0, 1.0, (0.0,) * n, (np.inf,) * n, True, True)
    diagonal = np.diag(information)
    if not (np.isfinite(information).all() and np.isfinite(gradient).all()):
        return nothing  # an effect that diverges away from the motion has no score there
    if np.any(diagonal <= _ABSORBED * alone) or np.linalg.eigvalsh(_unit(information)).min() < _ABSORBED:
        return nothing
    covariance = np.linalg.inv(information)
    estimate = covariance @ gradient
    errors = np.sqrt(np.diag(covariance) * scatter)
    chi2 = float(gradient @ estimate) / scatter
    return Scored(
        candidate,
        chi2,
        float(chi_squared.sf(chi2, n)),
        tuple(estimate.tolist()),
        tuple(errors.tolist()),
        False,
        physical(candidate, estimate, errors),
    )


def physical(candidate: Candidate, estimate: Iterable[float], errors: Iterable[float]) -> bool:
    """Return True if amplitudes are in their range, within two standard errors.

    If the range includes both signs it is only typical: a strong effect may exceed it, and even more its
    score around a diverged fit.
    """
    ranges = [p.range for p in candidate.effect.spec.parameters if p.role == "amplitude"]
    wide = [(_STRONG * low, _STRONG * high) if low < 0 < high else (low, high) for low, high in ranges]
    return all(
        low - 2 * e <= a <= high + 2 * e for a, e, (low, high) in zip(estimate, errors, wide, strict=True)
    )


def _unit(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    result: NDArray[np.float64] = matrix * scale[:, None] * scale[None, :]
    return result
