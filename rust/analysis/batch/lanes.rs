//! A packet of trajectories, each with its own job, parameters, time and end.

use crate::analysis::batch::step_budget::StepBudget;
use crate::integrate::{ErrorNorm, Failure, Integrator, Method, Progress};
use crate::model::{Family, System};
use crate::scalar::{InstructionSet, Isa, Mask, Plain, Real, Scalar, Work, constants};

/// Where a job starts.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a, S, const D: usize> {
    /// The values of the family's parameters.
    pub values: &'a [f64],
    pub t: f64,
    /// The state, the same in all lanes.
    pub x: [S; D],
    /// The time to run to.
    pub end: f64,
}

/// One [`Integrator`] whose lanes are loaded and unloaded one by one.
pub struct LaneBatch<'a, F: Family<D>, S: Scalar, const D: usize, E, K> {
    isa: Isa,
    family: &'a F,
    values: Vec<S>,
    /// The packet that is integrated.
    pub driver: Integrator<F::Built<S>, S, D, E, K>,
    /// The job in each lane.
    jobs: Vec<Option<usize>>,
    /// How many there are.
    active: usize,
    /// Where each lane's run ends.
    pub end: S::Real,
    /// The time at which runs end at last, where that is not their first end.
    pub latest: f64,
    /// The trials so far, and the lanes' step budgets.
    trials: u64,
    budgets: Vec<StepBudget>,
}

/// The budgets are looked at after so many trials.
const EVERY: u64 = 1024;

impl<'a, F, S, const D: usize, E, K> LaneBatch<'a, F, S, D, E, K>
where
    F: Family<D>,
    S: Scalar,
    E: ErrorNorm<S, D> + Copy,
    K: Method<S, D>,
{
    /// An empty batch, which needs some start to be built from; packets run with these instructions.
    pub fn new(
        isa: Isa,
        family: &'a F,
        method: impl FnOnce(Vec<S>) -> K,
        like: Start<'_, S, D>,
        norm: &E,
    ) -> Self {
        let values: Vec<S> = constants(like.values);
        let t = S::Real::constant(like.t);
        let method = method(values.clone());
        let driver = Integrator::by(method, family.build(&values), t, like.x, None, norm).with_wall();
        Self {
            isa,
            family,
            values,
            driver,
            jobs: vec![None; S::Real::LANES],
            active: 0,
            end: t,
            latest: like.end,
            trials: 0,
            budgets: vec![StepBudget::new(0, like.t, like.end); S::Real::LANES],
        }
    }

    /// Starts a job in a lane.
    #[inline(always)]
    pub fn load(&mut self, lane: usize, job: usize, start: Start<'_, S, D>) {
        // For packets it is part of the code with their instructions.
        if const { S::Real::LANES > 1 } {
            self.load_here(lane, job, start);
        } else {
            self.load_apart(lane, job, start);
        }
    }

    #[inline(never)]
    fn load_apart(&mut self, lane: usize, job: usize, start: Start<'_, S, D>) {
        self.load_here(lane, job, start);
    }

    #[inline(always)]
    fn load_here(&mut self, lane: usize, job: usize, start: Start<'_, S, D>) {
        let mut changed = false;
        for i in 0..start.values.len() {
            let mut lanes = self.values[i].real();
            changed |= lanes.lane(lane).to_bits() != start.values[i].to_bits();
            lanes.set_lane(lane, start.values[i]);
            self.values[i] = S::lift(lanes);
        }
        // Otherwise values that are evaluated once for all steps stay.
        if changed {
            self.driver.set_system(self.family.build(&self.values), &self.values);
        }
        let only = S::Mask::from_lanes(|i| i == lane);
        self.driver.start(only, S::Real::constant(start.t), start.x, None);
        self.end.set_lane(lane, start.end);
        self.budgets[lane] = StepBudget::new(self.trials, start.t, start.end.max(self.latest));
        self.active += usize::from(self.jobs[lane].is_none());
        self.jobs[lane] = Some(job);
    }

    /// Ends the job in a lane, which from now on stays where it is.
    #[inline(always)]
    pub fn unload(&mut self, lane: usize) -> Option<usize> {
        self.end.set_lane(lane, self.driver.t().lane(lane));
        let job = self.jobs[lane].take();
        self.active -= usize::from(job.is_some());
        job
    }

    /// The job in a lane.
    pub fn job(&self, lane: usize) -> Option<usize> {
        self.jobs[lane]
    }

    /// The values of the parameters in each lane.
    #[inline(always)]
    pub fn values(&self) -> &[S] {
        &self.values
    }

    /// Whether all lanes are empty.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.active == 0
    }

    /// Tries a step in every lane.
    pub fn trial(&mut self) -> Progress<S::Mask> {
        self.trials += 1;
        if self.trials.is_multiple_of(EVERY) {
            self.look_at_budgets();
        }
        let end = self.end;
        if const { S::Real::LANES > 1 } {
            S::Real::work(self.isa, Trial { driver: &mut self.driver, end })
        } else {
            self.driver.trial_apart(end)
        }
    }

    /// Gives lanes that have spent their budgets an end that is not a number: they fail in this trial.
    #[cold]
    #[inline(never)]
    fn look_at_budgets(&mut self) {
        for lane in 0..S::Real::LANES {
            let t = self.driver.t().lane(lane);
            if self.jobs[lane].is_some() && self.budgets[lane].exceeded(self.trials, t) {
                self.end.set_lane(lane, f64::NAN);
            }
        }
    }

    /// Why a lane that failed in the last trial cannot go on.
    pub fn failure_of(&self, lane: usize) -> Failure {
        if self.end.lane(lane).is_nan() {
            return Failure::EverShorter { t: self.driver.t().lane(lane) };
        }
        self.driver.failure_of(lane)
    }

    /// Lanes that are at their end.
    #[inline(always)]
    pub fn arrived(&self) -> S::Mask {
        let left = self.end - self.driver.t();
        S::Real::zero().less(left).not()
    }
}

/// Does what is worth the best instructions over packets; for a single trajectory a method's kernel alone
/// is.
#[inline(always)]
pub fn work<R: Real, W: Work>(isa: Isa, work: W) -> W::Output {
    if const { R::LANES > 1 } { R::work(isa, work) } else { work.run::<Plain>() }
}

struct Trial<'a, M, S: Scalar, const D: usize, E, K> {
    driver: &'a mut Integrator<M, S, D, E, K>,
    end: S::Real,
}

impl<M, S, const D: usize, E, K> Work for Trial<'_, M, S, D, E, K>
where
    S: Scalar,
    M: System<S, D>,
    E: ErrorNorm<S, D> + Copy,
    K: Method<S, D>,
{
    type Output = Progress<S::Mask>;

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Progress<S::Mask> {
        self.driver.trial(self.end)
    }
}
