use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Friction that settles in the course of a record: of a rubber or a grease that warms, a bearing that runs in.
pub struct WarmingFriction;

impl EffectLaw for WarmingFriction {
    const SPEC: Spec = Spec {
        name: "warming_friction",
        title: "friction that settles with time",
        equation: "k = k_plain + a exp(-T/tau)",
        meaning: "the friction begins off its later value, as of a rubber or a grease that warms",
        bodies: &[Body::Disk, Body::Pendulum],
        slots: &[Slot::Friction],
        momenta: &[],
        parameters: &[
            EffectParameter::amplitude("a", "m^2/s"),
            EffectParameter::scanned("tau", "s", 20.0, "duration").within(0.1, 1e4),
        ],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.friction += p[0] * (-at.t / p[1]).exp();
    }
}
