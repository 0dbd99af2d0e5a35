"""The page about a film that the tracker refuses: frames, what looks like a mark in them, and why not."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from udd.errors import UddError

from .document import Column, Figure, Gallery, Head, Paragraph, Report, Section, Table, table
from .images import photograph
from .page import identity, refuse_folder, write_page

if TYPE_CHECKING:
    from udd.tracking.detection.survey import Survey
    from udd.tracking.options import TrackOptions
    from udd.video.reader import Film, Picture

FRAMES = 6  # that are shown
LOOKED = 24  # in which marks are counted
WIDTH = 300  # pixels of each
TRY = (
    "Say where the disk moves with --region u0,v0,u1,v1 if something on the wall has the marks' colours.",
    "Say the marks' colours as they are in these frames: a layout with sRGB codes in a file for --config.",
    "If the marks are there but never all of them, take more light, a plainer wall, or a shorter exposure.",
    "If no frame shows the device, cut the film to the part that does.",
)


def write_refused(
    video: str | os.PathLike[str],
    reason: str,
    path: str | os.PathLike[str],
    *,
    given: Mapping[str, Any],
    command: str | None = None,
) -> bool:
    """Write a page about a film that could not be tracked.

    Parameters
    ----------
    video : path
        The film.
    reason : str
        The tracker's message.
    path : path
        HTML file to write.
    given : mapping
        Options of the tracker, with their names.
    command : str, optional
        By which the film was tracked.

    Returns
    -------
    bool
        False if the film shows nothing to make a page of, or if an option is wrong.
    """
    from udd.tracking.calibration.config import read_options
    from udd.tracking.detection.survey import survey
    from udd.video.reader import Film

    refuse_folder(path)
    try:
        options = read_options(given.get("config"), **{k: v for k, v in given.items() if k != "config"})
        film = Film(video, fps=options.fps)
        look_over = survey(film)
    except UddError:
        return False
    some = [burst[0] for burst in look_over.bursts]
    few = some[:: max(1, -(-len(some) // LOOKED))]
    patches = [_patches(picture, options) for picture in few]
    names = _names(options)
    sections = [
        Section("Why not", (Paragraph(f"{reason}.", "warn"), *(Paragraph(text) for text in TRY))),
        Section(
            "Patches in the colours of the marks",
            (_counted(names, patches), Gallery(_frames(film, few, patches))),
        ),
        Section("The film", (_facts(film, look_over, some),)),
    ]
    head = Head("No motion was measured", "The tracker refuses this film.", numbers=(), notes=())
    write_page(Report(head, tuple(sections), identity(video), command), path)
    return True


def _names(options: TrackOptions) -> list[str]:
    from udd.tracking.detection.colour_blobs import COLOURS

    if options.layout.standard:
        return list(COLOURS)
    return [f"mark {k + 1}, sRGB {rgb}" for k, rgb in enumerate(options.layout.colours)]


def _patches(picture: Picture, options: TrackOptions) -> list[list[tuple[complex, float]]]:
    """Return places and areas [pixels] of what has each mark's colour."""
    from udd.tracking.detection.colour_blobs import coloured
    from udd.tracking.detection.layout_matching import coloured as in_layout

    if options.tags:
        return [[] for _ in options.layout.places]
    inside = options.inside(picture)
    blobs = coloured(inside) if options.layout.standard else in_layout(inside, options.layout)
    return [list(zip(map(complex, b.centre), map(float, b.area), strict=True)) for b in blobs]


def _counted(names: list[str], patches: list[list[list[tuple[complex, float]]]]) -> Table:
    title = "Patches in the marks' colours"
    columns = {
        "name": Column("colour", names=True),
        "frames": Column("in frames", number=True),
        "usual": Column("patches in each", number=True),
        "area": Column("the largest [pixels]", number=True),
    }
    rows = []
    for k, name in enumerate(names):
        seen = [frame[k] for frame in patches if frame[k]]
        largest = [max(area for _, area in each) for each in seen]
        rows.append(
            {
                "name": name,
                "frames": f"{len(seen)} of {len(patches)}",
                "usual": f"{np.median([len(each) for each in seen]):.0f}" if seen else "0",
                "area": f"{np.median(largest):.0f}" if seen else "",
            }
        )
    return table(title, columns, rows)


def _frames(
    film: Film, pictures: list[Picture], patches: list[list[list[tuple[complex, float]]]]
) -> tuple[Figure, ...]:
    """Return frames with a circle about each patch and the number of its colour."""
    import cv2

    from udd.video.rgb_frames import rgb

    out = []
    for k in np.unique(np.linspace(0, len(pictures) - 1, FRAMES).astype(int)):
        image = np.ascontiguousarray(rgb(pictures[k], film.full_range))
        for number, each in enumerate(patches[k], start=1):
            for centre, area in each:
                at = (round(centre.real), round(centre.imag))
                radius = round(1.5 * np.sqrt(area)) + 3
                cv2.circle(image, at, radius, (255, 0, 255), 1, cv2.LINE_AA)
                cv2.putText(
                    image, str(number), (at[0] + radius, at[1]), 0, 0.45, (255, 0, 255), 1, cv2.LINE_AA
                )
        title = f"Frame {pictures[k].index}"
        out.append(Figure(photograph(image, title, WIDTH), f"{title}, {pictures[k].t:.2f} s"))
    return tuple(out)


def _facts(film: Film, look_over: Survey, pictures: list[Picture]) -> Table:
    light = np.median([float(np.median(p.y)) for p in pictures])
    rows = [
        ("size", f"{look_over.width} x {look_over.height} pixels"),
        ("frames", f"{look_over.frames}"),
        ("frames per second, by the header", f"{film.fps:.4g}"),
        ("packets that do not decode", f"{look_over.broken}"),
        ("median brightness", f"{light:.0f} of 255"),
    ]
    columns = {"name": Column("what", names=True), "value": Column("value")}
    return table("The film", columns, [{"name": name, "value": value} for name, value in rows])
