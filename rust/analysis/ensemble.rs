//! The same model from many states, or with many values of its parameters.

use crate::analysis::CancelFlag;
use crate::analysis::batch::lanes::{LaneBatch, Start};
use crate::analysis::batch::method_factory::{Dop853Factory, Dopri5Factory, MethodFactory, TaylorFactory};
use crate::analysis::batch::rows;
use crate::analysis::batch::scheduler::{
    BatchJob, ExecutionContext, Queue, ResultSink, rerun_failed, run_batch, run_one_by_one,
};
use crate::analysis::batch::series_family::{SeriesFamily, rates_of};
use crate::analysis::trajectory::{Outcome, follow};
use crate::integrate::{Failure, Integrator, Steps, Tolerance, order};
use crate::model::{AnySystem, Family, System};
use crate::observe::Samples;
use crate::scalar::{Isa, Mask, Real, Scalar, vector};

/// How steps are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodChoice {
    Dopri5,
    Dop853,
    /// Where a series follows the law, else as [`Dopri5`](MethodChoice::Dopri5). A run fails where its series does
    /// not serve.
    Taylor,
    /// The same, but such a run is done again as by [`Dop853`](MethodChoice::Dop853).
    Auto,
}

/// Many runs of one model.
#[derive(Clone, Copy, Debug)]
pub struct Ensemble<'a, F, const D: usize> {
    pub family: &'a F,
    /// The parameters' values, one row for each run, or a single row for all.
    pub values: &'a [Vec<f64>],
    /// The initial states, one for each run, or a single one for all.
    pub starts: &'a [[f64; D]],
    /// When states are wanted, increasing; the first is the time of the initial state.
    pub times: &'a [f64],
    pub tolerance: Tolerance,
    pub stepper: MethodChoice,
}

/// One run of an ensemble.
#[derive(Clone, Debug)]
pub struct EnsembleRun<const D: usize> {
    /// The states at the times wanted, as many as it reached.
    pub states: Vec<[f64; D]>,
    /// When and where it ended, and how.
    pub t: f64,
    pub x: [f64; D],
    pub outcome: Result<Outcome, Failure>,
}

impl<F: Family<D>, const D: usize> Ensemble<'_, F, D> {
    /// Runs them all. `None` for a run that was not finished when the work stopped.
    pub fn run(&self, context: ExecutionContext<'_>) -> Vec<Option<EnsembleRun<D>>> {
        // The steps are those of a run by itself, in which padding states do not count.
        let tolerance = self.tolerance.filled::<D>(self.family.idle());
        Ensemble { tolerance, ..*self }.run_filled(order(&self.tolerance), context)
    }

    fn run_filled(&self, order: usize, context: ExecutionContext<'_>) -> Vec<Option<EnsembleRun<D>>> {
        let (runs, isa) = (rows::count(self.values, self.starts), context.isa);
        let stages = |queue: &Queue<'_>, results: &mut ResultSink<'_, _>| {
            self.one_by_one(&Dop853Factory, queue, results);
        };
        let tape = match self.stepper {
            MethodChoice::Dopri5 => None,
            MethodChoice::Dop853 => return run_one_by_one(&stages, runs, context),
            MethodChoice::Taylor | MethodChoice::Auto => rows::tape(self.family, self.values),
        };
        let Some(tape) = &tape else {
            let job = Sampled { ensemble: self, recipe: Dopri5Factory, isa };
            let alone = |queue: &Queue<'_>, results: &mut ResultSink<'_, _>| {
                self.one_by_one(&Dopri5Factory, queue, results);
            };
            return run_batch(self.family.goes_in_packets().then_some(&job), &alone, runs, context);
        };
        let recipe = TaylorFactory { tape, order, isa };
        let alone = |queue: &Queue<'_>, results: &mut ResultSink<'_, _>| {
            self.one_by_one(&recipe, queue, results);
        };
        let rates = |values: &[f64], t: f64, x: &[f64; D]| rates_of(self.family, values, t, x);
        let &Ensemble { family, values, starts, times, tolerance, stepper } = self;
        let family = &SeriesFamily::new(&rates, family.idle());
        let ensemble = &Ensemble { family, values, starts, times, tolerance, stepper };
        let job = Sampled { ensemble, recipe, isa };
        let passages = run_batch(self.family.goes_in_packets().then_some(&job), &alone, runs, context);
        let failed = |passage: &EnsembleRun<D>| {
            stepper == MethodChoice::Auto && passage.outcome.is_err_and(|failure| tape.hands_over(&failure))
        };
        rerun_failed(&stages, passages, failed, context)
    }

    /// As a [trajectory](crate::analysis::trajectory), so that both share what is compiled.
    fn one_by_one<T: MethodFactory<D>>(
        &self,
        recipe: &T,
        queue: &Queue<'_>,
        results: &mut ResultSink<'_, EnsembleRun<D>>,
    ) {
        let Ensemble { times, tolerance, .. } = self;
        while let Some(job) = queue.take() {
            let Start { values, t, x, end } = self.start::<f64>(job);
            let (system, method) = (self.family.build(values), recipe.make(values.to_vec()));
            let passage = if const { T::FORGETS && !<F::Built<f64> as System<f64, D>>::SMOOTH } {
                let system: &dyn AnySystem<f64, D> = &system;
                let mut run = Integrator::by(method, system, t, x, None, tolerance).with_wall();
                passage(&mut run, times, end, queue.stop())
            } else {
                let mut run = Integrator::by(method, system, t, x, None, tolerance).with_wall();
                passage(&mut run, times, end, queue.stop())
            };
            match passage {
                Some(passage) => results.push(job, passage),
                None => return,
            }
        }
    }

    #[inline(always)]
    fn start<S: Scalar>(&self, run: usize) -> Start<'_, S, D> {
        let x = rows::of(self.starts, run);
        Start {
            values: rows::of::<Vec<f64>>(self.values, run),
            t: self.times[0],
            x: vector!(S, D; n => S::constant(x[n])),
            end: self.times[self.times.len() - 1],
        }
    }
}

