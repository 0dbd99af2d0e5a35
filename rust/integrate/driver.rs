//! The one stepping loop.

use std::array::from_fn;

use super::control::{Controller, initial_step};
use super::dense::Dense;
use super::landing::{Find, NOISE, Target, Watch};
use super::step::{Step, step};
use super::tableau::STAGES;
use super::tolerance::{ErrorNorm, Failure, Tolerance};
use crate::model::{MAX_SURFACES, Sides, System, sides_of};
use crate::scalar::Scalar;

/// What the work was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Steps accepted.
    pub accepted: u64,
    /// Trial steps rejected for their error.
    pub rejected: u64,
    /// Evaluations of the rates.
    pub evaluations: u64,
}

/// How an accepted step ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// As far as the step size goes, or at the end asked for.
    Free,
    /// On this switching surface.
    Surface(usize),
    /// On the wall of the model's domain.
    Wall,
}

/// A run in progress: each [`advance`](Driver::advance) takes one accepted step.
///
/// Between steps the law is smooth: a step ends on the first switching surface it meets, to 1e-12 of
/// the surface function's size in the step, and the next one starts on the other side. Everything
/// derived from a run (samples, events, tangents, exponents) is built on this loop.
pub struct Driver<'a, M, S: Scalar, const D: usize, E = Tolerance> {
    system: &'a M,
    norm: E,
    controller: Controller,
    /// Whether the run ends on the wall.
    wall: bool,
    t: f64,
    x: [S; D],
    rate: [S; D],
    sides: Sides<S>,
    /// The size of the next trial step, of the sign of the direction.
    h: f64,
    /// The last accepted step: its start, its size and the step itself.
    from: (f64, [S; D]),
    size: f64,
    last: Step<S, D>,
    /// Sides changed since time last moved on.
    flips: usize,
    /// The state is on a surface to within rounding, which leaves its side open.
    undecided: bool,
    /// The work so far.
    pub counts: Counts,
}

