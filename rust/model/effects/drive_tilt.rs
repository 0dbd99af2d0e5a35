//! A drive tilted by the angle `a` against gravity; only the angle between gravity and drive can be known.

use super::{At, EffectParameter, Law, Momentum, Role, Scalar, Slot, Slots, Spec};

/// A drive tilted by the angle `a` against gravity; only the angle between gravity and drive can be known.
pub struct DriveTilt;

impl Law for DriveTilt {
    const SPEC: Spec = Spec {
        name: "drive_tilt",
        title: "tilt of the drive",
        equation: "u = a W",
        meaning: "the wheels drive the disk at a small angle to the vertical",
        slots: &[Slot::Lateral],
        momenta: &[Momentum::Consistent],
        parameters: &[EffectParameter { name: "a", unit: "rad", default: 0.0, range: (-0.5, 0.5), role: Role::Amplitude }],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &At<S>, slots: &mut Slots<S>) {
        slots.lateral += p[0] * at.w;
    }
}
