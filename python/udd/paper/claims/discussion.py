"""Claims of the discussion: the clock, forced pendulums, successive heights, spin-down."""

from __future__ import annotations

import numpy as np

from udd import relatives
from udd.paper import device
from udd.paper.branches import RELAXATION, hopf, rotation_of_disk
from udd.paper.figures.clock import EIGHT, C, after_a_push, disk_periods, periods
from udd.paper.figures.heights import limit, next_heights
from udd.paper.figures.rotation import spun_down
from udd.paper.lab import Lab
from udd.paper.registry import Verdict, claim, judged
from udd.sections import poincare
from udd.trajectory import simulate


@claim(
    "forced-pendulum",
    place="Section 6",
    says="A periodically forced pendulum cannot have a fixed period; it detunes and is modulated over "
    "long times.",
)
def forced_pendulum(_lab: Lab) -> Verdict:
    """A damped one, near resonance."""
    frequency = 0.9
    model = relatives.torqued_pendulum(1.0, 0.2, 0.2, frequency)
    found = poincare(model, "v", 400, state0=[0.0, 0.0], direction="down", transient=400, t_max=20_000.0)
    spread = float(np.ptp(found.return_times) / found.return_times.mean())
    swing = float(np.abs(found.component("theta")).max())
    ratio = found.return_times.mean() * frequency / (2 * np.pi)
    evidence = (
        f"with friction 0.2 and a torque 0.2 cos(0.9 t), r = 1, it swings by {swing:.2f} rad with the "
        "period of the torque "
        f"(ratio {ratio:.9f}), alike to {spread:.0e} over 400 swings after 400 more"
    )
    otherwise = (
        "a damped one locks to its drive, whose period it takes; detuning and modulation stay where "
        "friction is "
        "absent. What the disk has over it is a period of its own, without a clock that drives it"
    )
    return judged(spread > 1e-6, evidence, otherwise=otherwise)


@claim(
    "clock-period",
    place="Section 6",
    says="For large drives the disk has a well-defined period.",
)
def clock_period(_lab: Lab) -> Verdict:
    """T sqrt(w) at large drives, and for the full disk."""
    w = np.array([10.0, 100.0, 1000.0])
    scaled = periods(w) * np.sqrt(w)
    W = np.linspace(0.08, 0.12, 9)
    slope = np.polyfit(np.log(W), np.log(disk_periods(W)), 1)[0]
    fast = simulate(device.disk(0.15), 120.0, EIGHT, method="taylor")
    evidence = (
        f"DLE: T √w = {scaled[0]:.6f}, {scaled[1]:.6f}, {scaled[2]:.6f} at w = 10, 100, 1000 (limit "
        f"{C:.6f}); disk: T goes as W^{slope:.3f} from 8 to 12 cm/s; from the same start the disk "
        f"{'stays' if fast.outcome == 'finished' else 'leaves the wheels'} at 15 cm/s"
    )
    remark = (
        "the period is set by the drive, as W^(−1/2): a clock as good as half the relative steadiness of "
        "its wheels. The disk's orbit grows with W until it has no room left"
    )
    return judged(abs(scaled[2] / C - 1) < 1e-4 and abs(slope + 0.5) < 0.02, evidence, remark)


@claim("clock-robust", place="Section 6", says="The periodic motion is robust to perturbations.")
def clock_robust(_lab: Lab) -> Verdict:
    """After a push of half the state's size."""
    _, gaps = after_a_push(12.0, 0.5, 60)
    settled = int(np.argmax(gaps < 1e-8))
    evidence = (
        f"DLE, w = 12: pushed by half its size, the half periods are back to 1e-8 after {settled} of them"
    )
    remark = "just above the symmetry breaking (w = 7.0964) it takes thousands"
    return judged(0 < settled < 60, evidence, remark)


@claim(
    "successive-heights",
    place="Section 5 B",
    says="For small drives the DLE are approximated by an iterated map with many cusps.",
)
def successive_heights(_lab: Lab) -> Verdict:
    """One height against the next, beside the limit w -> 0."""
    gaps, spreads = [], []
    for w in (0.1, 0.03, 0.01):
        first, following = next_heights(w, 1.0, 1.8, 1500)
        gaps.append(float(np.median(np.abs(limit(following) - first))))
        order = np.argsort(first)
        spreads.append(float(np.median(np.abs(np.diff(following[order])))))
    evidence = (
        "the next height is a function of the last (neighbours 0.0005 apart differ by "
        f"{spreads[0]:.0e}, {spreads[1]:.0e}, {spreads[2]:.0e} at w = 0.1, 0.03, 0.01); distance to the "
        "limit "
        f"6 (h + h′) = (1 + 4 h′)^(3/2), median: {gaps[0]:.3f}, {gaps[1]:.3f}, {gaps[2]:.3f}"
    )
    remark = "as w → 0 the cusps crowd and shrink onto a smooth map with the stable fixed point 1.353"
    return judged(gaps[2] < gaps[1] < gaps[0] and spreads[0] < 0.01, evidence, remark)


@claim(
    "spin-down",
    place="Section 3 C",
    says="As the drive is lowered the rotating states turn unstable at last: there is a lower bound on W.",
)
def spin_down(_lab: Lab) -> Verdict:
    """Where the rotation is lost as the drive is lowered, in the disk with the relaxation."""
    down = np.arange(0.070, 0.0459, -0.002)
    omega, y, z = device.rotating(float(down[0]))
    spread = spun_down(down, [omega, y, z, 0.0])[:, 1]
    lost = down[spread > 1.0]
    point = hopf(rotation_of_disk(RELAXATION))
    bound = float("nan") if point is None else point.value
    evidence = (
        "b = 43.6 /m: lowered in steps of 2 mm/s, a minute each, the rotation is lost at "
        f"{100 * lost[0]:.1f} cm/s; linear theory "
        f"puts the bound at {100 * bound:.2f} cm/s"
    )
    remark = "with the added relaxation; the paper's plain model has no stable rotation at all"
    return judged(len(lost) > 0 and lost[0] < bound + 1e-9, evidence, remark)


@claim(
    "driven-by-nothing-periodic",
    place="Section 4 C",
    says="A steady drive leads to an aperiodic response.",
)
def aperiodic(_lab: Lab) -> Verdict:
    """The exact averages on the chaotic orbit at w = 1."""
    from udd.spectra import lyapunov_spectrum

    found = lyapunov_spectrum(1.0, t=50_000, tol=2e-3)
    value, error = found.exponents[0], found.standard_errors[0]
    total = found.exponents.sum()
    evidence = (
        f"w = 1: largest exponent {value:.4f} ± {error:.4f}, dimension {found.dimension:.3f}, exponents' "
        f"sum {total:.6f}"
    )
    return judged(found.verdict == "chaos", evidence)
