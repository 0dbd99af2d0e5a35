//! Forecasts: filter a window, then run free.

use nalgebra::SMatrix;

use super::sensor::{Moment, seen};
use super::{EstimateError, Estimator, FilmParameters, Options, Sensor, Unknowns};
use crate::analysis::CancelFlag;
use crate::analysis::batch::parallel::try_map;
use crate::integrate::cancel;
use crate::integrate::propagate;
use crate::model::{Family, System, sides_of};

/// The estimate from a window of frames alone.
#[derive(Clone, Copy, Debug)]
pub struct Filtered<const D: usize> {
    /// The state at the first frame.
    pub first: [f64; D],
    /// The state at the last frame, where a forecast starts.
    pub last: [f64; D],
    /// Its covariance.
    pub covariance: SMatrix<f64, D, D>,
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// The states that each window of frames `(first, last)` gives on its own, all parameters held.
    pub fn filter(
        &self,
        point: &Unknowns<D>,
        windows: &[(usize, usize)],
        options: &Options,
        stop: &CancelFlag,
    ) -> Result<Vec<Filtered<D>>, EstimateError> {
        try_map(windows.len(), &|i| {
            let (first, last) = windows[i];
            let part = Self {
                record: self.record.part(first, last),
                free: Vec::new(),
                family: self.family.clone(),
                sensor: self.sensor.clone(),
                known: None,
                ..*self
            };
            let start = Unknowns { states: point.states[first..=last].to_vec(), ..point.clone() };
            let solution = part.solve(start, options, stop)?;
            Ok(Filtered {
                first: solution.point.states[0],
                last: solution.point.states[last - first],
                covariance: solution.state_covariance[last - first],
            })
        })
    }

    /// Predicts the observations at increasing times after each start `(film, time, state)`, by the model alone.
    pub fn predict(
        &self,
        sets: &[FilmParameters],
        starts: &[(usize, f64, [f64; D])],
        times: &[Vec<f64>],
    ) -> Result<Vec<Vec<[f64; M]>>, EstimateError> {
        let systems: Vec<F::Built<f64>> =
            (0..).zip(sets).map(|(film, set)| self.family.build_for(film, &set.model)).collect();
        let tolerance = self.tolerance.filled::<D>(self.family.idle());
        try_map(starts.len().min(times.len()), &|i| {
            let ((film, t, x), times) = (starts[i], &times[i]);
            let (system, set) = (&systems[film], &sets[film]);
            let (mut t, mut x) = (t * set.pace(), x);
            let mut expected = Vec::with_capacity(times.len());
            for &next in times {
                cancel::look();
                let next = next * set.pace();
                x = propagate(system, t, next, x, &tolerance)
                    .map_err(|source| EstimateError::Integration { t, source })?;
                t = next;
                let rate = system.rates(t, &x, &sides_of(system, t, &x));
                let at = Moment { t, x: &x, rate: &rate, parameters: &set.model };
                expected.push(seen(&self.sensor, system, &set.camera, &at));
            }
            Ok(expected)
        })
    }
}
