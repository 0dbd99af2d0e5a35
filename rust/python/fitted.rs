//! The estimator whatever its family and its sensor: plain numbers in, plain numbers out. The code on Python's side
//! is compiled once.
//!
//! For user-defined models with more than four states the estimator is compiled for twelve: smaller models get
//! unobserved padding states at the end. Here these are added to what comes in, and cut from what goes out.

use std::sync::Arc;

use nalgebra::{SMatrix, SVector};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::errors::room_for;
use super::jobs;
use super::linearisation_cache::Linearised;
use super::model::AnyModel;
use crate::analysis::CancelFlag;
use crate::estimate::{
    AngleSensor, CachedLinearisation, Candidate, Cost, DiskCamera, EstimateError, Estimator, FilmParameters,
    FormulaSensor, FreeParameter, Options, ParameterJacobian, Record, Role, RowMatrix, Score, Sensor,
    Unknowns,
};
use crate::integrate::Tolerance;
use crate::model::{Either, Family, FormulaFamily};

/// A frame's flow is followed much more closely than the model's smallest assumed error.
const TOLERANCE: Tolerance = Tolerance::new(1e-7, 1e-9);

/// An array: its numbers in C order.
pub struct Array {
    pub shape: Vec<usize>,
    pub numbers: Vec<f64>,
}

impl Array {
    fn needs_columns(&self, wanted: usize, what: &str) -> PyResult<()> {
        if self.shape[1] == wanted {
            return Ok(());
        }
        Err(PyValueError::new_err(format!("{what} must have {wanted} columns, not {}", self.shape[1])))
    }
}

/// Frame by frame: time, what was seen, its information, whether the next frame is linked, which film it
/// belongs to; and the autocorrelation of each channel's noise from one frame to the next.
pub struct Data {
    pub t: Vec<f64>,
    pub seen: Array,
    pub information: Array,
    pub linked: Vec<bool>,
    pub film: Vec<usize>,
    pub autocorrelation: Vec<f64>,
}

/// All that makes a problem beside the model.
pub struct Asked<'a> {
    /// None where nothing was measured.
    pub data: Option<&'a Data>,
    pub states: &'a Array,
    pub sets: Vec<FilmParameters>,
    pub free: Vec<FreeParameter>,
    /// Plays no part where nothing was measured.
    pub diffusion: &'a [f64],
    /// The results of a solve at this point.
    pub linear: Option<&'a Linearised>,
}

impl Asked<'_> {
    /// Whether all fits together, for so many states and channels, and parameters of the model and of the camera.
    fn check(&self, (d, m): (usize, usize), (model, camera): (usize, usize)) -> PyResult<()> {
        let wrong = |what: String| Err(PyValueError::new_err(what));
        if let Some(data) = self.data {
            if self.diffusion.len() != d {
                return wrong(format!("diffusion must have {d} numbers"));
            }
            if data.information.shape[1..] != [m, m] {
                return wrong(format!("information must hold {m} x {m} matrices"));
            }
            data.seen.needs_columns(m, "seen")?;
            if data.autocorrelation.len() != m {
                return wrong("autocorrelation: one per channel".into());
            }
            let n = data.t.len();
            let others =
                [data.seen.shape[0], data.information.shape[0], data.film.len(), data.linked.len() + 1];
            if n == 0 || others.iter().any(|&length| length != n) {
                return wrong("t, seen, information, linked and film have different lengths".into());
            }
        }
        let fits = |set: &FilmParameters| set.model.len() == model && set.camera.len() == camera;
        if self.sets.is_empty() || !self.sets.iter().all(fits) {
            return wrong("every film needs the model's and the camera's parameters".into());
        }
        self.states.needs_columns(d, "states")?;
        let films = self.sets.len();
        if let Some(data) = self.data
            && (self.states.shape[0] != data.t.len() || data.film.iter().any(|&film| film >= films))
        {
            return wrong("states and parameters do not fit the record".into());
        }
        for free in &self.free {
            let (index, most) = match free.role {
                Role::Model(index) => (index, model),
                Role::Camera(index) => (index, camera),
                Role::Clock => (0, 1),
            };
            if index >= most || free.film.is_some_and(|film| film >= films) {
                return wrong(format!("there is no parameter {index} of {most}"));
            }
        }
        Ok(())
    }
}

