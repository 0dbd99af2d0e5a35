"""Models of the user's own, from text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd import _core
from udd._util.arguments import checked_arguments
from udd._util.expressions import Expression, text_of
from udd._util.validation import number
from udd.effects import Effect
from udd.effects.user_defined import along_of, delayed_by
from udd.errors import ModelError
from udd.measurement.input_signal import InputSignal

from .base import Model
from .profile import DiscoveryProfile, DynamicsProfile, FitProfile, ModelProfile

__all__ = ["FormulaModel", "cofactor", "determinant"]

_MOST_STATES = 12
_POINT = "__"


class FormulaText(NamedTuple):
    """The core's description of a formula model, without the values of its parameters."""

    states: list[str]
    equations: list[str]
    parameters: list[str]
    angles: list[str]
    inputs: list[str]
    delays: list[str | None]
    records: list[list[InputSignal]]
    record: int
    observe: list[tuple[str, str, str | None, bool]]


@dataclass(frozen=True, init=False, repr=False)
class FormulaModel(Model, written=True):
    """A user's own model, as :class:`udd.Model` makes it.

    Attributes
    ----------
    state_names : tuple of str
        Names of the state's components, in order.
    texts : tuple of str
        Rates of the states. The order is the same.
    values : tuple of (str, float)
        Parameters with their values.
    angles : tuple of str
        The states that are angles.
    effects : tuple of Effect
        Terms that were added to the equations. Their slot is a rate, as in ``"v'"``, or a force, as in
        ``"force(x)"``.
    mass : tuple of tuple of str
        The mass matrix; empty if not given.
    inputs : tuple of str
        The measured inputs.
    delays : tuple of (str, str)
        Inputs and sensors with a delay, each with the parameter of its delay.
    observe : tuple of (str, str)
        The sensors' names and formulas; empty if the states themselves are measured.
    turning : tuple of str
        Those of :attr:`channels` that are angles: a turn of an angle is a turn of the reading.
    records : tuple of mapping of str to InputSignal
        The measured inputs, record by record; empty until :meth:`with_inputs`.
    record : int
        The number of the record that :meth:`rates` and runs follow.

    See Also
    --------
    udd.Model : makes these models and documents the arguments.
    udd.fit : estimate the parameters.
    udd.plot.time_series : draw a run.
    """

    kind: ClassVar[str] = "own"
    _plain: ClassVar[tuple[str, ...]] = ()
    _options: ClassVar[tuple[str, ...]] = (
        "states",
        "equations",
        "parameters",
        "angles",
        "effects",
        "mass",
        "inputs",
        "delays",
        "observe",
    )

    state_names: tuple[str, ...]  # type: ignore[misc]
    texts: tuple[str, ...]
    values: tuple[tuple[str, float], ...]
    angles: tuple[str, ...]  # type: ignore[misc]
    effects: tuple[Effect, ...]
    mass: tuple[tuple[str, ...], ...]
    inputs: tuple[str, ...]  # type: ignore[misc]
    delays: tuple[tuple[str, str], ...]
    observe: tuple[tuple[str, str], ...]
    turning: tuple[str, ...] = field(compare=False)
    records: tuple[Mapping[str, InputSignal], ...] = field(compare=False)
    record: int = field(compare=False)

    def __new__(cls, *_arguments: Any, **_options: Any) -> FormulaModel:
        """Create an uninitialised instance, which a copy or a pickle fills itself."""
        return object.__new__(cls)

    @checked_arguments
    def __init__(
        self,
        states: Sequence[str],
        equations: Mapping[str, Expression] | Sequence[Expression],
        parameters: Mapping[str, float] | None = None,
        *,
        angles: Iterable[str] = (),
        effects: Iterable[Effect] = (),
        mass: Sequence[Sequence[Expression]] | None = None,
        inputs: Iterable[str] = (),
        delays: Mapping[str, str] | None = None,
        observe: Mapping[str, Expression] | None = None,
    ) -> None:
        names = _names("states", states)
        if not 1 <= len(names) <= _MOST_STATES:
            raise ModelError(f"a model has 1 to {_MOST_STATES} states, not {len(names)}")
        if not isinstance(parameters, Mapping | None):
            raise ModelError(f"parameters must be a table of names and values, not {parameters!r}")
        given = {} if parameters is None else {str(name): value for name, value in parameters.items()}
        values = tuple((name, number(f"the parameter {name:.80}", value)) for name, value in given.items())
        for name in given:
            if not name.isidentifier():
                raise ModelError(f"a parameter's name must be a single word, not {name!r}")
        driven, sensors = _names("inputs", inputs), _sensors(observe)
        turns = _names("angles", angles)
        for name in turns:
            if name not in names:
                raise ModelError(f"the angle {name!r} is no state; there are {', '.join(names)}")
        if twice := next((name for name in sensors if name in driven), None):
            raise ModelError(f"a sensor has the name of the input {twice}")
        self._set(
            state_names=names,
            texts=_equations(names, equations),
            values=values,
            angles=turns,
            effects=(),
            mass=(),
            inputs=driven,
            delays=_delays(driven, tuple(sensors), given, delays),
            observe=tuple(sensors.items()),
            turning=() if sensors else turns,
            records=(),
            record=0,
        )
        _core.model_parameters(self)  # which parses the equations
        if sensors and turns:
            self._set(turning=_turning(self))
        if mass is not None and len(mass):
            self._set(mass=_mass_matrix(self, mass))
        added = self._effects(effects)
        if added:
            self._set(effects=added)
            _core.model_parameters(self)

    def _set(self, **fields: Any) -> None:
        for name, value in fields.items():
            object.__setattr__(self, name, value)
        vars(self).pop("_own", None)

    def _with(self, **fields: Any) -> Self:
        """Return a copy with other fields, unchecked."""
        changed = object.__new__(type(self))
        changed._set(**vars(self) | fields)
        return changed

    @property
    def state_units(self) -> tuple[str, ...]:  # type: ignore[override]
        """The states' units, which are the user's."""
        return ("",) * len(self.state_names)

    @property
    def equations(self) -> dict[str, str]:
        """Each state's rate as text, without added effects."""
        return dict(zip(self.state_names, self.texts, strict=True))

    @property
    def channels(self) -> tuple[str, ...]:
        """The columns of a measurement: the sensors, or all states if there are no sensors."""
        return tuple(dict(self.observe)) or self.state_names

    @checked_arguments
    def observed(self, t: ArrayLike, states: ArrayLike) -> NDArray[np.float64]:
        """Compute the sensor readings for given states (the output equation).

        Parameters
        ----------
        t : array_like, shape (...)
            Times; broadcast against the states.
        states : array_like, shape (..., dim)

        Returns
        -------
        ndarray, shape (..., c)
            One column for each of :attr:`channels`. A delayed reading is that of an earlier state.

        Raises
        ------
        ModelError
            Numbers that are not finite, or shapes that do not fit.

        Examples
        --------
        >>> import udd
        >>> swing = udd.Model(
        ...     ["theta", "w"], ["w", "-sin(theta)"], {"gain": 2.0}, observe={"volts": "gain*theta"}
        ... )
        >>> swing.observed(0.0, [0.3, 1.0])
        array([0.6])
        """
        times, rows, shape = self._broadcast(t, states)
        return _core.observed(self, times, rows).reshape(*shape, len(self.channels))

    @property
    def names_time(self) -> bool:
        """True if a formula of the rates contains the time `t` or a measured input."""
        formula_text = self._own
        variables = [*formula_text.states, *formula_text.inputs]
        parsed = (
            _core.formula_operations(text, variables, formula_text.parameters)
            for text in formula_text.equations
        )
        return bool(formula_text.inputs) or any(
            name == "t" for operations in parsed for name, _, _ in operations
        )

    @property
    def kinematic(self) -> tuple[str, ...]:
        """States whose rate is another state by definition, as in ``theta' = v``."""
        pairs = zip(self.state_names, self.texts, strict=True)
        return tuple(name for name, text in pairs if text.strip() in self.state_names)

    @property
    def speeds(self) -> dict[str, str]:
        """The coordinates of a mechanical model, in order, each with the state that is its rate.

        Those of its states whose rate is a state of which no other one is the rate. A mass matrix has a row
        and a column for each.
        """
        rates = {name: self.equations[name].strip() for name in self.kinematic}
        return {name: speed for name, speed in rates.items() if speed not in rates}

    @checked_arguments
    def mass_matrix(self, states: ArrayLike) -> NDArray[np.float64]:
        """Evaluate the mass matrix.

        Parameters
        ----------
        states : array_like, shape (..., dim)

        Returns
        -------
        ndarray, shape (..., n, n)
            A row and a column for each of :attr:`speeds`.

        Raises
        ------
        ModelError
            The model has none.

        Examples
        --------
        >>> import udd
        >>> swing = udd.Model(["theta", "v"], ["v", "-sin(theta)"], {"m": 2.0}, mass=[["m"]])
        >>> swing.mass_matrix([0.1, 0.0])
        array([[2.]])
        """
        if not self.mass:
            raise ModelError("the model was given no mass matrix")
        rows = []
        for row in self.mass:
            rates = (*row, *["0"] * (len(self.state_names) - len(row)))
            entries = FormulaModel(self.state_names, rates, dict(self.values))
            rows.append(entries.rates(0.0, states)[..., : len(row)])
        return np.stack(rows, axis=-2)

    @checked_arguments
    def accelerations(self, along: str) -> dict[str, str]:
        """Return the accelerations by a unit force along a coordinate, as formulas.

        Parameters
        ----------
        along : str
            A coordinate, or the difference of two, between which the force then acts: ``"b - a"``.

        Returns
        -------
        dict of str to str
            By speed: a component of ``M^-1 e``, with the mass matrix M and the direction e.

        Raises
        ------
        ModelError
            No mass matrix, or a coordinate that there is not.
        """
        if not self.mass:
            raise ModelError(f"a force along {along} needs the model's mass matrix: udd.Model(..., mass=...)")
        speeds, (first, *rest) = list(self.speeds), (name.strip() for name in along.split(" - "))
        for name in (first, *rest):
            if name not in speeds or len(rest) > 1 or name in rest[:-1] or [first] == rest:
                between = (
                    f' or between two of them, as in "force({speeds[1]} - {speeds[0]})"' if speeds[1:] else ""
                )
                raise ModelError(
                    f"a force acts along one of {', '.join(speeds)}{between}, not along {along!r}"
                )
        n, whole = len(speeds), determinant(self.mass)
        result = {}
        for i, speed in enumerate(self.speeds.values()):
            parts = [cofactor(self.mass, speeds.index(first), i)]
            parts += [f"({cofactor(self.mass, speeds.index(name), i)})" for name in rest]
            result[speed] = f"({' - '.join(parts)})/({whole})" if n > 1 else f"1/({whole})"
        return result

    @property
    def parameters(self) -> dict[str, float]:
        """Name and value of every parameter, in order; an effect's are called ``effect.name``."""
        added = {f"{e.name}.{name}": value for e in self.effects for name, value in e.parameters.items()}
        return dict(self.values) | added

    @property
    def units(self) -> dict[str, str]:
        """The parameters' units, which are the user's."""
        return dict.fromkeys(self.parameters, "")

    @property
    def _spec(self) -> tuple[str, list[float], list[Any], bool]:
        """Return the core's description of the model; its equations contain the effects."""
        return self.kind, list(self.parameters.values()), [], False

    @cached_property
    def _own(self) -> FormulaText:
        """Return the core's description without the values."""
        texts = dict(self.equations)
        for effect in self.effects:
            for state, factor in self._entered(effect.slots[0]).items():
                term = _written(effect)
                texts[state] = f"{texts[state]} + ({term})" + (f"*({factor})" if factor else "")
        # A point is no part of a name there.
        names = [name.replace(".", _POINT) for name in self.parameters]
        delays = {name: parameter.replace(".", _POINT) for name, parameter in self.late.items()}
        return FormulaText(
            states=list(self.state_names),
            equations=list(texts.values()),
            parameters=names,
            angles=list(self.angles),
            inputs=list(self.inputs),
            delays=[delays.get(name) for name in self.inputs],
            records=[[record[name] for name in self.inputs] for record in self.records],
            record=self.record,
            observe=[(name, text, delays.get(name), name in self.turning) for name, text in self.observe],
        )

    @property
    def late(self) -> dict[str, str]:
        """Delayed inputs and sensors, each with its parameter: from :attr:`delays` and from effects."""
        pairs = ((delayed_by(effect.slots[0]), effect) for effect in self.effects)
        return dict(self.delays) | {name: f"{e.name}.{e.amplitudes[0]}" for name, e in pairs if name}

    def _entered(self, slot: str) -> dict[str, str]:
        """Return the states whose rates a slot adds to, with their factors; no factor for a rate itself."""
        along = along_of(slot)
        if delayed_by(slot):
            return {}
        return self.accelerations(along) if along else {slot.removesuffix("'"): ""}

    @checked_arguments
    def with_parameters(self, values: Mapping[str, float]) -> Self:
        """Return the model with other values of some parameters.

        Parameters
        ----------
        values : mapping of str to float
            New values by name; the other parameters keep theirs.

        Returns
        -------
        FormulaModel
            The same equations with these values.

        Raises
        ------
        ModelError
            An unknown name or a value that is not finite.
        """
        parameters = self.parameters
        for name in values:
            if name not in parameters:
                raise ModelError(
                    f"the model has no parameter {name!r}; it has {', '.join(parameters) or 'none'}"
                )
        new = [(n, number(f"the parameter {n}", values.get(n, v))) for n, v in self.values]
        return self._with(values=tuple(new), effects=self._effects_with(values))

    @checked_arguments
    def with_inputs(self, *records: Mapping[str, InputSignal], record: int = 0) -> Self:
        """Return the model with measured inputs.

        Parameters
        ----------
        *records : mapping of str to InputSignal
            A signal for every input; several records where a fit has several.
        record : int
            The number of the record that :meth:`rates` and runs follow.

        Returns
        -------
        FormulaModel
            The same equations with these signals.

        Raises
        ------
        ModelError
            An input without a signal, a signal of what is no input, or a record that there is not.

        Examples
        --------
        >>> import udd
        >>> cart = udd.Model(["x", "v"], ["v", "u - v"], inputs=["u"])
        >>> cart.with_inputs({"u": udd.InputSignal([0.0, 2.0], [0.0, 4.0])}).rates(1.0, [0.0, 0.5])
        array([0.5, 1.5])
        """
        checked = []
        for signals in records:
            if unknown := next((name for name in signals if name not in self.inputs), None):
                input_names = ", ".join(self.inputs) or "none"
                raise ModelError(f"the model has no input {unknown!r}; it has {input_names}")
            for name in self.inputs:
                if not isinstance(signals.get(name), InputSignal):
                    raise ModelError(
                        f"the input {name} needs a signal (a udd.InputSignal), not {signals.get(name)!r}"
                    )
            checked.append(dict(signals))
        if not 0 <= record < max(len(checked), 1):
            raise ModelError(f"there is no record {record} of the inputs: there are {len(checked)}")
        return self._with(records=tuple(checked) if self.inputs else (), record=record)

    @checked_arguments
    def with_term(self, equation: str, term: Expression, **amplitude: float) -> FormulaModel:
        """Return the model with a term added to one of its equations.

        Parameters
        ----------
        equation : str
            The state whose rate the term adds to.
        term : str or SymPy expression
            A formula of the states, ``t`` and the parameters.
        **amplitude : float
            The term's factor, a new parameter.

        Returns
        -------
        FormulaModel

        Raises
        ------
        ModelError
            An equation that there is not, a formula that cannot be used, or not exactly one factor with a
            new name.

        Examples
        --------
        >>> import udd
        >>> swing = udd.Model(["theta", "v"], ["v", "-sin(theta)"], angles=["theta"])
        >>> swing.with_term("v", "abs(v)*v", drag=-0.1).equations["v"]
        '-sin(theta) + drag*(abs(v)*v)'
        """
        if equation not in self.state_names:
            raise ModelError(f"there is no equation of {equation!r}; there are {', '.join(self.state_names)}")
        if len(amplitude) != 1:
            raise ModelError(f"a term has one factor, as in with_term({equation!r}, ..., c=0.0)")
        (name,) = amplitude
        if name in self.parameters:
            raise ModelError(f"the model has a parameter {name!r} already")
        text = f"{self.equations[equation]} + {name}*({text_of('the term', term)})"
        arguments = self._arguments() | {
            "equations": self.equations | {equation: text},
            "parameters": dict(self.values) | amplitude,
        }
        return FormulaModel(**arguments)._with(records=self.records, record=self.record)

    def _arguments(self) -> dict[str, Any]:
        """Return the arguments of the constructor."""
        return {
            "states": self.state_names,
            "equations": self.equations,
            "parameters": dict(self.values),
            "angles": self.angles,
            "effects": self.effects,
            "mass": self.mass,
            "inputs": self.inputs,
            "delays": dict(self.delays),
            "observe": dict(self.observe),
        }

    def with_effects(self, effects: Iterable[Effect]) -> Self:
        """Return the model with these effects instead of those added before.

        Parameters
        ----------
        effects : iterable of Effect
            Formulas and curves whose slot is the rate of a state, as in
            ``udd.effects.formula("v'", "c*abs(v)*v", c=-0.1)``; see also :meth:`with_term`. A model
            with a mass matrix also takes a force along a coordinate, ``"force(b)"``, or between two,
            ``"force(b - a)"``, which enters every acceleration.

        Returns
        -------
        FormulaModel
            The same equations with these terms.

        Raises
        ------
        ModelError
            An effect of disk or pendulum, one given twice, or one that names what the model does not have.
        """
        changed = self._with(effects=self._effects(effects))
        _core.model_parameters(changed)
        return changed

    def _effects(self, effects: Iterable[Effect]) -> tuple[Effect, ...]:
        given = (effects,) if isinstance(effects, Effect) else tuple(effects)
        for effect in given:
            if isinstance(effect, Effect) and self.kind not in effect.spec.bodies:
                raise ModelError(
                    f"{effect.name} acts on a udd.Disk or a udd.Pendulum; a model of your own takes a term: "
                    "with_term, or udd.effects.formula with the rate of a state for its slot"
                )
        result = super()._effects(given)
        late = [name for name, _parameter in self.delays]
        for effect in result:
            slot = effect.slots[0]
            if delayed := delayed_by(slot):
                _check_delay(effect, delayed, self.inputs, late)
                late.append(delayed)
            if any(state not in self.state_names for state in self._entered(slot)):
                rate_names = ", ".join(f"{name}'" for name in self.state_names)
                raise ModelError(f"{effect.name} adds to {slot}, but the model's rates are {rate_names}")
            for name in effect.parameters:
                if name in self.state_names:
                    raise ModelError(f"{effect.name} has a parameter {name!r}, which is the name of a state")
        return result

    def replace(self, **changes: Any) -> FormulaModel:
        """Return the model with other constructor arguments or parameters.

        Parameters
        ----------
        **changes
            Arguments of :func:`udd.Model`, or parameters by name.

        Returns
        -------
        FormulaModel
            The changed model.

        Raises
        ------
        ModelError
            An unknown name or an unusable value.
        """
        arguments = self._arguments()
        new_values = {name: changes.pop(name) for name in list(changes) if name in self.parameters}
        for name in changes:
            if name not in arguments:
                argument_names = ", ".join((*arguments, *self.parameters))
                raise ModelError(f"the model has no {name!r}; it has {argument_names}")
        new = FormulaModel(**(arguments | changes))
        if new.inputs == self.inputs:
            new = new._with(records=self.records, record=self.record)
        return new.with_parameters(new_values) if new_values else new

    def __repr__(self) -> str:
        angles = f", angles={list(self.angles)!r}" if self.angles else ""
        mass = f", mass={[list(row) for row in self.mass]!r}" if self.mass else ""
        inputs = f", inputs={list(self.inputs)!r}" if self.inputs else ""
        delays = f", delays={dict(self.delays)!r}" if self.delays else ""
        observe = f", observe={dict(self.observe)!r}" if self.observe else ""
        options = f"{angles}{mass}{inputs}{delays}{observe}"
        text = f"Model({list(self.state_names)!r}, {self.equations!r}, {dict(self.values)!r}{options})"
        return f"{text}.with_effects({list(self.effects)!r})" if self.effects else text


