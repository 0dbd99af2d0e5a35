//! The polynomials of a step, looked at with the best instructions that there are.

use crate::analysis::poincare::sign_changes::{CLEAR, Side, Stretch, in_doubt, judge};
use crate::integrate::{MOST_PROBES, Method};
use crate::model::choose;
use crate::scalar::{InstructionSet, Isa, Mask, Packet, Real, Scalar, Work, vector};

/// The polynomials of a step, one for each component of the state, in their own unit of time.
pub struct DenseOutput<'a, R: Real, const D: usize> {
    isa: Isa,
    /// Lowest first.
    coefficients: [&'a [R]; D],
    pub unit: R,
}

impl<'a, R: Real, const D: usize> DenseOutput<'a, R, D> {
    /// Those of the method's last trial; `own` is room for what it does not have at hand.
    #[inline(always)]
    pub fn of<K: Method<R, D>>(method: &'a K, isa: Isa, own: &'a mut Room<R, D>) -> Self {
        if K::SERIES {
            let mut coefficients: [&[R]; D] = [&[]; D];
            for n in 0..D {
                coefficients[n] = method.component(n).unwrap_or_default();
            }
            return Self { isa, coefficients, unit: R::one() };
        }
        own.states.clear();
        let unit = method.polynomial(&mut own.states);
        for (n, list) in own.components.iter_mut().enumerate() {
            list.clear();
            for x in &own.states {
                list.push(x[n]);
            }
        }
        let mut coefficients: [&[R]; D] = [&[]; D];
        for n in 0..D {
            coefficients[n] = &own.components[n];
        }
        Self { isa, coefficients, unit }
    }

    /// The state at `s`.
    #[inline(always)]
    pub fn state(&self, s: R) -> [R; D] {
        vector!(R, D; n => R::work(self.isa, At { c: self.coefficients[n], s }))
    }

    /// The coefficients of a component.
    pub fn component(&self, n: usize) -> &'a [R] {
        self.coefficients[n]
    }

    /// Looks where a component crosses a value; returns the sides after that, and the lanes in doubt.
    #[inline(always)]
    pub fn signs(&self, n: usize, scan: Scanned<'_, R>, stretches: &mut [Stretch<R>]) -> (Side<R>, R::Mask) {
        R::work(self.isa, Signs { c: self.coefficients[n], scan, stretches })
    }

    /// Where a component has a value, between the two places; `zero` is what counts as that.
    #[inline(always)]
    pub fn root(&self, n: usize, less: f64, low: (R, R), high: (R, R), zero: R, lanes: R::Mask) -> R {
        R::work(self.isa, Root { c: self.coefficients[n], less, low, high, zero, lanes })
    }
}

/// Room for polynomials.
pub struct Room<R: Real, const D: usize> {
    states: Vec<[R; D]>,
    components: [Vec<R>; D],
}

impl<R: Real, const D: usize> Room<R, D> {
    pub fn new() -> Self {
        Self { states: Vec::with_capacity(32), components: std::array::from_fn(|_| Vec::with_capacity(32)) }
    }
}

/// The value at `s`; `lift` makes the coefficients as wide as `s`.
#[inline(always)]
fn value<R: Real, P: Real>(c: &[R], s: P, lift: impl Fn(R) -> P) -> P {
    // Two sums side by side; the state itself is added last, which rounds once.
    let square = s * s;
    let (mut odd, mut even) = (P::zero(), P::zero());
    let (pairs, rest) = c[1..].as_chunks::<2>();
    if let [last] = rest {
        odd = lift(*last);
    }
    for pair in pairs.iter().rev() {
        odd = lift(pair[0]).fused(odd, square);
        even = lift(pair[1]).fused(even, square);
    }
    lift(c[0]).fused(odd.fused(even, s), s)
}

struct At<'a, R> {
    c: &'a [R],
    s: R,
}

impl<R: Real> Work for At<'_, R> {
    type Output = R;

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> R {
        value(self.c, self.s, |c| c)
    }
}

/// The target: a value, from the given places and sides on.
pub struct Scanned<'a, R: Real> {
    pub less: f64,
    /// The places, as parts of the size.
    pub probes: &'a [f64],
    pub size: R,
    /// The function's value at the last of them.
    pub end: R,
    pub side: Side<R>,
}

struct Signs<'a, R: Real> {
    c: &'a [R],
    scan: Scanned<'a, R>,
    stretches: &'a mut [Stretch<R>],
}

