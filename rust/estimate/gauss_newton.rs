//! The minimum, by Gauss-Newton with Levenberg-Marquardt damping.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::linearise::invert;
use super::link_response::Transition;
use super::{
    Bordered, EstimateError, Estimator, FreeParameter, Linearisation, ReducedSystem, Sensor, Unknowns,
};
use crate::analysis::CancelFlag;
use crate::model::Family;

/// Trials of one step, ever shorter.
const MOST_TRIALS: i32 = 12;
/// The shortest part of a full step that is tried before its parameters are damped.
const SHORTEST: f64 = 0.25;
/// Damping beyond which parameters no longer move.
const MOST_DAMPING: f64 = 1e4;
/// So many steps in a row without gain are the end.
const ENOUGH: usize = 3;

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// The most linearisations.
    pub iterations: usize,
    /// Converged when a full step promises to lower the cost by less than this (in units of chi^2).
    pub decrease: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { iterations: 30, decrease: 0.01 }
    }
}

/// The sum of squares that is minimised, by its parts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// The misfits', in units of their assumed noise.
    pub misfit: f64,
    /// The defects', in units of the model's assumed error.
    pub defect: f64,
    /// Of the priors.
    pub prior: f64,
}

impl Cost {
    pub fn total(&self) -> f64 {
        self.misfit + self.defect + self.prior
    }
}

/// A minimum and its surroundings.
#[derive(Clone, Debug)]
pub struct Solution<const D: usize, const M: usize> {
    pub point: Unknowns<D>,
    /// The record linearised around it.
    pub linear: Arc<Linearisation<D, M>>,
    pub cost: Cost,
    pub converged: bool,
    pub iterations: usize,
    /// Logarithm of the likelihood of the record, states and free parameters integrated out around the minimum
    /// next to this point; a constant that depends on neither noise nor model is left out. Parameters without a
    /// prior count as with one of a standard deviation of 1.
    pub evidence: f64,
    /// Covariance of the free parameters.
    pub covariance: DMatrix<f64>,
    /// Covariance of each frame's state.
    pub state_covariance: Vec<SMatrix<f64, D, D>>,
    /// Observation minus prediction by model and camera, per frame.
    pub misfit: Vec<SVector<f64, M>>,
    /// The variance of the estimate of what was seen, per frame and channel.
    pub seen_variance: Vec<SVector<f64, M>>,
    /// The state less what the model makes of the one before, per link.
    pub defect: Vec<SVector<f64, D>>,
}

/// A point, the record linearised around it, and its cost.
struct Iterate<const D: usize, const M: usize> {
    point: Unknowns<D>,
    linear: Arc<Linearisation<D, M>>,
    cost: Cost,
}

/// A step of the states and the free parameters.
struct Step<const D: usize> {
    states: Vec<SVector<f64, D>>,
    parameters: DVector<f64>,
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// The inverse variance of the model error over each link; the value for padding states has no effect.
    pub fn precision(&self) -> Vec<SVector<f64, D>> {
        let t = &self.record.t;
        let live = self.live();
        let mut all: Vec<SVector<f64, D>> = vec![SVector::repeat(1.0); t.len().saturating_sub(1)];
        for i in 0..all.len() {
            for k in 0..live {
                all[i][k] = (self.diffusion[k].powi(2) * (t[i + 1] - t[i])).recip();
            }
        }
        all
    }

    /// The cost at a point around which the record is linearised.
    fn cost(&self, point: &Unknowns<D>, linear: &Linearisation<D, M>) -> Cost {
        let mut cost = Cost {
            misfit: self.misfit_cost(&linear.misfits()),
            defect: self.defect_cost(&linear.flow),
            ..Cost::default()
        };
        for free in &self.free {
            cost.prior += ((point.get(free) - free.mean) / free.sd).powi(2);
        }
        cost
    }

