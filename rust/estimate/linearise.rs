//! The record linearised around a point: residuals and their derivatives, from duals.

use std::array::from_fn;

use nalgebra::{DMatrix, SMatrix, SVector};
use rayon::prelude::*;

use super::columns::{Columns, TimeOrigin};
use super::flow::Link;
use super::{EstimateError, Estimator, Point, Sensor};
use crate::model::{Family, System, sides_of};
use crate::scalar::{Dual, Scalar};

/// A frame's residual `misfit = seen - h`, and `dh/dx`.
#[derive(Clone, Copy, Debug)]
pub struct Sight<const D: usize, const M: usize> {
    pub misfit: SVector<f64, M>,
    pub h: SMatrix<f64, M, D>,
}

/// Residuals and derivatives, frame by frame and link by link; the columns are those of parameters.
#[derive(Clone, Debug)]
pub struct Linear<const D: usize, const M: usize> {
    pub sights: Vec<Sight<D, M>>,
    pub flow: Vec<Link<D>>,
    pub columns: Columns,
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// Linearises the record around a point with respect to the states and to the free parameters.
    pub fn linearise(&self, point: &Point<D>) -> Result<Linear<D, M>, EstimateError> {
        let flow = self.flow(point)?;
        let values: Vec<Vec<f64>> = point.sets.iter().map(|set| set.model.clone()).collect();
        let columns = self.columns(point, &flow, (&self.family, &values), &self.free, TimeOrigin::Record);
        Ok(Linear { sights: self.sights(point), flow, columns })
    }

    fn sights(&self, point: &Point<D>) -> Vec<Sight<D, M>> {
        let systems: Vec<F::Built<Dual<f64, D>>> = self.systems(point);
        let one = |i: usize| {
            let film = self.record.film[i];
            let set = &point.sets[film];
            let camera: Vec<Dual<f64, D>> = set.camera.iter().map(|&v| Dual::constant(v)).collect();
            let t = Dual::constant(self.record.t[i] * set.pace());
            let x: [Dual<f64, D>; D] = from_fn(|k| Dual::variable(point.states[i][k], k));
            let rate = systems[film].rates(t, &x, &sides_of(&systems[film], t, &x));
            let seen = self.sensor.observe(&camera, &x, &rate);
            Sight { misfit: self.misfit(i, &seen.map(|s| s.re)), h: SMatrix::from_fn(|m, k| seen[m].d[k]) }
        };
        (0..self.record.t.len()).into_par_iter().map(one).collect()
    }

    /// What was seen in frame `i` less what should have been.
    fn misfit(&self, i: usize, expected: &[f64; M]) -> SVector<f64, M> {
        SVector::from_fn(|m, _| {
            let difference = self.record.seen[i][m] - expected[m];
            if self.sensor.is_angle(m) { wrap(difference) } else { difference }
        })
    }

    /// Residuals alone: `(misfit, defect)`.
    #[allow(clippy::type_complexity)]
    pub fn residuals(
        &self,
        point: &Point<D>,
    ) -> Result<(Vec<SVector<f64, M>>, Vec<SVector<f64, D>>), EstimateError> {
        let systems: Vec<F::Built<f64>> = self.systems(point);
        let one = |i: usize| {
            let film = self.record.film[i];
            let set = &point.sets[film];
            let (x, t) = (&point.states[i], self.record.t[i] * set.pace());
            let rate = systems[film].rates(t, x, &sides_of(&systems[film], t, x));
            self.misfit(i, &self.sensor.observe(&set.camera, x, &rate))
        };
        let misfits = (0..self.record.t.len()).into_par_iter().map(one).collect();
        Ok((misfits, self.defects(point)?))
    }
}

/// The angle modulo a turn, nearest to zero.
fn wrap(angle: f64) -> f64 {
    angle - (angle / std::f64::consts::TAU).round() * std::f64::consts::TAU
}

/// The covariance that belongs to a symmetric matrix of information; none where it is singular.
pub(super) fn invert(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    // Scaled to a unit diagonal, so that units do not decide what counts as singular.
    let n = information.nrows();
    if n == 0 {
        return Some(DMatrix::zeros(0, 0));
    }
    let scale: Vec<f64> = (0..n).map(|j| information[(j, j)].max(f64::MIN_POSITIVE).sqrt().recip()).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| information[(i, j)] * scale[i] * scale[j]);
    let inverse = nalgebra::Cholesky::new(scaled)?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
