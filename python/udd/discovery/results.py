"""What a discovery found."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from udd._util.keywords import renamed_attribute
from udd._util.one_line import OneLine
from udd.discovery.nonparametric.curve_scan import Curve
from udd.discovery.scoring.score_scan import Scored
from udd.discovery.validation.by_record import RecordAnswer, sentence
from udd.discovery.validation.held_out_errors import Errors, Ratio, comparison_horizon, lacks_more
from udd.effects import Effect
from udd.fitting import Fit
from udd.fitting.diagnostics import ModelError, Reading, ran_off, rate_of, readings
from udd.fitting.thinning import Thinned
from udd.measurement import Measurement
from udd.models import Model

from .experiment_design import NextExperiment, hints
from .thresholds import Confirmation, RejectionReason

if TYPE_CHECKING:
    from udd.report.document import Report


def _named(ratio: Ratio) -> dict[str, float]:
    """A ratio with its interval, as a machine reads it."""
    return dict(zip(("value", "low", "high"), ratio, strict=True))


@dataclass(frozen=True, repr=False)
class AddedEffect(OneLine):
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
    witness : {"held", "fitted", "halves"}
        What bears it out: that cost, the held-out frames once they are fitted too, or each half of the record
        in alternate stretches.
    curve : Curve or None
        Where it was located without a formula: the curve with its band. The effect is that, or a formula
        for it.
    is_law : bool
        Whether it is a term of the library, or of the user, a power, or a formula of one term.
    tried : str
        What it was called as a candidate, with the shape and the frequency that it was tried with.
    by_record : list of RecordAnswer
        Of several records that were fitted together, what each says of it.
    """

    effect: Effect
    title: str
    equation: str
    expression: str
    parameters: dict[str, float]
    errors: dict[str, float]
    chi2: float
    p: float
    ratio: Ratio
    witness: Confirmation
    curve: Curve | None = None
    is_law: bool = True
    tried: str = ""
    by_record: list[RecordAnswer] = field(default_factory=list)

    def like_a_drift(self, model: Model) -> bool:
        """Whether it was located as a curve over time alone, as the zero of a sensor that drifts is one.

        Not of a disk, which a camera sees.
        """
        over = [] if self.curve is None else [c.name for c in self.curve.coordinates]
        return over == ["t"] and not model.profile.sensor.sees_marks

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
            "held_out_cost_ratio": _named(self.ratio),
            "borne_out_by": self.witness,
            "by_record": [own.to_dict() for own in self.by_record],
        }


@dataclass(frozen=True, repr=False)
class Alternative(OneLine):
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


