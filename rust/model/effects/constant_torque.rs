use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// A torque that never changes.
pub struct ConstantTorque;

impl EffectLaw for ConstantTorque {
    const SPEC: Spec = Spec {
        name: "constant_torque",
        title: "constant torque",
        equation: "torque = c",
        meaning: "something turns the disk always the same way",
        bodies: &[Body::Disk, Body::Pendulum],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[EffectParameter::amplitude("c", "m^2/s^2")],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], _at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.torque += p[0];
    }
}
