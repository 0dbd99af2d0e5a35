use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Momentum, Scalar, Slot, Spec};

/// A drive speed that varies periodically at a frequency of its own.
pub struct DriveRipple;

impl EffectLaw for DriveRipple {
    const SPEC: Spec = Spec {
        name: "drive_ripple",
        title: "drive ripple",
        equation: "W_c = W (1 + a cos(phi) + b sin(phi)), phi = 2 pi f T",
        meaning: "the motor or its gears make the drive speed vary at a steady frequency",
        bodies: &[Body::Disk],
        slots: &[Slot::Vertical],
        momenta: &[Momentum::Consistent],
        parameters: &[
            EffectParameter::amplitude("a", "").within(-1.0, 1.0),
            EffectParameter::amplitude("b", "").within(-1.0, 1.0),
            EffectParameter::frequency("f", "Hz", 1.0).within(0.01, 12.0),
        ],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        let (sin, cos) = (p[2] * at.t).scale(std::f64::consts::TAU).sin_cos();
        slots.vertical += at.w * (p[0] * cos + p[1] * sin);
    }
}
