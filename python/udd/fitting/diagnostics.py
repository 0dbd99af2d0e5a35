"""Diagnostics of a fit: needed model error, coloured innovations, runaway parameters."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from udd import _core
from udd._util.one_line import OneLine
from udd._util.small_units import small_unit

from .input_noise import LEVELS_APART, NoisyInput, diffusion_by_noise, noisy_inputs
from .parameters import Free
from .sensor import geometry_limits, is_film, lattice, moving, repeats

if TYPE_CHECKING:
    from .problem import Fit

_LAGS = 20  # of the innovations' autocorrelation
#: Probability for white noise below which innovations are not white. Lenses and outliers bring those of right
#: models to 1e-6; what is missing brings 1e-8 and far less, or a model error.
_COLOURED = 1e-8
#: Levels from the last one at which a right model may be held: of 50 films without an effect all came to the
#: last itself.
_NEARLY = 1
_OFF = 3.0  # standard deviations from what was stated
_LEAST = 30  # frames of which innovations tell anything
#: Steps over the noise, their own step/sqrt(12) contained: less than 0.4 steps of other noise are beside it.
_COARSE = 2.0
#: Of a channel's range, and of the variance that a fit assumes: smaller innovations may be the last digits of
#: the record or of the integrator, and a search takes them for noise as well.
_LAST_DIGITS, _UNRESOLVED = 1e-6, 0.1
_BETTER = 0.8  # of the noise that a fit assumes: misfits below show that it is less


@dataclass(frozen=True)
class ModelError:
    """How far the model is assumed to miss the rate of a state, r.m.s. over a frame, to follow its data.

    Attributes
    ----------
    state, unit : str
    needed : float
        As the record makes it likeliest.
    right : float
        What a right model is held to.
    """

    state: str
    unit: str
    needed: float
    right: float


@dataclass(frozen=True)
class RunawayParameter:
    """A parameter that left what was stated of it by more than that is good to, or that no device has."""

    name: str
    unit: str
    value: float
    stated: float
    sd: float

    @property
    def text(self) -> str:
        """In a sentence."""
        unit = f" {self.unit}" if self.unit else ""
        if not np.isfinite(self.sd):
            return f"{self.name} = {self.value:.4g}{unit}, which should be positive"
        return (
            f"{self.name} = {self.value:.4g}{unit}, {abs(self.value - self.stated) / self.sd:.1f} times the "
            f"{self.sd:.2g}{unit} from the {self.stated:.4g}{unit} that it was taken to be good to"
        )


@dataclass(frozen=True, repr=False)
class Reading(OneLine):
    """What a channel's frames are good to.

    Attributes
    ----------
    name, unit : str
    noise : float
        Standard deviation that the fit assumed of a typical frame.
    shown : float
        The same as the misfits show it.
    step : float
        That the channel was read in; 0 where its values lie on no lattice.
    memory : float
        How much of the noise is still there in the next frame.
    trusted : bool
        Whether the frames are counted on for what they show; those of a film are not where they scatter by
        less than its geometry is good to.
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
        """Whether no other noise blurs the steps: their errors then follow the motion."""
        return self.step > _COARSE * self.noise

    @property
    def told(self) -> float:
        """What a frame is good to by itself."""
        return self.noise if self.trusted else self.shown

    @property
    def text(self) -> str:
        """In words: in mm and mrad, as errors are told."""
        unit, factor = small_unit(self.unit)
        unit = f" {unit}" if unit else ""
        said = f"{self.name} {factor * self.told:.3g}{unit}"
        if not self.trusted:
            counted = f"{factor * self.noise:.3g}{unit}, for the geometry of a film is known no better"
            said += f" (counted as {counted})"
        if self.step:
            said += f", read in steps of {factor * self.step:.3g}{unit}"
        if self.memory:
            said += f" (the errors of neighbouring frames correlate by {self.memory:.2f})"
        return said


