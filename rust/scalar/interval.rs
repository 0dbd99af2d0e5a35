//! Intervals: all values that a number can have.
//!
//! A law evaluated over intervals encloses its values over a stretch of time and state (Moore, Interval Analysis, 1966);
//! over [`Enclosed`] numbers it also encloses their slopes. The ends are rounded to nearest, so whoever asks pads what
//! goes in. A function that is undefined somewhere in its argument gives NaN, and so does all that depends on it.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::{Dual, Mask, Plain, Real, Scalar, Work};

/// The numbers from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

/// An interval of values and one of slopes.
pub type Enclosed = Dual<Interval, 1>;

/// The outcome of a comparison of intervals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Truth {
    possible: bool,
    certain: bool,
}

impl Interval {
    pub const UNKNOWN: Self = Self { low: f64::NAN, high: f64::NAN };

    pub fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// All numbers that are no farther from `middle` than `radius`.
    pub fn around(middle: f64, radius: f64) -> Self {
        Self { low: middle - radius, high: middle + radius }
    }

    /// Whether it surely does not contain zero.
    pub fn excludes_zero(self) -> bool {
        self.low > 0.0 || self.high < 0.0
    }

    pub fn width(self) -> f64 {
        self.high - self.low
    }

    /// From the least to the largest of these; unknown where one of them is infinite or not a number.
    fn of(values: [f64; 4]) -> Self {
        let [a, b, c, d] = values;
        if !(a + b + c + d).is_finite() {
            return Self::UNKNOWN;
        }
        Self { low: a.min(b).min(c.min(d)), high: a.max(b).max(c.max(d)) }
    }

    fn hull(self, other: Self) -> Self {
        Self::of([self.low, self.high, other.low, other.high])
    }

    /// Its image under a function that rises.
    fn rising(self, f: impl Fn(f64) -> f64) -> Self {
        let (low, high) = (f(self.low), f(self.high));
        if (low + high).is_finite() { Self { low, high } } else { Self::UNKNOWN }
    }

    /// Whether it contains `place` plus a whole number of turns.
    fn passes(self, place: f64) -> bool {
        ((self.high - place) / TAU).floor() >= ((self.low - place) / TAU).ceil()
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { low: self.low + o.low, high: self.high + o.high }
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { low: self.low - o.high, high: self.high - o.low }
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self::of([self.low * o.low, self.low * o.high, self.high * o.low, self.high * o.high])
    }
}

impl Div for Interval {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        if !o.excludes_zero() {
            return Self::UNKNOWN;
        }
        Self::of([self.low / o.low, self.low / o.high, self.high / o.low, self.high / o.high])
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}

impl AddAssign for Interval {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl SubAssign for Interval {
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl Scalar for Interval {
    type Real = Self;
    type Mask = Truth;
    type Register = Self;

    fn register(self, _i: usize) -> Self {
        self
    }
    fn set_register(&mut self, _i: usize, lanes: Self) {
        *self = lanes;
    }
    fn constant(value: f64) -> Self {
        Self { low: value, high: value }
    }
    fn lift(value: Self) -> Self {
        value
    }
    fn real(self) -> Self {
        self
    }
    fn scale(self, factor: f64) -> Self {
        let (a, b) = (self.low * factor, self.high * factor);
        if factor < 0.0 { Self { low: b, high: a } } else { Self { low: a, high: b } }
    }
    fn times(self, factor: Self) -> Self {
        self * factor
    }
    fn fused(self, a: Self, b: Self) -> Self {
        self + a * b
    }
    fn fused_times(self, a: Self, b: Self) -> Self {
        self + a * b
    }
    fn less(self, other: Self) -> Truth {
        // NaN may be anything.
        let impossible = self.low >= other.high;
        Truth { possible: !impossible, certain: self.high < other.low }
    }
    fn select(mask: Truth, yes: Self, no: Self) -> Self {
        match mask {
            Truth { certain: true, .. } => yes,
            Truth { possible: false, .. } => no,
            _ => yes.hull(no),
        }
    }
    fn slope_of_jump(mask: Truth, yes: Self, no: Self) -> Self {
        if mask.possible && !mask.certain { Self::UNKNOWN } else { Self::select(mask, yes, no) }
    }
    fn is_single(self) -> bool {
        self.low == self.high
    }
    fn mask(value: bool) -> Truth {
        Truth { possible: value, certain: value }
    }
    fn square(self) -> Self {
        let (a, b) = (self.low * self.low, self.high * self.high);
        if self.low <= 0.0 && self.high >= 0.0 {
            return Self::of([0.0, a, b, 0.0]);
        }
        Self::of([a, b, a, b])
    }
    fn sqrt(self) -> Self {
        self.rising(f64::sqrt)
    }
    fn exp(self) -> Self {
        self.rising(Scalar::exp)
    }
    fn ln(self) -> Self {
        if self.low > 0.0 { self.rising(Scalar::ln) } else { Self::UNKNOWN }
    }
    fn sin(self) -> Self {
        if !self.width().is_finite() {
            return Self::UNKNOWN;
        }
        let ends = self.each(Scalar::sin);
        Self {
            low: if self.passes(-FRAC_PI_2) { -1.0 } else { ends.low },
            high: if self.passes(FRAC_PI_2) { 1.0 } else { ends.high },
        }
    }
    fn cos(self) -> Self {
        (self + Self::constant(FRAC_PI_2)).sin()
    }
    fn tanh(self) -> Self {
        self.rising(Scalar::tanh)
    }
    fn atan2(self, x: Self) -> Self {
        // Only the half line on which the angle jumps is left out.
        if !(x.low > 0.0 || self.excludes_zero()) {
            return Self::UNKNOWN;
        }
        let angle = f64::atan2;
        Self::of([
            angle(self.low, x.low),
            angle(self.low, x.high),
            angle(self.high, x.low),
            angle(self.high, x.high),
        ])
    }
}

impl Real for Interval {
    const LANES: usize = 1;

