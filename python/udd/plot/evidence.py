"""The evidence of a discovery for each candidate, and the errors before and after."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from udd._util.arguments import checked_arguments
from udd._util.small_units import small_unit
from udd.errors import UddError

from .inputs import require
from .style import AFTER, ALIKE, BEFORE, FAINT, FLOOR, legend_above, new_axes, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_LINE = 34  # letters of a candidate's title in one line


@checked_arguments(error=UddError)
def evidence(discovery: Any, ax: Axes | None = None, *, stage: int = 0, most: int = 12) -> Axes:
    """Draw the decrease in chi2 that each candidate would bring, with the threshold of significance.

    The effect that was added has the decrease that came about; the others have a first estimate.

    Parameters
    ----------
    discovery : Discovery
    ax : Axes, optional
    stage : int
        The first search is 0; each effect that is added is followed by another.
    most : int
        How many candidates, the best first.

    Returns
    -------
    Axes

    See Also
    --------
    udd.discover : computes the scores.
    udd.plot.errors : draw the errors on held-out data.
    """
    require(discovery, "a discovery holds evidence", "scans")
    if not 0 <= stage < len(discovery.scans):
        raise UddError(f"the discovery searched {len(discovery.scans)} times; there is no stage {stage}")
    scan = [s for s in discovery.scans[stage] if not s.absorbed][:most]
    titles = [textwrap.fill(s.candidate.title, _LINE) for s in scan]
    lines = sum(1.0 + 0.6 * title.count("\n") for title in titles)
    ax = new_axes(ax, size=(8.0, 1.5 + 0.3 * lines))
    chosen = {f.tried or f.title for f in discovery.effects}
    alike = {a.title for a in discovery.alternatives}
    fitted = decreases(discovery, stage)
    seen: set[str] = set()
    for k, scored in enumerate(scan):
        title = scored.candidate.title
        kind, colour = (
            ("found", AFTER)
            if title in chosen
            else ("cannot be distinguished from it", ALIKE)
            if title in alike
            else ("unphysical sign", "white")
            if not scored.physical
            else ("other candidates", FAINT)
        )
        ax.barh(
            k,
            max(fitted.get(title, scored.chi2), 0.1),
            color=colour,
            edgecolor="#8a8a8a" if colour == "white" else colour,
            label=None if kind in seen else kind,
        )
        seen.add(kind)
    ax.axvline(
        threshold(discovery, stage),
        color="black",
        linestyle="--",
        linewidth=1.2,
        label="what chance hardly reaches",
    )
    ax.set_yticks(range(len(scan)), titles, fontsize="small")
    ax.set_ylim(max(len(scan), 1) - 0.4, -0.6)
    ax.set_xscale("log")
    ax.set_xlim(left=0.5)
    ax.set_xlabel("evidence: decrease in χ² with this effect")
    legend_above(ax)
    tidy(ax)
    ax.grid(False, axis="y")
    return ax


def decreases(discovery: Any, stage: int) -> dict[str, float]:
    """Return the decrease in chi2 with the effect that a search added, by the name of the candidate.

    Effects that act identically on these data have the same decrease.
    """
    from udd.discovery.thresholds import SAME

    result = {}
    for effect in discovery.effects[stage : stage + 1]:
        result[effect.tried or effect.title] = effect.chi2
        result |= {
            other.title: effect.chi2
            for other in discovery.alternatives
            if other.likeness > SAME and other.instead_of == effect.effect.name
        }
    return result


def threshold(discovery: Any, stage: int) -> float:
    """Return the chi2 that a candidate with one amplitude must reach, with all candidates counted."""
    from udd._util import chi_squared
    from udd.discovery.thresholds import ALPHA

    return float(chi_squared.isf(ALPHA / discovery.comparisons[stage], 1))


@checked_arguments(error=UddError)
def errors(discovery: Any, ax: Axes | None = None) -> Axes:
    """Draw the error of free runs on held-out data: before, after, and the noise floor.

    Parameters
    ----------
    discovery : Discovery
    ax : Axes, optional

    Returns
    -------
    Axes

    See Also
    --------
    udd.discover : computes the errors.
    udd.plot.evidence : draw the scores of the candidates.
    """
    require(discovery, "a discovery holds errors", "error_before")
    from matplotlib.ticker import LogLocator

    before, after = discovery.error_before, discovery.error_after
    unit, factor = small_unit(before.unit)
    ax = new_axes(ax)
    lines = [(before, BEFORE, "o", "the known model")]
    if discovery.effects:
        lines.append(
            (after, AFTER, "s", "with the added effect" + ("s" if len(discovery.effects) > 1 else ""))
        )
    for k, (e, colour, marker, words) in enumerate(lines):
        h = np.array(e.horizons) * (1 + 0.03 * k)
        ax.plot(h, factor * e.median, color=colour, marker=marker, linewidth=1.8, label=words)
        ax.vlines(h, factor * e.low, factor * e.high, color=colour, linewidth=3, alpha=0.4)
    last = lines[-1][0]
    ax.plot(
        last.horizons,
        factor * last.floor,
        color=FLOOR,
        linestyle=":",
        marker=".",
        linewidth=1.5,
        label="noise floor",
    )
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xticks(before.horizons, [f"{h:.3g}" for h in before.horizons])
    ax.minorticks_off()
    ax.yaxis.set_major_formatter("{x:g}")
    low, high = ax.get_ylim()
    ax.yaxis.set_major_locator(
        LogLocator(subs=(1.0, 2.0, 5.0) if high > 8 * low else (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))
    )
    ax.set_xlabel("forecast horizon [s]")
    ax.set_ylabel(f"median error [{unit}]")
    legend_above(ax)
    tidy(ax)
    return ax
