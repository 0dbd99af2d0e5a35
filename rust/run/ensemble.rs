//! The same model from many states, or with many values of its parameters.

use super::Stop;
use super::fleet::{Crew, Fleet, Queue, Yields, sail, sail_again};
use super::recipe::{ByDop853, ByDopri5, ByTaylor, Recipe};
use super::rows;
use super::ship::{Ship, Start};
use super::trajectory::{Outcome, follow};
use crate::integrate::{Driver, Failure, Steps, Tolerance, order};
use crate::model::{AnySystem, Family, System};
use crate::observe::Samples;
use crate::scalar::{Isa, Mask, Real, Scalar};
use crate::unroll::vector;

/// How steps are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stepper {
    Dopri5,
    Dop853,
    /// Where a series follows the law, else as [`Dopri5`](Stepper::Dopri5). A run fails where its series does
    /// not serve.
    Taylor,
    /// The same, but such a run is done again as by [`Dop853`](Stepper::Dop853).
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
    pub stepper: Stepper,
}

/// One run of an ensemble.
#[derive(Clone, Debug)]
pub struct Passage<const D: usize> {
    /// The states at the times wanted, as many as it reached.
    pub states: Vec<[f64; D]>,
    /// When and where it ended, and how.
    pub t: f64,
    pub x: [f64; D],
    pub outcome: Result<Outcome, Failure>,
}

impl<F: Family<D>, const D: usize> Ensemble<'_, F, D> {
    /// Runs them all. `None` stands for runs that were not finished when the work was stopped.
    pub fn run(&self, crew: Crew<'_>) -> Vec<Option<Passage<D>>> {
        self.run_beside(self.family, crew)
    }

    /// The same, where `alone` is the same family, with the same parameters, in the type that single runs are compiled
    /// for anyway: those that go in no packet are runs of that.
    pub fn run_beside<A: Family<D>>(&self, alone: &A, crew: Crew<'_>) -> Vec<Option<Passage<D>>> {
        let (runs, isa) = (rows::count(self.values, self.starts), crew.isa);
        let stages = Sampled { ensemble: self, alone, recipe: ByDop853, isa };
        let tape = match self.stepper {
            Stepper::Dopri5 => None,
            Stepper::Dop853 => return sail(&stages, runs, crew),
            Stepper::Taylor | Stepper::Auto => rows::tape(self.family, self.values),
        };
        match &tape {
            Some(tape) => {
                let recipe = ByTaylor { tape, order: order(&self.tolerance), isa };
                let passages = sail(&Sampled { ensemble: self, alone, recipe, isa }, runs, crew);
                let failed = |passage: &Passage<D>| {
                    self.stepper == Stepper::Auto
                        && passage.outcome.is_err_and(|failure| tape.hands_over(&failure))
                };
                sail_again(&stages, passages, failed, crew)
            }
            None => sail(&Sampled { ensemble: self, alone, recipe: ByDopri5, isa }, runs, crew),
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

struct Sampled<'a, F, A, const D: usize, T> {
    ensemble: &'a Ensemble<'a, F, D>,
    alone: &'a A,
    recipe: T,
    isa: Isa,
}

impl<F: Family<D>, A, const D: usize, T: Recipe<D>> Sampled<'_, F, A, D, T> {
    /// Starts a run in a lane; returns its states so far. Not a closure, which would be a function of its own.
    #[inline(always)]
    fn load<R: Real>(
        &self,
        ship: &mut Ship<'_, F, R, D, Tolerance, T::Method<R>>,
        lane: usize,
        run: usize,
    ) -> Vec<[f64; D]> {
        let start = self.ensemble.start::<R>(run);
        let mut states = Vec::with_capacity(self.ensemble.times.len());
        states.push(lane_of(&start.x, lane));
        ship.load(lane, run, start);
        states
    }
}

