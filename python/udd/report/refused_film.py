"""The page about a film that the tracker refuses: frames, what looks like a mark in them, and why not."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from udd.errors import UddError

from .document import Clickable, Column, Figure, Gallery, Head, Paragraph, Report, Section, Table, table
from .images import photograph
from .page import identity, refuse_folder, write_page

if TYPE_CHECKING:
    from udd.tracking.detection.survey import Survey
    from udd.tracking.options import TrackOptions
    from udd.video.reader import Film, Picture

FRAMES = 6  # that are shown
LOOKED = 24  # in which marks are counted
WIDTH = 300  # pixels of each
CLICKED = 480  # pixels of the width of the frames to click on; the picture has twice as many
TRY = (
    "Click below what you know of the film, and track it again with the command that is shown then.",
    "If something on the wall has the marks' colours, click the region in which the disk moves.",
    "If your disk has other marks, click them and the disk's edge. Printed tags need a layout (--config).",
    "If the marks are there but never all of them, take more light, a plainer wall, or a shorter exposure.",
    "If no frame shows the device, cut the film to the part that does.",
)
TRY_BOB = (
    "Click below what you know of the film, and track it again with the command that is shown then.",
    "The bob may have another colour in this light: click it.",
    "If something else of the bob's colour moves, click the region in which the bob moves.",
    "If the bob does not swing from a fixed pivot, the film shows no pendulum, and udd cannot track it.",
)
TRY_TAGS = (
    "Click below what you know of the film, and track it again with the command that is shown then.",
    "Each tag needs its white margin, and must be sharp: take more light or a shorter exposure.",
    "Compare the layout with the disk: the dictionary and the number of each tag, and its place and side.",
)
DISK_TOOLS = ("pivot", "points", "marks", "edge", "region")
TAG_TOOLS = ("pivot", "points", "region")
BOB_TOOLS = ("bob", "pivot", "region")


@dataclass(frozen=True)
class RefusedFilm:
    """A film that the tracker refused, the options, and pictures of it."""

    film: Film
    options: TrackOptions
    look_over: Survey
    patches: list[list[list[tuple[complex, float]]]]  # of `pictures`, by colour: places and areas [pixels]
    pictures: list[Picture]


def look(video: str | os.PathLike[str], given: Mapping[str, Any]) -> RefusedFilm | None:
    """Look at a film that was refused; None if it shows nothing, or if an option is wrong.

    Parameters
    ----------
    video : path
        The film.
    given : mapping
        Options of the tracker, with their names.
    """
    from udd.tracking.calibration.config import read_options
    from udd.tracking.detection.survey import survey
    from udd.video.reader import Film

    try:
        options = read_options(given.get("config"), **{k: v for k, v in given.items() if k != "config"})
        film = Film(video, fps=options.fps)
        film.left_out = options.leave_out
        look_over = survey(film)
        some = [burst[0] for burst in look_over.bursts]
        few = some[:: max(1, -(-len(some) // LOOKED))]
        return RefusedFilm(film, options, look_over, [_patches(picture, options) for picture in few], few)
    except UddError:
        return None


def write_refused(
    video: str | os.PathLike[str],
    reason: str,
    path: str | os.PathLike[str],
    *,
    given: Mapping[str, Any],
    commands: tuple[str, str] | None = None,
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
    commands : (str, str), optional
        The command by which the film was tracked, and the part of it that clicks do not change.

    Returns
    -------
    bool
        False if the film shows nothing to make a page of, or if an option is wrong.
    """
    refuse_folder(path)
    refused = look(video, given)
    if refused is None:
        return False
    before, command = commands or (None, shlex.join(["udd", "track", str(video)]))
    data = {**click_data(refused), "command": command}
    safe = json.dumps(data).replace("<", "\\u003c")  # a film's name may hold an HTML tag
    options = refused.options
    advice = TRY_TAGS if options.tags else TRY if options.bob is None else TRY_BOB
    sections = [
        Section("Why not", (Paragraph(f"{reason}.", "warn"), *(Paragraph(text) for text in advice))),
        Section("Click what you know", (Clickable(Markup(safe)),)),
    ]
    if not options.tags:
        shown = (_counted(refused), Gallery(_frames(refused)))
        sections.append(Section("Patches in the colours of the marks", shown))
    sections.append(Section("The film", (_facts(refused),)))
    head = Head("No motion was measured", "The tracker refuses this film.", numbers=(), notes=())
    write_page(Report(head, tuple(sections), identity(video), before), path, guide=())
    return True


