//! How far a Taylor polynomial reaches, and its values.

use std::array::from_fn;

use super::Jets;
use crate::scalar::{Real, Scalar};

impl<S: Scalar, const D: usize, const N: usize> Jets<S, D, N> {
    /// The solution at a distance `dt` from where it was expanded.
    #[inline(always)]
    pub fn at(&self, dt: S::Real) -> [S; D] {
        let dt2 = dt * dt;
        let dt4 = dt2 * dt2;
        from_fn(|n| {
            let c = &self.coefficients()[n];
            // Four polynomials in dt^4 side by side; the state itself is added last, which rounds once.
            let part = |r: usize| {
                let last = r + (N - 1 - r) / 4 * 4;
                let mut sum = c[last];
                let mut k = last;
                while k > r {
                    k -= 4;
                    sum = sum.times(dt4) + c[k];
                }
                sum
            };
            let (low, high) = (part(1) + part(2).times(dt), part(3) + part(4).times(dt));
            c[0] + (low + high.times(dt2)).times(dt)
        })
    }

    /// The step size at which the last two terms are as small as allowed: `atol + rtol |x|` in the root
    /// mean square over the components. Not a number where a coefficient is none.
    ///
    /// À. Jorba and M. Zou, Experimental Mathematics 14 (2005) 99, section 3.2.
    #[inline(always)]
    pub fn radius(&self, rtol: f64, atol: f64) -> S::Real {
        let constant = S::Real::constant;
        let inverse: [S::Real; D] = from_fn(|n| {
            let size = self.coefficients()[n][0].real().abs();
            constant(1.0) / (constant(atol) + size.scale(rtol))
        });
        // The squared norm of order k.
        let norm = |k: usize| {
            let mut sum = constant(0.0);
            for (series, inverse) in self.coefficients().iter().zip(inverse) {
                sum += (series[k].real() * inverse).square();
            }
            sum.scale(1.0 / D as f64)
        };
        let reach = |k: usize| norm(k).ln().scale(-0.5 / k as f64);
        reach(N - 1).min(reach(N - 2)).exp()
    }
}
