"""Claims about the intermediate and large drives, by exponents and verdicts on the motion."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from udd.bifurcations import continuation, periodic_orbit
from udd.chaos.largest_exponent import lyapunov
from udd.chaos.poincare_sections import poincare
from udd.chaos.spectrum import Spectrum, lyapunov_spectrum
from udd.models import DLE
from udd.paper import device
from udd.paper.registry import Verdict, claim, judged
from udd.paper.shared_films import Lab
from udd.simulation.ensembles import ensemble
from udd.simulation.trajectory import simulate


@functools.cache
def _spectrum(W: float) -> Spectrum:
    """Compute the spectrum of the equations without the edge."""
    return lyapunov_spectrum(device.disk(W, beyond=True), t=40_000, tol=0.02, state0=device.FAST_START)


def _said(spectrum: Spectrum, unit: str = "/s") -> str:
    value, error = spectrum.exponents[0], spectrum.standard_errors[0]
    return f"largest exponent {value:.3f} ± {error:.3f} {unit}, verdict “{spectrum.verdict}”"


@functools.cache
def _left(W: float, n: int = 400, time: float = 120.0) -> float:
    """Compute the share of random starts that lose contact within two minutes."""
    random = np.random.default_rng(0)
    radius, angle = random.uniform(0.01, 0.05, n), random.uniform(0, 2 * np.pi, n)
    starts = np.stack(
        [random.normal(0, 2, n), radius * np.sin(angle), radius * np.cos(angle), np.zeros(n)], axis=-1
    )
    outcome = ensemble(device.disk(W), time, starts, rtol=1e-7).outcome
    return float((outcome == "ejected").mean())


@claim("chaos-3.9", place="Section 3 C", says="At W = 3.9 cm/s the motion is chaotic.")
def chaos_39(_lab: Lab) -> Verdict:
    """Check the exponent without the edge, and the share of starts that stay on the disk."""
    spectrum, lost = _spectrum(0.039), _left(0.039)
    remark = (
        f"the attractor reaches beyond the disk's edge: {lost:.0%} of random starts lose contact within two "
        'minutes; the exponent belongs to the equations without the edge (edge="ignore")'
    )
    return judged(spectrum.verdict == "chaos", _said(spectrum), remark if lost > 0.1 else "")


@claim(
    "order-5.5",
    place="Sections 3 C and 5 D",
    says="At W = 5.5 cm/s chaos is suppressed: a high-periodic state.",
)
def order_55(_lab: Lab) -> Verdict:
    """Check the verdict: the equations are chaotic there."""
    spectrum = _spectrum(0.055)
    otherwise = (
        "for the model with the paper's constants, whose attractor also reaches beyond the disk there; the "
        "device may differ"
    )
    return judged(spectrum.verdict == "periodic orbit", _said(spectrum), otherwise=otherwise)


@claim("order-7.1", place="Section 3 C", says="At W = 7.1 cm/s chaos is gone: the motion is periodic.")
def order_71(_lab: Lab) -> Verdict:
    """Check the period, and that the orbit is not its own mirror image."""
    spectrum = _spectrum(0.071)
    run = simulate(spectrum.model, [0.0, spectrum.period / 2], spectrum.end, method="taylor")
    gap = np.abs(run.state[1, :3] * [-1, -1, 1] - run.state[0, :3]) / [10, 0.02, 0.02]
    evidence = f"verdict “{spectrum.verdict}”, T = {spectrum.period:.9f} s"
    lopsided = gap.max() > 1e-3
    remark = "the orbit is one of an asymmetric pair, each the other's mirror image" if lopsided else ""
    return judged(spectrum.verdict == "periodic orbit", evidence, remark)


@claim(
    "ejection",
    place="Section 5 B, Video 2",
    says="Now and then the wheels eject the disk, which follows the unstable ascent Z = Z₀ + W T too far.",
)
def ejection(_lab: Lab) -> Verdict:
    """Check the share of ejections, by the drive."""
    shares = {W: _left(W) for W in (0.014, 0.039, 0.055, 0.071)}
    words = ", ".join(f"{share:.0%} at {100 * W:.1f} cm/s" for W, share in shares.items())
    return judged(shares[0.039] > 0, f"of 400 random starts lose contact within two minutes: {words}")


@claim("dle-3.9", place="Section 5 D", says="At w = 3.9 the DLE is chaotic.")
def dle_39(_lab: Lab) -> Verdict:
    """Check the exponent."""
    spectrum = lyapunov_spectrum(3.9, t=200_000, tol=2e-3)
    return judged(spectrum.verdict == "chaos", _said(spectrum, "per unit of time"))


def _late(w: float, n: int = 16) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return late states of several orbits, and how closely each returns to itself after 22 points."""
    starts = np.random.default_rng(1).normal(size=(n, 3))
    states = ensemble(DLE(w), 60_000.0, starts, rtol=1e-9).end
    y = poincare(DLE(w), n=200, state0=states, transient=0).component("y")
    return states, np.abs(y[:, 22:] - y[:, :-22]).max(axis=1)