@dataclass(frozen=True)
class Diagnostics:
    """What a fit shows of its own faults.

    Attributes
    ----------
    missed : list of ModelError
        One for every equation that says more than that one state is the rate of another.
    tight : bool
        Whether the model could be held as tightly as a right one can.
    white : dict of str to float
        Probability that the innovations of each channel are white noise (Ljung and Box); without channels
        whose innovations are too small to tell, and empty if the record is too short.
    ran_off : list of RunawayParameter
    factor : float
        By what the standard errors are multiplied: 1 where nothing is missing.
    sensor : list of Reading
        The noise of each channel and the steps that it was read in.
    rests : float or None
        Time from which a film shows its disk at rest, which is left out, s.
    filmed : bool
        Whether it is a film, whose own faults leave a right model's innovations coloured.
    inputs : list of NoisyInput
        The inputs whose samples scatter.
    by_inputs : list of float
        What their noise makes of the rates that are missed, r.m.s. over a frame, if it makes all of that.
    unit : str or None
        The unit that explains the record far better than the one stated, in a sentence.
    clock : str or None
        That the times were rounded, and what they are taken for.
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
        """The channels whose innovations are not white; steps that no other noise blurs leave none white."""
        stepped = [one.name for one in self.sensor if one.coarse]
        return [name for name, p in self.white.items() if p < _COLOURED and name not in stepped]

    @property
    def missing(self) -> bool:
        """Whether the model lacks something.

        Of a film colour alone does not tell: its faults, like those of a lens, make some. So does an input's
        noise, which goes on in the motion.
        """
        return not self.tight or (bool(self.coloured) and not self.filmed and not self.by_inputs)

    @property
    def verdict(self) -> str:
        """In a sentence."""
        if self.missing:
            return "something is missing: run udd discover"
        if self.by_inputs:
            return "nothing shows that something is missing: the inputs' noise explains what the model misses"
        if self.coloured:
            return "what is left is not white, by a fault of the film or something small: run udd discover"
        return "nothing shows that something is missing"

    @property
    def sentences(self) -> list[str]:
        """All of it in words, the verdict first."""
        said = [self.verdict]
        rates = ", ".join(f"{rate_of(m.state)} of {m.needed:.2g} {m.unit}".rstrip() for m in self.missed)
        right = ", ".join(f"{m.right:.2g} {m.unit}".rstrip() for m in self.missed)
        if self.by_inputs:
            made = ", ".join(f"{one:.2g}" for one in self.by_inputs)
            said.append(f"the model misses {rates}, r.m.s. over a frame; the inputs' noise makes {made}")
        elif not self.tight:
            said.append(
                f"the model misses {rates}, r.m.s. over a frame; a right one would miss less than {right}"
            )
        elif self.missed:
            said.append(f"the model misses {rates} at most, r.m.s. over a frame, as a right one does")
        if self.white:
            least = min(self.coloured or self.white, key=lambda name: self.white[name])
            state = f"not white in {', '.join(self.coloured)}" if self.coloured else "white"
            if not self.coloured and self.white[least] < _COLOURED:
                state = "no more coloured than steps make them"
            said.append(
                f"with that, innovations are {state} (probability of so much colour by chance: "
                f"{self.white[least]:.1g} in {least})"
            )
        said += [f"warning: {one.text}" for one in self.ran_off]
        said += [f"warning: {self.unit}"] if self.unit else []
        said += [self.clock] if self.clock else []
        said += [one.text for one in self.inputs]
        if self.sensor:
            said.append(f"noise: {'; '.join(one.text for one in self.sensor)}")
        if self.rests is not None:
            said.append(
                f"from {self.rests:.4g} s on the disk rests and the film repeats its picture: left out"
            )
        if self.factor > 1:
            said.append(
                f"standard errors are {self.factor:.0f} times those of a right model: what is missing may "
                "lean on any number for the whole record"
            )
        return said

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads."""
        return {
            "missing": self.missing,
            "sentences": self.sentences,
            "model_error": [vars(one) for one in self.missed],
            "white": dict(self.white),
            "ran_off": [vars(one) for one in self.ran_off],
            "noise": [vars(one) for one in self.sensor],
            "noisy_inputs": [vars(one) for one in self.inputs],
            "errors_times": self.factor,
        }


def doubts(fit: Fit) -> Diagnostics:
    """What a fit shows of its own faults."""
    last = len(fit.problem.schedule) - 1
    noisy = noisy_inputs(fit.measurements, fit.model.inputs)
    missed, white = _missed(fit), _white(fit)
    tight = fit.level >= last - _NEARLY
    by_inputs = [] if tight else _by_inputs(fit, missed, noisy)
    tight = tight or bool(by_inputs)
    # An error of the model that goes with a parameter's own effect, always one way, moves it by as many
    # standard errors as the square root of the number of independent ones that were assumed.
    factor = float(np.sqrt(max(int(fit.record.linked.sum()), 1))) if not tight else 1.0
    return Diagnostics(
        missed,
        tight,
        white,
        ran_off(fit),
        factor,
        readings(fit),
        _rests(fit),
        is_film(fit.measurement),
        noisy,
        by_inputs,
        fit.unit_doubt,
        next((str(m.meta["clock"]) for m in fit.measurements if "clock" in m.meta), None),
    )


