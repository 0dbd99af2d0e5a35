//! The one stepping loop.

use super::cancel;
use super::event_location::{EventIteration, EventStatus, Look, SurfaceMonitor, union};
use super::method::{Course, Method, Trial};
use super::runge_kutta::Dopri5;
use super::saltation::pass;
use super::step_size::{PiController, initial_step};
use crate::failure::Failure;
use crate::model::{AnySystem, MAX_SURFACES, Sides, StepStart, System, TARGETS, WALL, choose, sides_of};
use crate::scalar::{self, InstructionSet, Isa, Mask, Real, Scalar, vector};
use crate::tolerance::{ErrorNorm, Tolerance};
use crate::unroll::unroll;

/// The work, summed over the lanes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Steps accepted.
    pub accepted: u64,
    /// Trial steps rejected for their error.
    pub rejected: u64,
    /// Evaluations of the rates.
    pub evaluations: u64,
    /// Jumps of the law that the run only just reached: its derivatives are in doubt.
    pub grazes: u64,
}

/// More jumps of the law than this while time moves on by less than the part `STILL` of the run chatter.
const MOST_JUMPS: f64 = 100.0;
const STILL: f64 = 1e-9;

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

impl Ending {
    /// On the first of the targets that were crossed.
    #[inline]
    fn of(crossed: &[bool; TARGETS]) -> Self {
        match crossed.iter().position(|&crossed| crossed) {
            Some(WALL) => Ending::Wall,
            Some(j) => Ending::Surface(j),
            None => Ending::Free,
        }
    }
}

/// The result of one trial step of a single run.
enum Attempted {
    Moved,
    Failed,
    Rejected,
}

/// The result of one trial step, lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct Progress<M> {
    /// Lanes that took a step, be it one of no length onto the surface that they are on.
    pub moved: M,
    /// Those of them that ended on each target: the switching surfaces, then the wall.
    pub crossed: [M; TARGETS],
    /// Lanes that cannot go on.
    pub failed: M,
}

impl<M: Mask> Progress<M> {
    /// Lanes that ended on a switching surface or on the wall.
    #[inline(always)]
    pub fn switched(&self) -> M {
        union(&self.crossed)
    }

    /// Lanes that ended on the wall.
    pub fn walled(&self) -> M {
        self.crossed[WALL]
    }
}

/// A run in progress, or one in each lane: every [`trial`](Integrator::trial) tries a step in all of them.
///
/// Lanes have their own time, step size and fate. Between steps the law is smooth: a step ends on the
/// first switching surface it meets, to 1e-12 of the surface function's size in the step, and the next
/// one starts on the other side. Everything derived from a run (samples, events, tangents, sections,
/// exponents) is built on this loop.
pub struct Integrator<M, S: Scalar, const D: usize, E = Tolerance, K = Dopri5<S, D>> {
    system: M,
    method: K,
    norm: E,
    controller: PiController<S::Real>,
    run: Run<S, D>,
}

/// The state of a run. Its rare work is compiled once for each kind of number.
struct Run<S: Scalar, const D: usize> {
    /// True if lanes end on the wall.
    wall: bool,
    at: StepStart<S, D>,
    /// The size of the next trial step, of the sign of the direction.
    h: S::Real,
    /// The last accepted step: its start and its size.
    from: S::Real,
    size: S::Real,
    landing: EventIteration<S::Real>,
    /// Sides changed since time last moved on.
    flips: S::Real,
    /// When the run began.
    start: S::Real,
    /// The number of jumps of the law, and the time since which they count.
    jumps: (S::Real, S::Real),
    /// The state is on a surface to within rounding, which leaves its side open.
    undecided: S::Mask,
    work: Work<S::Real>,
}

/// The work lane by lane: steps accepted and rejected, trials, and evaluations outside of trials.
#[derive(Clone, Copy, Debug)]
struct Work<R> {
    accepted: R,
    rejected: R,
    trials: R,
    beside: R,
    grazes: R,
}

