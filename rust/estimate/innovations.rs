//! Innovations: the part of each frame that the frames before do not predict; white noise if the model is right.

use nalgebra::{DMatrix, DVector};

use super::bordered::root;
use super::{EstimateError, Estimator, Sensor, Unknowns};
use crate::integrate::cancel;
use crate::inverse::invert;
use crate::model::Family;

/// A filter predicts nothing before so many frames.
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
        let mut filter =
            Filter { states: D, at: DVector::zeros(D + M), spread: DMatrix::zeros(D + M, D + M), known: 0 };
        let mut before = [false; M];
        let mut found = vec![[f64::NAN; M]; record.t.len()];
        for (i, own) in found.iter_mut().enumerate() {
            cancel::look();
            let root = root(&record.information[i]);
            let mut ahead = DMatrix::zeros(D + M, D + M);
            for m in 0..M {
                ahead[(D + m, D + m)] = record.remembered(i, m, before[m]);
                before[m] = root[(m, m)] != 0.0;
            }
            if i > 0 && record.linked[i - 1] {
                let link = &linear.flow[i - 1];
                for m in 0..D {
                    for k in 0..D {
                        ahead[(m, k)] = link.slope(m, k);
                    }
                }
                filter.go_on(&ahead, link.defect.as_slice(), precision[i - 1].as_slice());
            } else {
                filter.begin(vague);
            }
            filter.renew_noise(&ahead);
            let sight = &linear.sights[i];
            filter
                .see(root.as_slice(), sight.h.as_slice(), sight.misfit.as_slice(), own)
                .ok_or(EstimateError::Singular { t: record.t[i] })?;
        }
        Ok(found)
    }
}

/// The filter, for any numbers of states and channels.
struct Filter {
    states: usize,
    /// The states' deviations, then the noise, and their covariance.
    at: DVector<f64>,
    spread: DMatrix<f64>,
    /// How many frames it has seen.
    known: usize,
}

impl Filter {
    /// Starts anew.
    fn begin(&mut self, vague: &[f64]) {
        self.at.fill(0.0);
        self.spread.fill(0.0);
        for (k, vague) in vague.iter().enumerate() {
            self.spread[(k, k)] = vague.powi(2);
        }
        self.known = 0;
    }

    /// Goes on to the next frame.
    fn go_on(&mut self, ahead: &DMatrix<f64>, defect: &[f64], precision: &[f64]) {
        self.at = ahead * &self.at;
        self.spread = ahead * &self.spread * ahead.transpose();
        for k in 0..self.states {
            self.at[k] -= defect[k];
            self.spread[(k, k)] += precision[k].recip();
        }
    }

    /// The part of the noise that is new has the rest of its variance.
    fn renew_noise(&mut self, ahead: &DMatrix<f64>) {
        for e in self.states..self.at.len() {
            self.spread[(e, e)] += 1.0 - ahead[(e, e)].powi(2);
        }
    }

    /// Filters a frame and returns its innovation; none if the frames before do not determine it.
    /// Matrices are given by their columns.
    fn see(&mut self, root: &[f64], h: &[f64], misfit: &[f64], brought: &mut [f64]) -> Option<()> {
        let (states, channels) = (self.states, misfit.len());
        let root = |r: usize, c: usize| root[c * channels + r];
        let there: Vec<usize> = (0..channels).filter(|&m| root(m, m) != 0.0).collect();
        if there.is_empty() {
            return Some(());
        }
        // The observation of state and noise: h x + root^-1 e.
        let rows = there.len();
        let mut noise = DMatrix::from_fn(rows, rows, |r, c| root(there[r], there[c]));
        assert!(invert(noise.as_mut_slice(), rows), "the diagonal of a triangle has no zero");
        let mut seen = DMatrix::zeros(rows, states + channels);
        for r in 0..rows {
            (0..states).for_each(|k| seen[(r, k)] = h[k * channels + there[r]]);
            (0..rows).for_each(|c| seen[(r, states + there[c])] = noise[(r, c)]);
        }
        let rest = DVector::from_fn(rows, |r, _| misfit[there[r]]) - &seen * &self.at;
        let across = &seen * &self.spread;
        let expected = &across * seen.transpose();
        if self.known >= SETTLED {
            for (r, &m) in there.iter().enumerate() {
                brought[m] = rest[r] / expected[(r, r)].sqrt();
            }
        }
        let inverse = expected.cholesky()?;
        self.at += across.tr_mul(&inverse.solve(&rest));
        self.spread -= across.tr_mul(&inverse.solve(&across));
        self.spread = (&self.spread + self.spread.transpose()) / 2.0;
        self.known += 1;
        Some(())
    }
}
