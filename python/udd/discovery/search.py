"""The search for effects: score, fit the best in full, test, add, and begin again."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, ncx2

from udd.errors import FitError
from udd.fitting import Fit, Record, at_level, extend, loosened

from .bearing import ALPHA, borne_out, same_level
from .candidates import Candidate, library
from .coordinates import Coordinate
from .curves import Curve, scan_curves
from .formulas import Formula, formulas_for
from .heldout import (
    Errors,
    Ratio,
    comparison_horizon,
    held_out_errors,
    improvement,
    whole_improvement,
)
from .located import fit_curve, fit_formula
from .results import Alternative, Witness
from .scan import Scan, Scored, physical, scan, strongest_ripple
from .together import together

#: Forms of an effect whose fits differ by less than this many units of log-likelihood are not told apart.
NATS = 10.0
_SUPERSET = 0.95  # a form with more parameters and this likeness is the same form with more freedom
_WORSE = 1.1  # an effect is refused if the lower end of the errors' ratio exceeds this at some horizon
_EXPLAINED = 1.6  # chi2 per degree of freedom below which nothing strong is missing
_SCATTER = 3.0  # candidates are scored around a fit whose chi2 per degree of freedom is below this
_DIFFERENT = 0.02  # of the noise: laws whose fits differ by less are the same
_TRIED = 6  # of the best candidates, fitted in full
_MOST = 3  # effects added
_CURVES = 2  # of the likeliest, located
_FORMULAS = 3  # for each, fitted in full


@dataclass(frozen=True)
class Step:
    """An addition that was accepted: one candidate, two or three together, or a curve.

    Attributes
    ----------
    candidates : list of Candidate
    curve : Curve or None
        The curve that was located, where that is what was added or what a formula was found for.
    chi2, p : float
        By how much chi2 fell, and the probability of that by chance.
    ratio : tuple of float
        Cost of the held-out frames after over before, with its 95 % interval.
    witness : {"held", "fitted", "halves"}
        What bears it out, see :func:`udd.discovery.bearing.borne_out`.
    alternatives : list of Alternative
    price : float
        What its freedom costs, in chi2; more for a formula, and for a curve, than for what physics knows.
    """

    candidates: list[Candidate]
    curve: Curve | None
    chi2: float
    p: float
    ratio: Ratio
    witness: Witness
    alternatives: list[Alternative]
    price: float


@dataclass(frozen=True)
class State:
    """Where the search stands: fits of the first part and of all data, and held-out errors."""

    part: Fit
    whole: Fit
    errors: Errors


@dataclass(frozen=True)
class Look:
    """What the scores around one fit say.

    Attributes
    ----------
    fit : Fit
    library : Scan
    curves : list of Curve
        The likeliest first.
    looks : int
        How many scores could have been the best, around all fits that were tried.
    """

    fit: Fit
    library: Scan
    curves: list[Curve]
    looks: int

    def passing(self) -> list[Scored]:
        """The candidates that neither chance nor a film's faults explain, the strongest first."""
        faults = self.fit.faults
        usable = [
            s
            for s in self.library.scored
            if s.physical and not s.absorbed and s.p * self.looks < ALPHA and s.chi2 > faults
        ]
        return sorted(usable, key=lambda s: -round(s.chi2, 3))

    def nats(self, scored: Scored) -> float:
        """A candidate's gain over nothing, its parameters paid for, as a curve's evidence counts."""
        return (scored.chi2 - scored.candidate.parameters * _price(self.fit)) / 2

    def strongest(self) -> float:
        """The gain of the best explanation."""
        singles = [self.nats(s) for s in self.library.scored if s.physical]
        return max([c.evidence for c in self.curves] + singles, default=0.0)


def _wider(look: Look) -> Look:
    """With the surfaces over two coordinates."""
    found = scan_curves(look.fit, only=lambda _slot, own: len(own) == 2, pairs=True)
    curves = sorted(look.curves + found.curves, key=lambda c: -c.evidence)
    return replace(look, curves=curves, looks=look.looks + found.looks)


def _price(fitted: Fit) -> float:
    """What a parameter costs, in chi2 (BIC)."""
    return math.log(np.isfinite(fitted.misfit).sum())


