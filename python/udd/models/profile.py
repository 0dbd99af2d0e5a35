"""Profiles: the properties of models apart from the equations, as plain numbers and functions.

The file of each model defines its profile, with the reasons for its numbers. It has one group for each
reader. Code that needs a property of a model reads ``model.profile``, or :func:`udd.models.profile_of` if
only the kind is known, instead of testing for a model.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from udd._util.one_line import OneLine

Floats = NDArray[np.float64]
#: Parameters by name: numbers, or columns with a value for each of many orbits.
Parameters = Mapping[str, Any]


class Powers(NamedTuple):
    """The energy of states and what changes it, per unit mass: :func:`udd.energy_balance`."""

    stored: Floats
    motor: float
    change: Floats
    friction: Floats


@dataclass(frozen=True)
class DynamicsProfile:
    """How the motion of a model is followed and compared: chaos, attractors, bifurcations, sweeps.

    Attributes
    ----------
    time_scale : float
        About the unit of time in which the motion takes place, that of the disk being 0.27 s.
    time_unit : str
        ``"s"``; empty where time has no unit.
    drive : str or None
        The parameter that drives the motion: what a fit holds at rest where it is zero.
    start : tuple of float or None
        A state from which orbits reach the main attractor; None where that is the user's to say.
    section : str or None
        The component whose zero is the usual Poincaré section, and which its pictures show; None for the
        maxima of the first state.
    crossing_rate : callable or None
        ``(parameters) -> rate``: typical crossings of a section in a unit of time; None for a tenth.
    sizes : callable or None
        ``(parameters) -> (sizes, clock)``: what is large for the components by name, and a typical time of
        the motion; None where the states that occur say it.
    rotation : str or None
        A component that is a speed of rotation, of a model whose state holds no angle.
    inertia : callable or None
        ``(model, states) -> inertia``: the moment of inertia per unit mass, m^2.
    energy : callable or None
        ``(model, states, rates) -> Powers``; None where no energy is known.
    averages : callable or None
        ``(model, exponents, mean, product) -> dict``: how far time averages on a bounded orbit are from what
        they must be, by what they are. `mean` (d,) is that of the states, `product` (d, d) that of products.
    inside : callable or None
        ``(parameters, states) -> bool``: where a model that can leave its domain has not left it.
    """

    time_scale: float = 0.25
    time_unit: str = "s"
    drive: str | None = None
    start: tuple[float, ...] | None = None
    section: str | None = None
    crossing_rate: Callable[[Parameters], Floats] | None = None
    sizes: Callable[[Parameters], tuple[dict[str, float], float]] | None = None
    rotation: str | None = None
    inertia: Callable[[Any, Floats], Floats | float] | None = None
    energy: Callable[[Any, Floats, Floats], Powers] | None = None
    averages: Callable[[Any, Floats, Floats, Floats], dict[str, float]] | None = None
    inside: Callable[[Parameters, Floats], NDArray[np.bool_]] | None = None

    @property
    def rate_unit(self) -> str:
        """The unit of a rate, one over the time's; 1 if time has no unit."""
        return f"1/{self.time_unit}" if self.time_unit else "1"


@dataclass(frozen=True)
class SensorProfile:
    """The columns of a measurement of the model, and the errors of a camera.

    Attributes
    ----------
    columns, units : tuple of str
        What a measurement consists of. Empty of a model that nothing measures, or any of whose states may be
        measured.
    sigma : tuple of float
        What a camera typically gets wrong in each column, in its unit, where a measurement does not say.
    compared : int
        How many of the first columns two motions are compared by: places by their distance, an angle by its
        size; none for the root mean square over all columns, in units of their spread.
    camera : mapping of str to float
        What is known of the camera's parameters beforehand, as standard deviations around zero.
    clock : float or None
        The same of the rate of its clock; None where that is taken to be right.
    pivot : tuple of str
        Those of the camera's parameters that say where the pivot is, the zero of an angle first.
    zero : str or None
        The camera's only parameter where an encoder reads the angle; None where no encoder does.
    faults : tuple of float
        What no film is better than, however little its frames scatter: faults of the camera and of the
        tracking that go with the motion, as a root mean square per column.
    faithful : float
        In a search noise that is not stated is at least this part of `sigma`.
    sees_marks : bool
        Whether a camera follows several marks. Then nothing that moves with the camera, or drifts, looks like
        a motion of the body, and the frames show their own noise.
    """

    columns: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    sigma: tuple[float, ...] = ()
    compared: int = 0
    camera: Mapping[str, float] = field(default_factory=dict)
    clock: float | None = None
    pivot: tuple[str, ...] = ()
    zero: str | None = None
    faults: tuple[float, ...] = (0.0,)
    faithful: float = 0.0
    sees_marks: bool = False

    @property
    def error_unit(self) -> str:
        """The unit in which two motions are compared: ``"m"``, ``"rad"``, or ``"spread"`` of the columns."""
        return self.units[0] if self.compared else "spread"


