//! What a number is.
//!
//! Every model is written once, generic over [`Scalar`]. Run over `f64` it gives a trajectory; over
//! [`Dual`] numbers it gives tangents and parameter sensitivities, exact to rounding; a packet of
//! lanes would give many trajectories at once. Branches are therefore written with masks
//! ([`Scalar::select`]) instead of `if`.

mod dual;
mod real;

pub use dual::Dual;

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

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
    type Real: Scalar<Mask = Self::Mask>;
    /// The outcome of a comparison, one truth value per lane.
    type Mask: Copy + Debug + Send + Sync + PartialEq;

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

    fn zero() -> Self {
        Self::constant(0.0)
    }
    fn one() -> Self {
        Self::constant(1.0)
    }

    /// True where the value is below `other`'s; derivatives do not count.
    fn less(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is true, `no` elsewhere, with their derivatives.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// The same truth value in every lane.
    fn mask(value: bool) -> Self::Mask;

    fn sqrt(self) -> Self;
    fn exp(self) -> Self;
    fn ln(self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn tanh(self) -> Self;

    fn square(self) -> Self {
        self * self
    }
}
