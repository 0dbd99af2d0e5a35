use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Momentum, Scalar, Slot, Spec};

/// Slip along OC in proportion to gravity's component along it (the paper's section IV B).
///
/// The direction is softened within 1 mm of the centre.
pub struct RadialSlip;

impl EffectLaw for RadialSlip {
    const SPEC: Spec = Spec {
        name: "radial_slip",
        title: "slip along gravity's radial component",
        equation: "(u, W_c - W) = -c Z (Y, Z)/(Y^2 + Z^2)",
        meaning: "the disk slips along the line from contact to centre, pulled by gravity's component along it",
        bodies: &[Body::Disk],
        slots: &[Slot::Lateral, Slot::Vertical],
        momenta: &[Momentum::Constraint, Momentum::Consistent],
        parameters: &[EffectParameter::amplitude("c", "m/s").within(0.0, f64::INFINITY)],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        let pull = p[0] * at.z / (at.y.square() + at.z.square() + S::constant(1e-6));
        slots.lateral -= pull * at.y;
        slots.vertical -= pull * at.z;
    }
}
