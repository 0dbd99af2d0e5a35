"""Sheets to print: the disk with its marks or tags at true scale, a ruler, and the layout for the tracker."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd.errors import UddError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

KINDS = ("marks", "tags")
#: Width and height [mm].
PAPERS = {"A4": (210.0, 297.0), "A3": (297.0, 420.0), "letter": (215.9, 279.4)}
MARGIN = 8.0  # mm that printers leave white
BELOW = 40.0  # mm for the text and the ruler
RULER = 100.0  # mm
SIDE = 0.2  # of the radius: the side of a mark
TAG_REACH, TAG_SIDE = 0.62, 0.3
DICTIONARY = "4x4_50"
LEAST, MOST = 0.02, 0.5  # m: radii
INCH = 25.4  # mm


def write_sheet(
    kind: str, path: str | os.PathLike[str], *, radius: float = 0.08, paper: str = "A4"
) -> tuple[Path, Path]:
    """Write a sheet to print and stick on the disk (PDF), and the tracker's config for it (TOML).

    Parameters
    ----------
    kind : {"marks", "tags"}
        The four colour marks, or four ArUco tags.
    path : path
        File of the PDF. The config has the same name with the ending ``.toml``.
    radius : float, optional
        Radius of the disk [m].
    paper : {"A4", "A3", "letter"}, optional
        Size of the sheet.

    Returns
    -------
    tuple of (Path, Path)
        The PDF and the config.

    Raises
    ------
    UddError
        There is no such kind or paper, the radius is out of range, or the disk does not fit on the paper.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from udd.report.sheet import write_sheet
    >>> pdf, config = write_sheet("tags", pathlib.Path(tempfile.mkdtemp()) / "tags.pdf", radius=0.06)
    >>> pdf.name, config.name
    ('tags.pdf', 'tags.toml')
    """
    from udd._util.atomic_files import require_writable, write_whole
    from udd.tracking import write_config

    _check(kind, radius, paper)
    page = Path(path)
    config = page.with_suffix(".toml")
    for each in (page, config):
        require_writable(each)
    given = sheet_config(kind, radius)
    write_whole(page, _drawn(kind, given, radius, paper))
    write_config(config, given, comment=f"For the disk of {page.name}, printed at 100 %.")
    return page, config


def sheet_config(kind: str, radius: float) -> dict[str, Any]:
    """Return the tracker's options for a disk with the marks of a sheet, radius in m."""
    from udd.tracking.calibration.scale import REACH

    if kind == "marks":
        return {"disk_radius": radius, "mark_distance": round(REACH * radius, 6)}
    reach, side = round(TAG_REACH * radius, 6), round(TAG_SIDE * radius, 6)
    places = [(0.0, reach), (reach, 0.0), (0.0, -reach), (-reach, 0.0)]
    layout = [
        {"tag": f"{DICTIONARY}:{number}", "at": list(at), "side": side} for number, at in enumerate(places)
    ]
    return {"disk_radius": radius, "layout": layout}


def _check(kind: str, radius: float, paper: str) -> None:
    if kind not in KINDS:
        raise UddError(f"a sheet shows {' or '.join(KINDS)}, not {kind!r}")
    if paper not in PAPERS:
        raise UddError(f"paper must be one of {', '.join(PAPERS)}, not {paper!r}")
    if not (math.isfinite(radius) and LEAST <= radius <= MOST):
        raise UddError(f"radius must be from {LEAST:g} to {MOST:g} m, got {radius!r}: is it in m?")
    room = _largest(paper)
    if 1e3 * radius > room:
        larger = [other for other in PAPERS if 1e3 * radius <= _largest(other)]
        hint = f"say paper={larger[0]!r}" if larger else "print it in parts"
        raise UddError(f"a disk of radius {1e3 * radius:g} mm does not fit on {paper} ({room:g} mm): {hint}")


def _largest(paper: str) -> float:
    """Return the largest radius of a disk that fits on a paper [mm]."""
    width, height = PAPERS[paper]
    return min(width - 2 * MARGIN, height - BELOW - 2 * MARGIN) / 2


def _drawn(kind: str, given: Mapping[str, Any], radius: float, paper: str) -> bytes:
    """Return the PDF: a figure as large as the paper, one unit of its axes being a millimetre."""
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle

    width, height = PAPERS[paper]
    figure = Figure(figsize=(width / INCH, height / INCH))
    FigureCanvasPdf(figure)
    ax = figure.add_axes((0, 0, 1, 1), xlim=(0, width), ylim=(0, height))
    ax.set_axis_off()
    mm, middle = 1e3 * radius, (width / 2, BELOW + (height - BELOW) / 2)
    ax.add_patch(Circle(middle, mm, fill=False, linewidth=0.3, color="0.4"))
    for dx, dy in ((2.0, 0.0), (0.0, 2.0)):
        ax.plot(
            [middle[0] - dx, middle[0] + dx], [middle[1] - dy, middle[1] + dy], color="0.4", linewidth=0.3
        )
    if kind == "marks":
        _marks(ax, middle, mm)
    else:
        _tags(ax, middle, given["layout"])
    _ruler(ax, width)
    what = (
        "red, orange, blue, green clockwise" if kind == "marks" else f"ArUco {DICTIONARY}, 0 to 3 clockwise"
    )
    ax.text(
        width / 2, BELOW - 8, f"Disk of radius {mm:g} mm: {what}; beta = 0 with the first one up. "
        "Print at 100 %, not “fit to page”.", ha="center", va="center", fontsize=8,
    )  # fmt: skip
    room = BytesIO()
    figure.savefig(room, format="pdf", metadata={"CreationDate": None, "Title": f"udd sheet {kind}"})
    return room.getvalue()


def _marks(ax: Axes, middle: tuple[float, float], radius: float) -> None:
    from matplotlib.patches import Rectangle

    from udd.markers.layout import STANDARD
    from udd.tracking.calibration.scale import REACH

    half = SIDE * radius / 2
    for place, codes in zip(STANDARD.places, STANDARD.colours, strict=True):  # down in a picture is positive
        at = REACH * radius * place
        corner = (middle[0] + at.real - half, middle[1] - at.imag - half)
        colour = tuple(code / 255 for code in codes)
        ax.add_patch(Rectangle(corner, 2 * half, 2 * half, facecolor=colour, edgecolor="none"))


def _tags(ax: Axes, middle: tuple[float, float], layout: list[dict[str, Any]]) -> None:
    from matplotlib.patches import Rectangle

    from udd.markers.tags import cells_of, read_tags

    for tag in read_tags(layout):
        cells = cells_of(tag)
        cell = 1e3 * tag.side / len(cells)
        left, top = (
            middle[0] + 1e3 * (tag.at.real - tag.side / 2),
            middle[1] - 1e3 * (tag.at.imag - tag.side / 2),
        )
        for row, column in zip(*(cells == 0).nonzero(), strict=True):
            corner = (left + column * cell, top - (row + 1) * cell)
            ax.add_patch(Rectangle(corner, cell, cell, facecolor="black", edgecolor="black", linewidth=0.01))


def _ruler(ax: Axes, width: float) -> None:
    left, low = (width - RULER) / 2, MARGIN + 6
    ax.plot([left, left + RULER], [low, low], color="black", linewidth=0.4)
    for k in range(round(RULER) + 1):
        tick = 4.0 if k % 10 == 0 else 2.5 if k % 5 == 0 else 1.5
        ax.plot([left + k, left + k], [low, low + tick], color="black", linewidth=0.2)
    ax.text(width / 2, low - 3, f"{RULER:.0f} mm: measure it", ha="center", va="center", fontsize=7)
