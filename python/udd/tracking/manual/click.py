"""Clicks by hand in a frame of a film: what is known of it, for the tracker to begin with."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from udd.tracking.calibration.config import Config, as_said, settings
from udd.tracking.detection.survey import survey
from udd.tracking.options import positive
from udd.video.reader import Film, TrackError

from .questions import ClickSession, check
from .still_frames import still_frames
from .window import Window

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZE = (10.4, 7.2)  # inches


def click(
    video: str | os.PathLike[str], *, distance: float | None = None, config: Config | None = None
) -> dict[str, Any]:
    """Ask for clicks on a calm frame of a film, and return the options that follow from them.

    Parameters
    ----------
    video : path
        A film as for `udd.track`.
    distance : float, optional
        Between two points that are asked for [m]; it sets the scale. Without, the disk's radius does.
    config : path or mapping, optional
        Options that are given already (as for `udd.track`). They are not asked for, and are part of the
        result.

    Returns
    -------
    dict
        Arguments of `udd.track` by name, for its ``config`` or for `udd.tracking.write_config`: ``pivot``,
        ``region`` [pixels, u right and v down], ``scale`` [pixels per metre], ``layout`` (marks [m], colours
        as sRGB codes; beta is 0 where the first one is above the disk's centre), ``disk_radius`` [m] where
        only the distance tells it, and in ``sigma`` how well each is known. Skipped questions have no entry.

    Raises
    ------
    TrackError
        The person left; no window can be opened here; the film cannot be read; the distance is not a positive
        number, or the scale is known as well; the film is a pendulum's.

    See Also
    --------
    udd.track : takes the options.
    udd.tracking.write_config : writes them to a file.

    Notes
    -----
    A click on a mark is refined to the patch of like colour about it. Everything is a beginning with its
    error, which the tracker improves by what the film shows; where the film does not tell, it stands.

    Examples
    --------
    >>> import udd
    >>> known = udd.tracking.click("run.mp4", distance=0.12)  # doctest: +SKIP
    >>> udd.tracking.write_config("disk.toml", known)  # doctest: +SKIP
    >>> m = udd.track("run.mp4", config=known)  # doctest: +SKIP

    The result of two marks and a contact that were clicked:

    >>> said = {"pivot": [138.2, 166.0], "scale": 877.1}
    >>> said["sigma"] = {"pivot": 3.0, "scale": 9.0, "layout": 0.0012}
    >>> said["layout"] = [{"at": [0.0, 0.0601], "colour": [198, 41, 47]}]
    >>> said["layout"] += [{"at": [0.0497, -0.0351], "colour": [32, 79, 184]}]
    >>> sorted(udd.tracking.calibration.config.settings(said))
    ['layout', 'pivot', 'scale', 'sigma']
    """
    said = dict(as_said({} if config is None else config)[1])
    options = settings({} if config is None else config)
    if distance is not None:
        try:
            distance = positive(distance)
        except (TypeError, ValueError):
            raise TrackError(f"distance must be a positive number of metres, not {distance!r}") from None
    check(options, distance)
    film = Film(video, fps=options.get("fps"))
    figure = _figure()
    try:
        frames = still_frames(survey(film))
        if not frames:
            raise TrackError(f"{film.path}: no frame decodes whole, so there is none to click on")
        clicks = ClickSession(frames[0], film.full_range, said, distance)
        window = Window(figure, frames, clicks)
        _wait(figure, f"{film.path.name}: what is known by hand")
    finally:
        _close(figure)
    if window.left or not clicks.done:
        raise TrackError(f"{film.path}: the window was left before all was answered; nothing is written")
    out = clicks.config()
    settings(out)
    return out


def _figure() -> Figure:
    """Return an empty figure that a person can see and click on.

    Raises
    ------
    TrackError
        There is no screen, or matplotlib has nothing to open a window with.
    """
    import matplotlib.pyplot as plt

    no_window, instead = "no window can be opened to click in", "a config file says the same"
    try:
        figure = plt.figure(figsize=SIZE, num=None)
    except Exception as error:  # each toolkit fails in a way of its own
        why = next(iter(str(error).splitlines()), type(error).__name__)
        raise TrackError(f"{no_window} ({why}); {instead}") from None
    if getattr(type(figure.canvas), "required_interactive_framework", None) is None:
        plt.close(figure)
        why = "matplotlib finds no screen, or no toolkit such as Tk or Qt"
        raise TrackError(f"{no_window} ({why}); {instead}")
    return figure


def _wait(figure: Figure, title: str) -> None:
    """Show the window until it is answered or left."""
    manager = figure.canvas.manager
    if manager is not None:
        manager.set_window_title(title)
        handler = getattr(manager, "key_press_handler_id", None)
        if handler is not None:  # matplotlib's own keys: Backspace and arrows would move the view
            figure.canvas.mpl_disconnect(handler)
    figure.show()
    figure.canvas.start_event_loop()


def _close(figure: Figure) -> None:
    import matplotlib.pyplot as plt

    plt.close(figure)
