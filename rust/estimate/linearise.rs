//! The record linearised around a point: residuals and their derivatives, from duals.

use std::array::from_fn;

use nalgebra::{Const, DMatrix, Dyn, OMatrix, SMatrix, SVector};
use rayon::prelude::*;

use super::bordered::Block;
use super::{EstimateError, Estimator, Point, Role, Sensor};
use crate::integrate::propagate;
use crate::model::{Family, System, sides_of};
use crate::scalar::{Dual, Scalar};

/// How many directions one pass differentiates in.
const WIDTH: usize = 12;
pub(super) type Wide = Dual<f64, WIDTH>;

/// Residuals and derivatives, frame by frame and link by link:
/// `misfit = seen - h` with `dh = h dx + g dtheta`, `defect = x_{i+1} - Phi` with
/// `dPhi = a dx + b dtheta`.
#[derive(Clone, Debug)]
pub struct Linear<const D: usize, const M: usize> {
    pub h: Vec<SMatrix<f64, M, D>>,
    pub g: Vec<OMatrix<f64, Const<M>, Dyn>>,
    pub misfit: Vec<SVector<f64, M>>,
    pub a: Vec<SMatrix<f64, D, D>>,
    pub b: Vec<Block<D>>,
    pub defect: Vec<SVector<f64, D>>,
}

impl<const D: usize, const M: usize> Linear<D, M> {
    /// The number of border columns.
    pub fn columns(&self) -> usize {
        self.g[0].ncols()
    }

    /// This linearisation with the columns of `other` set beside its own.
    pub fn beside(mut self, other: &Self) -> Self {
        let p = self.columns();
        let widen = p + other.columns();
        for (own, new) in self.g.iter_mut().zip(&other.g) {
            let mut wide = OMatrix::<f64, Const<M>, Dyn>::zeros(widen);
            wide.columns_mut(0, p).copy_from(own);
            wide.columns_mut(p, widen - p).copy_from(new);
            *own = wide;
        }
        for (own, new) in self.b.iter_mut().zip(&other.b) {
            let mut wide = Block::<D>::zeros(widen);
            wide.columns_mut(0, p).copy_from(own);
            wide.columns_mut(p, widen - p).copy_from(new);
            *own = wide;
        }
        self
    }
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// Linearises the record around a point with respect to the states and to `roles`.
    pub fn linearise(&self, point: &Point<D>, roles: &[Role]) -> Result<Linear<D, M>, EstimateError> {
        self.linearise_as(&self.family, point, roles, TimeOrigin::Record)
    }

    /// The same with another family, to which the point's model parameters belong.
    pub(super) fn linearise_as(
        &self,
        family: &F,
        point: &Point<D>,
        roles: &[Role],
        origin: TimeOrigin,
    ) -> Result<Linear<D, M>, EstimateError> {
        let frames: Vec<_> = (0..self.record.t.len())
            .into_par_iter()
            .map(|i| self.frame((family, origin), point, roles, i))
            .collect::<Result<_, _>>()?;
        let n = frames.len();
        let mut linear = Linear {
            h: Vec::with_capacity(n),
            g: Vec::with_capacity(n),
            misfit: Vec::with_capacity(n),
            a: Vec::with_capacity(n),
            b: Vec::with_capacity(n),
            defect: Vec::with_capacity(n),
        };
        for frame in frames {
            linear.h.push(frame.h);
            linear.g.push(frame.g);
            linear.misfit.push(frame.misfit);
            linear.a.push(frame.a);
            linear.b.push(frame.b);
            linear.defect.push(frame.defect);
        }
        Ok(linear)
    }

    /// Frame `i` and the link that leaves it, a pass for every few parameters.
    fn frame(
        &self,
        family: (&F, TimeOrigin),
        point: &Point<D>,
        roles: &[Role],
        i: usize,
    ) -> Result<Frame<D, M>, EstimateError> {
        let mut frame = Frame {
            h: SMatrix::zeros(),
            g: OMatrix::<f64, Const<M>, Dyn>::zeros(roles.len()),
            misfit: SVector::zeros(),
            a: SMatrix::zeros(),
            b: Block::zeros(roles.len()),
            defect: SVector::zeros(),
        };
        let linked = i + 1 < self.record.t.len() && self.record.linked[i];
        // The camera does not enter the flow: its columns need no integration.
        let (dynamic, camera): (Vec<usize>, Vec<usize>) =
            (0..roles.len()).partition(|&j| !matches!(roles[j], Role::Camera(_)));
        let mut passes: Vec<(&[usize], bool)> =
            dynamic.chunks(WIDTH - D).map(|chunk| (chunk, linked)).collect();
        if passes.is_empty() {
            passes.push((&[], linked));
        }
        passes.extend(camera.chunks(WIDTH - D).map(|chunk| (chunk, false)));
        for (chunk, flows) in passes {
            self.pass(family, point, (roles, chunk), i, flows, &mut frame)?;
        }
        Ok(frame)
    }

