"""Diagnostics of a fit: needed model error, coloured innovations, runaway parameters."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from udd import _core
from udd._util.one_line import OneLine
from udd._util.small_units import small_unit

from .innovations import innovations
from .input_noise import LEVEL_RATIO, NoisyInput, diffusion_by_noise, noisy_inputs
from .sensor import geometry_limits, is_film, lattice, moving, repeats

if TYPE_CHECKING:
    from .fit_result import Fit

_LAGS = 20  # of the innovations' autocorrelation
#: Probability for white noise below which innovations are not white. With a right model, lenses and outliers
#: cause 1e-6 at least; missing physics causes 1e-8 and far less, or a model error.
_COLOURED = 1e-8
#: Levels above the last one that a right model may need: all of 50 films without an effect reached the last.
_NEARLY = 1
_OFF = 3.0  # standard deviations from the prior's mean
_LEAST = 30  # frames, below which innovations are not tested
#: Ratio of the step to the noise (which contains step/sqrt(12)) above which other noise is negligible: below
#: 0.4 steps.
_COARSE = 2.0
#: Shares of a channel's range and of the assumed variance: smaller innovations may be the last digits of the
#: record or of the integrator, and a search treats them as noise, too.
_LAST_DIGITS, _UNRESOLVED = 1e-6, 0.1
_BETTER = 0.8  # share of the assumed noise; smaller misfits show that the noise is smaller


@dataclass(frozen=True)
class ModelError:
    """Model error that a fit assumes in the rate of a state, r.m.s. over a frame.

    Attributes
    ----------
    state, unit : str
    needed : float
        The value with the highest likelihood.
    right : float
        The value for a right model.
    """

    state: str
    unit: str
    needed: float
    right: float


@dataclass(frozen=True)
class RunawayParameter:
    """A parameter outside its prior, or with an impossible value."""

    name: str
    unit: str
    value: float
    stated: float
    sd: float
    error: float

    @property
    def text(self) -> str:
        """The warning, in one sentence."""
        unit = f" {self.unit}" if self.unit else ""
        text = f"{self.name} = {self.value:.4g} ± {self.error:.2g}{unit}; expected"
        if not np.isfinite(self.sd):
            return f"{text} a positive value"
        off = abs(self.value - self.stated) / self.sd
        return f"{text} {self.stated:.4g} ± {self.sd:.2g}{unit}: {off:.1f} standard deviations off"


@dataclass(frozen=True, repr=False)
class Reading(OneLine):
    """Noise of a channel's frames.

    Attributes
    ----------
    name, unit : str
        Name of the channel, and its unit.
    noise : float
        Standard deviation that the fit assumed. It is that of a typical frame.
    shown : float
        Standard deviation of the misfits.
    step : float
        Step in which the channel was read. It is 0 if its values lie on no lattice.
    memory : float
        Lag-1 autocorrelation of the noise.
    trusted : bool
        True if a fit weights the frames by the noise that they show. False for a film whose frames scatter by
        less than its geometric error.
    """

    name: str
    unit: str
    noise: float
    shown: float
    step: float
    memory: float
    trusted: bool = True

    @property
    def coarse(self) -> bool:
        """True if no other noise blurs the steps; their errors then follow the motion."""
        return self.step > _COARSE * self.noise

    @property
    def frame_noise(self) -> float:
        """Noise of a single frame."""
        return self.noise if self.trusted else self.shown

    @property
    def text(self) -> str:
        """Description in mm and mrad, as errors are reported."""
        unit, factor = small_unit(self.unit)
        unit = f" {unit}" if unit else ""
        text = f"{self.name} {factor * self.frame_noise:.3g}{unit}"
        if not self.trusted:
            counted = f"{factor * self.noise:.3g}{unit}, because the geometry of a film is no more accurate"
            text += f" (counted as {counted})"
        if self.step:
            text += f", read in steps of {factor * self.step:.3g}{unit}"
        if self.memory:
            text += f" (the errors of neighbouring frames correlate by {self.memory:.2f})"
        return text


@dataclass(frozen=True)
class Diagnostics:
    """Goodness of fit: remaining model error, whiteness of innovations, runaway parameters, noise.

    Attributes
    ----------
    missed : list of ModelError
        Remaining model error of each equation. Equations in which a state is the rate of another have none.
    tight : bool
        True if the model error could be reduced to that of a right model.
    white : dict of str to float
        Probability that the innovations of each channel are white noise (Ljung-Box). Channels with negligible
        innovations are left out. It is empty if the record is too short.
    ran_off : list of RunawayParameter
        Parameters that diverged.
    factor : float
        Inflation of the standard errors. It is 1 if nothing is missing.
    sensor : list of Reading
        Noise of each channel, with the step in which it was read.
    rests : float or None
        Time from which on the disk of a film is at rest [s]. Later frames are left out.
    filmed : bool
        True if the record is a film. Faults of a film correlate even a right model's innovations.
    inputs : list of NoisyInput
        Inputs with noisy samples.
    by_inputs : list of float
        Errors of the rates caused by the inputs' noise, r.m.s. over a frame. It is empty unless they explain
        all of the model error.
    unit : str or None
        Sentence about a unit that explains the record far better than the given one.
    clock : str or None
        Sentence about rounded times, and the assumed ones.
    """

    missed: list[ModelError]
    tight: bool
    white: dict[str, float]
    ran_off: list[RunawayParameter]
    factor: float
    sensor: list[Reading]
    rests: float | None = None
    filmed: bool = False
    inputs: list[NoisyInput] = field(default_factory=list)
    by_inputs: list[float] = field(default_factory=list)
    unit: str | None = None
    clock: str | None = None

    @property
    def coloured(self) -> list[str]:
        """Channels whose innovations are not white, except those whose steps no other noise blurs."""
        stepped = [reading.name for reading in self.sensor if reading.coarse]
        return [name for name, p in self.white.items() if p < _COLOURED and name not in stepped]

    @property
    def missing(self) -> bool:
        """True if the model lacks something.

        Coloured innovations of a film are no evidence: its own faults, such as a lens, colour them. Nor are
        they if inputs are noisy, because that noise persists in the motion.
        """
        return not self.tight or (bool(self.coloured) and not self.filmed and not self.by_inputs)

    @property
    def verdict(self) -> str:
        """The verdict, in one sentence."""
        if self.missing:
            return "something is missing: run udd discover"
        if self.by_inputs:
            return "no sign that something is missing: the inputs' noise explains the model error"
        if self.coloured:
            return "residuals are not white, from a fault of the film or a small effect: run udd discover"
        return "no sign that something is missing"

    @property
    def sentences(self) -> list[str]:
        """All diagnostics in sentences, the verdict first."""
        text = [self.verdict]
        rates = ", ".join(f"{rate_of(m.state)} of {m.needed:.2g} {m.unit}".rstrip() for m in self.missed)
        right = ", ".join(f"{m.right:.2g} {m.unit}".rstrip() for m in self.missed)
        if self.by_inputs:
            made = ", ".join(f"{value:.2g}" for value in self.by_inputs)
            text.append(f"the model misses {rates}, r.m.s. over a frame; the inputs' noise causes {made}")
        elif not self.tight:
            text.append(
                f"the model misses {rates}, r.m.s. over a frame; a right model would miss less than {right}"
            )
        elif self.missed:
            text.append(f"the model misses at most {rates}, r.m.s. over a frame, as a right model does")
        if self.white:
            least = min(self.coloured or self.white, key=lambda name: self.white[name])
            state = f"not white in {', '.join(self.coloured)}" if self.coloured else "white"
            if not self.coloured and self.white[least] < _COLOURED:
                state = "no more coloured than the steps of the readings explain"
            text.append(
                f"with this model error, innovations are {state} (probability of this colour by chance: "
                f"{self.white[least]:.1g} in {least})"
            )
        text += [f"warning: {parameter.text}" for parameter in self.ran_off]
        text += [f"warning: {self.unit}"] if self.unit else []
        text += [self.clock] if self.clock else []
        text += [noisy.text for noisy in self.inputs]
        if self.sensor:
            text.append(f"noise: {'; '.join(reading.text for reading in self.sensor)}")
        if self.rests is not None:
            text.append(
                f"from {self.rests:.4g} s on the disk is at rest and the film repeats its picture: left out"
            )
        if self.factor > 1:
            text.append(
                f"standard errors were inflated {self.factor:.0f} times, because missing physics can bias "
                "every parameter"
            )
        return text

    def to_dict(self) -> dict[str, Any]:
        """Return the diagnostics as JSON-ready values."""
        return {
            "missing": self.missing,
            "sentences": self.sentences,
            "model_error": [vars(entry) for entry in self.missed],
            "white": dict(self.white),
            "ran_off": [vars(entry) for entry in self.ran_off],
            "noise": [vars(entry) for entry in self.sensor],
            "noisy_inputs": [vars(entry) for entry in self.inputs],
            "errors_times": self.factor,
        }


def doubts(fit: Fit) -> Diagnostics:
    """Diagnose a fit: model error, innovations, runaway parameters, noise, units."""
    last = len(fit.problem.schedule) - 1
    noisy = noisy_inputs(fit.measurements, fit.model.inputs)
    missed, end = _missed(fit), moving(fit.measurement)
    tight = fit.level >= last - _NEARLY
    by_inputs = [] if tight else _by_inputs(fit, missed, noisy)
    tight = tight or bool(by_inputs)
    # A model error that always follows a parameter's own effect, with one sign, moves that parameter by as
    # many standard errors as the square root of the number of independent errors that were assumed.
    factor = float(np.sqrt(max(int(fit.record.linked.sum()), 1))) if not tight else 1.0
    return Diagnostics(
        missed=missed,
        tight=tight,
        white=_white(fit),
        ran_off=ran_off(fit),
        factor=factor,
        sensor=readings(fit),
        rests=float(fit.measurement.t[end - 1]) if end < len(fit.measurement) else None,
        filmed=is_film(fit.measurement),
        inputs=noisy,
        by_inputs=by_inputs,
        unit=fit.unit_doubt,
        clock=next((str(m.meta["clock"]) for m in fit.measurements if "clock" in m.meta), None),
    )


def readings(fit: Fit) -> list[Reading]:
    """Return the noise of each observed channel, and the steps in which it was read."""
    known_units = fit.model.profile.sensor.units
    sd = fit.noise_sd
    limited = geometry_limits(fit.model.profile.sensor, fit.measurement)
    result = []
    for k, name in enumerate(fit.channels):
        observed = fit.record.observed[:, k]
        if not observed.any():
            continue
        step = lattice(fit.record.seen[observed & (fit.record.film == 0), k])
        # Repeated readings share the error of their step: the others show the noise of a single frame.
        alone = observed & (repeats(fit.record.seen[:, k], step) == 1) if step else observed
        noise = float(np.median(sd[alone, k]) if alone.any() else sd[observed, k].min())
        # A misfit is smaller than the error, because the states follow the frames.
        squares = np.square(fit.misfit[observed, k]) + fit.misfit_variance[observed, k]
        errors = squares / np.square(sd[observed, k])
        shown = noise * float(np.sqrt(np.average(errors, weights=fit.noise.weight[observed])))
        trusted = not limited or shown > _BETTER * noise
        unit, memory = known_units[k] if known_units else "", float(fit.noise.memory[k])
        result.append(Reading(name, unit, noise, shown, step, memory, trusted))
    return result


def units(fit: Fit) -> dict[str, str]:
    """Return the unit of every free parameter: SI, or % for a share."""
    all_units = fit.model.units | dict(_core.camera_parameters(fit.model.kind))
    return {name: all_units.get(name.partition("[")[0], "") for name in fit.parameters}


def rate_of(state: str) -> str:
    """Name the rate of a state, for messages about its error."""
    return {"Omega": "angular accelerations", "Y": "velocities of Y", "Z": "velocities of Z"}.get(
        state, f"{state}'"
    )


def _by_inputs(fit: Fit, missed: list[ModelError], noisy: list[NoisyInput]) -> list[float]:
    """Return the model errors caused by the inputs' noise; empty unless they explain all of it."""
    if not noisy:
        return []
    step = float(np.median(np.diff(fit.record.t)))
    made = diffusion_by_noise(fit.models, replace(fit.record, states=fit.states)) / np.sqrt(step)
    errors = [float(made[fit.model.state_names.index(rate.state)]) for rate in missed]
    # If that noise is real, the model error cannot be far below it.
    pairs = [(rate.needed, by) for rate, by in zip(missed, errors, strict=True) if by > 0.0]
    is_similar = all(by / LEVEL_RATIO <= needed <= LEVEL_RATIO * by for needed, by in pairs)
    return errors if pairs and is_similar else []