@dataclass(frozen=True)
class Trial:
    """A proposal fitted in full: candidates with free amplitudes, a located curve, or a formula for one.

    Attributes
    ----------
    candidates : list of Candidate
        The effects, as they were proposed.
    fit, compared : Fit
        The fit, and the same held as tightly as those that it is compared with.
    names : list of str
        The parameters that came in with it.
    price : float
        What its freedom costs, in chi2 (BIC).
    freedom : float
        How many numbers were found for it.
    curve : Curve or None
        What was located.
    formula : Formula or None
        What the curve is written as.
    """

    candidates: list[Candidate]
    fit: Fit
    compared: Fit
    names: list[str]
    price: float
    freedom: float
    curve: Curve | None = None
    formula: Formula | None = None

    @property
    def amplitudes(self) -> list[float]:
        """The fitted values of these parameters."""
        return [self.fit.parameters[name] for name in self.names]

    @property
    def is_curve(self) -> bool:
        """Whether it is a curve without a formula."""
        return self.curve is not None and self.formula is None

    def criterion(self, unit: float) -> float:
        """chi2 in a common unit with the price of the freedom: the smaller the better."""
        return self.compared.chi2 / unit + self.price

    @property
    def handicap(self) -> float:
        """By how much chi2 must be better than that of an effect of the library."""
        return 0.0 if self.curve is None else 3 * NATS if self.formula is None else 2 * NATS

    @property
    def needed(self) -> bool:
        """Whether each of several candidates is needed beside the others."""
        if len(self.candidates) < 2:
            return True
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
        if self.curve is not None:
            return True
        values, errors = self.fit.parameters, self.fit.errors
        return all(
            physical(c, [values[n] for n in c.amplitude_names], [errors[n] for n in c.amplitude_names])
            for c in self.candidates
        )


def _of_library(current: Fit, candidates: list[Candidate], start: list[float]) -> Trial | None:
    """Effects of the library with free amplitudes."""
    try:
        fitted = extend(current, [c.effect for c in candidates], start)
    except FitError:
        return None
    names = [name for c in candidates for name in c.amplitude_names]
    price = _price(fitted) * sum(c.parameters for c in candidates)
    trial = Trial(candidates, fitted, fitted, names, price, len(names))
    return trial if trial.physical and fitted.converged else None


def _of_curve(current: Fit, curve: Curve) -> Trial | None:
    """A curve, located in full."""
    try:
        kind = "curve" if len(curve.coordinates) == 1 else "surface"
        located = fit_curve(current, curve, _unused(current, kind))
    except FitError:
        return None
    if not located.fit.converged:
        return None
    candidate = Candidate(located.effect, curve.title)
    return Trial(
        [candidate], located.fit, located.fit, [], 2 * located.price, located.curve.df, located.curve
    )


def _of_formula(current: Fit, curve: Curve, written: Formula) -> Trial | None:
    """A formula for a curve, all its constants free."""
    name = _unused(current, "formula")
    try:
        fitted = fit_formula(current, curve, written, name)
    except FitError:
        return None
    effect = fitted.model.effects[-1]
    names = [f"{name}.{p}" for p in effect.parameters]
    price, free = _price(fitted) * len(names), len(names)
    trial = Trial([Candidate(effect, effect.title)], fitted, fitted, names, price, free, curve, written)
    return trial if fitted.converged else None


def _fitted(trials: list[Trial | None]) -> list[Trial]:
    """Those that could be fitted."""
    return [t for t in trials if t]


def _one_of_each(trials: list[Trial]) -> list[Trial]:
    """The best of those that tried one effect with several values of a shape that a fit then found."""
    found: dict[object, Trial] = {}
    for trial in sorted(trials, key=lambda t: (-t.fit.level, t.fit.chi2)):
        effect = trial.candidates[0].effect
        fixed = [effect.parameters[p.name] for p in effect.spec.parameters if not p.sought]
        found.setdefault((effect.name, effect.momentum, *fixed), trial)
    return [trial for trial in trials if trial in found.values()]


def _states_first(curves: list[Curve]) -> list[Curve]:
    """The likeliest first, but after those as likely what stands for states in a roundabout way.

    Curves over time take up anything slow, and curves over the direction can do much of what those over Y
    and Z do.
    """

    def handicap(own: Coordinate) -> float:
        return 2 * NATS if own.name == "t" else NATS if own.angle and own.text != own.name else 0.0

    return sorted(curves, key=lambda c: -c.evidence + handicap(c.coordinates[0]))


