//! A number with a few derivatives in the lanes of a register.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use super::{InstructionSet, Packet, Real, Scalar};

/// A number with up to three derivatives, by the vector instructions of a set; no bit changes.
///
/// A product takes two instructions: the first factor by the second one's number, and the second one's derivatives by
/// the first one's number.
#[derive(Clone, Copy, Debug)]
pub struct DerivativeLanes<V> {
    /// The number and then its derivatives.
    all: Packet<4, V>,
    /// The number, in every lane.
    number: Packet<4, V>,
    /// The derivatives beside a zero.
    derivatives: Packet<4, V>,
}

impl<V: InstructionSet> DerivativeLanes<V> {
    #[inline(always)]
    pub fn new(number: f64, [a, b, c]: [f64; 3]) -> Self {
        Self::of(Packet::new([number, a, b, c]))
    }

    /// Unused parts cost nothing.
    #[inline(always)]
    fn of(all: Packet<4, V>) -> Self {
        let mut derivatives = all;
        derivatives.set_lane(0, 0.0);
        Self { all, number: Packet::constant(all.lane(0)), derivatives }
    }

    #[inline(always)]
    pub fn zero() -> Self {
        Self::of(Packet::zero())
    }

    #[inline(always)]
    pub fn number(self) -> f64 {
        self.all.lane(0)
    }

    #[inline(always)]
    pub fn derivative(self, i: usize) -> f64 {
        self.all.lane(1 + i)
    }

    #[inline(always)]
    pub fn scale(self, factor: f64) -> Self {
        Self::of(self.all.scale(factor))
    }

    #[inline(always)]
    pub fn fused(self, a: Self, b: Self) -> Self {
        Self::of(self.all.fused(a.all, b.number).fused(b.derivatives, a.number))
    }

    #[inline(always)]
    pub fn fused_scaled(self, a: Self, factor: f64) -> Self {
        Self::of(self.all.fused(a.all, Packet::constant(factor)))
    }
}

impl<V: InstructionSet> Add for DerivativeLanes<V> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::of(self.all + other.all)
    }
}

impl<V: InstructionSet> Sub for DerivativeLanes<V> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::of(self.all - other.all)
    }
}

impl<V: InstructionSet> Mul for DerivativeLanes<V> {
    type Output = Self;
    #[inline(always)]
    #[allow(clippy::suspicious_arithmetic_impl, reason = "the product rule is a sum")]
    fn mul(self, other: Self) -> Self {
        Self::of(self.all * other.number + other.derivatives * self.number)
    }
}

impl<V: InstructionSet> Neg for DerivativeLanes<V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::of(-self.all)
    }
}

impl<V: InstructionSet> AddAssign for DerivativeLanes<V> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
