//! Landing on switching surfaces and on the wall.
//!
//! A step is taken with the side of every surface frozen. Then [`SurfaceMonitor::find`] looks on the step's
//! polynomial for the first place where a surface's sign contradicts its side. A lane that crosses takes
//! its step anew up to there, and [`EventIteration`] corrects the step's size until the surface's function is
//! zero; the other lanes go on meanwhile.

use super::method::{Course, MOST_PROBES, Method, StepStart};
use super::root::bracketed;
use super::tolerance::Tolerance;
use crate::model::{MAX_SURFACES, System};
use crate::scalar::{Mask, Real, Scalar};
use crate::unroll::{unroll, vector};

/// What can be crossed: the switching surfaces, then the wall.
pub const TARGETS: usize = MAX_SURFACES + 1;
pub const WALL: usize = MAX_SURFACES;

/// The lanes of any target. Unrolled by hand: a fold stays a function without vector instructions.
#[inline(always)]
pub fn union<M: Mask>(masks: &[M; TARGETS]) -> M {
    let mut any = masks[0];
    unroll!(j in 1..TARGETS => { any = any.or(masks[j]); });
    any
}

/// A target's function counts as zero below this part of its largest value in the step.
const ZERO: f64 = 1e-13;
const ON_TARGET: f64 = 1e-12;
/// Below this a surface's function is rounding noise: the system rests on the surface.
const NOISE: f64 = 1e-14;

/// The places at which a step is looked at, and the lanes that are beyond each target at any of them.
pub struct Look<S: Scalar, const D: usize> {
    probes: [[S::Real; D]; MOST_PROBES],
    pub beyond: [S::Mask; TARGETS],
}

/// The states at these parts of a step of size `h`.
pub struct Probes<'a, R: Real, const D: usize> {
    h: R,
    parts: &'static [f64],
    states: &'a [[R; D]; MOST_PROBES],
}

/// Finds the lanes that are beyond each target at any of these places. A function of its own for each law and kind of
/// number, whatever the method.
#[inline(never)]
pub fn beyond<M: System<S, D>, S: Scalar, const D: usize>(
    system: &M,
    at: &StepStart<S, D>,
    wall: bool,
    probes: &Probes<'_, S::Real, D>,
    beyond: &mut [S::Mask; TARGETS],
) {
    // Where there is no target this is not asked.
    if const { M::SMOOTH } {
        return;
    }
    let watch = SurfaceMonitor { system, at, wall, noise: NOISE };
    // The numbers of places, quarters or eighths, known to the compiler, which looks at them side by side.
    match probes.parts.len() {
        4 if const { size_of::<S>() == size_of::<f64>() } => watch.at_places(4, probes, beyond),
        _ if const { size_of::<S>() == size_of::<f64>() } => watch.at_places(MOST_PROBES, probes, beyond),
        places => watch.at_places(places, probes, beyond),
    }
}

/// The same, one target and one place after the other: for laws whose surfaces are long to ask for.
pub fn beyond_in_turn<M: System<S, D>, S: Scalar, const D: usize>(
    system: &M,
    at: &StepStart<S, D>,
    wall: bool,
    probes: &Probes<'_, S::Real, D>,
    beyond: &mut [S::Mask; TARGETS],
) {
    if const { M::SMOOTH } {
        return;
    }
    let watch = SurfaceMonitor { system, at, wall, noise: NOISE };
    for (target, beyond) in beyond.iter_mut().enumerate() {
        if watch.has(target) {
            *beyond = watch.at_target(target, probes.parts.len(), probes);
        }
    }
}

/// What a step does to the targets, lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct Found<R: Real> {
    /// Lanes whose first crossing is of this target.
    pub crossing: [R::Mask; TARGETS],
    /// Lanes that start on this target and leave it to the wrong side.
    pub stale: [R::Mask; TARGETS],
    /// How far after the start of the step the crossing is.
    pub dt: R,
    /// A later place where the sign is wrong on the polynomial.
    pub high: R,
    /// Where the target's function counts as zero.
    pub zero: R,
}

/// A run on the way from one step to the next: what is looked at, and from where.
pub struct SurfaceMonitor<'a, M, S: Scalar, const D: usize> {
    system: &'a M,
    at: &'a StepStart<S, D>,
    wall: bool,
    /// A surface whose function stays below this in a step is left alone: the step's error is larger.
    noise: f64,
}

