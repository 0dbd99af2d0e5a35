"""Claims about the small drive, W = 1.4 cm/s: creep, heights, and static friction."""

from __future__ import annotations

import functools
from itertools import pairwise

import numpy as np

from udd.chaos.largest_exponent import lyapunov
from udd.errors import UddError
from udd.paper import device
from udd.paper.registry import Verdict, claim, judged
from udd.paper.shared_films import Lab
from udd.simulation.trajectory import Trajectory, simulate


@functools.cache
def _run() -> Trajectory:
    """Run ten minutes at W = 1.4 cm/s."""
    run = simulate(device.disk(device.SLOW), np.arange(0, 600, 0.005), device.SLOW_START, method="taylor")
    if run.outcome != "finished":
        raise UddError(f"the run at W = 1.4 cm/s ended early: {run.outcome}")
    return run


@functools.cache
def _ascents() -> tuple[tuple[int, int], ...]:
    """Return the indices at which the centre passes the contact upwards, and of the top after each."""
    run = _run()
    passes = np.flatnonzero((run.Z[:-1] < 0) & (run.Z[1:] >= 0))
    bounds = [*passes.tolist(), len(run.t)]
    pairs = []
    for first, following in pairwise(bounds):
        top = first + int(np.argmax(run.Z[first:following]))
        if run.Z[top] > 0.01 and top < following - 1:
            pairs.append((first, top))
    return tuple(pairs)


@claim("slow-chaos", place="Section 3 B", says="At W = 1.4 cm/s the motion is chaotic.")
def slow_chaos(_lab: Lab) -> Verdict:
    """Check the largest exponent."""
    value, error = lyapunov(device.disk(device.SLOW, beyond=True), t=40_000, tol=4e-3, with_error=True)
    return judged(
        value > 4 * error,
        f"largest Lyapunov exponent {value:.3f} ± {error:.3f} /s",
        f"weakly: neighbouring orbits separate by a factor e in {1 / value:.0f} s",
    )


@claim(
    "slow-ascent",
    place="Section 3 B",
    says="In each cycle Z rises at nearly the constant speed W of the drive.",
)
def slow_ascent(_lab: Lab) -> Verdict:
    """Check the slope of Z as the centre passes the contact."""
    run = _run()
    slopes = []
    for first, _top in _ascents():
        part = slice(max(first - 100, 0), first + 100)
        slopes.append(np.polyfit(run.t[part], run.Z[part], 1)[0] / device.SLOW)
    middle, low = float(np.median(slopes)), float(np.min(slopes))
    evidence = f"slope over 1 s about Z = 0: median {middle:.3f} W, lowest {low:.3f} W, {len(slopes)} cycles"
    return judged(middle > 0.95, evidence)


@claim(
    "higher-deeper",
    place="Section 3 B",
    says="The smaller Y is at first, the higher the disk is driven, and the deeper it falls.",
)
def higher_deeper(_lab: Lab) -> Verdict:
    """Check rank correlations over the cycles of ten minutes."""
    from scipy.stats import spearmanr

    run = _run()
    pairs = _ascents()
    first = np.array([abs(run.Y[k]) for k, _ in pairs])
    tops = np.array([run.Z[k] for _, k in pairs])
    depths = np.array([-run.Z[k : k + 200].min() for _, k in pairs])
    higher, deeper = spearmanr(first, tops).statistic, spearmanr(tops, depths).statistic
    evidence = (
        f"rank correlations over {len(pairs)} cycles: |Y| at Z = 0 with the height {higher:.3f}, height "
        f"with depth {deeper:.3f}"
    )
    return judged(higher < -0.9 and deeper > 0.9, evidence)


@claim(
    "static-friction",
    place="Sections 3 B and 5",
    says="Static friction arrests the disk, stuck at a small Y, until the torque of gravity surpasses it.",
)
def static_friction(_lab: Lab) -> Verdict:
    """Check that nothing sticks in the paper's model: the disk creeps by a closed law."""
    run = _run()
    slowest = min(float(np.abs(run.Omega[first : top + 1]).min()) for first, top in _ascents())
    creep = simulate(
        device.disk(device.SLOW), [0.0, 0.02 / device.SLOW], [device.G * 1e-6 / device.K1, 1e-6, 0, 0]
    ).state[-1]
    law = device.G * creep[2] ** 2 / (2 * device.SLOW * device.K1)
    gap = abs(np.log(creep[1] / 1e-6) / law - 1)
    evidence = (
        "the friction torque k Ω vanishes with Ω, so no torque is too small to move the disk: in "
        f"{len(_ascents())} ascents of ten minutes |Ω| is never below {slowest:.3f} rad/s. Released 1 µm "
        "from "
        f"the axis it creeps as Y = Y₀ exp[g (Z² − Z₀²)/(2 W k₁)], to {gap:.1%} in the exponent on the "
        "first 2 cm"
    )
    otherwise = (
        "this is about the paper's model, in which creep looks like sticking. A real disk may well stick, "
        "but "
        "a constant threshold would then carry it to its edge, since g Y does not change while it sticks "
        '(see udd.effects.coulomb with treatment="set-valued")'
    )
    return judged(slowest == 0.0, evidence, otherwise=otherwise)


@claim(
    "torque-shape",
    place="Section 5 A",
    says="Motion is damped more strongly at low than at high angular velocity.",
)
def torque_shape(_lab: Lab) -> Verdict:
    """Check that the coefficient falls with the speed, and the torque does not everywhere."""
    peak = device.K1**2 / (4 * device.K2)
    bottom = device.K0 * device.KINK
    evidence = (
        f"k falls from {device.K1} to {device.K0} m²/s at |Ω| = {device.KINK:.6f} rad/s; the torque k Ω "
        "is N-shaped: largest "
        f"{peak:.6f} m²/s² at {device.K1 / (2 * device.K2):.5f} rad/s, then least {bottom:.6f} at the kink"
    )
    return judged(peak > bottom, evidence, "true of the coefficient; the torque itself vanishes with Ω")
