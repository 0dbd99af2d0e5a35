//! What each frame brings that the frames before it did not foretell: white noise, if the model is right.

use nalgebra::{DMatrix, DVector};

use super::bordered::root;
use super::{EstimateError, Estimator, Sensor, Unknowns};
use crate::model::Family;

/// A filter foretells nothing before it has seen so many frames.
const SETTLED: usize = 12;

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// The innovations in units of their own standard deviations, frame by frame; NaN where nothing was seen or
    /// too little was known.
    ///
    /// A Kalman filter runs along the point's states, where everything is linear, with all parameters held. It
    /// estimates the states' deviations and the noise, which may remember itself; the noise is counted in
    /// units of its standard deviation. `vague` is what is known of a state where a run starts.
    pub fn innovations(&self, point: &Unknowns<D>, vague: &[f64; D]) -> Result<Vec<[f64; M]>, EstimateError> {
        let record = &self.record;
        let linear = Self { free: Vec::new(), known: None, ..self.clone() }.linearise(point)?;
        let precision = self.precision();
        let mut at = DVector::zeros(D + M);
        let mut spread = DMatrix::zeros(D + M, D + M);
        let mut known = 0;
        let mut before = [false; M];
        let mut found = vec![[f64::NAN; M]; record.t.len()];
        for (i, own) in found.iter_mut().enumerate() {
            let root = root(&record.information[i]);
            let there: Vec<usize> = (0..M).filter(|&m| root[(m, m)] != 0.0).collect();
            let mut ahead = DMatrix::zeros(D + M, D + M);
            for m in 0..M {
                ahead[(D + m, D + m)] = record.remembered(i, m, before[m]);
            }
            if i > 0 && record.linked[i - 1] {
                let link = &linear.flow[i - 1];
                ahead.view_mut((0, 0), (D, D)).copy_from(&link.a());
                at = &ahead * at;
                spread = &ahead * spread * ahead.transpose();
                for k in 0..D {
                    at[k] -= link.defect[k];
                    spread[(k, k)] += precision[i - 1][k].recip();
                }
            } else {
                at.fill(0.0);
                spread.fill(0.0);
                (0..D).for_each(|k| spread[(k, k)] = vague[k].powi(2));
                known = 0;
            }
            (D..D + M).for_each(|e| spread[(e, e)] += 1.0 - ahead[(e, e)].powi(2));
            before = std::array::from_fn(|m| there.contains(&m));
            if there.is_empty() {
                continue;
            }

            // What is seen of state and noise: h x + root^-1 e.
            let rows = there.len();
            let within = DMatrix::from_fn(rows, rows, |r, c| root[(there[r], there[c])]);
            let noise = within.try_inverse().expect("the diagonal of a triangle has no zero");
            let sight = &linear.sights[i];
            let mut seen = DMatrix::zeros(rows, D + M);
            for r in 0..rows {
                (0..D).for_each(|k| seen[(r, k)] = sight.h[(there[r], k)]);
                (0..rows).for_each(|c| seen[(r, D + there[c])] = noise[(r, c)]);
            }
            let rest = DVector::from_fn(rows, |r, _| sight.misfit[there[r]]) - &seen * &at;
            let across = &seen * &spread;
            let expected = &across * seen.transpose();
            if known >= SETTLED {
                for (r, &m) in there.iter().enumerate() {
                    own[m] = rest[r] / expected[(r, r)].sqrt();
                }
            }
            let inverse = expected.cholesky().ok_or(EstimateError::Singular { t: record.t[i] })?;
            at += across.tr_mul(&inverse.solve(&rest));
            spread -= across.tr_mul(&inverse.solve(&across));
            spread = (&spread + spread.transpose()) / 2.0;
            known += 1;
        }
        Ok(found)
    }
}
