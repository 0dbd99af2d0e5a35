//! Forward-mode derivatives: a value and its derivatives in `N` directions.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::{Real, Scalar};
use crate::scalar::vector;
use crate::unroll::unroll;

/// `re + Σ_i d[i] ε_i` with `ε_i ε_j = 0`. The inner scalar may itself be a dual (nested
/// derivatives) or a packet.
///
/// ```
/// use udd::scalar::{Dual, Scalar};
/// let x = Dual::<f64, 1>::variable(2.0, 0);
/// let y = x * x.sin();
/// assert!((y.d[0] - (2f64.sin() + 2.0 * 2f64.cos())).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<S, const N: usize> {
    /// The value.
    pub re: S,
    /// The derivatives, one per direction.
    pub d: [S; N],
}

impl<S: Scalar, const N: usize> Dual<S, N> {
    /// The variable that direction `i` differentiates with respect to.
    #[inline(always)]
    pub fn variable(re: S, i: usize) -> Self {
        let mut d = [S::zero(); N];
        d[i] = S::one();
        Self { re, d }
    }

    /// The variable of direction `i`, of which only those from `first` on, as many as there is room for, are worked out
    /// here: else a constant.
    #[inline(always)]
    pub fn along(re: S, i: usize, first: usize) -> Self {
        match i.checked_sub(first) {
            Some(i) if i < N => Self::variable(re, i),
            _ => Self::fixed(re),
        }
    }

    /// A value whose derivatives are zero.
    #[inline(always)]
    pub fn fixed(re: S) -> Self {
        Self { re, d: [S::zero(); N] }
    }

    /// The chain rule: a function's value and its slope at `self`.
    #[inline(always)]
    fn chain(self, value: S, slope: S) -> Self {
        Self { re: value, d: vector!(S, N; i => self.d[i] * slope) }
    }
}

/// Whether products of numbers with derivatives in `S` are functions of their own: derivatives of derivatives make them
/// long.
const fn nested<S: Scalar>() -> bool {
    S::ORDER >= 1 && S::Real::LANES == 1
}

/// The same for sums: derivatives of the third order make them long, too.
const fn deep<S: Scalar>() -> bool {
    S::ORDER >= 2
}

/// The operation as a function of its own.
#[inline(never)]
fn apart<A, T>(operation: impl Fn(A) -> T, operands: A) -> T {
    operation(operands)
}

#[inline(always)]
fn sum<S: Scalar, const N: usize>((a, b): (&Dual<S, N>, &Dual<S, N>)) -> Dual<S, N> {
    Dual { re: a.re + b.re, d: vector!(S, N; i => a.d[i] + b.d[i]) }
}

#[inline(always)]
fn difference<S: Scalar, const N: usize>((a, b): (&Dual<S, N>, &Dual<S, N>)) -> Dual<S, N> {
    Dual { re: a.re - b.re, d: vector!(S, N; i => a.d[i] - b.d[i]) }
}

/// By the product rule.
#[inline(always)]
fn product<S: Scalar, const N: usize>((a, b): (&Dual<S, N>, &Dual<S, N>)) -> Dual<S, N> {
    Dual { re: a.re * b.re, d: vector!(S, N; i => a.d[i] * b.re + b.d[i] * a.re) }
}

#[inline(always)]
fn quotient<S: Scalar, const N: usize>((a, b): (&Dual<S, N>, &Dual<S, N>)) -> Dual<S, N> {
    let inverse = S::one() / b.re;
    let re = a.re * inverse;
    Dual { re, d: vector!(S, N; i => (a.d[i] - b.d[i] * re) * inverse) }
}

#[inline(always)]
fn scaled<S: Scalar, const N: usize>((a, factor): (&Dual<S, N>, f64)) -> Dual<S, N> {
    Dual { re: a.re.scale(factor), d: vector!(S, N; i => a.d[i].scale(factor)) }
}

#[inline(always)]
fn negative<S: Scalar, const N: usize>(a: &Dual<S, N>) -> Dual<S, N> {
    Dual { re: -a.re, d: vector!(S, N; i => -a.d[i]) }
}

#[inline(always)]
fn selected<S: Scalar, const N: usize>((mask, yes, no): (S::Mask, &Dual<S, N>, &Dual<S, N>)) -> Dual<S, N> {
    Dual { re: S::select(mask, yes.re, no.re), d: vector!(S, N; i => S::select(mask, yes.d[i], no.d[i])) }
}

impl<S: Scalar, const N: usize> Add for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        if const { deep::<S>() } { apart(sum, (&self, &o)) } else { sum((&self, &o)) }
    }
}

impl<S: Scalar, const N: usize> Sub for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        if const { deep::<S>() } { apart(difference, (&self, &o)) } else { difference((&self, &o)) }
    }
}

