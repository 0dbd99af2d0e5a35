//! How far a Taylor polynomial reaches, and its values.

use std::convert::identity;

use super::Jets;
use crate::scalar::elementary::power_rough;
use crate::scalar::{InstructionSet, Mask, Packet, Real, Scalar, Work, vector};
use crate::tolerance::ErrorNorm;
use crate::unroll::unroll;

/// 2^-600: the square of the largest number times this, over a tolerance, is still a number.
const SMALL: f64 = f64::from_bits((1023 - 600) << 52);

impl<S: Scalar, const D: usize, const N: usize> Jets<S, D, N> {
    /// The solution at a distance `dt` from where it was expanded.
    pub fn at(&self, dt: S::Real) -> [S; D] {
        S::Real::work(self.isa(), Value(self, dt))
    }

    /// The same without derivatives at these parts of a distance, of these components; the others are zero.
    pub fn along<const P: usize>(&self, dt: S::Real, parts: &[f64], of: &[bool; D]) -> [[S::Real; D]; P] {
        S::Real::work(self.isa(), Along::<S, D, N, P>(self, dt, parts, of))
    }

    /// The solution at a distance `dt` and the rates of its polynomial there, without their derivatives.
    pub fn at_with_slope(&self, dt: S::Real) -> ([S; D], [S::Real; D]) {
        S::Real::work(self.isa(), WithSlope(self, dt))
    }

    /// The same of the state without derivatives.
    pub fn real_with_slope(&self, dt: S::Real) -> ([S::Real; D], [S::Real; D]) {
        S::Real::work(self.isa(), RealWithSlope(self, dt))
    }

    /// As [`at`](Jets::at), with the caller's instructions, by the series up to this order.
    #[inline(always)]
    pub fn at_here(&self, order: usize, dt: S::Real) -> [S; D] {
        let (series, terms) = (self.coefficients(), order.min(N - 1) + 1);
        if const { size_of::<S>() == size_of::<S::Real>() } {
            return vector!(S, D; n => value(&series[n][..terms], dt, identity));
        }
        // Derivatives fill the registers: one component after the other.
        let mut x = [S::zero(); D];
        for n in 0..D {
            x[n] = value(&series[n][..terms], dt, identity);
        }
        x
    }

    /// As [`at_with_slope`](Jets::at_with_slope), with the caller's instructions, by the series up to this order.
    #[inline(always)]
    pub fn at_with_slope_here(&self, order: usize, dt: S::Real) -> ([S; D], [S::Real; D]) {
        let (series, terms) = (self.coefficients(), order.min(N - 1) + 1);
        let (mut x, mut slope) = ([S::zero(); D], [S::Real::zero(); D]);
        if const { size_of::<S>() == size_of::<S::Real>() } {
            unroll!(n in 0..D => { (x[n], slope[n]) = with_slope(&series[n][..terms], dt, identity); });
        } else {
            for n in 0..D {
                (x[n], slope[n]) = with_slope(&series[n][..terms], dt, identity);
            }
        }
        (x, slope)
    }

    /// The coefficients of a component up to the order.
    #[inline(always)]
    fn terms(&self, n: usize) -> &[S] {
        &self.coefficients()[n][..=self.order()]
    }

    #[inline(always)]
    fn real_values(&self, dt: S::Real, of: &[bool; D]) -> [S::Real; D] {
        if const { S::Real::LANES == 1 } {
            // Only where machines are rare.
            let mut x = [S::Real::zero(); D];
            for n in 0..D {
                if of[n] {
                    x[n] = value(self.terms(n), dt, S::real);
                }
            }
            return x;
        }
        vector!(S::Real, D; n => if of[n] { value(self.terms(n), dt, S::real) } else { S::Real::zero() })
    }

