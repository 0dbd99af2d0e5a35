"""The window in which a frame is clicked on: what the mouse and the keys do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from udd.video.reader import Picture

from .questions import ClickSession
from .view import ClickView

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Window:
    """Questions about a film's frame in a matplotlib figure.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        An empty one. Its canvas's events are all that this listens to.
    frames : sequence of Picture
        To choose from; `clicks` begins with the first.
    clicks : ClickSession
        The questions.
    """

    def __init__(self, figure: Figure, frames: Sequence[Picture], clicks: ClickSession) -> None:
        self.figure, self.frames, self.clicks = figure, frames, clicks
        self.left = False  # whether the person went away
        self.number = 0  # of the frame
        self.shown = ClickView(figure, clicks)
        listen = figure.canvas.mpl_connect
        listen("button_press_event", self._press)
        listen("button_release_event", self._release)
        listen("motion_notify_event", self._point)
        listen("key_press_event", self._key)
        listen("close_event", self._closed)
        self.shown.frame()
        self._draw()

    def _place(self, event: Any) -> complex | None:
        """Return the place of an event in the frame [pixels]; None outside, and if the toolbar is in use."""
        bar: Any = getattr(self.figure.canvas, "toolbar", None)
        if event.inaxes is not self.shown.axes or (bar is not None and bar.mode):
            return None
        return complex(event.xdata, event.ydata)

    def _press(self, event: Any) -> None:
        at = self._place(event)
        if at is not None and event.button == 1:
            self.clicks.press(at)
            self._draw()

    def _release(self, event: Any) -> None:
        at = self._place(event)
        if at is not None and event.button == 1:
            self.clicks.release(at)
            self._draw()

    def _point(self, event: Any) -> None:
        if event.inaxes is self.shown.axes:
            self.shown.look(complex(event.xdata, event.ydata))

    def _key(self, event: Any) -> None:
        if event.key in ("enter", "return", " ", "space"):
            self.clicks.accept()
        elif event.key == "backspace":
            self.clicks.undo()
        elif event.key == "escape":
            self.left = True
        elif event.key in ("left", "right"):
            self._turn(1 if event.key == "right" else -1)
        if self.left or self.clicks.done:
            self.figure.canvas.stop_event_loop()
        else:
            self._draw()

    def _turn(self, by: int) -> None:
        """To another frame."""
        number = (self.number + by) % len(self.frames)
        if self.clicks.show(self.frames[number]):
            self.number = number
            self.shown.frame()

    def _closed(self, _: Any) -> None:
        self.left = self.left or not self.clicks.done
        self.figure.canvas.stop_event_loop()

    def _draw(self) -> None:
        self.shown.draw(self.number + 1, len(self.frames))
