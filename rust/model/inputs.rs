//! Measured inputs of a law (exogenous signals): functions of time that no state moves.

use std::sync::Arc;

use crate::scalar::{Mask, Real, Scalar};

/// The coefficients of a piece's polynomial.
pub const COEFFICIENTS: usize = 4;

/// An input between two samples: `u = c0 + c1 s + c2 s^2 + c3 s^3` with `s` the time since its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece<S> {
    pub origin: S,
    pub coefficients: [f64; COEFFICIENTS],
}

impl<S: Scalar> Piece<S> {
    /// The input's value.
    #[inline]
    pub fn at(&self, t: S) -> S {
        let since = t - self.origin;
        let [first, rest @ ..] = self.coefficients;
        let slope = rest.iter().rev().fold(S::zero(), |sum, &c| sum * since + S::constant(c));
        S::constant(first) + slope * since
    }
}

/// One input's samples, each with the polynomial that holds from it on to the next. Before the first it has the first
/// one's value, after the last one that of the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    t: Vec<f64>,
    pieces: Vec<[f64; COEFFICIENTS]>,
    last: f64,
    /// The parameter by which the law feels it later, if there is one.
    delay: Option<usize>,
}

impl Signal {
    /// From the samples' times, which increase, and the pieces between them.
    ///
    /// # Panics
    /// Where there is not one piece fewer than there are times.
    pub fn new(t: Vec<f64>, pieces: Vec<[f64; COEFFICIENTS]>, last: f64, delay: Option<usize>) -> Self {
        assert_eq!(t.len(), pieces.len() + 1, "a piece between each two samples");
        Self { t, pieces, last, delay }
    }

    fn piece(&self, number: usize) -> (f64, [f64; COEFFICIENTS]) {
        match number {
            0 => (self.t[0], [self.pieces[0][0], 0.0, 0.0, 0.0]),
            n if n <= self.pieces.len() => (self.t[n - 1], self.pieces[n - 1]),
            n => (self.t[n - 1], [self.last, 0.0, 0.0, 0.0]),
        }
    }

    /// Returns true if it jumps at a sample.
    fn jumps(&self) -> bool {
        self.pieces.iter().any(|piece| piece[1..] == [0.0; 3])
    }
}

/// The times at which any input of a record goes over to its next piece.
#[derive(Debug, PartialEq)]
struct Timeline {
    knots: Vec<f64>,
    /// Each input's piece in every interval between knots, in the one before the first and in that after the last:
    /// all of the first interval, then those of the second.
    pieces: Vec<u32>,
}

impl Timeline {
    fn new(signals: &[Signal], delay: &dyn Fn(&Signal) -> f64) -> Self {
        let late = |signal: &Signal, t: f64| t + delay(signal);
        let mut knots: Vec<f64> =
            signals.iter().flat_map(|signal| signal.t.iter().map(|&t| late(signal, t))).collect();
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        let mut next = vec![0_u32; signals.len()];
        let mut pieces = next.clone();
        for &knot in &knots {
            for (next, signal) in next.iter_mut().zip(signals) {
                while signal.t.get(*next as usize).is_some_and(|&t| late(signal, t) <= knot) {
                    *next += 1;
                }
            }
            pieces.extend(&next);
        }
        Self { knots, pieces }
    }

    /// The interval that holds this time and is, counted from the one before the first knot, odd or even. At a knot,
    /// to rounding, both of its neighbours hold it: so the parity tells the time before it from the time after.
    fn interval(&self, t: f64, odd: bool) -> usize {
        let held = self.knots.partition_point(|&knot| knot <= t);
        if (held % 2 == 1) == odd {
            return held;
        }
        let before = held.checked_sub(1).map_or(f64::INFINITY, |knot| t - self.knots[knot]);
        let after = self.knots.get(held).map_or(f64::INFINITY, |knot| knot - t);
        if before <= after { held - 1 } else { held + 1 }
    }
}

/// A record's inputs, ready to be asked. One of them may be felt later by a parameter of the model, its delay.
#[derive(Clone, Debug)]
pub struct Inputs<S> {
    signals: Arc<[Signal]>,
    timeline: Arc<Timeline>,
    delays: Vec<S>,
    jumps: bool,
}

/// A record's inputs before the model's parameters are known.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    signals: Arc<[Signal]>,
    /// The timeline if no input is delayed.
    timeline: Option<Arc<Timeline>>,
    /// True if a delayed input jumps.
    jumps: bool,
}

impl Signals {
    pub fn new(signals: Vec<Signal>) -> Self {
        let free = signals.iter().any(|signal| signal.delay.is_some());
        let timeline = (!free).then(|| Arc::new(Timeline::new(&signals, &|_| 0.0)));
        let jumps = signals.iter().any(|signal| signal.delay.is_some() && signal.jumps());
        Self { signals: signals.into(), timeline, jumps }
    }

    /// How many inputs there are.
    pub fn len(&self) -> usize {
        self.signals.len()
    }

    /// Returns true if it is empty.
    pub fn is_empty(&self) -> bool {
        self.signals.is_empty()
    }

