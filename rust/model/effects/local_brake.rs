use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Friction near one angle: something that the pendulum, or a place on the disk's rim, rubs against as it passes.
///
/// Near the angle it is `a exp(-((beta - c)/s)^2)`; written with a sine it is the same in every turn.
pub struct LocalBrake;

impl EffectLaw for LocalBrake {
    const SPEC: Spec = Spec {
        name: "local_brake",
        title: "friction near an angle",
        equation: "k = k_plain + a exp(-(2 sin((beta - c)/2)/s)^2); beta is theta for pendulums",
        meaning: "something rubs where the pendulum, or a place on the disk's rim, passes one angle",
        bodies: &[Body::Disk, Body::Pendulum],
        slots: &[Slot::Friction],
        momenta: &[],
        parameters: &[
            EffectParameter::amplitude("a", "m^2/s").within(0.0, f64::INFINITY),
            EffectParameter::scanned("c", "rad", 0.0, "angle"),
            EffectParameter::shape("s", "rad", 0.2, &[0.1, 0.3, 0.8]).within(1e-3, 2.0),
        ],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        let away = (at.beta - p[1]).scale(0.5).sin().scale(2.0) / p[2];
        slots.friction += p[0] * (-away.square()).exp();
    }
}