impl<M, S, const D: usize, E, K> Integrator<M, S, D, E, K>
where
    S: Scalar,
    M: System<S, D>,
    E: ErrorNorm<S, D> + Copy,
    K: Method<S, D>,
{
    /// Starts at time `t` and state `x`. The size and the direction of the first trial step are those
    /// of `h` where given; otherwise the size is estimated and the direction is forward.
    pub fn new(system: M, t: S::Real, x: [S; D], h: Option<S::Real>, norm: &E) -> Self
    where
        K: Default,
    {
        Self::by(K::default(), system, t, x, h, norm)
    }

    /// The same by a method made beforehand.
    pub fn by(method: K, system: M, t: S::Real, x: [S; D], h: Option<S::Real>, norm: &E) -> Self {
        let run = Run::new(&system, t, x);
        let mut integrator =
            Self { system, method, norm: *norm, controller: PiController::new(K::ORDER), run };
        // Packets are only short with their own instructions.
        if const { S::Real::LANES > 1 } {
            S::Real::work(Isa::Baseline, Begin { integrator: &mut integrator, t, x, h });
        } else {
            integrator.start(S::mask(true), t, x, h);
        }
        integrator
    }

    /// Ends runs on the model's wall, where it has one.
    pub fn with_wall(mut self) -> Self {
        self.run.wall = self.system.wall(&self.run.at.x).is_some();
        self
    }

    /// Restarts these lanes, as [`new`](Integrator::new) does.
    #[inline(always)]
    pub fn start(&mut self, lanes: S::Mask, t: S::Real, x: [S; D], h: Option<S::Real>) {
        let run = &mut self.run;
        run.at.t = S::Real::select(lanes, t, run.at.t);
        run.at.x = vector!(S, D; n => S::select(lanes, x[n], run.at.x[n]));
        run.from = S::Real::select(lanes, t, run.from);
        run.size = S::Real::select(lanes, S::Real::zero(), run.size);
        // A series knows how far it reaches.
        let h = if K::SERIES { Some(h.unwrap_or(S::Real::constant(f64::INFINITY))) } else { h };
        match h {
            Some(h) if const { M::SMOOTH && K::SERIES } => run.h = S::Real::select(lanes, h, run.h),
            h => {
                let first = FirstStep { lanes, t, h, order: K::ORDER, tolerance: self.norm.state() };
                match const { S::Real::LANES > 1 } {
                    true => run.find_start(&self.system, first),
                    false => run.find_start(&(&self.system as &dyn AnySystem<S, D>), first),
                }
                self.controller.reset(lanes);
            }
        }
        self.begin(lanes);
    }

    /// The work so far.
    pub fn counts(&self) -> Counts {
        let sum = |count: S::Real| {
            let mut all = 0;
            for i in 0..S::Real::LANES {
                all += count.lane(i) as u64;
            }
            all
        };
        let Work { accepted, rejected, trials, beside, grazes } = self.run.work;
        let evaluations = trials.scale(K::EVALUATIONS as f64) + beside;
        Counts {
            accepted: sum(accepted),
            rejected: sum(rejected),
            evaluations: sum(evaluations),
            grazes: sum(grazes),
        }
    }

    /// Continues with another system, to whose parameters these values belong. [Start](Integrator::start) lanes again
    /// if their parameters change.
    #[inline(always)]
    pub fn set_system(&mut self, system: M, values: &[S]) {
        self.system = system;
        self.method.set_parameters(values);
    }

    /// What is integrated.
    #[inline(always)]
    pub fn system(&self) -> &M {
        &self.system
    }

    /// The time reached.
    #[inline(always)]
    pub fn t(&self) -> S::Real {
        self.run.at.t
    }

    /// The state reached.
    #[inline(always)]
    pub fn x(&self) -> &[S; D] {
        &self.run.at.x
    }

    /// The sides that the law is taken on.
    #[inline(always)]
    pub fn sides(&self) -> &Sides<S> {
        &self.run.at.sides
    }

    /// The size of the next trial step.
    #[inline(always)]
    pub fn h(&self) -> S::Real {
        self.run.h
    }

    /// The time at which the last accepted step began.
    #[inline(always)]
    pub fn from(&self) -> S::Real {
        self.run.from
    }

    /// The last accepted step's size (times are rounded, sizes are not).
    #[inline(always)]
    pub fn size(&self) -> S::Real {
        self.run.size
    }

    /// The state at `dt` after the start of the last accepted step, on its polynomial; in lanes that moved
    /// in the last trial.
    #[inline(always)]
    pub fn dense(&self, dt: S::Real) -> [S; D] {
        self.method.at(dt)
    }

    /// The method, whose polynomial is that of the last trial.
    pub fn method(&self) -> &K {
        &self.method
    }

    /// Goes on from another state at the same time, as when tangents are scaled back.
    #[inline(always)]
    pub fn set_state(&mut self, lanes: S::Mask, x: [S; D]) {
        let at = &mut self.run.at;
        at.x = vector!(S, D; n => S::select(lanes, x[n], at.x[n]));
        self.begin(lanes);
    }

    /// Tries a step in every lane that is not at its `end`, at most up to there; a lane that gets there
    /// reaches it exactly.
    #[inline(always)]
    pub fn trial(&mut self, end: S::Real) -> Progress<S::Mask> {
        // Laws with measured inputs do not go in packets.
        if const { M::SMOOTH || S::Real::LANES > 1 } {
            return self.trial_within(end);
        }
        let at = &self.run.at;
        // At most up to the next knot of the law's inputs, behind which the next step feels the next pieces.
        let knot = self.system.clock().and_then(|clock| {
            self.system.next_knot(at.t, &at.sides, end).map(|knot| (clock, S::Real::constant(knot)))
        });
        let progress = self.trial_within(knot.map_or(end, |(_, knot)| knot));
        if let Some((clock, knot)) = knot
            && is_zero(knot - self.run.at.t).any()
        {
            self.run.pass_knot((&self.system, &mut self.method), clock);
        }
        progress
    }

    /// The same as a function of its own, which all share who follow single runs: in their loops the compiler makes slower
    /// code of it.
    #[inline(never)]
    pub fn trial_apart(&mut self, end: S::Real) -> Progress<S::Mask> {
        self.trial(end)
    }

    #[inline(always)]
    fn trial_within(&mut self, end: S::Real) -> Progress<S::Mask> {
        let run = &mut self.run;
        let remaining = end - run.at.t;
        // An end that is not a number leaves its lane active, to fail.
        let active = is_zero(remaining).not();
        let targets = !M::SMOOTH && (run.wall || self.system.surfaces() > 0);
        let landing = if targets { run.landing.lanes() } else { S::mask(false) };

        let longest = self.norm.state().max_step;
        if longest < f64::INFINITY {
            run.limit(longest);
        }
        let cut = run.h.abs().scale(1.01).less(remaining.abs()).not();
        let mut h = S::Real::select(cut, remaining, run.h);
        let mut last = cut;
        if targets {
            // A short step leads away from a surface that rounding does not let go of.
            h = S::Real::select(run.undecided, h.scale(0.1), h);
            h = S::Real::select(landing, run.landing.size, h);
            last = cut.and(run.undecided.or(landing).not());
        }
        let asked = S::Real::select(active, h, S::Real::zero());
        let trial = self.method.attempt(&self.system, &run.at, asked, &self.norm);
        self.method.extend(&self.system, &run.at);
        run.work.trials = tick(active, run.work.trials, 1.0);

        let judged = active.and(landing.not());
        // A series gives its own step size: one step says nothing about the next.
        let (good, factor) = match K::SERIES {
            true => (trial.error.finite(), S::Real::one()),
            false => self.controller.judge(trial.error, judged),
        };
        let accepted = judged.and(good);
        let rejected = judged.and(good.not());
        last = last.and(accepted);
        let mut failed = S::mask(false);
        if K::SERIES {
            last = last.and(trial.size.abs().less(asked.abs()).not());
            let (t, next) = (run.at.t, run.at.t + trial.size);
            failed = rejected.or(accepted.and(t.less(next).or(next.less(t)).not()));
        } else {
            // A step cut short at the end says little about a long one.
            let next = asked * factor;
            let kept = next.abs().max(run.h.abs()).zip(asked, f64::copysign);
            let next = S::Real::select(cut.and(good), kept, next);
            run.h = S::Real::select(judged, next, run.h);
            if rejected.any() {
                failed = rejected.and(S::Mask::from_lanes(|i| {
                    let (t, h) = (run.at.t.lane(i), run.h.lane(i));
                    // A size that is not a number, as towards an end that is none, would never shrink.
                    t + h == t || h.abs() < 1e-100 || !h.is_finite()
                }));
            }
        }
        if rejected.any() {
            run.work.rejected = tick(rejected, run.work.rejected, 1.0);
        }

        let mut progress =
            Progress { moved: accepted.and(failed.not()), crossed: [S::mask(false); TARGETS], failed };
        if const { !M::SMOOTH } && targets {
            let lanes = progress.moved.and(run.undecided.not());
            let watch = SurfaceMonitor::new(&self.system, &run.at, run.wall, self.norm.state());
            let look = watch.look(&self.method, trial.size, lanes);
            if union(&look.suspect).or(landing).or(run.undecided).any() {
                let accepted = progress.moved;
                let (method, norm): (&mut dyn Course<S, D>, _) = (&mut self.method, self.norm.state());
                let (looked, ends) = ((accepted, &look, landing), (end, last));
                // Single runs land often enough to know whose surfaces they are.
                if const { size_of::<S>() == size_of::<f64>() } {
                    run.on_surfaces(
                        (&self.system, method),
                        norm,
                        &trial,
                        looked,
                        factor,
                        ends,
                        &mut progress,
                    );
                } else {
                    let law: &dyn AnySystem<S, D> = &self.system;
                    run.on_surfaces((&law, method), norm, &trial, looked, factor, ends, &mut progress);
                }
                return progress;
            }
        }
        run.commit(M::SMOOTH, &trial, progress.moved, (end, last));
        self.method.begin_next(progress.moved);
        progress
    }

    #[inline(always)]
    fn begin(&mut self, lanes: S::Mask) {
        self.method.begin(&self.system, &self.run.at, lanes);
        self.run.work.beside = tick(lanes, self.run.work.beside, 1.0);
    }
}