@dataclass(frozen=True)
class OtherUnit:
    """Another unit that numbers may be in: the sentence that says so, and what changes then.

    Attributes
    ----------
    text : str
    parameters : dict of str to float
        The model's parameters then.
    factors : dict of str to float
        By what columns of the measurement are multiplied then, and the states with them.
    shifts : dict of str to float
        What is added to columns of the measurement then, and to states.
    """

    text: str
    parameters: dict[str, float] = field(default_factory=dict)
    factors: dict[str, float] = field(default_factory=dict)
    shifts: dict[str, float] = field(default_factory=dict)


def no_unit(_model: Any, *_rows: Any) -> None:
    """Accept all units."""


def no_units(_model: Any) -> Iterator[OtherUnit]:
    """Yield no other unit."""
    return iter(())


@dataclass(frozen=True)
class FitProfile:
    """The assumptions of a fit before it uses the data.

    Attributes
    ----------
    model_error : tuple of tuple of float
        The assumed model error of a search over one frame of 40 ms, from large to small, per state in its
        unit. With a large one a wrong model follows the data and the noise is estimated; with a small one
        weak effects show. A fit derives its model errors from the record. Empty if a search does so, too.
    searched : int or None
        The number of these levels in a search; None for all.
    equations : mapping of str to str, or None
        The states in whose equations something may be missing, with the unit of the missing term; None for
        all but those that define one state as the rate of another.
    priors : mapping of str to float, or None
        The free parameters by default, with the relative standard deviations of the priors; infinite without
        a prior. By default all parameters are free, without priors.
    each : tuple of str
        The parameters that by default have a separate value for each of several measurements.
    fixed : mapping of str to float
        Standard uncertainties of the parameters that a fit fixes, in the parameters' units.
    stated : tuple of str
        The parameters that a device's owner states: a fit far from them is one of something else.
    unknown : tuple of str
        The free parameters of a comparison of units: those known least; empty if no units are compared.
    hardly : int
        The model error of that comparison, as an index into `model_error`.
    mistaken_unit : callable
        ``(model, step, values) -> sentence or None``: what is wrong with the numbers of the frames seen,
        (n, m), `step` s apart, if they cannot be in s, m and rad.
    other_units : callable
        ``(model) -> iterator of OtherUnit``: the units in which the numbers may be likelier.
    drive_seen : callable or None
        ``(t, values, seen) -> float``: the drive as the frames alone show it.
    pace : callable or None
        ``(parameters) -> float``: what sets the pace of the motion, and is stated.
    ahead, window : float
        How far a forecast goes by default, and the data before its start from which the state is filtered, s;
        of a user's own model in units of the motion's time scale.
    valid_error : float
        The error from which on a forecast is no longer valid, in :attr:`SensorProfile.error_unit`.
    """

    model_error: tuple[tuple[float, ...], ...] = ()
    searched: int | None = None
    equations: Mapping[str, str] | None = None
    priors: Mapping[str, float] | None = None
    each: tuple[str, ...] = ("W",)
    fixed: Mapping[str, float] = field(default_factory=dict)
    stated: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    hardly: int = 0
    mistaken_unit: Callable[[Any, float, Floats], str | None] = no_unit
    other_units: Callable[[Any], Iterator[OtherUnit]] = no_units
    drive_seen: Callable[[Floats, Floats, NDArray[np.bool_]], float] | None = None
    pace: Callable[[Parameters], float] | None = None
    ahead: float = 10.0
    window: float = 1.0
    valid_error: float = 0.2


@dataclass(frozen=True, repr=False)
class Coordinate(OneLine):
    """Something that an unknown curve can be a function of.

    Attributes
    ----------
    name : str
        As the formulas' grammar and the pictures call it.
    of : callable
        ``(t, states) -> values``, states with the components along the last axis.
    rate : callable
        ``(states, rates) -> values``: how fast it changes along the motion.
    angle : bool
        Whether it counts modulo a turn.
    text : str
        What it is in formulas.
    """

    name: str
    of: Callable[[Floats, Floats], Floats]
    rate: Callable[[Floats, Floats], Floats]
    angle: bool
    text: str


