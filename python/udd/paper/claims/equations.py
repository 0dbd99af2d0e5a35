"""Claims about the equations themselves, the scales, and the swings without a drive."""

from __future__ import annotations

import numpy as np

from udd.models import Disk
from udd.paper import device
from udd.paper.registry import Verdict, claim, judged
from udd.paper.shared_films import Lab
from udd.simulation.trajectory import simulate


@claim(
    "limits",
    place="Section 4 A",
    says="Without a drive R is constant; without gravity Y and the orientation are, and Z = Z₀ + W T.",
)
def limits(_lab: Lab) -> Verdict:
    """Check the two limiting cases of the kinematic equations."""
    still = simulate(device.disk(0.0), np.linspace(0, 5, 501), device.ZERO_START, method="taylor")
    radius = np.ptp(np.hypot(still.Y, still.Z))
    light = simulate(device.disk(0.039).replace(g=0.0), np.linspace(0, 1, 101), [0, 0.02, -0.02, 0])
    off = np.abs(
        light.state - np.stack([0 * light.t, 0 * light.t + 0.02, -0.02 + 0.039 * light.t, 0 * light.t], 1)
    )
    evidence = (
        f"in runs R is constant to {radius:.0e} m, and Y, Z, β agree with the formulas to {off.max():.0e}"
    )
    return judged(radius < 1e-9 and off.max() < 1e-12, evidence)


@claim(
    "angular-momentum",
    place="Section 4 B",
    says="dJ/dT = g Y − k Ω with J = I Ω − W Y is the same as I dΩ/dT = g Y − k Ω − W Z Ω.",
)
def angular_momentum(_lab: Lab) -> Verdict:
    """Check J from the angular velocity's equation against the torque."""
    model = device.disk(0.039)
    states = np.random.default_rng(0).normal(size=(1000, 4)) * [5, 0.02, 0.02, 1]
    omega, y, z = states[:, 0], states[:, 1], states[:, 2]
    spin, dy, dz, _ = model.rates(0.0, states).T
    inertia = device.R**2 / 2 + y**2 + z**2
    change = inertia * spin + 2 * (y * dy + z * dz) * omega - model.W * dy
    friction = np.maximum(device.K1 - device.K2 * np.abs(omega), device.K0)
    gap = np.abs(change - (device.G * y - friction * omega)).max() / np.abs(change).max()
    return judged(gap < 1e-12, f"at 1000 random states both agree to {gap:.0e} of the largest torque")


@claim("scales", place="Section 5 C", says="L = 4.6 mm and τ = 0.27 s, so that z = 10 is Z = 4.6 cm.")
def scales(_lab: Lab) -> Verdict:
    """Check the scales from the constants."""
    L, tau = device.L, device.TAU
    evidence = f"L = {1e3 * L:.6f} mm, τ = {tau:.7f} s, 10 L = {1e3 * L:.3f} cm"
    return judged(round(1e3 * L, 1) == 4.6 and round(tau, 2) == 0.27, evidence)


@claim(
    "converted-drives",
    place="Section 5 C",
    says="The drives 3.9, 4.5 and 7.1 of the DLE are 6.7, 7.8 and 12.3 cm/s.",
)
def converted_drives(_lab: Lab) -> Verdict:
    """Check W = w L/tau."""
    converted = [100 * w * device.L / device.TAU for w in device.DLE_DRIVES]
    gap = max(abs(value - said) for value, said in zip(converted, (6.7, 7.8, 12.3), strict=True))
    words = ", ".join(f"{value:.2f}" for value in converted)
    remark = "the last digit of the second and third is one too high: 7.7 and 12.2" if gap > 0.05 else ""
    return judged(gap < 0.1, f"W = w L/τ gives {words} cm/s", remark)


@claim(
    "drive-range",
    place="Section 2 A",
    says="The drive wheel has a radius of 3 cm and turns at 0.3 to 3 rad/s.",
)
def drive_range(_lab: Lab) -> Verdict:
    """Check W = rate x radius, and the paper's drives."""
    low, high = (Disk.from_wheel(rate).W for rate in (0.3, 3.0))
    used = (device.SLOW, *device.DRIVES, 0.088)
    evidence = (
        f"W from {100 * low:.1f} to {100 * high:.1f} cm/s; the paper's drives are "
        f"{', '.join(f'{100 * W:.1f}' for W in used)} cm/s, the wheel at {min(used) / 0.03:.2f} to "
        f"{max(used) / 0.03:.2f} rad/s"
    )
    remark = "the fastest, of its video 3, is near the end of the motor's range"
    return judged(all(low <= W <= high for W in used), evidence, remark)


@claim(
    "zero-drive-swings",
    place="Section 3 A",
    says="Without a drive the motion dies out after 3–4 oscillations.",
)
def zero_drive_swings(_lab: Lab) -> Verdict:
    """Count turning points larger than a millimetre."""
    run = simulate(device.disk(0.0), np.linspace(0, 6, 12001), device.ZERO_START, method="taylor")
    turns = np.flatnonzero(run.Omega[1:-1] * run.Omega[2:] < 0) + 1
    large = turns[np.abs(run.Y[turns]) > 1e-3]
    count = len(large) / 2
    places = ", ".join(f"{1e3 * y:.1f}" for y in run.Y[turns][:6])
    evidence = (
        f"the computed swings turn at Y = {places} mm: {count:g} to {count + 1:g} oscillations above a "
        f"millimetre"
    )
    return judged(2 <= count <= 4, evidence)


@claim(
    "constant-inertia",
    place="Section 5 A",
    says="The fitted orbit without a drive uses a constant moment of inertia I_O.",
)
def constant_inertia(_lab: Lab) -> Verdict:
    """Check I_O alone against I_C + I_O."""
    full = device.R**2 / 2 + 0.058**2
    times = []
    for inertia in (full, 0.058**2):
        # Without I_C: a disk so small that only the distance counts, with the same friction.
        model = device.disk(0.0).replace(R=np.sqrt(2 * (inertia - 0.058**2)) or 1e-9, edge="ignore")
        run = simulate(model, np.linspace(0, 2, 20001), device.ZERO_START, method="taylor")
        times.append(run.t[np.flatnonzero(run.Omega[1:-1] * run.Omega[2:] < 0)[0] + 1])
    evidence = (
        f"the first swing ends at {times[0]:.3f} s with I_C + I_O, at {times[1]:.3f} s with I_O alone; "
        "k₀, k₁ and k₂ belong to the former"
    )
    remark = "the paper must mean I_C + I_O, which is constant without a drive"
    return judged(times[0] > 1.1 * times[1], evidence, remark)


@claim(
    "friction-law",
    place="Section 5 A",
    says="k = max(k₁ − k₂|Ω|, k₀) with k₀ = 0.012, k₁ = 0.103, k₂ = 0.055 fits the swings without a drive.",
    filmed=True,
)
def friction_law(lab: Lab) -> Verdict:
    """Check the package's own fit of a film that was made with this law."""
    fit = lab.friction_fit()
    law = {"k0": device.K0, "k1": device.K1, "k2": device.K2}
    parts = [f"{name} = {fit.parameters[name]:.5f} ± {fit.errors[name]:.5f}" for name in law]
    far = max(abs(fit.parameters[name] - value) / fit.errors[name] for name, value in law.items())
    evidence = (
        f"from the film: {', '.join(parts)}; at most {far:.1f} standard errors from the law it was made with"
    )
    remark = "the paper's own recordings are not at hand: this is a check of the package on itself"
    return judged(far < 3, evidence, remark)
