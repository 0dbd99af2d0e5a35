//! Landing on switching surfaces and on the wall.
//!
//! A step is taken with the side of every surface frozen. Then [`SurfaceMonitor::find`] looks on the step's
//! polynomial for the first place where a surface's sign contradicts its side. For surfaces that are as slow as the state
//! a few places are enough; [`sign_changes`] decides on all others, and where these places leave it open. A lane that
//! crosses takes its step again up to there, and [`EventIteration`] corrects the step's size until the surface's
//! function is
//! zero; the other lanes go on meanwhile.

use std::cell::Cell;

use super::cancel;
use super::method::{Course, Method};
use super::root::bracketed;
use super::zeros::{Bracket, Curve, Polynomials, Search, resolved, sign_changes, time};
use crate::model::{
    EnclosedSurfaces, MOST_PROBES, Probes, Sides, StepStart, System, TARGETS, Targets, WALL, choose, suspects,
};
use crate::scalar::{Enclosed, Mask, Real, Scalar, vector};
use crate::tolerance::Tolerance;
use crate::unroll::unroll;

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
/// A step with more pieces to look at is cut where they end.
const MOST_PIECES: usize = 1 << 16;
/// After each so many pieces the search asks whether its result is still wanted.
const LOOK_EVERY: usize = 1 << 10;
/// A step that starts on a surface does not cross it by less than its error times this: a body that is let go first moves
/// by less than any error.
const LIFT_OFF: f64 = 10.0;
/// So many places show how far beyond a surface it gets.
const DEPTHS: usize = 16;

/// The places at which a step is looked at, and the lanes that may cross each target.
pub struct Look<S: Scalar, const D: usize> {
    probes: [[S::Real; D]; MOST_PROBES],
    pub suspect: [S::Mask; TARGETS],
}

/// The effect of a step on the targets, lane by lane.
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
    /// The size below which the target's function counts as zero.
    pub zero: R,
    /// As far after the start of the step as there is surely no crossing, in lanes where that is not its end.
    pub cut: R,
}

/// A run on the way from one step to the next: what is looked at, and from where.
pub struct SurfaceMonitor<'a, M, S: Scalar, const D: usize> {
    pub targets: Targets<'a, M, S, D>,
    /// A surface whose function stays below this in a step is left alone: the step's error is larger.
    noise: f64,
    /// The relative error of a step.
    rtol: f64,
}

