"""Effects of no library: a formula of the user's, or a curve."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd import _core
from udd._util.arguments import checked_arguments
from udd._util.expressions import Expression, text_of
from udd._util.validation import array, number
from udd.errors import ModelError

from .spec import Effect, Own, Parameter, Spec, _specs

__all__ = ["curve", "formula", "surface"]

#: Where each slot enters: the left side of an equation, the slot's unit, and what it would mean.
_SLOTS = {
    "torque": ("torque = ", "m^2/s^2", "a torque that the model lacks"),
    "friction": ("k = k_plain + ", "m^2/s", "the friction changes"),
    "lateral": ("u = ", "m/s", "the contact moves sideways"),
    "vertical": ("W_c = W + ", "m/s", "the contact moves up or down beside the drive"),
}
_MOMENTA = {"lateral": ("consistent", "constraint"), "vertical": ("consistent", "constraint")}


@dataclass(frozen=True)
class FormulaSpec(Spec):
    """What is said of an effect that a user wrote: see :func:`formula`.

    Attributes
    ----------
    text : str
        The formula.
    """

    text: str

    @property
    def own(self) -> Own:
        """What the core needs to know."""
        names = [p.name for p in self.parameters]
        return self.slots[0], self.text, names, [p.name for p in self.parameters if p.role == "amplitude"]

    def call(self, effect: Effect) -> tuple[str, list[str]]:
        """The function that makes the effect, and its arguments as text."""
        items = [repr(self.slots[0]), repr(self.text)]
        if self.name != "formula":
            items.append(f"name={self.name!r}")
        if self.title != self.name:
            items.append(f"title={self.title!r}")
        if any(p.role != "amplitude" for p in self.parameters):
            items.append(f"amplitudes={effect.amplitudes!r}")
        ranges = {p.name: p.range for p in self.parameters if p.range != UNLIMITED}
        if ranges:
            shown = ", ".join(f"{name!r}: ({low}, {high})" for name, (low, high) in ranges.items())
            items.append(f"ranges={{{shown}}}".replace("inf", 'float("inf")'))
        return "formula", items + [f"{name}={value!r}" for name, value in effect.parameters.items()]


@dataclass(frozen=True)
class CurveSpec(FormulaSpec):
    """What is said of a curve: see :func:`curve`.

    Attributes
    ----------
    coordinate : str
        What the curve is a function of.
    low, high : float
        Where it begins and ends.
    periodic : bool
        Whether it begins anew where it ends.
    """

    coordinate: str
    low: float
    high: float
    periodic: bool

    @property
    def cells(self) -> int:
        """How many stretches there are between its knots."""
        return len(self.parameters) - (0 if self.periodic else 3)

    @property
    def step(self) -> float:
        """The distance of its knots."""
        return (self.high - self.low) / self.cells

    def basis(self, x: ArrayLike) -> NDArray[np.float64]:
        """The curve's values for each coefficient alone.

        Parameters
        ----------
        x : array_like (...)
            Values of the coordinate.

        Returns
        -------
        ndarray (..., coefficients)
        """
        u = (array("x", x) - self.low) / self.step
        u = np.mod(u, self.cells) if self.periodic else np.clip(u, 0.0, self.cells)
        away = np.abs(u[..., None] + 1.0 - np.arange(self.cells + 3))
        outer, inner = (np.clip(width - away, 0.0, None) for width in (2.0, 1.0))
        result: NDArray[np.float64] = (outer**3 - 4.0 * inner**3) / 6.0
        if self.periodic:
            result, beyond = result[..., :-3].copy(), result[..., -3:]
            result[..., :3] += beyond
        return result

    def expression(self, values: Mapping[str, float], equation: str) -> str:
        """The curve by its values at the knots."""
        knots = self.low + self.step * np.arange(self.cells if self.periodic else self.cells + 1)
        at = self.basis(knots) @ np.array(list(values.values()))
        shown = ", ".join(f"s({x:.4g}) = {value:.4g}" for x, value in zip(knots, at, strict=True))
        return f"{equation}, {shown}"

    def call(self, effect: Effect) -> tuple[str, list[str]]:
        """The function that makes the effect, and its arguments as text."""
        where = [repr(self.slots[0]), repr(self.coordinate), repr(self.low), repr(self.high)]
        items = [*where, repr(list(effect.values))]
        if self.periodic:
            items.append("periodic=True")
        if self.name != "curve":
            items.append(f"name={self.name!r}")
        return "curve", items


@dataclass(frozen=True)
class SurfaceSpec(FormulaSpec):
    """What is said of a surface: see :func:`surface`.

    Attributes
    ----------
    coordinates : tuple of str
        What the surface is a function of.
    low, high : tuple of float
        Where it begins and ends.
    shape : tuple of int
        How many coefficients there are along each coordinate.
    periodic : bool
        Whether it begins anew where it ends along the second coordinate.
    """

    coordinates: tuple[str, str]
    low: tuple[float, float]
    high: tuple[float, float]
    shape: tuple[int, int]
    periodic: bool

    def expression(self, values: Mapping[str, float], equation: str) -> str:
        """The surface in words: its numbers are too many to read."""
        return equation

    def call(self, effect: Effect) -> tuple[str, list[str]]:
        """The function that makes the effect, and its arguments as text."""
        grid = np.reshape(effect.values, self.shape).tolist()
        items = [repr(v) for v in (self.slots[0], self.coordinates, self.low, self.high, grid)]
        if self.periodic:
            items.append("periodic=True")
        if self.name != "surface":
            items.append(f"name={self.name!r}")
        return "surface", items


UNLIMITED = (-np.inf, np.inf)


@checked_arguments
def formula(
    slot: str,
    expression: Expression,
    *,
    momentum: str | None = None,
    name: str = "formula",
    title: str | None = None,
    amplitudes: Iterable[str] | None = None,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    **parameters: float,
) -> Effect:
    """An effect given as a formula.

    Parameters
    ----------
    slot : {"torque", "friction", "lateral", "vertical"}, the rate of a state, or a force
        What the formula adds to: the torque [m^2/s^2], the friction coefficient k [m^2/s], the contact's
        lateral velocity u or its vertical velocity W_c [m/s]. Of a user's own model, the rate of a state:
        ``"v'"``; its formula may use the model's states and parameters. Where that model has a mass matrix,
        also a force along a coordinate, ``"force(x)"``, or between two, ``"force(b - a)"``: on b, and its
        reaction on a. Where it has measured inputs, the delay of one, ``"delay(u)"``: the formula is then
        one parameter.
    expression : str or SymPy expression
        Of the time ``t``, the state ``Omega, Y, Z, beta`` (of a pendulum also ``theta``), the plain model's
        friction ``k``, moment of ``inertia`` and ``g``, a disk's ``W`` and ``R`` (a pendulum's ``length``),
        numbers, ``pi``, and the effect's own parameters; with ``+ - * / ^``, ``sqrt``, ``exp``, ``ln``,
        ``sin``, ``cos``, ``tan``, ``sinh``, ``cosh``, ``tanh``, ``atan``, ``atan2(y, x)``, ``abs``,
        ``sign``, ``min(a, b)``, ``max(a, b)``, ``where(x > c, a, b)``, ``bspline`` (the cardinal cubic
        B-spline) and the splines of :func:`curve`. Runs of disk and pendulum land where ``abs(Omega)``
        changes, those of a model of your own on all kinks (see :class:`udd.Model`); other kinks of an effect
        on disk or pendulum are only compared: runs go over them by small steps, without a power series.
    momentum : {"consistent", "constraint"}, optional
        How a lateral or vertical effect enters the angular momentum; see :class:`Spec`.
    name : str
        What its parameters are called after: ``name.parameter``.
    title : str, optional
        What a reader calls it; by default its name.
    amplitudes : iterable of str, optional
        The parameters to which the formula is proportional, taken together; by default all.
    ranges : mapping of str to (low, high), optional
        The physically sensible ranges of parameters.
    **parameters : float
        The effect's own parameters.

    Returns
    -------
    Effect

    Raises
    ------
    ModelError
        A name that the formula may not use, a formula that is not proportional to its amplitudes, or a
        parameter that it does not use.

    Notes
    -----
    The text is parsed to a list of operations, which the core evaluates as it does the library's effects;
    nothing in it is executed. ``abs(Omega)`` may have its kink: the integrator lands there. At other kinks it
    does not, and jumps are none of a formula's.

    Examples
    --------
    >>> import udd
    >>> warp = udd.effects.formula("torque", "a*sin(2*beta) + b*cos(2*beta)", name="warp", a=0.01, b=0.0)
    >>> warp.expression
    'torque = 0.01*sin(2*beta) + 0*cos(2*beta)'
    >>> udd.Disk(0.039, effects=[warp]).parameters["warp.a"]
    0.01
    """
    given = {key: number(f"{key} of {name}", value) for key, value in parameters.items()}
    spec = written(slot, expression, name, title, amplitudes, ranges, tuple(given))
    return spec.make(momentum=momentum, treatment=None, **given)


def written(
    slot: str,
    expression: Expression,
    name: str,
    title: str | None,
    amplitudes: Iterable[str] | None,
    ranges: Mapping[str, tuple[float, float]] | None,
    names: tuple[str, ...],
) -> FormulaSpec:
    """What is said of a formula."""
    _word(name)
    linear = names if amplitudes is None else _names(amplitudes)
    limits = dict(ranges or {})
    for other in (*linear, *limits):
        if other not in names:
            raise ModelError(f"{name} has no parameter {other!r}; it has {', '.join(names) or 'none'}")
    listed = tuple(_parameter(name, own, "", own in linear, limits.get(own, UNLIMITED)) for own in names)
    text = text_of("the formula", expression)
    return FormulaSpec(*_described(slot, name, title or name, text, text, listed), listed, text)


@checked_arguments
def curve(
    slot: str,
    coordinate: Expression,
    low: float,
    high: float,
    coefficients: ArrayLike,
    *,
    periodic: bool = False,
    momentum: str | None = None,
    name: str = "curve",
) -> Effect:
    """An effect given as a curve: a cubic spline over one coordinate.

    Parameters
    ----------
    slot : {"torque", "friction", "lateral", "vertical"}
        What the curve adds to; see :func:`formula`.
    coordinate : str or SymPy expression
        What it is a function of: ``"Omega"``, ``"Y"``, ``"Z"``, ``"beta"``, ``"t"`` or any formula, such as
        ``"sqrt(Y^2 + Z^2)"``.
    low, high : float
        Where it begins and ends. Beyond, it keeps its last value.
    coefficients : array_like, shape (n,)
        At least four; they are the parameters ``c0``, ``c1``, ..., all amplitudes.
    periodic : bool
        Whether it begins anew where it ends, as over an angle from 0 to 2 pi.
    momentum : {"consistent", "constraint"}, optional
        How a lateral or vertical effect enters the angular momentum; see :class:`Spec`.
    name : str
        What its parameters are called after.

    Returns
    -------
    Effect

    Raises
    ------
    ModelError
        A coordinate that there is not, fewer than four coefficients, or a range that is none.

    Notes
    -----
    The curve is ``sum of c[i] B((x - low)/h + 1 - i)`` with the cardinal cubic B-spline ``B`` and
    ``h = (high - low)/(n - 3)``: every cubic spline with these knots from `low` to `high`. A periodic one has
    ``h = (high - low)/n`` and begins anew with ``c[0]`` after ``c[n - 1]``. Second derivatives are
    continuous, but where the curve ends. In formulas it is ``spline(x, low, high, c0, c1, ...)`` and
    ``periodic(...)``.

    Examples
    --------
    >>> import udd
    >>> drag = udd.effects.curve("torque", "Omega", -8.0, 8.0, [0.02, 0.01, 0.0, -0.01, -0.02])
    >>> drag.expression
    'torque = s(Omega), a cubic spline from -8 to 8, s(-8) = 0.01, s(0) = 0, s(8) = -0.01'
    >>> list(udd.Disk(0.039, effects=drag).parameters)[6:]
    ['curve.c0', 'curve.c1', 'curve.c2', 'curve.c3', 'curve.c4']
    """
    values = array("coefficients", coefficients)
    if values.ndim != 1 or len(values) < 4:
        raise ModelError("a curve needs a list of at least four coefficients")
    first, last = number("low", low), number("high", high, above=float(low))
    listed = _coefficients(slot, name, len(values))
    x, names = text_of("the coordinate", coordinate), [p.name for p in listed]
    text = f"{'periodic' if periodic else 'spline'}({x}, {first!r}, {last!r}, {', '.join(names)})"
    shown = f"s({x}), a {'periodic ' if periodic else ''}cubic spline from {first:g} to {last:g}"
    common = _described(slot, name, f"{slot} over {x}", shown, text, listed)
    spec = CurveSpec(*common, listed, text, x, first, last, bool(periodic))
    return spec.make(momentum=momentum, treatment=None, **dict(zip(names, values.tolist(), strict=True)))


@checked_arguments
def surface(
    slot: str,
    coordinates: tuple[Expression, Expression],
    low: tuple[float, float],
    high: tuple[float, float],
    coefficients: ArrayLike,
    *,
    periodic: bool = False,
    momentum: str | None = None,
    name: str = "surface",
) -> Effect:
    """An effect given as a surface: a cubic spline over two coordinates.

    Parameters
    ----------
    slot : {"torque", "friction", "lateral", "vertical"}
        What the surface adds to; see :func:`formula`.
    coordinates : pair of str or SymPy expression
        What it is a function of, as for :func:`curve`.
    low, high : pair of float
        Where it begins and ends along each. Beyond, it fades within three knots along the first coordinate,
        and keeps its last value along the second.
    coefficients : array_like, shape (m, n)
        At least four along each; they are the parameters ``c0``, ``c1``, ... row by row, all amplitudes.
    periodic : bool
        Whether it begins anew where it ends along the second coordinate, as over an angle.
    momentum : {"consistent", "constraint"}, optional
        How a lateral or vertical effect enters the angular momentum; see :class:`Spec`.
    name : str
        What its parameters are called after.

    Returns
    -------
    Effect

    Raises
    ------
    ModelError
        A coordinate that there is not, too few coefficients, or a range that is none.

    Notes
    -----
    The sum of ``c[i, j] B((x - low[0])/h + 1 - i) S_j(y)`` with the cardinal cubic B-spline ``B``,
    ``h = (high[0] - low[0])/(m - 3)``, and the basis ``S_j`` of :func:`curve`.

    Examples
    --------
    A drag that grows towards the edge.

    >>> import udd
    >>> grid = [[0.02 * i, 0.0, 0.0, -0.02 * i] for i in range(4)]
    >>> drag = udd.effects.surface("torque", ("abs(Y)", "Omega"), (0.0, -8.0), (0.05, 8.0), grid)
    >>> drag.expression
    'torque = s(abs(Y), Omega), a cubic spline surface over 0 to 0.05 and -8 to 8'
    """
    values = array("coefficients", coefficients)
    if values.ndim != 2 or min(values.shape) < 4:
        raise ModelError("a surface needs a table of coefficients, at least four along each coordinate")
    if any(isinstance(pair, str) or len(pair) != 2 for pair in (coordinates, low, high)):
        raise ModelError("a surface needs two coordinates, and where each begins and ends")
    first = tuple(number("low", v) for v in low)
    last = tuple(number("high", v, above=a) for v, a in zip(high, first, strict=True))
    listed = _coefficients(slot, name, values.size)
    x, y = (text_of("the coordinate", c) for c in coordinates)
    (m, n), names = values.shape, [p.name for p in listed]
    per = (m - 3) / (last[0] - first[0])
    kind = "periodic" if periodic else "spline"
    rows = (
        f"bspline((({x}) - {first[0]!r})*{per!r} + {1 - i}) * "
        f"{kind}({y}, {first[1]!r}, {last[1]!r}, {', '.join(names[i * n : (i + 1) * n])})"
        for i in range(m)
    )
    text = " + ".join(rows)
    spans = " and ".join(f"{a:.3g} to {b:.3g}" for a, b in zip(first, last, strict=True))
    shown = f"s({x}, {y}), a cubic spline surface over {spans}"
    common = _described(slot, name, f"{slot} over {x} and {y}", shown, text, listed)
    spec = SurfaceSpec(
        *common, listed, text, (x, y), (first[0], first[1]), (last[0], last[1]), (m, n), bool(periodic)
    )
    given = dict(zip(names, values.ravel().tolist(), strict=True))
    return spec.make(momentum=momentum, treatment=None, **given)


_MOST_COEFFICIENTS = 2000  # their formula has 10,000 characters


def _coefficients(slot: str, name: str, count: int) -> tuple[Parameter, ...]:
    """The parameters of a spline: its coefficients, all amplitudes, in the slot's unit."""
    _slot(slot)
    if count > _MOST_COEFFICIENTS:
        raise ModelError(f"a spline has at most {_MOST_COEFFICIENTS} coefficients, not {count}")
    unit = _SLOTS[slot][1] if slot in _SLOTS else ""
    return tuple(_parameter(name, f"c{i}", unit, True, UNLIMITED) for i in range(count))


