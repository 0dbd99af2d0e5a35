"""User-defined effects: formulas, curves and surfaces."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd import _core
from udd._util.arguments import checked_arguments
from udd._util.expressions import Expression, text_of
from udd._util.one_line import OneLine
from udd._util.validation import array, number
from udd.errors import ModelError

from .spec import CoreFormula, Effect, Parameter, Spec, _specs

__all__ = ["curve", "formula", "surface"]

#: Left side of the equation, unit and physical meaning of each slot.
_SLOTS = {
    "torque": ("torque = ", "m^2/s^2", "a torque that the model lacks"),
    "friction": ("k = k_plain + ", "m^2/s", "the friction changes"),
    "lateral": ("u = ", "m/s", "the contact moves sideways"),
    "vertical": ("W_c = W + ", "m/s", "the contact moves up or down in addition to the drive"),
}
_MOMENTA = {"lateral": ("consistent", "constraint"), "vertical": ("consistent", "constraint")}


@dataclass(frozen=True, repr=False)
class FormulaSpec(OneLine, Spec):
    """Specification of a user's formula: see :func:`formula`.

    Attributes
    ----------
    text : str
        The formula.
    """

    text: str

    @property
    def core_formula(self) -> CoreFormula:
        """Data for the core: slot, formula, parameters, amplitudes."""
        names = [p.name for p in self.parameters]
        return self.slots[0], self.text, names, [p.name for p in self.parameters if p.role == "amplitude"]

    def call(self, effect: Effect) -> tuple[str, list[str]]:
        """Return the name of the function that makes the effect, and its arguments as text."""
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
    """Specification of a curve: see :func:`curve`.

    Attributes
    ----------
    coordinate : str
        Coordinate of the curve.
    low, high : float
        Its ends.
    periodic : bool
        True if its end is joined to its beginning.
    """

    coordinate: str
    low: float
    high: float
    periodic: bool

    @property
    def cells(self) -> int:
        """Number of intervals between the knots."""
        return len(self.parameters) - (0 if self.periodic else 3)

    @property
    def step(self) -> float:
        """Distance between knots."""
        return (self.high - self.low) / self.cells

    def basis(self, x: ArrayLike) -> NDArray[np.float64]:
        """Compute the curve's basis functions: its values for each coefficient alone.

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
        """Describe the curve by its values at the knots."""
        knots = self.low + self.step * np.arange(self.cells if self.periodic else self.cells + 1)
        at = self.basis(knots) @ np.array(list(values.values()))
        shown = ", ".join(f"s({x:.4g}) = {value:.4g}" for x, value in zip(knots, at, strict=True))
        return f"{equation}, {shown}"

    def call(self, effect: Effect) -> tuple[str, list[str]]:
        """Return the name of the function that makes the effect, and its arguments as text."""
        where = [repr(self.slots[0]), repr(self.coordinate), repr(self.low), repr(self.high)]
        items = [*where, repr(list(effect.values))]
        if self.periodic:
            items.append("periodic=True")
        if self.name != "curve":
            items.append(f"name={self.name!r}")
        return "curve", items


