//! Dry friction: its force depends on the direction of sliding, not on the speed alone.

use super::{Contributions, EffectInputs};
use crate::model::Sides;
use crate::model::stick_slip::REVERSAL;
use crate::scalar::Scalar;

/// The treatment of dry friction's jump at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrictionModel {
    /// `tanh(Omega/eps)` replaces the sign. Nothing sticks, but it can be fitted.
    Smoothed,
    /// The sign itself, any value from -1 to 1 at rest: it sticks, until the torque exceeds the friction.
    SetValued,
    /// The same, with speeds below `eps` treated as rest (Karnopp, J. Dyn. Sys. Meas. Control 107 (1985) 100).
    Karnopp,
    /// Bristles that bend by up to about `eps`, an angle, before they slide (Canudas de Wit, Olsson, Åström &
    /// Lischinsky, IEEE Trans. Autom. Control 40 (1995) 419). Only a [`WithLuGre`](crate::model::WithLuGre)
    /// model has them; in others the effect does nothing.
    Lugre,
}

impl FrictionModel {
    /// All of them, the default first.
    pub const ALL: &[FrictionModel] =
        &[FrictionModel::Smoothed, FrictionModel::SetValued, FrictionModel::Karnopp, FrictionModel::Lugre];

    /// Its name in Python.
    pub fn name(self) -> &'static str {
        match self {
            FrictionModel::Smoothed => "smoothed",
            FrictionModel::SetValued => "set-valued",
            FrictionModel::Karnopp => "karnopp",
            FrictionModel::Lugre => "lugre",
        }
    }
}

/// The state of the contact in addition to the speed.
#[derive(Clone, Copy, Debug)]
pub struct Contact<S> {
    /// The direction in which it slides: 1 or -1, 0 where it sticks.
    pub sign: S,
    /// The bristles' deflection, rad.
    pub bristle: S,
}

impl<S: Scalar> Default for Contact<S> {
    #[inline]
    fn default() -> Self {
        Self { sign: S::zero(), bristle: S::zero() }
    }
}

/// The sum of dry friction in addition to a torque.
#[derive(Clone, Copy, Debug)]
pub struct Dry<S> {
    /// The largest torque that holds the contact where it is, m^2/s^2.
    pub hold: S,
    /// The speed below which it counts as at rest, rad/s; of several effects the last one's holds.
    pub band: S,
    /// The bristles' torque in steady sliding, m^2/s^2, and per deflection, m^2/s^2/rad.
    pub grip: S,
    pub stiffness: S,
}

impl<S: Scalar> Default for Dry<S> {
    #[inline]
    fn default() -> Self {
        Self { hold: S::zero(), band: S::zero(), grip: S::zero(), stiffness: S::zero() }
    }
}

impl<S: Scalar> Contributions<S> {
    /// Adds dry friction of this size, at the present speed and at rest; it turns round over the width `eps`.
    #[inline(always)]
    pub fn rub(&mut self, size: S, at_rest: S, eps: S, at: &EffectInputs<S>) {
        match self.treatment {
            FrictionModel::Smoothed => self.torque -= size * (at.omega / eps).tanh(),
            FrictionModel::SetValued => {
                self.torque -= size * at.contact.sign;
                self.dry.hold += size;
            }
            FrictionModel::Karnopp => {
                self.torque -= size * at.contact.sign;
                self.dry.hold += size;
                self.dry.band = eps;
            }
            FrictionModel::Lugre => {
                self.dry.grip += size;
                self.dry.stiffness += at_rest / eps;
            }
        }
    }
}

impl<S: Scalar> Dry<S> {
    /// The bristles' torque on a body of this inertia, and the rate of their deflection; see
    /// [`WithLuGre`](crate::model::WithLuGre). The damping lets the body stop on them with little
    /// swinging.
    #[inline(always)]
    pub fn bristles(&self, omega: S, deflection: S, inertia: S, sides: &Sides<S>) -> (S, S) {
        let speed = S::select(sides[REVERSAL], omega, -omega);
        // Without friction the constant only prevents 0/0.
        let grip = self.grip + S::constant(f64::MIN_POSITIVE);
        let rate = omega - self.stiffness * speed * deflection / grip;
        let damping = (self.stiffness * inertia + S::constant(f64::MIN_POSITIVE)).sqrt();
        (-(self.stiffness * deflection + damping * rate), rate)
    }
}
