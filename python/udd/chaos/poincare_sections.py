"""Poincaré sections: where orbits cross a surface, and the maps from crossing to crossing."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd import _core
from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd._util.keywords import with_defaults
from udd._util.labelled import axes, of_states
from udd._util.progress import progress_bar, thread_count
from udd._util.validation import number, whole
from udd.errors import IncompleteWarning, ModelError, interrupted, outside
from udd.models import Model, require_model
from udd.models.parameter_batch import orbits_of
from udd.simulation.batch import RUN_OPTIONS, Batch, RunOptions
from udd.simulation.below_tolerance import warn_of_some
from udd.simulation.outcomes import OUTCOMES
from udd.simulation.trajectory import longest_step, tolerances

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Section", "poincare"]

_Floats = NDArray[np.float64]

_DIRECTIONS = {"up": 1, "down": -1, "both": 0}
# Named surfaces of a component X: the zero of its rate, and the direction that the name implies.
_EXTREMA = {"maxima": -1, "minima": 1, "turning points": 0}
_EXTREMUM = re.compile(rf"({'|'.join(_EXTREMA)}) of (\w+)")
_SMALL = 1e-3  # the size of states down to which the usual absolute tolerance is small
CLOCKS = 100.0  # typical times that a crossing may take on average


@dataclass(frozen=True, eq=False)
class Section(Drawable):
    """Crossings of a surface, or of several, along one orbit or many.

    Attributes
    ----------
    t : ndarray, shape (..., n)
        Times of the crossings. An orbit that ended early has fewer than n. With many orbits such rows end in
        NaN.
    state : ndarray, shape (..., n, dim)
        States at the crossings, in the order of ``model.state_names``.
    which : ndarray of int, shape (..., n)
        Number of the surface, counted from 0. It is -1 if there is no crossing.
    section : tuple of str
        The surfaces. Each is an expression that is zero there.
    direction : tuple of {"up", "down", "both"}
        Direction in which each expression changes.
    found : int, or ndarray of int, shape (...)
        Number of crossings.
    residual : float, or ndarray, shape (...)
        The largest absolute value of the expressions at the points.
    outcome : str, or ndarray of str, shape (...)
        ``"finished"``, or the reason for fewer crossings. Reasons are ``"ejected"``, ``"time ran out"``,
        ``"escaped"`` (to infinity), ``"failed"``, ``"chattering"`` and ``"interrupted"``.
    end : ndarray, shape (..., dim)
        The last state. It is the last crossing if the orbit finished.
    t_end : float, or ndarray, shape (...)
        The time of that.
    model : Model
        The model of the orbits, before parameters were varied.

    See Also
    --------
    udd.poincare : makes it.
    udd.plot.poincare : draw the points.
    udd.plot.return_map : draw the return map.
    """

    t: _Floats
    state: _Floats
    which: NDArray[np.int64]
    section: tuple[str, ...]
    direction: tuple[str, ...]
    found: Any
    residual: Any
    outcome: Any
    end: _Floats
    t_end: Any
    model: Model

    @property
    def return_times(self) -> _Floats:
        """Times from crossing to crossing, shape (..., n - 1); of one surface: see :meth:`of`."""
        self._single("return_times")
        return np.diff(self.t, axis=-1)

    @checked_arguments
    def component(self, name: str) -> _Floats:
        """Return one component of the points.

        Parameters
        ----------
        name : str
            A state of the model, such as ``"Omega"``.

        Returns
        -------
        ndarray, shape (..., n)
            In the unit of the state.

        Raises
        ------
        ModelError
            The state has no such component.
        """
        names = self.model.state_names
        if name not in names:
            raise ModelError(f"the state has no component {name!r}; it has {', '.join(names)}")
        return self.state[..., names.index(name)]

    @checked_arguments
    def of(self, which: int) -> Section:
        """Return the crossings of one of several surfaces.

        Parameters
        ----------
        which : int
            Its place in :attr:`section`.

        Returns
        -------
        Section
            With rows as long as the longest, the others end in NaN.

        Raises
        ------
        ModelError
            There is no such surface.
        """
        if which not in range(len(self.section)):
            raise ModelError(f"there are {len(self.section)} surfaces, counted from 0, and none is {which!r}")
        is_chosen = self.which == which
        count = is_chosen.sum(axis=-1)
        order = np.argsort(~is_chosen, axis=-1, kind="stable")[..., : int(count.max(initial=0))]
        there = np.take_along_axis(is_chosen, order, axis=-1)
        t = np.where(there, np.take_along_axis(self.t, order, axis=-1), np.nan)
        state = np.take_along_axis(self.state, order[..., None], axis=-2)
        state = np.where(there[..., None], state, np.nan)
        crossing_count = int(count) if count.ndim == 0 else count
        index = np.where(there, 0, -1)
        names, directions = (self.section[which],), (self.direction[which],)
        rest = (self.residual, self.outcome, self.end, self.t_end, self.model)
        return Section(t, state, index, names, directions, crossing_count, *rest)

    @checked_arguments
    def return_map(self, component: str) -> tuple[_Floats, _Floats]:
        """Pair each crossing with the next one.

        Parameters
        ----------
        component : str
            A component of the state, such as ``"y"``.

        Returns
        -------
        x, x_next : ndarray, shape (..., n - 1)

        Raises
        ------
        ModelError
            The state has no such component, or there are several surfaces.
        """
        self._single("return_map")
        x = self.component(component)
        return x[..., :-1], x[..., 1:]

    @checked_arguments
    def cusp_map(self, component: str | None = None) -> tuple[_Floats, _Floats]:
        """Pair each maximum with the next one: Lorenz's map [2].

        It is made of the orbits from the first points of this section, followed from maximum to maximum.

        Parameters
        ----------
        component : str, optional
            Component with the maxima. The default is the height z of the DLE, Z of a disk, theta of a
            pendulum.

        Returns
        -------
        height, next_height : ndarray, shape (..., n - 1)
            With as many maxima n as this section has points.

        Raises
        ------
        ModelError
            The state has no such component, or there is no point to start from, or parameters were varied.
        """
        usual = self.model.profile.dynamics.section or self.model.state_names[0]
        name = usual if component is None else component
        self.component(name)
        if self.t.ndim != 1:
            raise ModelError("the cusp map is that of one orbit; ask udd.poincare for the maxima of many")
        if not len(self.t):
            raise ModelError("this section has no point from which to look for maxima")
        maxima = poincare(self.model, f"maxima of {name}", len(self.t), state0=self.state[0], transient=0)
        return maxima.return_map(name)

    def to_xarray(self) -> xr.Dataset:
        """Return labelled arrays: ``t``, ``which`` and every state, over the orbits and ``crossing``.

        Returns
        -------
        xarray.Dataset

        Examples
        --------
        >>> import udd
        >>> udd.poincare(udd.DLE(10.0), n=20).to_xarray().sizes["crossing"]
        20
        """
        model = self.model
        dims = [*axes(self.t.shape[:-1], "orbit"), "crossing"]
        attrs = {"model": repr(model), "section": "; ".join(self.section)}
        dataset = of_states(model.state_names, model.state_units, self.state, dims, {}, **attrs)
        return dataset.assign(t=(dims, self.t), which=(dims, self.which))

    def _single(self, what: str) -> None:
        if len(self.section) > 1:
            raise ModelError(f"{what} is that of one surface: choose one of {len(self.section)} by .of(k)")

    def __repr__(self) -> str:
        laws = [text if "=" in text else f"{text} = 0" for text in self.section]
        what = " and ".join(f"{law} ({d})" for law, d in zip(laws, self.direction, strict=True))
        if self.t.ndim == 1:
            return (
                f"<Section {what} of {self.model!r}: {self.found} points, residual {self.residual:.1e}, "
                f"{self.outcome}>"
            )
        worst = float(np.max(self.residual, initial=0.0))
        return (
            f"<Section {what} of {self.model!r}: {self.t.shape[:-1]} orbits, up to {self.t.shape[-1]} "
            f"points each, residual {worst:.1e}>"
        )


@checked_arguments
def poincare(
    model: Model,
    section: str | Sequence[str] | None = None,
    n: int = 1000,
    *,
    state0: ArrayLike | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
    direction: str | Sequence[str] | None = None,
    transient: int = 100,
    t_max: float | None = None,
    **options: Unpack[RunOptions],
) -> Section:
    """Compute a Poincaré section: the crossings of a surface along orbits.

    Parameters
    ----------
    model : Model
    section : str or list of str, optional
        Surfaces. Each is an expression that is zero there, or an equation. It may contain components of the
        state (``"z"``, ``"omega = y"``), their rates (``"z'"``), the time ``t``, parameters and numbers.
        Operators are ``+ - * / ^``. Functions are those of :func:`udd.effects.formula`. Or a name:
        ``"maxima of z"``, ``"minima of z"``, ``"turning points of z"`` of any component, ``"reversal"``
        (the angular velocity is zero). By default z = 0 of the DLE, Z = 0 of a disk, theta = 0 of a
        pendulum, and the maxima of the first state of a user's own model.
    n : int
        Number of crossings of each orbit.
    state0 : array_like, shape (..., dim), optional
        Initial states, at time 0. An orbit that starts on the surface does not cross it there.
    parameters : mapping of str to array_like, optional
        Other values of some of the model's parameters. Their shapes broadcast with each other and with the
        leading axes of `state0`. The result has these axes.
    direction : {"up", "down", "both"} or list of these, optional
        Direction of the crossings that count: the expression rises, falls, or both. The default is ``"up"``,
        and ``"both"`` for turning points and reversals.
    transient : int
        Number of crossings that are left out first.
    t_max : float, optional
        Time at which an orbit ends in any case. The default is 100 typical times of the motion for every
        crossing.
    **options
        ``rtol`` (1e-9) and ``atol`` (1e-12, less for starts below 1e-3) are the tolerances of the run.
        ``max_step`` is its longest step. ``threads`` is one per core by default, and the result does not
        depend on it. ``progress`` is True for a progress bar, False for none, or a function that
        gets the state of the work as a text. By default a bar shows after 2 s in a terminal or a notebook.
        With ``partial``, Ctrl-C returns the finished part with a warning, instead of raising an exception.

    Returns
    -------
    Section
        Fields ``t``, ``state``, ``which``, ``found`` and ``outcome``; each component by
        :meth:`Section.component`.

    Raises
    ------
    ModelError
        An expression, a state or an option that cannot be used.

    Interrupted
        On Ctrl-C, with the crossings found as its ``partial``.
    MemoryError
        There is no room for so many points.

    Warns
    -----
    IncompleteWarning
        Where orbits end before the surface is crossed n times; after Ctrl-C where a partial result was asked
        for.
    ToleranceWarning
        A component falls below `atol` and grows again, and an error of `atol` changes what follows; some of
        many orbits are checked.

    See Also
    --------
    udd.bifurcation : section points over a parameter.
    udd.periodic_orbit : the cycle near a point.
    udd.plot.poincare : draw the points.
    udd.plot.return_map : draw each point over the one before.

    Notes
    -----
    The Taylor method's polynomials are as accurate as its steps; a crossing is a zero of the expression on
    such a polynomial. If the expression may have several zeros, interval arithmetic
    divides the step until each part has at most one, however fast the expression changes. A surface that is
    only touched is not crossed. A smooth pulse of the law that is shorter than a step may need ``max_step``.

    References
    ----------
    Interval arithmetic: R. E. Moore [15]. Zeros: N. Anderson and Å. Björck [14].

    Examples
    --------
    >>> import udd
    >>> points = udd.poincare(udd.DLE(10.0), n=20, transient=1000)
    >>> points.residual < 1e-12
    True
    >>> print(f"{points.return_times.mean():.6f}")  # half a period of the symmetric orbit
    1.679161
    """
    require_model(model)
    surfaces, ways = surfaces_of(model, section, direction)
    count, skipped = whole("n", n, 1), whole("transient", transient, 0)
    chosen = with_defaults("poincare", RUN_OPTIONS, options)
    rtol, atol = tolerances(chosen["rtol"], chosen["atol"])
    shape, rows, starts = orbits_of(model, parameters or {}, state0)
    if "atol" not in options:
        atol *= _smallness(starts)
    if t_max is None:
        end = CLOCKS * clock_of(model, rows) * (count + skipped)
    else:
        end = number("t_max", t_max, above=0.0)
    longest = longest_step(chosen["max_step"], end)
    jobs = max(len(rows), len(starts))
    with progress_bar(jobs, "orbit", chosen["progress"]) as bar:
        batch = Batch(model, rows, starts, rtol, atol, thread_count(chosen["threads"]), bar.since(), longest)
        raw = _core.sections(batch, list(zip(surfaces, ways, strict=True)), skipped, count, end)
    names = np.array(OUTCOMES)[raw["outcome"]]
    numbers = raw["found"].astype(np.int64)
    columns = raw["t"].shape[1]  # as many as were asked for, or were found until Ctrl-C
    which = np.where(np.arange(columns) < numbers[:, None], raw["which"].astype(np.int64), -1)
    words = tuple(next(word for word, sign in _DIRECTIONS.items() if sign == way) for way in ways)
    # A single orbit has plain numbers, and no room for points that it does not have.
    last = columns if shape else int(numbers[0])

    def of_orbits(values: NDArray[Any]) -> Any:
        return values.reshape(shape) if shape else values[0].item()

    made = Section(
        raw["t"].reshape(*shape, columns)[..., :last],
        raw["points"].reshape(*shape, columns, len(model.state_names))[..., :last, :],
        which.reshape(*shape, columns)[..., :last],
        surfaces,
        words,
        of_orbits(numbers),
        of_orbits(raw["residual"]),
        of_orbits(names),
        raw["end"].reshape(*shape, -1),
        of_orbits(raw["t_end"]),
        model,
    )
    _tell(raw["outcome"], numbers, count, made, chosen["partial"])
    warn_of_some(model, rows, starts, raw["t_end"], rtol, atol)
    return made


def surfaces_of(
    model: Model, section: str | Sequence[str] | None, direction: str | Sequence[str] | None
) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Return the expressions, and the signs of the directions in which they are crossed."""
    if section is None:
        section = model.profile.dynamics.section or f"maxima of {model.state_names[0]}"
    texts = [section] if isinstance(section, str) else section
    if not isinstance(texts, Sequence) or not texts or not all(isinstance(text, str) for text in texts):
        raise ModelError(f"section must be an expression such as 'z', or a list of them, not {section!r}")
    if direction is None or isinstance(direction, str):
        wanted: list[str | None] = [direction] * len(texts)
    else:
        wanted = list(direction)
    if len(wanted) != len(texts):
        raise ModelError(f"there are {len(texts)} sections but {len(wanted)} directions")
    pairs = [_surface(model, *pair) for pair in zip(texts, wanted, strict=True)]
    return tuple(pair[0] for pair in pairs), tuple(pair[1] for pair in pairs)