/// The numbers of frames, free parameters, states and channels.
pub struct Size {
    pub frames: usize,
    pub free: usize,
    pub states: usize,
    pub channels: usize,
}

/// A solution, its arrays flat.
pub struct Solved {
    pub states: Vec<f64>,
    pub sets: Vec<FilmParameters>,
    pub covariance: Vec<f64>,
    pub state_covariance: Vec<f64>,
    pub misfit: Vec<f64>,
    pub seen_variance: Vec<f64>,
    pub defect: Vec<f64>,
    pub cost: Cost,
    pub evidence: f64,
    pub converged: bool,
    pub iterations: usize,
    pub linear: Linearised,
}

/// An estimator at a point; see the methods of the same names in `rust/estimate`. Arrays are flat.
pub trait Fitted: Send + Sync {
    fn size(&self) -> Size;
    fn solve(self: Box<Self>, options: &Options, stop: &CancelFlag) -> Result<Solved, EstimateError>;
    /// The candidates: wider models of the same kind, and which of their parameters are amplitudes.
    fn score(&self, candidates: Vec<(AnyModel, Vec<usize>)>) -> PyResult<Score>;
    /// The columns: what they add to the states at the links' ends.
    fn score_groups(&self, state: RowMatrix, groups: &[usize]) -> Result<Vec<Score>, EstimateError>;
    /// Times, states and responses.
    fn places(&self) -> Result<[Vec<f64>; 3], EstimateError>;
    /// The states at the first and at the last frames, and the covariances there.
    fn filter(&self, windows: &[(usize, usize)], stop: &CancelFlag) -> Result<[Vec<f64>; 3], EstimateError>;
    /// `vague`: one per state.
    fn innovations(&self, vague: &[f64]) -> Result<Vec<f64>, EstimateError>;
    /// After the point's states, which are the starts, of these films at these times.
    fn predict(&self, film: &[usize], t0: &[f64], times: &[Vec<f64>]) -> Result<Vec<f64>, EstimateError>;
}

/// An estimator at a point, and the test for a model of the same kind.
pub struct Fit<F: Family<D>, C: Sensor<D, M>, const D: usize, const M: usize> {
    pub estimator: Estimator<F, C, D, M>,
    pub point: Unknowns<D>,
    own: fn(AnyModel) -> Option<(F, Vec<f64>)>,
}

/// Adds padding states up to a number that the estimator is compiled for, at least the number of channels.
fn filled(model: AnyModel) -> AnyModel {
    let Some(family) = model.widest() else { return model };
    let (states, channels) = (family.states().len(), family.observation().len());
    match states {
        1..=4 if channels <= states => model,
        _ => AnyModel::Twelve(family, model.values().to_vec()),
    }
}

/// The problem that is asked of a model.
pub fn fitted(model: AnyModel, asked: Asked<'_>) -> PyResult<Box<dyn Fitted>> {
    macro_rules! of {
        ($($kind:pat => $told:expr, $problem:expr;)+) => {
            match filled(model) {
                $($kind => {
                    let own = |model| match filled(model) {
                        $kind => Some($told),
                        _ => None,
                    };
                    Box::new(problem($problem, own, asked)?) as Box<dyn Fitted>
                })+
                _ => return Err(PyValueError::new_err("a camera sees a disk or a pendulum")),
            }
        };
    }
    Ok(of! {
        AnyModel::Four(Either::First(family), values) => (family, values), (family, &values, DiskCamera);
        AnyModel::Two(Either::First(family), values) => (family, values), (family, &values, AngleSensor);
        AnyModel::Two(Either::Second(family), values) => (family, values), with_sensor(family, &values);
        AnyModel::Three(Either::Second(family), values) => (family, values), with_sensor(family, &values);
        AnyModel::Four(Either::Second(family), values) => (family, values), with_sensor(family, &values);
        AnyModel::Twelve(family, values) => (family, values), with_sensor(family, &values);
    })
}

