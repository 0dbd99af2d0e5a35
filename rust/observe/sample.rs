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

    /// Takes the samples that lie in the run's last step.
    pub fn take(&mut self, run: &dyn Steps<D>) {
        let end = run.t();
        if self.times.get(self.x.len()).is_none_or(|&t| t > end) {
            return;
        }
        while let Some(&t) = self.times.get(self.x.len()) {
            if t > end {
                break;
            }
            let x = if t == end { *run.x() } else { run.dense(t - run.from()) };
            self.x.push(x);
        }
    }
}