# Its sizes, units and times are the user's; what a fit needs to know of them the record says.
FormulaModel.profile = ModelProfile(
    written=True,
    dynamics=DynamicsProfile(time_scale=1.0),
    # The parameters that :mod:`udd.related_systems` and models like the disk's and the pendulum's state.
    fit=FitProfile(stated=("W", "length"), ahead=10.0, window=1.0, valid_error=0.2),  # of each state's spread
    discovery=DiscoveryProfile(horizons=(0.2, 0.4, 1.0, 2.0, 4.0), filter_window=1.0, filter_level=2),
)


def _check_delay(effect: Effect, delayed: str, inputs: Sequence[str], late: Sequence[str]) -> None:
    """Return True if an effect can be the delay of an input."""
    if delayed not in inputs:
        input_names = ", ".join(inputs) or "none"
        raise ModelError(f"{effect.name} delays {delayed}, but the model's inputs are {input_names}")
    if delayed in late:
        raise ModelError(f"the input {delayed} has a delay already: {effect.name} would be a second one")
    if effect.spec.core_formula is None or [effect.spec.core_formula[1]] != list(effect.amplitudes):
        raise ModelError(f"the delay {effect.name} must be one parameter, not a formula")


def _written(effect: Effect) -> str:
    """Write an effect's formula with the core's names of its parameters."""
    assert effect.spec.core_formula is not None
    if not effect.parameters:
        return effect.spec.core_formula[1]
    names = "|".join(map(re.escape, effect.parameters))
    return re.sub(
        rf"(?<![\w.])(?:{names})(?!\w)", rf"{effect.name}{_POINT}\g<0>", effect.spec.core_formula[1]
    )