@dataclass(frozen=True, repr=False)
class RejectedEffect(OneLine):
    """An effect that lowers the held-out error of a model which lacks something, but does not pass the tests.

    Attributes
    ----------
    effect : Effect
        With the parameters fitted to all data.
    title : str
    chi2, p : float
        By how much chi2 falls, in units of what remains at the same frequencies, and the probability of that
        by chance, all candidates, curves and surfaces counted.
    errors : Errors
        Held-out errors of the model with it.
    ratio : tuple of float
        Held-out error with it over that without, as for :attr:`Discovery.ratio`.
    why : {"chance", "drift", "part", "held", "form", "unconfirmed", "records"}
        Why it is not added: chance does as much, in all data or in the part that effects are sought in; a
        slow drift of the sensor's zero explains more; the held-out data do not bear it out; another form that
        fits clearly better does not pass; or it passed, but free runs over the held-out data do not get
        better beyond doubt; or only some of several records want it, though the others could show it.
    by_record : list of RecordAnswer
        Of several records that were fitted together, what each says of it.
    """

    effect: Effect
    title: str
    chi2: float
    p: float
    errors: Errors
    ratio: Ratio
    why: RejectionReason
    by_record: list[RecordAnswer] = field(default_factory=list)

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads."""
        return {
            "name": self.effect.name,
            "momentum": self.effect.momentum,
            "title": self.title,
            "why": self.why,
            "expression": self.effect.expression,
            "chi2": self.chi2,
            "p": self.p,
            "error": self.errors.to_dict(),
            "held_out_ratio": _named(self.ratio),
            "by_record": [own.to_dict() for own in self.by_record],
        }


@dataclass(frozen=True)
class Discovery:
    """What a model lacks, given measured motion.

    Attributes
    ----------
    verdict : str
        ``"nothing missing"``, ``"effect identified"``, ``"effect present, form not identified"``, or
        ``"fits the first part, not confirmed"`` where free runs over the held-out data do not bear it out:
        what that is stands in `rejected`. ``"search not finished"`` where its time was up before anything
        was found.
    baseline, fit : Fit
        The model without and with the added effects, each fitted to all data; the same where none was added.
    effects : list of AddedEffect
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
    curves : list of list of Curve
        The same of every curve that an equation may lack, as a function of anything.
    comparisons : list of int
        How many candidates and curves each round looked at, every frequency counted.
    split : float
        Time from which the data were held out, s; of the first measurement.
    rejected : list of RejectedEffect
        Where an effect is present but none passes: what comes nearest, the best first. Also what passed but
        was not confirmed.
    thinned : list of Thinned
        What became of measurements with more frames than their motion needs: block averages, which the
        measurements of `fit` are then. Empty where all frames were taken as they were.
    budget : float or None
        The seconds that ended the search before it was done, where they did.
    stopped : str or None
        What it was at then.
    excused : list of str or None
        Where parameters of the camera were held and its faults would explain most of what the found model
        leaves, or a part of what was found: titles of the effects that they would explain as well.
    random : list of ModelError
        The random forces that the model needs beside the effects, where such forces alone, like those of a
        support that moves, explain the data about as well: the effects are not identified then.
    held_out : tuple of int
        The numbers of the measurements that were held out whole; none where the last part of each was. Then
        `split` is the time in the first measurement from which pictures show free runs.
    undetermined : tuple of str
        Parameters that the data do not determine, held near what was stated.
    doubts : list of str
        What speaks against naming the form of what was found, in sentences.
    """

    verdict: str
    baseline: Fit
    fit: Fit
    effects: list[AddedEffect]
    alternatives: list[Alternative]
    error_before: Errors
    error_after: Errors
    ratio: Ratio
    scans: list[list[Scored]]
    curves: list[list[Curve]]
    comparisons: list[int]
    split: float
    trained: Fit = field(repr=False)
    rejected: list[RejectedEffect] = field(default_factory=list)
    thinned: list[Thinned] = field(default_factory=list)
    budget: float | None = None
    stopped: str | None = None
    excused: list[str] | None = None
    random: list[ModelError] = field(default_factory=list)
    held_out: tuple[int, ...] = ()
    undetermined: tuple[str, ...] = ()
    doubts: list[str] = field(default_factory=list)

    looks = renamed_attribute("looks", "comparisons")
    refused = renamed_attribute("refused", "rejected")

    def __repr__(self) -> str:
        """The verdict on one line."""
        found = ", ".join(effect.title for effect in self.effects)
        value, low, high = self.ratio
        error = f"; held-out error x {value:.3g} ({low:.3g} to {high:.3g})" if found else ""
        return f"<Discovery: {self.verdict}{': ' if found else ''}{found}{error}>"

    def _repr_html_(self) -> str:
        """The verdict's card, for notebooks."""
        from html import escape

        def numbers(effect: AddedEffect) -> str:
            errors = ((name, value, effect.errors.get(name)) for name, value in effect.parameters.items())
            return ", ".join(
                f"{name} = {value:.5g}" + (f" ± {error:.2g}" if error else "")
                for name, value, error in errors
            )

        items = "".join(
            f"<li>{escape(e.title)}: <code>{escape(e.expression)}</code>, {escape(numbers(e))}</li>"
            for e in self.effects
        )
        head, _, ratio = repr(self)[1:-1].partition("; ")
        return f"<p><b>{escape(head)}</b></p><ul>{items}</ul><p>{escape(ratio)}</p>"

    @property
    def measurement(self) -> Measurement:
        """The first measurement."""
        return self.fit.measurement

    @property
    def horizon(self) -> float | None:
        """The horizon that `ratio` is taken at, s; None for the whole held-out part."""
        return comparison_horizon(self.error_before) if self.error_before.unit != "rad" else None

    @property
    def model(self) -> Model:
        """The refitted model with the effects."""
        return self.fit.model

    @property
    def noise(self) -> list[Reading]:
        """What the frames of each channel are good to, as the record shows it; of means where it was thinned.

        See :class:`udd.fitting.diagnostics.Reading`.
        """
        steps = self.thinned[0].steps if self.thinned else {}
        return [replace(one, step=steps.get(one.name, one.step)) for one in readings(self.fit)]

    @property
    def by_record(self) -> list[tuple[str, list[RecordAnswer]]]:
        """Titles, and what each of several records says: of what was found, and of what only some want."""
        found = [(one.title, one.by_record) for one in self.effects]
        found += [(one.title, one.by_record) for one in self.rejected if one.why == "records"]
        return [own for own in found if own[1]]

    @property
    def remarks(self) -> list[str]:
        """What there is to doubt of the final model's numbers, in sentences; empty where nothing is."""
        said = [sentence(title, answers) for title, answers in self.by_record] + self.doubts
        said += [f"The fit leaves what was stated: {one.text}." for one in ran_off(self.fit)]
        if doubt := self.fit.unit_doubt:
            said.append(f"{doubt[0].upper()}{doubt[1:]}. The fit is that of the numbers as stated.")
        if self.effects and lacks_more(self.fit, self.error_after):
            said.append("Something is missing beside what was found: it leaves more than noise does.")
        if self.excused is not None:
            what = (
                f"{' and '.join(self.excused)} as well" if self.excused else "what is left, or a part of this"
            )
            said.append(
                f"Parameters of the camera were held, whose faults would explain {what}: leave all of them "
                "free (camera=True)."
            )
        if self.random:
            needed = ", ".join(f"{rate_of(m.state)} of {m.needed:.2g} {m.unit}".rstrip() for m in self.random)
            said.append(
                "Forces that push at random, like those of a support that moves, explain this record about "
                f"as well; beside what was found it still needs {needed}, r.m.s. over a frame."
            )
        if any(effect.curve is not None for effect in self.effects):
            said += [
                f"{one.name} is read in steps of {one.step:.3g} {one.unit}, coarser than its other noise: "
                "such errors follow the motion, and a formula may be made of them."
                for one in readings(self.fit)
                if one.coarse
            ]
        if self.undetermined:
            said.append(
                f"The data do not determine {', '.join(self.undetermined)}: each was held near its stated "
                "value, give or take as much. Their numbers say little more than was stated."
            )
        fixed = [name for name in self.baseline.parameters if name not in self.fit.parameters]
        if fixed:
            said.append(
                f"Held as stated, because they run away where they are free: {', '.join(fixed)}. What was "
                "found may make up for errors in these."
            )
        said += [
            f"The record's {own.frames} frames were averaged over {own.every} at a time, to "
            f"{int(own.measurement.seen.sum())}: the motion changes so slowly that nothing is lost by it."
            for own in self.thinned
            if own.every > 1
        ]
        return said

    @cached_property
    def hints(self) -> list[NextExperiment]:
        """What could be filmed to part the forms in doubt, the best first; worked out when asked for."""
        return hints(self)

    @property
    def hint(self) -> NextExperiment | None:
        """The best of them; None where nothing is in doubt."""
        return self.hints[0] if self.hints else None

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads."""
        return {
            "verdict": self.verdict,
            "stopped": self.stopped,
            "remarks": self.remarks,
            "noise": [vars(one) for one in self.noise],
            "effects": [found.to_dict() for found in self.effects],
            "alternatives": [other.to_dict() for other in self.alternatives],
            "refused": [near.to_dict() for near in self.rejected],
            "error_before": self.error_before.to_dict(),
            "error_after": self.error_after.to_dict(),
            "held_out_ratio": _named(self.ratio),
            "horizon_s": self.horizon,
            "held_out_from_s": self.split,
            "held_out_records": list(self.held_out),
            "undetermined": list(self.undetermined),
            "baseline": self.baseline.numbers(),
            "fit": self.fit.numbers(),
        }

    def report(self, path: str | os.PathLike[str], **details: Any) -> Report:
        """Write a page that a person reads: pictures first, one file. See :func:`udd.report.write`."""
        from udd.report import write

        return write(self, path, **details)
