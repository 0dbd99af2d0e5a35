"""Claims about the steadily rotating states."""

from __future__ import annotations

import functools

import numpy as np

from udd.ensembles import ensemble
from udd.models import DLE
from udd.paper import device
from udd.paper.figures.rotation import hopf_of_disk
from udd.paper.lab import Lab
from udd.paper.linear import eigenvalues, growth
from udd.paper.registry import Verdict, claim, judged

_UNITS = (1.0, 1.0, 1.0)
_SIZES = (4.0, 0.01, 0.01)


def _is_rotating(states: np.ndarray, w: float, within: float = 1e-3) -> np.ndarray:
    """Which states are one of the rotating ones."""
    goal = np.array([np.sqrt(w), np.sqrt(w), 0.0])
    mirror = goal * [-1, -1, 1]
    near = [np.abs(states - one).max(axis=-1) < within for one in (goal, mirror)]
    result: np.ndarray = near[0] | near[1]
    return result


@claim(
    "unstable-rotation",
    place="Section 5 E",
    says="The rotating states of the DLE are unstable at every drive: one negative real eigenvalue and a "
    "growing pair.",
)
def unstable_rotation(_lab: Lab) -> Verdict:
    """The cubic's roots over six decades, and the rates' Jacobian."""
    drives = np.geomspace(1e-3, 1e3, 400)
    roots = [np.roots([1, 1, w, 2 * w]) for w in drives]
    least = min(root.real.max() for root in roots)
    shape = all((np.abs(root.imag) > 0).sum() == 2 and root.real.min() < 0 for root in roots)
    own = eigenvalues(DLE(3.9), device.rotating_dle(DLE(3.9)), _UNITS)
    gap = np.abs(np.sort_complex(own) - np.sort_complex(np.roots([1, 1, 3.9, 7.8]))).max()
    evidence = (
        f"the pair's real part is positive from w = 1e-3 ({least:.1e}) to 1e3; the cubic's roots at 3.9 "
        "are the "
        f"Jacobian's eigenvalues to {gap:.0e}"
    )
    return judged(least > 0 and shape and gap < 1e-8, evidence)


@claim(
    "unstable-rotation-disk",
    place="Section 5 E",
    says="The full moment of inertia and friction do not make the rotating states stable (not shown there).",
)
def unstable_rotation_disk(_lab: Lab) -> Verdict:
    """Growth rates of the full disk."""
    drives = np.linspace(0.005, 0.3, 60)
    rates = [growth(device.disk(float(W)), device.rotating(float(W)), _SIZES) for W in drives]
    k = int(np.argmin(rates))
    evidence = (
        f"from 0.5 to 30 cm/s the growth rate is positive, least {rates[k]:.2f} /s at "
        f"{100 * drives[k]:.1f} cm/s"
    )
    return judged(min(rates) > 0, evidence)


@claim(
    "rotation-approximation",
    place="Section 5 E",
    says="In the rotating states R is much smaller than the disk's radius, and k is constant.",
)
def rotation_approximation(_lab: Lab) -> Verdict:
    """At the paper's drives."""
    found = {W: device.rotating(W) for W in (0.014, 0.039, 0.055, 0.071, 0.088)}
    far = max(y for _, y, _ in found.values()) / device.R
    slow = min(omega for omega, _, _ in found.values())
    evidence = (
        f"Y is at most {far:.1%} of the radius, |Ω| at least {slow:.2f} rad/s (the kink is at "
        f"{device.KINK:.2f})"
    )
    return judged(far < 0.2 and slow > device.KINK, evidence)


@claim(
    "damping-stabilises",
    place="Section 5 E",
    says="With B = 0.2 the rotating states are stable above a minimal drive.",
)
def damping_stabilises(_lab: Lab) -> Verdict:
    """Where the growth rate vanishes, against the closed form; and for the full disk."""
    from scipy.optimize import brentq

    def rate(w: float) -> float:
        model = DLE(w, B=device.B)
        return growth(model, device.rotating_dle(model), _UNITS)

    found = brentq(rate, 2.0, 5.0, xtol=1e-12)
    closed = device.hopf_drive(device.B)
    disk = hopf_of_disk(device.B / device.L)
    evidence = (
        f"the growth rate vanishes at w = {found:.8f}; closed form (1 − B)/(B (1 + B)) = {closed:.8f}. "
        "The full disk with "
        f"b = B/L = {device.B / device.L:.1f} /m: W = {100 * disk:.2f} cm/s"
    )
    return judged(abs(found - closed) < 1e-7 and rate(found + 0.1) < 0 < rate(found - 0.1), evidence)