impl<'a, M, S, const D: usize, E> Driver<'a, M, S, D, E>
where
    S: Scalar<Real = f64, Mask = bool>,
    M: System<S, D>,
    E: ErrorNorm<S, D> + Copy,
{
    /// Starts at time `t` and state `x`. The size and the direction of the first trial step are those
    /// of `h` where given; otherwise the size is estimated and the direction is forward.
    pub fn new(system: &'a M, t: f64, x: [S; D], h: Option<f64>, norm: &E) -> Self {
        let mut sides = sides_of(system, S::lift(t), &x);
        let rate = system.rates(S::lift(t), &x, &sides);
        let direction = h.map_or(1.0, f64::signum);
        start_sides(system, t, &x, &rate, direction, &mut sides);
        let mut counts = Counts { evaluations: 1, ..Counts::default() };
        let h = h.unwrap_or_else(|| {
            counts.evaluations += 1;
            initial_step(system, (t, &x, &rate), 1.0, &sides, norm.state())
        });
        let last = Step { x, stages: [rate; STAGES] };
        Self {
            system,
            norm: *norm,
            controller: Controller::default(),
            wall: false,
            t,
            x,
            rate,
            sides,
            h,
            from: (t, x),
            size: 0.0,
            last,
            flips: 0,
            undecided: false,
            counts,
        }
    }

    /// Ends the run on the model's wall, where it has one.
    pub fn with_wall(mut self) -> Self {
        self.wall = self.system.wall(&self.x).is_some();
        self
    }

    /// The time reached.
    pub fn t(&self) -> f64 {
        self.t
    }

    /// The state reached.
    pub fn x(&self) -> &[S; D] {
        &self.x
    }

    /// The size of the next trial step.
    pub fn h(&self) -> f64 {
        self.h
    }

    /// The time at which the last accepted step began.
    pub fn from(&self) -> f64 {
        self.from.0
    }

    /// The last accepted step's size (times are rounded, sizes are not) and its polynomial.
    pub fn dense(&self) -> (f64, Dense<S, D>) {
        (self.size, Dense::new(&self.from.1, &self.last, self.size))
    }

    /// Goes on from another state at the same time, as when tangents are scaled back.
    pub fn set_state(&mut self, x: [S; D]) {
        self.x = x;
        self.refresh();
    }

    /// Takes one accepted step, at most up to `end`, which it then reaches exactly.
    pub fn advance(&mut self, end: f64) -> Result<Ending, Failure> {
        loop {
            let remaining = end - self.t;
            let cut = self.h.abs() * 1.01 >= remaining.abs();
            let h = if cut { remaining } else { self.h };
            // A short step leads away from a surface that rounding does not let go of.
            let (h, cut) = if self.undecided { (h * 0.1, false) } else { (h, cut) };
            let trial = step(self.system, self.t, &self.x, &self.rate, h, &self.sides);
            self.counts.evaluations += (STAGES - 1) as u64;
            let error = self.norm.of_step(&self.x, &trial, h);
            let (accepted, factor) = self.controller.judge(error);
            if !accepted {
                self.counts.rejected += 1;
                self.h = h * factor;
                // A size that is not a number, as towards an end that is none, would never shrink.
                if self.t + self.h == self.t || self.h.abs() < 1e-100 || !self.h.is_finite() {
                    return Err(if error.is_finite() {
                        Failure::StepUnderflow { t: self.t }
                    } else {
                        Failure::NotFinite { t: self.t }
                    });
                }
                continue;
            }
            // A step cut short at the end says little about a long one.
            self.h = if cut { (h * factor).abs().max(self.h.abs()).copysign(h) } else { h * factor };

            if self.undecided {
                // All laws are continuous: on the surface both sides are the same to rounding.
                self.h = h * factor.max(1.0) * 10.0;
                self.undecided = false;
                self.commit(h, trial, None);
                self.sides = sides_of(self.system, S::lift(self.t), &self.x);
                self.refresh();
                return Ok(Ending::Free);
            }
            if self.system.surfaces() == 0 && !self.wall {
                self.commit(h, trial, cut.then_some(end));
                return Ok(Ending::Free);
            }
            if let Some(ending) = self.examine(h, trial, cut.then_some(end)) {
                return Ok(ending);
            }
        }
    }

    /// Commits the trial step as far as the first target; `None` where it must be taken again
    /// because it started on the wrong side.
    fn examine(&mut self, h: f64, trial: Step<S, D>, end: Option<f64>) -> Option<Ending> {
        let watch = Watch {
            system: self.system,
            t: self.t,
            x: &self.x,
            rate: &self.rate,
            sides: &self.sides,
            wall: self.wall,
            noise: NOISE.max(self.norm.state().atol),
        };
        let start = from_fn(|n| self.x[n].real());
        let dense = Dense::from_stages(&start, |i, n| trial.stages[i][n].real(), h);
        let (target, theta, high, scale) = match watch.find(&dense, h) {
            Find::Clear => {
                self.commit(h, trial, end);
                return Some(Ending::Free);
            }
            Find::Stale(target) => {
                let moved = self.size != 0.0 && self.flips == 0;
                self.rest();
                let ending = self.cross(target);
                return (moved || ending == Ending::Wall).then_some(ending);
            }
            Find::Crossing { target, theta, high, scale } => (target, theta, high, scale),
        };
        match watch.land((target, theta, high, scale), &dense, h, &mut self.counts.evaluations) {
            Some((size, landed)) => {
                self.commit(size, landed, None);
                Some(self.cross(target))
            }
            None if high == 1.0 => {
                self.commit(h, trial, end);
                Some(Ending::Free)
            }
            None => {
                let size = high * h;
                let short = step(self.system, self.t, &self.x, &self.rate, size, &self.sides);
                self.counts.evaluations += (STAGES - 1) as u64;
                self.commit(size, short, None);
                Some(Ending::Free)
            }
        }
    }

    fn commit(&mut self, h: f64, step: Step<S, D>, end: Option<f64>) {
        self.from = (self.t, self.x);
        self.size = h;
        let t = end.unwrap_or(self.t + h);
        if t != self.t {
            self.flips = 0;
        }
        self.t = t;
        self.x = step.x;
        self.rate = step.stages[STAGES - 1];
        self.last = step;
        self.counts.accepted += 1;
    }

    /// The last step becomes one of no length.
    fn rest(&mut self) {
        self.from = (self.t, self.x);
        self.size = 0.0;
    }

    /// Changes the side of the target that the state is on.
    fn cross(&mut self, target: Target) -> Ending {
        let Target::Surface(j) = target else { return Ending::Wall };
        self.flips += 1;
        if self.flips > 2 * MAX_SURFACES {
            self.undecided = true;
            self.flips = 0;
            return Ending::Free;
        }
        self.sides[j] = !self.sides[j];
        self.refresh();
        Ending::Surface(j)
    }

    fn refresh(&mut self) {
        self.rate = self.system.rates(S::lift(self.t), &self.x, &self.sides);
        self.counts.evaluations += 1;
    }
}

/// At a start exactly on a surface the side is the one the flow goes to.
fn start_sides<S, const D: usize>(
    system: &impl System<S, D>,
    t: f64,
    x: &[S; D],
    rate: &[S; D],
    direction: f64,
    sides: &mut Sides<S>,
) where
    S: Scalar<Real = f64, Mask = bool>,
{
    for j in 0..system.surfaces() {
        if system.surface(j, S::lift(t), x, sides).real() == 0.0 {
            let ahead = direction * 1e-9;
            let moved = from_fn(|n| x[n] + rate[n].scale(ahead));
            sides[j] = S::zero().less(system.surface(j, S::lift(t + ahead), &moved, sides));
        }
    }
}
