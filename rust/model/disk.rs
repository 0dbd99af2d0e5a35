//! The upward-driven disk with friction and effects.

use super::effects::{Contact, Contributions, Dry, Effect, EffectInputs, Term};
use super::stick_slip::{REVERSAL, Slider, Sticking};
use super::{EnclosedSurfaces, Family, Momentum, Parameter, Sides, System, choose, enclosed, parameter};
use crate::scalar::{Dual, Enclosed, Mask, Scalar};

/// The disk, per unit mass, for the state `[Omega, Y, Z, beta]`:
///
/// ```text
/// dY/dT = Z Omega + u        dZ/dT = -Y Omega + W_c        dbeta/dT = Omega
/// I dOmega/dT = g Y - k Omega + torque - (Y u + Z W_c) Omega + Y dW_c/dT - Z du/dT
/// I = R^2/2 + Y^2 + Z^2      k = max(k1 - k2 |Omega|, k0) + friction
/// ```
///
/// The contact moves the disk's material at `(u, W_c)`; without effects `u = 0`, `W_c = W` and this
/// is the paper's model. Effects add to `torque`, `friction`, `u` and `W_c`. Those with
/// [`Momentum::Constraint`] enter the first two equations only, the third keeps its form without them.
#[derive(Clone, Debug)]
pub struct Disk<S> {
    /// Drive speed, m/s.
    pub w: S,
    /// Disk radius, m.
    pub radius: S,
    /// Gravity, m/s^2.
    pub g: S,
    /// The friction law's constants.
    pub friction: Friction<S>,
    /// The effects, with their parameter values.
    pub effects: Vec<Term<S>>,
    /// True if the run ends where the contact reaches the disk's edge, `Y^2 + Z^2 = R^2`.
    pub edge: bool,
    /// True if dry friction can hold it at rest.
    pub sticking: Sticking,
}

/// The paper's friction law `k = max(k1 - k2 |Omega|, k0)`, in m^2/s.
#[derive(Clone, Copy, Debug)]
pub struct Friction<S> {
    /// Floor at high speed, m^2/s.
    pub k0: S,
    /// Value at rest, m^2/s.
    pub k1: S,
    /// Fall with the speed, m^2.
    pub k2: S,
}

impl<S: Scalar> Friction<S> {
    /// Positive on the slow branch `k1 - k2 |Omega|`, negative where the floor `k0` holds.
    #[inline(always)]
    fn kink(&self, speed: S) -> S {
        self.k1 - self.k2 * speed - self.k0
    }
}

/// Surface 0 is `Omega = 0`, where `|Omega|` has its kink; surface 1 is the friction law's kink. A disk
/// that can stick has two more.
const KINK: usize = 1;

/// The total torque on the disk, its inertia, and the contact's velocity.
pub(super) struct EquationOfMotion<S> {
    pub torque: S,
    pub inertia: S,
    pub velocity: (S, S),
    pub dry: Dry<S>,
}

#[inline(always)]
fn speed_of<S: Scalar>(omega: S, sides: &Sides<S>) -> S {
    S::select(sides[REVERSAL], omega, -omega)
}

impl<S: Scalar> Disk<S> {
    /// The inputs of an effect, over the disk's own scalar or over duals of it.
    #[inline(always)]
    fn at<A: Scalar<Mask = S::Mask>>(
        &self,
        lift: impl Fn(S) -> A,
        t: A,
        [omega, y, z, beta]: [A; 4],
        contact: &Contact<S>,
        sides: &Sides<S>,
    ) -> EffectInputs<A> {
        let speed = A::select(sides[REVERSAL], omega, -omega);
        let f = &self.friction;
        let k = A::select(sides[KINK], lift(f.k1) - lift(f.k2) * speed, lift(f.k0));
        let radius = lift(self.radius);
        let inertia = radius.square().scale(0.5) + y.square() + z.square();
        let contact = Contact { sign: lift(contact.sign), bristle: lift(contact.bristle) };
        EffectInputs {
            t,
            omega,
            speed,
            y,
            z,
            beta,
            k,
            inertia,
            w: lift(self.w),
            g: lift(self.g),
            radius,
            contact,
        }
    }

