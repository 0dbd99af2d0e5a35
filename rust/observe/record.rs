//! A whole run as a piecewise polynomial.

use crate::integrate::Steps;
use crate::memory;

/// More than the polynomial of any method's step.
const MOST_COEFFICIENTS: usize = 32;

/// The polynomials of all steps.
#[derive(Clone, Debug)]
pub struct Record<const D: usize> {
    /// The times between steps, one more than there are steps.
    times: Vec<f64>,
    /// Each piece's unit of time and where its coefficients end.
    pieces: Vec<(f64, usize)>,
    coefficients: Vec<[f64; D]>,
    /// The state where there is no step.
    start: [f64; D],
}

impl<const D: usize> Record<D> {
    /// Begins at time `t` and state `x`.
    pub fn new(t: f64, x: [f64; D]) -> Self {
        Self { times: vec![t], pieces: Vec::new(), coefficients: Vec::new(), start: x }
    }

    /// Adds the run's last step.
    pub fn push(&mut self, run: &dyn Steps<D>) {
        if run.size() != 0.0 {
            self.times.push(run.t());
            let unit = run.polynomial(&mut self.coefficients);
            self.pieces.push((unit, self.coefficients.len()));
        }
    }

    /// Makes room for another step; false where there is none.
    pub fn grow(&mut self) -> bool {
        memory::grow(&mut self.times, 1)
            && memory::grow(&mut self.pieces, 1)
            && memory::grow(&mut self.coefficients, MOST_COEFFICIENTS)
    }

    /// What it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.times) + size_of_val(&*self.pieces) + size_of_val(&*self.coefficients)
    }

    /// The first and the last time.
    pub fn span(&self) -> (f64, f64) {
        (self.times[0], self.times[self.times.len() - 1])
    }

    /// The state at time `t`; `None` outside the run.
    pub fn at(&self, t: f64) -> Option<[f64; D]> {
        let (first, last) = self.span();
        if !(first..=last).contains(&t) {
            return None;
        }
        let Some(newest) = self.pieces.len().checked_sub(1) else { return Some(self.start) };
        let piece = self.times.partition_point(|&time| time <= t).saturating_sub(1).min(newest);
        let begin = if piece == 0 { 0 } else { self.pieces[piece - 1].1 };
        let (unit, end) = self.pieces[piece];
        let theta = (t - self.times[piece]) / unit;
        let own = &self.coefficients[begin..end];
        let mut x = [0.0; D];
        for c in own.iter().rev() {
            for n in 0..D {
                x[n] = x[n] * theta + c[n];
            }
        }
        Some(x)
    }
}
