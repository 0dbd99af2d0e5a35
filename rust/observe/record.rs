//! A whole run as a piecewise polynomial.

use crate::integrate::{Dense, Driver};
use crate::model::System;

/// The polynomials of all steps.
#[derive(Clone, Debug, Default)]
pub struct Record<const D: usize> {
    /// The times between steps, one more than there are steps.
    times: Vec<f64>,
    pieces: Vec<(f64, Dense<f64, D>)>,
}

impl<const D: usize> Record<D> {
    /// Begins at time `t`.
    pub fn new(t: f64) -> Self {
        Self { times: vec![t], pieces: Vec::new() }
    }

    /// Adds the driver's last step.
    pub fn push<M: System<f64, D>>(&mut self, driver: &Driver<'_, M, f64, D>) {
        let (size, dense) = driver.dense();
        if size != 0.0 {
            self.times.push(driver.t());
            self.pieces.push((size, dense));
        }
    }

    /// The first and the last time.
    pub fn span(&self) -> (f64, f64) {
        (self.times[0], self.times[self.times.len() - 1])
    }

    /// The state at time `t`; `None` outside the run.
    pub fn at(&self, t: f64) -> Option<[f64; D]> {
        let (first, last) = self.span();
        if !(first..=last).contains(&t) || self.pieces.is_empty() {
            return None;
        }
        let next = self.times.partition_point(|&time| time <= t).clamp(1, self.pieces.len());
        let (size, dense) = &self.pieces[next - 1];
        Some(dense.at(((t - self.times[next - 1]) / size).min(1.0)))
    }
}
