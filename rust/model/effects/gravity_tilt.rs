//! Gravity tilted by the angle `a` against the plane's vertical; only the angle between gravity and drive can be known.

use super::{At, EffectParameter, Law, Role, Scalar, Slot, Slots, Spec};

/// Gravity tilted by the angle `a` against the plane's vertical; only the angle between gravity and drive can be known.
pub struct GravityTilt;

impl Law for GravityTilt {
    const SPEC: Spec = Spec {
        name: "gravity_tilt",
        title: "tilt of gravity",
        equation: "torque = a g Z",
        meaning: "gravity and the picture's vertical differ by a small angle",
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[EffectParameter { name: "a", unit: "rad", default: 0.0, range: (-0.5, 0.5), role: Role::Amplitude }],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &At<S>, slots: &mut Slots<S>) {
        slots.torque += p[0] * at.g * at.z;
    }
}