struct Sampled<'a, F, const D: usize, T> {
    ensemble: &'a Ensemble<'a, F, D>,
    recipe: T,
    isa: Isa,
}

impl<F: Family<D>, const D: usize, T: MethodFactory<D>> Sampled<'_, F, D, T> {
    /// Starts a run in a lane; returns its states so far. Not a closure, which would be a function of its own.
    #[inline(always)]
    fn load<R: Real>(
        &self,
        batch: &mut LaneBatch<'_, F, R, D, Tolerance, T::Method<R>>,
        lane: usize,
        run: usize,
    ) -> Vec<[f64; D]> {
        let start = self.ensemble.start::<R>(run);
        let mut states = Vec::with_capacity(self.ensemble.times.len());
        states.push(lane_of(&start.x, lane));
        batch.load(lane, run, start);
        states
    }
}

impl<F: Family<D>, const D: usize, T: MethodFactory<D>> BatchJob for Sampled<'_, F, D, T> {
    type Yield = EnsembleRun<D>;

    const PACKETS: bool = F::PACKETS && T::PACKETS;
    const DOUBLE: bool = T::SERIES;

    #[inline(always)]
    fn run_batch<R: Real>(&self, queue: &Queue<'_>, results: &mut ResultSink<'_, EnsembleRun<D>>) {
        let Ensemble { family, times, tolerance, .. } = self.ensemble;
        let Some(first) = queue.take() else { return };
        let like = self.ensemble.start::<R>(first);
        let mut batch = LaneBatch::new(self.isa, *family, |values| self.recipe.make(values), like, tolerance);
        let mut states: Vec<Vec<[f64; D]>> = vec![Vec::new(); R::LANES];
        // The time of each lane's next sample.
        let mut wanted = R::constant(f64::INFINITY);
        let after = |taken: usize| if taken < times.len() { times[taken] } else { f64::INFINITY };
        for lane in 0..queue.lanes::<R>() {
            let run = if lane == 0 { Some(first) } else { queue.take() };
            if let Some(run) = run {
                states[lane] = self.load(&mut batch, lane, run);
                wanted.set_lane(lane, after(1));
            }
        }
        while !batch.is_empty() && !queue.stopped() {
            let progress = batch.trial();
            loop {
                let due = progress.moved.and(batch.driver.t().less(wanted).not());
                if !due.any() {
                    break;
                }
                let inside = due.and(wanted.less(batch.driver.t()));
                let x = match inside.any() {
                    true => {
                        let dense = batch.driver.dense(wanted - batch.driver.from());
                        vector!(R, D; n => R::select(inside, dense[n], batch.driver.x()[n]))
                    }
                    false => *batch.driver.x(),
                };
                for lane in due.lanes() {
                    states[lane].push(lane_of(&x, lane));
                    wanted.set_lane(lane, after(states[lane].len()));
                }
            }
            let over = batch.arrived().or(progress.walled()).or(progress.failed);
            for lane in over.lanes() {
                let outcome = if progress.failed.lane(lane) {
                    Err(batch.failure_of(lane))
                } else if progress.walled().lane(lane) {
                    Ok(Outcome::Ejected)
                } else {
                    Ok(Outcome::Finished)
                };
                let Some(run) = batch.unload(lane) else { continue };
                wanted.set_lane(lane, f64::INFINITY);
                let own = std::mem::take(&mut states[lane]);
                let (t, x) = (batch.driver.t().lane(lane), lane_of(batch.driver.x(), lane));
                results.push(run, EnsembleRun { states: own, t, x, outcome });
                if let Some(run) = queue.take() {
                    states[lane] = self.load(&mut batch, lane, run);
                    wanted.set_lane(lane, after(1));
                }
            }
        }
    }
}

/// One run, from where it stands; none where it was stopped.
fn passage<const D: usize>(
    run: &mut dyn Steps<D>,
    times: &[f64],
    end: f64,
    stop: &CancelFlag,
) -> Option<EnsembleRun<D>> {
    let mut samples = Samples::new(times, *run.x());
    let outcome = match follow(run, end, (stop, None), &mut |run, _| Ok(samples.take(run))) {
        Err(Failure::Interrupted) => return None,
        Ok(Outcome::Chattering) => Err(Failure::Chattering { t: run.t() }),
        outcome => outcome,
    };
    Some(EnsembleRun { states: samples.x, t: run.t(), x: *run.x(), outcome })
}

// Not by an adapter, which would be a function of its own.
#[inline(always)]
fn lane_of<R: Real, const D: usize>(x: &[R; D], lane: usize) -> [f64; D] {
    vector!(f64, D; n => x[n].lane(lane))
}