def _missed(fit: Fit) -> list[ModelError]:
    step = float(np.median(np.diff(fit.record.t)))
    model, names = fit.model, fit.model.profile.fit.equations
    if names is None:
        names = {name: "" for name in model.state_names if name not in model.kinematic}
    root = np.sqrt(step)
    pairs = zip(fit.problem.diffusion, fit.problem.schedule[-1], strict=True)
    needed = {
        name: (q / root, right / root) for name, (q, right) in zip(model.state_names, pairs, strict=True)
    }
    return [ModelError(name, unit, *needed[name]) for name, unit in names.items()]


def _white(fit: Fit) -> dict[str, float]:
    if len(fit.record.t) < _LEAST:
        return {}
    result = innovations(fit)
    _statistic, p = result.ljung_box(min(_LAGS, len(result.values) // 5))
    resolved = result.chi2 > _UNRESOLVED
    for k, name in enumerate(result.names):
        channel = fit.channels.index(name)
        observed = fit.record.observed[:, channel]
        seen, misfit = fit.record.seen[observed, channel], fit.misfit[observed, channel]
        resolved[k] &= np.sqrt(np.mean(misfit**2)) > _LAST_DIGITS * np.ptp(seen)
    return {
        name: float(value)
        for name, value, is_resolved in zip(result.names, p, resolved, strict=True)
        if np.isfinite(value) and is_resolved
    }


def ran_off(fit: Fit) -> list[RunawayParameter]:
    """Return the parameters outside their priors, and negative friction coefficients."""
    result, unit_of = [], units(fit)
    for free in fit.problem.free:
        value, error = fit.parameters[free.name], fit.errors[free.name]
        is_friction = free.role == "model" and free.base in ("k0", "k1")
        if np.isfinite(free.sd) and abs(value - free.mean) > _OFF * free.sd:
            sd = free.sd
        elif is_friction and value < -_OFF * error:
            sd = np.inf
        else:
            continue
        result.append(RunawayParameter(free.name, unit_of[free.name], value, free.mean, sd, error))
    return result
