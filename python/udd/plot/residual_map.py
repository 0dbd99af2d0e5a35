"""The residual of every equation along every coordinate, on one picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd.errors import UddError

from .fits import binned, coordinates
from .inputs import require_fit
from .style import AFTER, AXES, BEFORE, EQUATIONS, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

_BINS = 16
_CHANCE = 1e-3  # over all cells together
_SHORT = {"t": "time T", "R": "R", "beta": "β mod 2π", "Omega": "Ω", "theta": "θ"}


@checked_arguments(error=UddError)
def residual_map(fit: Any, ax: Axes | None = None, *, before: Any = None) -> Axes:
    """Draw the mean residual of every equation (rows) along every coordinate (columns).

    If a model is right, every band contains the zero line. A cell has a frame if the
    probability of the means' scatter by chance is below 0.1 %, over all cells together.

    Parameters
    ----------
    fit : Fit
    ax : Axes, optional
    before : Fit, optional
        Another fit of the same record, drawn first in another colour; its cells are then the framed ones.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        Not a fit.

    See Also
    --------
    udd.fit : makes the fit.
    udd.plot.residuals : a single panel.
    """
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.patches import Rectangle

    shown = [(fit, AFTER)] if before is None else [(before, BEFORE), (fit, AFTER)]
    for one, _ in shown:
        require_fit(one)
    rows, columns = fit.model.state_names, list(coordinates(fit))
    cells = [_cells(one) for one, _ in shown]
    ax = new_axes(ax, size=(1.5 * len(columns) + 1.5, 0.95 * len(rows) + 0.8))
    for r, equation in enumerate(rows):
        top = max(float(np.max(np.abs(m) + 2 * s)) for grid in cells for _, m, s in grid[r])
        words, unit, factor = EQUATIONS[equation]
        place = len(rows) - 1 - r
        ax.text(-0.03, place + 0.62, words, ha="right", va="center", fontsize="medium")
        ax.text(
            -0.03, place + 0.36, f"± {factor * top:.2g} {unit}", ha="right", va="center", fontsize="small"
        )
        for c in range(len(columns)):
            # All fits of a cell share its axes.
            low = min(float(grid[r][c][0].min()) for grid in cells)
            high = max(float(grid[r][c][0].max()) for grid in cells)
            for grid, (_, colour) in zip(cells, shown, strict=True):
                centre, mean, error = grid[r][c]
                x = c + 0.04 + 0.92 * (centre - low) / max(high - low, 1e-300)
                y, e = place + 0.5 + 0.44 * mean / top, 0.88 * error / top
                band = np.column_stack([np.r_[x, x[::-1]], np.r_[y - e, (y + e)[::-1]]])
                ax.add_collection(PolyCollection([band], facecolor=colour, alpha=0.3, linewidth=0))
                ax.add_collection(LineCollection([np.column_stack([x, y])], color=colour, linewidth=1.2))
            clear = beyond_chance(cells[0][r][c], len(rows) * len(columns))
            edge = {"edgecolor": shown[0][1], "linewidth": 1.6} if clear else {"edgecolor": "#d0d0d0"}
            ax.add_patch(
                Rectangle((c + 0.01, place + 0.02), 0.98, 0.96, fill=False, zorder=3 if clear else 0, **edge)
            )
            if r == len(rows) - 1:
                _, unit, scale = AXES[columns[c]]
                name = _SHORT.get(columns[c], columns[c]) + ("" if unit == "1" else f" [{unit}]")
                ax.text(c + 0.5, -0.06, name, ha="center", va="top")
                span = f"{scale * low:.3g} to {scale * high:.3g}".replace("-", "−")
                ax.text(c + 0.5, -0.24, span, ha="center", va="top", fontsize="small")
    middles = [[(0.01, k + 0.5), (len(columns) - 0.01, k + 0.5)] for k in range(len(rows))]
    ax.add_collection(LineCollection(middles, color="black", linewidth=0.7, zorder=1))
    ax.set_xlim(0, len(columns))
    ax.set_ylim(0, len(rows))
    ax.set_axis_off()
    return ax


def _cells(fit: Any) -> list[list[tuple[Array, Array, Array]]]:
    places = coordinates(fit)
    return [[binned(x, y, _BINS) for x in places.values()] for y in fit.defect.T]


def beyond_chance(cell: tuple[Array, Array, Array], cells: int) -> bool:
    """Return True if the means of a cell scatter more about zero than chance allows, all cells counted."""
    from udd._util import chi_squared

    _, mean, error = cell
    there = error > 0
    # The errors are those of a dozen stretches or so: a chi2 of normal means would be too sharp by a tenth.
    z2 = float(((mean[there] / error[there]) ** 2).sum()) / 1.1
    return bool(chi_squared.sf(z2, int(there.sum())) < _CHANCE / cells)