impl<S: Scalar, const N: usize> Mul for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        if const { nested::<S>() } { apart(product, (&self, &o)) } else { product((&self, &o)) }
    }
}

impl<S: Scalar, const N: usize> Div for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        if const { nested::<S>() } { apart(quotient, (&self, &o)) } else { quotient((&self, &o)) }
    }
}

impl<S: Scalar, const N: usize> Neg for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        if const { deep::<S>() } { apart(negative, &self) } else { negative(&self) }
    }
}

impl<S: Scalar, const N: usize> AddAssign for Dual<S, N> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<S: Scalar, const N: usize> SubAssign for Dual<S, N> {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl<S: Scalar, const N: usize> Scalar for Dual<S, N> {
    type Real = S::Real;
    type Mask = S::Mask;
    type Register = Dual<S::Register, N>;

    #[inline(always)]
    fn register(self, i: usize) -> Self::Register {
        Dual { re: self.re.register(i), d: vector!(S::Register, N; n => self.d[n].register(i)) }
    }
    #[inline(always)]
    fn set_register(&mut self, i: usize, lanes: Self::Register) {
        self.re.set_register(i, lanes.re);
        unroll!(n in 0..N => { self.d[n].set_register(i, lanes.d[n]); });
    }
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::fixed(S::constant(value))
    }
    #[inline(always)]
    fn lift(value: S::Real) -> Self {
        Self::fixed(S::lift(value))
    }
    #[inline(always)]
    fn real(self) -> S::Real {
        self.re.real()
    }
    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        if const { deep::<S>() } { apart(scaled, (&self, factor)) } else { scaled((&self, factor)) }
    }
    #[inline(always)]
    fn times(self, factor: S::Real) -> Self {
        Self { re: self.re.times(factor), d: vector!(S, N; i => self.d[i].times(factor)) }
    }
    #[inline(always)]
    fn fused(self, a: Self, b: Self) -> Self {
        let d = vector!(S, N; i => self.d[i].fused(a.d[i], b.re).fused(b.d[i], a.re));
        Self { re: self.re.fused(a.re, b.re), d }
    }
    const SYMBOLIC: bool = S::SYMBOLIC;
    const ORDER: usize = S::ORDER + 1;
    const DERIVATIVES: usize = if size_of::<S>() == size_of::<f64>() && N <= 4 { N } else { 0 };

    #[inline(always)]
    fn derivative(self, i: usize) -> f64 {
        if i < N { self.d[i].real().lane(0) } else { 0.0 }
    }
    #[inline(always)]
    fn with_derivatives(value: f64, derivative: impl Fn(usize) -> f64) -> Self {
        Self { re: S::constant(value), d: vector!(S, N; i => S::constant(derivative(i))) }
    }
    #[inline(always)]
    fn fused_times(self, a: Self, b: S::Real) -> Self {
        Self { re: self.re.fused_times(a.re, b), d: vector!(S, N; i => self.d[i].fused_times(a.d[i], b)) }
    }
    #[inline(always)]
    fn less(self, other: Self) -> S::Mask {
        self.re.less(other.re)
    }
    #[inline(always)]
    fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        if const { deep::<S>() } { apart(selected, (mask, &yes, &no)) } else { selected((mask, &yes, &no)) }
    }
    #[inline(always)]
    fn jumping(mask: S::Mask, yes: Self, no: Self) -> Self {
        let d = vector!(S, N; i => S::slope_of_jump(mask, yes.d[i], no.d[i]));
        Self { re: S::jumping(mask, yes.re, no.re), d }
    }
    #[inline(always)]
    fn is_single(self) -> bool {
        self.re.is_single()
    }
    #[inline(always)]
    fn mask(value: bool) -> S::Mask {
        S::mask(value)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.re.sqrt();
        self.chain(root, S::constant(0.5) / root)
    }
    // One function for each kind of number: these are long.
    #[inline(never)]
    fn exp(self) -> Self {
        let value = self.re.exp();
        self.chain(value, value)
    }
    #[inline(never)]
    fn ln(self) -> Self {
        self.chain(self.re.ln(), S::one() / self.re)
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    #[inline(always)]
    fn cos(self) -> Self {
        self.sin_cos().1
    }
    #[inline(never)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.re.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
    #[inline(never)]
    fn tanh(self) -> Self {
        let value = self.re.tanh();
        self.chain(value, S::one() - value * value)
    }
    #[inline(never)]
    fn atan2(self, x: Self) -> Self {
        let inverse = S::one() / (self.re.square() + x.re.square());
        let (along, across) = (x.re * inverse, self.re * inverse);
        Self { re: self.re.atan2(x.re), d: vector!(S, N; i => self.d[i] * along - x.d[i] * across) }
    }
}
