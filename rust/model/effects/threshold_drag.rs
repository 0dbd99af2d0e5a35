use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Drag that begins at a speed: of a brake that flies out, of a flow that separates.
///
/// The corner is rounded off over 0.05 rad/s.
pub struct ThresholdDrag;

const ROUND: f64 = 0.05;

impl EffectLaw for ThresholdDrag {
    const SPEC: Spec = Spec {
        name: "threshold_drag",
        title: "drag above a speed",
        equation: "k = k_plain + a max(|Omega| - c, 0)",
        meaning: "a resistance begins where the body turns faster than a certain speed",
        bodies: &[Body::Disk, Body::Pendulum],
        slots: &[Slot::Friction],
        momenta: &[],
        parameters: &[
            EffectParameter::amplitude("a", "m^2").within(0.0, f64::INFINITY),
            EffectParameter::scanned("c", "rad/s", 1.0, "speed").within(0.0, 100.0),
        ],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        let above = at.speed - p[1];
        let rounded = (above.square() + S::constant(ROUND * ROUND)).sqrt();
        slots.friction += p[0] * (above + rounded).scale(0.5);
    }
}
