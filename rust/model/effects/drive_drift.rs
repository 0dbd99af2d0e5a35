//! A drive speed that drifts steadily, as on an emptying battery.

use super::{At, Body, EffectParameter, Law, Momentum, Scalar, Slot, Slots, Spec};

/// A drive speed that drifts steadily, as on an emptying battery.
pub struct DriveDrift;

impl Law for DriveDrift {
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
    fn enter<S: Scalar>(p: &[S], at: &At<S>, slots: &mut Slots<S>) {
        slots.vertical += p[0] * at.w * at.t;
    }
}
