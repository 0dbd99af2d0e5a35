"""Height of the centre over its offset at the contact: the disk's analogue of the onset of convection."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from udd.chaos.poincare_sections import poincare
from udd.models import DLE
from udd.paper.canvas import panels, titled
from udd.paper.registry import figure
from udd.paper.shared_films import Lab
from udd.plot.style import AFTER, BEFORE, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

OFFSETS = np.geomspace(1e-8, 3e-2, 60)


def tops(w: float, offset: Array) -> Array:
    """Compute the height that the DLE's centre reaches from rest at these offsets from the contact."""
    starts = np.stack([0 * offset, offset, 0 * offset], axis=-1)
    # Motion that grows from 1e-8 must stay above the absolute tolerance.
    result: Array = poincare(DLE(w), "maxima of z", 1, state0=starts, transient=0, atol=1e-30).component("z")
    return result[..., 0]


def growth(height: Array) -> Array:
    """Compute the growth of an offset up to a height, as ``exp(growth/w)``.

    The centre rises as z = w t. Near the axis the offset grows at the rate ``(sqrt(1 + 4 z) - 1)/2``, the
    larger eigenvalue of ``omega' = y - omega, y' = omega z``. Its integral is ``((1 + 4 h)^(3/2) - 1)/12 -
    h/2``.
    """
    result: Array = ((1 + 4 * height) ** 1.5 - 1) / 12 - height / 2
    return result


@figure(
    "overturning",
    paper="Section 6, convection",
    title="How high the centre rises before it overturns",
    caption="The DLE, released at rest with the offset y from the contact, like a stratified fluid whose "
    "centre of mass passes the middle of its basin. (a) The height h that the centre reaches. (b) The "
    "growth of the offset up to that height, ((1 + 4h)^(3/2) − 1)/12 − h/2. All points are on lines of "
    "slope −w (black, with a free intercept).",
)
def overturning(_lab: Lab) -> Figure:
    """Draw height and growth over the offset."""
    made, axes = panels(1, 2, 9.6, 4.4)
    for w, colour in ((0.1, BEFORE), (0.03, "#e69f00"), (0.01, AFTER)):
        height = tops(w, OFFSETS)
        axes[0].semilogx(OFFSETS, height, ".", color=colour, markersize=4, label=f"w = {w}")
        axes[1].semilogx(OFFSETS, growth(height), ".", color=colour, markersize=4, label=f"w = {w}")
        shift = np.mean(growth(height) + w * np.log(OFFSETS))
        axes[1].semilogx(OFFSETS, shift - w * np.log(OFFSETS), color="black", linewidth=0.8, zorder=0)
    for k, words in enumerate(("height h [1]", "growth up to h [1]")):
        axes[k].set_xlabel("offset y as the centre passes the contact [1]")
        axes[k].set_ylabel(words)
        axes[k].legend(frameon=False)
        titled(axes[k], k, ("height", "linear theory")[k])
        tidy(axes[k])
    return made
