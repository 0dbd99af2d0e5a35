"""A frame that is clicked on, as it is drawn: the question, what is clicked, a loupe and a list of it."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from udd.tracking.overlay import CONTACT, FITTED, SAID
from udd.video.rgb_frames import rgb

from .questions import ClickSession

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

LOUPE = 20  # pixels each side of the pointer that the loupe shows
WIDE, NARROW = 92, 112  # letters of a line, large and small
LINE = 0.06  # of the list's height
KEYS = "Enter or Space: go on     Backspace: take back     Esc: leave, nothing is written"
OTHER = "     ← →: another frame"


class ClickView:
    """Draws the state of `Clicks` into an empty matplotlib figure."""

    def __init__(self, figure: Figure, clicks: ClickSession) -> None:
        self.figure, self.clicks = figure, clicks
        self.drawn: list[Artist] = []
        height, width = clicks.picture.y.shape
        grid = figure.add_gridspec(
            2, 2, left=0.02, right=0.98, bottom=0.07, top=0.86, width_ratios=(2.4, 1), height_ratios=(1, 1.6)
        )
        self.axes = figure.add_subplot(grid[:, 0], label="frame")
        self.loupe = figure.add_subplot(grid[0, 1], label="loupe")
        self.list = figure.add_subplot(grid[1, 1], label="list")
        blank = np.zeros((height, width, 3), np.uint8)
        self.images = [axes.imshow(blank, interpolation="nearest") for axes in (self.axes, self.loupe)]
        for axes in (self.axes, self.loupe):
            axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xticks=[], yticks=[])
        self.list.axis("off")
        self.across = self.loupe.axhline(0.0, color=_of(SAID), lw=0.6)
        self.upright = self.loupe.axvline(0.0, color=_of(SAID), lw=0.6)
        at: dict[str, Any] = {"ha": "left", "va": "top", "transform": figure.transFigure}
        self.asked = figure.text(0.02, 0.985, "", fontsize=12, weight="bold", **at)
        self.remark_text = figure.text(0.02, 0.915, "", fontsize=10, **at)
        self.keys = figure.text(0.02, 0.045, "", fontsize=9, color="0.35", **at)
        self.look(complex(width / 2, height / 2))

    def look(self, at: complex) -> None:
        """Point the loupe at a place [pixels]."""
        self.loupe.set(xlim=(at.real - LOUPE, at.real + LOUPE), ylim=(at.imag + LOUPE, at.imag - LOUPE))
        self.across.set_ydata([at.imag, at.imag])
        self.upright.set_xdata([at.real, at.real])
        self.figure.canvas.draw_idle()

    def frame(self) -> None:
        """Show the picture itself, which may be another one."""
        picture = rgb(self.clicks.picture, self.clicks.full_range)
        for image in self.images:
            image.set_data(picture)

    def draw(self, number: int, frames: int) -> None:
        """Show what is asked now and all that is clicked, in frame `number` of so many."""
        for artist in self.drawn:
            artist.remove()
        self.drawn = []
        clicks = self.clicks
        self.asked.set_text(fill(clicks.sentence, WIDE))
        self.remark_text.set_text(fill(clicks.remark or clicks.hint, NARROW))
        self.remark_text.set_color("tab:red" if clicks.remark else "0.2")
        keys = KEYS + (OTHER if frames > 1 else "")
        self.keys.set_text(f"{keys}     (frame at {clicks.picture.t:.2f} s, {number} of {frames})")
        said = [*self._pivot(), *self._marks(), *self._ruler(), *self._rim(), *self._region()]
        style: dict[str, Any] = {"fontsize": 9, "va": "top", "transform": self.list.transAxes}
        if said:
            said = [("clicked", "u, v in pixels"), *said]
        for row, (name, value) in enumerate(said):
            for x, text, colour in ((0.0, name, "0.35"), (0.27, value, "0.1")):
                self.drawn.append(self.list.text(x, 0.98 - LINE * row, text, color=colour, **style))
        self.figure.canvas.draw_idle()

    def _pivot(self) -> list[tuple[str, str]]:
        at = self.clicks.answers.pivot
        if at is None:
            return []
        self._points([at], "+", CONTACT)
        return [("pivot", _pixels(at))]

    def _marks(self) -> list[tuple[str, str]]:
        said = []
        for number, mark in enumerate(self.clicks.answers.marks, start=1):
            if len(mark.outline):
                self._line([*mark.outline, mark.outline[0]], FITTED)
            self._points([mark.centre], "x", FITTED)
            style: dict[str, Any] = {"color": "white", "weight": "bold", "fontsize": 9, "clip_on": True}
            style["bbox"] = {"fc": "black", "ec": "none", "alpha": 0.6, "pad": 1}
            place = (mark.centre.real, mark.centre.imag)
            self.drawn.append(
                self.axes.annotate(str(number), place, (6, 6), textcoords="offset points", **style)
            )
            said.append(
                (f"mark {number}", f"{_pixels(mark.centre)}{'' if mark.refined else ' (as clicked)'}")
            )
        return said

    def _ruler(self) -> list[tuple[str, str]]:
        ends = self.clicks.answers.ruler
        if not ends:
            return []
        self._points(ends, "o", SAID)
        self._line(ends, SAID)
        marks = self.clicks.ends
        said = " to ".join(_pixels(z) for z in ends) if marks is None else "mark {} to mark {}".format(*marks)
        return [(f"{self.clicks.distance:g} m", said)]

    def _rim(self) -> list[tuple[str, str]]:
        points, edge = self.clicks.answers.rim, self.clicks.edge
        if not points:
            return []
        self._points(points, ".", FITTED)
        if edge is None:
            return (
                [("centre", _pixels(points[0]))] if len(points) == 1 else [("edge", f"{len(points)} points")]
            )
        self._line(edge.centre + edge.radius * np.exp(2j * np.pi * np.arange(129) / 128), FITTED)
        self._points([edge.centre], "+", FITTED)
        return [("centre", _pixels(edge.centre)), ("radius", f"{edge.radius:.1f}")]

    def _region(self) -> list[tuple[str, str]]:
        corners = self.clicks.answers.region
        if not corners:
            return []
        self._points(corners, "s", SAID)
        if len(corners) == 2:
            p, q = corners
            self._line([p, complex(q.real, p.imag), q, complex(p.real, q.imag), p], SAID)
        return [("region", " to ".join(_pixels(z) for z in corners))]

    def _points(self, places: Sequence[complex], marker: str, colour: tuple[int, int, int]) -> None:
        z = np.array(places)
        style: dict[str, Any] = {"ls": "", "marker": marker, "fillstyle": "none", "scalex": False}
        for axes, size in ((self.axes, 9), (self.loupe, 16)):
            for width, paint in ((2.6, "black"), (1.2, _of(colour))):
                self.drawn += axes.plot(z.real, z.imag, ms=size, mec=paint, mew=width, scaley=False, **style)

    def _line(self, places: Any, colour: tuple[int, int, int]) -> None:
        z = np.array(places)
        for axes in (self.axes, self.loupe):
            for width, paint in ((2.2, "black"), (1.0, _of(colour))):
                self.drawn += axes.plot(z.real, z.imag, color=paint, lw=width, scalex=False, scaley=False)


def _of(colour: tuple[int, int, int]) -> tuple[float, float, float]:
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


def _pixels(z: complex) -> str:
    return f"{z.real:.1f}, {z.imag:.1f}"
