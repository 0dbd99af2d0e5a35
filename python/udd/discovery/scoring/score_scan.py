"""Score test (Rao) of every candidate effect, from one more solve of the fit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util import chi_squared
from udd.fitting import Fit
from udd.fitting.time_scale import motion_time_scale
from udd.models.formula_model import FormulaModel

from .candidate import Candidate
from .candidates import ripples
from .coordinates import slots
from .forcing import responses, score_forcings
from .natural_modes import belongs
from .term_library import waves

#: A candidate is absorbed when the free parameters take this share of its information.
_ABSORBED = 1e-4
_ALIKE = 1e6  # condition of the information from which on candidates act alike
_STRONG = 4.0  # times the usual amplitudes, of effects that may have either sign
_WAVES = 100  # scored at a time: what a long record takes in memory
_AT_ONCE = 20_000  # looked at together: some ten megabytes
_MOST_PAIRS = 700_000  # looked at in all: a few seconds
_LINES = 24  # of a scan over frequencies, looked at between them too


@dataclass(frozen=True)
class Scored:
    """What the score says of one candidate.

    Attributes
    ----------
    candidate : Candidate
    chi2 : float
        By how much chi2 would fall, in units of the fit's own scatter.
    p : float
        Probability of so large a fall by chance, for one candidate looked at.
    amplitudes, errors : tuple of float
        Estimates with standard errors, in SI units.
    absorbed : bool
        The free parameters already do what this candidate does: the data cannot see it.
    physical : bool
        The amplitudes lie in their physical range (friction takes energy out).
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
    """Scores of a list of candidates with what is needed for their combinations."""

    scored: list[Scored]
    gradient: NDArray[np.float64]
    information: NDArray[np.float64]
    columns: list[list[int]]
    scatter: float

    def pairs(self, most: int | None = None) -> tuple[list[tuple[list[Scored], float]], int]:
        """Two candidates with the fall of chi2 that both together give, largest first.

        At most so many pairs, and how many there are. Where there are millions only those of the candidates
        that alone give most are looked at; the others count, too, as the data chose which. What a scan chose
        the value of is in none: beside another law it looks like a third.
        """
        told_apart = [k for k, s in enumerate(self.scored) if not (s.absorbed or s.candidate.scanned)]
        usable = self._strongest(told_apart)
        # Candidates that act alike have no place side by side.
        unit = _unit(self.information)

        def alike(at: NDArray[np.intp]) -> NDArray[np.float64]:
            return np.asarray(np.linalg.cond(unit[at[:, :, None], at[:, None, :]]))

        def fall(at: NDArray[np.intp]) -> NDArray[np.float64]:
            g = self.gradient[at][:, :, None]
            found = g.mT @ np.linalg.solve(self.information[at[:, :, None], at[:, None, :]], g)
            return np.asarray(found[:, 0, 0]) / self.scatter

        pairs = np.array(list(itertools.combinations(usable, 2)), dtype=np.intp).reshape(-1, 2)
        pairs = pairs[self._each(pairs, alike) < _ALIKE]
        falls = self._each(pairs, fall)
        order = np.argsort(-falls, kind="stable")
        found = [([self.scored[k] for k in pairs[i]], float(falls[i])) for i in order[:most]]
        return found, len(order) + math.comb(len(told_apart), 2) - math.comb(len(usable), 2)

    def _strongest(self, usable: list[int]) -> list[int]:
        """Candidates that make no more pairs than are looked at."""
        many = len(usable)
        while math.comb(many, 2) > _MOST_PAIRS:
            many -= 1
        best = sorted(usable, key=lambda k: -self.scored[k].chi2)[:many]
        return sorted(best)

    def _each(
        self, pairs: NDArray[np.intp], value: Callable[[NDArray[np.intp]], NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """A value of each pair from its columns: of those with as many columns many at a time."""
        widths = np.array([len(own) for own in self.columns], dtype=np.intp)
        table = np.zeros((len(widths), widths.max(initial=1)), dtype=np.intp)
        for row, own in zip(table, self.columns, strict=True):
            row[: len(own)] = own
        result = np.empty(len(pairs))
        # The widths of a pair as one number, which is told apart sooner than a row.
        kinds = widths[pairs] @ (widths.max(initial=0) + 1) ** np.arange(pairs.shape[1])
        for one in np.unique(kinds):
            rows = np.flatnonzero(kinds == one)
            kind = widths[pairs[rows[0]]]
            for some in np.array_split(rows, len(rows) // _AT_ONCE + 1):
                at = [table[pairs[some, k], :width] for k, width in enumerate(kind)]
                result[some] = value(np.concatenate(at, axis=1))
        return result

    def likeness(self, i: int, j: int) -> float:
        """How alike two candidates act on the data: the largest canonical correlation, 0 to 1."""
        a, b = self.columns[i], self.columns[j]
        block = self.information
        left = np.linalg.solve(block[np.ix_(a, a)], block[np.ix_(a, b)])
        right = np.linalg.solve(block[np.ix_(b, b)], block[np.ix_(b, a)])
        return float(np.sqrt(max(np.linalg.eigvals(left @ right).real.max(), 0.0)))


def scan(fit: Fit, candidates: Sequence[Candidate]) -> Scan:
    """Score candidates around a fit."""
    problem, model = fit.problem, fit.model
    gradient, information, alone = _core.score(
        problem.at(fit.point),
        [(c.added_to(model), c.amplitude_indices(model)) for c in candidates],
    )
    scatter = max(fit.scatter, 1.0)
    scored, columns, first = [], [], 0
    for candidate in candidates:
        own = list(range(first, first + len(candidate.amplitude_names)))
        first += len(own)
        columns.append(own)
        block = information[np.ix_(own, own)]
        scored.append(score_of(candidate, gradient[own], block, alone[own], scatter))
    return Scan(scored, gradient, information, columns, scatter)


def strongest_ripple(fit: Fit) -> tuple[Scored | None, int]:
    """Periodogram of score tests: the strongest drive ripple, and the number of frequencies tested.

    The frequencies are half a line (1 / duration) apart. First every second one is scored. A ripple between
    two lines still has two fifths of its strength in both, so that the frequencies between are only scored
    beside the strongest lines. For a user's own model it is the strongest harmonic force in any equation; a
    pendulum has none.
    """
    if isinstance(fit.model, FormulaModel):
        found = _scan_waves(fit, fit.model)
        return max(found, key=lambda s: s.chi2, default=None), len(found)
    candidates = ripples(fit.model, fit.record.t)
    lines = scan_ripples(fit, candidates[::2])
    best = sorted(range(len(lines)), key=lambda k: -lines[k].chi2)[:_LINES]
    between = sorted({2 * k + side for k in best for side in (-1, 1)} & set(range(len(candidates))))
    beside = scan_ripples(fit, [candidates[k] for k in between])
    return max(lines + beside, key=lambda s: s.chi2, default=None), len(candidates)


def scan_ripples(fit: Fit, candidates: Sequence[Candidate]) -> list[Scored]:
    """Score drive ripples."""
    if not candidates:
        return []
    frequencies = [c.effect.parameters["f"] for c in candidates]
    scores = _core.score_ripples(fit.problem.at(fit.point), frequencies)
    scatter = max(fit.scatter, 1.0)
    return [score_of(c, g, i, a, scatter) for c, g, i, a in zip(candidates, *scores, strict=True)]


def _scan_waves(fit: Fit, model: FormulaModel) -> list[Scored]:
    moved, t = responses(fit), fit.record.t
    # As of the drive's ripple on the disk: what is much faster than the motion does nothing to it.
    fastest = min(0.25 / float(np.median(np.diff(t)[fit.record.linked])), 6.0 / motion_time_scale(fit))
    frequencies = np.arange(2.0 / np.ptp(t), fastest, 0.5 / np.ptp(t))
    frequencies = frequencies[~belongs(frequencies, fit)]
    there = {effect.name for effect in model.effects}
    candidates = [c for c in waves(model, frequencies) if c.effect.name not in there]
    by_name = {slot.name: slot for slot in slots(model)}
    scatter = max(fit.scatter, 1.0)
    result: list[Scored] = []
    for first in range(0, len(candidates), _WAVES):
        some, columns = candidates[first : first + _WAVES], []
        for one in some:
            phase = 2 * np.pi * one.effect.values[-1] * moved.t
            slot = by_name[one.effect.slots[0]]
            value = np.stack([np.cos(phase), np.sin(phase)], axis=-1)
            columns.append(moved.columns(slot, value, np.zeros(value.shape)))
        for one, score in zip(some, score_forcings(fit, columns), strict=True):
            gradient, information, alone = (
                scatter * part for part in (score.gradient, score.information, score.alone)
            )
            result.append(score_of(one, gradient, information, alone, scatter))
    return result


def score_of(
    candidate: Candidate,
    gradient: NDArray[np.float64],
    information: NDArray[np.float64],
    alone: NDArray[np.float64],
    scatter: float,
) -> Scored:
    """What a score's gradient and information, in units of chi2, say of a candidate."""
    n = len(gradient)
    nothing = Scored(candidate, 0.0, 1.0, (0.0,) * n, (np.inf,) * n, True, True)
    own = np.diag(information)
    if not (np.isfinite(information).all() and np.isfinite(gradient).all()):
        return nothing  # what runs away from where the motion is says nothing there
    if np.any(own <= _ABSORBED * alone) or np.linalg.eigvalsh(_unit(information)).min() < _ABSORBED:
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
    """Whether amplitudes lie in their range, give or take their error.

    Where both signs are, the range says what is usual, which a strong effect, and more so its score around a
    fit that went astray, may leave.
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
