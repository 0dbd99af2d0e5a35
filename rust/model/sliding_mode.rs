//! Sliding modes: where a law jumps at a surface and points to it from both sides, the state stays on it.
//!
//! Filippov's convention (Differential Equations with Discontinuous Righthand Sides, 1988): on the surface
//! the rates are the mean of those of its two sides, weighted so that the state does not leave it. With
//! `-c*sign(v)` in the rate of `v` this is set-valued dry friction: the body sticks until the other forces
//! exceed `c`.

use super::{MAX_SURFACES, Sides, choose};
use crate::scalar::{Mask, Scalar};

/// The most surfaces that a law slides on: each takes a second one, between sliding and not.
pub const MAX_SLIDING: usize = MAX_SURFACES / 2;
/// The most states of a law that slides.
const MOST: usize = 12;

/// A start is on a surface where its function is below this part of the terms that it is the sum of.
const ON: f64 = 1e-14;

/// A law: the rates on given sides, on none of which it slides. For any number of states, so that what is here is
/// compiled once for each kind of number.
pub type Law<'a, S> = &'a dyn Fn(&Sides<S>, &mut [S]);

/// A surface `offset + gradient x = 0` on which a law may slide.
///
/// Its side is true where the function is positive. While the law slides it is false and that of `mode` true,
/// which distinguishes this from the sides of a start, which are all true until they are known.
#[derive(Clone, Debug)]
pub struct SlidingSurface<S> {
    /// The numbers of the surface and of the one between sliding and not.
    pub surface: usize,
    pub mode: usize,
    pub offset: S,
    pub gradient: Vec<S>,
}

/// The rates on all surfaces that the law slides on.
struct Balance<S> {
    rates: [S; MOST],
    /// The place between its two sides at which the law is taken, from -1 to 1.
    between: [S; MAX_SLIDING],
    /// How the difference of a surface's two sides moves the state away from it; negative where it brings it back.
    away: [S; MAX_SLIDING],
}

impl<S: Scalar> SlidingSurface<S> {
    fn along(&self, rates: &[S]) -> S {
        let mut sum = S::zero();
        for (&slope, &rate) in self.gradient.iter().zip(rates) {
            sum += slope * rate;
        }
        sum
    }

    /// Returns true if the law slides here.
    pub fn slides(&self, sides: &Sides<S>) -> S::Mask {
        sides[self.mode].and(sides[self.surface].not())
    }

    /// Subtracts this multiple of the gradient from the numbers, if the mask is true.
    fn take(&self, numbers: &mut [S], amount: S, here: S::Mask) {
        let part = amount / self.along(&self.gradient);
        for (own, &slope) in numbers.iter_mut().zip(&self.gradient) {
            *own = S::select(here, *own - slope * part, *own);
        }
    }

    /// Returns true if a state is on the surface to rounding.
    fn holds(&self, x: &[S]) -> S::Mask {
        let size = |a: S| S::select(a.less(S::zero()), -a, a);
        let mut terms = size(self.offset);
        for (&slope, &own) in self.gradient.iter().zip(x) {
            terms += size(slope * own);
        }
        terms.scale(ON).less(size(self.offset + self.along(x))).not()
    }
}

/// The rates of a law that may slide.
pub fn rates<S: Scalar>(surfaces: &[SlidingSurface<S>], sides: &Sides<S>, law: Law<'_, S>, result: &mut [S]) {
    law(sides, result);
    if !S::SYMBOLIC && !surfaces.iter().any(|own| sides[own.mode].any()) {
        return;
    }
    let balance = balance(surfaces, sides, law);
    for own in surfaces {
        for (rate, &held) in result.iter_mut().zip(&balance.rates) {
            *rate = S::select(sides[own.mode], held, *rate);
        }
    }
}

/// The weights with which the law stays on every surface that it slides on (Utkin's equivalent control).
///
/// The side of such a surface is false: its other side is what is mixed in.
fn balance<S: Scalar>(surfaces: &[SlidingSurface<S>], sides: &Sides<S>, law: Law<'_, S>) -> Balance<S> {
    let (count, states) = (surfaces.len(), surfaces[0].gradient.len());
    let mut rates = [S::zero(); MOST];
    law(sides, &mut rates[..states]);
    let mut halves = [[S::zero(); MOST]; MAX_SLIDING];
    for (half, own) in halves.iter_mut().zip(surfaces) {
        let mut above = *sides;
        above[own.surface] = S::mask(true);
        law(&above, &mut half[..states]);
        for (part, &rate) in half.iter_mut().zip(&rates) {
            *part = (*part - rate).scale(0.5);
        }
    }
    let mut matrix = [[S::zero(); MAX_SLIDING]; MAX_SLIDING];
    let mut up = [S::zero(); MAX_SLIDING];
    let mut away = [S::zero(); MAX_SLIDING];
    for (i, own) in surfaces.iter().enumerate() {
        let slides = sides[own.mode];
        for j in 0..count {
            let rest = if i == j { S::one() } else { S::zero() };
            matrix[i][j] = S::select(slides, own.along(&halves[j]), rest);
        }
        away[i] = own.along(&halves[i]);
        up[i] = S::select(slides, -own.along(&rates), S::zero());
    }
    solve(count, &mut matrix, &mut up);
    for (&part, half) in up.iter().zip(&halves[..count]) {
        for (rate, &own) in rates.iter_mut().zip(half) {
            *rate += part * own;
        }
    }
    // Without what rounding leaves.
    for own in surfaces {
        let left = own.along(&rates);
        own.take(&mut rates, left, sides[own.mode]);
    }
    Balance { rates, between: up.map(|part| part - S::one()), away }
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
                matrix[i][j] -= factor * matrix[k][j];
            }
            right[i] -= factor * right[k];
        }
    }
    for k in (0..count).rev() {
        for j in k + 1..count {
            right[k] -= matrix[k][j] * right[j];
        }
        right[k] = right[k] / matrix[k][k];
    }
}