@dataclass(frozen=True)
class SurfaceSpec(FormulaSpec):
    """Specification of a surface: see :func:`surface`.

    Attributes
    ----------
    coordinates : tuple of str
        Coordinates of the surface.
    low, high : tuple of float
        Ends of the surface. There is a pair for each coordinate.
    shape : tuple of int
        Number of coefficients along each coordinate.
    periodic : bool
        True if its end is joined to its beginning along the second coordinate.
    """

    coordinates: tuple[str, str]
    low: tuple[float, float]
    high: tuple[float, float]
    shape: tuple[int, int]
    periodic: bool

    def expression(self, values: Mapping[str, float], equation: str) -> str:
        """Describe the surface in words: its numbers are too many to read."""
        return equation

    def call(self, effect: Effect) -> tuple[str, list[str]]:
        """Return the name of the function that makes the effect, and its arguments as text."""
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
    """Make an effect from a formula.

    Parameters
    ----------
    slot : {"torque", "friction", "lateral", "vertical"}, the rate of a state, or a force
        The equation that the formula is added to. It is the torque [m^2/s^2], the friction coefficient k
        [m^2/s], or the lateral velocity u or vertical velocity W_c of the contact [m/s]. In a user's own
        model it is the rate of a state, ``"v'"``. The formula may then use the model's states and parameters.
        A model with a mass matrix also has forces along a coordinate, ``"force(x)"``, or between two,
        ``"force(b - a)"``: on b, with its reaction on a. A model with measured inputs also has their delays,
        ``"delay(u)"``. The formula of a delay is a single parameter.
    expression : str or SymPy expression
        It may use the time ``t``, the state ``Omega, Y, Z, beta`` (of a pendulum also ``theta``), numbers,
        ``pi``, and the effect's parameters. It may also use the plain model's friction ``k``, moment of
        ``inertia`` and ``g``, and a disk's ``W`` and ``R`` or a pendulum's ``length``. Operators and
        functions: ``+ - * / ^``, ``sqrt``, ``exp``, ``ln``, ``sin``, ``cos``, ``tan``, ``sinh``, ``cosh``,
        ``tanh``, ``atan``, ``atan2(y, x)``, ``abs``, ``sign``, ``min(a, b)``, ``max(a, b)``,
        ``where(x > c, a, b)``, ``bspline`` (the cardinal cubic B-spline) and the splines of :func:`curve`.
        Runs of disk and pendulum locate the kink of ``abs(Omega)``. They cross other kinks by small steps,
        without a power series. Runs of a user's own model locate all kinks (see :class:`udd.Model`).
    momentum : {"consistent", "constraint"}, optional
        Way of a lateral or vertical effect to enter the angular momentum. See :class:`Spec`.
    name : str
        Prefix of its parameters' names: ``name.parameter``.
    title : str, optional
        Name for a reader; default: `name`.
    amplitudes : iterable of str, optional
        The parameters to which the formula is proportional, taken together; default: all.
    ranges : mapping of str to (low, high), optional
        The physically sensible ranges of parameters.
    **parameters : float
        Values of the effect's parameters.

    Returns
    -------
    Effect
        With `expression`, `parameters` and `amplitudes`; pass it to a model as ``effects=``.

    Raises
    ------
    ModelError
            The formula uses an unknown name, is not proportional to its amplitudes, or does not use a
            parameter.

    See Also
    --------
    curve : an effect as a spline over one coordinate.
    surface : an effect as a spline over two coordinates.

    Notes
    -----
    The text is parsed to a list of operations, which the core evaluates as it does the library's effects;
    nothing in it is executed. The integrator locates the kink of ``abs(Omega)``, but no other kinks. A
    formula must not jump.

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
    """Make the specification of a formula."""
    _word(name)
    linear = names if amplitudes is None else _names(amplitudes)
    limits = dict(ranges or {})
    for other in (*linear, *limits):
        if other not in names:
            raise ModelError(f"{name} has no parameter {other!r}; it has {', '.join(names) or 'none'}")
    listed = tuple(
        _parameter(name, parameter, "", parameter in linear, limits.get(parameter, UNLIMITED))
        for parameter in names
    )
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
    """Make an effect from a curve: a cubic spline over one coordinate.

    Parameters
    ----------
    slot : {"torque", "friction", "lateral", "vertical"}
        The equation that the curve is added to; see :func:`formula`.
    coordinate : str or SymPy expression
        Coordinate of the curve: ``"Omega"``, ``"Y"``, ``"Z"``, ``"beta"``, ``"t"`` or any formula, such as
        ``"sqrt(Y^2 + Z^2)"``.
    low, high : float
        Its ends. Beyond them it is constant.
    coefficients : array_like, shape (n,)
        At least four. They become the parameters ``c0``, ``c1``, ... All are amplitudes.
    periodic : bool
        True if its end is joined to its beginning. An angle from 0 to 2 pi needs this.
    momentum : {"consistent", "constraint"}, optional
        Way of a lateral or vertical effect to enter the angular momentum; see :class:`Spec`.
    name : str
        Prefix of its parameters' names.

    Returns
    -------
    Effect
        With one amplitude for each coefficient.

    Raises
    ------
    ModelError
            The coordinate is unknown, there are fewer than four coefficients, or `low` is not below `high`.

    See Also
    --------
    formula : an effect as a formula.
    surface : an effect as a spline over two coordinates.
    udd.plot.curve : draw a fitted curve.

    Notes
    -----
    The curve is ``sum of c[i] B((x - low)/h + 1 - i)`` with the cardinal cubic B-spline ``B`` and ``h = (high
    - low)/(n - 3)``. Every cubic spline with these knots from `low` to `high` has this form (C. de Boor, "A
    Practical Guide to Splines", Springer 1978 [57]). A periodic curve has ``h = (high - low)/n`` and
    continues with ``c[0]`` after ``c[n - 1]``. Second derivatives are continuous except at the ends of the
    curve. In formulas it is ``spline(x, low, high, c0, c1, ...)`` and ``periodic(...)``.

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
    """Make an effect from a surface: a cubic spline over two coordinates.

    Parameters
    ----------
    slot : {"torque", "friction", "lateral", "vertical"}
        The equation that the surface is added to. See :func:`formula`.
    coordinates : pair of str or SymPy expression
        Coordinates of the surface. They are as for :func:`curve`.
    low, high : pair of float
        Its ends along each. Beyond them it decays to zero within three knots along the first coordinate, and
        is constant along the second.
    coefficients : array_like, shape (m, n)
        At least four along each. They become the parameters ``c0``, ``c1``, ... row by row. All are
        amplitudes.
    periodic : bool
        True if its end is joined to its beginning along the second coordinate. An angle needs this.
    momentum : {"consistent", "constraint"}, optional
        Way of a lateral or vertical effect to enter the angular momentum; see :class:`Spec`.
    name : str
        Prefix of its parameters' names.

    Returns
    -------
    Effect
        With one amplitude for each coefficient.

    Raises
    ------
    ModelError
            A coordinate is unknown, there are too few coefficients, or `low` is not below `high`.

    See Also
    --------
    curve : an effect as a spline over one coordinate.

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
        raise ModelError("a surface needs two coordinates, two values of low and two of high")
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
    """Make the parameters of a spline: its coefficients, all amplitudes, in the slot's unit."""
    _slot(slot)
    if count > _MOST_COEFFICIENTS:
        raise ModelError(f"a spline has at most {_MOST_COEFFICIENTS} coefficients, not {count}")
    unit = _SLOTS[slot][1] if slot in _SLOTS else ""
    return tuple(_parameter(name, f"c{i}", unit, True, UNLIMITED) for i in range(count))


def is_spline(effect: Effect) -> bool:
    """Return True if an effect is a curve or a surface, whose many numbers mean nothing to a reader."""
    return isinstance(effect.spec, CurveSpec | SurfaceSpec)


def _described(
    slot: str, name: str, title: str, shown: str, text: str, parameters: tuple[Parameter, ...]
) -> tuple[str, str, str, str, tuple[str, ...], tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Return the checked attributes of a specification before its parameters."""
    _slot(slot)
    _word(name)
    if name in _specs():
        raise ModelError(f"the library already has an effect {name!r}: give the formula another name")
    entry = _SLOTS.get(slot)
    left, _unit, meaning = entry or (f"{slot} = ... + ", "", f"the rate {slot} has one more term")
    if along_of(slot):
        left, meaning = f"{slot} = ", "a force that enters every acceleration through the mass matrix"
    if delayed_by(slot):
        left, meaning = f"{slot} = ", "the input acts later than it was measured"
    names = [p.name for p in parameters]
    linear = [p.name for p in parameters if p.role == "amplitude"]
    # For a user's own model only the model knows the states.
    bodies = tuple(_core.formula_bodies(name, (slot, text, names, linear))) if slot in _SLOTS else ("own",)
    return name, title, left + shown, meaning, bodies, (slot,), _MOMENTA.get(slot, ()), ()


def _slot(slot: str) -> None:
    rate = isinstance(slot, str) and slot.endswith("'") and slot[:-1].isidentifier()
    if slot not in _SLOTS and not rate and not along_of(slot) and not delayed_by(slot):
        raise ModelError(
            f'the slot must be one of {", ".join(_SLOTS)}; for a model of your own also a rate "v\'", a '
            "force "
            f'"force(x)" or a delay "delay(u)", not {slot!r:.80}'
        )


def along_of(slot: object) -> str | None:
    """Return the coordinate, or the difference of two, along which a force acts; None for another slot."""
    match = re.fullmatch(r"force\((\w+(?: - \w+)?)\)", slot) if isinstance(slot, str) else None
    return match[1] if match else None


def delayed_by(slot: object) -> str | None:
    """Return the input that a slot delays; None for another slot."""
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
        raise ModelError(
            f"the range of {name} of {effect} must be (low, high) with low <= high, not ({low}, {high})"
        )
    # The default must not depend on the given values.
    default = min(max(0.0, low), high)
    return Parameter(name, unit, default, (low, high), "amplitude" if linear else "shape", ())
