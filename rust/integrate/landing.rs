//! Landing on switching surfaces and on the wall.
//!
//! A step is taken with the side of every surface frozen. Then [`Watch::find`] looks on the step's
//! polynomial for the first place where a surface's sign contradicts its side, and [`Watch::land`]
//! takes the step anew up to there, until the surface's function is zero.

use super::dense::Dense;
use super::root::bracketed;
use super::step::{Step, step};
use super::tableau::STAGES;
use crate::model::{Sides, System};
use crate::scalar::Scalar;

/// What can be crossed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    Surface(usize),
    Wall,
}

/// What a step does to the targets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Find {
    /// It crosses none.
    Clear,
    /// The first crossing, at `theta` on the polynomial; the sign is wrong at `high`.
    Crossing { target: Target, theta: f64, high: f64, scale: f64 },
    /// The step starts on the target and leaves it to the wrong side.
    Stale(Target),
}

/// Where within a step the signs are looked at, so that a target crossed twice is seen too.
const PROBES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// A target's function counts as zero below this part of its largest value in the step.
const ZERO: f64 = 1e-13;
const ON_TARGET: f64 = 1e-12;
/// Below this a surface's function is rounding noise: the system rests on the surface.
pub const NOISE: f64 = 1e-14;

/// A system on the way from one step to the next: what is looked at, and from where.
pub struct Watch<'a, M, S: Scalar, const D: usize> {
    pub system: &'a M,
    pub t: f64,
    pub x: &'a [S; D],
    pub rate: &'a [S; D],
    pub sides: &'a Sides<S>,
    pub wall: bool,
    /// A surface whose function stays below this in a step is left alone: the step's error is larger.
    pub noise: f64,
}

impl<M, S, const D: usize> Watch<'_, M, S, D>
where
    S: Scalar<Real = f64, Mask = bool>,
    M: System<S, D>,
{
    /// The target's function, positive on the side that the law is frozen on.
    fn value(&self, target: Target, t: f64, x: &[S; D]) -> f64 {
        match target {
            Target::Surface(j) => {
                let value = self.system.surface(j, S::lift(t), x, self.sides).real();
                if self.sides[j] { value } else { -value }
            }
            Target::Wall => self.system.wall(x).map_or(1.0, S::real),
        }
    }

    /// The first crossing within a step of size `h` with this polynomial.
    pub fn find(&self, dense: &Dense<f64, D>, h: f64) -> Find {
        let states = PROBES.map(|theta| dense.at(theta).map(S::lift));
        let mut first = Find::Clear;
        let mut earliest = f64::INFINITY;
        let surfaces = (0..self.system.surfaces()).map(Target::Surface);
        for target in surfaces.chain(self.wall.then_some(Target::Wall)) {
            let start = self.value(target, self.t, self.x);
            let mut values = [0.0; PROBES.len()];
            let mut scale = start.abs();
            for i in 0..PROBES.len() {
                values[i] = self.value(target, self.t + PROBES[i] * h, &states[i]);
                scale = scale.max(values[i].abs());
            }
            if scale < self.noise && target != Target::Wall {
                continue;
            }
            let Some(i) = values.iter().position(|&v| v < 0.0) else { continue };
            let on = |theta: f64| self.value(target, self.t + theta * h, &dense.at(theta).map(S::lift));
            let mut low = if i == 0 { (0.0, start) } else { (PROBES[i - 1], values[i - 1]) };
            let mut high = (PROBES[i], values[i]);
            if i == 0 && start <= ON_TARGET * scale {
                // On the target: either it goes to the right side for a moment only, or not at all.
                match excursion(on, &mut high, ON_TARGET * scale) {
                    Some(point) => low = point,
                    None => return Find::Stale(target),
                }
            }
            let theta = bracketed(on, low, high, 1e-3 * ZERO * scale);
            if theta < earliest {
                earliest = theta;
                first = Find::Crossing { target, theta, high: high.0, scale };
            }
        }
        first
    }

    /// The step up to the crossing, with its size: `None` where the step itself, unlike its polynomial,
    /// does not cross (it grazes).
    pub fn land(
        &self,
        (target, theta, high, scale): (Target, f64, f64, f64),
        dense: &Dense<f64, D>,
        h: f64,
        evaluations: &mut u64,
    ) -> Option<(f64, Step<S, D>)> {
        let zero = ZERO * scale;
        let mut take = |size: f64| {
            *evaluations += (STAGES - 1) as u64;
            let step = step(self.system, self.t, self.x, self.rate, size, self.sides);
            (self.value(target, self.t + size, &step.x), step)
        };
        let on = |theta: f64| self.value(target, self.t + theta * h, &dense.at(theta).map(S::lift));

        // Newton with the polynomial's slope, then secants.
        let mut size = theta * h;
        let mut slope = (on(theta + 1e-4) - on(theta - 1e-4)) / (2e-4 * h);
        let mut last: Option<(f64, f64)> = None;
        for _ in 0..8 {
            let (value, step) = take(size);
            if value.abs() <= zero {
                return Some((size, step));
            }
            if let Some((old, old_value)) = last {
                slope = (value - old_value) / (size - old);
            }
            last = Some((size, value));
            size -= value / slope;
            let within = size / h > 0.0 && size / h <= high;
            if !within {
                break;
            }
        }

        let end = high * h;
        let (value, _) = take(end);
        if value >= 0.0 {
            return None;
        }
        let start = self.value(target, self.t, self.x).max(0.0);
        let size = bracketed(|size| take(size).0, (0.0, start), (end, value), zero);
        Some((size, take(size).1))
    }
}

/// Looks ever closer to the start for a point where the function is above `least`; `high` becomes
/// the last point seen below zero.
fn excursion(on: impl Fn(f64) -> f64, high: &mut (f64, f64), least: f64) -> Option<(f64, f64)> {
    let mut theta = high.0;
    for _ in 0..30 {
        theta *= 0.5;
        let value = on(theta);
        if value > least {
            return Some((theta, value));
        }
        if value < 0.0 {
            *high = (theta, value);
        }
    }
    None
}
