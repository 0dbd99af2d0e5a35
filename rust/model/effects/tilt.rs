use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Gravity and drive that are not parallel: an angle `a` between them.
///
/// The tilt of the picture belongs to the camera and is fitted separately, so a tilted gravity and a tilted drive
/// are one and the same: the world turned by `a`.
pub struct Tilt;

impl EffectLaw for Tilt {
    const SPEC: Spec = Spec {
        name: "tilt",
        title: "tilt between gravity and drive",
        equation: "torque = a g Z",
        meaning: "the wheels do not drive the disk straight up against gravity (only the angle between the two can be known)",
        bodies: &[Body::Disk],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[EffectParameter::amplitude("a", "rad").within(-0.5, 0.5)],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.torque += p[0] * at.g * at.z;
    }
}
