"""The base class of models: equations with parameters and effects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd import _core
from udd._util.arguments import checked_arguments
from udd._util.keywords import renamed_attribute
from udd._util.validation import array, number
from udd.effects import Effect
from udd.effects.spec import CoreFormula
from udd.errors import ModelError

from .profile import ModelProfile

if TYPE_CHECKING:
    from udd._util.expressions import Expression

    from .formula_model import FormulaModel

__all__ = ["Model", "require_model"]


def require_model(given: object) -> None:
    """Refuse what is no model.

    Raises
    ------
    ModelError
    """
    if not isinstance(given, Model):
        raise ModelError(f"a model is needed (udd.DLE, udd.Disk, udd.Pendulum or a udd.Model), not {given!r}")


class Model:
    """Model in text form, and base class of all models.

    Models are immutable: changes make a new one.

    Parameters
    ----------
    states : sequence of str
        Names of the state's components. There are 1 to 12.
    equations : mapping of str to formula, or sequence of formula
        The rate of each state: text or a SymPy expression. It may contain the states, the parameters, the
        time ``t``, numbers and ``pi``. Operators and functions are ``+ - * / ^``, ``sqrt``, ``exp``, ``ln``,
        ``sin``, ``cos``, ``tan``, ``sinh``, ``cosh``, ``tanh``, ``atan``, ``atan2(y, x)``, ``abs``, ``sign``,
        ``min(a, b)``, ``max(a, b)``, ``where(x > c, a, b)`` and ``bspline``, the cardinal cubic B-spline.
    parameters : mapping of str to float, optional
        The parameters' values.
    angles : iterable of str
        The states that are angles in rad: they may grow without end.
    mass : sequence of sequence of formula, optional
        The mass matrix of a mechanical model: formulas of the states and parameters. It has a row and a
        column for each coordinate (a state whose equation is another state), in their order. The equations
        are still stated in full. With a mass matrix, :func:`udd.discover` searches for missing forces, which
        enter every acceleration, such as friction in a joint.
    inputs : sequence of str, optional
        Measured inputs (exogenous signals), such as a motor's torque. The equations may use their names.
        Their samples come with the run or the record: ``udd.simulate(..., inputs=...)``,
        ``udd.Measurement(..., inputs=...)``.
    delays : mapping of str to str, optional
        Inputs that act on the model later, and sensors that are late. Each has the parameter that is its
        delay [s].
    observe : mapping of str to formula, optional
        Readings of the sensors (the output equation): a formula for each column of a measurement, at most
        12. It may contain the states, their rates (``w'``), the parameters and ``t``. An example is
        ``{"volts": "gain*theta + zero"}``. Without it the columns are states.

    Raises
    ------
    ModelError
        A name that a formula may not use, a state without an equation, a value that is not finite, a mass
        matrix that is not symmetric and positive definite.

    See Also
    --------
    udd.mechanism : a model from a mass matrix and forces.
    udd.related_systems : predefined models.
    udd.fit : estimate the parameters from data.

    Notes
    -----
    The equations are parsed to a list of operations, which the core evaluates; nothing in them is executed.

    The equations have a kink or jump at each change of ``abs``, ``sign``, ``min``, ``max`` and ``where``.
    Runs land on up to six such surfaces and record the events ``"kink"``, ``"jump"``, ``"stick"`` and
    ``"slip"``. A surface on which the state can stick counts for two, all measured inputs together for one.
    Power series restart there. Derivatives pass through, with the saltation matrix of a jump. Runs cross
    further surfaces by small steps, and such a model has no power series.

    References
    ----------
    Sliding on a switching surface: A. F. Filippov [16]. Saltation matrix: R. I. Leine and H. Nijmeijer [17].
    Taylor series: À. Jorba and M. Zou [13].

    Examples
    --------
    >>> import udd
    >>> lorenz = udd.Model(
    ...     ["x", "y", "z"],
    ...     {"x": "sigma*(y - x)", "y": "x*(rho - z) - y", "z": "x*y - beta*z"},
    ...     {"sigma": 10.0, "rho": 28.0, "beta": 8 / 3},
    ... )
    >>> lorenz.rates(0.0, [1.0, 2.0, 3.0])
    array([10., 23., -6.])
    >>> udd.simulate(lorenz, 1.0, [1.0, 1.0, 1.0], method="taylor").outcome
    'finished'
    """

    kind: ClassVar[str]
    """``"dle"``, ``"disk"``, ``"pendulum"`` or ``"own"``."""
    state_names: ClassVar[tuple[str, ...]]
    """The names of the state's components, in order."""
    state_units: ClassVar[tuple[str, ...]]
    """Their units, empty where dimensionless."""
    angles: ClassVar[tuple[str, ...]] = ()
    """The components that are angles: they may grow without end."""
    inputs: ClassVar[tuple[str, ...]] = ()
    """Its measured inputs."""
    profile: ClassVar[ModelProfile]
    """Its properties apart from the equations."""
    _plain: ClassVar[tuple[str, ...]]
    _options: ClassVar[tuple[str, ...]] = ("effects",)
    _written: ClassVar[type[FormulaModel]]
    effects: tuple[Effect, ...]

    def __new__(
        cls,
        states: Sequence[str],
        equations: Mapping[str, Expression] | Sequence[Expression],
        parameters: Mapping[str, float] | None = None,
        *,
        angles: Iterable[str] = (),
        mass: Sequence[Sequence[Expression]] | None = None,
        inputs: Iterable[str] = (),
        delays: Mapping[str, str] | None = None,
        observe: Mapping[str, Expression] | None = None,
    ) -> FormulaModel:
        """Make a user-defined model, of the subclass that declares itself ``written``."""
        return cls._written.__new__(cls._written)

    def __init_subclass__(cls, *, written: bool = False, **options: Any) -> None:
        super().__init_subclass__(**options)
        if written:
            Model._written = cast("type[FormulaModel]", cls)

    slow = renamed_attribute("slow", "time_scale")

    @property
    def time_scale(self) -> float:
        """Typical time of the motion; for the disk 0.27 s."""
        return self.profile.dynamics.time_scale

    @property
    def names_time(self) -> bool:
        """True if a formula of the rates may contain the time `t`; a compiled law may."""
        return True

    @property
    def kinematic(self) -> tuple[str, ...]:
        """States whose rate is another state by definition; none for a compiled law."""
        return ()

    @property
    def parameters(self) -> dict[str, float]:
        """Name and value of every parameter, in order; an effect's are called ``effect.name``."""
        result = {name: float(getattr(self, name)) for name in self._plain}
        for effect in self.effects:
            result.update({f"{effect.name}.{name}": value for name, value in effect.parameters.items()})
        return result

    @property
    def units(self) -> dict[str, str]:
        """The unit of every parameter, empty where dimensionless."""
        effect_units = {
            f"{e.name}.{p.name}": p.unit for e in self.effects if e.made for p in e.spec.parameters
        }
        return dict(_core.model_parameters(self)) | effect_units

    @property
    def _spec(
        self,
    ) -> tuple[str, list[float], list[tuple[str, str | None, str | None, CoreFormula | None]], bool]:
        """Return the core's description of the model."""
        effects = [(e.name, e.momentum, e.treatment, e.spec.core_formula) for e in self.effects]
        return self.kind, list(self.parameters.values()), effects, getattr(self, "edge", "ignore") == "stop"

    @checked_arguments
    def with_parameters(self, values: Mapping[str, float]) -> Self:
        """Return the model with other values of some parameters.

        Parameters
        ----------
        values : mapping
            Any of :attr:`parameters`. As on the way of a fit, friction, drive and amplitudes may leave their
            physical ranges; sizes must stay positive and everything finite.

        Returns
        -------
        Model
            Of the same class.

        Raises
        ------
        ModelError
            An unknown name or an unusable value.

        Examples
        --------
        >>> import udd
        >>> udd.Disk(0.039).with_parameters({"W": 0.05}).W
        0.05
        """
        parameters = self.parameters
        for name in values:
            if name not in parameters:
                raise ModelError(
                    f"{type(self).__name__} has no parameter {name!r}; it has {', '.join(parameters)}"
                )
        return self._changed({n: values[n] for n in self._plain if n in values}, self._effects_with(values))

    def _effects_with(self, values: Mapping[str, float]) -> tuple[Effect, ...]:
        """Return the effects with other values of some parameters, by the model's names."""
        effects = []
        for effect in self.effects:
            changes = {p: values[key] for p in effect.parameters if (key := f"{effect.name}.{p}") in values}
            effects.append(effect.replace(**changes) if changes else effect)
        return tuple(effects)

    def with_effects(self, effects: Iterable[Effect]) -> Self:
        """Return the model with these effects instead of its present ones.

        Parameters
        ----------
        effects : iterable of Effect
            All effects of the new model; an empty list removes them.

        Returns
        -------
        Model
            Of the same class.

        Raises
        ------
        ModelError
            An effect given twice, or one that the model cannot have.
        """
        return self._changed({}, self._effects(effects))

    def _changed(self, plain: Mapping[str, float], effects: tuple[Effect, ...]) -> Self:
        """Return a copy with other numbers; check only for values that break the equations."""
        new = object.__new__(type(self))
        for name, value in vars(self).items():
            object.__setattr__(new, name, value)
        for name, value in plain.items():
            positive = 0.0 if name in ("R", "length", "inertia") else None
            object.__setattr__(new, name, number(name, value, above=positive))
        object.__setattr__(new, "effects", effects)
        new._add_bristles()
        return new

    def _add_bristles(self) -> None:
        """Add the state of LuGre friction, the bristles' deflection."""
        names, units = type(self).state_names, type(self).state_units
        if any(effect.treatment == "lugre" for effect in self.effects):
            names, units = (*names, "bristle"), (*units, "rad")
        object.__setattr__(self, "state_names", names)
        object.__setattr__(self, "state_units", units)

    def _effects(self, effects: Iterable[Effect]) -> tuple[Effect, ...]:
        if isinstance(effects, Effect):
            effects = (effects,)
        try:
            result = tuple(effects)
        except TypeError:
            raise ModelError(f"effects must be a list of effects, not {effects!r}") from None
        for effect in result:
            if not isinstance(effect, Effect):
                raise ModelError(f"effects must be made by udd.effects, not {effect!r}")
            if self.kind not in effect.spec.bodies:
                bodies = " or ".join(effect.spec.bodies)
                raise ModelError(f"the effect {effect.name} acts on a {bodies}, not on a {self.kind}")
        names = [effect.name for effect in result]
        for name in names:
            if names.count(name) > 1:
                raise ModelError(f"the effect {name} is given twice")
        return result

    def rates(self, t: ArrayLike, state: ArrayLike) -> NDArray[np.float64]:
        """Evaluate the right-hand side of the equations of motion.

        Parameters
        ----------
        t : array_like, shape (...)
            Times; broadcast against the states.
        state : array_like, shape (..., dim)
            States.

        Returns
        -------
        ndarray, shape (..., dim)
            The state's time derivatives.

        Raises
        ------
        ModelError
            Numbers that are not finite, or shapes that do not fit.

        Examples
        --------
        >>> import udd
        >>> udd.DLE(1.0).rates(0.0, [1.0, 1.0, 0.5])
        array([0. , 0.5, 0. ])
        """
        times, states, shape = self._broadcast(t, state)
        return _core.rates(self, times, states).reshape(*shape, len(self.state_names))

    def _broadcast(
        self, t: ArrayLike, state: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[int, ...]]:
        """Times and states in a row, and the shape that they had together."""
        times, states = array("t", t), array("state", state)
        dim = len(self.state_names)
        if states.ndim == 0 or states.shape[-1] != dim:
            raise ModelError(
                f"the state must have {dim} components ({', '.join(self.state_names)}), not {states.shape}"
            )
        try:
            shape = np.broadcast_shapes(times.shape, states.shape[:-1])
        except ValueError:
            raise ModelError(f"times {times.shape} and states {states.shape} do not fit together") from None
        flat_t = np.broadcast_to(times, shape).ravel()
        return flat_t, np.broadcast_to(states, (*shape, dim)).ravel(), shape

    def replace(self, **changes: Any) -> Self:
        """Return the model with other constructor arguments or parameters.

        Parameters
        ----------
        **changes
            Arguments of the constructor, or parameters of effects as in ``**{"relaxation.b": 5.0}``.

        Returns
        -------
        Model
            Of the same class.

        Raises
        ------
        ModelError
            An unknown name or an unusable value.

        Examples
        --------
        >>> import udd
        >>> udd.Disk(0.039).replace(edge="ignore").edge
        'ignore'
        """
        dotted = {name: changes.pop(name) for name in list(changes) if "." in name}
        arguments = {name: getattr(self, name) for name in (*self._plain, *self._options)}
        for name in changes:
            if name not in arguments:
                raise ModelError(f"{type(self).__name__} has no {name!r}; it has {', '.join(arguments)}")
        new = type(self)(**(arguments | changes))
        return new.with_parameters(dotted) if dotted else new