def _mass_matrix(model: FormulaModel, given: Sequence[Sequence[Expression]]) -> tuple[tuple[str, ...], ...]:
    """Convert a mass matrix to text and check it at a few states."""
    speeds = list(model.speeds)
    if not speeds:
        raise ModelError("a mass matrix needs coordinates: states whose equation is another state")
    try:
        rows = [list(row) for row in given if not isinstance(row, str)]
    except TypeError:
        rows = []
    if [len(row) for row in rows] != [len(speeds)] * len(speeds):
        raise ModelError(f"mass must be a table with a row and a column for each of {', '.join(speeds)}")
    mass = tuple(tuple(text_of("the mass matrix", one) for one in row) for row in rows)
    mass_model = model._with(mass=mass)
    # Numbers without a pattern, in which no formula is symmetric by accident.
    states = np.sin(np.arange(1.0, 3 * len(model.state_names) + 1)).reshape(3, -1)
    try:
        at = mass_model.mass_matrix(states)
    except ModelError as error:
        raise ModelError(re.sub(r"the equation of \w+", "the mass matrix", str(error))) from None
    at = at[np.isfinite(at).all(axis=(1, 2))]
    if not np.allclose(at, np.swapaxes(at, 1, 2), rtol=1e-9, atol=0.0):
        raise ModelError("the mass matrix must be symmetric")
    if len(at) and np.linalg.eigvalsh(at).min() <= 0.0:
        raise ModelError("the mass matrix must be positive definite")
    return mass


