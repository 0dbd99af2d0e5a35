//! Cubic splines on evenly spaced knots.

use crate::scalar::{Mask, Real, Scalar};

/// A cubic spline whose coefficients are parameters. Its second derivative is continuous, but where it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spline {
    /// Which parameter is the first coefficient; the others follow.
    pub first: usize,
    pub count: usize,
    /// Where its knots begin and how many there are per unit.
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

    /// How many stretches there are between knots.
    pub fn cells(&self) -> usize {
        if self.periodic { self.count } else { self.count - 3 }
    }

    /// The parameters that are its coefficients.
    pub fn parameters(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.count
    }

    /// Its value. Only the four coefficients that count are asked for, of each lane's cell.
    // One function for each kind of number, whatever asks for it.
    #[inline(never)]
    pub fn of<S: Scalar>(self, x: S, coefficient: &dyn Fn(usize) -> S) -> S {
        let cells = self.cells();
        let mut u = (x - S::constant(self.low)).scale(self.per);
        if !self.periodic {
            let end = S::constant(cells as f64);
            u = S::select(u.less(S::zero()), S::zero(), u);
            u = S::select(end.less(u), end, u);
        }
        let floor = u.real().each(f64::floor);
        // Over several cells, or across the end of the last one.
        if !floor.is_single() {
            return S::constant(f64::NAN);
        }
        // The last point belongs to the last cell. NaN has no cell and stays NaN.
        let floor = if self.periodic { floor } else { floor.min(S::Real::constant((cells - 1) as f64)) };
        let place = |lane: usize| match self.periodic {
            true => floor.lane(lane).rem_euclid(cells as f64) as usize % cells,
            false => (floor.lane(lane) as usize).min(cells - 1),
        };
        let of = |cell: usize, k: usize| {
            let i = cell + k;
            coefficient(self.first + if i < self.count { i } else { i - self.count })
        };
        let mut c = [S::zero(); 4];
        if const { S::Real::LANES == 1 } {
            let cell = place(0);
            for (k, own) in c.iter_mut().enumerate() {
                *own = of(cell, k);
            }
        } else {
            for cell in 0..cells {
                let here = <S::Mask as Mask>::from_lanes(|lane| place(lane) == cell);
                if here.any() {
                    for (k, own) in c.iter_mut().enumerate() {
                        *own = S::select(here, of(cell, k), *own);
                    }
                }
            }
        }
        let s = u - S::lift(floor);
        let left = S::one() - s;
        let (s2, left2) = (s.square(), left.square());
        // The four pieces of the cardinal spline, times 6.
        let sum = c[0] * (left2 * left)
            + c[1] * (S::constant(4.0) + s2 * (s.scale(3.0) - S::constant(6.0)))
            + c[2] * (S::constant(4.0) + left2 * (left.scale(3.0) - S::constant(6.0)))
            + c[3] * (s2 * s);
        sum.scale(1.0 / 6.0)
    }
}
