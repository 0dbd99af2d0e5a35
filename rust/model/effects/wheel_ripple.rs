use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Momentum, Scalar, Slot, Spec};

/// A drive wheel out of round: its speed varies once per turn, at the rate `W/r`.
pub struct WheelRipple;

impl EffectLaw for WheelRipple {
    const SPEC: Spec = Spec {
        name: "wheel_ripple",
        title: "drive ripple at the wheel's frequency",
        equation: "W_c = W (1 + a cos(phi) + b sin(phi)), phi = W T/r",
        meaning: "the drive wheel is out of round, so that its speed varies once per turn",
        bodies: &[Body::Disk],
        slots: &[Slot::Vertical],
        momenta: &[Momentum::Consistent],
        parameters: &[
            EffectParameter::amplitude("a", "").within(-1.0, 1.0),
            EffectParameter::amplitude("b", "").within(-1.0, 1.0),
            EffectParameter::shape("r", "m", 0.03, &[0.03]).within(1e-3, 0.3),
        ],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        let (sin, cos) = (at.w * at.t / p[2]).sin_cos();
        slots.vertical += at.w * (p[0] * cos + p[1] * sin);
    }
}