impl<S: Scalar, const D: usize> Run<S, D> {
    fn new(system: &impl System<S, D>, t: S::Real, x: [S; D]) -> Self {
        let zero = S::Real::zero();
        let sides = match const { S::Real::LANES > 1 } {
            true => sides_of(system, S::lift(t), &x),
            false => sides_of(&(system as &dyn AnySystem<S, D>), S::lift(t), &x),
        };
        Self {
            wall: false,
            at: StepStart { t, x, sides },
            h: zero,
            from: t,
            size: zero,
            landing: EventIteration::new(),
            flips: zero,
            start: t,
            jumps: (zero, t),
            undecided: S::mask(false),
            work: Work { accepted: zero, rejected: zero, trials: zero, beside: zero, grazes: zero },
        }
    }

    /// Finds the sides of the law and the size of the first step; packets do so by their own instructions.
    #[inline(never)]
    fn find_start(&mut self, system: &impl System<S, D>, first: FirstStep<'_, S>) {
        if const { S::Real::LANES > 1 } {
            S::Real::work(Isa::Baseline, Starting { run: self, system, first });
        } else {
            self.start_on_sides(system, first);
        }
    }

    #[inline(always)]
    fn start_on_sides(&mut self, system: &impl System<S, D>, first: FirstStep<'_, S>) {
        let FirstStep { lanes, t, h, order, tolerance } = first;
        let mut fresh = self.at;
        fresh.sides = sides_of(system, S::lift(fresh.t), &fresh.x);
        // Not by a closure, which would be a function of its own.
        let h = match h {
            Some(h) => h,
            None => {
                self.work.beside = tick(lanes, self.work.beside, 2.0);
                initial_step(system, &fresh, order, tolerance)
            }
        };
        start_sides(system, &mut fresh, h);
        self.take_sides(lanes, &fresh.sides);
        self.h = S::Real::select(lanes, h, self.h);
        self.flips = S::Real::select(lanes, S::Real::zero(), self.flips);
        self.start = S::Real::select(lanes, t, self.start);
        self.jumps.0 = S::Real::select(lanes, S::Real::zero(), self.jumps.0);
        self.jumps.1 = S::Real::select(lanes, t, self.jumps.1);
        self.undecided = self.undecided.and(lanes.not());
        for on in &mut self.landing.on {
            *on = on.and(lanes.not());
        }
    }

