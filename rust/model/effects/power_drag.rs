use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Drag that grows with a power of the speed, between and beyond the quadratic and the cubic one.
///
/// Below 1e-3 rad/s the power is rounded off: its slope there may have no end.
pub struct PowerDrag;

const ROUND: f64 = 1e-3;

impl EffectLaw for PowerDrag {
    const SPEC: Spec = Spec {
        name: "power_drag",
        title: "drag with a power of the speed",
        equation: "k = k_plain + a |Omega|^n",
        meaning: "the resistance grows with a power of the speed that is no whole number",
        bodies: &[Body::Disk, Body::Pendulum],
        slots: &[Slot::Friction],
        momenta: &[],
        parameters: &[
            EffectParameter::amplitude("a", "m^2/s").within(0.0, f64::INFINITY),
            EffectParameter::scanned("n", "", 0.5, "power").within(-0.95, 4.0),
        ],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        let squared = at.omega.square() + S::constant(ROUND * ROUND);
        slots.friction += p[0] * (p[1].scale(0.5) * squared.ln()).exp();
    }
}
