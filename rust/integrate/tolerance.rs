//! How accurate a run shall be, and how it can fail.

use thiserror::Error;

use crate::scalar::{Dual, Mask, Real, Scalar};
use crate::unroll::{unroll, vector};

/// How large the error of a step is.
pub trait ErrorNorm<S: Scalar, const D: usize> {
    /// The norm of the error of a step from one state to another: 1 where it is just allowed.
    fn of_step(&self, error: &[S; D], before: &[S; D], after: &[S; D]) -> S::Real;

    /// What is allowed for the state alone.
    fn state(&self) -> &Tolerance;

    /// Whether more than the state counts.
    const TANGENTS: bool = false;
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
    #[inline(always)]
    pub fn norm<R: Real, const D: usize>(&self, error: [R; D], before: [R; D], after: [R; D]) -> R {
        let mut sum = R::zero();
        unroll!(n in 0..D => {
            let size = before[n].abs().max(after[n].abs());
            let ratio = error[n] / (size.scale(self.rtol) + R::constant(self.atol));
            sum += ratio * ratio;
        });
        sum.scale(1.0 / D as f64).sqrt()
    }
}

impl<S: Scalar, const D: usize> ErrorNorm<S, D> for Tolerance {
    #[inline(always)]
    fn of_step(&self, error: &[S; D], before: &[S; D], after: &[S; D]) -> S::Real {
        let real = |x: &[S; D]| vector!(S::Real, D; n => x[n].real());
        self.norm(real(error), real(before), real(after))
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

impl<R: Real, const D: usize, const N: usize> ErrorNorm<Dual<R, N>, D> for WithTangents {
    #[inline(always)]
    fn of_step(&self, error: &[Dual<R, N>; D], before: &[Dual<R, N>; D], after: &[Dual<R, N>; D]) -> R {
        let mut worst = self.0.of_step(error, before, after);
        for i in 0..N {
            let length = |v: &[Dual<R, N>; D]| {
                let mut sum = R::zero();
                for n in 0..D {
                    sum += v[n].d[i] * v[n].d[i];
                }
                sum
            };
            let allowed = length(before).max(length(after)).scale(self.0.rtol * self.0.rtol);
            let ratio = (length(error) / allowed).sqrt();
            // A tangent of no length has no error; what is not a number stays.
            worst = R::select(R::zero().less(allowed).and(ratio.less(worst).not()), ratio, worst);
        }
        worst
    }

    fn state(&self) -> &Tolerance {
        &self.0
    }

    const TANGENTS: bool = true;
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
    #[error("the law switches without end at t = {t}: the run chatters")]
    Chattering { t: f64 },
    #[error("interrupted")]
    Interrupted,
}
