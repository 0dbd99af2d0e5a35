//! A contact that sticks: the modes of set-valued dry friction, and the switches between them.
//!
//! A body slides one way or the other, or it sticks; which one is a side like any other. Sliding stops
//! on the surface `Omega = 0`: there it sticks if dry friction can hold the other torques, else the
//! torque carries it through. It is let go where the torque reaches what friction can hold. With
//! Karnopp's band it also sticks, from any speed inside the band, as soon as friction can hold it.

use super::effects::{Contact, Dry, Term};
use super::{Sides, choose};
use crate::scalar::{Mask, Scalar};

/// The surface `Omega = 0`.
pub const REVERSAL: usize = 0;

/// The way in which a model's contact sticks, if it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sticking {
    Never,
    /// On the surface `Omega = 0`.
    AtRest,
    /// Within a band of speeds.
    InBand,
}

impl Sticking {
    /// With these effects.
    pub fn of<S: Scalar>(effects: &[Term<S>]) -> Self {
        if effects.iter().any(Term::has_band) {
            Sticking::InBand
        } else if effects.iter().any(Term::sticks) {
            Sticking::AtRest
        } else {
            Sticking::Never
        }
    }
}

/// A body whose speed `Omega`, the state's first component, dry friction can hold at zero.
pub trait Slider<S: Scalar, const D: usize> {
    /// The surfaces `|Omega| = band` and the one between sliding and sticking, the last of all.
    const BAND: usize;
    const STUCK: usize;

    fn sticking(&self) -> Sticking;

    /// The torque but for dry friction, and what dry friction can hold, in this state with `Omega = 0`.
    fn at_rest(&self, t: S, x: &[S; D], sides: &Sides<S>) -> (S, Dry<S>);

    /// The direction in which the contact slides.
    #[inline(always)]
    fn contact(&self, sides: &Sides<S>) -> Contact<S> {
        let mut sign = S::zero();
        if self.sticking() != Sticking::Never {
            sign = S::select(sides[REVERSAL], S::one(), -S::one());
            sign = S::select(sides[Self::STUCK], S::zero(), sign);
        }
        Contact { sign, bristle: S::zero() }
    }

    /// The rate of `Omega`, which is zero while the contact sticks.
    #[inline(always)]
    fn held(&self, rate: S, sides: &Sides<S>) -> S {
        match self.sticking() {
            Sticking::Never => rate,
            _ => S::select(sides[Self::STUCK], S::zero(), rate),
        }
    }

    /// The functions of the surfaces [`Slider::BAND`] and [`Slider::STUCK`].
    fn sliding_surface(&self, j: usize, t: S, x: &[S; D], sides: &Sides<S>) -> S {
        let banded = self.sticking() == Sticking::InBand;
        if j == Self::BAND {
            if !banded {
                return S::one();
            }
            let (_, dry) = self.at_rest(t, x, sides);
            return S::select(sides[REVERSAL], x[0], -x[0]) - dry.band;
        }
        // Initially no side is known, and all count as true.
        let moving = x[0].less(S::zero()).or(S::zero().less(x[0]));
        let mut open = sides[Self::STUCK].and(moving.not());
        if banded {
            open = open.or(sides[Self::STUCK].or(sides[Self::BAND]).not());
        }
        if !open.any() {
            return -S::one();
        }
        let (torque, dry) = self.at_rest(t, x, sides);
        S::select(open, margin(torque, dry.hold), -S::one())
    }

    /// Returns true if the function of [`Slider::BAND`] or [`Slider::STUCK`] changes no faster than the state: a constant does,
    /// the torque on a contact at rest need not.
    #[inline(always)]
    fn is_slow(&self, j: usize, sides: &Sides<S>) -> bool {
        let banded = self.sticking() == Sticking::InBand;
        if j == Self::BAND { !banded } else { !banded && !sides[Self::STUCK].any() }
    }

    /// A contact at rest that friction does not hold slides where the torque pulls it.
    fn settle_contact(&self, t: S, x: &[S; D], sides: &mut Sides<S>) {
        if self.sticking() == Sticking::Never {
            return;
        }
        let moving = x[0].less(S::zero()).or(S::zero().less(x[0]));
        if moving.not().any() {
            let (torque, _) = self.at_rest(t, x, sides);
            sides[REVERSAL] = choose(moving, sides[REVERSAL], S::zero().less(torque));
        }
    }

    /// Passes one of the three surfaces in the lanes `here`.
    fn switch_contact(&self, j: usize, t: S, x: &mut [S; D], sides: &mut Sides<S>, here: S::Mask) {
        let (torque, dry) = self.at_rest(t, x, sides);
        let holds = S::zero().less(margin(torque, dry.hold));
        let stuck = sides[Self::STUCK];
        let mut sticks = here.and(holds);
        let mut pulled = here.and(holds.not());
        if j == Self::BAND {
            sides[j] = choose(here, sides[j].not(), sides[j]);
            sticks = sticks.and(sides[j].not());
            pulled = S::mask(false);
        } else if j == Self::STUCK {
            sticks = here.and(stuck.not());
            pulled = here.and(stuck);
        }
        sides[Self::STUCK] = sticks.or(stuck.and(pulled.not()));
        sides[REVERSAL] = choose(pulled, S::zero().less(torque), sides[REVERSAL]);
        if self.sticking() == Sticking::InBand {
            sides[Self::BAND] = sides[Self::BAND].and(sticks.not());
        }
        x[0] = S::select(sticks, S::zero(), x[0]);
    }

    /// The name of the event in which the body reaches this side of [`Slider::BAND`] or [`Slider::STUCK`].
    fn contact_event(&self, j: usize, side: bool) -> &'static str {
        match (j == Self::STUCK, side) {
            (true, true) => "stick",
            (true, false) => "slip",
            (false, _) => "band",
        }
    }

    /// Returns true if the law jumps at surface `j`.
    fn contact_jumps(&self, j: usize) -> bool {
        match self.sticking() {
            Sticking::Never => false,
            // A contact that starts to slip has no acceleration at first: that switch is continuous.
            Sticking::AtRest => j == REVERSAL,
            Sticking::InBand => j == REVERSAL || j == Self::BAND || j == Self::STUCK,
        }
    }
}

/// Positive where friction can hold the torque, from -1 to 1.
#[inline(always)]
fn margin<S: Scalar>(torque: S, hold: S) -> S {
    let (pull, most) = (torque.square(), hold.square());
    // Neither is much smaller than 1e-100: the constant only prevents 0/0.
    (most - pull) / (most + pull + S::constant(f64::MIN_POSITIVE))
}
