use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Friction that grows with the distance of the disk's centre from the contact.
pub struct RadialFriction;

impl EffectLaw for RadialFriction {
    const SPEC: Spec = Spec {
        name: "radial_friction",
        title: "friction growing with the distance",
        equation: "k = k_plain + c (Y^2 + Z^2)",
        meaning: "the contact rubs more the farther the disk's centre is from it",
        bodies: &[Body::Disk],
        slots: &[Slot::Friction],
        momenta: &[],
        parameters: &[EffectParameter::amplitude("c", "1/s")],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.friction += p[0] * (at.y.square() + at.z.square());
    }
}
