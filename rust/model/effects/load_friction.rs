use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Friction that grows with the load on the wheels, the hypothesis with which the paper ends.
///
/// Per unit mass, the contact's force along the drive carries the weight and accelerates the centre of mass, so that
/// `F = g + d^2Z/dT^2`. With the rolling constraint `dZ/dT = -Y Omega + W` and `dY/dT = Z Omega`,
///
/// ```text
/// d^2Z/dT^2 = -Omega dY/dT - Y dOmega/dT = -Z Omega^2 - Y dOmega/dT
/// F/g - 1   = -(Z Omega^2 + Y dOmega/dT)/g,      I dOmega/dT = g Y - k Omega - W Z Omega
/// ```
///
/// with the plain model's `dOmega/dT`: what the effect itself adds to the load is of second order in `a`. If
/// the disk hangs below the contact and swings, `F > g`. At rest and in steady rotation (`Z = 0`, `Omega` constant)
/// the load is the weight, and nothing changes there.
pub struct LoadFriction;

impl EffectLaw for LoadFriction {
    const SPEC: Spec = Spec {
        name: "load_friction",
        title: "load-dependent friction",
        equation: "k = k_plain (1 + a (F/g - 1)), F = g - Z Omega^2 - Y dOmega/dT",
        meaning: "the friction grows with the force between the wheels and the disk",
        bodies: &[Body::Disk],
        slots: &[Slot::Friction],
        momenta: &[],
        parameters: &[EffectParameter::amplitude("a", "").within(0.0, 10.0)],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.friction += p[0] * at.k * at.excess_load();
    }
}
