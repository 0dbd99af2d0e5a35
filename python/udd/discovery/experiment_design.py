"""Experiment design: the next film that would distinguish forms that the data cannot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util.odds import odds
from udd._util.parallel import parallel_map
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.candidates import renamed
from udd.effects import Effect
from udd.errors import UddError
from udd.fitting import Fit, Record
from udd.fitting.estimator_input import FilmParameters
from udd.fitting.parameters import Free
from udd.fitting.problem import Point, Problem
from udd.models import Model
from udd.simulation.trajectory import integrated

from .thresholds import EVIDENCE_MARGIN

if TYPE_CHECKING:
    from .results import Alternative, Discovery

Array = NDArray[np.float64]

_STARTS = 6  # places of the record from which a further film may start, tried in turn
_SHORTEST = 0.5  # share of the film's length: if the disk loses contact sooner, the film is not feasible


@dataclass(frozen=True)
class NextExperiment:
    """Next film, and what it is expected to show.

    Attributes
    ----------
    design : str
        Description of the film; empty if no feasible film would distinguish any of the forms.
    nats : float
        Expected difference in log likelihood between the forms: the least of those that would be
        distinguished, or the most if none would.
    each : dict of str to float
        The same for each alternative, by its title.
    text : str
        The advice in one sentence.
    """

    design: str
    nats: float
    each: dict[str, float]
    text: str

    @property
    def parts(self) -> list[str]:
        """Titles of the alternatives that the film would distinguish from the chosen form."""
        return [title for title, nats in self.each.items() if nats >= EVIDENCE_MARGIN]

    def to_dict(self) -> dict[str, Any]:
        """Return the advice as JSON-ready values."""
        return {"design": self.design, "nats": self.nats, "each": self.each, "text": self.text}


@dataclass(frozen=True)
class Film:
    """Film that could be made, from one of several start states, (k, d), which are tried in turn.

    It may continue at the end of the first one, with its camera and drive, as if that was filmed for as long
    `again`. Once it is simulated, `t` and `states` have the motion.
    """

    design: str
    model: Model
    starts: Array
    again: bool = False
    t: Array = field(default_factory=lambda: np.zeros(0))
    states: Array = field(default_factory=lambda: np.zeros(0))


def hints(discovery: Discovery) -> list[NextExperiment]:
    """Rank films that would distinguish the forms that the data cannot, the best first.

    Each film is simulated with the discovered model and added to the part of the record on which the forms
    were compared. Drive and camera of a new film are as uncertain as those of the first. If a form with the
    amplitudes ``a`` is true and another is fitted, chi2 increases by ``a (S - C T^-1 C') a``: ``S`` and ``T``
    are the information on the amplitudes of the two with everything else refitted, ``C`` is their cross
    information. Half of the increase, the smaller of the two forms', is the expected difference in log
    likelihood. The film's gain is added to the difference in the present data.

    Parameters
    ----------
    discovery : Discovery

    Returns
    -------
    list of NextExperiment
        One for every film that distinguishes some of the forms. If there is no such film, one that says so.
        Empty if no form is in doubt.

    Examples
    --------
    >>> import numpy as np, udd
    >>> t = np.arange(0, 30, 0.05)
    >>> noise = 2e-3 * np.random.default_rng(0).standard_normal(len(t))
    >>> theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 1.0]).state[:, 1] + noise
    >>> discovery = udd.discover(udd.Measurement(t, {"theta": theta}), udd.Pendulum(1.0, k0=0.03))
    >>> discovery.hints
    []
    """
    if not discovery.alternatives:
        return []
    pairs = [pair for other in discovery.alternatives if (pair := _Pair.of(discovery, other))]
    if not pairs:
        return []
    now = [pair.nats(None) for pair in pairs]

    def predicted(planned: Film) -> tuple[str, dict[str, float]] | None:
        film = _filmed(discovery.trained, planned)
        if film is None:
            return None
        each: dict[str, float] = {}
        for pair, before in zip(pairs, now, strict=True):
            nats = pair.other.nats + max(pair.nats(film) - before, 0.0)
            each[pair.other.title] = float(min(nats, each.get(pair.other.title, np.inf)))
        return film.design, each

    designs = [design for design in parallel_map(predicted, _films(discovery.trained)) if design]
    return _ranked(designs)


def _ranked(designs: Sequence[tuple[str, dict[str, float]]]) -> list[NextExperiment]:
    """Describe the designs: those that distinguish most forms first."""
    result = []
    for design, each in designs:
        parts = [nats for nats in each.values() if nats >= EVIDENCE_MARGIN]
        if parts:
            excluded = ", ".join(f"{t} (odds of {odds(n)})" for t, n in each.items() if n >= EVIDENCE_MARGIN)
            left = ", ".join(t for t, n in each.items() if n < EVIDENCE_MARGIN)
            text = f"film {design}: it is expected to separate what was found from {excluded}"
            text += f"; not from {left}" if left else ""
            result.append(NextExperiment(design, min(parts), each, text))
    if result:
        return sorted(result, key=lambda hint: (-len(hint.parts), -hint.nats))
    if not designs:
        return [
            NextExperiment("", 0.0, {}, "no feasible film keeps the disk between the wheels for long enough")
        ]
    design, each = max(designs, key=lambda d: max(d[1].values()))
    most = max(each.values())
    text = (
        f"no feasible film would separate them: the best, {design}, is expected to give odds of "
        f"{odds(most)}, and {odds(EVIDENCE_MARGIN)} are needed"
    )
    return [NextExperiment("", most, each, text)]


def _films(fit: Fit) -> Iterator[Film]:
    """Yield films that could be made of the device."""
    model, states, first_film = fit.models[0], fit.states, fit.record.film == 0
    ends = fit.states[first_film][-1:]
    places = states[first_film][np.linspace(0, first_film.sum() - 1, _STARTS).astype(int)]
    for design, parameters, start in model.profile.discovery.films(model, places):
        yield Film(design, model.with_parameters(parameters) if parameters else model, start)
    yield Film("on for as long again", model, ends, again=True)


def _filmed(fit: Fit, film: Film) -> Film | None:
    """Simulate a film as long as the first one; None if the disk loses contact too soon."""
    first_film = fit.record.film == 0
    frames = int(first_film.sum())
    times = fit.record.t[first_film]
    t = np.median(np.diff(times)) * np.arange(frames)
    longest: Array = np.zeros((0, fit.states.shape[1]))
    for start in film.starts:
        try:
            run = integrated(film.model, t + (times[-1] if film.again else 0.0), start, rtol=1e-7, atol=1e-9)
        except UddError:
            continue
        # A run that loses contact is cut at the edge; its last time is not a frame's.
        states = run.state if run.outcome == "finished" else run.state[:-1]
        longest = max(longest, states, key=len)
        if len(longest) == frames:
            break
    is_feasible = len(longest) >= _SHORTEST * frames
    return replace(film, t=t[: len(longest)], states=longest) if is_feasible else None


@dataclass(frozen=True, eq=False)
class _Pair:
    """Chosen form and a rival, around the fit on which they were compared."""

    fit: Fit
    chosen: Candidate
    other: Alternative

    @classmethod
    def of(cls, discovery: Discovery, other: Alternative) -> _Pair | None:
        """Make the pair; None if the model already has the rival in addition to the chosen form."""
        model = discovery.trained.model
        effect = next((e for e in model.effects if e.name == other.instead_of), None)
        if effect is None:
            return None
        rest = model.with_effects([e for e in model.effects if e.name != effect.name])
        named = renamed(other.effect, rest)
        if named is None:
            return None
        return cls(discovery.trained, Candidate(effect, effect.title), replace(other, effect=named))

    @cached_property
    def free(self) -> tuple[Free, ...]:
        """Free parameters without those of the chosen form."""
        name = self.chosen.effect.name
        order = list(self._without(self.fit.models[0]).parameters)
        kept = (f for f in self.fit.problem.free if not f.name.startswith(f"{name}."))
        return tuple(replace(f, index=order.index(f.base)) if f.role == "model" else f for f in kept)

    def _without(self, model: Model) -> Model:
        return model.with_effects([e for e in model.effects if e.name != self.chosen.effect.name])

    def nats(self, film: Film | None) -> float:
        """Compute the forms' expected difference in log likelihood, with or without a further film."""
        problem, point = self._with(film)
        model = problem.models[0]
        forms = [_still(self.chosen), _still(Candidate(self.other.effect, self.other.title))]
        _gradient, information, _alone = _core.score(problem.at(point), [c.scored_in(model) for c in forms])
        k = len(self.chosen.amplitude_names)
        effects, rival_effects = np.arange(k), np.arange(k, len(information))
        a = _amplitudes(self.chosen.effect)
        b = _amplitudes(self.other.effect)
        rises = _rise(information, effects, rival_effects, a), _rise(information, rival_effects, effects, b)
        return 0.5 * min(rises) / max(self.fit.scatter, 1.0)

    def _with(self, film: Film | None) -> tuple[Problem, Point]:
        """Return the problem without the chosen form and with a further film, at the expected solution."""
        fit, problem = self.fit, self.fit.problem
        models = tuple(self._without(m) for m in fit.models)
        sets = [
            FilmParameters(list(m.parameters.values()), camera, clock)
            for m, (_values, camera, clock) in zip(models, fit.point.sets, strict=True)
        ]
        if film is None:
            alone = replace(problem, models=models, free=self.free)
            return alone, Point(fit.states, tuple(sets))
        record = _longer(fit.record, film.t, film.states, 0 if film.again else len(models))
        weight = np.concatenate([problem.noise.weight, np.ones(len(film.t))])
        free = self.free
        if not film.again:
            film_model = self._without(film.model)
            free = _for_films(free, models, film_model)
            models = (*models, film_model)
            sets.append(sets[0]._replace(model=list(film_model.parameters.values())))
        noise = replace(problem.noise, weight=weight)
        longer = replace(problem, models=models, record=record, free=free, noise=noise)
        return longer, Point(np.concatenate([fit.states, film.states]), tuple(sets))


