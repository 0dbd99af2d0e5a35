"""Attractors over a parameter, and over the plane of initial states."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd.errors import UddError

from .style import AXES, FAINT, MANY, MEASURED, SHADES, SQUARE, WIDE, legend_above, new_axes, tidy

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


@checked_arguments(error=UddError)
def bifurcation(
    result: xr.Dataset, ax: Axes | None = None, *, component: str | None = None, colour: str | None = None
) -> Axes:
    """Draw section points over the parameter; stretches with hysteresis are shaded.

    Parameters
    ----------
    result : xarray.Dataset
        Of :func:`udd.bifurcation`.
    ax : Axes, optional
    component : str, optional
        The component of the state; by default the first that varies.
    colour : {"path", "attractor"}, optional
        Colour by direction of the sweep or by attractor; by default by direction if there are two.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is no bifurcation diagram, or has no such component.

    See Also
    --------
    udd.bifurcation : computes the points.
    udd.plot.diagram : the same with branches.

    Examples
    --------
    >>> import udd
    >>> diagram = udd.bifurcation(udd.DLE(1.0), "w", [5.3, 6.0, 7.5], n=40)
    >>> udd.plot.bifurcation(diagram).get_ylabel()
    'ω [1]'
    """
    parameter = result.attrs.get("parameter")
    if parameter is None or "point" not in result.dims:
        raise UddError("this is no bifurcation diagram: udd.bifurcation makes one")
    name = shown_component(result, component)
    if colour not in (None, "path", "attractor"):
        raise UddError(f'colour must be "path" or "attractor", not {colour!r}')
    if colour == "attractor" and "attractor" not in result:
        raise UddError("the attractors of this diagram were not distinguished")
    points = result[name].transpose("path", "start", parameter, "point").to_numpy()
    x = np.broadcast_to(result[parameter].to_numpy()[:, None], points.shape[2:])
    words, unit, factor = _axis(result, name)
    ax = new_axes(ax)
    if "hysteresis_interval" in result:
        for first, last in result["hysteresis_interval"].to_numpy():
            half = _half_step(result[parameter].to_numpy(), first, last)
            ax.axvspan(first - half[0], last + half[1], color="#fbe9c6", linewidth=0, label="hysteresis")
    for shade, label, chosen in _layers(result, points, colour):
        size = min(2.5, max(0.4, 120.0 / result.sizes[parameter]))  # of lines where values are dense
        ax.plot(
            np.broadcast_to(x, points.shape)[chosen],
            factor * points[chosen],
            linestyle="none",
            marker="o",
            markersize=size,
            markeredgewidth=0,
            color=shade,
            label=label,
            rasterized=bool(chosen.sum() > MANY),
        )
    ax.set_xlabel(f"{parameter} [{result[parameter].attrs.get('units', '1')}]")
    ax.set_ylabel(f"{words} [{unit}]")
    _legend(ax)
    tidy(ax, grid=False)
    return ax


@checked_arguments(error=UddError)
def basins(result: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the basins of attraction: a colour for each attractor, greys for other ends.

    Starts that were not run, such as those off the wheels, are white.

    Parameters
    ----------
    result : xarray.Dataset
        Result of :func:`udd.basins`, over two components.
    ax : Axes, optional

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result holds no basins over two components.

    See Also
    --------
    udd.basins : computes them.
    udd.plot.bifurcation : attractors over a parameter.

    Examples
    --------
    >>> import numpy as np, udd
    >>> grid = {"omega": np.linspace(-3, 3, 8), "z": np.linspace(-3, 3, 8)}
    >>> udd.plot.basins(udd.basins(udd.DLE(9.0), grid, n=24)).get_xlabel()
    'ω at the start [1]'
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap

    names = result.attrs.get("grid") if "attractor" in result else None
    if names is None or len(names.split()) != 2:
        raise UddError("these are no basins over two components: udd.basins makes them")
    across, up = names.split()
    titles = [str(title) for title in result["ending"].to_numpy()]
    ends, shades = _ends(result, titles).transpose(up, across).to_numpy(), _shades(titles)
    (x_words, x_unit, x_factor), (y_words, y_unit, y_factor) = _axis(result, across), _axis(result, up)
    ax = new_axes(ax, size=SQUARE if x_unit == y_unit != "1" else WIDE)
    ax.pcolormesh(
        x_factor * result[across].to_numpy(),
        y_factor * result[up].to_numpy(),
        np.ma.masked_less(ends, 0),
        cmap=ListedColormap(shades),
        norm=BoundaryNorm(np.arange(len(titles) + 1) - 0.5, len(titles)),
        shading="nearest",
        rasterized=True,
    )
    fractions = result["fraction"].to_numpy()
    for shade, title, fraction in zip(shades, titles, fractions, strict=True):
        said = _said(result, title) + (f", {100 * fraction:.3g} %" if np.isfinite(fraction) else "")
        if (ends == titles.index(title)).any():
            ax.plot([], [], "s", color=shade, markeredgecolor=MEASURED, markeredgewidth=0.5, label=said)
    ax.set_xlabel(f"{x_words} at the start [{x_unit}]")
    ax.set_ylabel(f"{y_words} at the start [{y_unit}]")
    legend_above(ax, fontsize="small")
    if x_unit == y_unit != "1":
        ax.set_aspect("equal")
    tidy(ax, grid=False)
    return ax


def _said(result: xr.Dataset, title: str) -> str:
    """Describe an ending in words; an attractor with its kind."""
    if not title.startswith("attractor"):
        return title
    one = result.sel(number=int(title.split()[1]))
    kind = str(one["kind"].attrs["flag_meanings"]).split()[int(one["kind"])]
    return f"period {int(one['period'])}" if kind == "periodic" else kind


def _ends(result: xr.Dataset, titles: list[str]) -> xr.DataArray:
    """Return the place of each initial state's ending among the titles."""
    ends: xr.DataArray = result["attractor"] - 1
    for value, name in enumerate(str(result["outcome"].attrs["flag_meanings"]).split()):
        title = name.replace("_", " ")
        if title in titles:
            ends = ends.where(result["outcome"] != value, titles.index(title))
    return ends


