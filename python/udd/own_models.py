"""Models of the user's own, from text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NoReturn, Self

from udd import _core
from udd._expressions import Expression, text_of
from udd._validate import number
from udd.effects import Effect
from udd.errors import ModelError
from udd.models import Model

__all__ = ["OwnModel"]

_MOST_STATES = 6


@dataclass(frozen=True, init=False, repr=False)
class OwnModel(Model):
    """A user's own model, as :class:`udd.Model` makes it.

    Attributes
    ----------
    state_names : tuple of str
        The names of the state's components, in order.
    texts : tuple of str
        Their rates.
    values : tuple of (str, float)
        The parameters.
    angles : tuple of str
        The states that are angles.
    """

    kind: ClassVar[str] = "own"
    slow: ClassVar[float] = 1.0
    _plain: ClassVar[tuple[str, ...]] = ()
    _options: ClassVar[tuple[str, ...]] = ("states", "equations", "parameters", "angles")

    state_names: tuple[str, ...]  # type: ignore[misc]
    texts: tuple[str, ...]
    values: tuple[tuple[str, float], ...]
    angles: tuple[str, ...]  # type: ignore[misc]

    def __new__(cls, *_arguments: Any, **_options: Any) -> OwnModel:
        """Leave everything to the initialisation, which a copy or a pickle does not need."""
        return object.__new__(cls)

    def __init__(
        self,
        states: Sequence[str],
        equations: Mapping[str, Expression] | Sequence[Expression],
        parameters: Mapping[str, float] | None = None,
        *,
        angles: Iterable[str] = (),
    ) -> None:
        names = _names("states", states)
        if not 1 <= len(names) <= _MOST_STATES:
            raise ModelError(f"a model has 1 to {_MOST_STATES} states, not {len(names)}")
        if not isinstance(parameters, Mapping | None):
            raise ModelError(f"parameters must be a table of names and values, not {parameters!r}")
        given = {} if parameters is None else {str(name): value for name, value in parameters.items()}
        values = tuple((name, number(f"the parameter {name}", value)) for name, value in given.items())
        for name in given:
            if not name.isidentifier():
                raise ModelError(f"a parameter's name must be a single word, not {name!r}")
        turning = _names("angles", angles)
        for name in turning:
            if name not in names:
                raise ModelError(f"the angle {name!r} is no state; there are {', '.join(names)}")
        self._set(names, _equations(names, equations), values, turning)
        _core.model_parameters(self)  # which parses the equations

    def _set(
        self,
        names: tuple[str, ...],
        texts: tuple[str, ...],
        values: tuple[tuple[str, float], ...],
        angles: tuple[str, ...],
    ) -> None:
        object.__setattr__(self, "state_names", names)
        object.__setattr__(self, "texts", texts)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "angles", angles)

    @property
    def state_units(self) -> tuple[str, ...]:  # type: ignore[override]
        """The states' units, which are the user's."""
        return ("",) * len(self.state_names)

    @property
    def effects(self) -> tuple[Effect, ...]:  # type: ignore[override]
        """None: its equations say everything."""
        return ()

    @property
    def equations(self) -> dict[str, str]:
        """Each state's rate, as text."""
        return dict(zip(self.state_names, self.texts, strict=True))

    @property
    def parameters(self) -> dict[str, float]:
        """Name and value of every parameter, in order."""
        return dict(self.values)

    @property
    def _own(self) -> tuple[list[str], list[str], list[str], list[str]]:
        """What the core needs to know beside the values."""
        return list(self.state_names), list(self.texts), list(self.parameters), list(self.angles)

    def with_parameters(self, values: Mapping[str, float]) -> Self:
        """The model with other values of some parameters.

        Raises
        ------
        ModelError
            An unknown name or a value that is not finite.
        """
        known = self.parameters
        for name in values:
            if name not in known:
                raise ModelError(f"the model has no parameter {name!r}; it has {', '.join(known) or 'none'}")
        new = {n: number(f"the parameter {n}", values[n]) if n in values else v for n, v in known.items()}
        changed = object.__new__(type(self))
        changed._set(self.state_names, self.texts, tuple(new.items()), self.angles)
        return changed

    def with_term(self, equation: str, term: Expression, **amplitude: float) -> OwnModel:
        """The model with a term added to one of its equations.

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
        OwnModel

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
        return OwnModel(
            self.state_names,
            self.equations | {equation: text},
            self.parameters | amplitude,
            angles=self.angles,
        )

    def with_effects(self, effects: Iterable[Effect]) -> NoReturn:
        """Effects act on a disk or a pendulum; see :meth:`with_term`."""
        raise ModelError(
            "effects act on a udd.Disk or a udd.Pendulum; a model of your own takes a term: with_term"
        )

    def replace(self, **changes: Any) -> OwnModel:
        """The model with other arguments of its constructor or other parameters.

        Raises
        ------
        ModelError
            An unknown name or an unusable value.
        """
        arguments: dict[str, Any] = {
            "states": self.state_names,
            "equations": self.equations,
            "parameters": self.parameters,
            "angles": self.angles,
        }
        own = {name: changes.pop(name) for name in list(changes) if name in self.parameters}
        for name in changes:
            if name not in arguments:
                known = ", ".join((*arguments, *self.parameters))
                raise ModelError(f"the model has no {name!r}; it has {known}")
        new = OwnModel(**(arguments | changes))
        return new.with_parameters(own) if own else new

    def __repr__(self) -> str:
        angles = f", angles={list(self.angles)!r}" if self.angles else ""
        return f"Model({list(self.state_names)!r}, {self.equations!r}, {self.parameters!r}{angles})"


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
    """The rates in the order of the states."""
    if isinstance(equations, Mapping):
        given = {str(name): one for name, one in equations.items()}
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
    return tuple(text_of(f"the equation of {name}", one) for name, one in zip(names, listed, strict=True))