    /// The same law over intervals.
    pub(super) fn enclosed(&self, lane: usize) -> Disk<Enclosed> {
        let of = |number| enclosed(number, lane);
        let Friction { k0, k1, k2 } = self.friction;
        Disk {
            w: of(self.w),
            radius: of(self.radius),
            g: of(self.g),
            friction: Friction { k0: of(k0), k1: of(k1), k2: of(k2) },
            effects: self.effects.iter().map(|own| own.map(of)).collect(),
            edge: self.edge,
            sticking: self.sticking,
        }
    }

    /// `(u, W_c - W)` of the effects that `wanted` selects.
    #[inline(always)]
    fn slip<A: Scalar>(
        &self,
        lift: impl Fn(S) -> A,
        at: &EffectInputs<A>,
        wanted: Momentum,
    ) -> Contributions<A> {
        let mut slots = Contributions::default();
        for term in &self.effects {
            if term.momentum == Some(wanted) {
                term.slip(&lift, at, &mut slots);
            }
        }
        slots
    }

    /// The equation of motion with all effects. It is large, and compiled once for each kind of number.
    #[inline(never)]
    pub(super) fn equation_of_motion(
        &self,
        t: S,
        x: &[S; 4],
        contact: &Contact<S>,
        sides: &Sides<S>,
    ) -> EquationOfMotion<S> {
        let &[omega, y, z, _] = x;
        let at = self.at(|s| s, t, *x, contact, sides);
        let (mut dy, mut dz) = (z * omega, self.w - y * omega);

        let mut forces = Contributions::default();
        let mut slips = false;
        for term in &self.effects {
            match term.momentum {
                None => term.enter(&|s| s, &at, &mut forces),
                Some(momentum) => slips |= momentum == Momentum::Consistent,
            }
        }
        let mut torque = self.g * y;
        torque += forces.torque;
        let k = at.k + forces.friction;
        let constraint = self.slip(|s| s, &at, Momentum::Constraint);
        let consistent = self.slip(|s| s, &at, Momentum::Consistent);
        dy += consistent.lateral + constraint.lateral;
        dz += consistent.vertical + constraint.vertical;
        let (u, w_c) = (consistent.lateral, self.w + consistent.vertical);

        // dW_c/dT and du/dT follow from the effect's own formula: direction 0 goes along the flow with
        // Omega held, direction 1 along Omega, whose rate is what we solve for.
        let mut inertia = at.inertia;
        if slips {
            let along = |value: S, rate: S| Dual { re: value, d: [rate, S::zero()] };
            let flow = self.at(
                Dual::<S, 2>::fixed,
                along(t, S::one()),
                [Dual::variable(omega, 1), along(y, dy), along(z, dz), along(x[3], omega)],
                contact,
                sides,
            );
            let slip = self.slip(Dual::<S, 2>::fixed, &flow, Momentum::Consistent);
            torque += y * slip.vertical.d[0] - z * slip.lateral.d[0];
            inertia += z * slip.lateral.d[1] - y * slip.vertical.d[1];
        }
        torque = torque - k * omega - (y * u + z * w_c) * omega;
        EquationOfMotion { torque, inertia, velocity: (dy, dz), dry: forces.dry }
    }
}

impl<S: Scalar> Slider<S, 4> for Disk<S> {
    const BAND: usize = 2;
    const STUCK: usize = 3;

    #[inline(always)]
    fn sticking(&self) -> Sticking {
        self.sticking
    }

    fn at_rest(&self, t: S, &[_, y, z, beta]: &[S; 4], sides: &Sides<S>) -> (S, Dry<S>) {
        let contact = Contact { sign: S::zero(), bristle: S::zero() };
        let motion = self.equation_of_motion(t, &[S::zero(), y, z, beta], &contact, sides);
        (motion.torque, motion.dry)
    }
}