    fn defect_cost(&self, flow: &[Transition<D>]) -> f64 {
        let precision = self.precision();
        let mut cost = 0.0;
        for i in 0..flow.len() {
            if self.record.linked[i] {
                let defect = &flow[i].defect;
                cost += defect.component_mul(defect).dot(&precision[i]);
            }
        }
        cost
    }

    /// The point with its linearisation if its cost is at most `limit`; otherwise the memory, for the next trial.
    #[allow(clippy::type_complexity, reason = "memory that is returned is no error")]
    fn look(
        &self,
        point: Unknowns<D>,
        room: Linearisation<D, M>,
        limit: f64,
    ) -> Result<Result<Iterate<D, M>, Linearisation<D, M>>, EstimateError> {
        // The defects alone reject most points that are too far off.
        let linear = match self.linearise_if(&point, room, |flow| self.defect_cost(flow) <= limit)? {
            Ok(linear) => linear,
            Err(rejected) => return Ok(Err(rejected)),
        };
        let cost = self.cost(&point, &linear);
        let accepted = cost.total() <= limit;
        Ok(if accepted { Ok(Iterate { point, linear: Arc::new(linear), cost }) } else { Err(linear) })
    }

    /// Adds the free parameters' priors to normal equations at a point, and fixes padding states.
    pub(super) fn add_priors(&self, point: &Unknowns<D>, system: &mut Bordered<D>) {
        for (j, free) in self.free.iter().enumerate() {
            system.prior(j, point.get(free), free.mean, free.sd);
        }
        system.hold(self.family.idle());
    }

    /// Minimises the cost from a start.
    pub fn solve(
        &self,
        start: Unknowns<D>,
        options: &Options,
        stop: &CancelFlag,
    ) -> Result<Solution<D, M>, EstimateError> {
        let linear = self.around(&start)?;
        let mut here = Iterate { cost: self.cost(&start, &linear), point: start, linear };
        let (precision, mut room, mut spare) =
            (self.precision(), Bordered::empty(), Linearisation::default());
        let mut damping = 0.0;
        let mut still = 0;
        let mut iteration = 0;
        loop {
            iteration += 1;
            stop.check().map_err(|_| EstimateError::Cancelled)?;
            let linear = &here.linear;
            let mut system = room.anew(linear, &linear.columns, &self.record, &precision);
            self.add_priors(&here.point, &mut system);
            let reduced = system.eliminate(&self.record.t)?;
            let full = self.step(&reduced, 0.0)?;
            let promise = reduced.promise(&full.parameters);
            let done = promise < options.decrease || still == ENOUGH;
            // The remaining gain at the end; at a kink it cannot be reached.
            let left = if promise < options.decrease { promise } else { 0.0 };
            if done || iteration > options.iterations {
                return self.finish(here, &reduced, left, (iteration, done));
            }
            let Some(lower) = self.lower(&here, &reduced, full, &mut damping, spare)? else {
                return self.finish(here, &reduced, left, (iteration, true));
            };
            // At a kink of the law the cost has one too: there full steps keep promising more than they hold.
            let gained = here.cost.total() - lower.cost.total();
            still = if gained < options.decrease { still + 1 } else { 0 };
            spare = room_of(std::mem::replace(&mut here, lower).linear);
            room = reduced.into_room();
        }
    }