impl<'a, M, S, const D: usize> SurfaceMonitor<'a, M, S, D>
where
    S: Scalar,
    M: System<S, D>,
{
    /// From here on, with or without a wall.
    #[inline(always)]
    pub fn new(system: &'a M, at: &'a StepStart<S, D>, wall: bool, tolerance: &Tolerance) -> Self {
        Self { system, at, wall, noise: NOISE.max(tolerance.atol) }
    }

    /// Whether there is such a target.
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

    /// The same at `dt` after the start of the method's last trial, on its polynomial.
    #[inline(always)]
    pub fn on(&self, target: usize, method: &dyn Course<S, D>, dt: S::Real) -> S::Real {
        let x = method.real_at(dt, &self.system.watched());
        self.value(target, self.at.t + dt, &vector!(S, D; n => S::lift(x[n])))
    }

    /// Looks at the method's last trial, of size `h`, in these lanes: in most steps there is nothing to find.
    #[inline(always)]
    pub fn look<K: Method<S, D>>(&self, method: &K, h: S::Real, lanes: S::Mask) -> Look<S, D> {
        let probes = method.along(h, K::PROBES, &self.system.watched());
        let mut beyond = [S::mask(false); TARGETS];
        self.system.beyond(self.at, self.wall, &Probes { h, parts: K::PROBES, states: &probes }, &mut beyond);
        for beyond in &mut beyond {
            *beyond = beyond.and(lanes);
        }
        Look { probes, beyond }
    }

    /// The lanes that are beyond each target at any of so many places.
    #[inline(always)]
    fn at_places(&self, places: usize, probes: &Probes<'_, S::Real, D>, beyond: &mut [S::Mask; TARGETS]) {
        // Unrolled, so that each target's function is known.
        unroll!(target in 0..TARGETS => {
            if self.has(target) {
                beyond[target] = self.at_target(target, places, probes);
            }
        });
    }

    /// The lanes that are beyond a target at any of so many places.
    #[inline(always)]
    fn at_target(&self, target: usize, places: usize, probes: &Probes<'_, S::Real, D>) -> S::Mask {
        let parts = &probes.parts[..places];
        let mut any = S::mask(false);
        for i in 0..places {
            let x = vector!(S, D; n => S::lift(probes.states[i][n]));
            let value = self.value(target, self.at.t + probes.h.scale(parts[i]), &x);
            any = any.or(value.less(S::Real::zero()));
        }
        any
    }

    /// The first crossings within the method's last trial, of size `h`, that was looked at in these lanes.
    pub fn find(
        &self,
        method: &dyn Course<S, D>,
        h: S::Real,
        lanes: S::Mask,
        look: &Look<S, D>,
    ) -> Found<S::Real> {
        let never = S::mask(false);
        let infinite = S::Real::constant(f64::INFINITY);
        let zero = S::Real::zero();
        let mut found =
            Found { crossing: [never; TARGETS], stale: [never; TARGETS], dt: infinite, high: infinite, zero };
        let mut earliest = infinite;
        let mut stale = never;
        for target in 0..TARGETS {
            if !self.has(target) || !look.beyond[target].any() {
                continue;
            }
            let on = |dt: S::Real| self.on(target, method, dt);
            let start = self.value(target, self.at.t, &self.at.x);
            let mut scale = start.abs();
            let (mut low, mut high) = ((zero, start), (zero, zero));
            let (mut wrong, mut early) = (never, never);
            for (i, &theta) in method.probes().iter().enumerate() {
                let dt = h.scale(theta);
                let x = vector!(S, D; n => S::lift(look.probes[i][n]));
                let value = self.value(target, self.at.t + dt, &x);
                scale = scale.max(value.abs());
                let new = value.less(zero).and(wrong.not());
                high = pick(new, (dt, value), high);
                wrong = wrong.or(new);
                low = pick(wrong, low, (dt, value));
                if i == 0 {
                    early = new;
                }
            }
            let mut crossing = lanes.and(wrong);
            if target != WALL {
                crossing = crossing.and(scale.less(S::Real::constant(self.noise)).not());
            }
            if !crossing.any() {
                continue;
            }
            let least = scale.scale(ON_TARGET);
            let near = crossing.and(early).and(least.less(start).not());
            if near.any() {
                // On the target: either it goes to the right side for a moment only, or not at all.
                let gone = leaves_and_returns(on, &mut low, &mut high, least, near);
                found.stale[target] = near.and(gone.not()).and(stale.not());
                stale = stale.or(found.stale[target]);
                crossing = crossing.and(near.not().or(gone));
            }
            let tiny = scale.scale(1e-3 * ZERO);
            let dt = bracketed(on, low, high, tiny, crossing);
            let first = crossing.and(dt.abs().less(earliest));
            earliest = S::Real::select(first, dt.abs(), earliest);
            found.dt = S::Real::select(first, dt, found.dt);
            found.high = S::Real::select(first, high.0, found.high);
            found.zero = S::Real::select(first, scale.scale(ZERO), found.zero);
            for j in 0..TARGETS {
                found.crossing[j] = if j == target { first } else { found.crossing[j].and(first.not()) };
            }
        }
        for crossing in &mut found.crossing {
            *crossing = crossing.and(stale.not());
        }
        found
    }
}