def _surface(model: Model, text: str, direction: str | None) -> tuple[str, int]:
    """Return the expression of a named surface."""
    if direction is not None and direction not in _DIRECTIONS:
        raise ModelError(f'direction must be "up", "down" or "both", not {direction!r}')
    extremum = _EXTREMUM.fullmatch(text.strip())
    if extremum is not None:
        kind, name = extremum.groups()
        implied = _EXTREMA[kind]
        if name not in model.state_names:
            raise ModelError(f"the state has no component {name!r}; it has {', '.join(model.state_names)}")
        given = None if direction is None else _DIRECTIONS[direction]
        if kind != "turning points" and given not in (None, implied):
            raise ModelError(f"{text} say the direction themselves: leave direction out")
        return f"{name}'", implied if given is None else given
    if text.strip() == "reversal":
        return model.state_names[0], _DIRECTIONS[direction or "both"]
    return text, _DIRECTIONS[direction or "up"]


def _smallness(starts: _Floats) -> float:
    """Return the factor of the usual absolute tolerance for orbits that start close to zero."""
    size = float(np.abs(starts).max(initial=0.0))
    return min(1.0, size / _SMALL) if size > 0 else 1.0


def clock_of(model: Model, rows: _Floats) -> float:
    """Return the typical time between crossings of the slowest orbit; `rows` are the orbits' parameters."""
    p = dict(zip(model.parameters, rows.T, strict=True))
    crossing_rate = model.profile.dynamics.crossing_rate
    rate = np.full(len(rows), 0.1) if crossing_rate is None else crossing_rate(p)
    slowest = float(rate[np.isfinite(rate) & (rate > 0)].min(initial=1.0))
    return 1.0 / max(slowest, 1e-6)


