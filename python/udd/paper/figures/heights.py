"""Map of successive heights, and its limit for small drives."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from udd.chaos.poincare_sections import poincare
from udd.errors import IncompleteWarning
from udd.models import DLE
from udd.paper.canvas import panels, titled
from udd.paper.registry import figure
from udd.paper.shared_films import Lab
from udd.plot.style import AFTER, BEFORE, FAINT, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

#: Absolute tolerance: the sideways motion at the end of the swings is of size exp(-1/w), and determines all
#: that follows.
TINY = 1e-200


def next_heights(w: float, low: float = 0.5, high: float = 2.6, n: int = 3000) -> tuple[Array, Array]:
    """Compute pairs of successive heights from which the centre falls, for starts over a range of heights.

    Maxima of z below the contact belong to the swings and are left out.
    """
    heights = np.linspace(low, high, n)
    starts = np.stack([np.full(n, np.sqrt(w)), np.full(n, np.sqrt(w)), heights], axis=-1)
    z = maxima(w, starts, 60, 40 / w + 60)
    pairs = []
    for row in z:
        tops = row[np.isfinite(row) & (row > 0)]
        if len(tops) >= 2:
            pairs.append(tops[:2])
    first, following = np.array(pairs).T
    return first, following


def maxima(w: float, starts: Array, n: int, time: float) -> Array:
    """Compute the maxima of z within a time, at most n for each start; rows of several starts end in NaN."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IncompleteWarning)  # the time is the limit, not the number
        section = poincare(DLE(w), "maxima of z", n, state0=starts, transient=0, t_max=time, atol=TINY)
    return section.component("z")


def limit(following: Array) -> Array:
    """Return the height of the previous fall if the next one is `following`, in the limit of no drive.

    With z = w t the spin obeys ``omega'' + omega' = z omega``. It decays as ``exp(-t/2)`` while the centre
    swings (z < -1/4), then changes at the rate ``(sqrt(1 + 4 z) - 1)/2``. The next fall begins when it has
    its old size again. To leading order in w that is ``6 (h + h') = (1 + 4 h')^(3/2)``.
    """
    result: Array = (1 + 4 * following) ** 1.5 / 6 - following
    return result


@figure(
    "heights",
    paper="Section 5 B, the map of successive heights",
    title="From one height to the next",
    caption="Height of the centre (the maximum of z) over the height of its previous fall, in the DLE. "
    "At the map's cusps the swings end with hardly any sideways motion, and the centre rises higher. As w "
    "decreases the cusps crowd, with the distance π w/√(h − 1/4). Black: the limit w → 0, "
    "6 (h + h′) = (1 + 4 h′)^(3/2), whose fixed point 1.353 is stable: the chaos comes from the cusps.",
)
def heights(_lab: Lab) -> Figure:
    """Draw the map at three drives."""
    made, axes = panels(1, 3, 12.6, 4.4)
    curve = np.linspace(0.6, 2.2, 200)
    for k, w in enumerate((0.1, 0.03, 0.01)):
        first, following = next_heights(w)
        axes[k].plot(first, following, ".", color=AFTER, markersize=1.5, rasterized=True)
        axes[k].plot(limit(curve), curve, color="black", linewidth=1.0)
        axes[k].plot([0.5, 2.6], [0.5, 2.6], color=FAINT, linewidth=1, zorder=0)
        tops = maxima(w, np.array([0.1, 0.1, 1.4]), 600, 500 / w)
        tops = tops[tops > 0][10:]
        axes[k].plot(tops[:-1], tops[1:], ".", color=BEFORE, markersize=3, label="on the attractor")
        axes[k].set_xlim(0.5, 2.6)
        axes[k].set_xlabel("height h [1]")
        axes[k].set_ylabel("next height h′ [1]")
        titled(axes[k], k, f"w = {w}")
        tidy(axes[k])
    axes[0].legend(frameon=False, loc="lower right")
    return made