def _sensors(observe: Mapping[str, Expression] | None) -> dict[str, str]:
    """Convert the sensors' formulas to text, by name."""
    if not isinstance(observe, Mapping | None):
        raise ModelError(f"observe must be a table of sensors and formulas, not {observe!r}")
    given = {str(name): one for name, one in (observe or {}).items()}
    for name in given:
        if not name.isidentifier() or name == "t":
            raise ModelError(f"a sensor's name must be a single word other than t, not {name!r}")
    return {name: text_of(f"what {name} sees", one) for name, one in given.items()}


def _turning(model: FormulaModel) -> tuple[str, ...]:
    """Return the sensors for which a turn of an angle is a turn, for any values of the parameters."""
    values = {name: 1.1 * value + 0.0123 for name, value in model.values}
    model = model._with(delays=()).with_parameters(values)
    if model.inputs:
        still = InputSignal([0.0, 1.0], [0.0, 0.0])
        model = model.with_inputs(dict.fromkeys(model.inputs, still))
    start = np.sin(np.arange(1.0, len(model.state_names) + 1))
    turned_channels = set()
    for name in model.angles:
        turned = start + 2 * np.pi * (np.array(model.state_names) == name)
        with np.errstate(all="ignore"):  # where a formula has no value it shows no turn either
            moved = np.abs(model.observed(0.0, turned) - model.observed(0.0, start))
        turned_channels |= {model.channels[k] for k in np.flatnonzero(np.abs(moved - 2 * np.pi) < 1e-9)}
    return tuple(name for name in model.channels if name in turned_channels)


