use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// A disk whose mass is not centred: gravity's torque follows its orientation.
pub struct EccentricMass;

impl EffectLaw for EccentricMass {
    const SPEC: Spec = Spec {
        name: "eccentric_mass",
        title: "eccentric mass",
        equation: "torque = a sin(beta) + b cos(beta)",
        meaning: "the disk carries more mass on one side, which gravity turns down",
        bodies: &[Body::Disk],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[EffectParameter::amplitude("a", "m^2/s^2"), EffectParameter::amplitude("b", "m^2/s^2")],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        let (sin, cos) = at.beta.sin_cos();
        slots.torque += p[0] * sin + p[1] * cos;
    }
}
