//! A packet of trajectories, each with its own job, parameters, time and end.

use crate::integrate::{Driver, ErrorNorm, Method, Progress};
use crate::model::Family;
use crate::scalar::{Mask, Real, Scalar};

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

/// One [`Driver`] whose lanes are loaded and unloaded one by one.
pub struct Ship<'a, F: Family<D>, S: Scalar, const D: usize, E, K> {
    family: &'a F,
    values: Vec<S>,
    /// The packet under way.
    pub driver: Driver<F::Built<S>, S, D, E, K>,
    /// The job in each lane.
    jobs: Vec<Option<usize>>,
    /// Where each lane's run ends.
    pub end: S::Real,
}

impl<'a, F, S, const D: usize, E, K> Ship<'a, F, S, D, E, K>
where
    F: Family<D>,
    S: Scalar,
    E: ErrorNorm<S, D> + Copy,
    K: Method<S, D>,
{
    /// An empty ship, which needs some start to be built from.
    pub fn new(family: &'a F, method: impl FnOnce(Vec<S>) -> K, like: Start<'_, S, D>, norm: &E) -> Self {
        let values: Vec<S> = like.values.iter().map(|&value| S::constant(value)).collect();
        let t = S::Real::constant(like.t);
        let method = method(values.clone());
        let driver = Driver::by(method, family.build(&values), t, like.x, None, norm).with_wall();
        Self { family, values, driver, jobs: vec![None; S::Real::LANES], end: t }
    }

    /// Starts a job in a lane.
    pub fn load(&mut self, lane: usize, job: usize, start: Start<'_, S, D>) {
        for (own, &value) in self.values.iter_mut().zip(start.values) {
            let mut lanes = own.real();
            lanes.set_lane(lane, value);
            *own = S::lift(lanes);
        }
        self.driver.set_system(self.family.build(&self.values), &self.values);
        let only = S::Mask::from_lanes(|i| i == lane);
        self.driver.start(only, S::Real::constant(start.t), start.x, None);
        self.end.set_lane(lane, start.end);
        self.jobs[lane] = Some(job);
    }

    /// Ends the job in a lane, which from now on stays where it is.
    pub fn unload(&mut self, lane: usize) -> Option<usize> {
        self.end.set_lane(lane, self.driver.t().lane(lane));
        self.jobs[lane].take()
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
    pub fn is_empty(&self) -> bool {
        self.jobs.iter().all(Option::is_none)
    }

    /// Tries a step in every lane.
    #[inline(never)]
    pub fn trial(&mut self) -> Progress<S::Mask> {
        self.driver.trial(self.end)
    }

    /// Lanes that are at their end.
    #[inline(always)]
    pub fn arrived(&self) -> S::Mask {
        let left = self.end - self.driver.t();
        S::Real::zero().less(left).not()
    }
}