impl<F: Family<D>, A: Family<D>, const D: usize, T: Recipe<D>> Fleet for Sampled<'_, F, A, D, T> {
    type Yield = Passage<D>;

    const PACKETS: bool = F::PACKETS && T::STARTS_IN_PACKETS || F::STARTS_IN_PACKETS && T::PACKETS;
    const DOUBLE: bool = T::PACKETS;

    /// As a [trajectory](super::trajectory), so that both share what is compiled.
    fn walk(&self, queue: &Queue<'_>, yields: &mut Yields<'_, Passage<D>>) {
        let Ensemble { times, tolerance, .. } = self.ensemble;
        while let Some(job) = queue.take() {
            let Start { values, t, x, end } = self.ensemble.start::<f64>(job);
            let (system, method) = (self.alone.build(values), self.recipe.make(values.to_vec()));
            let passage = if const { T::FORGETS && !<A::Built<f64> as System<f64, D>>::SMOOTH } {
                let system: &dyn AnySystem<f64, D> = &system;
                let mut run = Driver::by(method, system, t, x, None, tolerance).with_wall();
                passage(&mut run, times, end, queue.stop())
            } else {
                let mut run = Driver::by(method, system, t, x, None, tolerance).with_wall();
                passage(&mut run, times, end, queue.stop())
            };
            match passage {
                Some(passage) => yields.push(job, passage),
                None => return,
            }
        }
    }

    fn goes_in_packets(&self) -> bool {
        self.ensemble.family.goes_in_packets()
    }

    #[inline(always)]
    fn sail<R: Real>(&self, queue: &Queue<'_>, yields: &mut Yields<'_, Passage<D>>) {
        let Ensemble { family, times, tolerance, .. } = self.ensemble;
        let Some(first) = queue.take() else { return };
        let like = self.ensemble.start::<R>(first);
        let mut ship = Ship::new(self.isa, *family, |values| self.recipe.make(values), like, tolerance);
        let mut states: Vec<Vec<[f64; D]>> = vec![Vec::new(); R::LANES];
        // The time of each lane's next sample.
        let mut wanted = R::constant(f64::INFINITY);
        let after = |taken: usize| if taken < times.len() { times[taken] } else { f64::INFINITY };
        for lane in 0..queue.lanes::<R>() {
            let run = if lane == 0 { Some(first) } else { queue.take() };
            if let Some(run) = run {
                states[lane] = self.load(&mut ship, lane, run);
                wanted.set_lane(lane, after(1));
            }
        }
        while !ship.is_empty() && !queue.stopped() {
            let progress = ship.trial();
            loop {
                let due = progress.moved.and(ship.driver.t().less(wanted).not());
                if !due.any() {
                    break;
                }
                let inside = due.and(wanted.less(ship.driver.t()));
                let x = match inside.any() {
                    true => {
                        let dense = ship.driver.dense(wanted - ship.driver.from());
                        vector!(R, D; n => R::select(inside, dense[n], ship.driver.x()[n]))
                    }
                    false => *ship.driver.x(),
                };
                for lane in due.lanes() {
                    states[lane].push(lane_of(&x, lane));
                    wanted.set_lane(lane, after(states[lane].len()));
                }
            }
            let over = ship.arrived().or(progress.walled()).or(progress.failed);
            for lane in over.lanes() {
                let outcome = if progress.failed.lane(lane) {
                    Err(ship.driver.failure_of(lane))
                } else if progress.walled().lane(lane) {
                    Ok(Outcome::Ejected)
                } else {
                    Ok(Outcome::Finished)
                };
                let Some(run) = ship.unload(lane) else { continue };
                wanted.set_lane(lane, f64::INFINITY);
                let own = std::mem::take(&mut states[lane]);
                let (t, x) = (ship.driver.t().lane(lane), lane_of(ship.driver.x(), lane));
                yields.push(run, Passage { states: own, t, x, outcome });
                if let Some(run) = queue.take() {
                    states[lane] = self.load(&mut ship, lane, run);
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
    stop: &Stop,
) -> Option<Passage<D>> {
    let mut samples = Samples::new(times, *run.x());
    let outcome = match follow(run, end, (stop, None), &mut |run, _| Ok(samples.take(run))) {
        Err(Failure::Interrupted) => return None,
        Ok(Outcome::Chattering) => Err(Failure::Chattering { t: run.t() }),
        outcome => outcome,
    };
    Some(Passage { states: samples.x, t: run.t(), x: *run.x(), outcome })
}

// Not by an adapter, which would be a function of its own.
#[inline(always)]
fn lane_of<R: Real, const D: usize>(x: &[R; D], lane: usize) -> [f64; D] {
    vector!(f64, D; n => x[n].lane(lane))
}