/// A user's own model with what sees its states.
fn with_sensor<const D: usize>(
    family: FormulaFamily<D>,
    values: &[f64],
) -> (FormulaFamily<D>, &[f64], FormulaSensor<D>) {
    let sensor = FormulaSensor::of(&family);
    (family, values, sensor)
}

/// The same for one family and one sensor.
pub fn problem<F, C, const D: usize, const M: usize>(
    (family, values, sensor): (F, &[f64], C),
    own: fn(AnyModel) -> Option<(F, Vec<f64>)>,
    asked: Asked<'_>,
) -> PyResult<Fit<F, C, D, M>>
where
    F: Family<D> + 'static,
    C: Sensor<D, M> + 'static,
{
    let (d, m) = (D - family.idle(), sensor.channels());
    asked.check((d, m), (values.len(), C::PARAMETERS.len()))?;
    let mut record = Record::default();
    if let Some(data) = asked.data {
        // Two linearisations with their columns, the normal equations, and covariances of the states.
        let numbers = 8 * D * D + 4 * (D + M) * (asked.free.len() + 8);
        room_for(&format!("{} frames", data.t.len()), data.t.len() as f64 * numbers as f64 * 8.0)?;
        (record.t, record.linked, record.film) = (data.t.clone(), data.linked.clone(), data.film.clone());
        record.memory[..m].copy_from_slice(&data.autocorrelation);
        record.seen = padded(&data.seen.numbers, m).into_iter().map(SVector::from).collect();
        for information in data.information.numbers.chunks_exact(m * m) {
            let number = |r, c| if r < m && c < m { information[m * r + c] } else { 0.0 };
            record.information.push(SMatrix::from_fn(number));
        }
    }
    let mut diffusion = [1.0; D];
    if asked.data.is_some() {
        diffusion[..d].copy_from_slice(asked.diffusion);
    }
    let point = Unknowns { states: padded(&asked.states.numbers, d), sets: asked.sets };
    let tolerance = TOLERANCE;
    let mut estimator =
        Estimator { family, sensor, record, free: asked.free, diffusion, tolerance, known: None };
    estimator.known = asked.linear.and_then(|linear| linear.known(&estimator));
    Ok(Fit { estimator, point, own })
}

impl<F, C, const D: usize, const M: usize> Fit<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// The numbers of live states and channels.
    fn live(&self) -> (usize, usize) {
        (D - self.estimator.family.idle(), self.estimator.sensor.channels())
    }
}

