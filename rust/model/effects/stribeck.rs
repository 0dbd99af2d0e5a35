//! Dry friction that fades with the speed over the width `fade`, smoothed over the width `eps`.

use super::{At, Body, EffectParameter, Law, Role, Scalar, Slot, Slots, Spec};

/// Dry friction that fades with the speed over the width `fade`, smoothed over the width `eps`.
pub struct Stribeck;

impl Law for Stribeck {
    const SPEC: Spec = Spec {
        name: "stribeck",
        title: "Stribeck friction",
        equation: "torque = -c tanh(Omega/eps) exp(-(Omega/fade)^2)",
        meaning: "dry friction that is strongest near rest and fades as the contact slides faster",
        bodies: &[Body::Disk, Body::Pendulum],
        slots: &[Slot::Torque],
        momenta: &[],
        parameters: &[
            EffectParameter {
                name: "c",
                unit: "m^2/s^2",
                default: 0.0,
                range: (0.0, f64::INFINITY),
                role: Role::Amplitude,
            },
            EffectParameter {
                name: "fade",
                unit: "rad/s",
                default: 1.0,
                range: (0.05, 20.0),
                role: Role::Shape(&[0.3, 1.0, 3.0]),
            },
            EffectParameter {
                name: "eps",
                unit: "rad/s",
                default: 0.05,
                range: (1e-4, 1.0),
                role: Role::Shape(&[0.05]),
            },
        ],
    };

    #[inline(always)]
    fn enter<S: Scalar>(p: &[S], at: &At<S>, slots: &mut Slots<S>) {
        let fading = (-(at.omega / p[1]).square()).exp();
        slots.torque -= p[0] * (at.omega / p[2]).tanh() * fading;
    }
}
