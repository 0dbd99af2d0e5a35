"""Figures with lettered panels side by side, and a note on the source of the data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FILMED = "measured: a film made by udd.render, tracked by udd.track"


def panels(
    rows: int, columns: int, width: float, height: float, *, note: str = "", projection: str | None = None
) -> tuple[Figure, list[Any]]:
    """Make a figure and its Axes, row by row; sizes in inches."""
    from matplotlib.figure import Figure as New

    made = New(figsize=(width, height), layout="constrained")
    grid: Any = made.subplots(rows, columns, squeeze=False, subplot_kw={"projection": projection})
    if note:
        made.suptitle(note, fontsize="small", color="#666666")
    return made, list(np.ravel(grid))


def titled(ax: Axes, number: int, words: str) -> None:
    """Set the panel's title: its letter and its content."""
    ax.set_title(f"({'abcdefgh'[number]}) {words}", loc="left", fontsize="medium")
