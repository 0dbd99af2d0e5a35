//! Cubic splines on evenly spaced knots.

use crate::scalar::{Cells, Real, Scalar};

/// A cubic spline whose coefficients are parameters. Its second derivative is continuous, but where it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spline {
    /// Which parameter is the first coefficient; the others follow.
    pub first: usize,
    pub count: usize,
    /// Its first knot, and the number of knots per unit.
    pub low: f64,
    pub per: f64,
    /// True if the curve is periodic. Otherwise it keeps its last value beyond its ends.
    pub periodic: bool,
}

impl Spline {
    /// From `low` to `high`, with these coefficients.
    pub fn new(first: usize, count: usize, (low, high): (f64, f64), periodic: bool) -> Self {
        let cells = if periodic { count } else { count - 3 };
        Self { first, count, low, per: cells as f64 / (high - low), periodic }
    }

    /// Its cells.
    fn knots(&self) -> Cells {
        Cells { coefficients: self.count, periodic: self.periodic }
    }

    /// The parameters that are its coefficients.
    pub fn parameters(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.count
    }

    /// Its value.
    #[inline(always)]
    pub fn of<S: Scalar>(self, x: S, coefficient: &dyn Fn(usize) -> S) -> S {
        let place = (x - S::constant(self.low)).scale(self.per);
        let coefficient = |i: usize| coefficient(self.first + i);
        let (floor, [p0, p1, p2, p3]) = if const { S::SYMBOLIC } {
            let (floor, powers) = place.real().piece(self.knots(), &|i| coefficient(i).real());
            (floor, powers.map(S::lift))
        } else {
            self.knots().piece(place.real(), &coefficient)
        };
        let s = place - S::lift(floor);
        p0 + s * (p1 + s * (p2 + s * p3))
    }
}