def _delays(
    inputs: tuple[str, ...],
    sensors: tuple[str, ...],
    parameters: Mapping[str, float],
    delays: Mapping[str, str] | None,
) -> tuple[tuple[str, str], ...]:
    """Return the delayed inputs and sensors, each with its parameter."""
    if not isinstance(delays, Mapping | None):
        raise ModelError(f"delays must be a table of inputs or sensors and parameters, not {delays!r}")
    for name, parameter in (delays or {}).items():
        if name not in inputs and name not in sensors:
            sensor_text = f" and the sensors {', '.join(sensors)}" if sensors else ""
            raise ModelError(
                f"there is a delay of {name!r}, but the inputs are {', '.join(inputs) or 'none'}{sensor_text}"
            )
        if parameter not in parameters:
            parameter_names = ", ".join(parameters) or "none"
            raise ModelError(
                f"the delay of {name} must be one of the parameters {parameter_names}, not {parameter!r}"
            )
    return tuple((delays or {}).items())


def determinant(matrix: Sequence[Sequence[str]]) -> str:
    """Expand the determinant of a matrix of formulas by its first row."""
    if len(matrix) == 1:
        return matrix[0][0]
    parts = (f"({one})*({cofactor(matrix, 0, k)})" for k, one in enumerate(matrix[0]))
    return " + ".join(parts)


