//! The state at given times, read off the polynomials of the steps.

use crate::integrate::{Driver, Method, Tolerance};
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
    pub fn take<M, K>(&mut self, driver: &Driver<M, f64, D, Tolerance, K>)
    where
        M: System<f64, D>,
        K: Method<f64, D>,
    {
        let end = driver.t();
        if self.times.get(self.x.len()).is_none_or(|&t| t > end) {
            return;
        }
        while let Some(&t) = self.times.get(self.x.len()) {
            if t > end {
                break;
            }
            let x = if t == end { *driver.x() } else { driver.dense(t - driver.from()) };
            self.x.push(x);
        }
    }
}
