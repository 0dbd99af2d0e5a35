//! The minimum, by Gauss-Newton with Levenberg-Marquardt damping.

use nalgebra::{DMatrix, SMatrix, SVector};

use super::linearise::invert;
use super::{Bordered, EstimateError, Estimator, Point, Role, Sensor};
use crate::model::Family;
use crate::run::Stop;

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
    /// Of the misfits, in units of their assumed noise.
    pub misfit: f64,
    /// Of the defects, in units of the model's assumed error.
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
    pub point: Point<D>,
    pub cost: Cost,
    pub converged: bool,
    pub iterations: usize,
    /// Covariance of the free parameters.
    pub covariance: DMatrix<f64>,
    /// Covariance of each frame's state.
    pub state_covariance: Vec<SMatrix<f64, D, D>>,
    /// What was seen less what the model and the camera say, per frame.
    pub misfit: Vec<SVector<f64, M>>,
    /// The variance of the estimate of what was seen, per frame and channel.
    pub seen_variance: Vec<SVector<f64, M>>,
    /// The state less what the model makes of the one before, per link.
    pub defect: Vec<SVector<f64, D>>,
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// The parts that the free parameters play, in the order of the borders.
    pub fn roles(&self) -> Vec<Role> {
        self.free.iter().map(|free| free.role).collect()
    }

    /// The inverse variance of the model's error over each link.
    pub fn precision(&self) -> Vec<SVector<f64, D>> {
        let steps = self.record.t.windows(2).map(|pair| pair[1] - pair[0]);
        steps.map(|dt| SVector::from_fn(|k, _| (self.diffusion[k].powi(2) * dt).recip())).collect()
    }

    /// The cost of residuals at a point.
    fn cost(&self, point: &Point<D>, misfit: &[SVector<f64, M>], defect: &[SVector<f64, D>]) -> Cost {
        let mut cost = Cost::default();
        for (e, information) in misfit.iter().zip(&self.record.information) {
            cost.misfit += e.dot(&(information * e));
        }
        for ((r, q), &linked) in defect.iter().zip(&self.precision()).zip(&self.record.linked) {
            if linked {
                cost.defect += r.component_mul(r).dot(q);
            }
        }
        for free in &self.free {
            cost.prior += ((point.get(free.role) - free.mean) / free.sd).powi(2);
        }
        cost
    }

    /// The normal equations at a linearised point, priors included, from the first `free.len()`
    /// columns on.
    pub(super) fn equations(&self, point: &Point<D>, linear: &super::Linear<D, M>) -> Bordered<D> {
        let mut system = Bordered::new(linear, &self.record, &self.precision());
        for (j, free) in self.free.iter().enumerate() {
            system.prior(j, point.get(free.role), free.mean, free.sd);
        }
        system
    }

    /// Minimises the cost from a start.
    pub fn solve(
        &self,
        start: Point<D>,
        options: &Options,
        stop: &Stop,
    ) -> Result<Solution<D, M>, EstimateError> {
        let roles = self.roles();
        let mut point = start;
        let (misfit, defect) = self.residuals(&point)?;
        let mut cost = self.cost(&point, &misfit, &defect);
        let mut lambda = 0.0_f64;
        let mut iterations = 0;
        loop {
            stop.check().map_err(|_| EstimateError::Cancelled)?;
            let linear = self.linearise(&point, &roles)?;
            let system = self.equations(&point, &linear);
            let mut converged = false;
            let mut improved = false;
            // A step that does not lower the cost is damped more strongly and tried again.
            while !improved && !converged && iterations < options.iterations {
                iterations += 1;
                let mut damped = system.clone();
                damped.damp(lambda);
                let reduced = damped.eliminate(&self.record.t)?;
                let step = invert(&reduced.schur).ok_or_else(undetermined)? * &reduced.gradient;
                let states = reduced.states(&step);
                let promised = promise(&system, &states, &step);
                let mut trial = point.clone();
                for (x, change) in trial.states.iter_mut().zip(&states) {
                    for k in 0..D {
                        x[k] += change[k];
                    }
                }
                for (free, change) in self.free.iter().zip(step.iter()) {
                    *trial.get_mut(free.role) += change;
                }
                let tried = self.residuals(&trial).map(|(e, r)| self.cost(&trial, &e, &r));
                match tried {
                    Ok(new) if new.total().is_finite() && new.total() <= cost.total() + 1e-9 => {
                        let gained = cost.total() - new.total();
                        point = trial;
                        cost = new;
                        improved = true;
                        converged = lambda == 0.0 && promised.max(gained) < options.decrease;
                        lambda = if lambda < 1e-4 { 0.0 } else { lambda * 0.1 };
                    }
                    _ if promised < options.decrease => converged = true,
                    _ => lambda = if lambda == 0.0 { 1e-3 } else { lambda * 10.0 },
                }
                if lambda > 1e8 {
                    break;
                }
            }
            if converged || !improved || iterations >= options.iterations {
                return self.finish(point, iterations, converged);
            }
        }
    }

    /// The covariances at the minimum.
    fn finish(
        &self,
        point: Point<D>,
        iterations: usize,
        converged: bool,
    ) -> Result<Solution<D, M>, EstimateError> {
        let linear = self.linearise(&point, &self.roles())?;
        let reduced = self.equations(&point, &linear).eliminate(&self.record.t)?;
        let covariance = invert(&reduced.schur).ok_or_else(undetermined)?;
        let state_covariance = reduced.state_covariance(&covariance);
        let seen_variance =
            linear.h.iter().zip(&state_covariance).map(|(h, p)| (h * p * h.transpose()).diagonal()).collect();
        let cost = self.cost(&point, &linear.misfit, &linear.defect);
        Ok(Solution {
            point,
            cost,
            converged,
            iterations,
            covariance,
            state_covariance,
            misfit: linear.misfit,
            seen_variance,
            defect: linear.defect,
        })
    }
}

/// Where a matrix of information has no inverse.
pub(super) fn undetermined() -> EstimateError {
    EstimateError::Undetermined("some of them can change together without changing the fit".into())
}

/// By how much the linear model says a step lowers the cost.
fn promise<const D: usize>(
    system: &Bordered<D>,
    states: &[SVector<f64, D>],
    parameters: &nalgebra::DVector<f64>,
) -> f64 {
    // At the exact step the decrease is rhs . step; for a damped one this is a lower bound's scale.
    let states: f64 = system.rhs.iter().zip(states).map(|(b, x)| b.dot(x)).sum();
    states + system.corner_rhs.dot(parameters)
}
