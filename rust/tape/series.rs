//! Products of power series, one coefficient at a time.
//!
//! The order of the sums is the same for every width of the numbers. Terms come in pairs, from the
//! middle of the series outwards, so that the coefficients found last enter last: a single trajectory
//! waits for them as shortly as possible. Two sums run side by side, so that they need not wait for each
//! other.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use crate::scalar::{DerivativeLanes, InstructionSet, Isa, Scalar};

/// The body for every order `k` below `to`, a number of coefficients of at most 25, with its number known when the program
/// is compiled.
macro_rules! orders {
    ($k:ident below $to:tt => $body:block) => {
        $crate::tape::series::orders!(@ $k $to, $body, 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23)
    };
    (@ $k:ident $to:tt, $body:block, $($n:literal)+) => {
        $(if $crate::unroll::Turn::<0, $n, $to, 25>::RUNS {
            let $k: usize = $n;
            $body
        })+
    };
}
pub(super) use orders;

/// The coefficients of a series: any scalar, or a fan.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> + AddAssign
{
    fn zero() -> Self;
    fn scaled(self, factor: f64) -> Self;
    /// `self + a b`, rounded once.
    fn plus_product(self, a: Self, b: Self) -> Self;
    /// `self + a factor`, rounded once.
    fn plus_scaled(self, a: Self, factor: f64) -> Self;
}

impl<S: Scalar> Number for S {
    #[inline(always)]
    fn zero() -> S {
        S::zero()
    }
    #[inline(always)]
    fn scaled(self, factor: f64) -> S {
        self.scale(factor)
    }
    #[inline(always)]
    fn plus_product(self, a: S, b: S) -> S {
        self.fused(a, b)
    }
    #[inline(always)]
    fn plus_scaled(self, a: S, factor: f64) -> S {
        self.fused_times(a, S::Real::constant(factor))
    }
}

impl<V: InstructionSet> Number for DerivativeLanes<V> {
    #[inline(always)]
    fn zero() -> Self {
        DerivativeLanes::zero()
    }
    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        self.scale(factor)
    }
    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        self.fused(a, b)
    }
    #[inline(always)]
    fn plus_scaled(self, a: Self, factor: f64) -> Self {
        self.fused_scaled(a, factor)
    }
}

/// A coefficient, or several side by side, that numbers multiply.
pub trait Coefficient<S>: Copy {
    /// -0 : adding to it changes nothing, not even the sign of a zero.
    fn nothing() -> Self;
    /// `self + a b`, rounded once.
    fn with(self, a: S, b: Self) -> Self;
    fn plus(self, other: Self) -> Self;
}

impl<S: Number> Coefficient<S> for S {
    #[inline(always)]
    fn nothing() -> S {
        -S::zero()
    }
    #[inline(always)]
    fn with(self, a: S, b: S) -> S {
        self.plus_product(a, b)
    }
    #[inline(always)]
    fn plus(self, other: S) -> S {
        self + other
    }
}

/// `sum of a[j] b[k-j] for j in 1..k`, the coefficient `k` of the product without its first and last term.
#[inline(always)]
pub fn inner<S: Copy, C: Coefficient<S>, const N: usize>(a: &[S; N], b: &[C; N], k: usize) -> C {
    let pairs = k.saturating_sub(1) / 2;
    let (a_low, a_high) = (&a[1..=pairs], &a[k - pairs..k]);
    let (b_low, b_high) = (&b[1..=pairs], &b[k - pairs..k]);
    let (mut even, mut odd) = (C::nothing(), C::nothing());
    if k >= 2 && k.is_multiple_of(2) {
        even = even.with(a[k / 2], b[k / 2]);
    }
    let outwards = a_low.iter().rev().zip(b_high).zip(b_low.iter().rev().zip(a_high));
    for ((&al, &bh), (&bl, &ah)) in outwards {
        even = even.with(al, bh);
        odd = odd.with(ah, bl);
    }
    even.plus(odd)
}

/// `$sum` of order `k`, which is only known when the program runs.
///
/// For numbers without derivatives there is a program for each order: the way into a loop takes longer than the loop.
macro_rules! at_order {
    ($V:ty, $S:ty, $k:ident => $sum:expr) => {{
        if const { unrolled::<$V, $S>() } {
            let wanted = $k;
            orders!($k below N => {
                if wanted == $k {
                    return $sum;
                }
            });
            unreachable!("no coefficient of order {wanted}");
        } else {
            $sum
        }
    }};
}

/// Not where derivatives make every term long, nor on a PC without AVX2: it is rare, and every copy takes its time to
/// compile.
const fn unrolled<V: InstructionSet, S: Scalar>() -> bool {
    let baseline = cfg!(target_arch = "x86_64") && matches!(V::ISA, Isa::Baseline);
    size_of::<S>() == size_of::<S::Real>() && !baseline
}

/// [`inner`] where the order is only known when the program runs.
#[inline(always)]
pub fn inner_at<V: InstructionSet, S: Scalar, const N: usize>(a: &[S; N], b: &[S; N], k: usize) -> S {
    at_order!(V, S, k => inner(a, b, k))
}

/// [`inner_square`] where the order is only known when the program runs.
#[inline(always)]
pub fn inner_square_at<V: InstructionSet, S: Scalar, const N: usize>(a: &[S; N], k: usize) -> S {
    at_order!(V, S, k => inner_square(a, k))
}

/// `sum of a[j] a[k-j] for j in 1..k`, at half the cost.
#[inline(always)]
pub fn inner_square<S: Number, const N: usize>(a: &[S; N], k: usize) -> S {
    let half = pairs(a, k, S::nothing());
    let sum = half + half;
    if k >= 2 && k.is_multiple_of(2) { sum.plus_product(a[k / 2], a[k / 2]) } else { sum }
}

/// Half of it.
#[inline(always)]
pub fn half_square<S: Number, const N: usize>(a: &[S; N], k: usize) -> S {
    let middle = k >= 2 && k.is_multiple_of(2);
    pairs(a, k, if middle { (a[k / 2] * a[k / 2]).scaled(0.5) } else { S::nothing() })
}

/// `a[j] a[k-j]` for `0 < j < k - j` added to `sum`, from the middle outwards.
#[inline(always)]
fn pairs<S: Number, const N: usize>(a: &[S; N], k: usize, mut sum: S) -> S {
    let pairs = k.saturating_sub(1) / 2;
    for (&low, &high) in a[1..=pairs].iter().rev().zip(&a[k - pairs..k]) {
        sum = sum.plus_product(low, high);
    }
    sum
}
