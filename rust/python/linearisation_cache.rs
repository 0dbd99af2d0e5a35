//! The linearisation of a solve, kept for later requests at the same point.

use std::any::Any;

use nalgebra::SVector;
use pyo3::prelude::*;

use crate::estimate::{CachedLinearisation, Estimator, FreeParameter, Role, Sensor};
use crate::model::Family;

/// The record linearised where a solve ended: an estimator of any kind that knows it.
#[pyclass(frozen, module = "udd._core")]
pub struct Linearised(Box<dyn Any + Send + Sync>);

impl Linearised {
    /// Of this estimator.
    pub fn new<F, C, const D: usize, const M: usize>(
        mut of: Estimator<F, C, D, M>,
        known: CachedLinearisation<D, M>,
    ) -> Self
    where
        F: Family<D> + 'static,
        C: Sensor<D, M> + 'static,
    {
        of.known = Some(known);
        Self(Box::new(of))
    }

    /// The linearisation for an estimator; none if another record or model was linearised, or by other parameters.
    pub fn known<F, C, const D: usize, const M: usize>(
        &self,
        of: &Estimator<F, C, D, M>,
    ) -> Option<CachedLinearisation<D, M>>
    where
        F: Family<D> + 'static,
        C: Sensor<D, M> + 'static,
    {
        let kept: &Estimator<F, C, D, M> = self.0.downcast_ref()?;
        let (own, other) = (&kept.record, &of.record);
        let same = roles(&kept.free) == roles(&of.free)
            && kept.family == of.family
            && (&own.t, &own.linked, &own.film) == (&other.t, &other.linked, &other.film)
            && same_bits(&own.seen, &other.seen);
        if same { kept.known.clone() } else { None }
    }
}

/// Whether the same was seen. An unobserved value is NaN: only its bits are the same.
fn same_bits<const M: usize>(own: &[SVector<f64, M>], other: &[SVector<f64, M>]) -> bool {
    let mut same = own.len() == other.len();
    for i in 0..own.len().min(other.len()) {
        for m in 0..M {
            same &= own[i][m].to_bits() == other[i][m].to_bits();
        }
    }
    same
}

/// Which parameters are free.
fn roles(free: &[FreeParameter]) -> Vec<(Role, Option<usize>)> {
    free.iter().map(|free| (free.role, free.film)).collect()
}
