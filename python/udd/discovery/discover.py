"""The loop's second half: which effect the model lacks."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.stats import chi2

from udd.effects import Effect
from udd.errors import FitError
from udd.fitting import Fit, Record, extend, fit_record, loosened, record_of
from udd.measurement import Measurement
from udd.models import Model

from .candidates import Candidate, library
from .heldout import Errors, cost_improvement, held_out_errors, improvement, whole_improvement
from .scan import Scan, Scored, physical, scan, scan_ripples

#: Chance that a record without any effect is said to have one, over all candidates together.
ALPHA = 1e-3
#: Forms of an effect whose fits differ by less than this many units of log-likelihood are not told apart.
NATS = 10.0
#: The share of the record that effects are sought in; the rest is held out.
TRAIN = 0.6
#: Forms more alike than this move the same data in the same way, like a slip c Z and a relaxation -b W Z at
#: one drive.
SAME = 0.9999
_SUPERSET = 0.95  # a form with more parameters and this likeness is the same form with more freedom
_WORSE = 1.1  # an effect is refused if the lower end of the errors' ratio exceeds this at some horizon
_SCATTER = 3.0  # candidates are scored around a fit whose chi2 per degree of freedom is below this
_UNEXPLAINED = 2.0  # chi2 per degree of freedom above which a model does not explain its data, whatever lacks
_TRIED = 6  # of the best candidates, fitted in full
_MOST = 3  # effects added
_SHORTEST = 60  # frames


@dataclass(frozen=True)
class Found:
    """An effect that was added, with its numbers and its evidence.

    Attributes
    ----------
    effect : Effect
        With the fitted parameters (all data).
    title, equation, expression : str
        In prose, as the library writes it, and with the numbers in it.
    parameters, errors : dict of str to float
        The fitted parameters with standard errors.
    chi2 : float
        By how much chi2 fell when it was added, in units of the fit's scatter.
    p : float
        Probability of so large a fall by chance, all candidates counted.
    ratio : tuple of float
        Cost of the held-out frames after over before, all parameters held, with its 95 % interval.
    """

    effect: Effect
    title: str
    equation: str
    expression: str
    parameters: dict[str, float]
    errors: dict[str, float]
    chi2: float
    p: float
    ratio: tuple[float, float, float]

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads."""
        return {
            "name": self.effect.name,
            "momentum": self.effect.momentum,
            "title": self.title,
            "equation": self.equation,
            "expression": self.expression,
            "parameters": {n: {"value": v, "se": self.errors.get(n)} for n, v in self.parameters.items()},
            "chi2": self.chi2,
            "p": self.p,
            "held_out_cost_ratio": dict(zip(("value", "low", "high"), self.ratio, strict=True)),
        }


