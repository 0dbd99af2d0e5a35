//! Whether a run's steps have become so short that it would hardly end.

/// The usual step is the mean of so many at the start.
const FIRST: u64 = 1024;
/// Steps are averaged over so many: what is short lasts for less.
const WINDOW: u64 = 1 << 19;
/// Steps this much shorter than the usual one are short.
const SHORTER: f64 = 100.0;
/// A run that needs so many more steps, all of them short, takes a quarter of an hour at least.
const MOST: f64 = 1e9;

/// The length of a run's steps, at the start and lately.
///
/// A solution that turns or grows ever faster never reaches a pole, where a step would fail: its steps only get shorter.
#[derive(Clone, Copy, Debug)]
pub struct StepBudget {
    end: f64,
    /// The usual step; not a number as long as there were too few.
    usual: f64,
    /// The number of steps and the time at which the average began.
    from: (u64, f64),
}

impl StepBudget {
    /// For a run from time `t`, after so many steps, to `end`.
    pub fn new(steps: u64, t: f64, end: f64) -> Self {
        Self { end, usual: f64::NAN, from: (steps, t) }
    }

    /// Whether the run is to end at time `t`, after so many steps. To be asked now and then.
    pub fn exceeded(&mut self, steps: u64, t: f64) -> bool {
        let (begun, from) = self.from;
        let taken = steps - begun;
        if taken < if self.usual.is_nan() { FIRST } else { WINDOW } {
            return false;
        }
        let mean = (t - from) / taken as f64;
        self.from = (steps, t);
        if self.usual.is_nan() {
            self.usual = mean;
            return false;
        }
        mean * SHORTER <= self.usual && mean * MOST < self.end - t
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a run whose steps have these lengths ends early.
    fn ends(end: f64, step: impl Fn(f64) -> f64) -> bool {
        let (mut t, mut steps) = (0.0, 0);
        let mut budget = StepBudget::new(0, t, end);
        while t < end && steps < 20 * WINDOW {
            (t, steps) = (t + step(t), steps + 1);
            if steps % 1024 == 0 && budget.exceeded(steps, t) {
                return true;
            }
        }
        false
    }

    #[test]
    fn only_runs_that_would_hardly_end_are_ended() {
        // Ever faster, and a time that stands still.
        assert!(ends(1e5, |t| 0.1 * (-0.1 * t).exp()));
        assert!(ends(1e5, |t| if t < 200.0 { 0.1 } else { 0.0 }));
        assert!(ends(1.0, |_| 0.0));
        // Long, short from the start, faster with the square of time, and a burst.
        assert!(!ends(1e12, |_| 0.1));
        assert!(!ends(1e5, |_| 1e-9));
        assert!(!ends(1e4, |t| 1.0 / (1.0 + t)));
        assert!(!ends(1e5, |t| if (500.0..510.0).contains(&t) { 1e-4 } else { 0.1 }));
    }
}
