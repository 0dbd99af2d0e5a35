//! A plain pendulum with a fixed pivot: what the loop is tried on with other people's data.

use super::effects::{At, Effect, Slots, Term};
use super::{Family, Parameter, Sides, System, parameter};
use crate::scalar::Scalar;

/// A pendulum, per unit mass, for the state `[Omega, theta]` with `theta = 0` hanging:
///
/// ```text
/// I dOmega/dT = -g length sin(theta) - k0 Omega + torque - friction Omega      dtheta/dT = Omega
/// ```
///
/// In the disk's coordinates its bob is at `Y = length sin(theta)`, `Z = -length cos(theta)`, and
/// `beta = theta`; effects that enter through torque or friction serve both models.
#[derive(Clone, Debug)]
pub struct Pendulum<S> {
    /// Distance from the pivot to the centre of mass, m.
    pub length: S,
    /// Moment of inertia about the pivot, per unit mass, m^2.
    pub inertia: S,
    /// Gravity, m/s^2.
    pub g: S,
    /// Viscous friction, m^2/s.
    pub k0: S,
    /// The effects, with their parameter values.
    pub effects: Vec<Term<S>>,
}

impl<S: Scalar> System<S, 2> for Pendulum<S> {
    #[inline]
    fn rates(&self, t: S, &[omega, theta]: &[S; 2], sides: &Sides<S>) -> [S; 2] {
        let (sin, cos) = theta.sin_cos();
        let y = self.length * sin;
        let mut forces = Slots::default();
        if !self.effects.is_empty() {
            let at = At {
                t,
                omega,
                speed: S::select(sides[0], omega, -omega),
                y,
                z: -(self.length * cos),
                beta: theta,
                k: self.k0,
                inertia: self.inertia,
                w: S::zero(),
                g: self.g,
                radius: self.length,
            };
            for term in &self.effects {
                term.enter(&|s| s, &at, &mut forces);
            }
        }
        let torque = forces.torque - self.g * y;
        [(torque - (self.k0 + forces.friction) * omega) / self.inertia, omega]
    }

    fn surfaces(&self) -> usize {
        usize::from(!self.effects.is_empty())
    }

    #[inline(always)]
    fn surface(&self, _j: usize, _t: S, x: &[S; 2], _sides: &Sides<S>) -> S {
        x[0]
    }

    fn surface_name(&self, _j: usize) -> &'static str {
        "reversal"
    }
}

/// Builds [`Pendulum`].
#[derive(Clone, Debug)]
pub struct PendulumFamily {
    /// The effects; each enters through torque or friction.
    pub effects: Vec<Effect>,
}

impl Family<2> for PendulumFamily {
    type Built<S: Scalar> = Pendulum<S>;

    fn parameters(&self) -> Vec<Parameter> {
        let mut list = vec![
            parameter("length", "m"),
            parameter("inertia", "m^2"),
            parameter("g", "m/s^2"),
            parameter("k0", "m^2/s"),
        ];
        list.extend(self.effects.iter().flat_map(Effect::parameters));
        list
    }

    fn build<S: Scalar>(&self, values: &[S]) -> Pendulum<S> {
        let (plain, rest) = values.split_at(4);
        Pendulum {
            length: plain[0],
            inertia: plain[1],
            g: plain[2],
            k0: plain[3],
            effects: Term::list(&self.effects, rest),
        }
    }
}
