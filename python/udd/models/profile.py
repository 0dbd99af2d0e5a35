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
    """Numbers for following and comparing the motion of a model: chaos, attractors, bifurcations, sweeps.

    Attributes
    ----------
    time_scale : float
        Typical time of the motion. That of the disk is 0.27 s.
    time_unit : str
        Unit of time. It is ``"s"``, or empty for a dimensionless model.
    drive : str or None
        Parameter that drives the motion. If it is zero, a fit fixes it at zero.
    start : tuple of float or None
        State from which orbits reach the main attractor. None if the user states it.
    section : str or None
        Component whose zero is the usual Poincaré section, and which its pictures show. If None, it is the
        maxima of the first state.
    crossing_rate : callable or None
        ``(parameters) -> rate``: typical crossings of a section in a unit of time. None means a tenth.
    sizes : callable or None
        ``(parameters) -> (sizes, clock)``: large values of the components by name, and a typical time of the
        motion. None if both follow from the states of the run.
    rotation : str or None
        Component that is a speed of rotation. Only models without an angle in their state need it.
    inertia : callable or None
        ``(model, states) -> inertia``: the moment of inertia per unit mass [m^2].
    energy : callable or None
        ``(model, states, rates) -> Powers``. None if the model has no energy function.
    averages : callable or None
        ``(model, exponents, mean, product) -> dict``: deviations of time averages from their exact values on
        a bounded orbit, by name. `mean` (d,) holds the means of the states, and `product` (d, d) those of
        products.
    inside : callable or None
        ``(parameters, states) -> bool``: True for states within the domain of the model.
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
        Columns of a measurement, and their units. Empty for a model that is not measured, and for one all of
        whose states may be measured.
    sigma : tuple of float
        Typical error of a camera in each column, in its unit. Used if a measurement states no errors.
    compared : int
        Number of the first columns that are compared between two motions: places by their distance, an angle
        by its size. Zero means the root mean square over all columns, in units of their spread.
    camera : mapping of str to float
        Prior of the camera's parameters. Each value is a standard deviation around zero.
    clock : float or None
        Prior of the rate of its clock. None if the clock is assumed to be right.
    pivot : tuple of str
        Parameters of the camera for the place of the pivot. The zero of an angle comes first.
    zero : str or None
        The only parameter of the sensor if an encoder reads the angle. None if no encoder can.
    faults : tuple of float
        Least error of a film, however little its frames scatter: faults of the camera and of the tracking
        that follow the motion. It is a root mean square per column.
    faithful : float
        Lower limit of noise that is not stated, as a share of `sigma`. Only a search uses it.
    sees_marks : bool
        True if a camera follows several marks. Then a moving camera or a drift cannot be mistaken for a
        motion of the body, and the frames show their noise.
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
    """Another unit in which the numbers may be, with the changes that follow from it.

    Attributes
    ----------
    text : str
        Sentence that names the unit.
    parameters : dict of str to float
        Parameters of the model in this case.
    factors : dict of str to float
        Factors of columns of the measurement, and of states. Other columns keep their values.
    shifts : dict of str to float
        Constants that are added to columns of the measurement, and to states.
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
        Number of these levels in a search. None means all.
    equations : mapping of str to str, or None
        States in whose equations a term may be missing, with the unit of that term. None means all states
        but those whose rate is another state.
    priors : mapping of str to float, or None
        Parameters that are free by default, with relative standard deviations of their priors. Infinite means
        no prior. If None, all parameters are free, without priors.
    each : tuple of str
        Parameters with a separate value for each of several measurements by default.
    fixed : mapping of str to float
        Standard uncertainties of the parameters that a fit fixes. They are in the parameters' units.
    stated : tuple of str
        Parameters that the owner of a device states. A fit far from them belongs to another device.
    unknown : tuple of str
        Free parameters of a comparison of units: the least certain ones. Empty if no units are compared.
    hardly : int
        Model error of that comparison, as an index into `model_error`.
    mistaken_unit : callable
        ``(model, step, values) -> sentence or None``: the fault of observed numbers (n, m), `step` s apart,
        that cannot be in s, m and rad.
    other_units : callable
        ``(model) -> iterator of OtherUnit``: units in which the numbers may be more probable.
    drive_seen : callable or None
        ``(t, values, seen) -> float``: the drive estimated from the frames alone.
    pace : callable or None
        ``(parameters) -> float``: the stated number that sets the frequency of the motion.
    ahead, window : float
        Default length of a forecast, and of the data before its start from which the state is filtered [s].
        For a user's own model both are in units of the motion's time scale.
    valid_error : float
        Error at which a forecast ceases to be valid, in :attr:`SensorProfile.error_unit`.
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
        Name in formulas and pictures.
    of : callable
        ``(t, states) -> values``. The states have their components along the last axis.
    rate : callable
        ``(states, rates) -> values``: its rate of change along the motion.
    angle : bool
        True if it counts modulo a turn.
    text : str
        Formula of the coordinate.
    """

    name: str
    of: Callable[[Floats, Floats], Floats]
    rate: Callable[[Floats, Floats], Floats]
    angle: bool
    text: str


class CurveSlot(NamedTuple):
    """Place of an unknown curve: an effect's slot, its momentum, and the state in whose equation."""

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
        Lengths of the free runs on held-out data [s]. For a user's own model all times here are in units of
        the motion's time scale.
    filter_window : float
        Length of the data before each run from which its state is filtered [s].
    filter_level : int
        The model error of that filter, as an index into its levels.
    chaotic : bool
        True if a wrong model with a small model error diverges within seconds, so that scores around it
        select the wrong effect. A motion that decays over minutes shows effects only around such a fit.
    brakes : tuple of str
        Parameters that must stay positive if a pair of effects is added.
    coordinates : callable
        ``(model) -> tuple of Coordinate``. These may be coordinates of a curve, like the states and time.
    slots : tuple of CurveSlot, or None
        Places where a curve may enter. None means the equations themselves.
    films : callable
        ``(model, places) -> iterator of FurtherFilm``: proposals of the next film. The argument `places`
        holds states of the record, in order.
    """

    horizons: tuple[float, ...] = (0.2, 0.4, 1.0, 2.0, 4.0)
    filter_window: float = 1.0
    filter_level: int = 2
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
        Name of the device, as in ``"the disk"``.
    columns : tuple of str
        Columns that are drawn over time by default, all in one unit. A forecast shows the last one.
    path : tuple of (str, str)
        Abscissa and ordinate in the picture of an orbit. Empty if none is drawn.
    space : tuple of str, or None
        Axes of phase space. None if that is a plane.
    contact : bool
        True if an orbit is drawn around the contact, in the circle in which it must stay.
    movie : float
        Length of the movie of the models side by side [s].
    forecast : float
        Length of a forecast in pictures [s].
    forecast_end : bool
        True if the end of a forecast is shown. Motions that diverge slowly need it.
    run_start : tuple of float, or None
        Initial state of ``udd simulate``.
    meanings : mapping of str to str
        Meanings of the parameters.
    measured : callable
        ``(model, stated) -> text``: description of the measured device. The argument `stated` is the model
        with the parameters that the user gave.
    taken_as_known : str
        Sentence about the numbers that no fit can determine.
    options : mapping of str to str
        Options of the command line whose names differ from those of their parameters.
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
