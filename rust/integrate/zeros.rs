//! The places at which a function changes its sign within a step.
//!
//! Along a step every function of time and state is one of `s`, the part of the step that has passed. A piece of the
//! step is settled where interval arithmetic proves that the function has no zero there, or that its slope has none;
//! every other piece is halved. So a function may change as fast as it likes, whatever the step.

use crate::scalar::{Dual, Enclosed, Interval, Scalar};

/// Ends closer to one another than this part of what they are made of differ by rounding alone.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// A piece is noise where its values spread at most this many times as far as rounding spreads those of one place.
const NOISE: f64 = 4.0;
/// After each so many halvings a piece is checked for being noise.
const SHALLOW: u32 = 4;
/// No piece is halved more often.
const DEEPEST: u32 = 60;
/// The most terms of a step's polynomials.
const MOST_TERMS: usize = 32;
/// Nothing is hidden between two places if the bend of the values, times these, is less than their distance from zero, or
/// from one another.
const DIP: f64 = 1.0;
const TURN: f64 = 2.0;

/// A function along a step, `s` from 0 to 1.
pub trait Curve {
    fn value(&mut self, s: f64) -> f64;
    /// All its values and slopes from `a` to `b`. Both are unknown where it is undefined, the slope where it jumps.
    fn enclose(&mut self, a: f64, b: f64) -> Enclosed;
}

/// A piece of a step on whose ends a function has different signs; it has no other change of sign there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bracket {
    /// The place, and the value there.
    pub low: (f64, f64),
    pub high: (f64, f64),
}

/// The answer of a visitor: whether to search on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    Next,
    Enough,
}

/// The side of zero that a function was last on, and where.
pub type Known = Option<(f64, f64, bool)>;

/// Shows `visit` the changes of sign from 0 to 1, in this order. `before` is the side at the start; `first` and `last` are
/// the values at the ends. Returns the end of the searched part: less than 1 if `patient` refuses the number of pieces.
pub fn sign_changes(
    curve: &mut dyn Curve,
    before: Known,
    (first, last): (f64, f64),
    patient: &dyn Fn(usize) -> bool,
    visit: &mut dyn FnMut(Bracket) -> Search,
) -> f64 {
    let mut known = before;
    let (mut a, mut fa) = (0.0, first);
    // The ends of the pieces to come, the next one last.
    let (mut ends, mut open) = ([(1.0, last, 0_u32); DEEPEST as usize + 2], 1);
    let mut pieces = 0;
    while open > 0 {
        let (b, fb, depth) = ends[open - 1];
        pieces += 1;
        if !patient(pieces) {
            return a;
        }
        let m = 0.5 * (a + b);
        let fm = curve.value(m);
        if !is_settled(curve, (a, fa), (m, fm), (b, fb), depth) {
            ends[open - 1].2 = depth + 1;
            ends[open] = (m, fm, depth + 1);
            open += 1;
            continue;
        }
        open -= 1;
        let below = fb < 0.0;
        if fb.is_nan() {
            known = None;
        } else if fb != 0.0 {
            if let Some((s, value, side)) = known
                && side != below
            {
                let low = if fa != 0.0 && (fa < 0.0) == side { (a, fa) } else { (s, value) };
                if visit(Bracket { low, high: (b, fb) }) == Search::Enough {
                    return b;
                }
            }
            known = Some((b, fb, below));
        }
        (a, fa) = (b, fb);
    }
    1.0
}

/// Returns true if the function has at most one change of sign between `a` and `b`, or changes by rounding alone.
fn is_settled(
    curve: &mut dyn Curve,
    (a, fa): (f64, f64),
    (m, fm): (f64, f64),
    (b, fb): (f64, f64),
    depth: u32,
) -> bool {
    // No room for a place between, or nothing defined.
    if m <= a || m >= b || depth == DEEPEST || fa.is_nan() && fm.is_nan() && fb.is_nan() {
        return true;
    }
    let Dual { re: value, d: [slope] } = curve.enclose(a, b);
    if value.excludes_zero() {
        return true;
    }
    let mut width = value.width();
    if width.is_finite() {
        // The mean-value form is the narrower one over short pieces.
        let mean = Interval::constant(fm) + slope * Interval::around(0.0, 0.5 * (b - a));
        if mean.excludes_zero() || slope.excludes_zero() {
            return true;
        }
        width = width.min(mean.width());
    }
    if depth < SHALLOW || !depth.is_multiple_of(SHALLOW) {
        return false;
    }
    let mut at = |s: f64| curve.enclose(s, s).re.width();
    // If nothing is known even at single places, shorter pieces show no more: the values at the ends decide.
    width <= NOISE * at(m) || ![a, m, b].into_iter().any(|s| at(s).is_finite())
}

