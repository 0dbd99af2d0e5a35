"""The demonstration: from the sample film to the report."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path

from udd._util.atomic_files import made_folder
from udd._util.progress import status
from udd.discovery import Discovery, discover
from udd.models import Disk
from udd.tracking import track

#: Known to the user of the device: the speed of the wheels [m/s], and the radius of the disk [m].
W = 0.042
R = 0.08
#: Origin of the film, for the header of the measured table, the page and the report.
ORIGIN = "This film was rendered from a simulated disk, not filmed."


@dataclass(frozen=True)
class Demo:
    """Results of the demonstration."""

    discovery: Discovery
    measurement: Path
    report: Path


def demo(
    out: str | os.PathLike[str],
    *,
    null: bool = False,
    progress: bool | Callable[[str], object] | None = None,
) -> Demo:
    """Track the sample film, find the missing effect, and write the measurement and the report.

    Parameters
    ----------
    out : path
        Folder to write to. It is created if needed.
    null : bool
        If True, use the film of a disk without any effect. Nothing should be found in it.
    progress : bool or callable, optional
        True shows a progress bar, False none; a function gets the state of the work as a text. By default a
        bar shows after 2 s in a terminal or a notebook.

    Returns
    -------
    Demo

    Raises
    ------
    UddError
        The folder cannot be written to.
    """
    folder, name = made_folder(out), "sample_null" if null else "sample"
    stem = "_null" if null else ""
    table, page = folder / f"measurement{stem}.csv", folder / f"report{stem}.html"
    with as_file(files("udd") / "demo" / f"{name}.mp4") as film:
        measurement = track(film, disk_radius=R, progress=progress).with_meta(W=W, origin=ORIGIN)
        measurement.to_csv(table)
        with status(progress) as tell:
            discovery = discover(measurement, Disk(W, R=R), progress=tell)
            tell("writing the page")
        discovery.report(page, film=film, command="udd demo" + (" --null" if null else ""))
    return Demo(discovery, table, page)