def _same(one: Fit, other: Fit) -> bool:
    """Whether two models make the same motion: one law in other words."""
    sd = one.noise.sd(one.record, one.states[:, 0])
    return bool(np.nanmax(np.abs(one.misfit - other.misfit) / sd) < _DIFFERENT)


def _unused(current: Fit, name: str) -> str:
    """A name that no effect of the model has yet."""
    taken = {effect.name for effect in current.model.effects}
    return next(n for n in (name, *(f"{name}{k}" for k in range(2, 9))) if n not in taken)


def _cheaper(found: tuple[Step, State], steps: Sequence[Step], start: State, end: State) -> bool:
    """Whether one step explains the data as well as several from the same start, their freedom paid for."""
    step, state = found
    several, one = same_level(end.part, state.part)
    unit = one.inflation(at_level(start.part, one.level))
    return one.chi2 / unit + step.price < several.chi2 / unit + sum(s.price for s in steps)


@dataclass(frozen=True)
class Outcome:
    """Where a search ended: fits of the first part and of all data, errors, what was seen and done."""

    part: Fit
    whole: Fit
    errors: Errors
    accepted: list[Step]
    looks: list[Look]


class Search:
    """The search on the first part of a record, tested on the rest."""

    def __init__(
        self,
        record: Record,
        held: NDArray[np.bool_],
        tell: Callable[[str], None],
        unit: float = 1.0,
        given: Sequence[Candidate] = (),
    ) -> None:
        self.record, self.held, self.tell = record, held, tell
        self.unit, self.given = unit, given

    def errors(self, fitted: Fit) -> Errors:
        """Held-out errors of a fit of the first part."""
        return held_out_errors(fitted, self.record, self.held, unit=self.unit)

    def improvement(self, before: Errors, after: Errors) -> Ratio:
        """Held-out error after over before.

        Of the disk, which is chaotic, at the horizon of comparison; of a pendulum over the whole run.
        """
        if before.unit == "rad":
            return whole_improvement(before, after)
        return improvement(before, after, comparison_horizon(before))

    def run(self, base: Fit, whole: Fit, before: Errors) -> Outcome:
        """Add effects until none passes."""
        accepted: list[Step] = []
        looks: list[Look] = []
        states = [State(base, whole, before)]
        while len(accepted) < _MOST:
            self.tell("scoring candidates" + (" for a further effect" if accepted else ""))
            look = self._look(states[-1].part)
            found = self._known(states[-1], look)
            if found is None:
                look = _wider(look)
                found = self._located(states[-1], look)
            looks.append(look)
            if found is None:
                break
            accepted.append(found[0])
            states.append(found[1])
            self._prune(accepted, states, looks)
        self._simplify(accepted, states, looks)
        end = states[-1]
        return Outcome(end.part, end.whole, end.errors, accepted, looks)

    def _look(self, fitted: Fit) -> Look:
        """Score every candidate and curve around the fit and, where it explains little, around a looser one.

        A chaotic model that is wrong shows what it lacks only where it is held loosely; weak effects show
        where it is held tightly. The scores with the stronger explanation count.
        """

        def look(current: Fit) -> Look:
            ripple, frequencies = strongest_ripple(current)
            best = [ripple.candidate] if ripple else []
            scanned = scan(current, [*library(current.model, self.given), *best])
            curves = scan_curves(current)
            looks = len(scanned.scored) + frequencies + curves.looks
            return Look(current, scanned, curves.curves, looks)

        found = together(look, dict.fromkeys((fitted, loosened(fitted, _SCATTER))))
        return replace(max(found, key=Look.strongest), looks=sum(look.looks for look in found))

    def _known(self, current: State, look: Look) -> tuple[Step, State] | None:
        """The best addition of the library that passes: an effect, or some of them together.

        What physics knows comes first: as long as something else is missing too, a curve bends to explain a
        part of that. Once effects of the library explain the data, formulas compete with them.
        """
        passing = look.passing()
        curve = next((c for c in _states_first(look.curves) if len(c.coordinates) == 1), None)
        with ThreadPoolExecutor(1) as beside:  # a search in Python beside fits in the core
            sought = beside.submit(self._formulas, current, curve) if curve and passing else None
            singles = self._singles(current, passing)
        if curve and sought and singles and min(t.fit.scatter for t in singles) < _EXPLAINED:
            # Formulas that may explain the data as well as what the library has.
            known = max(look.nats(s) for s in passing)
            rivals = [f for f in sought.result() if curve.evidence + f.nats > known - NATS]
            singles += self._written(current, curve, rivals)
        return (
            self._accept(current, singles, look)
            or self._group(current, look, 2)
            or self._group(current, look, 3)
        )

    def _located(self, current: State, look: Look) -> tuple[Step, State] | None:
        """The best curve or surface that passes."""
        faults = look.fit.faults
        shown = [c for c in look.curves if c.p * look.looks < ALPHA and c.chi2 > faults]
        return self._accept(current, self._curves(current, _states_first(shown)[:_CURVES]), look)

    def _written(self, current: State, curve: Curve, formulas: list[Formula]) -> list[Trial]:
        """Formulas for a curve, fitted."""
        self._trying([f.text for f in formulas])
        return _fitted(together(lambda written: _of_formula(current.part, curve, written), formulas))

    def _trying(self, titles: list[str]) -> None:
        if titles:
            self.tell(f"trying {titles[0]}" + (f" and {len(titles) - 1} more" if titles[1:] else ""))

    def _formulas(self, current: State, curve: Curve) -> list[Formula]:
        observations = int(np.isfinite(current.part.misfit).sum())
        taken = current.part.model.state_names
        return formulas_for(curve, observations, taken=taken).formulas[:_FORMULAS]

    def _singles(self, current: State, passing: list[Scored]) -> list[Trial]:
        best = passing[:_TRIED]
        self._trying([s.candidate.title for s in best])
        found = together(lambda s: _of_library(current.part, [s.candidate], list(s.amplitudes)), best)
        return _one_of_each(_fitted(found))

    def _group(self, current: State, look: Look, size: int) -> tuple[Step, State] | None:
        """Several effects at once that pass only together."""
        best = look.library.groups(size)
        likely = [
            [s.candidate for s in group]
            for group, fall in best[:_TRIED]
            if len({s.candidate.effect.name for s in group}) == size
            and fall > look.fit.faults
            and chi2.sf(fall, sum(len(s.amplitudes) for s in group)) * len(best) < ALPHA
        ]
        self._trying([" with ".join(c.title for c in group) for group in likely])

        def tried(group: list[Candidate]) -> Trial | None:
            return _of_library(current.part, group, [0.0] * sum(len(c.amplitude_names) for c in group))

        return self._accept(current, _fitted(together(tried, likely)), replace(look, looks=len(best)))

    def _curves(self, current: State, likely: list[Curve]) -> list[Trial]:
        """The likeliest curves, as splines and by short formulas."""
        trials: list[Trial] = []
        self._trying([curve.title for curve in likely])
        for located in _fitted(together(lambda curve: _of_curve(current.part, curve), likely)):
            trials.append(located)
            if located.curve is not None:
                trials += self._written(current, located.curve, self._formulas(current, located.curve))
        return trials

    def _prune(self, accepted: list[Step], states: list[State], looks: list[Look]) -> None:
        """Leave out effects that a later one makes needless.

        A wrong form of the library takes up a part of what an effect outside of it does.
        """
        for k in range(len(accepted) - 1):
            last = accepted[-1]
            if last.curve is None:
                return
            title = accepted[k].candidates[0].title
            self.tell(f"trying {last.curve.title} instead of {title}")
            before = states[k]
            found = self._accept(before, self._curves(before, [last.curve]), looks[k])
            if found is None:
                continue
            if _cheaper(found, accepted[k:], states[k], states[-1]):
                accepted[k:], states[k + 1 :], looks[k + 1 :] = [found[0]], [found[1]], []
                return

    def _simplify(self, accepted: list[Step], states: list[State], looks: list[Look]) -> None:
        """Put one curve, or a formula for it, in the place of effects that explain the data no better.

        Where no effect of the library is right, some of them together may come near.
        """
        if len(accepted) < 2 or any(step.curve for step in accepted):
            return
        self.tell(f"trying one law instead of {len(accepted)}")
        found = self._located(states[0], looks[0])
        if found is not None and _cheaper(found, accepted, states[0], states[-1]):
            accepted[:], states[1:], looks[1:] = [found[0]], [found[1]], []

    def _accept(self, current: State, trials: list[Trial], look: Look) -> tuple[Step, State] | None:
        """The best trial that passes all tests."""
        trials = [t for t in trials if t.fit.level >= current.part.level and t.needed]
        if not trials:
            return None
        # chi2 compares only where the models are held equally tightly.
        level = min(t.fit.level for t in trials)
        trials = [replace(t, compared=at_level(t.fit, level)) for t in trials]
        unit = min(trials, key=lambda t: t.compared.chi2).compared.inflation(at_level(current.part, level))
        # Equal ones, like a slip and a relaxation at one drive, come in the library's order; what physics
        # knows comes before a formula, and a formula before a curve, that fit about as well.
        trials = sorted(trials, key=lambda t: round(t.criterion(unit) + t.handicap, 3))
        least = trials[0].criterion(unit) + trials[0].handicap
        # Where the best form fails a test, a clearly worse one is not named instead.
        for trial in (t for t in trials if t.criterion(unit) + t.handicap - least <= 2 * NATS):
            whole = self._again(current.whole, trial)
            if whole is None:
                continue
            before, after = same_level(current.whole, whole.fit)
            inflation = after.inflation(before)
            fall = (before.chi2 - after.chi2) / inflation
            # What a film's faults make up is no sum of squares of chance alone.
            p = min(float(ncx2.sf(fall, trial.freedom, after.faults / inflation)) * look.looks, 1.0)
            if p >= ALPHA:
                continue
            part, rest = (current.part, trial.fit), self.record.part(self.held)
            ratio, witness = borne_out(part, (before, after), rest, trial.names, self.unit)
            if witness is None:
                continue
            try:
                errors = self.errors(trial.fit)
            except FitError:
                continue
            if not self._worse(current.errors, errors):
                others = self._alternatives(trial, trials, look.library, unit)
                price = trial.price + trial.handicap
                step = Step(trial.candidates, trial.curve, fall, p, ratio, witness, others, price)
                return step, State(trial.fit, whole.fit, errors)
        return None

    def _again(self, whole: Fit, trial: Trial) -> Trial | None:
        """The same proposal fitted to all data."""
        if trial.curve is None:
            return _of_library(whole, trial.candidates, trial.amplitudes)
        if trial.formula is None:
            return _of_curve(whole, trial.curve)
        return _of_formula(whole, trial.curve, trial.formula)

    def _worse(self, before: Errors, after: Errors) -> bool:
        """Whether a chaotic model's forecasts get worse beyond doubt at some horizon."""
        return before.unit != "rad" and any(
            improvement(before, after, h)[1] > _WORSE for h in before.horizons
        )

    def _says_less(self, formula: Trial, chosen: Trial, nats: float) -> bool:
        """Whether a formula is the chosen law in other words, or has more constants for nothing."""
        return _same(formula.compared, chosen.compared) or (
            nats > 0 and len(formula.names) > len(chosen.names)
        )

    def _alternatives(
        self, chosen: Trial, trials: list[Trial], scanned: Scan, unit: float
    ) -> list[Alternative]:
        listed = [s.candidate for s in scanned.scored]
        best = chosen.criterion(unit)
        result = []
        for trial in trials:
            nats = (trial.criterion(unit) - best) / 2
            if (
                trial is chosen
                or nats > NATS
                or len(trial.candidates) != len(chosen.candidates)
                or trial.is_curve
                or (trial.formula is not None and self._says_less(trial, chosen, nats))
            ):
                continue
            for mine, other in zip(chosen.candidates, trial.candidates, strict=True):
                if mine.effect == other.effect:
                    continue
                known = mine in listed and other in listed
                likeness = scanned.likeness(listed.index(mine), listed.index(other)) if known else 0.0
                if likeness > _SUPERSET and other.parameters > mine.parameters:
                    continue  # the chosen form with something more that the data do not ask for
                named = {p: f"{other.effect.name}.{p}" for p in other.effect.parameters}
                fitted = trial.fit.parameters
                effect = other.effect.replace(**{p: fitted[n] for p, n in named.items() if n in fitted})
                result.append(
                    Alternative(mine.effect.name, effect, other.title, other.effect.equation, nats, likeness)
                )
        return result