@functools.cache
def _kept_below() -> tuple[float, int, int]:
    """Of starts close to the rotating state, 1 % below the minimal drive, how many are still there."""
    w = 0.99 * device.hopf_drive(device.B)
    near = np.random.default_rng(0).normal(size=(200, 3)) * 0.05 + [np.sqrt(w), np.sqrt(w), 0]
    ends = ensemble(DLE(w, B=device.B), 10_000.0, near, rtol=1e-8).end
    return w, int(_is_rotating(ends, w, 0.1).sum()), len(near)


@claim(
    "stable-below",
    place="Section 5 E",
    says="The rotation's stability to finite disturbances may extend even below the minimal drive.",
)
def stable_below(_lab: Lab) -> Verdict:
    """No start near it stays below the minimal drive; above it a finite basin."""
    w, kept, of = _kept_below()
    model = DLE(w, B=device.B)
    rate = growth(model, device.rotating_dle(model), _UNITS)
    caught = []
    for z in np.arange(0.0, 4.0, 0.1):
        start = [*device.rotating_dle(DLE(3.7, B=device.B))[:2], -z]
        end = ensemble(DLE(3.7, B=device.B), 1500.0, start).end
        caught.append(bool(_is_rotating(end, 3.7, 0.05)))
    basin = 0.1 * (caught.index(False) - 1) if False in caught else float("nan")
    evidence = (
        f"1 % below w_H the growth rate is {rate:+.4f}, and of {of} starts within 0.05 of the rotation "
        f"{kept} are there at "
        f"t = 10,000. Above, at w = 3.7, starts down to z = −{basin:.1f} go to it"
    )
    otherwise = (
        "finite disturbances are survived above w_H only: the Hopf bifurcation is subcritical, an "
        "unstable cycle "
        "bounds the basin there and none guards the rotation below"
    )
    return judged(kept > 0, evidence, otherwise=otherwise)


@functools.cache
def _transients() -> tuple[float, float, bool]:
    """Mean life of the chaos at w = 3.7, B = 0.2, its error, and whether -3.2 and -3.5 part ways."""
    w = 3.7
    model = DLE(w, B=device.B)
    s = np.sqrt(w)
    start = np.array([s, s, -3.5]) + np.random.default_rng(0).normal(size=(200, 3)) * 1e-3
    times = np.linspace(0, 20_000, 401)
    states = ensemble(model, times, start, rtol=1e-7).state
    there = _is_rotating(states, w, 0.05)
    lived = np.where(there.any(axis=1), times[there.argmax(axis=1)], times[-1])
    deaths = int(there.any(axis=1).sum())
    mean = float(lived.sum() / max(deaths, 1))
    early = ensemble(model, 1500.0, np.array([[s, s, -3.2], [s, s, -3.5]])).end
    parted = _is_rotating(early, w, 0.05)
    return mean, mean / np.sqrt(max(deaths, 1)), bool(parted[0] and not parted[1])


@claim(
    "bistable",
    place="Section 5 E, Figure 16 b",
    says="At B = 0.2, w = 3.7 a stable rotation (from z = −3.2) and a chaotic state (from −3.5) exist "
    "together.",
)
def bistable(_lab: Lab) -> Verdict:
    """The two starts, and how long the chaos lives."""
    mean, error, parted = _transients()
    evidence = (
        "the two starts part as said; of 200 orbits from about z = −3.5 the chaos ends in rotation after "
        f"{mean:,.0f} ± {error:,.0f} "
        "units on average"
    )
    remark = "the chaotic orbit is a transient, though a long one: in the end the disk rotates"
    return judged(parted, evidence, remark)


@claim(
    "not-from-rest",
    place="Section 3 C",
    says="The rotating states cannot be reached from rest.",
)
def not_from_rest(_lab: Lab) -> Verdict:
    """Starts at rest all over the disk, with the relaxation of the constraint."""
    from udd.paper.figures.rotation import relaxed

    shares = {}
    for W in (0.06, 0.071, 0.088):
        random = np.random.default_rng(0)
        radius, angle = 0.04 * np.sqrt(random.uniform(0, 1, 300)), random.uniform(0, 2 * np.pi, 300)
        starts = np.stack([0 * radius, radius * np.sin(angle), radius * np.cos(angle), 0 * radius], axis=-1)
        ends = ensemble(relaxed(W, device.B / device.L), 60.0, starts, rtol=1e-7).end
        goal = device.rotating(W)[0]
        shares[W] = float((np.abs(np.abs(ends[:, 0]) - goal) < 0.05 * goal).mean())
    words = ", ".join(f"{share:.0%} at {100 * W:.1f} cm/s" for W, share in shares.items())
    evidence = (
        f"of 300 starts at rest up to 4 cm from the contact, with b = 43.6 /m, rotate after a minute: {words}"
    )
    otherwise = (
        "it was seen on the device, and is nearly so in the model just above the lower bound on W; at "
        "larger drives "
        "the model's swings fall into rotation"
    )
    return judged(max(shares.values()) < 0.01, evidence, otherwise=otherwise)
