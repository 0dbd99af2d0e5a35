use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Scalar, Slot, Spec};

/// Dry friction in proportion to the load on a pendulum's pivot.
///
/// The rod pulls the pivot with `F/g = cos theta + l Omega^2/g`, the weight's part along it and what keeps the bob on
/// its circle. Friction brakes under a push as under a pull, so that the size counts, rounded off within 1e-3 of the
/// weight.
pub struct LoadCoulomb;

/// A share of the weight: within it the size of the load is rounded off at a change of sign.
const ROUND: f64 = 1e-3;

impl EffectLaw for LoadCoulomb {
    const SPEC: Spec = Spec {
        name: "load_coulomb",
        title: "dry friction growing with the load",
        equation: "torque = -f |cos(theta) + l Omega^2/g| tanh(Omega/eps)",
        meaning: "dry friction grows with the force of the rod on the pivot",
        bodies: &[Body::Pendulum],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[
            EffectParameter::amplitude("f", "m^2/s^2").within(0.0, f64::INFINITY),
            EffectParameter::shape("eps", "rad/s", 0.05, &[0.05]).within(1e-4, 1.0),
        ],
    };

    const DRY: bool = true;

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        let load = at.beta.cos() + at.radius * at.omega.square() / at.g;
        let load = (load.square() + S::constant(ROUND * ROUND)).sqrt();
        slots.rub(p[0] * load, p[0], p[1], at);
    }
}
