"""Claims about the steadily rotating states."""

from __future__ import annotations

import functools

import numpy as np

from udd.bifurcations import continuation
from udd.models import DLE
from udd.paper import device
from udd.paper.branches import RELAXATION, hopf, relaxed, rotation_of_disk, rotation_of_dle
from udd.paper.registry import Verdict, claim, judged
from udd.paper.shared_films import Lab
from udd.simulation.ensembles import ensemble


def _is_rotating(states: np.ndarray, w: float, within: float = 1e-3) -> np.ndarray:
    """Return True for each state close to a rotating one."""
    goal = np.array([np.sqrt(w), np.sqrt(w), 0.0])
    mirror = goal * [-1, -1, 1]
    is_close = [np.abs(states - target).max(axis=-1) < within for target in (goal, mirror)]
    result: np.ndarray = is_close[0] | is_close[1]
    return result


@claim(
    "unstable-rotation",
    place="Section 5 E",
    says="The rotating states of the DLE are unstable at every drive: one negative real eigenvalue and a "
    "growing pair.",
)
def unstable_rotation(_lab: Lab) -> Verdict:
    """Check the branch of rotating states over six decades of the drive, against the cubic."""
    branch = rotation_of_dle(0.0, 1e-3, 1e3)
    pair = branch.multipliers.real.max(axis=1)
    roots = [np.roots([1, 1, w, 2 * w]) for w in branch.values]
    eigenvalues = [np.sort_complex(row) for row in branch.multipliers]
    gap = max(np.abs(row - np.sort_complex(root)).max() for row, root in zip(eigenvalues, roots, strict=True))
    real = branch.multipliers.real.min(axis=1)
    evidence = (
        f"on the branch from w = 1e-3 to 1e3 the pair's real part is at least {pair.min():.1e}, the real "
        "eigenvalue "
        f"at most {real.max():.2f}; all agree with the cubic to {gap:.0e}"
    )
    return judged(bool(pair.min() > 0 and real.max() < 0 and not branch.stable.any()), evidence)


@claim(
    "unstable-rotation-disk",
    place="Section 5 E",
    says="The full moment of inertia and friction do not make the rotating states stable (not shown there).",
)
def unstable_rotation_disk(_lab: Lab) -> Verdict:
    """Check growth rates of the full disk along its branch."""
    branch = rotation_of_disk(0.0, low=0.005)
    rates = branch.multipliers.real.max(axis=1)
    k = int(np.argmin(rates))
    evidence = (
        f"from {100 * branch.values.min():.1f} to {100 * branch.values.max():.0f} cm/s the growth rate is "
        "positive, "
        f"least {rates[k]:.2f} /s at {100 * branch.values[k]:.1f} cm/s"
    )
    return judged(not branch.stable.any(), evidence)


@claim(
    "rotation-approximation",
    place="Section 5 E",
    says="In the rotating states R is much smaller than the disk's radius, and k is constant.",
)
def rotation_approximation(_lab: Lab) -> Verdict:
    """Check at the paper's drives."""
    states = {W: device.rotating(W) for W in (0.014, 0.039, 0.055, 0.071, 0.088)}
    far = max(y for _, y, _ in states.values()) / device.R
    slow = min(omega for omega, _, _ in states.values())
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
    """Check the Hopf point on the branch against the closed form, and for the full disk."""
    branch = rotation_of_dle(device.B)
    point, disk = hopf(branch), hopf(rotation_of_disk(RELAXATION))
    if point is None or disk is None:
        return judged(False, "no Hopf bifurcation was found")
    closed = device.hopf_drive(device.B)
    evidence = (
        f"Hopf bifurcation at w = {point.value:.10f} with the frequency {point.frequency:.8f}; closed forms "
        f"(1 − B)/(B (1 + B)) = {closed:.10f} and √((1 − B)/B) = 2. The full disk with b = B/L = "
        f"{RELAXATION:.1f} /m: "
        f"W = {100 * disk.value:.3f} cm/s"
    )
    above = bool(branch.stable[branch.values > point.value].all())
    below = bool(branch.stable[branch.values < point.value].any())
    return judged(abs(point.value - closed) < 1e-10 and above and not below, evidence)


@functools.cache
def _kept_below() -> tuple[int, int]:
    """Count starts close to the rotating state, 1 % below the minimal drive, that stay there."""
    w = 0.99 * device.hopf_drive(device.B)
    starts = np.random.default_rng(0).normal(size=(200, 3)) * 0.05 + [np.sqrt(w), np.sqrt(w), 0]
    ends = ensemble(DLE(w, B=device.B), 10_000.0, starts, rtol=1e-8).end
    return int(_is_rotating(ends, w, 0.1).sum()), len(starts)


