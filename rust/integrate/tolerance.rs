//! How accurate a run shall be, and how it can fail.

use std::array::from_fn;

use thiserror::Error;

use super::step::Step;
use crate::scalar::{Dual, Scalar};

/// How large the error of a step is.
pub trait ErrorNorm<S: Scalar, const D: usize> {
    /// The norm of the error of a step of size `h` from `x`: 1 where it is just allowed.
    fn of_step(&self, x: &[S; D], step: &Step<S, D>, h: S::Real) -> f64;

    /// What is allowed for the state alone.
    fn state(&self) -> &Tolerance;
}

/// The error that a step may make in component `n`: `atol + rtol |x_n|`.
///
/// The norm is the root mean square over the components of the error divided by that. Over duals
/// only the state's own error counts, not that of its derivatives, so that a run with tangents takes
/// the same steps as one without. See [`WithTangents`] where that is not enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Relative tolerance.
    pub rtol: f64,
    /// Absolute tolerance, in the state's own units.
    pub atol: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { rtol: 1e-9, atol: 1e-12 }
    }
}

impl Tolerance {
    /// The norm of `error`: 1 where it is just allowed.
    #[inline]
    pub fn norm<const D: usize>(&self, error: [f64; D], before: [f64; D], after: [f64; D]) -> f64 {
        let mut sum = 0.0;
        for n in 0..D {
            let ratio = error[n] / (self.atol + self.rtol * before[n].abs().max(after[n].abs()));
            sum += ratio * ratio;
        }
        (sum / D as f64).sqrt()
    }
}

impl<S: Scalar<Real = f64>, const D: usize> ErrorNorm<S, D> for Tolerance {
    #[inline]
    fn of_step(&self, x: &[S; D], step: &Step<S, D>, h: f64) -> f64 {
        let real = |x: &[S; D]| from_fn(|n| x[n].real());
        self.norm(step.real_error(h), real(x), real(&step.x))
    }

    fn state(&self) -> &Tolerance {
        self
    }
}

/// The state's tolerance, and every tangent to the same relative tolerance of its length.
///
/// Where the state comes to rest its own error vanishes and no longer bounds the step size; the
/// tangents' still does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WithTangents(pub Tolerance);

impl<const D: usize, const N: usize> ErrorNorm<Dual<f64, N>, D> for WithTangents {
    #[inline]
    fn of_step(&self, x: &[Dual<f64, N>; D], step: &Step<Dual<f64, N>, D>, h: f64) -> f64 {
        let error = step.error(h);
        let mut worst = self.0.norm(error.map(|e| e.re), x.map(|v| v.re), step.x.map(|v| v.re));
        for i in 0..N {
            let length = |v: &[Dual<f64, N>; D]| v.iter().map(|v| v.d[i] * v.d[i]).sum::<f64>();
            let allowed = self.0.rtol.powi(2) * length(x).max(length(&step.x));
            if allowed > 0.0 {
                worst = worst.max((length(&error) / allowed).sqrt());
            }
        }
        worst
    }

    fn state(&self) -> &Tolerance {
        &self.0
    }
}

/// Why a run could not go on.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum Failure {
    #[error("the state or its rate is not finite at t = {t}")]
    NotFinite { t: f64 },
    #[error(
        "the step size shrank to nothing at t = {t}: the tolerances are too tight or the solution blows up"
    )]
    StepUnderflow { t: f64 },
    #[error("more than {limit} steps were needed; the run stopped at t = {t}")]
    TooManySteps { t: f64, limit: u64 },
    #[error("the disk left the wheels at t = {t}")]
    LeftDomain { t: f64 },
    #[error("interrupted")]
    Interrupted,
}
