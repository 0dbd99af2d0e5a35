use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Momentum, Scalar, Slot, Spec};

/// Slip of the disk between the wheels in proportion to the height of its centre.
pub struct Slip;

impl EffectLaw for Slip {
    const SPEC: Spec = Spec {
        name: "slip",
        title: "slip c Z",
        equation: "W_c = W - c Z",
        meaning: "the disk slips between the wheels, down when its centre is above them",
        bodies: &[Body::Disk],
        slots: &[Slot::Vertical],
        momenta: &[Momentum::Constraint, Momentum::Consistent],
        parameters: &[EffectParameter::amplitude("c", "1/s")],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.vertical -= p[0] * at.z;
    }
}
