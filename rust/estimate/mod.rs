//! Estimation: what measured motion says about the model.
//!
//! Weak-constraint multiple shooting: unknown are the state at every frame, the model's parameters
//! and the camera's. Minimised is
//!
//! ```text
//! sum |y_i - h(x_i; camera)|^2_R + sum |x_{i+1} - Phi(x_i; theta)|^2_Q + priors
//! ```
//!
//! by Gauss-Newton, with tangents from duals. The states' part of the normal equations is
//! block-tridiagonal, bordered by the parameters ([`Bordered`]). The same equations, with one more
//! column per candidate, give the [`score`](Estimator::score) of every effect the model may lack.

mod bordered;
mod evidence;
mod frequency_scan;
mod gauss_newton;
mod innovations;
mod linearise;
mod link_propagation;
mod link_response;
mod parameter_jacobian;
mod record;
mod row_matrix;
mod score;
mod sensor;
mod window_filter;

pub use bordered::{Bordered, Covariances, ReducedSystem};
pub use frequency_scan::{BASIS, FrequencyProbe};
pub use gauss_newton::{Cost, Options, Solution};
pub use linearise::{CachedLinearisation, Linearisation, ObservationResidual};
pub use link_response::{PLACES_PER_LINK, QuadraturePoint, QuadraturePoints, Transition};
pub use parameter_jacobian::ParameterJacobian;
pub use record::{FilmParameters, FreeParameter, Record, Role, Unknowns};
pub use row_matrix::RowMatrix;
pub use score::{Candidate, Score};
pub use sensor::{AngleSensor, DiskCamera, FormulaSensor, Moment, Sensor, seen};
pub use window_filter::Filtered;

use crate::integrate::{Failure, Tolerance};
use crate::model::Family;

/// An estimation problem: a family of models, a sensor and a record.
#[derive(Clone, Debug)]
pub struct Estimator<F, C, const D: usize, const M: usize>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    pub family: F,
    pub sensor: C,
    pub record: Record<M>,
    /// Which parameters are free, with their priors; in the order of the borders.
    pub free: Vec<FreeParameter>,
    /// Standard deviation of the model's error per state and square root of a second: the error
    /// over an interval `dt` has variance `q^2 dt`.
    pub diffusion: [f64; D],
    pub tolerance: Tolerance,
    /// The record linearised around some point already: this record as this sensor sees it, for this family, these
    /// free parameters and this tolerance. Its noise, the priors and the diffusion may differ.
    pub known: Option<CachedLinearisation<D, M>>,
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// The number of live states.
    #[inline]
    pub(super) fn live(&self) -> usize {
        D - self.family.idle()
    }
}

/// Why an estimate failed.
#[derive(Debug, thiserror::Error)]
pub enum EstimateError {
    #[error("the model could not be integrated from the state at t = {t} s: {source}")]
    Integration { t: f64, source: Failure },
    #[error("the data do not determine the state at t = {t} s")]
    Singular { t: f64 },
    /// The free parameters of these numbers can change together.
    #[error(
        "the data do not determine the free parameters: some can change together without changing the fit"
    )]
    Undetermined(Vec<usize>),
    #[error("{0}")]
    Invalid(String),
    #[error("interrupted")]
    Cancelled,
}
