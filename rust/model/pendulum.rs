//! A plain pendulum with a fixed pivot: what the loop is tried on with other people's data.

use super::effects::{Contact, Contributions, Dry, Effect, EffectInputs, Term};
use super::stick_slip::{REVERSAL, Slider, Sticking};
use super::{EnclosedSurfaces, Family, Parameter, Sides, System, choose, enclosed, parameter};
use crate::scalar::{Enclosed, Mask, Scalar};

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
    /// True if dry friction can hold it at rest.
    pub sticking: Sticking,
}

impl<S: Scalar> Pendulum<S> {
    /// The same law over intervals.
    pub(super) fn enclosed(&self, lane: usize) -> Pendulum<Enclosed> {
        let of = |number| enclosed(number, lane);
        Pendulum {
            length: of(self.length),
            inertia: of(self.inertia),
            g: of(self.g),
            k0: of(self.k0),
            effects: self.effects.iter().map(|own| own.map(of)).collect(),
            sticking: self.sticking,
        }
    }

    /// The total torque, and the part of dry friction that is no torque.
    #[inline]
    pub(super) fn torque(
        &self,
        t: S,
        &[omega, theta]: &[S; 2],
        contact: Contact<S>,
        sides: &Sides<S>,
    ) -> (S, Dry<S>) {
        let (sin, cos) = theta.sin_cos();
        let y = self.length * sin;
        let mut forces = Contributions::default();
        if !self.effects.is_empty() {
            let at = EffectInputs {
                t,
                omega,
                speed: S::select(sides[REVERSAL], omega, -omega),
                y,
                z: -(self.length * cos),
                beta: theta,
                k: self.k0,
                inertia: self.inertia,
                w: S::zero(),
                g: self.g,
                radius: self.length,
                contact,
            };
            for term in &self.effects {
                term.enter(&|s| s, &at, &mut forces);
            }
        }
        (forces.torque - self.g * y - (self.k0 + forces.friction) * omega, forces.dry)
    }
}

impl<S: Scalar> Slider<S, 2> for Pendulum<S> {
    const BAND: usize = 1;
    const STUCK: usize = 2;

    #[inline(always)]
    fn sticking(&self) -> Sticking {
        self.sticking
    }

    fn at_rest(&self, t: S, x: &[S; 2], sides: &Sides<S>) -> (S, Dry<S>) {
        self.torque(t, &[S::zero(), x[1]], Contact::default(), sides)
    }
}

impl<S: Scalar> System<S, 2> for Pendulum<S> {
    #[inline]
    fn rates(&self, t: S, x: &[S; 2], sides: &Sides<S>) -> [S; 2] {
        let (torque, _) = self.torque(t, x, self.contact(sides), sides);
        [self.held(torque / self.inertia, sides), x[0]]
    }

    fn surfaces(&self) -> usize {
        match self.sticking {
            Sticking::Never => usize::from(!self.effects.is_empty()),
            _ => 3,
        }
    }

    #[inline(always)]
    fn surface(&self, j: usize, t: S, x: &[S; 2], sides: &Sides<S>) -> S {
        if j == REVERSAL { x[0] } else { self.sliding_surface(j, t, x, sides) }
    }

    #[inline(always)]
    fn is_steady(&self, j: usize, sides: &Sides<S>) -> bool {
        j == REVERSAL || self.is_slow(j, sides)
    }

    fn enclosing(&self, lane: usize) -> Option<Box<dyn EnclosedSurfaces<2> + '_>> {
        Some(Box::new(self.enclosed(lane)))
    }

    fn surface_name(&self, j: usize, side: bool) -> &'static str {
        if j == REVERSAL { "reversal" } else { self.contact_event(j, side) }
    }

    fn settle(&self, t: S, x: &[S; 2], sides: &mut Sides<S>) {
        self.settle_contact(t, x, sides);
    }

    fn switch(&self, j: usize, t: S, x: &mut [S; 2], sides: &mut Sides<S>, here: S::Mask) {
        if self.sticking == Sticking::Never {
            sides[j] = choose(here, sides[j].not(), sides[j]);
        } else {
            self.switch_contact(j, t, x, sides, here);
        }
    }

    fn jumps(&self, j: usize) -> bool {
        self.contact_jumps(j)
    }
}

/// Builds [`Pendulum`].
#[derive(Clone, Debug, PartialEq)]
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
        let effects = Term::list(&self.effects, rest);
        Pendulum {
            length: plain[0],
            inertia: plain[1],
            g: plain[2],
            k0: plain[3],
            sticking: Sticking::of(&effects),
            effects,
        }
    }
}
