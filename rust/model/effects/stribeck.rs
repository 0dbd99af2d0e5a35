use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Dry friction that fades with the speed over the width `fade`. The width `eps` smooths it.
pub struct Stribeck;

impl EffectLaw for Stribeck {
    const SPEC: Spec = Spec {
        name: "stribeck",
        title: "Stribeck friction",
        equation: "torque = -c tanh(Omega/eps) exp(-(Omega/fade)^2)",
        meaning: "dry friction that is strongest near rest and fades as the contact slides faster",
        bodies: &[Body::Disk, Body::Pendulum],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[
            EffectParameter::amplitude("c", "m^2/s^2").within(0.0, f64::INFINITY),
            EffectParameter::shape("fade", "rad/s", 1.0, &[0.3, 1.0, 3.0]).within(0.05, 20.0),
            EffectParameter::shape("eps", "rad/s", 0.05, &[0.05]).within(1e-4, 1.0),
        ],
    };

    const DRY: bool = true;

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        let fading = (-(at.omega / p[1]).square()).exp();
        slots.rub(p[0] * fading, p[0], p[2], at);
    }
}
