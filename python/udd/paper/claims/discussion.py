"""Claims of the discussion: the clock, forced pendulums, successive heights, spin-down."""

from __future__ import annotations

import numpy as np

from udd import related_systems as systems
from udd.chaos.poincare_sections import poincare
from udd.paper import device
from udd.paper.branches import RELAXATION, hopf, rotation_of_disk
from udd.paper.figures.clock import EIGHT, C, after_a_push, disk_periods, periods
from udd.paper.figures.heights import limit, next_heights
from udd.paper.figures.overturning import OFFSETS, growth, tops
from udd.paper.figures.rotation import spun_down
from udd.paper.figures.steady import eight, forced_swings, jitter, lengths, pumped, swing_period
from udd.paper.registry import Verdict, claim, judged
from udd.paper.shared_films import Lab
from udd.simulation.trajectory import integrated


@claim(
    "forced-pendulum",
    place="Section 6",
    says="A periodically forced pendulum cannot have a fixed period; it detunes and is modulated over "
    "long times.",
)
def forced_pendulum(_lab: Lab) -> Verdict:
    """Check a damped pendulum near resonance."""
    frequency = 0.9
    model = systems.torqued_pendulum(1.0, 0.2, 0.2, frequency)
    section = poincare(model, "v", 400, state0=[0.0, 0.0], direction="down", transient=400, t_max=20_000.0)
    spread = float(np.ptp(section.return_times) / section.return_times.mean())
    swing = float(np.abs(section.component("theta")).max())
    ratio = section.return_times.mean() * frequency / (2 * np.pi)
    evidence = (
        f"with friction 0.2 and a torque 0.2 cos(0.9 t), r = 1, it swings by {swing:.2f} rad with the period "
        f"of the torque (ratio {ratio:.9f}), constant to {spread:.0e} over 400 swings after 400 more"
    )
    otherwise = (
        "a damped pendulum locks to its drive and takes its period; detuning and modulation persist only "
        "without friction. The disk, in contrast, has its own period, without a clock that drives it"
    )
    return judged(spread > 1e-6, evidence, otherwise=otherwise)


@claim(
    "clock-period",
    place="Section 6",
    says="For large drives the disk has a well-defined period.",
)
def clock_period(_lab: Lab) -> Verdict:
    """Check T sqrt(w) at large drives, and for the full disk."""
    w = np.array([10.0, 100.0, 1000.0])
    scaled = periods(w) * np.sqrt(w)
    W = np.linspace(0.08, 0.12, 9)
    slope = np.polyfit(np.log(W), np.log(disk_periods(W)), 1)[0]
    fast = integrated(device.disk(0.15), 120.0, EIGHT, method="taylor")
    evidence = (
        f"DLE: T √w = {scaled[0]:.6f}, {scaled[1]:.6f}, {scaled[2]:.6f} at w = 10, 100, 1000 (limit "
        f"{C:.6f}); disk: T goes as W^{slope:.3f} from 8 to 12 cm/s; from the same start the disk "
        f"{'stays' if fast.outcome == 'finished' else 'loses contact'} at 15 cm/s"
    )
    remark = (
        "the period is set by the drive, as W^(−1/2): its relative error is half that of the wheels' speed. "
        "The disk's orbit grows with W until it reaches the edge"
    )
    return judged(abs(scaled[2] / C - 1) < 1e-4 and abs(slope + 0.5) < 0.02, evidence, remark)


@claim("clock-robust", place="Section 6", says="The periodic motion is robust to perturbations.")
def clock_robust(_lab: Lab) -> Verdict:
    """Check the response to a push of half the state's size."""
    _, gaps = after_a_push(12.0, 0.5, 60)
    settled = int(np.argmax(gaps < 1e-8))
    evidence = (
        "DLE, w = 12: after a push by half its size, the half periods return to 1e-8 within "
        f"{settled} of them"
    )
    remark = "just above the symmetry breaking (w = 7.0964) it takes thousands"
    return judged(0 < settled < 60, evidence, remark)


@claim(
    "successive-heights",
    place="Section 5 B",
    says="For small drives the DLE are approximated by an iterated map with many cusps.",
)
def successive_heights(_lab: Lab) -> Verdict:
    """Check successive heights against the limit w -> 0."""
    gaps, spreads = [], []
    for w in (0.1, 0.03, 0.01):
        first, following = next_heights(w, 1.0, 1.8, 1500)
        gaps.append(float(np.median(np.abs(limit(following) - first))))
        order = np.argsort(first)
        spreads.append(float(np.median(np.abs(np.diff(following[order])))))
    evidence = (
        "the next height is a function of the last (neighbours 0.0005 apart differ by "
        f"{spreads[0]:.0e}, {spreads[1]:.0e}, {spreads[2]:.0e} at w = 0.1, 0.03, 0.01). Median distance to "
        "the "
        f"limit 6 (h + h′) = (1 + 4 h′)^(3/2): {gaps[0]:.3f}, {gaps[1]:.3f}, {gaps[2]:.3f}"
    )
    remark = "as w → 0 the cusps crowd and shrink onto a smooth map with the stable fixed point 1.353"
    return judged(gaps[2] < gaps[1] < gaps[0] and spreads[0] < 0.01, evidence, remark)


