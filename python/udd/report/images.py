"""Pictures on a page: figures with margins in inches, embedded with what they show in words."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

from udd._util.data_uri import data_uri

from .document import Image

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray


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
    """Make a figure and its Axes by rows, with margins in inches; layout engines need twice the time."""
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
    return Image(data_uri(mime, buffer.getvalue()), alt, round(96 * figure.get_figwidth()))


def photograph(frame: NDArray[np.uint8], alt: str, width: int) -> Image:
    """Show a frame of a film (RGB) so many pixels wide, as a JPEG of at most twice as many."""
    import cv2

    factor = 2 * width / frame.shape[1]
    if factor < 1:
        frame = np.asarray(
            cv2.resize(frame, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA), np.uint8
        )
    _, coded = cv2.imencode(".jpg", frame[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])
    return Image(data_uri("image/jpeg", coded.tobytes()), alt, width)
