//! Several numbers at once: the lanes of a SIMD register.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::{Mask, Real, Scalar, elementary};

/// `L` numbers that go through the same operations, one trajectory each.
///
/// Every operation is a plain loop over the lanes, which the compiler turns into the vector
/// instructions of the [instruction set](super::Isa) that the caller was compiled for. A lane's bits do
/// not depend on that, nor on `L`: nothing is fused or reordered.
///
/// ```
/// use udd::scalar::{Packet, Real, Scalar};
/// let x = Packet([1.0, 4.0, 9.0, 16.0]);
/// let small = x.less(Packet::constant(5.0));
/// assert_eq!(Packet::select(small, x, x.sqrt()).lane(3), 4.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Packet<const L: usize>(pub [f64; L]);

/// One truth value per lane: all bits set where it is true.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(64))]
pub struct LaneMask<const L: usize>([u64; L]);

#[inline(always)]
fn lanes<const L: usize>(mut lane: impl FnMut(usize) -> f64) -> [f64; L] {
    let mut all = [0.0; L];
    for (i, own) in all.iter_mut().enumerate() {
        *own = lane(i);
    }
    all
}

#[inline(always)]
fn bits<const L: usize>(mut lane: impl FnMut(usize) -> u64) -> [u64; L] {
    let mut all = [0; L];
    for (i, own) in all.iter_mut().enumerate() {
        *own = lane(i);
    }
    all
}

impl<const L: usize> Mask for LaneMask<L> {
    #[inline(always)]
    fn from_lanes(mut lane: impl FnMut(usize) -> bool) -> Self {
        Self(bits(|i| if lane(i) { !0 } else { 0 }))
    }
    #[inline(always)]
    fn lane(self, i: usize) -> bool {
        self.0[i] != 0
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        Self(bits(|i| self.0[i] & other.0[i]))
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        Self(bits(|i| self.0[i] | other.0[i]))
    }
    #[inline(always)]
    fn not(self) -> Self {
        Self(bits(|i| !self.0[i]))
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0.iter().fold(0, |any, bits| any | bits) != 0
    }
}

macro_rules! lanewise {
    ($($Op:ident :: $op:ident),+) => {$(
        impl<const L: usize> $Op for Packet<L> {
            type Output = Self;
            #[inline(always)]
            fn $op(self, other: Self) -> Self {
                Self(lanes(|i| self.0[i].$op(other.0[i])))
            }
        }
    )+};
}
lanewise! { Add::add, Sub::sub, Mul::mul, Div::div }

impl<const L: usize> Neg for Packet<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|x| -x)
    }
}

impl<const L: usize> AddAssign for Packet<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize> SubAssign for Packet<L> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const L: usize> Real for Packet<L> {
    const LANES: usize = L;

    #[inline(always)]
    fn from_lanes(lane: impl FnMut(usize) -> f64) -> Self {
        Self(lanes(lane))
    }
    #[inline(always)]
    fn lane(self, i: usize) -> f64 {
        self.0[i]
    }
    #[inline(always)]
    fn set_lane(&mut self, i: usize, value: f64) {
        self.0[i] = value;
    }
    #[inline(always)]
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        Self(lanes(|i| f(self.0[i])))
    }
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(lanes(|i| f(self.0[i], other.0[i])))
    }
}

impl<const L: usize> Scalar for Packet<L> {
    type Real = Self;
    type Mask = LaneMask<L>;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self([value; L])
    }
    #[inline(always)]
    fn lift(value: Self) -> Self {
        value
    }
    #[inline(always)]
    fn real(self) -> Self {
        self
    }
    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        self.each(|x| x * factor)
    }
    #[inline(always)]
    fn times(self, factor: Self) -> Self {
        self * factor
    }
    #[inline(always)]
    fn less(self, other: Self) -> LaneMask<L> {
        LaneMask::from_lanes(|i| self.0[i] < other.0[i])
    }
    #[inline(always)]
    fn select(mask: LaneMask<L>, yes: Self, no: Self) -> Self {
        let pick = |i: usize| (yes.0[i].to_bits() & mask.0[i]) | (no.0[i].to_bits() & !mask.0[i]);
        Self(lanes(|i| f64::from_bits(pick(i))))
    }
    #[inline(always)]
    fn mask(value: bool) -> LaneMask<L> {
        LaneMask([if value { !0 } else { 0 }; L])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.each(f64::sqrt)
    }
    // Not inlined: models use these seldom, and their code is long over eight lanes. What is hot calls
    // `elementary` itself.
    #[inline(never)]
    fn exp(self) -> Self {
        elementary::exp(self)
    }
    #[inline(never)]
    fn ln(self) -> Self {
        elementary::ln(self)
    }
    #[inline(never)]
    fn sin(self) -> Self {
        elementary::sin_cos(self).0
    }
    #[inline(never)]
    fn cos(self) -> Self {
        elementary::sin_cos(self).1
    }
    #[inline(never)]
    fn tanh(self) -> Self {
        elementary::tanh(self)
    }
    #[inline(never)]
    fn sin_cos(self) -> (Self, Self) {
        elementary::sin_cos(self)
    }
}
