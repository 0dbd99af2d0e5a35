use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Dry friction of constant size. The width `eps` smooths it, so that it can be fitted.
pub struct Coulomb;

impl EffectLaw for Coulomb {
    const SPEC: Spec = Spec {
        name: "coulomb",
        title: "Coulomb friction",
        equation: "torque = -c tanh(Omega/eps)",
        meaning: "dry friction whose size does not depend on the speed",
        bodies: &[Body::Disk, Body::Pendulum],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[
            EffectParameter::amplitude("c", "m^2/s^2").within(0.0, f64::INFINITY),
            EffectParameter::shape("eps", "rad/s", 0.05, &[0.05]).within(1e-4, 1.0),
        ],
    };

    const DRY: bool = true;

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.rub(p[0], p[0], p[1], at);
    }
}