    fn work<W: Work>(_isa: super::Isa, work: W) -> W::Output {
        work.run::<Plain>()
    }
    fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Self {
        Self::constant(lane(0))
    }
    /// The middle.
    fn lane(self, _i: usize) -> f64 {
        0.5 * (self.low + self.high)
    }
    fn set_lane(&mut self, _i: usize, value: f64) {
        *self = Self::constant(value);
    }
    /// For functions that rise or fall.
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        let (a, b) = (f(self.low), f(self.high));
        Self::of([a, b, a, b])
    }
    /// For functions that rise or fall with either number.
    fn zip(self, o: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self::of([f(self.low, o.low), f(self.low, o.high), f(self.high, o.low), f(self.high, o.high)])
    }
    fn abs(self) -> Self {
        if self.low >= 0.0 {
            self
        } else if self.high <= 0.0 {
            -self
        } else {
            Self::of([0.0, -self.low, self.high, 0.0])
        }
    }
}

impl Mask for Truth {
    fn from_lanes(mut lane: impl FnMut(usize) -> bool) -> Self {
        Interval::mask(lane(0))
    }
    fn lane(self, _i: usize) -> bool {
        self.possible
    }
    fn and(self, o: Self) -> Self {
        Self { possible: self.possible && o.possible, certain: self.certain && o.certain }
    }
    fn or(self, o: Self) -> Self {
        Self { possible: self.possible || o.possible, certain: self.certain || o.certain }
    }
    fn not(self) -> Self {
        Self { possible: !self.certain, certain: !self.possible }
    }
    fn bits(self) -> u64 {
        u64::from(self.possible)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A function of intervals, and the same function of numbers.
    type Pair = (fn(Interval) -> Interval, fn(f64) -> f64);

    /// Every function's interval contains its values at 200 places within.
    #[test]
    fn functions_contain_their_values() {
        let functions: [Pair; 9] = [
            (Scalar::sin, f64::sin),
            (Scalar::cos, f64::cos),
            (Scalar::tanh, f64::tanh),
            (Scalar::square, |x| x * x),
            (Scalar::exp, f64::exp),
            (Real::abs, f64::abs),
            (|x| x.atan2(Interval::constant(1.0)), f64::atan),
            (|x| x * x - x, |x| x * x - x),
            (
                |x| Interval::select(x.less(Interval::zero()), -x, x.scale(-2.0)),
                |x| {
                    if x < 0.0 { -x } else { -2.0 * x }
                },
            ),
        ];
        for (low, width) in [(-3.0, 0.1), (-0.05, 0.1), (1.5, 0.2), (4.0, 3.0), (-7.0, 20.0), (100.0, 0.5)] {
            let whole = Interval::new(low, low + width);
            for (i, (over, at)) in functions.iter().enumerate() {
                let found = over(whole);
                for k in 0..=200 {
                    let value = at(low + width * f64::from(k) / 200.0);
                    let room = 1e-14 * (1.0 + value.abs());
                    let inside = found.low - room <= value && value <= found.high + room;
                    assert!(inside, "function {i} over {whole:?}: {value} is not in {found:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_undefined_is_unknown() {
        let across = Interval::new(-1.0, 2.0);
        let unknown = [across.ln(), across.sqrt(), Interval::one() / across, Interval::zero().atan2(across)];
        assert!(unknown.iter().all(|own| own.low.is_nan() && !own.excludes_zero()));
        // Neither excludes what a comparison of it may give.
        let mask = unknown[0].less(Interval::zero());
        assert!(mask.any() && mask.not().any());
    }
}
