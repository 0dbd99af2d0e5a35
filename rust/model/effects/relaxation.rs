use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Momentum, Scalar, Slot, Spec};

/// Relaxation of the rolling constraint: the wheels lift less the higher the centre (the paper's `B = b L`).
pub struct Relaxation;

impl EffectLaw for Relaxation {
    const SPEC: Spec = Spec {
        name: "relaxation",
        title: "relaxation of the rolling constraint",
        equation: "W_c = W - b W Z",
        meaning: "the wheels lift the disk less when its centre is above them, in proportion to the drive",
        bodies: &[Body::Disk],
        slots: &[Slot::Vertical],
        momenta: &[Momentum::Constraint, Momentum::Consistent],
        parameters: &[EffectParameter::amplitude("b", "1/m")],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.vertical -= p[0] * at.w * at.z;
    }
}
