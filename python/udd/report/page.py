"""The page, from the parts."""

from __future__ import annotations

import csv
import hashlib
import io
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from udd._util.atomic_files import write_whole
from udd._util.data_uri import data_uri
from udd._util.html_templates import templates
from udd._util.versions import version_of, versions
from udd.errors import UddError
from udd.fitting.innovations import innovations

from . import discovery_report, formula_report, wording
from .document import Head, Report, Section, plain

if TYPE_CHECKING:
    from udd.discovery.results import Discovery


#: Terms of the page, for its fold "How to read this page".
GUIDE = (
    ("Known model", "The equations that were given, fitted to the same data, before anything was added."),
    (
        "Held-out error",
        "The error of a model that runs freely for a time, on data that no fit used.",
    ),
    ("Noise floor", "The error of a faultless model, due to noise in the data and in its starting state."),
    ("95 % interval", "The true value lies in it in 19 of 20 such cases."),
    ("5.03(12)", "A value with the standard error of its last digits: 5.03 ± 0.12."),
    (
        "Decrease in χ²",
        "The misfit in units of the noise, without the effect minus with it. Chance reaches the dashed line "
        "once in a thousand searches.",
    ),
    (
        "Consistent, constraint",
        "How an effect enters: with the torque that goes with it, or as a change of the rolling alone.",
    ),
    ("Residual", "The departure of the motion from an equation: noise about zero if the model is right."),
)


def report_of(
    discovery: Discovery,
    *,
    film: str | os.PathLike[str] | None = None,
    source: str | os.PathLike[str] | None = None,
    command: str | None = None,
) -> Report:
    """Build the report of a discovery: sections of text, figures and tables.

    Parameters
    ----------
    discovery : Discovery
    film : path, optional
        The film in which the measurement was tracked; a stretch of it is shown next to the models.
    source : path, optional
        The file that the analysis began with, named with its SHA-256; by default the film.
    command : str, optional
        The command that makes the report again; by default that of `udd discover` with its usual options.

    Raises
    ------
    UddError
        The film is not the one that was tracked.
    """
    origin = film if source is None else source
    of_own = discovery.fit.model.profile.written
    if of_own and film is not None:
        raise UddError("a film shows a disk, not a model of your own")
    fits = [discovery.baseline, *([discovery.fit] if discovery.effects else [])]
    surprises = [innovations(fit) for fit in fits]
    with ThreadPoolExecutor(1) as background:  # the core computes hints while Python draws
        background.submit(lambda: discovery.hints)
        if of_own:
            sections = formula_report.sections(discovery, surprises)
        else:
            sections = discovery_report.sections(discovery, film, surprises)
    usual = wording.command(discovery, None if origin is None else Path(origin).name)
    return Report(_head(discovery), sections, identity(origin), command or usual)


def summary_of(discovery: Discovery) -> Report:
    """Build a report without pictures: the verdict, the reasons, near misses and alternatives."""
    tried = (*discovery_report.nearest(discovery), *discovery_report.reasons(discovery))
    of_own = discovery.fit.model.profile.written
    others = formula_report.others(discovery) if of_own else discovery_report.others(discovery)
    sections = [Section(discovery_report.tried_heading(discovery), tried)] if tried else []
    return Report(_head(discovery), (*sections, *([others] if discovery.alternatives else [])))


def _head(discovery: Discovery) -> Head:
    if discovery.fit.model.profile.written:
        return formula_report.formula_head(discovery)
    return discovery_report.disk_head(discovery)


def write(
    discovery: Discovery,
    path: str | os.PathLike[str],
    *,
    film: str | os.PathLike[str] | None = None,
    source: str | os.PathLike[str] | None = None,
    command: str | None = None,
) -> Report:
    """Write a discovery as one self-contained HTML page, without scripts or external links.

    Parameters
    ----------
    discovery : Discovery
    path : path
        File of the page. An older one is replaced when the new one is complete.
    film, source, command
        As for :func:`report_of`.

    Returns
    -------
    Report
        The content of the page.

    Raises
    ------
    UddError
        The page cannot be written there, or the film is not the one that was tracked.
    """
    refuse_folder(path)
    report = report_of(discovery, film=film, source=source, command=command)
    write_page(report, path)
    return replace(report, path=Path(path))


def refuse_folder(path: str | os.PathLike[str]) -> None:
    """Refuse to write a page where a folder stands, before the work."""
    if Path(path).is_dir():
        raise UddError(f"{Path(path)} is a folder, not a page to write to")


def write_page(
    report: Report, path: str | os.PathLike[str], guide: tuple[tuple[str, str], ...] = GUIDE
) -> None:
    """Write a report as one HTML page; `guide` explains its terms."""
    page = templates("udd.report").get_template("report.html")
    html = page.render(
        head=report.head,
        guide=guide,
        data=_data(report),
        sections=report.sections,
        source=report.source,
        command=report.command,
        version=version_of("udd"),
        versions=versions("udd", "numpy", "scipy"),
    )
    write_whole(Path(path), html.encode())


def _data(report: Report) -> list[tuple[str, str]]:
    """Return the tables of a report as titles and data URIs."""
    made = []
    for part in report.tables:
        text = io.StringIO()
        csv.writer(text).writerows(part.plain())
        made.append((plain(part.title), data_uri("text/csv;charset=utf-8", text.getvalue().encode())))
    return made


def identity(path: str | os.PathLike[str] | None) -> tuple[str, str] | None:
    """Return a file's name and SHA-256."""
    if path is None or Path(path).is_dir():  # of pictures
        return None
    try:
        with Path(path).open("rb") as file:
            return Path(path).name, hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise UddError(f"{path} cannot be read: {error.strerror}") from None
