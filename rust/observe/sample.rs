//! The state at given times, read off the polynomials of the steps.

use crate::integrate::Steps;

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

    /// The time of the next sample.
    pub fn wanted(&self) -> f64 {
        self.times.get(self.x.len()).copied().unwrap_or(f64::INFINITY)
    }

    /// Takes the samples that lie in the run's last step; returns the time of the next one.
    pub fn take(&mut self, run: &dyn Steps<D>) -> f64 {
        let end = run.t();
        let mut wanted = self.wanted();
        while wanted <= end {
            let x = if wanted == end { *run.x() } else { run.dense(wanted - run.from()) };
            self.x.push(x);
            wanted = self.wanted();
        }
        wanted
    }
}