    /// With the delays that are among these values.
    pub fn with<S: Scalar>(&self, values: &[S]) -> Inputs<S> {
        let delay = |signal: &Signal| signal.delay.map_or(S::zero(), |i| values[i]);
        let delays: Vec<S> = self.signals.iter().map(delay).collect();
        let timeline = self.timeline.clone().unwrap_or_else(|| {
            Arc::new(Timeline::new(&self.signals, &|signal| delay(signal).real().lane(0)))
        });
        Inputs { signals: self.signals.clone(), timeline, delays, jumps: self.jumps }
    }
}

impl<S: Scalar> Inputs<S> {
    /// The same with other numbers for the delays.
    pub fn map<T: Scalar>(&self, number: impl Fn(&S) -> T) -> Inputs<T> {
        Inputs {
            signals: self.signals.clone(),
            timeline: self.timeline.clone(),
            delays: self.delays.iter().map(number).collect(),
            jumps: self.jumps,
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.signals.len()
    }

    /// Returns true if it is empty.
    pub fn is_empty(&self) -> bool {
        self.signals.is_empty()
    }

    /// Input `k` at this time, on this [side](Inputs::side) of the nearest knot.
    pub fn piece(&self, k: usize, t: S::Real, side: S::Mask) -> Piece<S> {
        let interval = self.timeline.interval(t.lane(0), side.lane(0));
        let number = self.timeline.pieces[interval * self.signals.len() + k] as usize;
        let (origin, coefficients) = self.signals[k].piece(number);
        Piece { origin: S::constant(origin) + self.delays[k], coefficients }
    }

    /// Returns true if the interval after this time, or before it, is an odd one.
    pub fn side(&self, t: f64, after: bool) -> bool {
        let knots = &self.timeline.knots;
        let interval =
            if after { knots.partition_point(|&k| k <= t) } else { knots.partition_point(|&k| k < t) };
        interval % 2 == 1
    }

    /// The end of the interval in the direction of `end`, where it comes before that or just there.
    pub fn next_knot(&self, t: f64, odd: bool, end: f64) -> Option<f64> {
        let (knots, interval) = (&self.timeline.knots, self.timeline.interval(t, odd));
        if end >= t {
            knots.get(interval).copied().filter(|&knot| knot <= end)
        } else {
            interval.checked_sub(1).map(|before| knots[before]).filter(|&knot| knot >= end)
        }
    }

    /// A function that is zero at the knot next to this time, positive in odd intervals.
    pub fn surface(&self, t: S, side: S::Mask) -> S {
        let (time, odd) = (t.real().lane(0), side.lane(0));
        let (knots, interval) = (&self.timeline.knots, self.timeline.interval(time, odd));
        let before = interval.checked_sub(1).map_or(f64::INFINITY, |knot| (time - knots[knot]).abs());
        let after = knots.get(interval).map_or(f64::INFINITY, |knot| (knot - time).abs());
        let knot = if before <= after { interval - 1 } else { interval };
        // All inputs that jump at this knot are thought of as late by the same delay.
        let moved = (0..self.signals.len()).find(|&k| {
            let n = self.signals.len();
            self.timeline.pieces[knot * n + k] != self.timeline.pieces[(knot + 1) * n + k]
        });
        let late = moved.map_or(S::zero(), |k| self.delays[k]);
        let late = late - S::lift(late.real());
        let since = t - S::constant(knots[knot]) - late;
        // The interval after knot number `knot` is number `knot + 1`.
        if knot % 2 == 0 { since } else { -since }
    }

    /// Returns true if an input jumps whose delay may be differentiated by: a neighbour then meets the jump at another time.
    pub fn jumps(&self) -> bool {
        self.jumps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(delay: Option<usize>) -> Signals {
        let pieces = vec![[1.0, 1.0, 0.0, 0.0], [2.0, -2.0, 0.0, 0.0]];
        Signals::new(vec![Signal::new(vec![0.0, 1.0, 2.0], pieces, 0.0, delay)])
    }

    #[test]
    fn an_input_is_its_pieces_and_its_ends_beyond() {
        let inputs = ramp(None).with::<f64>(&[]);
        let value = |t: f64| inputs.piece(0, t, inputs.side(t, true)).at(t);
        assert_eq!([-3.0, 0.0, 0.5, 1.0, 1.5, 2.0, 9.0].map(value), [1.0, 1.0, 1.5, 2.0, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn a_knot_belongs_to_both_of_its_neighbours() {
        let inputs = ramp(None).with::<f64>(&[]);
        let slope = |after: bool| inputs.piece(0, 1.0, inputs.side(1.0, after)).coefficients[1];
        assert_eq!([slope(false), slope(true)], [1.0, -2.0]);
    }

    #[test]
    fn knots_follow_each_other_in_both_directions_and_come_late_by_the_delay() {
        let inputs = ramp(Some(0)).with::<f64>(&[0.25]);
        assert_eq!(inputs.next_knot(0.3, inputs.side(0.3, true), 5.0), Some(1.25));
        assert_eq!(inputs.next_knot(1.25, inputs.side(1.25, true), 5.0), Some(2.25));
        assert_eq!(inputs.next_knot(1.25, inputs.side(1.25, false), -5.0), Some(0.25));
        assert_eq!(inputs.next_knot(0.3, inputs.side(0.3, true), 1.0), None);
        assert_eq!(inputs.piece(0, 0.75, inputs.side(0.75, true)).at(0.75), 1.5);
    }
}
