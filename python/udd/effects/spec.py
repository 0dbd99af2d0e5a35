"""Effects, their parameter values, and their specifications."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

from udd import _core
from udd._util.keywords import renamed_attribute
from udd._util.validation import number
from udd.errors import ModelError

__all__ = ["Effect", "Parameter", "Spec", "library"]

#: Data for the core about a user-defined effect: slot, formula, parameters, amplitudes.
CoreFormula: TypeAlias = tuple[str, str, list[str], list[str]]

#: Symbols for the smoothed sign of the speed, by treatment.
_SIGNS = {"set-valued": "Sgn(Omega)", "karnopp": "Karnopp(Omega, eps)", "lugre": "LuGre(Omega, eps)"}


@dataclass(frozen=True)
class Parameter:
    """Parameter of an effect.

    Attributes
    ----------
    name, unit : str
        Name, and SI unit. The unit is empty if the parameter is dimensionless.
    default : float
        Value if none is given.
    range : tuple of float
        The physically sensible range.
    role : str
        ``"amplitude"`` (the effect is proportional to it and absent if all amplitudes are zero), ``"shape"``,
        ``"frequency"``, ``"scanned"`` (a shape whose value a search chooses by scores alone), or ``"width"``
        (of a smoothed jump; a search keeps the best one but does not distinguish widths).
    grid : tuple of float
        Values of a shape that a scan of candidates tries.
    along : str
        Kind of a scanned number: ``"angle"``, ``"side"`` (an angle's size), ``"speed"``, ``"power"`` or
        ``"duration"``.

    See Also
    --------
    udd.effects.library : effects with their parameters.
    """

    name: str
    unit: str
    default: float
    range: tuple[float, float]
    role: str
    grid: tuple[float, ...]
    along: str = ""

    @property
    def sought(self) -> bool:
        """True if a fit that adds the effect estimates it; False for a shape with a few whole values."""
        if self.role == "width":
            return False
        if self.role == "shape":
            return len(self.grid) > 1 and any(value % 1 for value in self.grid)
        return True

    def check(self, effect: str, value: object, *, strict: bool) -> float:
        """Return the value as a float if it is within the range.

        Parameters
        ----------
        effect : str
            Name of the effect, for the message.
        value : object
            The value.
        strict : bool
            If False, amplitudes may exceed the range.

        Returns
        -------
        float
            The value.

        Raises
        ------
        ModelError
            The value is no number or outside the range.
        """
        result = number(f"{self.name} of {effect}", value)
        low, high = self.range
        if (strict or self.role != "amplitude") and not low <= result <= high:
            unit = f" {self.unit}" if self.unit else ""
            raise ModelError(
                f"{self.name} of {effect} must be between {low:g} and {high:g}{unit}, not {result:g}"
            )
        return result


@dataclass(frozen=True)
class Spec:
    """Specification of an effect: names, meaning, and the equations that it enters.

    Attributes
    ----------
    name : str
        Name of its constructor in this module.
    title, equation, meaning : str
        Name for a reader, formula, and physical meaning. They are plain text.
    bodies : tuple of str
        Bodies that it can act on: ``"disk"``, ``"pendulum"``.
    slots : tuple of str
        Places in the equations: ``"torque"``, ``"friction"``, ``"lateral"``, ``"vertical"``.
    momenta : tuple of str
        Ways to enter the angular momentum, the default first: ``"consistent"`` (the contact's velocity and
        its rate of change exert a torque) or ``"constraint"`` (only the rolling constraint changes, as in the
        paper). Empty for torque and friction.
    treatments : tuple of str
        Treatments of dry friction's jump at rest, the default first. ``"smoothed"`` uses the width `eps`:
        nothing sticks, but it can be fitted. ``"set-valued"`` sticks until the torque exceeds the friction.
        ``"karnopp"`` [18] does the same, and speeds below `eps` count as rest. ``"lugre"`` [19] has bristles
        that bend by about `eps`, in rad, before they slide. Their deflection is an additional state, for
        :func:`udd.simulate` only. Empty for effects other than dry friction.
    parameters : tuple of Parameter
        In the order of the formula.

    See Also
    --------
    udd.effects.library : all specifications.
    udd.effects.formula : an effect from a formula.
    """

    name: str
    title: str
    equation: str
    meaning: str
    bodies: tuple[str, ...]
    slots: tuple[str, ...]
    momenta: tuple[str, ...]
    treatments: tuple[str, ...]
    parameters: tuple[Parameter, ...]

    @property
    def shaped(self) -> bool:
        """True if a fit that adds the effect also estimates a shape."""
        return any(p.sought and p.role in ("shape", "scanned") for p in self.parameters)

    def make(self, *, momentum: str | None = None, treatment: str | None = None, **values: float) -> Effect:
        """Make the effect with these parameter values.

        Parameters
        ----------
        momentum : str, optional
            One of `momenta`; by default the first.
        treatment : str, optional
            One of `treatments`; by default the first.
        **values : float
            Parameter values by name; the others take their defaults.

        Returns
        -------
        Effect
            Checked.

        Raises
        ------
        ModelError
            A parameter is unknown, a value is outside its range, or the effect has no such momentum or
            treatment.
        """
        parameters = {p.name: p for p in self.parameters}
        for name in values:
            if name not in parameters:
                raise ModelError(f"{self.name} has no parameter {name!r}; it has {', '.join(parameters)}")
        given = tuple(p.check(self.name, values.get(p.name, p.default), strict=True) for p in self.parameters)
        return Effect(self.name, given, momentum, treatment, self if self.core_formula else None)

    @property
    def core_formula(self) -> CoreFormula | None:
        """Data for the core about a user-defined effect; None for an effect of the library."""
        return None

    own = renamed_attribute("own", "core_formula")

    def expression(self, values: Mapping[str, float], equation: str) -> str:
        """Return the equation with these numbers inserted.

        Parameters
        ----------
        values : mapping of str to float
            Parameter values.
        equation : str
            The formula.

        Returns
        -------
        str
            The formula with numbers.
        """

        def put(match: re.Match[str]) -> str:
            value = values[match[0]]
            return f"({value:.4g})" if value < 0 else f"{value:.4g}"

        left, equals, right = equation.partition(" = ")
        names = "|".join(map(re.escape, values))
        return left + equals + (re.sub(rf"(?<!\w)(?:{names})(?!\w)", put, right) if names else right)

    def call(self, effect: Effect) -> tuple[str, list[str]]:
        """Return the name of the function that makes the effect, and its arguments as text.

        Parameters
        ----------
        effect : Effect
            An effect of this specification.

        Returns
        -------
        name : str
            Name of the constructor.
        arguments : list of str
            Every parameter with its value, as ``name=value``.
        """
        return self.name, [f"{name}={value!r}" for name, value in effect.parameters.items()]


@functools.cache
def _specs() -> Mapping[str, Spec]:
    """Return the core's library by name."""
    specs = {}
    for entry in _core.effect_library():
        parameters = tuple(
            Parameter(p["name"], p["unit"], p["default"], p["range"], p["role"], tuple(p["scan"]), p["along"])
            for p in entry["parameters"]
        )
        name = entry["name"]
        texts = entry["title"], entry["equation"], entry["meaning"]
        bodies, slots = tuple(entry["bodies"]), tuple(entry["slots"])
        choices = tuple(entry["momenta"]), tuple(entry["treatments"])
        specs[name] = Spec(name, *texts, bodies, slots, *choices, parameters)
    return MappingProxyType(specs)


def library() -> tuple[Spec, ...]:
    """List all effects of the library.

    Returns
    -------
    tuple of Spec
        Fields ``name``, ``title``, ``equation``, ``meaning``, ``slots`` and ``parameters``.

    See Also
    --------
    udd.effects.formula : an effect from a formula.
    udd.discover : which effects a model lacks.

    Examples
    --------
    >>> from udd import effects
    >>> for spec in effects.library()[:2]:
    ...     print(f"{spec.title}: {spec.equation}")
    quadratic drag: torque = -c |Omega| Omega
    cubic drag: torque = -c Omega^3
    """
    return tuple(_specs().values())


@dataclass(frozen=True, repr=False)
class Effect:
    """Physical effect with its parameter values; made by the constructors of this module.

    Parameters
    ----------
    name : str
        Name in the library.
    values : tuple of float
        Parameter values in the library's order. Amplitudes may be outside their physical range, as during a
        fit; shapes and frequencies may not.
    momentum : str, optional
        ``"consistent"`` or ``"constraint"``, if the effect has the choice. The default is its first.
    treatment : str, optional
        ``"smoothed"``, ``"set-valued"``, ``"karnopp"`` or ``"lugre"`` for dry friction; default: the first.
        See :class:`Spec`.
    made : Spec, optional
        Specification of an effect that is not of the library.

    Raises
    ------
    ModelError
            The name is unknown, a number is not finite or out of range, or a momentum or treatment does not
            apply.

    See Also
    --------
    library : list the effects.
    formula, curve, surface : make an effect outside the library.

    Examples
    --------
    A pendulum with dry friction stops within the dead band, where friction keeps it at rest:

    >>> import udd
    >>> dry = udd.effects.coulomb(c=0.05, treatment="set-valued")
    >>> run = udd.simulate(udd.Pendulum(0.5, effects=dry), 20.0, [0.0, 0.1])
    >>> run.events.kind
    ('reversal', 'reversal', 'reversal', 'reversal', 'stick')
    >>> float(run.Omega[-1]), bool(9.81 * 0.5 * abs(run.theta[-1]) < 0.05)
    (0.0, True)
    """

    name: str
    values: tuple[float, ...]
    momentum: str | None = None
    treatment: str | None = None
    made: Spec | None = None

    def __post_init__(self) -> None:
        for what in ("momentum", "treatment"):
            if not isinstance(getattr(self, what), str | None):
                raise ModelError(f"{what} of {self.name} must be a text, not {getattr(self, what)!r:.80}")
        if self.made is None and self.name not in _specs():
            raise ModelError(f"no effect is called {self.name!r}; choose one of {', '.join(_specs())}")
        spec = self.spec
        if len(self.values) != len(spec.parameters):
            raise ModelError(f"{self.name} takes {len(spec.parameters)} numbers, not {len(self.values)}")
        checked = (
            p.check(self.name, v, strict=False) for p, v in zip(spec.parameters, self.values, strict=True)
        )
        object.__setattr__(self, "values", tuple(checked))
        if self.momentum is None and spec.momenta:
            object.__setattr__(self, "momentum", spec.momenta[0])
        if self.momentum is not None and self.momentum not in spec.momenta:
            allowed = " or ".join(map(repr, spec.momenta)) or "left out: it enters no velocity"
            raise ModelError(f"momentum of {self.name} must be {allowed}, not {self.momentum!r}")
        if self.treatment is None and spec.treatments:
            object.__setattr__(self, "treatment", spec.treatments[0])
        if self.treatment is not None and self.treatment not in spec.treatments:
            allowed = " or ".join(map(repr, spec.treatments)) or "left out: it is not dry friction"
            raise ModelError(f"treatment of {self.name} must be {allowed}, not {self.treatment!r}")

    @property
    def spec(self) -> Spec:
        """Specification of the effect."""
        return self.made or _specs()[self.name]

    @property
    def title(self) -> str:
        """Name of the effect for a reader."""
        return self.spec.title

    @property
    def equation(self) -> str:
        """Formula of the effect."""
        sign = _SIGNS.get(self.treatment or "", "tanh(Omega/eps)")
        return self.spec.equation.replace("tanh(Omega/eps)", sign)

    @property
    def meaning(self) -> str:
        """Physical meaning of the effect."""
        return self.spec.meaning

    @property
    def slots(self) -> tuple[str, ...]:
        """Places in the equations that the effect enters."""
        return self.spec.slots

    @property
    def parameters(self) -> dict[str, float]:
        """Parameter values by name."""
        return dict(zip((p.name for p in self.spec.parameters), self.values, strict=True))

    @property
    def amplitudes(self) -> tuple[str, ...]:
        """Names of the parameters to which the effect is proportional."""
        return tuple(p.name for p in self.spec.parameters if p.role == "amplitude")

    @property
    def expression(self) -> str:
        """Formula with the numbers inserted.

        Examples
        --------
        >>> from udd import effects
        >>> effects.quadratic_drag(c=1.5e-4).expression
        'torque = -0.00015 |Omega| Omega'
        """
        return self.spec.expression(self.parameters, self.equation)

    def replace(self, **values: float) -> Effect:
        """Return the effect with other values of some parameters.

        Parameters
        ----------
        **values : float
            New values by name.

        Returns
        -------
        Effect
            The same effect with these values.

        Raises
        ------
        ModelError
            A parameter is unknown or a value is not usable.
        """
        new = self.parameters
        for name, value in values.items():
            if name not in new:
                raise ModelError(f"{self.name} has no parameter {name!r}; it has {', '.join(new)}")
            new[name] = value
        return Effect(self.name, tuple(new.values()), self.momentum, self.treatment, self.made)

    def __repr__(self) -> str:
        function, items = self.spec.call(self)
        if self.momentum is not None:
            items.append(f"momentum={self.momentum!r}")
        if self.treatment not in (None, "smoothed"):
            items.append(f"treatment={self.treatment!r}")
        return f"{function}({', '.join(items)})"
