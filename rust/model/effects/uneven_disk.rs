use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// A disk that is not the same all round: a torque that repeats `n` times per turn.
///
/// A warped disk, for example, is squeezed twice per turn by the wheels that hold it. The first
/// harmonic is an [eccentric mass](super::EccentricMass).
pub struct UnevenDisk;

impl EffectLaw for UnevenDisk {
    const SPEC: Spec = Spec {
        name: "uneven_disk",
        title: "uneven disk",
        equation: "torque = a sin(n beta) + b cos(n beta)",
        meaning: "the disk is warped or uneven, so that the wheels push it towards preferred orientations",
        bodies: &[Body::Disk],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[
            EffectParameter::amplitude("a", "m^2/s^2"),
            EffectParameter::amplitude("b", "m^2/s^2"),
            EffectParameter::shape("n", "", 2.0, &[2.0, 3.0, 4.0]).within(2.0, 12.0),
        ],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        let (sin, cos) = (p[2] * at.beta).sin_cos();
        slots.torque += p[0] * sin + p[1] * cos;
    }
}
