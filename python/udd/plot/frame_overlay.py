"""The tracked disk drawn over a frame of its film."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from udd._util.arguments import checked_arguments
from udd.errors import UddError

from .style import SQUARE, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: The marks' own colours, clockwise from the one that sits at beta.
MARKS = ("#e41a1c", "#ff9f1c", "#2b6cff", "#1fae4b")
_LINE = "#00e5ff"  # stands out on grey, black and white alike


@checked_arguments(error=UddError)
def overlay(image: Any, pixels: Any, frame: int, ax: Axes | None = None) -> Axes:
    """Draw a frame of the film with the fitted disk: outline, marks, centre and contact.

    Parameters
    ----------
    image : ndarray (height, width, 3)
    pixels : udd.tracking.Pixels
        Place of the disk in each frame, in pixels.
    frame : int
        The frame that `image` shows.
    ax : Axes, optional

    Returns
    -------
    Axes

    See Also
    --------
    udd.track : measures the film.
    udd.tracking.overlay : the whole film.
    """
    from matplotlib.patches import Circle

    if not 0 <= frame < len(pixels.centre):
        raise UddError(f"there is no frame {frame}: the measurement has {len(pixels.centre)}")
    ax = new_axes(ax, size=SQUARE)
    shown = np.asarray(image)
    ax.imshow(shown)
    u, v = pixels.centre[frame]
    if np.isfinite(u):
        ax.add_patch(Circle((u, v), pixels.radius, fill=False, edgecolor=_LINE, linewidth=1.8))
        ax.plot(u, v, "+", color=_LINE, markersize=9, markeredgewidth=1.8)
        for (mu, mv), codes in zip(pixels.marks[frame], pixels.colours, strict=True):
            for colour, width in (("white", 2.6), (np.array(codes) / 255, 1.4)):
                style: dict[str, Any] = {
                    "markerfacecolor": "none",
                    "markeredgecolor": colour,
                    "markeredgewidth": width,
                }
                ax.plot(mu, mv, "o", markersize=11, **style)
    ax.plot(*pixels.pivot, "x", color="#ff3df2", markersize=8, markeredgewidth=2)
    ax.set_xlim(-0.5, shown.shape[1] - 0.5)
    ax.set_ylim(shown.shape[0] - 0.5, -0.5)
    ax.set_xlabel("u [pixels]")
    ax.set_ylabel("v [pixels]")
    return ax