def is_spline(effect: Effect) -> bool:
    """Whether an effect is a curve or a surface, whose many numbers say nothing to a reader."""
    return isinstance(effect.spec, CurveSpec | SurfaceSpec)


def _described(
    slot: str, name: str, title: str, shown: str, text: str, parameters: tuple[Parameter, ...]
) -> tuple[str, str, str, str, tuple[str, ...], tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """The checked attributes of a spec before its parameters."""
    _slot(slot)
    _word(name)
    if name in _specs():
        raise ModelError(f"the library has an effect called {name!r} already: give the formula another name")
    known = _SLOTS.get(slot)
    left, _unit, meaning = known or (f"{slot} = ... + ", "", f"the rate {slot} has one more term")
    if along_of(slot):
        left, meaning = f"{slot} = ", "a force that enters every acceleration through the mass matrix"
    if delayed_by(slot):
        left, meaning = f"{slot} = ", "the input is felt later than it was measured"
    names = [p.name for p in parameters]
    linear = [p.name for p in parameters if p.role == "amplitude"]
    # Of a user's own model only the model knows the states.
    bodies = tuple(_core.formula_bodies(name, (slot, text, names, linear))) if slot in _SLOTS else ("own",)
    return name, title, left + shown, meaning, bodies, (slot,), _MOMENTA.get(slot, ()), ()


def _slot(slot: str) -> None:
    rate = isinstance(slot, str) and slot.endswith("'") and slot[:-1].isidentifier()
    if slot not in _SLOTS and not rate and not along_of(slot) and not delayed_by(slot):
        raise ModelError(
            f"the slot must be one of {', '.join(_SLOTS)}, or for a model of your own the rate of a state as "
            f'in "v\'", a force as in "force(x)" or a delay as in "delay(u)", not {slot!r}'
        )


def along_of(slot: object) -> str | None:
    """What a slot that is a force acts along: a coordinate, or the difference of two; None for any other."""
    match = re.fullmatch(r"force\((\w+(?: - \w+)?)\)", slot) if isinstance(slot, str) else None
    return match[1] if match else None


def delayed_by(slot: object) -> str | None:
    """The input that a slot lets be felt later; None for any other."""
    match = re.fullmatch(r"delay\((\w+)\)", slot) if isinstance(slot, str) else None
    return match[1] if match else None


def _word(name: str) -> None:
    if not (isinstance(name, str) and name.isidentifier()):
        raise ModelError(f"an effect's name must be a single word, not {name!r}")


def _names(names: Iterable[str]) -> tuple[str, ...]:
    if isinstance(names, str):
        raise ModelError("amplitudes must be a list of names, not a name")
    return tuple(names)


def _parameter(effect: str, name: str, unit: str, linear: bool, limits: tuple[float, float]) -> Parameter:
    try:
        low, high = (float(limit) for limit in limits)
    except (TypeError, ValueError, OverflowError):
        raise ModelError(f"the range of {name} must be two numbers, not {limits!r}") from None
    if not low <= high:
        raise ModelError(f"the range of {name} of {effect} must go upwards, not from {low} to {high}")
    # What is taken where no value is given must not depend on the values.
    default = min(max(0.0, low), high)
    return Parameter(name, unit, default, (low, high), "amplitude" if linear else "shape", ())
