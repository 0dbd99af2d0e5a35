"""Faults of a picture: axes that are squeezed, text over text."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.text import Text

HALF = 0.5


def share_of_axes(figure: Figure) -> float:
    """The part of the figure that its axes fill; of axes with equal scales their box counts."""
    figure.canvas.draw()
    whole = figure.bbox.width * figure.bbox.height
    boxes = [ax.get_window_extent() for ax in figure.axes if ax.get_label() != "<colorbar>"]
    return sum(box.width * box.height for box in boxes) / whole


def overlaps(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of texts that cover a part of each other, and texts that are cut off by the figure's edge."""
    figure.canvas.draw()
    shown = [(text.get_text(), corners(text)) for text in texts(figure)]
    pairs = [(a, b) for (a, item), (b, other) in combinations(shown, 2) if meet(item, other)]
    width, height = figure.bbox.width, figure.bbox.height
    cut = [
        (name, "the edge")
        for name, box in shown
        if box.min() < -1 or box[:, 0].max() > width + 1 or box[:, 1].max() > height + 1
    ]
    return pairs + cut


def texts(figure: Figure) -> list[Text]:
    """All texts that are drawn; of an axis only the ticks within its range."""
    hidden = set()
    for ax in figure.axes:
        for axis in ax._axis_map.values():  # type: ignore[attr-defined]
            drawn = axis._update_ticks() if axis.get_visible() and ax.axison else []
            kept = {id(label) for tick in drawn for label in (tick.label1, tick.label2)}
            ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
            hidden |= {id(label) for tick in ticks for label in (tick.label1, tick.label2)} - kept
            if not ax.axison:
                hidden |= {id(axis.label), id(axis.offsetText)}
    result = figure.findobj(lambda artist: isinstance(artist, Text))
    return [
        text for text in result if text.get_visible() and text.get_text().strip() and id(text) not in hidden
    ]


def corners(text: Text) -> np.ndarray:
    """The corners of a text's box, in pixels, turned as the text is."""
    angle = text.get_rotation()
    text.set_rotation(0)
    flat = text.get_window_extent()
    text.set_rotation(angle)
    turned = text.get_window_extent()
    middle = np.array([(turned.x0 + turned.x1) / 2, (turned.y0 + turned.y1) / 2])
    # A little less than the box: boxes may touch, and letters do not fill them.
    half = np.array([max(flat.width / 2 - 1, 0.5), max(flat.height / 2 - 2, 0.5)])
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    made: np.ndarray = middle + (signs * half) @ np.array([[c, s], [-s, c]])
    return made


def meet(one: Any, other: Any) -> bool:
    """Return True if two convex quadrilaterals overlap: no edge of either separates them."""
    for box in (one, other):
        for k in range(4):
            edge = box[(k + 1) % 4] - box[k]
            normal = np.array([-edge[1], edge[0]])
            a, b = one @ normal, other @ normal
            if a.max() <= b.min() or b.max() <= a.min():
                return False
    return True