def click_data(refused: RefusedFilm) -> dict[str, Any]:
    """Return frames to click on and earlier clicks, as JSON for ``clicks.js``."""
    from udd.tracking.manual.still_frames import still_frames
    from udd.video.rgb_frames import rgb

    film, options = refused.film, refused.options
    calm = still_frames(refused.look_over)
    first = calm[0].index
    calm.sort(key=lambda picture: (picture.index - first) % refused.look_over.frames)  # from the calmest on
    return {
        "size": [refused.look_over.width, refused.look_over.height],
        "bobs": 0 if options.bob is None else len(options.layout.places),
        "tools": TAG_TOOLS if options.tags else DISK_TOOLS if options.bob is None else BOB_TOOLS,
        "frames": [
            {
                "index": picture.index,
                "t": picture.t,
                "uri": photograph(rgb(picture, film.full_range), "", CLICKED).uri,
            }
            for picture in calm
        ],
        "start": _start(options),
    }


def _start(options: TrackOptions) -> dict[str, Any]:
    """Return the clicks and the values that the film was tracked with, for ``clicks.js``."""
    clicks, start = options.clicks, {}
    if clicks is not None:
        start = {"frame": clicks.frame, "points": clicks.points, "marks": clicks.marks, "edge": clicks.edge}
        start |= {} if clicks.pivot is None else {"pivot": [clicks.pivot]}
        start |= {} if clicks.distance is None else {"distance": f"{clicks.distance:g}"}
    if options.pivot is not None:
        start["pivot"] = [options.pivot]
    if options.region is not None:
        start["region"] = [options.region[:2], options.region[2:]]
    if options.fps is not None:
        rates = options.fps if isinstance(options.fps, tuple | list) else [(0, options.fps)]
        start["fps"] = ",".join(f"{first}:{rate:g}" if first else f"{rate:g}" for first, rate in rates)
    start["leave_out"] = ",".join(f"{a}-{b}" if b > a else f"{a}" for a, b in options.leave_out)
    return start


def _names(options: TrackOptions) -> list[str]:
    from udd.tracking.detection.colour_blobs import COLOURS

    if options.layout.standard:
        return list(COLOURS)
    what = "mark" if options.bob is None else "bob"
    return [f"{what} {k + 1}, sRGB {rgb}" for k, rgb in enumerate(options.layout.colours)]


def _patches(picture: Picture, options: TrackOptions) -> list[list[tuple[complex, float]]]:
    """Return places and areas [pixels] of what has each mark's colour."""
    from udd.tracking.detection.colour_blobs import coloured
    from udd.tracking.detection.layout_matching import coloured as in_layout

    if options.tags:
        return [[] for _ in options.layout.places]
    inside = options.inside(picture)
    blobs = coloured(inside) if options.layout.standard else in_layout(inside, options.layout)
    return [list(zip(map(complex, b.centre), map(float, b.area), strict=True)) for b in blobs]


def _counted(refused: RefusedFilm) -> Table:
    patches = refused.patches
    columns = {
        "name": Column("colour", names=True),
        "frames": Column("in frames", number=True),
        "usual": Column("patches in each", number=True),
        "area": Column("the largest [pixels]", number=True),
    }
    rows = []
    for k, name in enumerate(_names(refused.options)):
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
    return table("Patches in the marks' colours", columns, rows)


def _frames(refused: RefusedFilm) -> tuple[Figure, ...]:
    """Return frames with a circle about each patch and the number of its colour."""
    import cv2

    from udd.video.rgb_frames import rgb

    out = []
    pictures = refused.pictures
    for k in np.unique(np.linspace(0, len(pictures) - 1, FRAMES).astype(int)):
        image = np.ascontiguousarray(rgb(pictures[k], refused.film.full_range))
        fine = max(1.0, image.shape[1] / (2 * WIDTH))  # of the film to a pixel of the picture on the page
        for number, each in enumerate(refused.patches[k], start=1):
            for centre, area in each:
                at = (round(centre.real), round(centre.imag))
                radius, pen = round(1.5 * np.sqrt(area) + 3 * fine), round(fine)
                cv2.circle(image, at, radius, (255, 0, 255), pen, cv2.LINE_AA)
                place, colour = (at[0] + radius, at[1]), (255, 0, 255)
                cv2.putText(image, str(number), place, 0, 0.45 * fine, colour, pen, cv2.LINE_AA)
        title = f"Frame {pictures[k].index}"
        out.append(Figure(photograph(image, title, WIDTH), f"{title}, {pictures[k].t:.2f} s"))
    return tuple(out)


def _facts(refused: RefusedFilm) -> Table:
    look_over, film = refused.look_over, refused.film
    light = np.median([float(np.median(p.y)) for p in refused.pictures])
    rows = [
        ("size", f"{look_over.width} x {look_over.height} pixels"),
        ("frames", f"{look_over.frames}"),
        ("frames per second", f"{film.fps:.4g}{' (given)' if film.forced else ', by the header'}"),
        ("packets that do not decode", f"{look_over.broken}"),
        ("median brightness", f"{light:.0f} of 255"),
    ]
    columns = {"name": Column("what", names=True), "value": Column("value")}
    return table("The film", columns, [{"name": name, "value": value} for name, value in rows])
