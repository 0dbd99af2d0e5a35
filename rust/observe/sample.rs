//! The state at given times, read off the polynomials of the steps.

use crate::integrate::Driver;
use crate::model::System;

/// Samples at increasing times.
#[derive(Clone, Debug)]
pub struct Samples<'a, const D: usize> {
    times: &'a [f64],
    /// The states so far, one per time.
    pub x: Vec<[f64; D]>,
}

impl<'a, const D: usize> Samples<'a, D> {
    /// Starts at `x`, the state at the first of the times.
    pub fn new(times: &'a [f64], x: [f64; D]) -> Self {
        let mut states = Vec::with_capacity(times.len());
        if !times.is_empty() {
            states.push(x);
        }
        Self { times, x: states }
    }

    /// Takes the samples that lie in the driver's last step.
    pub fn take<M: System<f64, D>>(&mut self, driver: &Driver<'_, M, f64, D>) {
        let end = driver.t();
        if self.times.get(self.x.len()).is_none_or(|&t| t > end) {
            return;
        }
        let (size, dense) = driver.dense();
        while let Some(&t) = self.times.get(self.x.len()) {
            if t > end {
                break;
            }
            let x = if t == end { *driver.x() } else { dense.at((t - driver.from()) / size) };
            self.x.push(x);
        }
    }
}