    /// Makes the next trial no longer than this.
    #[cold]
    #[inline(never)]
    fn limit(&mut self, longest: f64) {
        // The last step of a run takes up to 1 % more.
        self.h = self.h.abs().min(S::Real::constant(longest / 1.01)).zip(self.h, f64::copysign);
    }

    /// Takes the law on these sides, in these lanes.
    #[inline(always)]
    fn take_sides(&mut self, lanes: S::Mask, sides: &Sides<S>) {
        for j in 0..MAX_SURFACES {
            self.at.sides[j] = choose(lanes, sides[j], self.at.sides[j]);
        }
    }

    /// Commits the trial where it crosses no target, and deals with the lanes where it does.
    fn on_surfaces<M: System<S, D>>(
        &mut self,
        (law, method): (&M, &mut dyn Course<S, D>),
        tolerance: &Tolerance,
        trial: &Trial<S, D>,
        (accepted, look, landing): (S::Mask, &Look<S, D>, S::Mask),
        factor: S::Real,
        (end, last): (S::Real, S::Mask),
        progress: &mut Progress<S::Mask>,
    ) {
        let never = S::mask(false);
        let at = self.at;
        let watch = SurfaceMonitor::new(law, &at, self.wall, tolerance);
        let leaving = accepted.and(self.undecided);
        let found = watch.find(method, trial.size, accepted.and(leaving.not()), look);
        let crossing = union(&found.crossing);
        let stale = union(&found.stale);
        let mut clear = accepted.and(crossing.or(stale).not());
        let mut trial = *trial;
        let mut last = last;
        let cut = clear.and(found.cut.finite());
        if cut.any() {
            if cancel::is_asked() {
                progress.moved = never;
                return;
            }
            // A step cannot be shorter than the time's rounding.
            let next = at.t + found.cut;
            let still = cut.and(at.t.less(next).or(next.less(at.t)).not());
            progress.failed = progress.failed.or(still);
            clear = clear.and(still.not());
            // The rest of the step has not been searched.
            if method.series() {
                let x = method.at(found.cut);
                trial.x = vector!(S, D; n => S::select(cut, x[n], trial.x[n]));
                trial.size = S::Real::select(cut, found.cut, trial.size);
                last = last.and(cut.not());
            } else {
                clear = clear.and(cut.not());
                self.h = S::Real::select(cut, found.cut, self.h);
            }
        }
        let mut crossed = [never; TARGETS];
        let mut landed = EventStatus { there: never, grazed: never };

        if landing.any() {
            // Landing lanes need the value of their own target.
            let mut value = S::Real::zero();
            for target in 0..TARGETS {
                if !self.landing.on[target].any() {
                    continue;
                }
                let own = watch.targets.value(target, self.at.t + trial.size, &trial.x);
                value = S::Real::select(self.landing.on[target], own, value);
            }
            let on = self.landing.on;
            landed = self.landing.judge(value);
            // Below the normal numbers a bracket cannot be halved for ever.
            let tiny = landing.and(trial.size.abs().less(S::Real::constant(f64::MIN_POSITIVE)));
            landed.there = landed.there.or(tiny.and(landed.grazed.not()));
            for on in &mut self.landing.on {
                *on = on.and(tiny.not());
            }
            for j in 0..TARGETS {
                crossed[j] = on[j].and(landed.there);
            }
        }
        if crossing.any() {
            if method.series() {
                // The polynomial is as good as the step: it may end there.
                let x = method.at(found.dt);
                trial.x = vector!(S, D; n => S::select(crossing, x[n], trial.x[n]));
                trial.size = S::Real::select(crossing, found.dt, trial.size);
                for j in 0..TARGETS {
                    crossed[j] = crossed[j].or(found.crossing[j]);
                }
                landed.there = landed.there.or(crossing);
            } else {
                let mut slope = S::Real::zero();
                let ahead = trial.size.scale(1e-4);
                for target in 0..TARGETS {
                    if !found.crossing[target].any() {
                        continue;
                    }
                    let on = |dt: S::Real| watch.on(target, method, dt);
                    let own = (on(found.dt + ahead) - on(found.dt - ahead)) / (ahead + ahead);
                    slope = S::Real::select(found.crossing[target], own, slope);
                }
                self.landing.begin(&found, crossing, slope);
            }
        }

        let moved = clear.or(landed.there).or(landed.grazed);
        let fresh = is_zero(self.size).not();
        let unflipped = self.flips.less(S::Real::one());
        self.commit(false, &trial, moved, (end, last.and(clear)));
        method.begin_next(moved);
        progress.moved = moved;

        if leaving.any() {
            // All laws are continuous: on the surface both sides are the same to rounding.
            let longer = trial.size * factor.max(S::Real::one()).scale(10.0);
            self.h = S::Real::select(leaving, longer, self.h);
            self.undecided = self.undecided.and(leaving.not());
            let sides = sides_of(law, S::lift(self.at.t), &self.at.x);
            self.take_sides(leaving, &sides);
            self.begin((law, &mut *method), leaving);
        }
        if stale.any() {
            // The last step becomes one of no length.
            self.from = S::Real::select(stale, self.at.t, self.from);
            self.size = S::Real::select(stale, S::Real::zero(), self.size);
        }
        for target in 0..TARGETS {
            let crossed = crossed[target];
            let over = crossed.or(found.stale[target]);
            if !over.any() {
                continue;
            }
            let before = self.at.sides;
            let turned = self.cross((law, &mut *method), target, over, end);
            let told = found.stale[target].and(if target == WALL { stale } else { fresh.and(unflipped) });
            progress.moved = progress.moved.or(told);
            let mut seen = crossed.or(told).and(turned);
            if target != WALL && law.jumps(target) {
                // The side after the switch, such as a contact that sticks, says more than the side before.
                for j in (0..law.surfaces()).rev() {
                    let changed =
                        before[j].and(self.at.sides[j].not()).or(self.at.sides[j].and(before[j].not()));
                    progress.crossed[j] = progress.crossed[j].or(seen.and(changed));
                    seen = seen.and(changed.not());
                }
                progress.failed = progress.failed.or(self.chatters());
            }
            progress.crossed[target] = progress.crossed[target].or(seen);
        }
    }

