"""The page about a tracked film."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from udd.measurement import Measurement

    from .tracking_result import Tracking


def page(
    video: str | os.PathLike[str],
    found: Measurement | Tracking,
    path: str | os.PathLike[str],
    *,
    command: str | None = None,
) -> None:
    """Write a page about a tracked film: its motion, its camera with uncertainties, and how each frame did.

    Parameters
    ----------
    video : path
        The film that was tracked.
    found : Measurement or Tracking
        Result of the tracker. With a `Tracking` the page also shows the errors of the marks in each part of
        the picture.
    path : path
        HTML file to write. An older one is replaced when the new one is complete.
    command : str, optional
        Command that made the measurement, for display.

    Raises
    ------
    UddError
        The page cannot be written there, or the measurement does not come from a film.

    See Also
    --------
    udd.track : makes the measurement.
    udd.tracking.overlay : the film with the fitted disk.
    udd.plot.overlay : draw a single frame.

    Examples
    --------
    >>> import udd
    >>> m = udd.track("run.mp4")  # doctest: +SKIP
    >>> udd.tracking.page("run.mp4", m, "run.html")  # doctest: +SKIP
    """
    from udd.report.tracking import write_tracked

    write_tracked(video, found, path, command=command)
