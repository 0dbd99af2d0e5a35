"""Pictures on a page: figures with margins in inches, embedded with what they show in words."""

from __future__ import annotations

import base64
import io
from typing import TYPE_CHECKING

from .document import Image

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def blank(
    width: float,
    height: float,
    *,
    rows: int = 1,
    columns: int = 1,
    left: float = 0.85,
    bottom: float = 0.6,
    top: float = 0.3,
    between: float = 0.25,
    shared: bool = False,
) -> tuple[Figure, list[list[Axes]]]:
    """A figure and its Axes, row by row, with margins in inches: a layout engine takes half of the time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    grid = figure.subplots(rows, columns, squeeze=False, sharex=shared or "col", sharey=shared or "row")
    figure.subplots_adjust(
        left=left / width,
        right=1 - 0.1 / width,
        bottom=bottom / height,
        top=1 - top / height,
        wspace=between * columns / max(width - left, 1.0),
        hspace=between * rows / max(height - bottom, 1.0),
    )
    return figure, grid.tolist()


def svg(figure: Figure, alt: str) -> Image:
    """Save a figure of lines."""
    return embedded(figure, "svg", alt, dpi=150)


def png(figure: Figure, alt: str) -> Image:
    """Save a figure of thousands of dots."""
    return embedded(figure, "png", alt, dpi=170)


def embedded(figure: Figure, kind: str, alt: str, dpi: int) -> Image:
    """Save a figure in any format of matplotlib, as a data URI."""
    import matplotlib as mpl

    buffer = io.BytesIO()
    metadata = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}.get(kind)
    # Without the salt, and with the date, the same result would give another file every time.
    with mpl.rc_context({"svg.hashsalt": "udd"}):
        figure.savefig(buffer, format=kind, dpi=dpi, metadata=metadata)
    mime = "image/svg+xml" if kind == "svg" else f"image/{kind}"
    uri = f"data:{mime};base64,{base64.b64encode(buffer.getvalue()).decode()}"
    return Image(uri, alt, round(96 * figure.get_figwidth()))
