"""Claims about falls to one side and the other, at small drives."""

from __future__ import annotations

import numpy as np

from udd.paper import device
from udd.paper.falls import Falls, falls
from udd.paper.figures.falls import falls_at
from udd.paper.registry import Verdict, claim, judged
from udd.paper.shared_films import Lab


def _sides(statistics: Falls) -> str:
    lengths = statistics.lengths
    return (
        f"{len(statistics.side)} falls, {np.mean(statistics.side > 0):.0%} to the right; runs to one side of "
        f"{lengths.mean():.2f} falls on average, {lengths.max()} at most"
    )


@claim(
    "falls-to-either-side",
    place="Section 3 B",
    says="From cycle to cycle the disk falls to one side or the other, irregularly.",
)
def either_side(_lab: Lab) -> Verdict:
    """Check the falls of twenty minutes."""
    slow, middle, fast = (falls_at(W) for W in (device.SLOW, 0.039, 0.071))
    evidence = (
        f"in twenty minutes at 1.4 cm/s {_sides(slow)}; at 3.9 cm/s {_sides(middle)} "
        "(a fair coin: runs of 2 on average)"
    )
    three = np.mean(slow.lengths == np.median(slow.lengths))
    remark = (
        f"with the paper's constants the sides are nearly regular at 1.4 cm/s: {three:.0%} of the runs "
        "are of "
        f"{np.median(slow.lengths):.0f} falls; irregular at 3.9 cm/s; at 7.1 cm/s "
        f"{np.mean(np.diff(fast.side) != 0):.0%} "
        "of the falls go to the other side than the one before"
    )
    mixed = 0.4 < np.mean(slow.side > 0) < 0.6 and len(np.unique(middle.lengths)) > 2
    return judged(bool(mixed), evidence, remark)


@claim(
    "theta-plateaus",
    place="Section 3 B, Figure 7",
    says="Repeated falls to the same side make θ larger or smaller, with plateaus at multiples of 2π; "
    "where the disk alternates sides it returns to the same plateau.",
)
def theta_plateaus(_lab: Lab) -> Verdict:
    """Check whole turns against the sides on which the centre rose and fell."""
    words, same, steps = [], [], []
    for W in (device.SLOW, 0.039, 0.055):
        statistics = falls_at(W)
        turned = statistics.turns != 0
        same.append(bool(np.array_equal(turned, statistics.side != statistics.rose)))
        steps.append(int(turned.sum()))
        words.append(f"{turned.sum()} of {len(turned)} at {100 * W:.1f} cm/s")
    evidence = (
        f"Θ rests within 0.3 rad of a multiple of 2π for {falls_at(device.SLOW).plateau:.0%} of the time "
        f"at 1.4 cm/s; it goes on to another multiple in {', '.join(words)}"
    )
    otherwise = (
        "the side of the fall before does not decide. Θ goes on exactly if the centre falls to the other "
        "side than that on which it rose past the contact, in all of these falls"
        if all(same)
        else "the side on which the centre rose does not decide either"
    )
    otherwise += (
        ". In the paper's model at 1.4 cm/s it always falls to the side on which it rose, so Θ stays. The "
        "film's plateaus at other multiples need a change of sides on the axis, by noise or sticking friction"
    )
    return judged(steps[0] > 0 and not all(same), evidence, otherwise=otherwise)


@claim(
    "slow-and-fast",
    place="Section 3 B",
    says="At low drive the slow ascent takes much longer than the fast descent; at larger drives the "
    "separation is lost.",
)
def slow_and_fast(_lab: Lab) -> Verdict:
    """Check the median times of both, and the share of time in which Z increases."""
    slow, fast = falls_at(device.SLOW), falls_at(0.071)
    evidence = (
        f"from the last low point to the top {slow.ascent:.2f} s, from there to the lowest "
        f"{slow.descent:.2f} s at "
        f"1.4 cm/s ({slow.ascent / slow.descent:.1f} times; Z grows {slow.rising:.0%} of the time); "
        f"{fast.ascent:.2f} "
        f"and {fast.descent:.2f} s at 7.1 cm/s ({fast.ascent / fast.descent:.1f} times; {fast.rising:.0%})"
    )
    return judged(slow.ascent > 4 * slow.descent and fast.ascent < 2 * fast.descent, evidence)


@claim(
    "falls-filmed",
    place="Section 3 B, Figures 5 to 7",
    says="The film at W = 1.4 cm/s shows slow ascents, fast descents, and falls to either side.",
    filmed=True,
)
def falls_filmed(lab: Lab) -> Verdict:
    """Check the same numbers from the tracked film."""
    motion = lab.smoothed("1.4")
    statistics = falls(motion.t, motion.state[:, 1], motion.state[:, 2])
    computed = falls_at(device.SLOW)
    agree = int(np.argmin(np.append(statistics.side == computed.side[: len(statistics.side)], False)))
    evidence = (
        f"{_sides(statistics)}; rising takes {statistics.ascent:.2f} s, falling {statistics.descent:.2f} "
        "s, and Z grows "
        f"{statistics.rising:.0%} of the time. The first {agree} falls go to the sides of the computed run"
    )
    holds = statistics.ascent > 4 * statistics.descent and len(np.unique(statistics.side)) == 2
    return judged(bool(holds), evidence, "a synthetic film of a run of the model, tracked")
