//! Log marginal likelihood (evidence) of a record, by Laplace's approximation.

use nalgebra::{DMatrix, SVector};

use super::{Estimator, Sensor};
use crate::model::Family;

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// The misfits' cost: the squares, in units of the noise, of what the frame before does not predict of them.
    pub(super) fn misfit_cost(&self, misfit: &[SVector<f64, M>]) -> f64 {
        let record = &self.record;
        if record.memory == [0.0; M] {
            let mut cost = -0.0;
            for i in 0..misfit.len() {
                cost += misfit[i].dot(&(record.information[i] * misfit[i]));
            }
            return cost;
        }
        let mut cost = 0.0;
        let mut before = ([false; M], SVector::<f64, M>::zeros());
        for (i, e) in misfit.iter().enumerate() {
            let root = super::bordered::root(&record.information[i]);
            let own = root * e;
            let mut there = [false; M];
            for m in 0..M {
                there[m] = root[(m, m)] != 0.0;
                if !there[m] {
                    continue;
                }
                let memory = record.remembered(i, m, before.0[m]);
                cost += (own[m] - memory * before.1[m]).powi(2) / (1.0 - memory * memory);
            }
            before = (there, own);
        }
        cost
    }

    /// Logarithm of the marginal likelihood, by Laplace's approximation around a minimum with this cost.
    ///
    /// The determinants are those of the states' part of the normal equations, and of what remains for the
    /// parameters.
    pub(super) fn evidence(&self, cost: f64, states: f64, schur: &DMatrix<f64>) -> f64 {
        let record = &self.record;
        let mut given = 0.0;
        let mut before = [false; M];
        for (i, information) in record.information.iter().enumerate() {
            let root = super::bordered::root(information);
            let mut there = [false; M];
            for m in (0..M).filter(|&m| root[(m, m)] != 0.0) {
                there[m] = true;
                given += 2.0 * root[(m, m)].ln();
                given -= (1.0 - record.remembered(i, m, before[m]).powi(2)).ln();
            }
            before = there;
        }
        for (precision, _) in self.precision().iter().zip(&record.linked).filter(|(_, linked)| **linked) {
            given += precision.iter().map(|q| q.ln()).sum::<f64>();
        }
        let priors = self.free.iter().filter(|free| free.sd.is_finite());
        given += priors.map(|free| -2.0 * free.sd.ln()).sum::<f64>();
        let parameters = match nalgebra::Cholesky::new(schur.clone()) {
            Some(lower) => 2.0 * lower.l().diagonal().iter().map(|v| v.ln()).sum::<f64>(),
            None => f64::INFINITY,
        };
        0.5 * (given - cost - states - parameters)
    }
}
