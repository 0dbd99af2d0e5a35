"""The page of a film that the tracker refuses, for all commands that take a film."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from udd.errors import UddError


def explain(
    film: Path,
    error: UddError,
    page: Path,
    given: Mapping[str, Any],
    commands: tuple[str, str],
    then: str = "",
) -> Path | None:
    """Write the page about a film that the tracker refuses.

    Parameters
    ----------
    film : Path
        The film.
    error : UddError
        The tracker's reason.
    page : Path
        HTML file to write.
    given : mapping
        Options of the tracker.
    commands : (str, str)
        The command that was given, and the one that tracks the film with clicks.
    then : str
        What to do with the table that the second command writes.
    """
    from udd.report.refused_film import write_refused
    from udd.video.reader import TrackError

    if not isinstance(error, TrackError):  # such as a file that is cut off
        return None
    if not write_refused(film, str(error), page, given=given, commands=commands):
        return None
    print(
        f"udd: written: {page}; open it to see the frames and to click what you know{then}", file=sys.stderr
    )
    return page


@contextmanager
def explained(film: Path, given: Mapping[str, Any], command: str) -> Iterator[None]:
    """Write the page next to the work of a command that tracks a film on its way, if the film is refused."""
    import shlex

    table = f"{film.stem}.csv"
    words = ["udd", "track", str(film), "--out", table]
    for name, value in given.items():
        words += [f"--{name.replace('_', '-')}", f"{value:g}"]
    try:
        yield
    except UddError as error:
        page = Path(f"{film.stem}-refused.html")
        then = f"; the command on the page makes {table}, which takes the place of the film"
        explain(film, error, page, given, (command, shlex.join(words)), then)
        raise