def _rests(fit: Fit) -> float | None:
    end = moving(fit.measurement)
    return float(fit.measurement.t[end - 1]) if end < len(fit.measurement) else None


def readings(fit: Fit) -> list[Reading]:
    """The noise of each channel that was seen, and the steps that it was read in."""
    known = fit.model.profile.sensor.units
    sd = fit.noise.sd(fit.record, fit.blurring)
    limited = geometry_limits(fit.model.profile.sensor, fit.measurement)
    result = []
    for k, name in enumerate(fit.channels):
        own = fit.record.observed[:, k]
        if own.any():
            first = own & (fit.record.film == 0)
            step = lattice(fit.record.seen[first, k])
            # Readings that repeat share the step's error: the others tell what one is good to.
            alone = own & (repeats(fit.record.seen[:, k], step) == 1) if step else own
            noise = float(np.median(sd[alone, k]) if alone.any() else sd[own, k].min())
            memory = float(fit.noise.memory[k])
            # A misfit is smaller than an error by what the states follow it.
            errors = (np.square(fit.misfit[own, k]) + fit.misfit_variance[own, k]) / np.square(sd[own, k])
            shown = noise * float(np.sqrt(np.average(errors, weights=fit.noise.weight[own])))
            trusted = not limited or shown > _BETTER * noise
            result.append(Reading(name, known[k] if known else "", noise, shown, step, memory, trusted))
    return result


def units(fit: Fit) -> dict[str, str]:
    """The SI unit of every free parameter; a share is told in %."""
    known = fit.model.units | dict(_core.camera_parameters(fit.model.kind))
    return {name: known.get(name.partition("[")[0], "") for name in fit.parameters}


def rate_of(state: str) -> str:
    """What an error of an equation is called."""
    return {"Omega": "angular accelerations", "Y": "velocities of Y", "Z": "velocities of Z"}.get(
        state, f"{state}'"
    )


def _by_inputs(fit: Fit, missed: list[ModelError], noisy: list[NoisyInput]) -> list[float]:
    """What the inputs' noise makes of the rates that are missed; empty where that is not all of it."""
    if not noisy:
        return []
    step = float(np.median(np.diff(fit.record.t)))
    made = diffusion_by_noise(fit.models, replace(fit.record, states=fit.states)) / np.sqrt(step)
    found = [float(made[fit.model.state_names.index(one.state)]) for one in missed]
    # Were that noise real the model could not miss by far less.
    pairs = [(one.needed, by) for one, by in zip(missed, found, strict=True) if by > 0.0]
    near = all(by / LEVELS_APART <= needed <= LEVELS_APART * by for needed, by in pairs)
    return found if pairs and near else []


def _missed(fit: Fit) -> list[ModelError]:
    step = float(np.median(np.diff(fit.record.t)))
    model = fit.model
    order, told = list(model.state_names), model.profile.fit.equations
    names = {name: "" for name in order if name not in model.kinematic} if told is None else told
    now, best = fit.problem.diffusion, fit.problem.schedule[-1]
    root = np.sqrt(step)
    return [
        ModelError(name, unit, now[order.index(name)] / root, best[order.index(name)] / root)
        for name, unit in names.items()
    ]


def _white(fit: Fit) -> dict[str, float]:
    from .innovations import innovations

    if len(fit.record.t) < _LEAST:
        return {}
    found = innovations(fit)
    _statistic, p = found.ljung_box(min(_LAGS, len(found.values) // 5))
    resolved = found.chi2 > _UNRESOLVED
    for k, name in enumerate(found.names):
        channel = fit.channels.index(name)
        own = fit.record.observed[:, channel]
        seen, misfit = fit.record.seen[own, channel], fit.misfit[own, channel]
        resolved[k] &= np.sqrt(np.mean(misfit**2)) > _LAST_DIGITS * np.ptp(seen)
    return {
        name: float(value)
        for name, value, told in zip(found.names, p, resolved, strict=True)
        if np.isfinite(value) and told
    }


def ran_off(fit: Fit) -> list[RunawayParameter]:
    """The parameters that left what was stated of them, and frictions that drive."""
    result, known = [], units(fit)
    for free in fit.problem.free:
        value = fit.parameters[free.name]
        unit = known[free.name]
        if np.isfinite(free.sd) and abs(value - free.mean) > _OFF * free.sd:
            result.append(RunawayParameter(free.name, unit, value, free.mean, free.sd))
        elif _is_friction(free) and value < -_OFF * fit.errors[free.name]:
            result.append(RunawayParameter(free.name, unit, value, free.mean, np.inf))
    return result


def _is_friction(free: Free) -> bool:
    return free.role == "model" and free.name.partition("[")[0] in ("k0", "k1")
