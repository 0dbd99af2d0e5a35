//! The targets of a step: switching surfaces and the wall, and the signs of their functions at a few places.

use super::{MAX_SURFACES, Sides, System};
use crate::scalar::{Mask, Real, Scalar, vector};
use crate::unroll::unroll;

/// The targets of crossings: the switching surfaces, then the wall.
pub const TARGETS: usize = MAX_SURFACES + 1;
pub const WALL: usize = MAX_SURFACES;

/// So many places within a step are looked at side by side, at most.
pub const MOST_PROBES: usize = 8;

/// A function has no zero between two places if its bend, times this, is less than the sum of the two values.
const CLEAR_SUM: f64 = 4.0;
/// A function has no zero in a step if its bend between quarters, times this, is less than its values near both ends.
const CLEAR: f64 = 1.5;

/// The state of a run, lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct StepStart<S: Scalar, const D: usize> {
    pub t: S::Real,
    pub x: [S; D],
    /// The side of each switching surface that the law is taken on.
    pub sides: Sides<S>,
}

/// The states at these parts of a step of size `h`.
pub struct Probes<'a, R: Real, const D: usize> {
    pub h: R,
    pub parts: &'static [f64],
    pub states: &'a [[R; D]; MOST_PROBES],
}

impl<R: Real, const D: usize> Probes<'_, R, D> {
    /// The values of a function of time and state.
    #[inline(always)]
    pub fn each(&self, start: R, value: impl Fn(R, &[R; D]) -> R) -> [R; MOST_PROBES] {
        let mut values = [R::zero(); MOST_PROBES];
        for (i, &part) in self.parts.iter().enumerate() {
            values[i] = value(start + self.h.scale(part), &self.states[i]);
        }
        values
    }
}

/// The functions of all targets on the sides of a step's start.
pub struct Targets<'a, M, S: Scalar, const D: usize> {
    pub system: &'a M,
    pub at: &'a StepStart<S, D>,
    pub wall: bool,
}

impl<M, S, const D: usize> Targets<'_, M, S, D>
where
    S: Scalar,
    M: System<S, D>,
{
    /// Returns true if there is such a target.
    #[inline(always)]
    pub fn has(&self, target: usize) -> bool {
        target < self.system.surfaces() || target == WALL && self.wall
    }

    /// The target's function, positive on the side that the law is frozen on.
    #[inline(always)]
    pub fn value(&self, target: usize, t: S::Real, x: &[S; D]) -> S::Real {
        if target == WALL {
            return self.system.wall(x).map_or(S::Real::one(), S::real);
        }
        let value = self.system.surface(target, S::lift(t), x, &self.at.sides).real();
        S::Real::select(self.at.sides[target], value, -value)
    }

    /// Returns true if the target's function is as slow as the state.
    #[inline(always)]
    pub fn is_steady(&self, target: usize) -> bool {
        target == WALL || self.system.is_steady(target, &self.at.sides)
    }

    /// The lanes that may cross each target, by so many places.
    #[inline(always)]
    fn at_places(&self, places: usize, probes: &Probes<'_, S::Real, D>, suspect: &mut [S::Mask; TARGETS]) {
        let probes = &Probes { parts: &probes.parts[..places], ..*probes };
        // Unrolled, so that each target's function is known.
        unroll!(target in 0..TARGETS => {
            if self.has(target) {
                suspect[target] = match self.is_steady(target) {
                    true => crossing(&self.along(target, probes), places),
                    false => S::mask(true),
                };
            }
        });
    }

    /// The target's function at these places, as [`value`](Self::value).
    #[inline(always)]
    pub fn along(&self, target: usize, probes: &Probes<'_, S::Real, D>) -> [S::Real; MOST_PROBES] {
        if target == WALL {
            return probes.each(self.at.t, |t, x| self.value(target, t, &vector!(S, D; n => S::lift(x[n]))));
        }
        let mut values = self.system.surface_along(target, self.at, probes);
        for value in &mut values[..probes.parts.len()] {
            *value = S::Real::select(self.at.sides[target], *value, -*value);
        }
        values
    }
}

/// The lanes in which a target's function may have a zero, by its values at so many places of a step.
#[inline(always)]
pub fn crossing<R: Real>(values: &[R; MOST_PROBES], places: usize) -> R::Mask {
    let mut beyond = R::mask(false);
    for value in &values[..places] {
        beyond = beyond.or(value.less(R::zero()));
    }
    if places == MOST_PROBES {
        // A long step: quarters alone hide zeros of a series that ends. At the start is the straight line through the
        // next two places.
        let mut least = values[0].scale(3.0) - values[1];
        let mut bend = R::zero();
        for i in 1..MOST_PROBES {
            least = least.min(values[i - 1] + values[i]);
            if i % 2 == 0 {
                bend = bend.max((values[i] - values[i - 1].scale(2.0) + values[i - 2]).abs());
            }
        }
        return beyond.or(bend.scale(CLEAR_SUM).less(least).not());
    }
    // A function that is farther from zero than it changes near both ends has no dip.
    let (a, b, c, d) = (values[0], values[1], values[2], values[3]);
    let least = a.min(d);
    let mut doubt = ((a - b).abs() + (c - d).abs()).less(least).not();
    if doubt.any() {
        let bend = (a - b.scale(2.0) + c).abs().max((b - c.scale(2.0) + d).abs());
        doubt = doubt.and(bend.scale(CLEAR).less(least).not());
    }
    beyond.or(doubt)
}

/// Finds the lanes that may cross each target: those beyond it at any of these places, and those that the places leave in
/// doubt. A function of its own for each law and kind of number, whatever the method.
#[inline(never)]
pub fn suspects<M: System<S, D>, S: Scalar, const D: usize>(
    targets: &Targets<'_, M, S, D>,
    probes: &Probes<'_, S::Real, D>,
    suspect: &mut [S::Mask; TARGETS],
) {
    // A smooth law has no target.
    if const { M::SMOOTH } {
        return;
    }
    // The numbers of places, quarters or eighths, known to the compiler, which looks at them side by side.
    match probes.parts.len() {
        4 if const { size_of::<S>() == size_of::<f64>() } => targets.at_places(4, probes, suspect),
        _ if const { size_of::<S>() == size_of::<f64>() } => targets.at_places(MOST_PROBES, probes, suspect),
        places => targets.at_places(places, probes, suspect),
    }
}

/// The function of surface `j` at one place after the other.
#[inline(always)]
pub fn surface_in_turn<M: System<S, D> + ?Sized, S: Scalar, const D: usize>(
    system: &M,
    j: usize,
    at: &StepStart<S, D>,
    probes: &Probes<'_, S::Real, D>,
) -> [S::Real; MOST_PROBES] {
    probes.each(at.t, |t, x| {
        system.surface(j, S::lift(t), &vector!(S, D; n => S::lift(x[n])), &at.sides).real()
    })
}
