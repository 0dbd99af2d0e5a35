use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Air drag that grows with the square of the speed.
pub struct QuadraticDrag;

impl EffectLaw for QuadraticDrag {
    const SPEC: Spec = Spec {
        name: "quadratic_drag",
        title: "quadratic drag",
        equation: "torque = -c |Omega| Omega",
        meaning: "the air resists with the square of the speed",
        bodies: &[Body::Disk, Body::Pendulum],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[EffectParameter::amplitude("c", "m^2").within(0.0, f64::INFINITY)],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.torque -= p[0] * at.speed * at.omega;
    }
}
