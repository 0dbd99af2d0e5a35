//! The cells between the knots of a cubic spline.

use super::{Mask, Real, Scalar};

/// Cells of unit length, from zero on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Cells {
    /// How many coefficients the spline has.
    pub coefficients: usize,
    /// True if the last cell is followed by the first. Otherwise the spline keeps its last value beyond its ends.
    pub periodic: bool,
}

/// The polynomial of a spline on a cell: where the cell begins, and the coefficients of the powers of the distance from
/// there.
pub type SplinePiece<S> = (<S as Scalar>::Real, [S; 4]);

impl Cells {
    /// How many cells there are.
    pub fn count(self) -> usize {
        if self.periodic { self.coefficients } else { self.coefficients - 3 }
    }

    /// The spline's polynomial at each lane's place.
    ///
    /// Only the four coefficients that count are asked for. Places over several cells, or across the end of the last one,
    /// have no polynomial.
    // One function for each kind of number, whatever asks for it.
    #[inline(never)]
    pub fn piece<S: Scalar>(self, place: S::Real, coefficient: &dyn Fn(usize) -> S) -> SplinePiece<S> {
        let (cells, zero) = (self.count(), S::Real::zero());
        let end = S::Real::constant(cells as f64);
        let (below, above) = (place.less(zero), end.less(place));
        let inside = if self.periodic {
            place
        } else {
            S::Real::select(below, zero, S::Real::select(above, end, place))
        };
        let floor = inside.each(f64::floor);
        if !floor.is_single() {
            return (floor, [S::constant(f64::NAN); 4]);
        }
        // The last point belongs to the last cell. NaN has no cell and stays NaN.
        let floor = if self.periodic { floor } else { floor.min(S::Real::constant((cells - 1) as f64)) };
        let cell_of = |lane: usize| match self.periodic {
            true => floor.lane(lane).rem_euclid(cells as f64) as usize % cells,
            false => (floor.lane(lane) as usize).min(cells - 1),
        };
        let of = |cell: usize, k: usize| {
            let i = cell + k;
            coefficient(if i < self.coefficients { i } else { i - self.coefficients })
        };
        let mut c = [S::zero(); 4];
        if const { S::Real::LANES == 1 } {
            let cell = cell_of(0);
            for (k, own) in c.iter_mut().enumerate() {
                *own = of(cell, k);
            }
        } else {
            for cell in 0..cells {
                let here = <S::Mask as Mask>::from_lanes(|lane| cell_of(lane) == cell);
                if here.any() {
                    for (k, own) in c.iter_mut().enumerate() {
                        *own = S::select(here, of(cell, k), *own);
                    }
                }
            }
        }
        let sixth = 1.0 / 6.0;
        let first = (c[0] + c[1].scale(4.0) + c[2]).scale(sixth);
        let mut powers = [
            first,
            (c[2] - c[0]).scale(0.5),
            (c[0] - c[1].scale(2.0) + c[2]).scale(0.5),
            (c[3] - c[0] + (c[1] - c[2]).scale(3.0)).scale(sixth),
        ];
        if !self.periodic {
            let outside = below.or(above);
            let last = (c[1] + c[2].scale(4.0) + c[3]).scale(sixth);
            powers[0] = S::select(above, last, first);
            for power in &mut powers[1..] {
                *power = S::select(outside, S::zero(), *power);
            }
        }
        (floor, powers)
    }
}
