//! Poincaré sections: where trajectories cross a surface.

use crate::analysis::batch::lanes::{LaneBatch, Start};
use crate::analysis::batch::method_factory::{Dopri5Factory, MethodFactory, TaylorFactory};
use crate::analysis::batch::rows;
use crate::analysis::batch::scheduler::{
    BatchJob, ExecutionContext, Queue, ResultSink, rerun_failed, run_batch, run_one_by_one,
};
use crate::analysis::batch::series_family::{SeriesFamily, rates_of};
use crate::analysis::poincare::crossing::{Crossing, Scan};
use crate::formula::Expression;
use crate::integrate::{Failure, Tolerance, order};
use crate::model::Family;
use crate::scalar::{Isa, Mask, Real, vector};

/// A component of the state beyond this has escaped to infinity.
pub const ESCAPE_BOUND: f64 = 1e6;

/// A surface, the zeros of a function, and the way in which it is to be crossed.
#[derive(Clone, Debug)]
pub struct Section {
    pub function: Expression,
    /// Whether crossings count where the function rises, and where it falls.
    pub rising: bool,
    pub falling: bool,
}

/// How a job of collecting crossings ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CrossingOutcome {
    /// With as many as were wanted.
    Finished,
    /// On the wall: the disk left the wheels.
    Ejected,
    /// At the last time allowed.
    TimeRanOut,
    Failed(Failure),
    /// Stopped from outside.
    Interrupted,
    /// Far away from where anything happens.
    Escaped,
}

/// The crossings of one trajectory.
#[derive(Clone, Debug)]
pub struct Crossings<const D: usize> {
    /// In the order of time: when, where, and of which surface.
    pub t: Vec<f64>,
    pub x: Vec<[f64; D]>,
    pub which: Vec<u8>,
    /// The largest absolute value of the surfaces' functions at these points.
    pub residual: f64,
    /// When and where the trajectory ended: on the last crossing wanted, or where it went out.
    pub end: (f64, [f64; D]),
    pub ended: CrossingOutcome,
}

impl<const D: usize> Crossings<D> {
    fn new(capacity: usize) -> Self {
        Self {
            t: Vec::with_capacity(capacity),
            x: Vec::with_capacity(capacity),
            which: Vec::with_capacity(capacity),
            residual: 0.0,
            end: (0.0, [0.0; D]),
            ended: CrossingOutcome::Finished,
        }
    }

    fn push(&mut self, crossed: &Crossing<D>) {
        self.t.push(crossed.t);
        self.x.push(crossed.x);
        self.which.push(crossed.which);
        self.residual = self.residual.max(crossed.residual.abs());
    }
}

/// Collects crossings along many trajectories of one model.
#[derive(Clone, Copy, Debug)]
pub struct SectionRun<'a, F, const D: usize> {
    pub family: &'a F,
    /// The parameters' values, one row for each trajectory, or a single row for all.
    pub values: &'a [Vec<f64>],
    /// The initial states, at time 0, one for each trajectory, or a single one for all.
    pub starts: &'a [[f64; D]],
    /// The surfaces.
    pub sections: &'a [Section],
    /// How many crossings are left out, and how many, at least one, are wanted after them.
    pub skip: usize,
    pub count: usize,
    /// The last time.
    pub end: f64,
    /// Which components of the state are bounded: unlike angles, they [escape](ESCAPE_BOUND).
    pub bounded: [bool; D],
    pub tolerance: Tolerance,
}

impl<F: Family<D>, const D: usize> SectionRun<'_, F, D> {
    /// Collects them all. `None` for a trajectory that was not begun when the work stopped.
    pub fn run(&self, context: ExecutionContext<'_>) -> Vec<Option<Crossings<D>>> {
        let (jobs, isa) = (rows::count(self.values, self.starts), context.isa);
        let stages = |queue: &Queue<'_>, results: &mut ResultSink<'_, _>| {
            Collect { sections: self, recipe: Dopri5Factory, isa }.run_batch::<f64>(queue, results);
        };
        let Some(tape) = &rows::tape(self.family, self.values) else {
            return run_one_by_one(&stages, jobs, context);
        };
        let recipe = TaylorFactory { tape, order: order(&self.tolerance), isa };
        let alone = |queue: &Queue<'_>, results: &mut ResultSink<'_, _>| {
            Collect { sections: self, recipe, isa }.run_batch::<f64>(queue, results);
        };
        let rates = |values: &[f64], t: f64, x: &[f64; D]| rates_of(self.family, values, t, x);
        let &SectionRun { family, values, starts, sections, skip, count, end, bounded, tolerance } = self;
        let family = &SeriesFamily::new(&rates, family.idle());
        let sections = &SectionRun { family, values, starts, sections, skip, count, end, bounded, tolerance };
        let job = Collect { sections, recipe, isa };
        let found = run_batch(self.family.goes_in_packets().then_some(&job), &alone, jobs, context);
        let failed = |crossings: &Crossings<D>| matches!(crossings.ended, CrossingOutcome::Failed(failure) if tape.hands_over(&failure));
        rerun_failed(&stages, found, failed, context)
    }

    fn start<R: Real>(&self, job: usize) -> Start<'_, R, D> {
        let x = rows::of(self.starts, job);
        let x = vector!(R, D; n => R::constant(x[n]));
        Start { values: rows::of::<Vec<f64>>(self.values, job), t: 0.0, x, end: self.end }
    }
}

