//! How far a Taylor polynomial reaches, and its values.

use super::Jets;
use crate::scalar::{Real, Scalar, Work};
use crate::unroll::{unroll, vector};

impl<S: Scalar, const D: usize, const N: usize> Jets<S, D, N> {
    /// The solution at a distance `dt` from where it was expanded.
    pub fn at(&self, dt: S::Real) -> [S; D] {
        self.isa().run(Value(self, dt))
    }

    /// The same without derivatives.
    pub fn real_at(&self, dt: S::Real) -> [S::Real; D] {
        self.isa().run(RealValue(self, dt))
    }

    /// As [`at`](Jets::at), with the caller's instructions.
    #[inline(always)]
    pub fn at_here(&self, dt: S::Real) -> [S; D] {
        let dt2 = dt * dt;
        let dt4 = dt2 * dt2;
        let mut x = [S::zero(); D];
        unroll!(n in 0..D => {
            let c = &self.coefficients()[n];
            // Four polynomials in dt^4 side by side, of the orders 1, 5, ..., 2, 6, ... and so on.
            let rounds = N.div_ceil(4) - 1;
            let mut sums = [S::zero(); 4];
            unroll!(r in 0..4 => {
                let k = 4 * rounds + 1 + r;
                if k < N {
                    sums[r] = c[k];
                }
            });
            for round in (0..rounds).rev() {
                let four = &c[4 * round + 1..4 * round + 5];
                unroll!(r in 0..4 => { sums[r] = sums[r].times(dt4) + four[r]; });
            }
            // The state itself is added last, which rounds once.
            let (low, high) = (sums[0] + sums[1].times(dt), sums[2] + sums[3].times(dt));
            x[n] = c[0] + (low + high.times(dt2)).times(dt);
        });
        x
    }

    /// The step size at which the last two terms are as small as allowed: `atol + rtol |x|` in the root
    /// mean square over the components. Not a number where a coefficient is none.
    ///
    /// À. Jorba and M. Zou, Experimental Mathematics 14 (2005) 99, section 3.2.
    #[inline(always)]
    #[allow(clippy::eq_op, reason = "infinite or no number minus itself is no number")]
    pub fn radius(&self, rtol: f64, atol: f64) -> S::Real {
        let (mut last, mut before) = (S::Real::constant(0.0), S::Real::constant(0.0));
        unroll!(n in 0..D => {
            let c = &self.coefficients()[n];
            let allowed = S::Real::constant(atol) + c[0].real().abs().scale(rtol);
            let inverse = S::Real::constant(1.0) / allowed;
            last += (c[N - 1].real() * inverse).square();
            before += (c[N - 2].real() * inverse).square();
        });
        // From squared norms: h = min over k of norm(k)^(-1/k).
        let sum = last + before;
        let last = last.scale(1.0 / D as f64).each(logarithm).scale(-0.5 / (N - 1) as f64);
        let before = before.scale(1.0 / D as f64).each(logarithm).scale(-0.5 / (N - 2) as f64);
        // Zero, or not a number.
        last.min(before).each(power) + (sum - sum)
    }
}

struct Value<'a, S: Scalar, const D: usize, const N: usize>(&'a Jets<S, D, N>, S::Real);

impl<S: Scalar, const D: usize, const N: usize> Work for Value<'_, S, D, N> {
    type Output = [S; D];

    #[inline(always)]
    fn run<const L: usize>(self) -> [S; D] {
        self.0.at_here(self.1)
    }
}

struct RealValue<'a, S: Scalar, const D: usize, const N: usize>(&'a Jets<S, D, N>, S::Real);

impl<S: Scalar, const D: usize, const N: usize> Work for RealValue<'_, S, D, N> {
    type Output = [S::Real; D];

    #[inline(always)]
    fn run<const L: usize>(self) -> [S::Real; D] {
        let x = self.0.at_here(self.1);
        vector!(S::Real, D; n => x[n].real())
    }
}

/// The logarithm to base 2 of a positive number, to 0.01: enough for a step size, whose own logarithm is a
/// small fraction of it.
#[inline(always)]
fn logarithm(x: f64) -> f64 {
    const TWO_52: f64 = 4_503_599_627_370_496.0;
    let exponent = f64::from_bits((x.to_bits() >> 52) | TWO_52.to_bits()) - (TWO_52 + 1023.0);
    let m = f64::from_bits((x.to_bits() & ((1 << 52) - 1)) | 1f64.to_bits()) - 1.0;
    exponent + m * (1.346_5 - 0.346_5 * m)
}

/// 2 to the power of `y`, to 0.3 %; `|y| < 1000`.
#[inline(always)]
fn power(y: f64) -> f64 {
    // Adding this leaves the whole part of y + 1023 in the last bits.
    const SHIFT: f64 = 6_755_399_441_055_744.0 + 1023.0;
    let shifted = (y - 0.5) + SHIFT;
    let f = y - (shifted - SHIFT);
    f64::from_bits(shifted.to_bits() << 52) * (1.0 + f * (0.656_5 + 0.343_5 * f))
}
