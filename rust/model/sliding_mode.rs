//! Sliding modes: where a law jumps at a surface and points to it from both sides, the state stays on it.
//!
//! Filippov's convention (Differential Equations with Discontinuous Righthand Sides, 1988): on the surface
//! the rates are the mean of those of its two sides, weighted so that the state does not leave it. With
//! `-c*sign(v)` in the rate of `v` this is set-valued dry friction: the body sticks until the other forces
//! exceed `c`.

use super::{MAX_SURFACES, Sides, choose};
use crate::scalar::{Mask, Scalar};
use crate::unroll::vector;

/// The most surfaces that a law slides on: each takes a second one, between sliding and not.
pub const MAX_SLIDING: usize = MAX_SURFACES / 2;

/// A start is on a surface where its function is below this part of the terms that it is the sum of.
const ON: f64 = 1e-14;

/// A surface `offset + gradient x = 0` on which a law may slide.
///
/// Its side is true where the function is positive. While the law slides it is false and that of `mode` true,
/// which tells this from the sides of a start, which are all true until they are known.
#[derive(Clone, Copy, Debug)]
pub struct SlidingSurface<S, const D: usize> {
    /// The numbers of the surface and of the one between sliding and not.
    pub surface: usize,
    pub mode: usize,
    pub offset: S,
    pub gradient: [S; D],
}

/// The rates on all surfaces that the law slides on.
struct Balance<S, const D: usize> {
    rates: [S; D],
    /// Where between its two sides the law is taken, from -1 to 1.
    between: [S; MAX_SLIDING],
    /// How the difference of a surface's two sides moves the state away from it; negative where it brings it back.
    away: [S; MAX_SLIDING],
}

impl<S: Scalar, const D: usize> SlidingSurface<S, D> {
    fn along(&self, rates: &[S; D]) -> S {
        let mut sum = S::zero();
        for n in 0..D {
            sum += self.gradient[n] * rates[n];
        }
        sum
    }

    /// Whether the law slides here.
    pub fn slides(&self, sides: &Sides<S>) -> S::Mask {
        sides[self.mode].and(sides[self.surface].not())
    }

    /// The state moved onto the surface, by the shortest way.
    fn projected(&self, x: &[S; D]) -> [S; D] {
        let by = (self.offset + self.along(x)) / self.along(&self.gradient);
        vector!(S, D; n => x[n] - self.gradient[n] * by)
    }

    /// Whether a state is on the surface to rounding.
    fn holds(&self, x: &[S; D]) -> S::Mask {
        let size = |a: S| S::select(a.less(S::zero()), -a, a);
        let mut terms = size(self.offset);
        for n in 0..D {
            terms += size(self.gradient[n] * x[n]);
        }
        terms.scale(ON).less(size(self.offset + self.along(x))).not()
    }
}

/// The rates of a law that may slide; `law` has those on given sides.
pub fn rates<S: Scalar, const D: usize>(
    surfaces: &[SlidingSurface<S, D>],
    sides: &Sides<S>,
    law: &dyn Fn(&Sides<S>) -> [S; D],
) -> [S; D] {
    let mut rates = law(sides);
    if !S::SYMBOLIC && !surfaces.iter().any(|own| sides[own.mode].any()) {
        return rates;
    }
    let balance = balance(surfaces, sides, law);
    for own in surfaces {
        rates = vector!(S, D; n => S::select(sides[own.mode], balance.rates[n], rates[n]));
    }
    rates
}

/// The weights with which the law stays on every surface whose mode is on (Utkin's equivalent control).
fn balance<S: Scalar, const D: usize>(
    surfaces: &[SlidingSurface<S, D>],
    sides: &Sides<S>,
    law: &dyn Fn(&Sides<S>) -> [S; D],
) -> Balance<S, D> {
    let count = surfaces.len();
    let mut above = *sides;
    for own in surfaces {
        above[own.surface] = S::mask(true);
    }
    let mut rates = law(&above);
    let mut halves = [[S::zero(); D]; MAX_SLIDING];
    for (half, own) in halves.iter_mut().zip(surfaces) {
        let mut below = above;
        below[own.surface] = S::mask(false);
        let other = law(&below);
        *half = vector!(S, D; n => (rates[n] - other[n]).scale(0.5));
    }
    // What goes from each upper side towards the lower one: nothing or all where the law does not slide.
    let mut matrix = [[S::zero(); MAX_SLIDING]; MAX_SLIDING];
    let mut down = [S::zero(); MAX_SLIDING];
    let mut away = [S::zero(); MAX_SLIDING];
    for (i, own) in surfaces.iter().enumerate() {
        let slides = sides[own.mode];
        for j in 0..count {
            let rest = if i == j { S::one() } else { S::zero() };
            matrix[i][j] = S::select(slides, own.along(&halves[j]), rest);
        }
        away[i] = own.along(&halves[i]);
        let stays = S::select(sides[own.surface], S::zero(), S::constant(-2.0));
        down[i] = S::select(slides, -own.along(&rates), stays);
    }
    solve(count, &mut matrix, &mut down);
    for (j, half) in halves[..count].iter().enumerate() {
        rates = vector!(S, D; n => rates[n] + down[j] * half[n]);
    }
    // Without what rounding leaves.
    for own in surfaces {
        let left = own.along(&rates) / own.along(&own.gradient);
        rates = vector!(S, D; n => S::select(sides[own.mode], rates[n] - own.gradient[n] * left, rates[n]));
    }
    Balance { rates, between: down.map(|part| part + S::one()), away }
}