@claim("dle-4.5", place="Section 5 D", says="At w = 4.5 the DLE is high-periodic.")
def dle_45(_lab: Lab) -> Verdict:
    """Check for a long chaotic transient, then 22 narrow bands; at a drive slightly above, a cycle."""
    early = lyapunov_spectrum(4.5, t=2000, tol=0.02, transient=100)
    states, gaps = _late(4.5)
    value, error = lyapunov(DLE(4.5), t=100_000, tol=3e-3, state0=states[0], with_error=True)
    shifted = _late(4.50001)[1]
    evidence = (
        f"up to t = 2000: {_said(early, 'per unit of time')}. After t = 60,000, {(gaps < 0.1).sum()} of "
        f"{len(gaps)} orbits "
        f"come back after 22 section points, to {np.median(gaps):.3f} in y (exponent {value:.3f} ± "
        f"{error:.3f}); "
        f"at w = 4.50001 they do so to {np.median(shifted):.1e}"
    )
    remark = (
        "only after a chaotic transient of thousands of units, and in a window of w some 3e-5 wide. At 4.5 "
        "itself the motion is still chaotic, in 22 bands that a picture does not resolve"
    )
    return judged(bool((gaps < 0.1).mean() > 0.8), evidence, remark)


@claim("dle-7.1", place="Section 5 D", says="At w = 7.1 the DLE is low-periodic.")
def dle_71(_lab: Lab) -> Verdict:
    """Check the symmetric figure-eight, and its distance from the symmetry breaking."""
    orbit = periodic_orbit(DLE(7.1))
    branch = continuation(periodic_orbit(DLE(10.0)), "w", (6.5, 12.0))
    breaking = branch.find("symmetry breaking")[0].value
    slowest = float(np.abs(orbit.multipliers).max())
    words = f"{'symmetric' if orbit.symmetric else 'asymmetric'} and {'' if orbit.stable else 'un'}stable"
    evidence = (
        f"the figure-eight with T = {orbit.period:.10f} is {words}; its symmetry breaks at w = {breaking:.9f}"
    )
    remark = (
        f"{7.1 - breaking:.4f} above the symmetry breaking, where transients die with the time constant "
        f"{-orbit.period / np.log(slowest):.0f}"
    )
    return judged(orbit.stable, evidence, remark if slowest > 0.99 else "")


@claim(
    "coexistence",
    place="Section 4 C",
    says="Over some drives several states of the DLE are present at one and the same drive.",
)
def coexistence(_lab: Lab) -> Verdict:
    """Check for two kinds of attractor from random starts at w = 7.6."""
    starts = np.random.default_rng(3).normal(size=(60, 3)) * 3
    section = poincare(DLE(7.6), n=24, state0=starts, transient=3000)
    spread = np.ptp(np.abs(section.component("y")), axis=-1)
    simple = spread < 1e-6
    evidence = (
        f"at w = 7.6, {simple.sum()} of 60 random starts end on the symmetric figure-eight, "
        f"{(~simple).sum()} elsewhere "
        f"(|y| at z = 0 spreads over {np.median(spread[~simple]):.2f})"
        if (~simple).any()
        else "all starts end alike at w = 7.6"
    )
    return judged(bool(simple.any() and (~simple).any()), evidence)
