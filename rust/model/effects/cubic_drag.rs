use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Drag that grows with the cube of the speed.
pub struct CubicDrag;

impl EffectLaw for CubicDrag {
    const SPEC: Spec = Spec {
        name: "cubic_drag",
        title: "cubic drag",
        equation: "torque = -c Omega^3",
        meaning: "a resistance that grows with the cube of the speed",
        bodies: &[Body::Disk, Body::Pendulum],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[EffectParameter::amplitude("c", "m^2 s").within(0.0, f64::INFINITY)],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.torque -= p[0] * at.omega.square() * at.omega;
    }
}
