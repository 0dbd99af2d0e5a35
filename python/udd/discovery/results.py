"""Result of a discovery."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from udd._util.drawable import Drawable
from udd._util.keywords import renamed_attribute
from udd._util.one_line import OneLine, cut
from udd._util.value_text import with_error
from udd.discovery.nonparametric.curve_scan import Curve
from udd.discovery.scoring.score_scan import Scored
from udd.discovery.validation.by_record import RecordAnswer, sentence
from udd.discovery.validation.held_out_errors import Errors, Ratio, lacks_more
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
    """Label a ratio and its interval, as JSON-ready values."""
    return dict(zip(("value", "low", "high"), ratio, strict=True))


@dataclass(frozen=True, repr=False)
class AddedEffect(OneLine):
    """Added effect, with its parameters and its evidence.

    Attributes
    ----------
    effect : Effect
        The effect with the parameters fitted to all data.
    title, equation, expression : str
        Name for a reader, formula, and formula with numbers. All are plain text.
    parameters, errors : dict of str to float
        Fitted parameters with standard errors. They are in SI units.
    chi2 : float
        Decrease in chi2 when it was added, in units of the fit's scatter.
    p : float
        Probability of so large a decrease by chance. All candidates are counted.
    ratio : tuple of float
        Cost of the held-out frames after over before, with its 95 % interval. All parameters are fixed.
    witness : {"held", "fitted", "halves"}
        Test that confirms it: that cost, a further decrease in chi2 when the held-out frames are fitted too,
        or each half of the record in alternate blocks.
    curve : Curve or None
        The located curve with its band, if it was located without a formula. The effect is this curve, or a
        formula for it.
    is_law : bool
        True for a term of the library or of the user, a power, or a formula of one term.
    tried : str
        Its title as a candidate, with the shape and the frequency of the trial.
    by_record : list of RecordAnswer
        The answer of each of several records that were fitted together.

    See Also
    --------
    udd.discover : finds it.
    udd.plot.curve : draw a located curve.
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

    def __repr__(self) -> str:
        """Describe the effect on one line."""
        numbers = f"{self._numbers()}; chi2 decreased by {self.chi2:.4g}"
        return cut(f"<AddedEffect {self.title}: {self.equation}, {numbers}>", 300)

    def _numbers(self) -> str:
        """Format the parameters with their errors."""
        values = self.parameters.items()
        return ", ".join(f"{name} = {with_error(v, self.errors.get(name))}" for name, v in values)

    def like_a_drift(self, model: Model) -> bool:
        """Return True for a curve over time alone, which may be the drift of a sensor's zero.

        A disk's is none, because a camera sees it.

        Parameters
        ----------
        model : Model
            The fitted model.

        Returns
        -------
        bool
        """
        over = [] if self.curve is None else [c.name for c in self.curve.coordinates]
        return over == ["t"] and not model.profile.sensor.sees_marks

    def to_dict(self) -> dict[str, Any]:
        """Return the effect as JSON-ready values.

        Returns
        -------
        dict of str
            Numbers, texts, lists and dictionaries; :func:`json.dumps` takes it.
        """
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
            "by_record": [answer.to_dict() for answer in self.by_record],
        }