    #[inline(always)]
    fn commit(&mut self, smooth: bool, trial: &Trial<S, D>, lanes: S::Mask, (end, last): (S::Real, S::Mask)) {
        let mut t = S::Real::select(last, end, self.at.t + trial.size);
        if !smooth {
            let elapsed = lanes.and(is_zero(t - self.at.t).not());
            self.flips = S::Real::select(elapsed, S::Real::zero(), self.flips);
        }
        let (mut from, mut size, mut x) = (self.at.t, trial.size, trial.x);
        // Without the question these are stores to some lanes, which AMD's processors take long for.
        if lanes.not().any() {
            from = S::Real::select(lanes, from, self.from);
            size = S::Real::select(lanes, size, self.size);
            t = S::Real::select(lanes, t, self.at.t);
            unroll!(n in 0..D => { x[n] = S::select(lanes, x[n], self.at.x[n]); });
        }
        (self.from, self.size) = (from, size);
        (self.at.t, self.at.x) = (t, x);
        self.work.accepted = tick(lanes, self.work.accepted, 1.0);
    }

    /// Changes the side of the target that these lanes are on; returns those where it did.
    fn cross(
        &mut self,
        (law, method): (&dyn AnySystem<S, D>, &mut dyn Course<S, D>),
        target: usize,
        lanes: S::Mask,
        end: S::Real,
    ) -> S::Mask {
        if target == WALL {
            return lanes;
        }
        self.flips = S::Real::select(lanes, self.flips + S::Real::one(), self.flips);
        let mut turned = lanes;
        if law.jumps(target) {
            // More of them in almost no time are no motion.
            let span = (end - self.start).abs().scale(STILL);
            let moved = lanes.and(span.less((self.at.t - self.jumps.1).abs()));
            self.jumps.1 = S::Real::select(moved, self.at.t, self.jumps.1);
            self.jumps.0 = S::Real::select(moved, S::Real::zero(), self.jumps.0);
            self.jumps.0 = S::Real::select(lanes, self.jumps.0 + S::Real::one(), self.jumps.0);
        } else {
            let stuck = lanes.and(S::Real::constant(2.0 * MAX_SURFACES as f64).less(self.flips));
            self.undecided = self.undecided.or(stuck);
            self.flips = S::Real::select(stuck, S::Real::zero(), self.flips);
            turned = lanes.and(stuck.not());
        }
        let StepStart { t, x, sides } = &mut self.at;
        let grazes = pass(&law, target, *t, self.size, x, sides, turned);
        self.work.grazes = tick(grazes, self.work.grazes, 1.0);
        self.begin((law, method), turned);
        turned
    }

