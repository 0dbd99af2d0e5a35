//! Numbers: plain ones, packets, dual numbers.
//!
//! Every model is written once, generic over [`Scalar`]. Run over `f64` it gives a trajectory; over
//! [`Dual`] numbers it gives tangents and parameter sensitivities, exact to rounding; over a [`Packet`]
//! it gives many trajectories at once. Branches are therefore written with masks
//! ([`Scalar::select`]) instead of `if`.

mod cells;
mod dual;
pub mod elementary;
mod fan;
mod interval;
mod isa;
mod lanes;
mod packet;
mod real;
mod vector;

pub use cells::{Cells, SplinePiece};
pub use dual::Dual;
pub use fan::DerivativeLanes;
pub use interval::{Enclosed, Interval, Truth};
pub(crate) use isa::run_with;
pub use isa::{InstructionSet, Isa, LANES, Plain, Work};
pub use packet::{LaneMask, Packet};
pub(crate) use vector::vector;

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// One number with four derivatives, each in a lane beside a copy of the number: the operations that the derivatives
/// have in common are vector instructions, and no bit changes. For fewer of them see [`DerivativeLanes`].
pub type Spread<V> = Dual<Packet<4, V>, 1>;

/// How many derivatives a [`Wide`] number has.
pub const WIDTH: usize = 8;
/// A number with derivatives in as many directions as are worked out together wherever it is not the exponents of a few
/// states that are wanted: fits, pieces of orbits, stiff steps and linearised laws share what is compiled for it.
pub type Wide = Dual<f64, WIDTH>;

/// A number that a model can be evaluated over.
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// The number without its derivatives: the type of a step size or of time in the stepper.
    type Real: Real<Mask = Self::Mask>;
    /// The outcome of a comparison, one truth value per lane.
    type Mask: Mask;

    /// A constant: its derivatives are zero.
    fn constant(value: f64) -> Self;
    /// A constant from a number without derivatives.
    fn lift(value: Self::Real) -> Self;
    /// The value, without derivatives.
    fn real(self) -> Self::Real;
    /// The product with a constant, cheaper than `self * Self::constant(factor)`.
    fn scale(self, factor: f64) -> Self;
    /// The product with a number without derivatives.
    fn times(self, factor: Self::Real) -> Self;

    /// `self + a b`, rounded once: one instruction where the machine has it, slow where it has not. For sums
    /// of products on the hottest paths, which are compiled for every [instruction set](Isa).
    fn fused(self, a: Self, b: Self) -> Self;
    /// The same for a factor without derivatives.
    fn fused_times(self, a: Self, b: Self::Real) -> Self;

    /// True for a number that is its lanes side by side in memory, and nothing else.
    const IS_PLAIN: bool = false;
    /// Whether it records what is done with it: then all branches are taken, and none is known.
    const SYMBOLIC: bool = false;
    /// The order of its derivatives: 0 for a number without.
    const ORDER: usize = 0;
    /// The derivatives of a number that has a few of them: up to three make a [`DerivativeLanes`], four a [`Spread`] number, which
    /// are faster.
    const DERIVATIVES: usize = 0;
    /// The derivative `i`.
    #[inline(always)]
    fn derivative(self, _i: usize) -> f64 {
        0.0
    }
    /// A number from its value and its derivatives.
    #[inline(always)]
    fn with_derivatives(value: f64, _derivative: impl Fn(usize) -> f64) -> Self {
        Self::constant(value)
    }

    /// [`LANES`] of its lanes, where it has as many or more.
    type Register: Scalar;
    /// The lanes from `i` times [`LANES`] on.
    fn register(self, i: usize) -> Self::Register;
    /// Changes them.
    fn set_register(&mut self, i: usize, lanes: Self::Register);

    #[inline(always)]
    fn zero() -> Self {
        Self::constant(0.0)
    }
    #[inline(always)]
    fn one() -> Self {
        Self::constant(1.0)
    }

    /// True where the value is below `other`'s; derivatives do not count.
    fn less(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is true, `no` elsewhere, with their derivatives.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// The same where the number jumps from the one to the other.
    #[inline(always)]
    fn jumping(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self::select(mask, yes, no)
    }
    /// The derivative of what jumps.
    #[inline(always)]
    fn slope_of_jump(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self::select(mask, yes, no)
    }
    /// Returns false for an interval of several numbers.
    #[inline(always)]
    fn is_single(self) -> bool {
        true
    }
    /// The same truth value in every lane.
    fn mask(value: bool) -> Self::Mask;

    fn sqrt(self) -> Self;
    fn exp(self) -> Self;
    fn ln(self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn tanh(self) -> Self;
    /// The angle of the point with this ordinate and the abscissa `x`, from -pi to pi.
    fn atan2(self, x: Self) -> Self;
    /// Sine and cosine at the cost of one.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        (self.sin(), self.cos())
    }

    #[inline(always)]
    fn square(self) -> Self {
        self * self
    }
}

/// These values as constants.
pub fn constants<S: Scalar>(values: &[f64]) -> Vec<S> {
    let mut list = Vec::with_capacity(values.len());
    for &value in values {
        list.push(S::constant(value));
    }
    list
}

/// A number without derivatives: one lane (`f64`) or several ([`Packet`]).
pub trait Real: Scalar<Real = Self> {
    /// The number of its trajectories.
    const LANES: usize;

    /// Does work over such numbers with these instructions; packets that are made of some bring their own.
    fn work<W: Work>(isa: Isa, work: W) -> W::Output;
    /// The number with these lanes.
    fn from_lanes(lane: impl FnMut(usize) -> f64) -> Self;
    /// Lane `i`.
    fn lane(self, i: usize) -> f64;
    /// Changes lane `i`.
    fn set_lane(&mut self, i: usize, value: f64);
    /// The polynomial of a cubic spline here; a recording knows it only during a run.
    #[inline(always)]
    fn piece(self, cells: Cells, coefficient: &dyn Fn(usize) -> Self) -> SplinePiece<Self> {
        cells.piece(self, coefficient)
    }
    /// Each lane by itself. Meant for what is one machine instruction or a few without branches.
    fn each(self, f: impl Fn(f64) -> f64) -> Self;
    /// The same for pairs of lanes.
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self;

    #[inline(always)]
    fn abs(self) -> Self {
        self.each(f64::abs)
    }
    /// The larger one; `other` where either is not a number.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    /// The smaller one; `other` where either is not a number.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    /// True where it is neither infinite nor not a number.
    #[inline(always)]
    fn finite(self) -> Self::Mask {
        self.abs().less(Self::constant(f64::INFINITY))
    }
}

/// Truth values, one per lane.
pub trait Mask: Copy + Debug + Send + Sync + PartialEq + 'static {
    /// The mask with these lanes.
    fn from_lanes(lane: impl FnMut(usize) -> bool) -> Self;
    /// Lane `i`.
    fn lane(self, i: usize) -> bool;
    fn and(self, other: Self) -> Self;
    fn or(self, other: Self) -> Self;
    fn not(self) -> Self;
    /// A bit for every lane, the lowest for the first.
    fn bits(self) -> u64;
    /// Whether any lane is true.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
    /// The lanes that are true, in their order: where these are few, or the mask is not in memory, faster than asking
    /// one lane after the other.
    #[inline(always)]
    fn lanes(self) -> Lanes {
        Lanes(self.bits())
    }
}

/// Numbers of lanes, as bits.
#[derive(Clone, Copy, Debug)]
pub struct Lanes(u64);

impl Iterator for Lanes {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let lane = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        Some(lane)
    }
}