/// Returns true if the values at equidistant places show all zeros of a function that is as slow as the step's
/// polynomials: between neighbours it neither turns nor dips to zero.
pub fn resolved(values: &[f64]) -> bool {
    let bend = |i: usize| (values[i - 1] - 2.0 * values[i] + values[i + 1]).abs();
    let inner = 1..=values.len() - 2;
    (1..values.len()).all(|i| {
        let (a, b) = (values[i - 1], values[i]);
        let mut bend_here = bend(i.clamp(*inner.start(), *inner.end()));
        bend_here = bend_here.max(bend((i - 1).clamp(*inner.start(), *inner.end())));
        (a - b).abs() > TURN * bend_here || a.abs().min(b.abs()) > DIP * bend_here || !(a - b).is_finite()
    })
}

/// The polynomials of a step in `s`, one for each component of the state.
pub struct Polynomials<const D: usize> {
    /// Lowest first.
    coefficients: [[f64; MOST_TERMS]; D],
    counts: [usize; D],
}

/// A component's values, slopes and second derivatives over a piece of a step.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    pub value: Interval,
    pub slope: Interval,
    pub bend: Interval,
}

impl<const D: usize> Polynomials<D> {
    /// From those in another unit of time, of which the step takes `size`.
    pub fn new(count: usize, size: f64, coefficient: impl Fn(usize, usize) -> f64) -> Self {
        let mut own = Self { coefficients: [[0.0; MOST_TERMS]; D], counts: [1; D] };
        for n in 0..D {
            let mut power = 1.0;
            for k in 0..count {
                own.coefficients[n][k] = coefficient(n, k) * power;
                if own.coefficients[n][k] != 0.0 {
                    own.counts[n] = k + 1;
                }
                power *= size;
            }
        }
        own
    }

    fn component(&self, n: usize) -> &[f64] {
        &self.coefficients[n][..self.counts[n]]
    }

    /// The state at `s`.
    pub fn at(&self, s: f64) -> [f64; D] {
        std::array::from_fn(|n| self.component(n).iter().rev().fold(0.0, |sum, &c| sum * s + c))
    }

    /// All that component `n` is from `a` to `b`, with what rounding adds.
    pub fn range(&self, n: usize, a: f64, b: f64) -> Range {
        let (m, r) = (0.5 * (a + b), 0.5 * (b - a));
        let (mut shifted, count) = (self.coefficients[n], self.counts[n]);
        let c = &mut shifted[..count];
        let size = c.iter().rev().fold(0.0, |sum, &c| sum * b + c.abs());
        for i in 0..c.len() {
            for k in (i..c.len() - 1).rev() {
                c[k] += m * c[k + 1];
            }
        }
        let (mut value, mut slope, mut bend) = (0.0, 0.0, 0.0);
        for k in (1..c.len()).rev() {
            let (own, k) = (c[k].abs(), k as f64);
            value = (value + own) * r;
            if k > 1.0 {
                slope = (slope + k * own) * r;
            }
            if k > 2.0 {
                bend = (bend + k * (k - 1.0) * own) * r;
            }
        }
        let c = |k: usize| c.get(k).copied().unwrap_or(0.0);
        Range {
            value: Interval::around(c(0), value + ROUNDING * size),
            slope: Interval::around(c(1), slope),
            bend: Interval::around(2.0 * c(2), bend),
        }
    }

    /// The same as a number for a law.
    pub fn enclose(&self, n: usize, a: f64, b: f64) -> Enclosed {
        let Range { value, slope, .. } = self.range(n, a, b);
        Dual { re: value, d: [slope] }
    }
}