def _still(candidate: Candidate) -> Candidate:
    """Set the candidate's amplitudes to zero."""
    effect = candidate.effect
    return replace(candidate, effect=effect.replace(**dict.fromkeys(effect.amplitudes, 0.0)))


def _amplitudes(effect: Effect) -> Array:
    return np.array([effect.parameters[name] for name in effect.amplitudes])


def _rise(information: Array, true: NDArray[np.int64], fitted: NDArray[np.int64], amplitudes: Array) -> float:
    """Compute the increase in chi2 if one form is true and the other is fitted."""
    shared = information[np.ix_(true, fitted)]
    taken = shared @ np.linalg.pinv(information[np.ix_(fitted, fitted)], hermitian=True) @ shared.T
    return max(float(amplitudes @ (information[np.ix_(true, true)] - taken) @ amplitudes), 0.0)


def _longer(record: Record, t: Array, states: Array, film: int) -> Record:
    """Append a further film's frames to a record, with the average noise of the others."""
    n, channels = len(t), record.seen.shape[1]
    typical = [np.median(s[np.isfinite(s)]) if np.isfinite(s).any() else np.inf for s in record.sigma.T]
    times = t if film else t + record.t[record.film == 0][-1]
    origins = record.origins if film < len(record.origins) else (*record.origins, record.origins[0])
    return Record(
        t=np.concatenate([record.t, times]),
        seen=np.concatenate([record.seen, np.zeros((n, channels))]),
        sigma=np.concatenate([record.sigma, np.tile(typical, (n, 1))]),
        rho=np.concatenate([record.rho, np.tile(record.rho.mean(axis=0), (n, 1, 1))]),
        linked=np.concatenate([record.linked, [False], np.ones(n - 1, dtype=bool)]),
        states=np.concatenate([record.states, states]),
        odd=np.concatenate([record.odd, np.zeros(n, dtype=bool)]),
        row=np.concatenate([record.row, np.full(n, -1)]),
        film=np.concatenate([record.film, np.full(n, film)]),
        origins=origins,
    )


def _for_films(free: Sequence[Free], models: Sequence[Model], further: Model) -> tuple[Free, ...]:
    """Return the free parameters with a further film, which has its own drive and camera."""
    if len(models) == 1:
        free = [replace(f, film=0, name=f"{f.name}[0]") if is_film_specific(f) else f for f in free]
    first = [f for f in free if f.film == 0]
    added = []
    for f in first:
        name = f.base
        other = replace(f, film=len(models), name=f"{name}[{len(models)}]")
        if f.role == "model" and models[0].parameters[name]:
            times = further.parameters[name] / models[0].parameters[name]
            other = replace(other, mean=f.mean * times, sd=f.sd * abs(times))
        added.append(other)
    return (*free, *added)


def is_film_specific(free: Free) -> bool:
    """Return True if every film has its own value."""
    return free.role != "model" or free.name == "W"