    /// A point of lower cost, on the way of the full step.
    ///
    /// A step that does not lower the cost, or leaves a parameter's range, is shortened. Along what the data hardly
    /// determine, the misfits' curvature makes it too long, and damping would all but stop it. Then it is damped
    /// ever more strongly.
    fn lower(
        &self,
        here: &Iterate<D, M>,
        reduced: &ReducedSystem<D>,
        full: Step<D>,
        damping: &mut f64,
        mut room: Linearisation<D, M>,
    ) -> Result<Option<Iterate<D, M>>, EstimateError> {
        let mut step = if *damping == 0.0 { full } else { self.step(reduced, *damping)? };
        let mut length = 1.0;
        for trial in 1..=MOST_TRIALS {
            let moved = self.moved(&here.point, &step, length);
            let looked = if self.free.iter().all(|free| free.allows(moved.get(free))) {
                self.look(moved, std::mem::take(&mut room), here.cost.total())
            } else {
                Ok(Err(std::mem::take(&mut room)))
            };
            match looked {
                Ok(Ok(lower)) => {
                    *damping = if *damping < 1e-2 { 0.0 } else { *damping * 0.1 };
                    return Ok(Some(lower));
                }
                Ok(Err(rejected)) => room = rejected,
                Err(_) => {}
            }
            if trial == MOST_TRIALS {
                break;
            }
            if *damping == 0.0 && length > SHORTEST {
                length *= 0.5;
                continue;
            }
            *damping = if *damping == 0.0 { 1e-2 } else { *damping * 10.0 };
            step = self.step(reduced, *damping)?;
            // Where damped parameters do not help it is the states that go too far.
            length = if *damping > MOST_DAMPING { 0.5_f64.powi(trial) } else { 1.0 };
        }
        Ok(None)
    }

    /// The step to the minimum of the linearised problem; the parameters damped.
    fn step(&self, reduced: &ReducedSystem<D>, damping: f64) -> Result<Step<D>, EstimateError> {
        let mut information = reduced.schur.clone();
        for j in 0..information.nrows() {
            information[(j, j)] *= 1.0 + damping;
        }
        let inverse = invert(&information).ok_or_else(|| undetermined(&self.free, &reduced.schur))?;
        let parameters = inverse * &reduced.gradient;
        Ok(Step { states: reduced.states(&parameters), parameters })
    }

    /// A point moved by a part of a step.
    fn moved(&self, point: &Unknowns<D>, step: &Step<D>, length: f64) -> Unknowns<D> {
        let mut moved = point.clone();
        for i in 0..moved.states.len() {
            for k in 0..D {
                moved.states[i][k] += length * step.states[i][k];
            }
        }
        for (free, &change) in self.free.iter().zip(step.parameters.iter()) {
            moved.shift(free, length * change);
        }
        moved
    }

    /// Collects the results at a point whose cost is above the minimum by `left`.
    fn finish(
        &self,
        Iterate { point, linear, cost }: Iterate<D, M>,
        reduced: &ReducedSystem<D>,
        left: f64,
        (iterations, converged): (usize, bool),
    ) -> Result<Solution<D, M>, EstimateError> {
        let covariance = invert(&reduced.schur).ok_or_else(|| undetermined(&self.free, &reduced.schur))?;
        let uncertain = reduced.uncertain(&covariance);
        Ok(Solution {
            point,
            cost,
            converged,
            iterations,
            evidence: self.evidence(cost.total() - left, reduced.log_determinant, &reduced.schur),
            covariance,
            state_covariance: uncertain.covariance(),
            seen_variance: uncertain.seen(&linear),
            misfit: linear.misfits(),
            defect: linear.defects(),
            linear,
        })
    }
}

/// The room that a linearisation took, where nobody else has it.
fn room_of<const D: usize, const M: usize>(linear: Arc<Linearisation<D, M>>) -> Linearisation<D, M> {
    Arc::try_unwrap(linear).unwrap_or_default()
}

/// Where a matrix of information has no inverse: the parameters that can change together.
pub(super) fn undetermined(free: &[FreeParameter], information: &DMatrix<f64>) -> EstimateError {
    let n = free.len().min(information.nrows());
    let scale: Vec<f64> = (0..n).map(|j| information[(j, j)].max(f64::MIN_POSITIVE).sqrt().recip()).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| information[(i, j)] * scale[i] * scale[j]);
    let found = scaled.symmetric_eigen();
    let least = found.eigenvalues.imin();
    let direction = found.eigenvectors.column(least);
    // Those that take part in the direction along which nothing changes.
    let strong = direction.amax() * 0.1;
    let parts = (0..n).filter(|&j| direction[j].abs() >= strong);
    EstimateError::Undetermined(parts.collect())
}