@claim(
    "spin-down",
    place="Section 3 C",
    says="As the drive is lowered the rotating states turn unstable at last: there is a lower bound on W.",
)
def spin_down(_lab: Lab) -> Verdict:
    """Check at which drive the rotation is lost as the drive is lowered, in the disk with the relaxation."""
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
    """Check the averages on the chaotic orbit at w = 1."""
    from udd.chaos.spectrum import lyapunov_spectrum

    spectrum = lyapunov_spectrum(1.0, t=50_000, tol=2e-3)
    value, error = spectrum.exponents[0], spectrum.standard_errors[0]
    total = spectrum.exponents.sum()
    evidence = (
        f"w = 1: largest exponent {value:.4f} ± {error:.4f}, dimension {spectrum.dimension:.3f}, exponents' "
        f"sum {total:.6f}"
    )
    return judged(spectrum.verdict == "chaos", evidence)


@claim(
    "no-detuning",
    place="Section 6",
    says="A steady drive has no frequency: the disk neither resonates nor detunes, nor is it modulated.",
)
def no_detuning(_lab: Lab) -> Verdict:
    """Check the modulation of a forced pendulum, and the clock's jitter under a rippled drive."""
    swings = forced_swings(0.0)[10:]
    ratios = (0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1.1, 1.5, 2.0, 2.5, 3.0)
    worst = {ripple: max(jitter(ripple, ratio) for ratio in ratios) for ripple in (0.01, 0.05)}
    still = jitter(0.0, 1.0)
    evidence = (
        f"without friction a pendulum under a torque 5 % below its frequency swings by {swings.min():.2f} to "
        f"{swings.max():.2f} rad, for ever. The figure-eight at w = 12 repeats to {still:.0e}. If the drive "
        "ripples by 1 % or 5 %, at a tenth to three times its frequency, its period has a jitter of at most "
        f"{worst[0.01]:.2%} or {worst[0.05]:.1%}"
    )
    remark = (
        "the clock is as steady as its wheels: single periods change by about half a ripple's size, most at "
        "half the clock's frequency"
    )
    return judged(still < 1e-9 and all(w < 0.65 * a for a, w in worst.items()), evidence, remark)


@claim(
    "isochrony",
    place="Section 6",
    says="The period of a plain pendulum depends on its amplitude; Huygens' cheeks make it isochronous.",
)
def isochrony(_lab: Lab) -> Verdict:
    """Check the periods of both at small and large swings."""
    amplitude = np.array([0.05, 0.5, 1.0, 1.4])
    plain = swing_period(systems.pendulum(1.0, 0.0), amplitude)
    cheeks = swing_period(systems.cycloidal_pendulum(1.0), amplitude)
    evidence = (
        f"from 0.05 to 1.4 rad the plain pendulum's period grows by {plain[-1] / plain[0] - 1:.1%}, that "
        "between "
        f"cheeks by {np.ptp(cheeks):.0e}"
    )
    return judged(bool(plain[-1] / plain[0] > 1.1 and np.ptp(cheeks) < 1e-8), evidence)


@claim(
    "like-a-swing",
    place="Section 6",
    says="The figure-eight resembles the path of the centre of mass of a person who pumps a swing.",
)
def like_a_swing(_lab: Lab) -> Verdict:
    """Check the distance from the pivot on the way out and back, for both."""
    words, shorter = [], []
    for name, (y, z) in (("the DLE at w = 10", eight()), ("a pumped swing", pumped())):
        out, back = lengths(y, z)
        crossings = (
            int(((y[:-1] < 0) & (y[1:] >= 0)).sum()),
            int(((z[1:-1] > z[:-2]) & (z[1:-1] >= z[2:])).sum()),
        )
        shorter.append(out < back and crossings == (1, 2))
        words.append(f"{name}: {out / back:.2f}")
    evidence = (
        "both go up and down twice while they swing once, and are shorter on the way out than on the way "
        "back; mean "
        f"distances, out over back: {', '.join(words)}"
    )
    return judged(all(shorter), evidence, "the likeness is one of the paths; what drives them differs")


@claim(
    "overturning-height",
    place="Section 6",
    says="How high the centre of mass rises, and when it overturns, depends on its offset as it passes "
    "the centre.",
)
def overturning_height(_lab: Lab) -> Verdict:
    """Check the slope of the offset's growth over its logarithm."""
    slopes = [np.polyfit(np.log(OFFSETS), growth(tops(w, OFFSETS)), 1)[0] / w for w in (0.1, 0.03, 0.01)]
    high = tops(0.1, OFFSETS[[0, -1]])
    evidence = (
        f"at w = 0.1 the centre rises to {high[0]:.2f} with the offset 1e-8 and to {high[1]:.2f} with 0.03. "
        "The growth ((1 + 4h)^(3/2) − 1)/12 − h/2 falls with ln y at the rate "
        f"{', '.join(f'{-s:.3f}' for s in slopes)} w at w = 0.1, 0.03, 0.01"
    )
    return judged(all(abs(s + 1) < 0.02 for s in slopes), evidence)