def cofactor(matrix: Sequence[Sequence[str]], i: int, k: int) -> str:
    """Compute a cofactor of a matrix of formulas: cofactors over the determinant give a symmetric inverse."""
    if len(matrix) == 1:
        return "1"
    rest = [[*row[:k], *row[k + 1 :]] for row in (*matrix[:i], *matrix[i + 1 :])]
    return f"-({determinant(rest)})" if (i + k) % 2 else f"({determinant(rest)})"


def _names(what: str, names: Iterable[str]) -> tuple[str, ...]:
    try:
        result = () if isinstance(names, str) else tuple(names)
        fine = all(str(name).isidentifier() for name in result)
    except TypeError:
        fine = False
    if isinstance(names, str) or not fine:
        raise ModelError(f"{what} must be a list of names, each a single word, not {names!r}")
    return tuple(str(name) for name in result)


def _equations(
    names: tuple[str, ...], equations: Mapping[str, Expression] | Sequence[Expression]
) -> tuple[str, ...]:
    """Return the rates in the order of the states."""
    if isinstance(equations, Mapping):
        given = {str(name): equation for name, equation in equations.items()}
        for name in names:
            if name not in given:
                raise ModelError(f"the state {name} has no equation")
        for name in given:
            if name not in names:
                raise ModelError(f"there is an equation of {name!r}, but the states are {', '.join(names)}")
        listed: list[Expression] = [given[name] for name in names]
    elif isinstance(equations, Sequence) and not isinstance(equations, str):
        listed = list(equations)
        if len(listed) != len(names):
            raise ModelError(f"there are {len(names)} states but {len(listed)} equations")
    else:
        raise ModelError(f"equations must be a table or a list of formulas, not {equations!r}")
    return tuple(
        text_of(f"the equation of {name}", equation) for name, equation in zip(names, listed, strict=True)
    )
