//! A disk whose mass is not centred: gravity's torque follows its orientation.

use super::{At, Body, EffectParameter, Law, Role, Scalar, Slot, Slots, Spec};

/// A disk whose mass is not centred: gravity's torque follows its orientation.
pub struct EccentricMass;

impl Law for EccentricMass {
    const SPEC: Spec = Spec {
        name: "eccentric_mass",
        title: "eccentric mass",
        equation: "torque = a sin(beta) + b cos(beta)",
        meaning: "the disk carries more mass on one side, which gravity turns down",
        bodies: &[Body::Disk],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[
            EffectParameter {
                name: "a",
                unit: "m^2/s^2",
                default: 0.0,
                range: (f64::NEG_INFINITY, f64::INFINITY),
                role: Role::Amplitude,
            },
            EffectParameter {
                name: "b",
                unit: "m^2/s^2",
                default: 0.0,
                range: (f64::NEG_INFINITY, f64::INFINITY),
                role: Role::Amplitude,
            },
        ],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &At<S>, slots: &mut Slots<S>) {
        slots.torque += p[0] * at.beta.sin() + p[1] * at.beta.cos();
    }
}
