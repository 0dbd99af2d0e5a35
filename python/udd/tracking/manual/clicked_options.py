"""Options of the tracker from clicked points."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from udd.tracking.clicks import Clicks
from udd.tracking.options import FIELDS, TrackOptions
from udd.video.reader import Film, Picture, TrackError

from .questions import ClickSession

MADE = ("pivot", "scale", "layout", "apart", "disk_radius", "calibrate", "sigma")  # by clicks


def with_clicks(film: Film, options: TrackOptions, clicks: Clicks) -> TrackOptions:
    """Return the options with what the clicked points say.

    A person answers the same questions in a window; see `udd.tracking.click`.

    Raises
    ------
    TrackError
        The film has no such frame. A clicked point shows no mark. An option already says what was clicked.
    """
    if options.bob is not None:
        raise TrackError("clicks are for a disk's film: of a pendulum say bob, pivot and length")
    places = {"pivot": [] if clicks.pivot is None else [clicks.pivot], "marks": clicks.marks}
    places |= {"ruler": clicks.points, "rim": clicks.edge}
    session = ClickSession(_frame(film, clicks.frame), film.full_range, _given(options), clicks.distance)
    answered = set()
    while not session.done:
        answered.add(session.question)
        for u, v in places.get(session.question, ()):
            session.press(complex(u, v))
            _check(film, session)
        session.accept()
        _check(film, session)
    left = [name for name, points in places.items() if points and name not in answered]
    if left:
        name = {"ruler": "points", "rim": "edge"}.get(left[0], left[0])
        why = "it needs marks too" if name == "edge" else "an option says the same already"
        raise TrackError(f"{film.path}: clicks: {name} is of no use: {why}")
    made = session.config()
    changes: dict[str, Any] = {name: made[name] for name in MADE if name in made}
    return options.changed({**changes, "clicks": None})


def _frame(film: Film, number: int) -> Picture:
    last = None
    for picture in film.pictures():
        last = picture
        if picture.index == number:
            return picture
    raise TrackError(
        f"{film.path}: clicks: there is no frame {number}; the last is {last.index if last else 'none'}"
    )


def _check(film: Film, session: ClickSession) -> None:
    if session.remark:
        raise TrackError(f"{film.path}: clicks: {session.question}: {session.remark.rstrip('.')}")


def _given(options: TrackOptions) -> dict[str, Any]:
    """Return the options that were given, as a config file says them."""
    out: dict[str, Any] = {
        name: getattr(options, name)
        for name in ("disk_radius", "mark_distance", "pivot", "scale", "region")
        if getattr(options, name) != FIELDS[name].default
    }
    if not options.layout.standard:
        out["layout"] = options.tags or options.layout
    switches = {name: value for name, value in asdict(options.calibrate).items() if value is not True}
    errors = {name: value for name, value in asdict(options.sigma).items() if value}
    return {**out, "calibrate": switches, "sigma": errors}