impl<R: Real> Work for Signs<'_, R> {
    type Output = (Side<R>, R::Mask);

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> (Side<R>, R::Mask) {
        let Scanned { less, probes, size, end, side } = self.scan;
        let mut s = [R::zero(); MOST_PROBES];
        for i in 0..probes.len() {
            s[i] = size.scale(probes[i]);
        }
        let mut values = [end; MOST_PROBES];
        let start = self.c[0] - R::constant(less);
        if const { R::LANES == 1 } {
            // One trajectory: all places side by side, as vector instructions need them.
            let places = Packet::<MOST_PROBES, V>::from_lanes(|i| s[i].lane(0));
            let found = value(self.c, places, |c| Packet::new([c.lane(0); MOST_PROBES]));
            // As in `in_doubt`: each value is then large enough for half of the sum with its neighbour.
            let at = |i: usize| if i == 0 { start.lane(0) + less } else { found.lane(i - 1) };
            let bend = |i: usize| (at(i - 1) - 2.0 * at(i) + at(i + 1)).abs();
            let change = 0.5 * CLEAR * bend(1).max(bend(3)).max(bend(5).max(bend(7)));
            let (low, high) = (Packet::constant(less - change), Packet::constant(less + change));
            let all_below = side.below.any() && !found.less(low).not().any() && end.less(R::zero()).any();
            let all_above = side.above.any() && !high.less(found).not().any() && R::zero().less(end).any();
            if all_below || all_above {
                // As in most steps, no crossing.
                if let [.., last] = self.stretches {
                    *last = Stretch { s: size, value: end, crossing: R::mask(false) };
                }
                return (side, R::mask(false));
            }
            for i in 0..MOST_PROBES {
                values[i] = R::constant(found.lane(i)) - R::constant(less);
            }
            values[probes.len() - 1] = end;
        } else {
            for i in 0..probes.len() - 1 {
                values[i] = value(self.c, s[i], |c| c) - R::constant(less);
            }
        }
        let doubt = in_doubt(start, &values[..probes.len()]);
        (judge(&s, &values, side, self.stretches), doubt)
    }
}

struct Root<'a, R: Real> {
    c: &'a [R],
    less: f64,
    low: (R, R),
    high: (R, R),
    zero: R,
    lanes: R::Mask,
}

impl<R: Real> Work for Root<'_, R> {
    type Output = R;

    /// Newton's method, with a bisection where it leaves the bracket and every fourth time, which bounds
    /// the work.
    #[inline(always)]
    fn run<V: InstructionSet>(self) -> R {
        let Self { c, less, mut low, high, zero, mut lanes } = self;
        let rising = low.1.less(high.1);
        let (mut top, mut s) = (high.0, low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1));
        // A zero at the start of the bracket is the answer.
        let at_start = low.1.abs().less(R::constant(f64::MIN_POSITIVE));
        s = R::select(at_start, low.0, s);
        lanes = lanes.and(at_start.not());
        for count in 1..=200 {
            let (value, slope) = value_and_slope(c, s);
            let value = value - R::constant(less);
            let narrow = s.abs().scale(f64::EPSILON).less((top - low.0).abs()).not();
            lanes = lanes.and(zero.less(value.abs())).and(narrow.not());
            if !lanes.any() {
                break;
            }
            let before = choose(rising, value.less(R::zero()), R::zero().less(value));
            low.0 = R::select(lanes.and(before), s, low.0);
            top = R::select(lanes.and(before.not()), s, top);
            let guess = s - value / slope;
            let (ahead, behind) = (guess - low.0, top - guess);
            let inside = R::zero().less(ahead * behind).and(R::mask(count % 4 != 0));
            let next = R::select(inside, guess, (low.0 + top).scale(0.5));
            s = R::select(lanes, next, s);
        }
        s
    }
}

/// The value and the derivative at `s`.
#[inline(always)]
fn value_and_slope<R: Real>(c: &[R], s: R) -> (R, R) {
    let square = s * s;
    let zero = R::zero();
    let (mut odd, mut even, mut odd_slope, mut even_slope) = (zero, zero, zero, zero);
    let (pairs, rest) = c[1..].as_chunks::<2>();
    let mut k = 2.0 * pairs.len() as f64;
    if let [last] = rest {
        (odd, odd_slope) = (*last, last.scale(k + 1.0));
    }
    for pair in pairs.iter().rev() {
        odd = pair[0].fused(odd, square);
        even = pair[1].fused(even, square);
        odd_slope = pair[0].scale(k - 1.0).fused(odd_slope, square);
        even_slope = pair[1].scale(k).fused(even_slope, square);
        k -= 2.0;
    }
    (c[0].fused(odd.fused(even, s), s), odd_slope.fused(even_slope, s))
}