struct Collect<'a, F, const D: usize, T> {
    sections: &'a SectionRun<'a, F, D>,
    recipe: T,
    isa: Isa,
}

impl<F: Family<D>, const D: usize, T: MethodFactory<D>> BatchJob for Collect<'_, F, D, T> {
    type Yield = Crossings<D>;

    const PACKETS: bool = F::PACKETS && T::SERIES;
    const DOUBLE: bool = true;

    #[inline(always)]
    fn run_batch<R: Real>(&self, queue: &Queue<'_>, results: &mut ResultSink<'_, Crossings<D>>) {
        let SectionRun { family, sections, skip, count, bounded, tolerance, .. } = *self.sections;
        let Some(first) = queue.take() else { return };
        let start = |job| self.sections.start::<R>(job);
        let mut batch =
            LaneBatch::new(self.isa, family, |values| self.recipe.make(values), start(first), &tolerance);
        let stopped = || queue.stopped();
        let mut scan: Scan<'_, R, D> = Scan::new(sections, self.isa, count, &stopped);
        // The crossings of each lane.
        let mut found_by: Vec<Crossings<D>> = vec![Crossings::new(0); R::LANES];
        for lane in 0..queue.lanes::<R>() {
            let job = if lane == 0 { Some(first) } else { queue.take() };
            if let Some(job) = job {
                batch.load(lane, job, start(job));
                found_by[lane] = Crossings::new(count);
            }
        }
        scan.begin(&batch, R::mask(true), skip);
        while !batch.is_empty() {
            let progress = batch.trial();
            let stopped = queue.stopped();
            let mut full = R::mask(false);
            if scan.look(&batch, progress.moved) {
                let mut any = false;
                for (lane, crossed) in scan.crossed() {
                    let found = &mut found_by[*lane];
                    if found.t.len() < count {
                        found.push(crossed);
                        any |= found.t.len() == count;
                    }
                }
                if any {
                    full = R::Mask::from_lanes(|lane| {
                        batch.job(lane).is_some() && found_by[lane].t.len() == count
                    });
                }
            }
            let mut far = R::mask(false);
            for n in 0..D {
                if bounded[n] {
                    far = far.or(R::constant(ESCAPE_BOUND).less(batch.driver.x()[n].abs()));
                }
            }
            let walled = progress.walled();
            let over = full.or(batch.arrived()).or(walled).or(progress.failed).or(far);
            if !(over.any() || stopped) {
                continue;
            }
            let mut fresh = false;
            for lane in over.or(R::mask(stopped)).lanes() {
                let ended = match () {
                    () if full.lane(lane) => CrossingOutcome::Finished,
                    () if progress.failed.lane(lane) => CrossingOutcome::Failed(batch.failure_of(lane)),
                    () if walled.lane(lane) => CrossingOutcome::Ejected,
                    () if far.lane(lane) => CrossingOutcome::Escaped,
                    () if over.lane(lane) => CrossingOutcome::TimeRanOut,
                    () => CrossingOutcome::Interrupted,
                };
                let Some(job) = batch.unload(lane) else { continue };
                let mut found = std::mem::replace(&mut found_by[lane], Crossings::new(0));
                found.ended = ended;
                found.end = match ended {
                    CrossingOutcome::Finished => (found.t[count - 1], found.x[count - 1]),
                    _ => (batch.driver.t().lane(lane), vector!(f64, D; n => batch.driver.x()[n].lane(lane))),
                };
                results.push(job, found);
                let next = if stopped { None } else { queue.take() };
                if let Some(job) = next {
                    batch.load(lane, job, start(job));
                    found_by[lane] = Crossings::new(count);
                    fresh = true;
                }
            }
            if fresh {
                scan.begin(&batch, over, skip);
            }
        }
    }
}