impl<S: Scalar> System<S, 4> for Disk<S> {
    #[inline]
    fn rates(&self, t: S, x: &[S; 4], sides: &Sides<S>) -> [S; 4] {
        let &[omega, y, z, _] = x;
        if self.effects.is_empty() {
            let at = self.at(|s| s, t, *x, &Contact::default(), sides);
            let torque = self.g * y - at.k * omega - z * self.w * omega;
            return [torque / at.inertia, z * omega, self.w - y * omega, omega];
        }
        let EquationOfMotion { torque, inertia, velocity: (dy, dz), .. } =
            self.equation_of_motion(t, x, &self.contact(sides), sides);
        [self.held(torque / inertia, sides), dy, dz, omega]
    }

    fn surfaces(&self) -> usize {
        if self.sticking == Sticking::Never { 2 } else { 4 }
    }

    #[inline(always)]
    fn surface(&self, j: usize, t: S, x: &[S; 4], sides: &Sides<S>) -> S {
        match j {
            REVERSAL => x[0],
            KINK => self.friction.kink(speed_of(x[0], sides)),
            _ => self.sliding_surface(j, t, x, sides),
        }
    }

    #[inline(always)]
    fn is_steady(&self, j: usize, sides: &Sides<S>) -> bool {
        j <= KINK || self.is_slow(j, sides)
    }

    fn enclosing(&self, lane: usize) -> Option<Box<dyn EnclosedSurfaces<4> + '_>> {
        Some(Box::new(self.enclosed(lane)))
    }

    #[inline(always)]
    fn watched(&self) -> [bool; 4] {
        match self.sticking {
            Sticking::Never => [true, self.edge, self.edge, false],
            _ => [true; 4],
        }
    }

    fn surface_name(&self, j: usize, side: bool) -> &'static str {
        match j {
            REVERSAL => "reversal",
            KINK => "friction kink",
            _ => self.contact_event(j, side),
        }
    }

    fn settle(&self, t: S, x: &[S; 4], sides: &mut Sides<S>) {
        self.settle_contact(t, x, sides);
    }

    fn switch(&self, j: usize, t: S, x: &mut [S; 4], sides: &mut Sides<S>, here: S::Mask) {
        if j == KINK || self.sticking == Sticking::Never {
            sides[j] = choose(here, sides[j].not(), sides[j]);
        } else {
            self.switch_contact(j, t, x, sides, here);
        }
    }

    fn jumps(&self, j: usize) -> bool {
        self.contact_jumps(j)
    }

    #[inline(always)]
    fn wall(&self, x: &[S; 4]) -> Option<S> {
        self.edge.then(|| self.radius.square() - x[1].square() - x[2].square())
    }
}

/// Builds [`Disk`]: which effects it has and what it does at its edge.
#[derive(Clone, Debug, PartialEq)]
pub struct DiskFamily {
    /// The effects and how each enters.
    pub effects: Vec<Effect>,
    /// See [`Disk::edge`].
    pub edge: bool,
}

impl DiskFamily {
    /// Parameters before those of the effects: `W, R, g, k0, k1, k2`.
    pub const PLAIN: usize = 6;
}

impl Family<4> for DiskFamily {
    type Built<S: Scalar> = Disk<S>;

    fn parameters(&self) -> Vec<Parameter> {
        let mut list = vec![
            parameter("W", "m/s"),
            parameter("R", "m"),
            parameter("g", "m/s^2"),
            parameter("k0", "m^2/s"),
            parameter("k1", "m^2/s"),
            parameter("k2", "m^2"),
        ];
        list.extend(self.effects.iter().flat_map(Effect::parameters));
        list
    }

    fn build<S: Scalar>(&self, values: &[S]) -> Disk<S> {
        let (plain, rest) = values.split_at(Self::PLAIN);
        let effects = Term::list(&self.effects, rest);
        Disk {
            w: plain[0],
            radius: plain[1],
            g: plain[2],
            friction: Friction { k0: plain[3], k1: plain[4], k2: plain[5] },
            sticking: Sticking::of(&effects),
            effects,
            edge: self.edge,
        }
    }
}
