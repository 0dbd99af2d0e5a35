//! Lyapunov exponents.

use crate::analysis::batch::lanes::{LaneBatch, Start};
use crate::analysis::batch::method_factory::{Dopri5Factory, MethodFactory, TaylorFactory};
use crate::analysis::batch::rows;
use crate::analysis::batch::scheduler::{
    BatchJob, ExecutionContext, Queue, ResultSink, rerun_failed, run_batch, run_one_by_one,
};
use crate::analysis::batch::series_family::{SeriesFamily, rates_of};
use crate::analysis::lyapunov::block_average::{Average, BlockAverages};
use crate::analysis::lyapunov::moments::Moments;
use crate::analysis::lyapunov::tangent_frame::{LogGrowth, tangents};
use crate::analysis::trajectory::Outcome;
use crate::integrate::{Failure, Tolerance, WithTangents, order};
use crate::model::Family;
use crate::scalar::{Dual, Isa, Mask, Real, vector};

/// A block is no shorter than this many steps.
const LEAST_STEPS: f64 = 32.0;

/// How exponents are estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LyapunovOptions {
    /// The time to run at most, the transient included.
    pub time: f64,
    /// The time at the start that is left out in any case.
    pub transient: f64,
    /// The run ends when the standard error of the largest exponent is down to this.
    pub goal: f64,
    /// The accuracy of the run.
    pub tolerance: Tolerance,
}

/// The `N` largest exponents of many orbits.
#[derive(Clone, Copy, Debug)]
pub struct Lyapunov<'a, F, const D: usize> {
    pub family: &'a F,
    /// The parameters' values, one row for each orbit, or a single row for all.
    pub values: &'a [Vec<f64>],
    /// The initial states, one for each orbit, or a single one for all.
    pub starts: &'a [[f64; D]],
    pub options: LyapunovOptions,
}

/// One orbit's exponents and their accuracy.
#[derive(Clone, Copy, Debug)]
pub struct Exponents<const D: usize, const N: usize> {
    pub exponents: Average<N>,
    /// Time averages of the state and of the products of its components, where all exponents are asked for.
    pub moments: Moments<f64, D>,
    /// When and where the run ended, and how.
    pub t: f64,
    pub x: [f64; D],
    pub outcome: Result<Outcome, Failure>,
}

impl<F: Family<D>, const D: usize> Lyapunov<'_, F, D> {
    /// The `N` largest exponents of each orbit: the mean growth rates of tangents that are kept
    /// orthonormal (Benettin et al., Meccanica 15 (1980) 9). `None` for an orbit that was not finished when the work
    /// stopped.
    ///
    /// Tangents are the derivative part of a dual run, as accurate as the state. Growth is summed over
    /// blocks, whose scatter gives the standard errors. Where the first half of the blocks disagrees
    /// with the second by more than chance allows, the run was still on its way to the attractor and the
    /// first half is dropped.
    pub fn run<const N: usize>(&self, context: ExecutionContext<'_>) -> Vec<Option<Exponents<D, N>>> {
        let (orbits, isa) = (rows::count(self.values, self.starts), context.isa);
        let stages = |queue: &Queue<'_>, results: &mut ResultSink<'_, _>| {
            let job = Tangents::<_, D, N, _> { orbits: self, recipe: Dopri5Factory, isa };
            job.run_batch::<f64>(queue, results);
        };
        let Some(tape) = &rows::tape(self.family, self.values) else {
            return run_one_by_one(&stages, orbits, context);
        };
        let recipe = TaylorFactory { tape, order: order(&self.options.tolerance), isa };
        let alone = |queue: &Queue<'_>, results: &mut ResultSink<'_, _>| {
            Tangents::<_, D, N, _> { orbits: self, recipe, isa }.run_batch::<f64>(queue, results);
        };
        let rates = |values: &[f64], t: f64, x: &[f64; D]| rates_of(self.family, values, t, x);
        let &Lyapunov { family, values, starts, options } = self;
        let family = &SeriesFamily::new(&rates, family.idle());
        let job = Tangents { orbits: &Lyapunov { family, values, starts, options }, recipe, isa };
        let found = run_batch(self.family.goes_in_packets().then_some(&job), &alone, orbits, context);
        let failed = |orbit: &Exponents<D, N>| orbit.outcome.is_err_and(|failure| tape.hands_over(&failure));
        rerun_failed(&stages, found, failed, context)
    }

    fn start<R: Real, const N: usize>(&self, orbit: usize) -> Start<'_, Dual<R, N>, D> {
        let x = *rows::of(self.starts, orbit);
        Start {
            values: rows::of::<Vec<f64>>(self.values, orbit),
            t: 0.0,
            x: tangents(x, self.family.idle()),
            end: if self.options.transient > 0.0 { self.options.transient } else { self.options.time },
        }
    }
}