    /// Passes the knot of an input, at which the run stands.
    #[inline(never)]
    fn pass_knot(&mut self, (law, method): (&dyn AnySystem<S, D>, &mut dyn Course<S, D>), clock: usize) {
        let everywhere = S::mask(true);
        let StepStart { t, x, sides } = &mut self.at;
        pass(&law, clock, *t, self.size, x, sides, everywhere);
        self.begin((law, method), everywhere);
    }

    /// Lanes where the law switches again and again while time stands still.
    fn chatters(&self) -> S::Mask {
        S::Real::constant(MOST_JUMPS).less(self.jumps.0)
    }

    fn begin(&mut self, (law, method): (&dyn AnySystem<S, D>, &mut dyn Course<S, D>), lanes: S::Mask) {
        method.begin(law, &self.at, lanes);
        self.work.beside = tick(lanes, self.work.beside, 1.0);
    }

    /// Why a lane cannot go on, by a method that takes steps of any size or by series.
    fn failure_of(&self, law: &dyn AnySystem<S, D>, series: bool, lane: usize) -> Failure {
        let t = self.at.t.lane(lane);
        if self.chatters().lane(lane) {
            return Failure::Chattering { t };
        }
        let rate = law.rates(S::lift(self.at.t), &self.at.x, &self.at.sides);
        let mut finite = series || self.h.lane(lane).is_finite();
        for n in 0..D {
            finite &= self.at.x[n].real().lane(lane).is_finite() && rate[n].real().lane(lane).is_finite();
        }
        match finite {
            true if series => Failure::NoSeries { t },
            true => Failure::StepUnderflow { t },
            false => Failure::NotFinite { t },
        }
    }
}

