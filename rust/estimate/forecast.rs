//! Forecasts: filter a window, then run free.

use nalgebra::SMatrix;
use rayon::prelude::*;

use super::{EstimateError, Estimator, Options, Point, Record, Sensor};
use crate::integrate::propagate;
use crate::model::{Family, System, sides_of};
use crate::run::Stop;

/// What a window of frames says on its own.
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
        point: &Point<D>,
        windows: &[(usize, usize)],
        options: &Options,
        stop: &Stop,
    ) -> Result<Vec<Filtered<D>>, EstimateError> {
        let one = |&(first, last): &(usize, usize)| {
            let part = Self {
                record: self.record.part(first, last),
                free: Vec::new(),
                family: self.family.clone(),
                sensor: self.sensor.clone(),
                ..*self
            };
            let start = Point { states: point.states[first..=last].to_vec(), ..point.clone() };
            let solution = part.solve(start, options, stop)?;
            Ok(Filtered {
                first: solution.point.states[0],
                last: solution.point.states[last - first],
                covariance: solution.state_covariance[last - first],
            })
        };
        windows.par_iter().map(one).collect()
    }

    /// What would be seen at increasing times after each start `(time, state)`, by the model alone.
    pub fn predict(
        &self,
        point: &Point<D>,
        starts: &[(f64, [f64; D])],
        times: &[Vec<f64>],
    ) -> Result<Vec<Vec<[f64; M]>>, EstimateError> {
        let system = self.family.build(&point.model);
        let pace = 1.0 + point.clock;
        let one = |(&(t, x), times): (&(f64, [f64; D]), &Vec<f64>)| {
            let (mut t, mut x) = (t * pace, x);
            let mut seen = Vec::with_capacity(times.len());
            for &next in times {
                x = propagate(&system, t, next * pace, x, &self.tolerance)
                    .map_err(|source| EstimateError::Integration { t, source })?;
                t = next * pace;
                let rate = system.rates(t, &x, &sides_of(&system, t, &x));
                seen.push(self.sensor.observe(&point.camera, &x, &rate));
            }
            Ok(seen)
        };
        starts.par_iter().zip(times).map(one).collect()
    }
}

impl<const M: usize> Record<M> {
    /// The frames from `first` to `last`, both included.
    fn part(&self, first: usize, last: usize) -> Self {
        Self {
            t: self.t[first..=last].to_vec(),
            seen: self.seen[first..=last].to_vec(),
            information: self.information[first..=last].to_vec(),
            linked: self.linked[first..last].to_vec(),
        }
    }
}