#[inline(always)]
fn pick<R: Real>(mask: R::Mask, yes: (R, R), no: (R, R)) -> (R, R) {
    (R::select(mask, yes.0, no.0), R::select(mask, yes.1, no.1))
}

/// Looks ever closer to the start for a point where the function is above `least`, which becomes the
/// low end of the bracket; the high end becomes the last point seen below zero. Returns the lanes that
/// have such a point.
fn leaves_and_returns<R: Real>(
    on: impl Fn(R) -> R,
    low: &mut (R, R),
    high: &mut (R, R),
    least: R,
    lanes: R::Mask,
) -> R::Mask {
    let mut gone = R::mask(false);
    let mut dt = high.0;
    for _ in 0..30 {
        dt = dt.scale(0.5);
        let value = on(dt);
        let open = lanes.and(gone.not());
        let above = open.and(least.less(value));
        *low = pick(above, (dt, value), *low);
        gone = gone.or(above);
        *high = pick(open.and(value.less(R::zero())), (dt, value), *high);
    }
    gone
}

/// Lanes on their way to a target, by steps of corrected size.
#[derive(Clone, Copy, Debug)]
pub struct EventIteration<R: Real> {
    /// The lanes that land on each target.
    pub on: [R::Mask; TARGETS],
    /// The size of the next trial.
    pub size: R,
    /// Brackets: a size that is too short and one that is too long, which is known (`sure`) or only
    /// supposed from the polynomial.
    low: (R, R),
    high: (R, R),
    sure: R::Mask,
    /// The trial before, and the slope of the function over the size.
    last: (R, R),
    slope: R,
    zero: R,
    count: R,
}

/// How trials of landing lanes went.
#[derive(Clone, Copy, Debug)]
pub struct EventStatus<M> {
    /// The step ends on the target.
    pub there: M,
    /// The step, unlike its polynomial, does not cross: it grazes.
    pub grazed: M,
}

impl<R: Real> EventIteration<R> {
    /// No lane is landing.
    pub fn new() -> Self {
        let (zero, never) = (R::zero(), R::mask(false));
        Self {
            on: [never; TARGETS],
            size: zero,
            low: (zero, zero),
            high: (zero, zero),
            sure: never,
            last: (zero, zero),
            slope: zero,
            zero,
            count: zero,
        }
    }

    /// The lanes that are landing.
    #[inline(always)]
    pub fn lanes(&self) -> R::Mask {
        union(&self.on)
    }

    /// Begins for the crossings found; `slope` is the function's on the polynomial.
    pub fn begin(&mut self, found: &Found<R>, lanes: R::Mask, slope: R) {
        let zero = R::zero();
        for j in 0..TARGETS {
            self.on[j] = self.on[j].or(found.crossing[j].and(lanes));
        }
        self.size = R::select(lanes, found.dt, self.size);
        self.low = pick(lanes, (zero, zero), self.low);
        self.high = pick(lanes, (found.high, zero), self.high);
        self.sure = self.sure.and(lanes.not());
        self.slope = R::select(lanes, slope, self.slope);
        self.zero = R::select(lanes, found.zero, self.zero);
        self.count = R::select(lanes, zero, self.count);
    }

    /// Looks at the target's value after a trial of `self.size`, and chooses the next size.
    pub fn judge(&mut self, value: R) -> EventStatus<R::Mask> {
        let zero = R::zero();
        let lanes = self.lanes();
        let size = self.size;
        let probe = self.sure.not().and(size.abs().less(self.high.0.abs()).not());
        let grazed = lanes.and(probe).and(value.less(zero).not());
        let narrow = (self.high.0 - self.low.0).abs();
        let collapsed = self.sure.and(self.high.0.abs().scale(2.0 * f64::EPSILON).less(narrow).not());
        let there = lanes.and(self.zero.less(value.abs()).not().or(collapsed)).and(grazed.not());

        let over = value.less(zero);
        self.low = pick(over, self.low, (size, value));
        self.high = pick(over, (size, value), self.high);
        self.sure = self.sure.or(over);
        self.count += R::one();
        // Newton with the polynomial's slope, then secants.
        let secant = (value - self.last.1) / (size - self.last.0);
        self.slope = R::select(R::one().less(self.count), secant, self.slope);
        let guess = size - value / self.slope;
        self.last = (size, value);
        // Never back in time: a state that noise left beyond its surface would be led there.
        let ahead = zero.less(guess * self.high.0);
        let inside = ahead.and(self.low.0.abs().less(guess.abs())).and(guess.abs().less(self.high.0.abs()));
        let patient = self.count.less(R::constant(8.0));
        let middle = (self.low.0 + self.high.0).scale(0.5);
        let careful = R::select(self.sure, middle, self.high.0);
        self.size = R::select(inside.and(patient), guess, careful);

        let done = there.or(grazed);
        for on in &mut self.on {
            *on = on.and(done.not());
        }
        EventStatus { there, grazed }
    }
}