def _hint(section: Section) -> str:
    """Name the section to ask for instead of an angle, which has each value once."""
    for name in section.model.angles:
        for text in section.section:
            plain = re.fullmatch(rf"\s*{name}\s*(?:(?:=|-)\s*([\w.*/+-]+))?\s*", text)
            if plain is not None:
                less = f" - {plain[1]}" if plain[1] else ""
                return f"; {name} is not taken modulo 2 pi: try the section 'sin({name}{less})'"
    return ""


def _tell(
    outcome: NDArray[np.uint8], achieved: NDArray[Any], n: int, section: Section, partial: bool
) -> None:
    """Warn of orbits with fewer points."""
    short = outcome != OUTCOMES.index("finished")
    if not short.any():
        return
    kinds, counts = np.unique(outcome[short], return_counts=True)
    if len(outcome) == 1:
        message = (
            f"the orbit has {int(achieved[0])} crossings instead of {n}: {OUTCOMES[kinds[0]]}{_hint(section)}"
        )
    else:
        whys = ", ".join(f"{OUTCOMES[kind]} {count}" for kind, count in zip(kinds, counts, strict=True))
        message = f"{int(short.sum())} of {len(outcome)} orbits have fewer than {n} crossings: {whys}"
        message += _hint(section)
    if (outcome == OUTCOMES.index("interrupted")).any():
        interrupted(lambda: section, message, partial)
    else:
        warnings.warn(IncompleteWarning(message), stacklevel=outside())
