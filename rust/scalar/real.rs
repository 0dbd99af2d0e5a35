//! `f64` as a [`Scalar`]: one lane, no derivatives.

use super::{Isa, Mask, Real, Scalar, Work, elementary};

impl Scalar for f64 {
    type Real = f64;
    type Mask = bool;
    type Register = f64;
    const IS_PLAIN: bool = true;

    #[inline(always)]
    fn register(self, _i: usize) -> f64 {
        self
    }
    #[inline(always)]
    fn set_register(&mut self, _i: usize, lanes: f64) {
        *self = lanes;
    }

    #[inline(always)]
    fn constant(value: f64) -> f64 {
        value
    }
    #[inline(always)]
    fn lift(value: f64) -> f64 {
        value
    }
    #[inline(always)]
    fn real(self) -> f64 {
        self
    }
    #[inline(always)]
    fn scale(self, factor: f64) -> f64 {
        self * factor
    }
    #[inline(always)]
    fn times(self, factor: f64) -> f64 {
        self * factor
    }
    #[inline(always)]
    fn fused(self, a: f64, b: f64) -> f64 {
        a.mul_add(b, self)
    }
    #[inline(always)]
    fn fused_times(self, a: f64, b: f64) -> f64 {
        self.fused(a, b)
    }
    #[inline(always)]
    fn less(self, other: f64) -> bool {
        self < other
    }
    #[inline(always)]
    fn select(mask: bool, yes: f64, no: f64) -> f64 {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn mask(value: bool) -> bool {
        value
    }
    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn exp(self) -> f64 {
        elementary::exp(self)
    }
    #[inline(always)]
    fn ln(self) -> f64 {
        elementary::ln(self)
    }
    #[inline(always)]
    fn sin(self) -> f64 {
        elementary::sin_cos(self).0
    }
    #[inline(always)]
    fn cos(self) -> f64 {
        elementary::sin_cos(self).1
    }
    #[inline(always)]
    fn tanh(self) -> f64 {
        elementary::tanh(self)
    }
    #[inline(always)]
    fn atan2(self, x: f64) -> f64 {
        f64::atan2(self, x)
    }
    #[inline(always)]
    fn sin_cos(self) -> (f64, f64) {
        elementary::sin_cos(self)
    }
}

impl Real for f64 {
    const LANES: usize = 1;

    #[inline(always)]
    fn work<W: Work>(isa: Isa, work: W) -> W::Output {
        if const { W::WIDE } { isa.run(work) } else { isa.run_narrow(work) }
    }
    #[inline(always)]
    fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> f64 {
        lane(0)
    }
    #[inline(always)]
    fn lane(self, _i: usize) -> f64 {
        self
    }
    #[inline(always)]
    fn set_lane(&mut self, _i: usize, value: f64) {
        *self = value;
    }
    #[inline(always)]
    fn each(self, f: impl Fn(f64) -> f64) -> f64 {
        f(self)
    }
    #[inline(always)]
    fn zip(self, other: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
        f(self, other)
    }
}

impl Mask for bool {
    #[inline(always)]
    fn from_lanes(mut lane: impl FnMut(usize) -> bool) -> bool {
        lane(0)
    }
    #[inline(always)]
    fn lane(self, _i: usize) -> bool {
        self
    }
    #[inline(always)]
    fn and(self, other: bool) -> bool {
        self & other
    }
    #[inline(always)]
    fn or(self, other: bool) -> bool {
        self | other
    }
    #[inline(always)]
    fn not(self) -> bool {
        !self
    }
    #[inline(always)]
    fn bits(self) -> u64 {
        u64::from(self)
    }
}
