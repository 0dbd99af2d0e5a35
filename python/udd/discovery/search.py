"""The search for effects: score, fit the best in full, test, add, and begin again."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from udd.errors import FitError
from udd.fitting import Fit, Record, at_level, extend, frame_costs, held, loosened

from .candidates import Candidate, library
from .heldout import (
    Errors,
    comparison_horizon,
    cost_improvement,
    held_out_errors,
    improvement,
    whole_improvement,
)
from .results import Alternative
from .scan import Scan, Scored, physical, scan, scan_ripples

#: Chance that a record without any effect is said to have one, over all candidates together.
ALPHA = 1e-3
#: Forms of an effect whose fits differ by less than this many units of log-likelihood are not told apart.
NATS = 10.0
_SUPERSET = 0.95  # a form with more parameters and this likeness is the same form with more freedom
_WORSE = 1.1  # an effect is refused if the lower end of the errors' ratio exceeds this at some horizon
_SCATTER = 3.0  # candidates are scored around a fit whose chi2 per degree of freedom is below this
_TRIED = 6  # of the best candidates, fitted in full
_MOST = 3  # effects added


@dataclass(frozen=True)
class Step:
    """An addition that was accepted: one candidate, or a pair."""

    candidates: list[Candidate]
    chi2: float
    p: float
    ratio: tuple[float, float, float]
    alternatives: list[Alternative]


@dataclass(frozen=True)
class State:
    """Where the search stands: fits of the first part and of all data, and held-out errors."""

    part: Fit
    whole: Fit
    errors: Errors


@dataclass(frozen=True)
class Trial:
    """A combination of candidates fitted in full."""

    candidates: list[Candidate]
    fit: Fit
    compared: Fit
    """The same held as tightly as those that it is compared with."""

    @property
    def names(self) -> list[str]:
        """The amplitudes' names among the model's parameters."""
        return [name for c in self.candidates for name in c.amplitude_names]

    @property
    def amplitudes(self) -> list[float]:
        """The fitted amplitudes."""
        return [self.fit.parameters[name] for name in self.names]

    def criterion(self, unit: float) -> float:
        """chi2 in a common unit with the price of a parameter (BIC): the smaller the better."""
        price = math.log(np.isfinite(self.fit.misfit).sum())
        return self.compared.chi2 / unit + price * sum(c.parameters for c in self.candidates)

    @property
    def needed(self) -> bool:
        """Whether each of the candidates is needed beside the others."""
        names = list(self.fit.parameters)
        for candidate in self.candidates:
            own = [names.index(name) for name in candidate.amplitude_names]
            a = np.array([self.fit.parameters[names[k]] for k in own])
            block = self.fit.covariance[np.ix_(own, own)] * max(self.fit.scatter, 1.0)
            if a @ np.linalg.solve(block, a) < chi2.isf(ALPHA, len(own)):
                return False
        return True

    @property
    def physical(self) -> bool:
        """Whether all amplitudes lie in their ranges."""
        values, errors = self.fit.parameters, self.fit.errors
        return all(
            physical(c, [values[n] for n in c.amplitude_names], [errors[n] for n in c.amplitude_names])
            for c in self.candidates
        )


class Search:
    """The search on the first part of a record, tested on the rest."""

    def __init__(self, record: Record, held: NDArray[np.bool_], tell: Callable[[str], None]) -> None:
        self.record, self.held, self.tell = record, held, tell
        self.looks: list[int] = []

    def errors(self, fitted: Fit) -> Errors:
        """Held-out errors of a fit of the first part."""
        return held_out_errors(fitted, self.record, self.held)

    def improvement(self, before: Errors, after: Errors) -> tuple[float, float, float]:
        """Held-out error after over before.

        Of the disk, which is chaotic, at the horizon of comparison; of a pendulum over the whole run.
        """
        if before.unit == "rad":
            return whole_improvement(before, after)
        return improvement(before, after, comparison_horizon(before))

    def run(
        self, base: Fit, whole: Fit, before: Errors
    ) -> tuple[Fit, Fit, Errors, list[Step], list[list[Scored]]]:
        """Add effects until none passes; fits of the first part and of all data, errors, what was done."""
        accepted: list[Step] = []
        scans: list[list[Scored]] = []
        current = State(base, whole, before)
        while len(accepted) < _MOST:
            self.tell("scoring candidates" + (" for a further effect" if accepted else ""))
            scanned = self._score(current.part)
            scans.append(sorted(scanned.scored, key=lambda s: -s.chi2))
            found = self._single(current, scanned) or self._pair(current, scanned)
            if found is None:
                break
            step, current = found
            accepted.append(step)
        return current.part, current.whole, current.errors, accepted, scans

    def _score(self, fitted: Fit) -> Scan:
        """Score every candidate around the fit and, where it does not explain the data, around a looser one.

        A chaotic model that is wrong shows what it lacks only where it is held loosely; weak effects show
        where it is held tightly. The scan with the stronger candidate counts.
        """
        scans = []
        looks = 0
        for current in dict.fromkeys((fitted, loosened(fitted, _SCATTER))):
            rippled = sorted(scan_ripples(current), key=lambda s: -s.chi2)
            best = [s.candidate for s in rippled[:1]]
            scans.append(scan(current, [*library(current.model), *best]))
            looks += len(scans[-1].scored) + len(rippled)
        self.looks.append(looks)
        return max(scans, key=lambda s: max((c.chi2 for c in s.scored if c.physical), default=0.0))

    def _single(self, current: State, scanned: Scan) -> tuple[Step, State] | None:
        passing = [
            s for s in scanned.scored if s.physical and not s.absorbed and s.p * self.looks[-1] < ALPHA
        ]
        passing.sort(key=lambda s: -round(s.chi2, 3))
        trials = []
        for s in passing[:_TRIED]:
            self.tell(f"trying {s.candidate.title}")
            trials.append(self._try(current.part, [s.candidate], list(s.amplitudes)))
        return self._accept(current, [t for t in trials if t], scanned, self.looks[-1])

    def _pair(self, current: State, scanned: Scan) -> tuple[Step, State] | None:
        best = scanned.pairs()
        trials = []
        for a, b, fall in best[:_TRIED]:
            columns = len(a.amplitudes) + len(b.amplitudes)
            same = a.candidate.effect.name == b.candidate.effect.name
            if same or chi2.sf(fall, columns) * len(best) >= ALPHA:
                continue
            self.tell(f"trying {a.candidate.title} with {b.candidate.title}")
            trials.append(self._try(current.part, [a.candidate, b.candidate], [0.0] * columns))
        return self._accept(current, [t for t in trials if t], scanned, len(best))

    def _try(self, current: Fit, candidates: list[Candidate], start: list[float]) -> Trial | None:
        try:
            fitted = extend(current, [c.effect for c in candidates], start)
            trial = Trial(candidates, fitted, fitted)
        except FitError:
            return None
        return trial if trial.physical and trial.fit.converged else None

    def _accept(
        self, current: State, trials: list[Trial], scanned: Scan, looks: int
    ) -> tuple[Step, State] | None:
        """The best trial that passes all tests."""
        trials = [t for t in trials if t.fit.level >= current.part.level and t.needed]
        if not trials:
            return None
        # chi2 compares only where the models are held equally tightly.
        level = min(t.fit.level for t in trials)
        trials = [replace(t, compared=at_level(t.fit, level)) for t in trials]
        unit = min(trials, key=lambda t: t.compared.chi2).compared.inflation(at_level(current.part, level))
        # Equal ones, like a slip and a relaxation at one drive, come in the library's order.
        trials = sorted(trials, key=lambda t: round(t.criterion(unit), 3))
        least = trials[0].criterion(unit)
        # Where the best form fails a test, a clearly worse one is not named instead.
        for trial in (t for t in trials if t.criterion(unit) - least <= 2 * NATS):
            ratio = self._held_ratio(current.part, trial.fit)
            whole = self._try(current.whole, trial.candidates, trial.amplitudes) if ratio[2] < 1.0 else None
            if whole is None:
                continue
            before, after = self._level(current.whole, whole.fit)
            fall = (before.chi2 - after.chi2) / after.inflation(before)
            p = min(float(chi2.sf(fall, len(trial.amplitudes))) * looks, 1.0)
            if p >= ALPHA:
                continue
            try:
                errors = self.errors(trial.fit)
            except FitError:
                continue
            if not self._worse(current.errors, errors):
                others = self._alternatives(trial, trials, scanned, unit)
                return Step(trial.candidates, fall, p, ratio, others), State(trial.fit, whole.fit, errors)
        return None

    def _level(self, one: Fit, other: Fit) -> tuple[Fit, Fit]:
        """Two fits of the same data, held equally tightly."""
        level = min(one.level, other.level)
        return at_level(one, level), at_level(other, level)

    def _held_ratio(self, before: Fit, after: Fit) -> tuple[float, float, float]:
        """Cost of the held-out frames after over before, all parameters held, with its 95 % interval."""
        record = self.record.part(self.held)
        level = min(before.level, after.level)
        costs = self._level(held(before, record, level), held(after, record, level))
        return cost_improvement(frame_costs(costs[0]), frame_costs(costs[1]), record)

    def _worse(self, before: Errors, after: Errors) -> bool:
        """Whether a chaotic model's forecasts get worse beyond doubt at some horizon."""
        return before.unit == "m" and any(improvement(before, after, h)[1] > _WORSE for h in before.horizons)

    def _alternatives(
        self, chosen: Trial, trials: list[Trial], scanned: Scan, unit: float
    ) -> list[Alternative]:
        listed = [s.candidate for s in scanned.scored]
        best = chosen.criterion(unit)
        result = []
        for trial in trials:
            nats = (trial.criterion(unit) - best) / 2
            if trial is chosen or nats > NATS or len(trial.candidates) != len(chosen.candidates):
                continue
            for mine, other in zip(chosen.candidates, trial.candidates, strict=True):
                if mine.effect == other.effect:
                    continue
                known = mine in listed and other in listed
                likeness = scanned.likeness(listed.index(mine), listed.index(other)) if known else 0.0
                if likeness > _SUPERSET and other.parameters > mine.parameters:
                    continue  # the chosen form with something more that the data do not ask for
                effect = other.effect.replace(
                    **{p: trial.fit.parameters[f"{other.effect.name}.{p}"] for p in other.effect.amplitudes}
                )
                result.append(
                    Alternative(mine.effect.name, effect, other.title, other.effect.equation, nats, likeness)
                )
        return result
