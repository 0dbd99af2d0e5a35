"""Poincaré sections and the maps from crossing to crossing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd.errors import UddError

from .style import AFTER, FAINT, MANY, SHADES, SQUARE, axis_of, label, legend_above, new_axes, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from udd.chaos.poincare_sections import Section

_TURNING = ("beta", "theta")
_SAME = 1e-9  # a component that varies by less of its size is the same everywhere


@checked_arguments(error=UddError)
def poincare(result: Section, ax: Axes | None = None, *, components: tuple[str, str] | None = None) -> Axes:
    """Draw the points of a section in the plane of two components, with a colour for each surface.

    Parameters
    ----------
    result : Section
        Result of :func:`udd.poincare`. The points of many orbits are drawn together.
    ax : Axes, optional
    components : tuple of str, optional
        Which components lie across and up; by default the first two that vary, or the time and the one.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is no section, has no points, or no such component.

    See Also
    --------
    udd.poincare : computes the section.
    udd.plot.return_map : draw each point over the one before.

    Examples
    --------
    >>> import udd
    >>> udd.plot.poincare(udd.poincare(udd.DLE(1.0), n=100)).get_xlabel()
    'ω [1]'
    """
    _checked(result)
    names = _components(result) if components is None else components
    (across, x), (up, y) = (_axis(result, name) for name in names)
    ax = new_axes(ax)
    for k, surface in enumerate(result.section):
        chosen = (result.which == k) & np.isfinite(result.t)
        said = f"{surface} = 0" if "=" not in surface else surface
        _dots(ax, x[chosen], y[chosen], SHADES[k % len(SHADES)], said)
    ax.set_xlabel(across)
    ax.set_ylabel(up)
    if len(result.section) > 1:
        legend_above(ax, markerscale=5.0 / ax.lines[0].get_markersize())
    tidy(ax)
    return ax


@checked_arguments(error=UddError)
def return_map(result: Section, ax: Axes | None = None, *, component: str | None = None) -> Axes:
    """Draw each crossing's component over that of the crossing before, with the diagonal.

    Parameters
    ----------
    result : Section
        Result of :func:`udd.poincare`. Ask it for ``"maxima of z"`` to see Lorenz's cusp map.
    ax : Axes, optional
    component : str, optional
        By default the first that varies; of a section of maxima what is at its maximum.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is no section of one surface, has no points, or no such component.

    See Also
    --------
    udd.Section.return_map : computes the pairs.
    udd.plot.poincare : draw the points.

    Examples
    --------
    >>> import udd
    >>> maxima = udd.poincare(udd.DLE(1.0), "maxima of z", 100)
    >>> udd.plot.return_map(maxima).get_ylabel()
    'next z [1]'
    """
    _checked(result)
    name = component
    if name is None:
        expression = result.section[0].removesuffix("'")
        name = expression if expression in result.model.state_names else _components(result)[-1]
    x, following = result.return_map(name)
    said, factor = axis_of(result.model, name)
    x, following = factor * x.ravel(), factor * following.ravel()
    there = np.isfinite(x) & np.isfinite(following)
    ax = new_axes(ax, size=SQUARE)
    if there.any():
        ends = [float(x[there].min()), float(x[there].max())]
        ax.plot(ends, ends, color=FAINT, linewidth=1.0, zorder=0)
    _dots(ax, x[there], following[there], AFTER, None)
    ax.set_xlabel(said)
    ax.set_ylabel(f"next {said}")
    ax.set_aspect("equal", "datalim")
    tidy(ax)
    return ax


def _checked(result: Any) -> None:
    from udd.chaos.poincare_sections import Section

    if not isinstance(result, Section):
        raise UddError(f"this is no section, which udd.poincare makes, but {type(result).__name__}")
    if not np.isfinite(result.t).any():
        raise UddError("there are no points in this section")


def _dots(ax: Axes, x: NDArray[Any], y: NDArray[Any], shade: str, said: str | None) -> None:
    size = min(4.0, max(0.5, 60.0 / np.sqrt(max(len(x), 1))))
    style: dict[str, Any] = {
        "linestyle": "none",
        "marker": "o",
        "markeredgewidth": 0,
        "rasterized": len(x) > MANY,
    }
    ax.plot(x, y, color=shade, markersize=size, label=said, **style)


def _components(result: Section) -> tuple[str, str]:
    """Choose two components that vary; rotating angles come last."""
    names = sorted(result.model.state_names, key=lambda name: name in _TURNING)
    varied = []
    for name in names:
        values = result.component(name)[np.isfinite(result.t)]
        if np.ptp(values) > _SAME * np.abs(values).max(initial=0.0) and np.ptp(values) > _SAME:
            varied.append(name)
    if len(varied) == 1 or (len(varied) == 2 and varied[1] in _TURNING):
        return "t", varied[0]
    if len(varied) < 2:
        return names[0], names[1]
    return varied[0], varied[1]


def _axis(result: Section, name: str) -> tuple[str, NDArray[np.float64]]:
    """Return the label of an axis, and the numbers along it."""
    if name == "t":
        return label("t" if result.model.profile.dynamics.time_unit else "tau"), result.t
    said, factor = axis_of(result.model, name)
    return said, factor * result.component(name)