@dataclass(frozen=True)
class Alternative:
    """A candidate that the data cannot tell from one that was chosen.

    Attributes
    ----------
    instead_of : str
        Name of the effect that it could replace.
    effect : Effect
    title, equation : str
    nats : float
        By how much worse it fits, in units of log-likelihood; negative where it fits better.
    likeness : float
        How alike the two act on these data, 0 to 1; 1 cannot be told apart at any length of record.
    """

    instead_of: str
    effect: Effect
    title: str
    equation: str
    nats: float
    likeness: float

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads."""
        return {
            "instead_of": self.instead_of,
            "name": self.effect.name,
            "momentum": self.effect.momentum,
            "title": self.title,
            "equation": self.equation,
            "nats_worse": self.nats,
            "likeness": self.likeness,
        }


@dataclass(frozen=True)
class Discovery:
    """What a model lacks, given measured motion.

    Attributes
    ----------
    verdict : str
        ``"nothing missing"``, ``"effect identified"`` or ``"effect present, form not identified"``.
    baseline, fit : Fit
        The model without and with the added effects, each fitted to all data.
    effects : list of Found
        The effects that were added; empty when nothing is missing.
    alternatives : list of Alternative
        Candidates that the data cannot tell apart from the chosen ones.
    error_before, error_after : Errors
        The same held-out errors, of models fitted without the held-out data; the noise floor beside them.
    ratio : tuple of float
        Held-out error after over before, with its 95 % interval: of the disk at :func:`comparison_horizon`,
        of a pendulum over the whole held-out part.
    scans : list of list of Scored
        What the score said of every candidate, for each round of the search, the best first.
    looks : list of int
        How many candidates each round looked at, every frequency counted.
    measurement : Measurement
    split : float
        Time from which the data were held out, s.
    """

    verdict: str
    baseline: Fit
    fit: Fit
    effects: list[Found]
    alternatives: list[Alternative]
    error_before: Errors
    error_after: Errors
    ratio: tuple[float, float, float]
    scans: list[list[Scored]]
    looks: list[int]
    measurement: Measurement
    split: float
    trained: Fit = field(repr=False)

    @property
    def horizon(self) -> float | None:
        """The horizon that `ratio` is taken at, s; None for the whole held-out part."""
        return comparison_horizon(self.error_before) if self.error_before.unit == "m" else None

    @property
    def model(self) -> Model:
        """The refitted model with the effects."""
        return self.fit.model

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads."""
        return {
            "verdict": self.verdict,
            "effects": [found.to_dict() for found in self.effects],
            "alternatives": [other.to_dict() for other in self.alternatives],
            "error_before": self.error_before.to_dict(),
            "error_after": self.error_after.to_dict(),
            "held_out_ratio": dict(zip(("value", "low", "high"), self.ratio, strict=True)),
            "horizon_s": self.horizon,
            "held_out_from_s": self.split,
            "baseline": self.baseline.to_dict(),
            "fit": self.fit.to_dict(),
        }

    def report(self, path: str | os.PathLike[str], **details: Any) -> None:
        """Write a page that a person reads: pictures first, one file. See :func:`udd.report.write`."""
        from udd.report import write

        write(self, path, **details)