/// How runs start in some lanes: the size of the first step is found for a method of this order where it is not given.
struct FirstStep<'a, S: Scalar> {
    lanes: S::Mask,
    t: S::Real,
    h: Option<S::Real>,
    order: i32,
    tolerance: &'a Tolerance,
}

/// The start in all lanes.
struct Begin<'a, M, S: Scalar, const D: usize, E, K> {
    integrator: &'a mut Integrator<M, S, D, E, K>,
    t: S::Real,
    x: [S; D],
    h: Option<S::Real>,
}

impl<M, S, const D: usize, E, K> scalar::Work for Begin<'_, M, S, D, E, K>
where
    S: Scalar,
    M: System<S, D>,
    E: ErrorNorm<S, D> + Copy,
    K: Method<S, D>,
{
    type Output = ();

    #[inline(always)]
    fn run<V: InstructionSet>(self) {
        self.integrator.start(S::mask(true), self.t, self.x, self.h);
    }
}

/// The sides and the first step of runs that start.
struct Starting<'a, 'b, M, S: Scalar, const D: usize> {
    run: &'a mut Run<S, D>,
    system: &'a M,
    first: FirstStep<'b, S>,
}

impl<M: System<S, D>, S: Scalar, const D: usize> scalar::Work for Starting<'_, '_, M, S, D> {
    type Output = ();