@claim(
    "stable-below",
    place="Section 5 E",
    says="The rotation's stability to finite disturbances may extend even below the minimal drive.",
)
def stable_below(_lab: Lab) -> Verdict:
    """Check that the Hopf bifurcation is subcritical: its cycles are above it, and unstable."""
    point = hopf(rotation_of_dle(device.B))
    if point is None:
        return judged(False, "no Hopf bifurcation was found")
    cycles = continuation(point, bounds=(2.0, 4.0))
    kept, of = _kept_below()
    evidence = (
        f"the Hopf bifurcation is {point.criticality} (first Lyapunov coefficient "
        f"{point.lyapunov_coefficient:.3e}). Its cycles exist at w = {cycles.values.min():.4f} to "
        f"{cycles.values.max():.2f} and {'some are stable' if cycles.stable.any() else 'are unstable'}. 1 % "
        f"below w_H, {kept} of {of} starts within 0.05 of the rotation are there at t = 10,000"
    )
    otherwise = (
        "the rotation survives finite disturbances above w_H only, within the unstable cycle that bounds its "
        "basin; below, nothing stabilises it"
    )
    return judged(kept > 0 or bool(cycles.stable.any()), evidence, otherwise=otherwise)


_SOON = 1500.0


@functools.cache
def _transients() -> tuple[float, float, float, float]:
    """Return the mean life of chaos at w = 3.7, its error, and the shares that soon rotate."""
    w = 3.7
    model = DLE(w, B=device.B)
    s = np.sqrt(w)
    offsets = np.random.default_rng(0).normal(size=(200, 3)) * 1e-3
    times = np.linspace(0, 20_000, 401)
    states = ensemble(model, times, np.array([s, s, -3.5]) + offsets, rtol=1e-7).state
    there = _is_rotating(states, w, 0.05)
    lived = np.where(there.any(axis=1), times[there.argmax(axis=1)], times[-1])
    deaths = int(there.any(axis=1).sum())
    mean = float(lived.sum() / max(deaths, 1))
    regular = ensemble(model, _SOON, np.array([s, s, -3.2]) + offsets, rtol=1e-7).end
    from_regular = float(_is_rotating(regular, w, 0.05).mean())
    return mean, mean / np.sqrt(max(deaths, 1)), from_regular, float((lived <= _SOON).mean())


@claim(
    "bistable",
    place="Section 5 E, Figure 16 b",
    says="At B = 0.2, w = 3.7 a stable rotation (from z = −3.2) and a chaotic state (from −3.5) exist "
    "together.",
)
def bistable(_lab: Lab) -> Verdict:
    """Check starts close to the two, and the life of the chaos."""
    mean, error, low, high = _transients()
    parted = low > 0.99 and high < 0.3
    evidence = (
        f"of 200 orbits from about z = −3.2 rotate at t = {_SOON:,.0f}: {low:.0%}; from about z = −3.5: "
        f"{high:.0%}, and their chaos ends in rotation after {mean:,.0f} ± {error:,.0f} units on average"
    )
    remark = "the chaotic orbit is a transient, though a long one: in the end the disk rotates"
    return judged(parted, evidence, remark)


@claim(
    "not-from-rest",
    place="Section 3 C",
    says="The rotating states cannot be reached from rest.",
)
def not_from_rest(_lab: Lab) -> Verdict:
    """Check starts at rest all over the disk, with the relaxation of the constraint."""
    shares = {}
    for W in (0.06, 0.071, 0.088):
        random = np.random.default_rng(0)
        radius, angle = 0.04 * np.sqrt(random.uniform(0, 1, 300)), random.uniform(0, 2 * np.pi, 300)
        starts = np.stack([0 * radius, radius * np.sin(angle), radius * np.cos(angle), 0 * radius], axis=-1)
        ends = ensemble(relaxed(W, RELAXATION), 60.0, starts, rtol=1e-7).end
        goal = device.rotating(W)[0]
        shares[W] = float((np.abs(np.abs(ends[:, 0]) - goal) < 0.05 * goal).mean())
    words = ", ".join(f"{share:.0%} at {100 * W:.1f} cm/s" for W, share in shares.items())
    evidence = (
        f"of 300 starts at rest up to 4 cm from the contact, with b = 43.6 /m, rotate after a minute: {words}"
    )
    otherwise = (
        "the device showed it, and it nearly holds in the model just above the lower bound on W; at larger "
        "drives the model's swings turn into rotation"
    )
    return judged(max(shares.values()) < 0.01, evidence, otherwise=otherwise)