impl<'a, M, S, const D: usize> SurfaceMonitor<'a, M, S, D>
where
    S: Scalar,
    M: System<S, D>,
{
    /// From here on, with or without a wall.
    #[inline(always)]
    pub fn new(system: &'a M, at: &'a StepStart<S, D>, wall: bool, tolerance: &Tolerance) -> Self {
        let targets = Targets { system, at, wall };
        Self { targets, noise: NOISE.max(tolerance.atol), rtol: tolerance.rtol }
    }

    /// The target's function at `dt` after the start of the method's last trial, on its polynomial.
    #[inline(always)]
    pub fn on(&self, target: usize, method: &dyn Course<S, D>, dt: S::Real) -> S::Real {
        let x = method.real_at(dt, &self.targets.system.watched());
        self.targets.value(target, self.targets.at.t + dt, &vector!(S, D; n => S::lift(x[n])))
    }

    /// Looks at the method's last trial, of size `h`, in these lanes: most steps cross no target.
    #[inline(always)]
    pub fn look<K: Method<S, D>>(&self, method: &K, h: S::Real, lanes: S::Mask) -> Look<S, D> {
        let probes = method.along(h, K::PROBES, &self.targets.system.watched());
        let mut suspect = [S::mask(false); TARGETS];
        let places = Probes { h, parts: K::PROBES, states: &probes };
        suspects(&self.targets, &places, &mut suspect);
        for suspect in &mut suspect {
            *suspect = suspect.and(lanes);
        }
        Look { probes, suspect }
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
        let mut found = Found {
            crossing: [never; TARGETS],
            stale: [never; TARGETS],
            dt: infinite,
            high: infinite,
            zero,
            cut: infinite,
        };
        let mut earliest = infinite;
        let mut stale = never;
        for target in 0..TARGETS {
            if !self.targets.has(target) || !look.suspect[target].any() {
                continue;
            }
            let on = |dt: S::Real| self.on(target, method, dt);
            let start = self.targets.value(target, self.targets.at.t, &self.targets.at.x);
            let mut scale = magnitude(start);
            let (mut low, mut high) = ((zero, start), (zero, zero));
            let (mut wrong, mut early) = (never, never);
            let probes = Probes { h, parts: method.probes(), states: &look.probes };
            let along = self.targets.along(target, &probes);
            let mut values = [start; MOST_PROBES + 1];
            for (i, &theta) in probes.parts.iter().enumerate() {
                let (dt, value) = (h.scale(theta), along[i]);
                scale = scale.max(magnitude(value));
                values[i + 1] = value;
                let new = value.less(zero).and(wrong.not());
                high = pick(new, (dt, value), high);
                wrong = wrong.or(new);
                low = pick(wrong, low, (dt, value));
                if i == 0 {
                    early = new;
                }
            }
            let steady = self.targets.is_steady(target);
            let least = S::Real::constant(if target == WALL { 0.0 } else { self.noise });
            let open = lanes.and(look.suspect[target]);
            let values = &values[..=method.probes().len()];
            for lane in open.lanes() {
                let shown = |value: &S::Real| value.lane(lane);
                let mut own = [0.0; MOST_PROBES + 1];
                own.iter_mut().zip(values).for_each(|(own, value)| *own = shown(value));
                let quiet = || scale.lane(lane) < least.lane(lane);
                if steady && (quiet() || resolved(&own[..values.len()])) {
                    continue;
                }
                let only = S::Mask::from_lanes(|i| i == lane);
                let ends = (shown(&start), shown(&values[values.len() - 1]));
                // The largest value of a fast function may lie between the places.
                let most = Cell::new(scale.lane(lane));
                let located = self.first_crossing(target, method, (h, lane), ends, &most);
                scale.set_lane(lane, most.get());
                match located {
                    Located::Between(from, to) => {
                        let lift =
                            |(dt, value): (f64, f64)| (S::Real::constant(dt), S::Real::constant(value));
                        low = pick(only, lift(from), low);
                        high = pick(only, lift(to), high);
                        wrong = wrong.or(only);
                        early = choose(only, S::mask(from.0 == 0.0), early);
                    }
                    Located::Nowhere => wrong = wrong.and(only.not()),
                    Located::Unknown => {}
                    Located::Before(dt) => {
                        let nearer = S::Real::constant(dt);
                        let nearer = S::Real::select(nearer.abs().less(found.cut.abs()), nearer, found.cut);
                        found.cut = S::Real::select(only, nearer, found.cut);
                    }
                }
            }
            let mut crossing = open.and(wrong).and(scale.less(least).not());
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
            let limited = |(dt, value)| (dt, bounded(value));
            let dt = bracketed(|dt| bounded(on(dt)), limited(low), limited(high), tiny, crossing);
            let first = crossing.and(dt.abs().less(earliest));
            earliest = S::Real::select(first, dt.abs(), earliest);
            found.dt = S::Real::select(first, dt, found.dt);
            found.high = S::Real::select(first, high.0, found.high);
            found.zero = S::Real::select(first, scale.scale(ZERO), found.zero);
            for j in 0..TARGETS {
                found.crossing[j] = if j == target { first } else { found.crossing[j].and(first.not()) };
            }
        }
        let late = found.cut.abs().less(found.dt.abs());
        for crossing in &mut found.crossing {
            *crossing = crossing.and(stale.not()).and(late.not());
        }
        found
    }

    /// Looks for the first crossing of a target in a lane, from these values at the start and at the end of the step.
    #[inline(never)]
    fn first_crossing(
        &self,
        target: usize,
        method: &dyn Course<S, D>,
        (h, lane): (S::Real, usize),
        (first, last): (f64, f64),
        most: &Cell<f64>,
    ) -> Located {
        let Some(laws) = self.targets.system.enclosing(lane) else { return Located::Unknown };
        let mut coefficients = Vec::new();
        let unit = method.polynomial(&mut coefficients).lane(lane);
        let size = h.lane(lane);
        let coefficient = |n: usize, k: usize| coefficients[k][n].real().lane(lane);
        let mut curve = TargetCurve {
            monitor: self,
            method,
            target,
            lane,
            step: (self.targets.at.t.lane(lane), size),
            most,
            polynomials: Polynomials::new(coefficients.len(), size / unit, coefficient),
            laws,
            sides: self.targets.at.sides.map(|side| Enclosed::mask(side.lane(lane))),
        };
        let start = Some((0.0, first, false));
        // How deep it gets beyond the surface between these parts of the step.
        let depth = |from: f64, to: f64| {
            let places = (1..DEPTHS).map(|i| from + (to - from) * i as f64 / DEPTHS as f64);
            let value = |s: f64| self.on(target, method, S::Real::constant(s * size)).lane(lane);
            places.map(|s| -value(s)).fold(0.0, f64::max)
        };
        let error = || LIFT_OFF * (self.noise + self.rtol * most.get());
        let (mut located, mut doubtful) = (Located::Nowhere, None);
        let between = |Bracket { low, high }| {
            let place = |(s, value): (f64, f64)| {
                // From an end without a number the search begins in the middle.
                (s * size, if value.is_nan() { -high.1 } else { value })
            };
            Located::Between(place(low), place(high))
        };
        let patient = |pieces: usize| {
            pieces <= MOST_PIECES && !(pieces.is_multiple_of(LOOK_EVERY) && cancel::is_asked())
        };
        let far = sign_changes(&mut curve, start, (first, last), &patient, &mut |bracket| {
            match doubtful.take() {
                // Back from where the start led.
                Some(before) if depth(0.0, bracket.high.0) > error() => located = between(before),
                Some(_) => return Search::Next,
                None if first.abs() <= error() && bracket.low.0 == 0.0 => {
                    doubtful = Some(bracket);
                    return Search::Next;
                }
                None => located = between(bracket),
            }
            Search::Enough
        });
        if let Some(bracket) = doubtful {
            located = between(bracket);
        }
        match located {
            Located::Nowhere if far < 1.0 => Located::Before(far * size),
            located => located,
        }
    }
}