def shown_component(result: xr.Dataset, component: str | None) -> str:
    """Return the component to draw: the given one, or the first that varies."""
    components = [str(name) for name, array in result.data_vars.items() if "point" in array.dims]
    if component is not None:
        if component not in components:
            raise UddError(f"this diagram has no {component!r}; it has {', '.join(components)}")
        return component
    for name in components:
        values = result[name].to_numpy()
        seen = values[np.isfinite(values)]
        if seen.size and np.ptp(seen) > 1e-9:
            return name
    return components[0]


def _axis(result: xr.Dataset, name: str) -> tuple[str, str, float]:
    """Return the words, the unit and the factor of a component."""
    return AXES.get(name, (name, result[name].attrs.get("units", "1"), 1.0))


def _half_step(values: NDArray[np.float64], first: float, last: float) -> tuple[float, float]:
    """Half the way to the neighbours, so that a stretch of one value has a width."""
    i, j = int(np.searchsorted(values, first)), int(np.searchsorted(values, last))
    before = values[i] - values[i - 1] if i else 0.0
    after = values[j + 1] - values[j] if j + 1 < len(values) else 0.0
    return float(before) / 2, float(after) / 2


def _layers(
    result: xr.Dataset, points: NDArray[np.float64], colour: str | None
) -> list[tuple[str, str | None, NDArray[np.bool_]]]:
    """List the colours: each with its name in the legend and a mask of its points."""
    seen = np.isfinite(points)
    paths = [str(name) for name in result["path"].to_numpy()]
    if colour is None:
        colour = "path" if len(paths) > 1 else ""
    if colour == "path":
        masks = [seen & (np.arange(len(paths)) == k)[:, None, None, None] for k in range(len(paths))]
        return [(SHADES[k], name, masks[k]) for k, name in enumerate(paths)]
    if colour == "attractor":
        labels = result["attractor"].transpose(*result[shown_component(result, None)].dims[:3]).to_numpy()
        numbers = np.unique(labels)
        return [
            (
                FAINT if number == 0 else SHADES[(number - 1) % len(SHADES)],
                None,
                seen & (labels == number)[..., None],
            )
            for number in numbers
        ]
    return [("#202020", None, seen)]


def _shades(titles: list[str]) -> list[Any]:
    """Colours that all readers distinguish: attractors in the palette, other ends in greys and black.

    More attractors than the palette has colours take steps of cividis, which are distinct by lightness alone.
    """
    import matplotlib

    count = sum(title.startswith("attractor") for title in titles)
    steps = matplotlib.colormaps["cividis"]
    greys = {"ejected": "#000000", "escaped": "#3d3d3d", "undecided": "#d9d9d9"}
    shades: list[Any] = []
    for k, title in enumerate(titles):
        if title.startswith("attractor"):
            shades.append(SHADES[k] if count <= len(SHADES) else steps(k / (count - 1)))
        else:
            shades.append(greys.get(title, "#ffffff"))
    return shades


def _legend(ax: Axes) -> None:
    """One entry for each name, with dots that can be seen."""
    handles, names = ax.get_legend_handles_labels()
    unique = dict(zip(names, handles, strict=True))
    if unique:
        from matplotlib.lines import Line2D

        sizes = [handle.get_markersize() for handle in unique.values() if isinstance(handle, Line2D)]
        legend_above(ax, list(unique.values()), list(unique), markerscale=5.0 / max(sizes, default=5.0))
