"""Branches of equilibria and cycles over a parameter, with their bifurcation points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from udd._util.arguments import checked_arguments
from udd.errors import UddError

from .style import FAINT, axis_of, legend_above, new_axes, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from udd.bifurcations import Branch
    from udd.bifurcations.branch_diagram import Diagram

Rows = list[list["NDArray[Any]"]]

_STABLE, _UNSTABLE = "#000000", "#cc3311"
_MARKS = {
    "fold": ("v", "#0072b2"),
    "nonsmooth fold": (">", "#0072b2"),
    "Hopf": ("s", "#009e73"),
    "symmetry breaking": ("D", "#cc79a7"),
    "period doubling": ("o", "#e69f00"),
    "Neimark-Sacker": ("p", "#56b4e9"),
    "Krein collision": ("X", "#56b4e9"),
    "branch point": ("^", "#999999"),
    "border collision": ("x", "#999999"),
}
_OPEN = 400  # lines that a piece may belong to
_LARGEST_GAP = 0.12  # crossings of neighbouring cycles are joined within this part of the picture's height


@checked_arguments(error=UddError)
def branches(
    result: Branch | Sequence[Branch],
    ax: Axes | None = None,
    *,
    component: str | None = None,
    view: str = "section",
    section: str | None = None,
) -> Axes:
    """Draw branches over the parameter: stable ones solid, unstable ones dashed, with bifurcations.

    Parameters
    ----------
    result : Branch or sequence of Branch
        Of :func:`udd.continuation`.
    ax : Axes, optional
    component : str, optional
        Which component of the state; by default the first.
    view : {"section", "extremes", "period"}
        Values of cycles: crossings of a section, extremes of the component, or periods.
    section : str, optional
        The section, upward; by default that of :func:`udd.poincare`.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        No branches, a component or view that there is not, or the periods of equilibria alone.

    See Also
    --------
    udd.continuation : computes a branch.
    udd.plot.diagram : the same with section points.

    Examples
    --------
    >>> import udd
    >>> branch = udd.continuation(udd.periodic_orbit(udd.DLE(8.0)), "w", (6.8, 8.2))
    >>> udd.plot.branches(branch, view="extremes").get_xlabel()
    'w'
    """
    from udd.bifurcations import Branch

    given = [result] if isinstance(result, Branch) else list(result)
    if not given or not all(isinstance(branch, Branch) for branch in given):
        raise UddError("these are no branches: udd.continuation makes them")
    if view not in ("section", "extremes", "period"):
        raise UddError(f'view must be "section", "extremes" or "period", not {view!r}')
    model, parameter = given[0].model, given[0].parameter
    name = model.state_names[0] if component is None else component
    if name not in model.state_names:
        raise UddError(f"the state has no {name!r}; it has {', '.join(model.state_names)}")
    shown = [branch for branch in given if view != "period" or branch.kind == "cycle"]
    if not shown:
        raise UddError("equilibria have no period")
    ax = new_axes(ax)
    rows = [_curves(branch, name, view, section) for branch in shown]
    for branch, branch_rows in zip(shown, rows, strict=True):
        _draw(ax, branch, branch_rows)
    for branch, branch_rows in zip(shown, rows, strict=True):
        _mark(ax, branch, branch_rows)
    unit = model.units[parameter]
    ax.set_xlabel(f"{parameter} [{unit}]" if unit else parameter)
    if view == "period":
        ax.set_ylabel(f"period [{model.profile.dynamics.time_unit or 1}]")
    else:
        words = axis_of(model, name)[0]
        ax.set_ylabel(f"least and greatest {words}" if view == "extremes" else words)
    tidy(ax, grid=False)
    _legend(ax)
    return ax


@checked_arguments(error=UddError)
def diagram(result: Diagram, ax: Axes | None = None, *, component: str | None = None) -> Axes:
    """Draw a bifurcation diagram: section points up and down, hysteresis, branches and bifurcations.

    Parameters
    ----------
    result : Diagram
        Of :func:`udd.diagram`.
    ax : Axes, optional
    component : str, optional
        Which component of the state; by default the first that varies.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is no diagram, or has no such component.

    See Also
    --------
    udd.diagram : computes it.
    udd.plot.branches : the branches alone.
    udd.plot.bifurcation : the section points alone.

    Examples
    --------
    >>> import numpy as np, udd
    >>> diagram = udd.diagram(udd.DLE(8.0), "w", np.linspace(7.0, 7.4, 5), n=24)
    >>> udd.plot.diagram(diagram).get_ylabel()
    'ω [1]'
    """
    from udd.bifurcations.branch_diagram import Diagram

    from .attractors import bifurcation, shown_component

    if not isinstance(result, Diagram):
        raise UddError(f"this is no diagram, which udd.diagram makes, but {type(result).__name__}")
    name = shown_component(result.scan, component)
    ax = bifurcation(result.scan, ax, component=name)
    low, high = ax.get_ylim()
    section = str(result.scan.attrs.get("section", "")) or None
    if result.branches:
        branches(result.branches, ax, component=name, section=section)
    # Branches may go far beyond what motions do.
    ax.set_ylim(low - 0.15 * (high - low), high + 0.15 * (high - low))
    first, last = result.scan[result.parameter].to_numpy()[[0, -1]]
    ax.set_xlim(first, last)
    return ax


def _curves(branch: Branch, name: str, view: str, section: str | None) -> Rows:
    """Return the drawn values for each place on the branch, with those of the mirror image."""
    column, factor = branch.model.state_names.index(name), axis_of(branch.model, name)[1]
    if view == "period":
        return [[np.array([period])] for period in branch.periods]
    sign = _mirrored(branch, column)
    if branch.kind == "equilibrium" or view == "extremes":
        ends = [branch.states] if branch.kind == "equilibrium" else list(branch.extremes)
        rows = np.array([end[:, column] for end in ends]).T * factor
        return [[row, *([sign * row] if sign else [])] for row in rows]
    which, states = branch.crossings(section)
    values = [factor * states[which == i, column] for i in range(len(branch))]
    return [[np.sort(row), *([np.sort(sign * row)] if sign else [])] for row in values]


def _mirrored(branch: Branch, column: int) -> float:
    """Return the sign of a component in the mirror image that is drawn too, 0 without such an image."""
    flow = branch._places[0][0].flow
    if flow.mirror is None or branch.symmetric or column not in flow.kept:
        return 0.0
    return float(flow.mirror[list(flow.kept).index(column)])


def _draw(ax: Axes, branch: Branch, rows: Rows) -> None:
    from matplotlib.collections import LineCollection

    every = np.concatenate([part for row in rows for part in row] or [np.zeros(1)])
    largest_gap = _LARGEST_GAP * float(np.ptp(every)) if every.size else 0.0
    # Between two places; at a bifurcation itself rounding would decide.
    turning = np.isin(branch.arclength, [point.arclength for point in branch.points])
    stable_between = np.where(turning[:-1], branch.stable[1:], branch.stable[:-1])
    for stable, shade, style, width in ((True, _STABLE, "-", 1.6), (False, _UNSTABLE, (0, (4, 2)), 0.9)):
        lines: list[list[tuple[float, float]]] = []
        for i in np.flatnonzero(stable_between == stable):
            for here, there in zip(rows[i], rows[i + 1], strict=True):
                if not len(there):
                    continue
                same = len(here) == len(there)
                others = there if same else [there[np.argmin(np.abs(there - a))] for a in here]
                for a, b in zip(here, others, strict=True):
                    if abs(a - b) <= largest_gap or largest_gap == 0.0:
                        _join(lines, (branch.values[i], a), (branch.values[i + 1], b))
        if not lines:
            continue
        drawn = LineCollection(
            lines,
            colors=shade,
            linewidths=width,
            linestyles=[style],
            zorder=3 if stable else 2.5,
            label="stable" if stable else "unstable",
        )
        ax.add_collection(drawn)
    ax.autoscale_view()


def _join(
    lines: list[list[tuple[float, float]]], first: tuple[float, float], last: tuple[float, float]
) -> None:
    """Prolong the line that ends where this piece begins, or begin one: dashes run on along a line."""
    for line in reversed(lines[-_OPEN:]):
        if line[-1] == first:
            line.append(last)
            return
    lines.append([first, last])


def _mark(ax: Axes, branch: Branch, rows: Rows) -> None:
    """Mark bifurcation points on every line of the branch, at the place next to each."""
    for point in branch.points:
        marker, shade = _MARKS.get(point.kind, ("*", FAINT))
        heights = np.concatenate(rows[int(np.argmin(np.abs(branch.arclength - point.arclength)))])
        ax.plot(
            np.full(len(heights), point.value),
            heights,
            linestyle="none",
            marker=marker,
            color=shade,
            markersize=4.5,
            markeredgecolor="black" if marker != "x" else shade,
            markeredgewidth=0.6,
            zorder=5,
            label=point.kind,
        )


def _legend(ax: Axes) -> None:
    handles, labels = ax.get_legend_handles_labels()
    first = {text: handle for handle, text in zip(reversed(handles), reversed(labels), strict=True)}
    if first:
        words = sorted(first, key=labels.index)
        # Above the picture: inside it would cover a branch, wherever it stands.
        legend_above(ax, [first[text] for text in words], words, fontsize="small")
