//! One step of the method.

use std::array::from_fn;

use super::tableau::{DORMAND_PRINCE as METHOD, STAGES};
use crate::model::{Sides, System};
use crate::scalar::Scalar;

/// What a step gives.
#[derive(Clone, Copy, Debug)]
pub struct Step<S: Scalar, const D: usize> {
    /// The new state.
    pub x: [S; D],
    /// The rates at all stages; the last is the rate at the new state.
    pub stages: [[S; D]; STAGES],
}

/// Takes a step of size `h` (of either sign) from time `t` and state `x`, whose rate is `first`.
///
/// It is a pure function, and generic over the scalar: `h` has one value per lane and no
/// derivatives. The sides of the switching surfaces stay as given, so the step sees a smooth law.
#[inline]
pub fn step<S: Scalar, const D: usize>(
    system: &impl System<S, D>,
    t: S::Real,
    x: &[S; D],
    first: &[S; D],
    h: S::Real,
    sides: &Sides<S>,
) -> Step<S, D> {
    let mut stages = [*first; STAGES];
    let mut new = *x;
    for i in 1..STAGES {
        new = from_fn(|n| x[n] + combine(&METHOD.a[i], &stages, i, n).times(h));
        stages[i] = system.rates(S::lift(t + h.scale(METHOD.c[i])), &new, sides);
    }
    Step { x: new, stages }
}

impl<S: Scalar, const D: usize> Step<S, D> {
    /// The estimated error of the new state, for the size `h` of the step.
    #[inline]
    pub fn error(&self, h: S::Real) -> [S; D] {
        from_fn(|n| combine(&METHOD.e, &self.stages, STAGES, n).times(h))
    }

    /// The same without derivatives.
    #[inline]
    pub fn real_error(&self, h: S::Real) -> [S::Real; D] {
        from_fn(|n| {
            let mut sum = self.stages[0][n].real().scale(METHOD.e[0]);
            for j in 1..STAGES {
                sum += self.stages[j][n].real().scale(METHOD.e[j]);
            }
            sum * h
        })
    }
}

/// `Σ_(j < count) weights_j k_j` for component `n`, the zero weights left out.
#[inline(always)]
fn combine<S: Scalar, const D: usize>(
    weights: &[f64; STAGES],
    stages: &[[S; D]; STAGES],
    count: usize,
    n: usize,
) -> S {
    let mut sum = stages[0][n].scale(weights[0]);
    for j in 1..count {
        if weights[j] != 0.0 {
            sum += stages[j][n].scale(weights[j]);
        }
    }
    sum
}
