use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Momentum, Scalar, Slot, Spec};

/// A drive speed that drifts steadily, as on an emptying battery.
pub struct DriveDrift;

impl EffectLaw for DriveDrift {
    const SPEC: Spec = Spec {
        name: "drive_drift",
        title: "drive drift",
        equation: "W_c = W (1 + a T)",
        meaning: "the drive slows down or speeds up over the record, as on an emptying battery",
        bodies: &[Body::Disk],
        slots: &[Slot::Vertical],
        momenta: &[Momentum::Consistent],
        parameters: &[EffectParameter::amplitude("a", "1/s")],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.vertical += p[0] * at.w * at.t;
    }
}