/// The time from `a` to `b` of a step that begins at `start` and takes `size`.
pub fn time(start: f64, size: f64, a: f64, b: f64) -> Enclosed {
    let (from, to) = (start + a * size, start + b * size);
    let rounding = ROUNDING * from.abs().max(to.abs());
    let re = Interval::new(from.min(to) - rounding, from.max(to) + rounding);
    Dual { re, d: [Interval::new(size, size)] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `f` of `s`, and the same over intervals.
    struct Of(fn(f64) -> f64, fn(Enclosed) -> Enclosed);

    impl Curve for Of {
        fn value(&mut self, s: f64) -> f64 {
            self.0(s)
        }
        fn enclose(&mut self, a: f64, b: f64) -> Enclosed {
            self.1(time(0.0, 1.0, a, b))
        }
    }

    fn found(mut curve: Of) -> (Vec<Bracket>, usize) {
        let (first, last) = (curve.value(0.0), curve.value(1.0));
        let (mut list, pieces) = (Vec::new(), std::cell::Cell::new(0));
        let known = (first != 0.0).then_some((0.0, first, first < 0.0));
        let patient = |count| {
            pieces.set(count);
            count < 100_000
        };
        let far = sign_changes(&mut curve, known, (first, last), &patient, &mut |bracket| {
            list.push(bracket);
            Search::Next
        });
        assert_eq!(far, 1.0, "{list:?}");
        (list, pieces.get())
    }

    #[test]
    fn every_change_of_sign_is_seen_once() {
        // cos(1000 s) + 0.9: two in each of 159.15 turns.
        let (list, pieces) =
            found(Of(|s| Scalar::cos(1000.0 * s) + 0.9, |s| s.scale(1000.0).cos() + Enclosed::constant(0.9)));
        assert_eq!(list.len(), 318);
        assert!(pieces < 8000, "{pieces}");
        for (k, own) in list.iter().enumerate() {
            let turn = std::f64::consts::TAU * (k / 2) as f64;
            let phase =
                if k % 2 == 0 { (-0.9_f64).acos() } else { std::f64::consts::TAU - (-0.9_f64).acos() };
            let right = (turn + phase) / 1000.0;
            assert!(own.low.0 <= right && right <= own.high.0, "{right} is not in {own:?}");
        }
    }

    #[test]
    fn what_only_touches_zero_ends_and_is_no_change() {
        let (list, pieces) = found(Of(|s| (s - 0.3) * (s - 0.3), |s| (s - Enclosed::constant(0.3)).square()));
        assert!(list.is_empty() && pieces < 400, "{list:?} {pieces}");
        // Zero everywhere, to rounding.
        let (list, pieces) = found(Of(|s| s - s, |s| s - s));
        assert!(list.len() < 2 && pieces < 400, "{list:?} {pieces}");
    }

    #[test]
    fn a_near_tangent_is_crossed_twice() {
        let (list, _) = found(Of(
            |s| (s - 0.3) * (s - 0.3) - 1e-12,
            |s| (s - Enclosed::constant(0.3)).square() - Enclosed::constant(1e-12),
        ));
        assert_eq!(list.len(), 2, "{list:?}");
    }

    #[test]
    fn a_polynomials_range_contains_it() {
        let cubic = Polynomials::<1>::new(4, 10.0, |_, k| [-120.0, 1.0, 2.0, -0.3][k]);
        for (a, b) in [(0.0, 1.0), (0.2, 0.25), (0.7, 0.7)] {
            let range = cubic.range(0, a, b);
            for k in 0..=50 {
                let [x] = cubic.at(a + (b - a) * f64::from(k) / 50.0);
                assert!(range.value.low <= x && x <= range.value.high);
            }
        }
    }

    #[test]
    fn equidistant_values_show_a_dip() {
        let values = |f: fn(f64) -> f64| [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0].map(|i| f(i / 8.0));
        assert!(resolved(&values(|s| s + 0.2)) && resolved(&values(|s| s - 0.31)));
        assert!(!resolved(&values(|s| (s - 0.31) * (s - 0.31) - 1e-6)));
        assert!(!resolved(&values(|s| (s - 0.31) * (s - 0.33) * (s - 0.35))));
    }
}
