use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Momentum, Scalar, Slot, Spec};

/// Sideways slip of the disk in proportion to the lateral offset of its centre.
pub struct LateralSlip;

impl EffectLaw for LateralSlip {
    const SPEC: Spec = Spec {
        name: "lateral_slip",
        title: "lateral slip",
        equation: "u = -c Y",
        meaning: "the disk slips sideways in the contact, towards its centre line",
        bodies: &[Body::Disk],
        slots: &[Slot::Lateral],
        momenta: &[Momentum::Constraint, Momentum::Consistent],
        parameters: &[EffectParameter::amplitude("c", "1/s")],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.lateral -= p[0] * at.y;
    }
}
