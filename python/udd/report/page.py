"""The page, from the parts."""

from __future__ import annotations

import hashlib
import os
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd._util.atomic_files import write_whole
from udd._util.html_templates import templates
from udd.errors import UddError
from udd.fitting.innovations import innovations

from . import figures, formula_model, tables, wording

if TYPE_CHECKING:
    from jinja2 import Template


def write(
    discovery: Any,
    path: str | os.PathLike[str],
    *,
    film: str | os.PathLike[str] | None = None,
    source: str | os.PathLike[str] | None = None,
    command: str | None = None,
) -> None:
    """Write a discovery as one HTML page that stands alone: pictures first, no script, no links.

    Parameters
    ----------
    discovery : Discovery
    path : path
        Of the page; an older one is replaced once the new one is complete.
    film : path, optional
        The film that the measurement was tracked in; a stretch of it is shown beside the models.
    source : path, optional
        The file that the analysis began with, named on the page with its SHA-256; by default the film.
    command : str, optional
        How the page was made, for those who want to make it again; by default what `udd discover` takes for
        the same analysis with its usual options.

    Raises
    ------
    UddError
        The page cannot be written there, or the film is not the one that was tracked.
    """
    target = Path(path)
    if target.is_dir():
        raise UddError(f"{target} is a folder, not a page to write to")
    origin = film if source is None else source
    of_own = discovery.fit.model.profile.written
    if of_own and film is not None:
        raise UddError("a film shows a disk, not a model of your own")
    fits = [discovery.baseline, *([discovery.fit] if discovery.effects else [])]
    surprises = [innovations(fit) for fit in fits]
    with ThreadPoolExecutor(1) as beside:  # what to film next is for the core, pictures are Python's
        beside.submit(lambda: discovery.hints)
        pictures = (
            formula_model.draw(discovery, surprises) if of_own else figures.draw(discovery, film, surprises)
        )
    page = template("own.html" if of_own else "page.html").render(
        d=discovery,
        words=wording,
        tables=tables,
        own=formula_model,
        pictures=pictures,
        innovations=surprises,
        numbers=wording.headline(discovery),
        command=command or wording.command(discovery, None if origin is None else Path(origin).name),
        version=version_of("udd"),
        versions=versions()[1],
        source=identity(origin),
    )
    write_whole(target, page.encode())


def template(name: str) -> Template:
    """One of the report's templates, which share their pieces and the words of these."""
    environment = templates("udd.report")
    environment.filters["pretty"] = wording.pretty
    return environment.get_template(name)


def identity(path: str | os.PathLike[str] | None) -> tuple[str, str] | None:
    """A file's name and SHA-256."""
    if path is None:
        return None
    try:
        with Path(path).open("rb") as file:
            return Path(path).name, hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise UddError(f"{path} cannot be read: {error.strerror}") from None


def version_of(name: str) -> str:
    """A package's version."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "(of unknown version)"


def versions() -> tuple[str, str]:
    """The version of udd, and in words all that the numbers may depend on."""
    import platform

    packages = ", ".join(f"{name} {version_of(name)}" for name in ("udd", "numpy", "scipy"))
    return version_of(
        "udd"
    ), f"{packages}, Python {platform.python_version()} on {platform.system()} {platform.machine()}"