class CurveSlot(NamedTuple):
    """Where an unknown curve may enter: an effect's slot, its momentum, and the state in whose equation."""

    name: str
    momentum: str | None
    equation: str


class FurtherFilm(NamedTuple):
    """A film that could be made: what to film, the parameters changed, and states to start from, in turn."""

    design: str
    parameters: dict[str, float]
    start: Floats


def no_coordinates(_model: Any) -> tuple[Coordinate, ...]:
    """Return no coordinates apart from the states and time."""
    return ()


def no_films(_model: Any, _places: Floats) -> Iterator[FurtherFilm]:
    """Propose no further film; only a longer one helps."""
    return iter(())


@dataclass(frozen=True)
class DiscoveryProfile:
    """The settings of a search for missing effects.

    Attributes
    ----------
    horizons : tuple of float
        Lengths of the free runs on held-out data, s; for a user-defined model, like all times
        here, in units of the motion's time scale.
    filter_window : float
        Data before each of them from which its state is filtered, s.
    filter_level : int
        The model error of that filter, as an index into its levels.
    pairs : bool
        True if a search also tries two effects at once after one passes; otherwise only with formulas.
    chaotic : bool
        True if a wrong model with a small model error diverges within seconds, so that scores around it
        select the wrong effect. A motion that decays over minutes shows effects only around such a fit.
    brakes : tuple of str
        Parameters that a pair of effects must not turn negative.
    coordinates : callable
        ``(model) -> tuple of Coordinate``: further inputs of a curve apart from the states and time.
    slots : tuple of CurveSlot, or None
        Where a curve may enter; None for the equations themselves.
    films : callable
        ``(model, places) -> iterator of FurtherFilm``: proposals of the next film; `places` are states of the
        record, in order.
    """

    horizons: tuple[float, ...] = (0.2, 0.4, 1.0, 2.0, 4.0)
    filter_window: float = 1.0
    filter_level: int = 2
    pairs: bool = True
    chaotic: bool = False
    brakes: tuple[str, ...] = ()
    coordinates: Callable[[Any], tuple[Coordinate, ...]] = no_coordinates
    slots: tuple[CurveSlot, ...] | None = None
    films: Callable[[Any, Floats], Iterator[FurtherFilm]] = no_films


def no_words(_model: Any, _stated: Any) -> str:
    """Return no description of the device."""
    return ""


@dataclass(frozen=True)
class ShownProfile:
    """The words and views of the model in pictures and pages.

    Attributes
    ----------
    noun : str
        What is filmed, as in ``"the disk"``.
    columns : tuple of str
        What is drawn over time by default, all in one unit; a forecast's picture shows the last one.
    path : tuple of (str, str)
        Across and up in the picture of an orbit; empty where none is drawn.
    space : tuple of str, or None
        The axes of phase space; None where that is a plane.
    contact : bool
        Whether an orbit is drawn around the contact, in the circle in which it must stay.
    movie : float
        For how long the models are shown side by side, s.
    forecast : float
        For how long a forecast is shown, s.
    forecast_end : bool
        Whether a forecast's end is shown: that of a motion which loses step slowly.
    run_start : tuple of float, or None
        Where ``udd simulate`` starts.
    meanings : mapping of str to str
        The parameters in words.
    measured : callable
        ``(model, stated) -> text``: what was measured; `stated` is the model as it was stated.
    taken_as_known : str
        The sentence that says what no fit can find out.
    options : mapping of str to str
        Parameters whose option on the command line has another name.
    """

    noun: str = ""
    columns: tuple[str, ...] = ()
    path: tuple[str, ...] = ()
    space: tuple[str, ...] | None = None
    contact: bool = False
    movie: float = 6.0
    forecast: float = 3.0
    forecast_end: bool = False
    run_start: tuple[float, ...] | None = None
    meanings: Mapping[str, str] = field(default_factory=dict)
    measured: Callable[[Any, Any], str] = no_words
    taken_as_known: str = ""
    options: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ModelProfile:
    """The properties of a model apart from its equations.

    Attributes
    ----------
    written : bool
        True if the user wrote the equations: then states, units, sizes and times are the user's. Any states
        may be measured, and the record gives all other settings.
    dynamics : DynamicsProfile
    sensor : SensorProfile
    fit : FitProfile
    discovery : DiscoveryProfile
    shown : ShownProfile
    """

    written: bool = False
    dynamics: DynamicsProfile = DynamicsProfile()
    sensor: SensorProfile = SensorProfile()
    fit: FitProfile = FitProfile()
    discovery: DiscoveryProfile = DiscoveryProfile()
    shown: ShownProfile = ShownProfile()