/// Solves `matrix x = right` in place. Frictions oppose their own surface most: without pivots.
fn solve<S: Scalar>(
    count: usize,
    matrix: &mut [[S; MAX_SLIDING]; MAX_SLIDING],
    right: &mut [S; MAX_SLIDING],
) {
    for k in 0..count {
        for i in k + 1..count {
            let factor = matrix[i][k] / matrix[k][k];
            for j in k..count {
                matrix[i][j] = matrix[i][j] - factor * matrix[k][j];
            }
            right[i] = right[i] - factor * right[k];
        }
    }
    for k in (0..count).rev() {
        for j in k + 1..count {
            right[k] = right[k] - matrix[k][j] * right[j];
        }
        right[k] = right[k] / matrix[k][k];
    }
}

/// The function of the surface between sliding and not: what is left of the jump that keeps the state on
/// surface `i`.
pub fn margin<S: Scalar, const D: usize>(
    surfaces: &[SlidingSurface<S, D>],
    i: usize,
    sides: &Sides<S>,
    law: &dyn Fn(&Sides<S>) -> [S; D],
) -> S {
    let slides = surfaces[i].slides(sides);
    if !slides.any() {
        return -S::one();
    }
    let balance = balance(surfaces, sides, law);
    let between = balance.between[i];
    let part = S::select(between.less(S::zero()), -between, between);
    // Not a number, or far beyond, where there is next to no jump.
    let held = slides.and(balance.away[i].less(S::zero())).and(part.less(S::constant(2.0)));
    S::select(held, S::one() - part, -S::one())
}

/// Completes the sides of a start: on surfaces the law slides, or leaves them to where it points.
pub fn settle<S: Scalar, const D: usize>(
    surfaces: &[SlidingSurface<S, D>],
    x: &[S; D],
    sides: &mut Sides<S>,
    law: &dyn Fn(&Sides<S>) -> [S; D],
) {
    // All that it is on may hold one another.
    for own in surfaces {
        let here = own.holds(x);
        sides[own.mode] = here;
        sides[own.surface] = sides[own.surface].and(here.not());
    }
    for i in 0..surfaces.len() {
        let here = surfaces[i].slides(sides);
        if here.any() {
            land(surfaces, i, sides, here, law);
        }
    }
}

/// What becomes of the sides where a run gets to surface `i`, in the lanes `here`; returns those that slide.
fn land<S: Scalar, const D: usize>(
    surfaces: &[SlidingSurface<S, D>],
    i: usize,
    sides: &mut Sides<S>,
    here: S::Mask,
    law: &dyn Fn(&Sides<S>) -> [S; D],
) -> S::Mask {
    let SlidingSurface { surface, mode, .. } = surfaces[i];
    let mut sliding = *sides;
    sliding[surface] = S::mask(false);
    sliding[mode] = S::mask(true);
    let stays = here.and(S::zero().less(margin(surfaces, i, &sliding, law)));
    let mut passing = *sides;
    passing[mode] = S::mask(false);
    let up = S::zero().less(midway(surfaces, i, &passing, law));
    sides[mode] = choose(here, stays, sides[mode]);
    sides[surface] = choose(here, up.and(stays.not()), sides[surface]);
    stays
}

/// How fast the mean of both sides leaves surface `i`.
fn midway<S: Scalar, const D: usize>(
    surfaces: &[SlidingSurface<S, D>],
    i: usize,
    sides: &Sides<S>,
    law: &dyn Fn(&Sides<S>) -> [S; D],
) -> S {
    let own = &surfaces[i];
    let mut sum = S::zero();
    for side in [true, false] {
        let mut on = *sides;
        on[own.surface] = S::mask(side);
        on[own.mode] = S::mask(false);
        sum += own.along(&rates(surfaces, &on, law));
    }
    sum
}

/// Passes surface `i`, or that of its mode, in the lanes `here`: the law begins to slide, goes through, or is let go.
pub fn switch<S: Scalar, const D: usize>(
    surfaces: &[SlidingSurface<S, D>],
    i: usize,
    x: &mut [S; D],
    sides: &mut Sides<S>,
    here: S::Mask,
    law: &dyn Fn(&Sides<S>) -> [S; D],
) {
    let own = &surfaces[i];
    let was = own.slides(sides);
    let arrives = here.and(was.not());
    let leaves = here.and(was);
    let onto = own.projected(x);
    if leaves.any() {
        let up = S::zero().less(midway(surfaces, i, sides, law));
        sides[own.mode] = sides[own.mode].and(leaves.not());
        sides[own.surface] = choose(leaves, up, sides[own.surface]);
    }
    let mut stays = S::mask(false);
    if arrives.any() {
        stays = land(surfaces, i, sides, arrives, law);
    }
    *x = vector!(S, D; n => S::select(stays.or(leaves), onto[n], x[n]));
}