impl<F, C, const D: usize, const M: usize> Fitted for Fit<F, C, D, M>
where
    F: Family<D> + 'static,
    C: Sensor<D, M> + 'static,
{
    fn size(&self) -> Size {
        let (frames, free) = (self.estimator.record.t.len(), self.estimator.free.len());
        let (states, channels) = self.live();
        Size { frames, free, states, channels }
    }

    fn solve(self: Box<Self>, options: &Options, stop: &CancelFlag) -> Result<Solved, EstimateError> {
        let (d, m) = self.live();
        let Self { estimator, point, .. } = *self;
        let s = estimator.solve(point, options, stop)?;
        Ok(Solved {
            states: rows(&s.point.states, d),
            sets: s.point.sets.clone(),
            covariance: s.covariance.as_slice().to_vec(),
            state_covariance: numbers(&s.state_covariance, (d, d)),
            misfit: numbers(&s.misfit, (m, 1)),
            seen_variance: numbers(&s.seen_variance, (m, 1)),
            defect: numbers(&s.defect[..estimator.record.t.len() - 1], (d, 1)),
            cost: s.cost,
            evidence: s.evidence,
            converged: s.converged,
            iterations: s.iterations,
            linear: Linearised::new(
                estimator,
                CachedLinearisation { point: Arc::new(s.point), linear: s.linear },
            ),
        })
    }

    fn score(&self, candidates: Vec<(AnyModel, Vec<usize>)>) -> PyResult<Score> {
        let own = self.point.sets[0].model.len();
        let mut all = Vec::with_capacity(candidates.len());
        for (model, indices) in candidates {
            let Some((family, values)) = (self.own)(model) else {
                return Err(PyValueError::new_err("a candidate is a model of another kind"));
            };
            let (more, amplitudes) = added(&values, own, &indices)?;
            all.push(Candidate { family, more, amplitudes });
        }
        Ok(self.estimator.score(&self.point, &all)?)
    }

    fn score_groups(&self, state: RowMatrix, groups: &[usize]) -> Result<Vec<Score>, EstimateError> {
        let (seen, live) =
            (RowMatrix::zeros(self.estimator.record.t.len() * M, state.width()), self.live().0);
        let mut all = RowMatrix::zeros(state.count() / live * D, state.width());
        for i in 0..state.count() {
            all.row_mut(i / live * D + i % live).copy_from_slice(state.row(i));
        }
        let state = all;
        self.estimator.score_groups(&self.point, &ParameterJacobian { seen, state }, groups)
    }

    fn places(&self) -> Result<[Vec<f64>; 3], EstimateError> {
        let d = self.live().0;
        let (mut t, mut states, mut responses) = (Vec::new(), Vec::new(), Vec::new());
        for link in self.estimator.places(&self.point)? {
            for place in &link.places {
                t.push(place.t);
                states.extend_from_slice(&place.state[..d]);
                responses.push(place.response);
            }
        }
        Ok([t, states, numbers(&responses, (d, d))])
    }

    fn filter(&self, windows: &[(usize, usize)], stop: &CancelFlag) -> Result<[Vec<f64>; 3], EstimateError> {
        let d = self.live().0;
        let (mut first, mut last, mut covariance) = (Vec::new(), Vec::new(), Vec::new());
        for end in self.estimator.filter(&self.point, windows, &Options::default(), stop)? {
            first.extend_from_slice(&end.first[..d]);
            last.extend_from_slice(&end.last[..d]);
            covariance.push(end.covariance);
        }
        Ok([first, last, numbers(&covariance, (d, d))])
    }

    fn innovations(&self, vague: &[f64]) -> Result<Vec<f64>, EstimateError> {
        let mut all = [1.0; D];
        all[..vague.len()].copy_from_slice(vague);
        Ok(rows(&self.estimator.innovations(&self.point, &all)?, self.live().1))
    }

    fn predict(&self, film: &[usize], t0: &[f64], times: &[Vec<f64>]) -> Result<Vec<f64>, EstimateError> {
        let mut starts = Vec::with_capacity(times.len());
        for i in 0..times.len() {
            starts.push((film[i], t0[i], self.point.states[i]));
        }
        let mut all = Vec::new();
        for seen in self.estimator.predict(&self.point.sets, &starts, times)? {
            all.extend(rows(&seen, self.live().1));
        }
        Ok(all)
    }
}

/// The values that a candidate has in addition to the model, and its amplitudes.
fn added(values: &[f64], own: usize, indices: &[usize]) -> PyResult<(Vec<f64>, Vec<Role>)> {
    if values.len() < own || indices.iter().any(|&index| index >= values.len()) {
        return Err(PyValueError::new_err("a candidate has no parameter of that number"));
    }
    Ok((values[own..].to_vec(), indices.iter().map(|&index| Role::Model(index)).collect()))
}

/// Rows of so many numbers, filled up with zeros.
fn padded<const D: usize>(numbers: &[f64], live: usize) -> Vec<[f64; D]> {
    let mut all = vec![[0.0; D]; numbers.len() / live];
    for (row, numbers) in all.iter_mut().zip(numbers.chunks_exact(live)) {
        row[..live].copy_from_slice(numbers);
    }
    all
}

/// The first so many numbers of every row.
fn rows<const D: usize>(rows: &[[f64; D]], live: usize) -> Vec<f64> {
    jobs::live(rows.as_flattened().to_vec(), D, live)
}

/// The numbers of small matrices in C order, of the first so many rows and columns.
fn numbers<const A: usize, const B: usize>(
    blocks: &[SMatrix<f64, A, B>],
    (height, width): (usize, usize),
) -> Vec<f64> {
    let mut all = Vec::with_capacity(height * width * blocks.len());
    for block in blocks {
        for i in 0..height {
            for j in 0..width {
                all.push(block[(i, j)]);
            }
        }
    }
    all
}