    /// How far the solution may be followed by the series up to this order: the last two terms are then as small
    /// as allowed. Not a number where one of these terms is none, or infinite.
    ///
    /// À. Jorba and M. Zou, Experimental Mathematics 14 (2005) 99, section 3.2.
    #[inline(always)]
    #[allow(clippy::eq_op, reason = "infinite or no number minus itself is no number")]
    pub fn radius<E: ErrorNorm<S, D>>(&self, order: usize, norm: &E, weights: &E::Weights) -> S::Real {
        let (series, order) = (self.coefficients(), order.clamp(4, N - 1));
        let mut sum = S::Real::zero();
        unroll!(n in 0..D => { sum += series[n][order].real() + series[n][order - 1].real(); });
        let (last, before) = (self.reach(order, norm, weights), self.reach(order - 1, norm, weights));
        let mut radius = last.0.min(before.0);
        // Near a pole the squares of norms are too large for a number long before the terms are.
        let square = last.1 + before.1;
        if square.finite().not().any() {
            radius = S::Real::select(square.finite(), radius, self.short_radius(order, norm, weights));
        }
        // Zero, or not a number.
        radius + (sum - sum)
    }

    /// The distance at which term `k` is as small as allowed, and the square of its norm.
    #[inline(always)]
    fn reach<E: ErrorNorm<S, D>>(&self, k: usize, norm: &E, weights: &E::Weights) -> (S::Real, S::Real) {
        let series = self.coefficients();
        let term = vector!(S, D; n => series[n][k]);
        let square = norm.of_term(&term, weights);
        (power_rough(square, -0.5 / k as f64), square)
    }

    /// The [`radius`](Jets::radius) where the terms are large: their norms are those of terms made small. Not a
    /// number where they carry derivatives, which may have become infinite first.
    #[cold]
    #[inline(never)]
    fn short_radius<E: ErrorNorm<S, D>>(&self, order: usize, norm: &E, weights: &E::Weights) -> S::Real {
        let series = self.coefficients();
        if const { size_of::<S>() > size_of::<S::Real>() } {
            return S::Real::constant(f64::NAN);
        }
        let reach = |k: usize| {
            let term = vector!(S, D; n => series[n][k].scale(SMALL));
            let square = norm.of_term(&term, weights);
            let mut rough = square;
            for lane in 0..S::Real::LANES {
                rough.set_lane(lane, power_rough(square.lane(lane), -0.5 / k as f64));
            }
            rough.scale(SMALL.powf(1.0 / k as f64)) + square.scale(0.0)
        };
        let (last, before) = (reach(order), reach(order - 1));
        last.min(before) + (last + before).scale(0.0)
    }
}

/// A component's value at `dt`, from its coefficients; `lift` turns them into numbers of the value's type, and does no more:
/// the compiler need not inline it.
#[inline(always)]
fn value<S: Copy, T: Scalar>(series: &[S], dt: T::Real, lift: impl Fn(S) -> T) -> T {
    evaluate::<false, _, _>(series, dt, lift).0
}

/// The same and the derivative with respect to `dt`.
#[inline(always)]
fn with_slope<S: Copy, T: Scalar>(series: &[S], dt: T::Real, lift: impl Fn(S) -> T) -> (T, T::Real) {
    evaluate::<true, _, _>(series, dt, lift)
}