/// The function of the surface between sliding and not: what is left of the jump that keeps the state on
/// surface `i`.
pub fn margin<S: Scalar>(surfaces: &[SlidingSurface<S>], i: usize, sides: &Sides<S>, law: Law<'_, S>) -> S {
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
pub fn settle<S: Scalar>(surfaces: &[SlidingSurface<S>], x: &[S], sides: &mut Sides<S>, law: Law<'_, S>) {
    // All that it is on may hold one another.
    for (i, own) in surfaces.iter().enumerate() {
        sides[own.mode] = S::mask(false);
        let mut here = own.holds(x);
        if here.any() {
            let [below, above] = speeds(surfaces, i, sides, law);
            here = here.and(above.less(below));
        }
        sides[own.mode] = here;
        sides[own.surface] = sides[own.surface].and(here.not());
    }
    for (i, own) in surfaces.iter().enumerate() {
        let here = own.slides(sides);
        if here.any() {
            let stays = here.and(S::zero().less(margin(surfaces, i, sides, law)));
            let up = points_up(surfaces, i, sides, law);
            sides[own.mode] = stays;
            sides[own.surface] = choose(here, up.and(stays.not()), sides[own.surface]);
        }
    }
}

/// True if a state is on a surface to which the law points from both sides, whether it holds or not.
pub fn attracts<S: Scalar>(
    surfaces: &[SlidingSurface<S>],
    x: &[S],
    sides: &Sides<S>,
    law: Law<'_, S>,
) -> S::Mask {
    let mut any = S::mask(false);
    for (i, own) in surfaces.iter().enumerate() {
        let here = own.holds(x);
        if here.any() {
            let [below, above] = speeds(surfaces, i, sides, law);
            any = any.or(here.and(above.less(below)));
        }
    }
    any
}

/// How fast the law leaves surface `i` upwards on its lower and on its upper side.
fn speeds<S: Scalar>(surfaces: &[SlidingSurface<S>], i: usize, sides: &Sides<S>, law: Law<'_, S>) -> [S; 2] {
    let own = &surfaces[i];
    [false, true].map(|side| {
        let mut on = *sides;
        on[own.surface] = S::mask(side);
        on[own.mode] = S::mask(false);
        let mut here = [S::zero(); MOST];
        rates(surfaces, &on, law, &mut here[..own.gradient.len()]);
        own.along(&here)
    })
}

/// Returns true if the mean of both sides leaves surface `i` upwards.
fn points_up<S: Scalar>(
    surfaces: &[SlidingSurface<S>],
    i: usize,
    sides: &Sides<S>,
    law: Law<'_, S>,
) -> S::Mask {
    let [below, above] = speeds(surfaces, i, sides, law);
    S::zero().less(below + above)
}

/// Passes surface `i`, or that of its mode, in the lanes `here`: the law begins to slide, goes through, or is let go.
pub fn switch<S: Scalar>(
    surfaces: &[SlidingSurface<S>],
    i: usize,
    x: &mut [S],
    sides: &mut Sides<S>,
    here: S::Mask,
    law: Law<'_, S>,
) {
    let own = &surfaces[i];
    let leaves = here.and(own.slides(sides));
    let arrives = here.and(leaves.not());
    let mut stays = S::mask(false);
    if leaves.any() {
        let up = points_up(surfaces, i, sides, law);
        sides[own.mode] = sides[own.mode].and(leaves.not());
        sides[own.surface] = choose(leaves, up, sides[own.surface]);
    }
    if arrives.any() {
        let mut sliding = *sides;
        sliding[own.surface] = S::mask(false);
        sliding[own.mode] = S::mask(true);
        stays = arrives.and(S::zero().less(margin(surfaces, i, &sliding, law)));
        sides[own.mode] = choose(arrives, stays, sides[own.mode]);
        let through = sides[own.surface].not().and(stays.not());
        sides[own.surface] = choose(arrives, through, sides[own.surface]);
    }
    let off = own.offset + own.along(x);
    own.take(x, off, stays.or(leaves));
}
