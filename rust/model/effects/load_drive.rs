use super::{Body, Contributions, EffectInputs, EffectLaw, EffectParameter, Momentum, Scalar, Slot, Spec};

/// A motor that slows under load: the load is the plain model's vertical force on the contact.
pub struct LoadDrive;

impl EffectLaw for LoadDrive {
    const SPEC: Spec = Spec {
        name: "load_drive",
        title: "load-dependent drive",
        equation: "W_c = W (1 - a (F/g - 1)), F = g - Z Omega^2 - Y dOmega/dT",
        meaning: "the motor slows when the disk pulls harder on the wheels",
        bodies: &[Body::Disk],
        slots: &[Slot::Vertical],
        momenta: &[Momentum::Consistent],
        parameters: &[EffectParameter::amplitude("a", "").within(0.0, 10.0)],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
        slots.vertical -= p[0] * at.w * at.excess_load();
    }
}