/// The place at which a lane first crosses a target.
enum Located {
    Unknown,
    Nowhere,
    /// Times after the start of the step, and the values there.
    Between((f64, f64), (f64, f64)),
    /// Not before this time; how it goes on is not known.
    Before(f64),
}

/// A target's function along a lane's step, positive on the side that the law is frozen on.
struct TargetCurve<'a, M, S: Scalar, const D: usize> {
    monitor: &'a SurfaceMonitor<'a, M, S, D>,
    method: &'a dyn Course<S, D>,
    target: usize,
    lane: usize,
    /// When it begins and how long it is.
    step: (f64, f64),
    /// The largest value so far.
    most: &'a Cell<f64>,
    polynomials: Polynomials<D>,
    laws: Box<dyn EnclosedSurfaces<D> + 'a>,
    sides: Sides<Enclosed>,
}

impl<M: System<S, D>, S: Scalar, const D: usize> Curve for TargetCurve<'_, M, S, D> {
    fn value(&mut self, s: f64) -> f64 {
        let dt = S::Real::constant(s * self.step.1);
        let value = self.monitor.on(self.target, self.method, dt).lane(self.lane);
        self.most.set(self.most.get().max(magnitude(value)));
        value
    }

    fn enclose(&mut self, a: f64, b: f64) -> Enclosed {
        let x = vector!(Enclosed, D; n => self.polynomials.enclose(n, a, b));
        if self.target == WALL {
            return self.laws.enclosed_wall(&x).unwrap_or(Enclosed::one());
        }
        let value =
            self.laws.enclosed_surface(self.target, time(self.step.0, self.step.1, a, b), &x, &self.sides);
        Enclosed::select(self.sides[self.target], value, -value)
    }
}

/// The size of a value that others are compared with: an infinite value counts as 1, and what is no number as 0.
#[inline(always)]
fn magnitude<R: Real>(value: R) -> R {
    let size = value.abs();
    R::select(size.finite(), size, R::select(R::zero().less(size), R::one(), R::zero()))
}

/// The value, or 1 or -1 if it is infinite: then its sign is all that counts.
#[inline(always)]
fn bounded<R: Real>(value: R) -> R {
    let sign = R::one().zip(value, f64::copysign);
    R::select(value.abs().less(R::constant(f64::INFINITY)).or(is_nan(value)), value, sign)
}

#[inline(always)]
fn is_nan<R: Real>(value: R) -> R::Mask {
    R::zero().less(value.abs()).or(value.abs().less(R::one())).not()
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
        let (zero, value) = (R::zero(), bounded(value));
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