@dataclass(frozen=True, repr=False)
class Alternative(OneLine):
    """Candidate that the data cannot distinguish from the chosen one.

    Attributes
    ----------
    instead_of : str
        Name of the effect that it could replace.
    effect : Effect
        The candidate. Its parameters are fitted.
    title, equation : str
        Name for a reader, and formula.
    nats : float
        Log likelihood of the chosen form minus that of this one. It is negative if this one fits better.
    likeness : float
        Likeness of their effects on these data, 0 to 1; at 1 no length of record distinguishes them.
    """

    instead_of: str
    effect: Effect
    title: str
    equation: str
    nats: float
    likeness: float

    def to_dict(self) -> dict[str, Any]:
        """Return the alternative as JSON-ready values."""
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
    """Effect that decreases the held-out error of an incomplete model, but does not pass the tests.

    Attributes
    ----------
    effect : Effect
        The effect with the parameters fitted to all data.
    title : str
        Name for a reader.
    chi2, p : float
        Decrease in chi2, in units of the remaining misfit at the same frequencies, and its probability by
        chance. All candidates, curves and surfaces are counted.
    errors : Errors
        Held-out errors of the model with it.
    ratio : tuple of float
        Held-out error with it over that without, as for :attr:`Discovery.ratio`.
    why : {"chance", "drift", "part", "held", "form", "unconfirmed", "records"}
        Reason for its rejection. ``"chance"``: not significant in all data. ``"part"``: not in the training
        part. ``"drift"``: a slow drift of the sensor's zero explains more. ``"held"``: the held-out data do
        not confirm it. ``"form"``: a form that fits clearly better does not pass. ``"unconfirmed"``: it
        passed, but free runs over the held-out data do not improve significantly. ``"records"``: it is
        significant in only some of several records, though the others could show it.
    by_record : list of RecordAnswer
        The answer of each of several records that were fitted together.
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
        """Return the rejected effect as JSON-ready values."""
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
            "by_record": [answer.to_dict() for answer in self.by_record],
        }


@dataclass(frozen=True)
class Discovery(Drawable):
    """Result of :func:`udd.discover`: the terms that a model lacks, with the evidence.

    Attributes
    ----------
    verdict : str
        ``"nothing missing"``, ``"effect identified"`` or ``"effect present, form not identified"``. ``"fits
        the first part, not confirmed"`` if free runs over the held-out data do not confirm the effect. The
        effect is then in `rejected`. ``"search not finished"`` if the time was up before anything was found.
    baseline, fit : Fit
        Fits to all data without and with the added effects. They are equal if none was added.
    effects : list of AddedEffect
        The added effects. Empty if nothing is missing.
    alternatives : list of Alternative
        Candidates that the data cannot distinguish from the chosen ones.
    error_before, error_after : Errors
        Held-out errors of models fitted without the held-out data, with the noise floor.
    ratio : tuple of float
        Held-out error after over before, with its 95 % interval: at :attr:`horizon`, or over the whole
        held-out part.
    scans : list of list of Scored
        Scores of all candidates, for each round of the search, the best first.
    curves : list of list of Curve
        Scores of all curves, for each round.
    comparisons : list of int
        Count of candidates and curves in each round, every frequency included.
    split : float
        Start of the held-out data, s; of the first measurement. They are the last part of each measurement,
        or its first part if only the rest shows an effect.
    rejected : list of RejectedEffect
        If an effect is present but none passes: those that come closest, the best first. Also effects that
        passed but were not confirmed.
    thinned : list of Thinned
        Block averages of measurements with more frames than their motion requires; the measurements of `fit`
        are then these. Empty if all frames were used.
    budget : float or None
        The limit in seconds, if it ended the search. Otherwise None.
    stopped : str or None
        Stage of the search at that time. None if the search finished.
    excused : list of str or None
        If parameters of the camera were fixed: titles of the effects that the camera's errors would explain
        as well. Empty if they would explain most of the remaining misfit, or a part of an effect. None if
        they would not.
    random : list of ModelError
        Random forces that the model needs in addition to the effects, if random forces alone, as from a
        moving support, explain the data about as well. The effects are then not identified.
    held_out : tuple of int
        Numbers of the measurements held out whole; empty if the last part of each is the held-out part. Then
        `split` is the time in the first measurement from which pictures show free runs.
    undetermined : tuple of str
        Parameters that are not identifiable from the data. They were constrained to their given values.
    doubts : list of str
        Reasons against naming the form of the effects, in sentences.

    See Also
    --------
    udd.plot.evidence : draw the candidates' decreases in chi2.
    udd.plot.errors : draw the held-out errors before and after.
    udd.plot.curve : draw a located curve.
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
        """Describe the verdict on one line."""
        titles = ", ".join(effect.title for effect in self.effects)
        value, low, high = self.ratio
        error = f"; held-out error x {value:.3g} ({low:.3g} to {high:.3g})" if titles else ""
        return f"<Discovery: {self.verdict}{': ' if titles else ''}{titles}{error}>"

    def _repr_html_(self) -> str:
        """Format the verdict for notebooks."""
        from html import escape

        items = "".join(
            f"<li>{escape(e.title)}: <code>{escape(e.expression)}</code>, {escape(e._numbers())}</li>"
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
        """Horizon of `ratio`, s; None for the whole held-out part."""
        return self.error_before.horizon

    @property
    def held_out_span(self) -> tuple[float, float]:
        """Begin and end of the held-out frames of the first measurement, s."""
        trained, all_frames = self.trained.record, self.fit.record
        first = float(trained.clock[0])
        end = first if first > self.split else float(all_frames.clock[all_frames.film == 0][-1])
        return self.split, end

    @property
    def model(self) -> Model:
        """The refitted model with the effects."""
        return self.fit.model

    @property
    def noise(self) -> list[Reading]:
        """Noise of each channel's frames, as the record shows it; of block means if the record was thinned.

        See :class:`udd.fitting.diagnostics.Reading`.
        """
        steps = self.thinned[0].steps if self.thinned else {}
        return [
            replace(reading, step=steps.get(reading.name, reading.step)) for reading in readings(self.fit)
        ]

    @property
    def by_record(self) -> list[tuple[str, list[RecordAnswer]]]:
        """Titles with the answers of several records, for added effects and for those that some support."""
        answers = [(effect.title, effect.by_record) for effect in self.effects]
        answers += [(effect.title, effect.by_record) for effect in self.rejected if effect.why == "records"]
        return [entry for entry in answers if entry[1]]

    @property
    def remarks(self) -> list[str]:
        """Caveats about the final fit, one sentence each."""
        said = [sentence(title, answers) for title, answers in self.by_record] + self.doubts
        runaways = ran_off(self.fit)
        said += [f"A parameter is far from its given value: {runaway.text}." for runaway in runaways]
        if any(runaway.name.partition("[")[0] not in self.fit.model.parameters for runaway in runaways):
            said.append(
                "A missing law of the angle or the place may look like such a camera: measure where the "
                "camera and the pivot were."
            )
        if doubt := self.fit.unit_doubt:
            said.append(f"{doubt[0].upper()}{doubt[1:]}. The fit uses the given units.")
        if self.effects and lacks_more(self.fit, self.error_after):
            said.append("Another effect is missing: the residuals exceed the noise.")
        if self.excused is not None:
            what = (
                f"{' and '.join(self.excused)} as well"
                if self.excused
                else "the rest, or a part of the effects"
            )
            said.append(
                f"Parameters of the camera were fixed, and its errors would explain {what}: leave all of "
                "them free (camera=True)."
            )
        if self.random:
            needed = ", ".join(f"{rate_of(m.state)} of {m.needed:.2g} {m.unit}".rstrip() for m in self.random)
            said.append(
                "Random forcing (e.g. a moving support) explains this record about as well. With the added "
                f"effects, random forcing of {needed}, r.m.s. over a frame, remains."
            )
        if any(effect.curve is not None for effect in self.effects):
            said += [
                f"{reading.name} is read in steps of {reading.step:.3g} {reading.unit}, larger than its "
                "other noise: such errors follow the motion, and may produce a formula."
                for reading in readings(self.fit)
                if reading.coarse
            ]
        if self.undetermined:
            said.append(
                f"The data do not determine {', '.join(self.undetermined)}: each was constrained to its "
                "given value ± 100 %. Their fitted values carry little further information."
            )
        fixed = [name for name in self.baseline.parameters if name not in self.fit.parameters]
        if fixed:
            said.append(
                f"Fixed at their given values, because they diverge if they are free: {', '.join(fixed)}. "
                "The added effects may compensate errors in these."
            )
        said += [
            f"The record's {thin.frames} frames were averaged in blocks of {thin.every}, to "
            f"{int(thin.measurement.seen.sum())}: the motion is so slow that no information is lost."
            for thin in self.thinned
            if thin.every > 1
        ]
        return said

    @cached_property
    def hints(self) -> list[NextExperiment]:
        """Films that would distinguish the forms in doubt, the best first; computed on first access."""
        return hints(self)

    @property
    def hint(self) -> NextExperiment | None:
        """The best of them; None if no form is in doubt."""
        return self.hints[0] if self.hints else None

    def to_dict(self) -> dict[str, Any]:
        """Return the discovery as JSON-ready values.

        Returns
        -------
        dict of str
            Numbers, texts, lists and dictionaries; :func:`json.dumps` takes it.
        """
        return {
            "verdict": self.verdict,
            "stopped": self.stopped,
            "remarks": self.remarks,
            "noise": [vars(reading) for reading in self.noise],
            "effects": [effect.to_dict() for effect in self.effects],
            "alternatives": [alternative.to_dict() for alternative in self.alternatives],
            "refused": [effect.to_dict() for effect in self.rejected],
            "error_before": self.error_before.to_dict(),
            "error_after": self.error_after.to_dict(),
            "held_out_ratio": _named(self.ratio),
            "horizon_s": self.horizon,
            "held_out_from_s": self.split,
            "held_out_to_s": self.held_out_span[1],
            "held_out_records": list(self.held_out),
            "undetermined": list(self.undetermined),
            "baseline": self.baseline.numbers(),
            "fit": self.fit.numbers(),
        }

    def report(self, path: str | os.PathLike[str], **details: Any) -> Report:
        """Write a page for readers, with pictures first, in one file.

        Parameters
        ----------
        path : path
            HTML file to write.
        **details
            As for :func:`udd.report.write`.

        Returns
        -------
        Report
            Parts of the page.
        """
        from udd.report import write

        return write(self, path, **details)