struct Tangents<'a, F, const D: usize, const N: usize, T> {
    orbits: &'a Lyapunov<'a, F, D>,
    recipe: T,
    isa: Isa,
}

impl<F: Family<D>, const D: usize, const N: usize, T: MethodFactory<D>> BatchJob
    for Tangents<'_, F, D, N, T>
{
    type Yield = Exponents<D, N>;

    // Tangents of many states fill the registers by themselves.
    const PACKETS: bool = F::PACKETS && T::SERIES && (N == 1 || D == 3);
    const DERIVATIVES: usize = N;
    const DOUBLE: bool = N == 1;

    #[inline(always)]
    fn run_batch<R: Real>(&self, queue: &Queue<'_>, results: &mut ResultSink<'_, Exponents<D, N>>) {
        let LyapunovOptions { time, transient, goal, tolerance } = self.orbits.options;
        let Some(first) = queue.take() else { return };
        let span = (time - transient) / (8 * BlockAverages::<N>::MOST) as f64;
        let start = |orbit| self.orbits.start::<R, N>(orbit);
        let norm = WithTangents(tolerance);
        let mut batch =
            LaneBatch::new(self.isa, self.orbits.family, |v| self.recipe.make(v), start(first), &norm);
        batch.latest = time;
        // Not cloned: clones have no room beforehand.
        let mut blocks = Vec::with_capacity(R::LANES);
        blocks.resize_with(R::LANES, || BlockAverages::<N>::new(span));
        let mut growth = LogGrowth::<R, N>::none();
        // When each lane's block began, and its steps since.
        let (mut since, mut steps) = (R::zero(), R::zero());
        let mut full_at = R::constant(f64::INFINITY);
        let mut moments = Moments::<R, D>::zero();
        let mut waiting = Some(first);
        for lane in 0..queue.lanes::<R>() {
            if let Some(orbit) = waiting.take().or_else(|| queue.take()) {
                batch.load(lane, orbit, start(orbit));
                full_at.set_lane(lane, if transient > 0.0 { f64::INFINITY } else { span });
            }
        }

        while !batch.is_empty() && !queue.stopped() {
            // Up to the end of the transient nothing counts.
            let counting = batch.end.less(R::constant(time)).not();
            let progress = batch.trial();
            let moved = progress.moved;
            if const { N == D } {
                moments.add(self.isa, &batch.driver, moved.and(counting));
            }
            steps += R::select(moved, R::one(), R::zero());
            let t = batch.driver.t();
            let full = moved.and(t.less(full_at).or(steps.less(R::constant(LEAST_STEPS))).not());
            let over = batch.arrived().or(progress.walled()).or(progress.failed);
            // A tangent that vanishes when a contact sticks shows at once or never.
            let told = full.or(over).or(progress.switched());
            growth.keep(self.isa, &mut batch.driver, (moved, told));
            for lane in full.or(over).lanes() {
                let Some(orbit) = batch.job(lane) else { continue };
                let now = t.lane(lane);
                let own = &mut blocks[lane];
                let mut converged = false;
                if counting.lane(lane) && now > since.lane(lane) {
                    let look = own.push(growth.lane(batch.driver.x(), lane), now - since.lane(lane));
                    if look && !own.drop_transient() {
                        converged = own.average().standard_error[0] <= goal;
                    }
                }
                let failed = progress.failed.lane(lane);
                let walled = progress.walled().lane(lane);
                let arrived = over.lane(lane) && !failed && !walled;
                let settled = arrived && !counting.lane(lane);
                if settled {
                    // The transient is over: count from here.
                    batch.end.set_lane(lane, time);
                    own.clear(span);
                    moments.clear(lane);
                }
                if full.lane(lane) || settled {
                    growth.restart(batch.driver.x(), lane);
                    since.set_lane(lane, now);
                    steps.set_lane(lane, 0.0);
                    full_at.set_lane(lane, now + own.span);
                }
                if !(converged || failed || walled || (arrived && !settled)) {
                    continue;
                }
                let outcome = match (failed, walled) {
                    (true, _) => Err(batch.failure_of(lane)),
                    (_, true) => Ok(Outcome::Ejected),
                    _ => Ok(Outcome::Finished),
                };
                let exponents = own.average();
                let x = vector!(f64, D; n => batch.driver.x()[n].re.lane(lane));
                let means = moments.lane(lane);
                moments.clear(lane);
                results.push(orbit, Exponents { exponents, moments: means, t: now, x, outcome });
                batch.unload(lane);
                full_at.set_lane(lane, f64::INFINITY);
                if let Some(orbit) = queue.take() {
                    batch.load(lane, orbit, start(orbit));
                    blocks[lane].clear(span);
                    growth.begin(batch.driver.x(), lane);
                    since.set_lane(lane, 0.0);
                    steps.set_lane(lane, 0.0);
                    full_at.set_lane(lane, if transient > 0.0 { f64::INFINITY } else { span });
                }
            }
        }
    }
}