#[inline(always)]
fn evaluate<const SLOPE: bool, S: Copy, T: Scalar>(
    series: &[S],
    dt: T::Real,
    lift: impl Fn(S) -> T,
) -> (T, T::Real) {
    let dt2 = dt * dt;
    let dt4 = dt2 * dt2;
    // Four polynomials in dt^4 side by side, of the orders 1, 5, ..., 2, 6, ... and so on.
    let (mut groups, mut highest) = series[1..].as_chunks::<4>();
    if highest.is_empty()
        && let [lower @ .., last] = groups
    {
        (groups, highest) = (lower, last);
    }
    let mut sums = [T::zero(); 4];
    for (sum, &c) in sums.iter_mut().zip(highest) {
        *sum = lift(c);
    }
    // Their derivatives with respect to dt^4.
    let mut slopes = [T::Real::zero(); 4];
    for group in groups.iter().rev() {
        for r in 0..4 {
            if const { SLOPE } {
                slopes[r] = sums[r].real().fused(slopes[r], dt4);
            }
            sums[r] = lift(group[r]).fused_times(sums[r], dt4);
        }
    }
    // The state itself is added last, which rounds once.
    let (low, high) = (sums[0].fused_times(sums[1], dt), sums[2].fused_times(sums[3], dt));
    let value = lift(series[0]).fused_times(low.fused_times(high, dt2), dt);
    if const { !SLOPE } {
        return (value, T::Real::zero());
    }
    // The derivative of dt^(r + 1) S(dt^4) is dt^r ((r + 1) S + 4 dt^4 S').
    let outer = dt4.scale(4.0);
    let mut parts = [T::Real::zero(); 4];
    for r in 0..4 {
        parts[r] = sums[r].real().scale((r + 1) as f64).fused(slopes[r], outer);
    }
    (value, parts[0].fused(parts[1], dt).fused(parts[2].fused(parts[3], dt), dt2))
}

/// The number without derivatives, in every lane.
#[inline(always)]
fn broadcast<S: Scalar, const P: usize, V: InstructionSet>(c: S) -> Packet<P, V> {
    Packet::new([c.real().lane(0); P])
}

struct Value<'a, S: Scalar, const D: usize, const N: usize>(&'a Jets<S, D, N>, S::Real);

impl<S: Scalar, const D: usize, const N: usize> Work for Value<'_, S, D, N> {
    type Output = [S; D];

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> [S; D] {
        self.0.at_here(self.0.order(), self.1)
    }
}

struct WithSlope<'a, S: Scalar, const D: usize, const N: usize>(&'a Jets<S, D, N>, S::Real);

impl<S: Scalar, const D: usize, const N: usize> Work for WithSlope<'_, S, D, N> {
    type Output = ([S; D], [S::Real; D]);

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Self::Output {
        self.0.at_with_slope_here(self.0.order(), self.1)
    }
}

struct RealWithSlope<'a, S: Scalar, const D: usize, const N: usize>(&'a Jets<S, D, N>, S::Real);

impl<S: Scalar, const D: usize, const N: usize> Work for RealWithSlope<'_, S, D, N> {
    type Output = ([S::Real; D], [S::Real; D]);

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Self::Output {
        let Self(jets, dt) = self;
        let (mut x, mut slope) = ([S::Real::zero(); D], [S::Real::zero(); D]);
        for n in 0..D {
            (x[n], slope[n]) = with_slope(jets.terms(n), dt, S::real);
        }
        (x, slope)
    }
}

struct Along<'a, S: Scalar, const D: usize, const N: usize, const P: usize>(
    &'a Jets<S, D, N>,
    S::Real,
    &'a [f64],
    &'a [bool; D],
);

impl<S: Scalar, const D: usize, const N: usize, const P: usize> Work for Along<'_, S, D, N, P> {
    type Output = [[S::Real; D]; P];

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> [[S::Real; D]; P] {
        let Self(jets, dt, parts, of) = self;
        let mut states = [[S::Real::zero(); D]; P];
        if const { S::Real::LANES == 1 && !V::ISA.is_rare() } {
            // One trajectory: the places are the lanes of a packet, for vector instructions.
            let part = |i: usize| parts.get(i).copied().unwrap_or_default();
            let places: Packet<P, V> = Packet::from_lanes(|i| dt.lane(0) * part(i));
            unroll!(n in 0..D => {
                if of[n] {
                    let found = value(jets.terms(n), places, broadcast::<S, P, V>);
                    for i in 0..P {
                        states[i][n] = S::Real::constant(found.lane(i));
                    }
                }
            });
        } else {
            for i in 0..parts.len() {
                states[i] = jets.real_values(dt.scale(parts[i]), of);
            }
        }
        states
    }
}
