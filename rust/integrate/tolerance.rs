//! How accurate a run shall be, and how it can fail.

use thiserror::Error;

/// The error that a step may make in component `n`: `atol + rtol |x_n|`.
///
/// The norm is the root mean square over the components of the error divided by that. Over duals
/// only the state's own error counts, not that of its derivatives, so that a run with tangents takes
/// the same steps as one without; the tangents are then about as accurate as the state, relative to
/// their growth.
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
    #[error("the law switches back and forth without end at t = {t}")]
    Chattering { t: f64 },
    #[error("the disk left the wheels at t = {t}")]
    LeftDomain { t: f64 },
    #[error("interrupted")]
    Interrupted,
}