    fn pass(
        &self,
        (family, origin): (&F, TimeOrigin),
        point: &Point<D>,
        (roles, chunk): (&[Role], &[usize]),
        i: usize,
        flows: bool,
        frame: &mut Frame<D, M>,
    ) -> Result<(), EstimateError> {
        let mut model: Vec<Wide> = point.model.iter().map(|&v| Wide::constant(v)).collect();
        let mut camera: Vec<Wide> = point.camera.iter().map(|&v| Wide::constant(v)).collect();
        for (k, &j) in chunk.iter().enumerate() {
            match roles[j] {
                Role::Model(m) => model[m] = Wide::variable(point.model[m], D + k),
                Role::Camera(c) => camera[c] = Wide::variable(point.camera[c], D + k),
                Role::Clock => {}
            }
        }
        let system = family.build(&model);
        let x: [Wide; D] = from_fn(|k| Wide::variable(point.states[i][k], k));
        let pace = 1.0 + point.clock;
        let t = match origin {
            TimeOrigin::Record => self.record.t[i] * pace,
            TimeOrigin::Frame => 0.0,
        };

        let time = Wide::constant(t);
        let rate = system.rates(time, &x, &sides_of(&system, time, &x));
        let seen = self.sensor.observe(&camera, &x, &rate);
        frame.misfit = self.misfit(i, &seen.map(|s| s.re));
        for (m, seen) in seen.iter().enumerate() {
            for k in 0..D {
                frame.h[(m, k)] = seen.d[k];
            }
            for (k, &j) in chunk.iter().enumerate() {
                frame.g[(m, j)] = seen.d[D + k];
            }
        }
        if !flows {
            return Ok(());
        }

        let end = t + (self.record.t[i + 1] - self.record.t[i]) * pace;
        let there = propagate(&system, t, end, x, &self.tolerance)
            .map_err(|source| EstimateError::Integration { t: self.record.t[i], source })?;
        let time = Wide::constant(end);
        let arrival = system.rates(time, &there, &sides_of(&system, time, &there));
        for m in 0..D {
            frame.defect[m] = point.states[i + 1][m] - there[m].re;
            for k in 0..D {
                frame.a[(m, k)] = there[m].d[k];
            }
            for (k, &j) in chunk.iter().enumerate() {
                frame.b[(m, j)] = match roles[j] {
                    // A slower clock lets the flow run on for longer.
                    Role::Clock => arrival[m].re * (self.record.t[i + 1] - self.record.t[i]),
                    _ => there[m].d[D + k],
                };
            }
        }
        Ok(())
    }

    /// What was seen in frame `i` less what should have been.
    fn misfit(&self, i: usize, expected: &[f64; M]) -> SVector<f64, M> {
        SVector::from_fn(|m, _| {
            let difference = self.record.seen[i][m] - expected[m];
            if C::ANGLE[m] { wrap(difference) } else { difference }
        })
    }

    /// Residuals alone: `(misfit, defect)`.
    #[allow(clippy::type_complexity)]
    pub fn residuals(
        &self,
        point: &Point<D>,
    ) -> Result<(Vec<SVector<f64, M>>, Vec<SVector<f64, D>>), EstimateError> {
        let system = self.family.build(&point.model);
        let pace = 1.0 + point.clock;
        let n = self.record.t.len();
        let rows: Vec<_> = (0..n)
            .into_par_iter()
            .map(|i| {
                let (x, t) = (point.states[i], self.record.t[i] * pace);
                let rate = system.rates(t, &x, &sides_of(&system, t, &x));
                let seen = self.sensor.observe(&point.camera, &x, &rate);
                let misfit = self.misfit(i, &seen);
                if i + 1 == n || !self.record.linked[i] {
                    return Ok((misfit, SVector::zeros()));
                }
                let there = propagate(&system, t, self.record.t[i + 1] * pace, x, &self.tolerance)
                    .map_err(|source| EstimateError::Integration { t: self.record.t[i], source })?;
                Ok((misfit, SVector::from_fn(|m, _| point.states[i + 1][m] - there[m])))
            })
            .collect::<Result<_, EstimateError>>()?;
        Ok(rows.into_iter().unzip())
    }
}

/// From where time counts in the model's equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TimeOrigin {
    /// The record's own time.
    Record,
    /// Every frame's time starts at zero.
    Frame,
}

struct Frame<const D: usize, const M: usize> {
    h: SMatrix<f64, M, D>,
    g: OMatrix<f64, Const<M>, Dyn>,
    misfit: SVector<f64, M>,
    a: SMatrix<f64, D, D>,
    b: Block<D>,
    defect: SVector<f64, D>,
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