def discover(
    measurement: Measurement,
    model: Model,
    free: Iterable[str] | None = None,
    *,
    camera: bool | Iterable[str] = True,
    priors: Mapping[str, tuple[float, float]] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Discovery:
    """Find the effect that a model lacks.

    The model is fitted to the first 60 % of the record. Every effect of the library is scored around that
    fit; the best are fitted in full. An effect is added only if so large a fall of chi2 has a chance below
    0.1 % over all candidates together (in those 60 % for white noise, and in all data with the misfits' own
    colour), its amplitudes are physical, and the last 40 % are explained better beyond doubt: with all
    parameters held, the 95 % interval of the costs' ratio excludes 1, and at no horizon do forecasts get
    worse. All coefficients are refitted and the search goes on; single effects that do not pass are tried in
    pairs. Forms that the data cannot tell apart are named. Where no effect passes but the model does not
    explain the data (chi2 per degree of freedom above 2), an effect is present that the library does not
    hold.

    Parameters
    ----------
    measurement : Measurement
    model : Disk or Pendulum
        The known model; its parameters are the start and the priors' means.
    free, camera, priors
        As for :func:`udd.fit`.
    progress : callable, optional
        Told in a few words what is being done.

    Returns
    -------
    Discovery

    Raises
    ------
    FitError
        The record is too short, or the model cannot be fitted to it.

    Examples
    --------
    A pendulum that the air resists with the square of its speed; the model knows viscous friction only.

    >>> import numpy as np, udd
    >>> t = np.arange(0, 60, 0.05)
    >>> truth = udd.Pendulum(1.0, k0=0.01, effects=[udd.effects.quadratic_drag(c=0.05)])
    >>> theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1]
    >>> noise = 2e-3 * np.random.default_rng(0).standard_normal(len(t))
    >>> found = udd.discover(udd.Measurement(t, {"theta": theta + noise}), udd.Pendulum(1.0, k0=0.03))
    >>> [effect.title for effect in found.effects]
    ['quadratic drag']
    """
    tell = progress or (lambda _text: None)
    free = None if free is None else list(free)
    record = record_of(measurement)
    n = len(record.t)
    if n < _SHORTEST:
        raise FitError(f"the record has {n} frames; to find an effect and test it takes at least {_SHORTEST}")
    first = int(TRAIN * n)
    options: dict[str, Any] = {"camera": camera, "priors": priors}

    tell("fitting the known model")
    base = fit_record(measurement, record.part(slice(0, first)), model, free, **options)
    baseline = fit_record(measurement, record, model, free, **options)
    search = _Search(record, first, tell)
    before = search.errors(base)
    trained, final, after, accepted, scans = search.run(base, baseline, before)
    found = [f for step in accepted for f in _describe(step, final)]
    others = [a for step in accepted for a in step.alternatives]
    doubtful = [a for a in others if a.likeness < SAME]
    if found:
        verdict = "effect present, form not identified" if doubtful else "effect identified"
    else:
        unexplained = baseline.scatter > _UNEXPLAINED
        verdict = "effect present, form not identified" if unexplained else "nothing missing"
    return Discovery(
        verdict=verdict,
        baseline=baseline,
        fit=final,
        effects=found,
        alternatives=others,
        error_before=before,
        error_after=after,
        ratio=search.improvement(before, after) if found else (1.0, 1.0, 1.0),
        scans=scans,
        looks=search.looks,
        measurement=measurement,
        split=float(record.t[first]),
        trained=trained,
    )


def comparison_horizon(errors: Errors) -> float:
    """The horizon at which a disk's models are compared: a second, or the nearest below that there is, s."""
    return max((h for h in errors.horizons if h <= 1.0), default=errors.horizons[0])


@dataclass(frozen=True)
class _Step:
    """An addition that was accepted: one candidate, or a pair."""

    candidates: list[Candidate]
    chi2: float
    p: float
    ratio: tuple[float, float, float]
    alternatives: list[Alternative]


@dataclass(frozen=True)
class _State:
    """Where the search stands: fits of the first part and of all data, and held-out errors."""

    part: Fit
    whole: Fit
    errors: Errors


@dataclass(frozen=True)
class _Trial:
    """A combination of candidates fitted in full."""

    candidates: list[Candidate]
    fit: Fit

    @property
    def names(self) -> list[str]:
        return [name for c in self.candidates for name in c.amplitude_names]

    @property
    def amplitudes(self) -> list[float]:
        return [self.fit.parameters[name] for name in self.names]

    def criterion(self, unit: float) -> float:
        """chi2 in a common unit with the price of a parameter (BIC): the smaller the better."""
        price = math.log(np.isfinite(self.fit.misfit).sum())
        return self.fit.chi2 / unit + price * sum(c.parameters for c in self.candidates)

    @property
    def physical(self) -> bool:
        values, errors = self.fit.parameters, self.fit.errors
        return all(
            physical(c, [values[n] for n in c.amplitude_names], [errors[n] for n in c.amplitude_names])
            for c in self.candidates
        )


class _Search:
    """The search on the first part of a record, tested on the rest."""

    def __init__(self, record: Record, first: int, tell: Callable[[str], None]) -> None:
        self.record, self.first, self.tell = record, first, tell
        self.looks: list[int] = []

    def errors(self, fitted: Fit) -> Errors:
        return held_out_errors(fitted, self.record, self.first)

    def improvement(self, before: Errors, after: Errors) -> tuple[float, float, float]:
        """Held-out error after over before.

        Of the disk, which is chaotic, at the horizon of comparison; of a pendulum over the whole run.
        """
        if before.unit == "rad":
            return whole_improvement(before, after)
        return improvement(before, after, comparison_horizon(before))

    def run(
        self, base: Fit, whole: Fit, before: Errors
    ) -> tuple[Fit, Fit, Errors, list[_Step], list[list[Scored]]]:
        """Add effects until none passes; fits of the first part and of all data, errors, what was done."""
        accepted: list[_Step] = []
        scans: list[list[Scored]] = []
        current = _State(base, whole, before)
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

    def _single(self, current: _State, scanned: Scan) -> tuple[_Step, _State] | None:
        passing = [
            s for s in scanned.scored if s.physical and not s.absorbed and s.p * self.looks[-1] < ALPHA
        ]
        passing.sort(key=lambda s: -round(s.chi2, 3))
        trials = []
        for s in passing[:_TRIED]:
            self.tell(f"trying {s.candidate.title}")
            trials.append(self._try(current.part, [s.candidate], list(s.amplitudes)))
        return self._accept(current, [t for t in trials if t], scanned, self.looks[-1])

    def _pair(self, current: _State, scanned: Scan) -> tuple[_Step, _State] | None:
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

    def _try(self, current: Fit, candidates: list[Candidate], start: list[float]) -> _Trial | None:
        try:
            trial = _Trial(candidates, extend(current, [c.effect for c in candidates], start))
        except FitError:
            return None
        return trial if trial.physical and trial.fit.converged else None

    def _accept(
        self, current: _State, trials: list[_Trial], scanned: Scan, looks: int
    ) -> tuple[_Step, _State] | None:
        """The best trial that passes all tests."""
        # chi2 compares only where the model is held equally tightly; a form that cannot be is worse.
        tightest = max((t.fit.level for t in trials), default=0)
        trials = [t for t in trials if t.fit.level == tightest >= current.part.level]
        if not trials:
            return None
        held = self.record.part(slice(self.first, None))
        unit = min(trials, key=lambda t: t.fit.chi2).fit.inflation(current.part)
        # Equal ones, like a slip and a relaxation at one drive, come in the library's order.
        trials = sorted(trials, key=lambda t: round(t.criterion(unit), 3))
        least = trials[0].criterion(unit)
        # Where the best form fails a test, a clearly worse one is not named instead.
        for trial in (t for t in trials if t.criterion(unit) - least <= 2 * NATS):
            ratio = cost_improvement(current.part, trial.fit, held)
            whole = self._try(current.whole, trial.candidates, trial.amplitudes) if ratio[2] < 1.0 else None
            if whole is None or whole.fit.level < current.whole.level:
                continue
            fall = (current.whole.chi2 - whole.fit.chi2) / whole.fit.inflation(current.whole)
            p = min(float(chi2.sf(fall, len(trial.amplitudes))) * looks, 1.0)
            if p >= ALPHA:
                continue
            after = self.errors(trial.fit)
            if not self._worse(current.errors, after):
                others = self._alternatives(trial, trials, scanned, unit)
                return _Step(trial.candidates, fall, p, ratio, others), _State(trial.fit, whole.fit, after)
        return None

    def _worse(self, before: Errors, after: Errors) -> bool:
        """Whether a chaotic model's forecasts get worse beyond doubt at some horizon."""
        return before.unit == "m" and any(improvement(before, after, h)[1] > _WORSE for h in before.horizons)

    def _alternatives(
        self, chosen: _Trial, trials: list[_Trial], scanned: Scan, unit: float
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


def _describe(step: _Step, final: Fit) -> list[Found]:
    """The effects of a step, with the numbers of the fit to all data."""
    result = []
    for candidate in step.candidates:
        effect = next(e for e in final.model.effects if e.name == candidate.effect.name)
        names = {p: f"{effect.name}.{p}" for p in effect.parameters}
        result.append(
            Found(
                effect=effect,
                title=candidate.title,
                equation=effect.equation,
                expression=effect.expression,
                parameters=dict(effect.parameters),
                errors={p: final.errors[name] for p, name in names.items() if name in final.errors},
                chi2=step.chi2,
                p=step.p,
                ratio=step.ratio,
            )
        )
    return result
