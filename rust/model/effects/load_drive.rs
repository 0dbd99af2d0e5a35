//! A motor that slows under load: the load is the vertical force on the contact, `F = g + d^2Z/dT^2`, taken from the plain model.

use super::{EffectInputs, Body, EffectParameter, EffectLaw, Momentum, Scalar, Slot, Contributions, Spec};

/// A motor that slows under load: the load is the vertical force on the contact, `F = g + d^2Z/dT^2`, taken from the plain model.
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
