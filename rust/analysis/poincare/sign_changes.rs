//! On which side of a surface lanes are, and where they change it.

use crate::integrate::MOST_PROBES;
use crate::scalar::{Mask, Real};

/// Nothing is hidden between two places if the bend of the values, times this, is less than the sum of the two sizes.
pub const CLEAR: f64 = 4.0;

/// On which side of a surface the lanes are, in which direction crossing it counts, and in which lanes.
#[derive(Clone, Copy, Debug)]
pub struct Side<R: Real> {
    /// Lanes that are known to be below, and above; neither while on it.
    pub below: R::Mask,
    pub above: R::Mask,
    pub rising: bool,
    pub falling: bool,
    pub moved: R::Mask,
}

/// A function at the end of a stretch of a step, and whether its surface is crossed within the stretch.
#[derive(Clone, Copy, Debug)]
pub struct Stretch<R: Real> {
    pub s: R,
    pub value: R,
    pub crossing: R::Mask,
}

/// Tells the stretches with a crossing from the values at their ends; returns the sides after them.
#[inline(always)]
pub fn judge<R: Real>(s: &[R], values: &[R], side: Side<R>, stretches: &mut [Stretch<R>]) -> Side<R> {
    let Side { mut below, mut above, rising, falling, moved } = side;
    for i in 0..stretches.len() {
        let value = values[i];
        let (low, high) = (value.less(R::zero()), R::zero().less(value));
        let mut crossing = R::mask(false);
        if rising {
            crossing = below.and(high).and(moved);
        }
        if falling {
            crossing = crossing.or(above.and(low).and(moved));
        }
        stretches[i] = Stretch { s: s[i], value, crossing };
        // A zero leaves the side as it was: a surface that is only touched is not crossed. NaN has no side.
        let sane = value.finite();
        below = low.or(below.and(high.not())).and(sane);
        above = high.or(above.and(low.not())).and(sane);
    }
    Side { below, above, ..side }
}

/// Returns the lanes that may have other changes of sign than the values at equidistant places show: the values bend too
/// much for their distance from zero and from one another.
#[inline(always)]
pub fn in_doubt<R: Real>(start: R, values: &[R]) -> R::Mask {
    let (mut least, mut bend) = (R::constant(f64::INFINITY), R::zero());
    let (mut last, mut before, mut size) = (start, start, start.abs());
    for i in 0..values.len() {
        let (value, next) = (values[i], values[i].abs());
        least = least.min(size + next);
        // Every other one will do where there are many; quarters alone hide zeros of a series that ends.
        if i % 2 == 1 || values.len() < MOST_PROBES && i > 0 {
            bend = bend.max((value - last.scale(2.0) + before).abs());
        }
        (before, last, size) = (last, value, next);
    }
    bend.scale(CLEAR).less(least).not()
}

/// Takes away the first crossings of lanes that still leave some out, so many as `skip` says.
#[inline(always)]
pub fn leave_out<R: Real>(stretches: &mut [Stretch<R>], skip: &mut R) {
    if !R::zero().less(*skip).any() {
        return;
    }
    for stretch in stretches.iter_mut() {
        let left_out = stretch.crossing.and(R::zero().less(*skip));
        *skip -= R::select(left_out, R::one(), R::zero());
        stretch.crossing = stretch.crossing.and(left_out.not());
    }
}