    #[inline(always)]
    fn run<V: InstructionSet>(self) {
        self.run.start_on_sides(self.system, self.first);
    }
}

impl<M, S, const D: usize, E, K> Integrator<M, S, D, E, K>
where
    S: Scalar<Real = f64, Mask = bool>,
    M: System<S, D>,
    E: ErrorNorm<S, D> + Copy,
    K: Method<S, D>,
{
    /// Takes one accepted step, at most up to `end`, which it then reaches exactly.
    pub fn advance(&mut self, end: f64) -> Result<Ending, Failure> {
        let mut ending = Ending::Free;
        loop {
            match self.attempt(end, &mut ending) {
                Attempted::Moved => return Ok(ending),
                Attempted::Failed => return Err(self.failure()),
                Attempted::Rejected if cancel::is_asked() => return Err(Failure::Interrupted),
                Attempted::Rejected => {}
            }
        }
    }

    /// Tries a step; where it does not end freely, says how.
    #[inline(always)]
    fn attempt(&mut self, end: f64, ending: &mut Ending) -> Attempted {
        let progress = self.trial_apart(end);
        if progress.failed {
            Attempted::Failed
        } else if progress.moved {
            if const { !M::SMOOTH } {
                *ending = Ending::of(&progress.crossed);
            }
            Attempted::Moved
        } else {
            Attempted::Rejected
        }
    }
}

impl<M, S, const D: usize, E, K> Integrator<M, S, D, E, K>
where
    S: Scalar,
    M: System<S, D>,
    E: ErrorNorm<S, D> + Copy,
    K: Method<S, D>,
{
    /// Why lane 0 cannot go on.
    pub fn failure(&self) -> Failure {
        self.failure_of(0)
    }

    /// Why a lane cannot go on.
    pub fn failure_of(&self, lane: usize) -> Failure {
        self.run.failure_of(&self.system, K::SERIES, lane)
    }
}

#[inline(always)]
fn is_zero<R: Real>(value: R) -> R::Mask {
    value.abs().less(R::constant(f64::from_bits(1)))
}

#[inline(always)]
fn tick<R: Real>(lanes: R::Mask, count: R, by: f64) -> R {
    count + R::select(lanes, R::constant(by), R::zero())
}

/// At a start exactly on a surface the side is the one the flow goes to.
#[inline(always)]
fn start_sides<S: Scalar, const D: usize>(system: &impl System<S, D>, at: &mut StepStart<S, D>, h: S::Real) {
    if let Some(clock) = system.clock() {
        at.sides[clock] = S::mask(system.clock_side(at.t, h.lane(0) >= 0.0));
    }
    for j in 0..system.surfaces() {
        let value = system.surface(j, S::lift(at.t), &at.x, &at.sides).real();
        let on = S::Mask::from_lanes(|i| value.lane(i) == 0.0);
        if on.any() {
            let ahead = h.each(|h| 1e-9_f64.copysign(h));
            let rate = system.rates(S::lift(at.t), &at.x, &at.sides);
            let moved = vector!(S, D; n => at.x[n] + rate[n].times(ahead));
            let there = system.surface(j, S::lift(at.t + ahead), &moved, &at.sides);
            at.sides[j] = choose(on, S::zero().less(there), at.sides[j]);
        }
    }
}
