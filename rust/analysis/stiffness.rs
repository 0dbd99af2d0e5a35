//! Whether stability limits a run's steps.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::integrate::{Failure, Steps};
use crate::scalar::vector;

/// The run is looked at when it has taken so many more steps.
const EVERY: u64 = 1000;
/// It is stiff where it was found held down so many times in a row.
const HELD: u32 = 15;
/// From this part of its method's stability limit on, stability limits a step: accuracy alone keeps it well below,
/// except with tolerances beyond 1e-3.
const PART: f64 = 0.5;
/// So many multiplications by the law's derivative show its largest eigenvalue.
const POWERS: usize = 10;

/// Watches over a run, and tells another thread.
#[derive(Debug)]
pub struct Stiffness {
    /// The bits of the time at which it was recognised; not a number as long as it was not.
    at: AtomicU64,
    /// Whether the run shall then end.
    ends: bool,
}

impl Stiffness {
    /// Nothing was recognised yet; whether the run shall [end](Failure::Stiff) where it is.
    pub fn new(ends: bool) -> Self {
        Self { at: AtomicU64::new(f64::NAN.to_bits()), ends }
    }

    /// The time at which it was recognised.
    pub fn recognised(&self) -> Option<f64> {
        let at = f64::from_bits(self.at.load(Ordering::Relaxed));
        at.is_finite().then_some(at)
    }
}

/// The state of the test during the run.
pub struct Look<const D: usize> {
    /// The number of steps after which the run is looked at.
    next: u64,
    held: u32,
    /// About the direction in which states that differ come together fastest.
    direction: [f64; D],
}

impl<const D: usize> Look<D> {
    pub fn new() -> Self {
        // Any direction that no symmetry singles out.
        Self { next: EVERY, held: 0, direction: vector!(f64, D; n => 1.0 + 0.618 * n as f64) }
    }

    /// Looks at the last step of a run; most steps are not worth it.
    ///
    /// The test is that of E. Hairer and G. Wanner, Solving ODEs II, section IV.2, with a product of the law's own
    /// derivatives in place of a quotient of two stages, so that it serves every method.
    #[inline]
    pub fn at(&mut self, run: &dyn Steps<D>, found: &Stiffness) -> Result<(), Failure> {
        let steps = run.counts().accepted;
        if steps < self.next || found.recognised().is_some() {
            return Ok(());
        }
        self.next = steps + EVERY;
        let held = run.size().abs() * self.decay(run) > PART * run.stable();
        self.held = if held { self.held + 1 } else { 0 };
        if self.held == HELD {
            found.at.store(run.t().to_bits(), Ordering::Relaxed);
            if found.ends {
                return Err(Failure::Stiff { t: run.t() });
            }
        }
        Ok(())
    }

    /// The largest eigenvalue of the law's derivative by size, by the power method on differences, where it makes
    /// states come together; else 0.
    fn decay(&mut self, run: &dyn Steps<D>) -> f64 {
        let (t, x) = (run.t(), run.x());
        let length = |v: &[f64; D]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let rate = run.rates(t, x);
        let apart = 1e-7 * (length(x) + 1e-3);
        let (mut growth, mut along) = (0.0, 0.0);
        for _ in 0..POWERS {
            let unit = 1.0 / length(&self.direction);
            let v = self.direction.map(|v| v * unit);
            let near = run.rates(t, &vector!(f64, D; n => x[n] + apart * v[n]));
            let changed = vector!(f64, D; n => (near[n] - rate[n]) / apart);
            let grown = length(&changed);
            if !(grown.is_finite() && grown > 0.0) {
                self.direction = v;
                return 0.0;
            }
            growth += grown.ln();
            along += (0..D).map(|n| v[n] * changed[n]).sum::<f64>() / grown;
            self.direction = changed;
        }
        // Oscillations are followed, not waited for: a third of the way towards each other at least.
        let share = along / POWERS as f64;
        if share < -0.3 { (growth / POWERS as f64).exp() } else { 0.0 }
    }
}
