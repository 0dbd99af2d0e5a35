//! The continuous extension of a step.

use std::array::from_fn;

use super::step::Step;
use super::tableau::{DORMAND_PRINCE as METHOD, STAGES};
use crate::scalar::Scalar;

/// The state within a step as a polynomial of order 4 in `θ = (t - t0)/h`.
#[derive(Clone, Copy, Debug)]
pub struct Dense<S, const D: usize> {
    /// The state at the start.
    start: [S; D],
    /// The coefficients of `θ, θ^2, θ^3, θ^4`.
    powers: [[S; D]; 4],
}

impl<S: Scalar, const D: usize> Dense<S, D> {
    /// The extension of a step of size `h` from `x`.
    pub fn new(x: &[S; D], step: &Step<S, D>, h: S::Real) -> Self {
        Self::from_stages(x, |i, n| step.stages[i][n], h)
    }

    /// The same from the stages' rates, `rate(stage, component)`.
    #[inline(always)]
    pub fn from_stages(x: &[S; D], rate: impl Fn(usize, usize) -> S, h: S::Real) -> Self {
        let powers = from_fn(|j| {
            from_fn(|n| {
                let mut sum = rate(0, n).scale(METHOD.p[0][j]);
                for i in 1..STAGES {
                    if METHOD.p[i][j] != 0.0 {
                        sum += rate(i, n).scale(METHOD.p[i][j]);
                    }
                }
                sum.times(h)
            })
        });
        Self { start: *x, powers }
    }

    /// The state at `θ`, from 0 at the start of the step to 1 at its end.
    #[inline(always)]
    pub fn at(&self, theta: S::Real) -> [S; D] {
        let [p1, p2, p3, p4] = &self.powers;
        from_fn(|n| {
            let sum = ((p4[n].times(theta) + p3[n]).times(theta) + p2[n]).times(theta) + p1[n];
            self.start[n] + sum.times(theta)
        })
    }

    /// The coefficients of `θ^0` to `θ^4`.
    pub fn coefficients(&self) -> [[S; D]; 5] {
        let [p1, p2, p3, p4] = self.powers;
        [self.start, p1, p2, p3, p4]
    }
}
