//! How a run can fail.

use thiserror::Error;

/// Why a run could not go on.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum Failure {
    #[error("the state or its rate is not finite at t = {t}")]
    NotFinite { t: f64 },
    #[error(
        "the step size shrank to nothing at t = {t}: the tolerances are too tight or the solution blows up"
    )]
    StepUnderflow { t: f64 },
    #[error("no power series serves at t = {t}: the law is not smooth there, or the solution blows up")]
    NoSeries { t: f64 },
    #[error("more than {limit} steps were needed; the run stopped at t = {t}")]
    TooManySteps { t: f64, limit: u64 },
    #[error("the model is stiff at t = {t}: its steps are held down by stability")]
    Stiff { t: f64 },
    #[error("the disk left the wheels at t = {t}")]
    LeftDomain { t: f64 },
    #[error("the law switches without end at t = {t}: the run chatters")]
    Chattering { t: f64 },
    #[error(
        "keeping every step to t = {end} would need about {:.3} GB, and there is no room for more than \
         {:.3}: give the times that are wanted, or leave out dense", bytes * 1e-9, kept * 1e-9
    )]
    NoRoom { end: f64, bytes: f64, kept: f64 },
    #[error(
        "the steps of the run have become so short by t = {t} that it would hardly end: the solution turns or grows \
         ever faster; end it earlier"
    )]
    EverShorter { t: f64 },
    #[error(
        "a tangent grows or dies out beyond the range of numbers within an interval, by t = {t}: use a shorter dt, or \
         another start if a contact sticks there"
    )]
    LostTangent { t: f64 },
    #[error("interrupted")]
    Interrupted,
}

impl Failure {
    /// Whether a method that needs no power series may do better: from a pole of the law, or of a surface's
    /// function, a series may lead to where there is no number.
    pub fn is_of_series(&self) -> bool {
        matches!(self, Failure::NoSeries { .. } | Failure::NotFinite { .. })
    }
}
