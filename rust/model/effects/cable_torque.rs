use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// A cable or thread that winds up with the disk's orientation.
pub struct CableTorque;

impl EffectLaw for CableTorque {
    const SPEC: Spec = Spec {
        name: "cable_torque",
        title: "cable torque",
        equation: "torque = -kappa beta + c",
        meaning: "something elastic winds up as the disk turns and pulls it back",
        bodies: &[Body::Disk, Body::Pendulum],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[
            EffectParameter::amplitude("kappa", "m^2/s^2").within(0.0, f64::INFINITY),
            EffectParameter::amplitude("c", "m^2/s^2"),
        ],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.torque += p[1] - p[0] * at.beta;
    }
}
