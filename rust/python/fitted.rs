//! The estimator whatever its family and its sensor: plain numbers in, plain numbers out. What is on Python's side
//! of it is compiled once.

use std::sync::Arc;

use nalgebra::{SMatrix, SVector};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

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
const TOLERANCE: Tolerance = Tolerance { rtol: 1e-7, atol: 1e-9 };

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
    /// What a solve left at this point.
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

/// An estimator at a point, and how a model of its own kind is told from others.
pub struct Fit<F: Family<D>, C: Sensor<D, M>, const D: usize, const M: usize> {
    pub estimator: Estimator<F, C, D, M>,
    pub point: Unknowns<D>,
    own: fn(AnyModel) -> Option<(F, Vec<f64>)>,
}

/// The problem that is asked of a model.
pub fn fitted(model: AnyModel, asked: Asked<'_>) -> PyResult<Box<dyn Fitted>> {
    macro_rules! of {
        ($($kind:pat => $told:expr, $problem:expr;)+) => {
            match model {
                $($kind => {
                    let own = |model| match model {
                        $kind => Some($told),
                        _ => None,
                    };
                    Box::new(problem($problem, own, asked)?) as Box<dyn Fitted>
                })+
                AnyModel::Five(Either::Second(_), _) | AnyModel::Six(..) => {
                    return Err(PyValueError::new_err("a model that is fitted has at most 4 states"));
                }
                _ => return Err(PyValueError::new_err("a camera sees a disk or a pendulum")),
            }
        };
    }
    Ok(of! {
        AnyModel::Four(Either::First(family), values) => (family, values), (family, &values, DiskCamera);
        AnyModel::Two(Either::First(family), values) => (family, values), (family, &values, AngleSensor);
        AnyModel::One(family, values) => (family, values), with_sensor(family, &values);
        AnyModel::Two(Either::Second(family), values) => (family, values), with_sensor(family, &values);
        AnyModel::Three(Either::Second(family), values) => (family, values), with_sensor(family, &values);
        AnyModel::Four(Either::Second(family), values) => (family, values), with_sensor(family, &values);
    })
}

/// A user's own model with what sees its states.
fn with_sensor<const D: usize>(
    family: FormulaFamily<D>,
    values: &[f64],
) -> (FormulaFamily<D>, &[f64], FormulaSensor<D>) {
    let states = family.states();
    let mut angles = [false; D];
    for n in 0..D {
        angles[n] = states[n].1;
    }
    let observation = family.observation().clone();
    (family, values, FormulaSensor { observation, angles })
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
    let m = sensor.channels();
    asked.check((D, m), (values.len(), C::PARAMETERS.len()))?;
    let mut record = Record::default();
    if let Some(data) = asked.data {
        (record.t, record.linked, record.film) = (data.t.clone(), data.linked.clone(), data.film.clone());
        record.memory[..m].copy_from_slice(&data.autocorrelation);
        // Channels that there are not have no information.
        for (seen, information) in data.seen.numbers.chunks(m).zip(data.information.numbers.chunks(m * m)) {
            record.seen.push(SVector::from_fn(|i, _| seen.get(i).copied().unwrap_or(0.0)));
            let there = |i, j| if i < m && j < m { information[m * i + j] } else { 0.0 };
            record.information.push(SMatrix::from_fn(there));
        }
    }
    let mut diffusion = [1.0; D];
    if asked.data.is_some() {
        diffusion.copy_from_slice(asked.diffusion);
    }
    let point = Unknowns { states: asked.states.numbers.as_chunks().0.to_vec(), sets: asked.sets };
    let tolerance = TOLERANCE;
    let mut estimator =
        Estimator { family, sensor, record, free: asked.free, diffusion, tolerance, known: None };
    estimator.known = asked.linear.and_then(|linear| linear.known(&estimator));
    Ok(Fit { estimator, point, own })
}

impl<F, C, const D: usize, const M: usize> Fitted for Fit<F, C, D, M>
where
    F: Family<D> + 'static,
    C: Sensor<D, M> + 'static,
{
    fn size(&self) -> Size {
        let (frames, free) = (self.estimator.record.t.len(), self.estimator.free.len());
        Size { frames, free, states: D, channels: self.estimator.sensor.channels() }
    }

    fn solve(self: Box<Self>, options: &Options, stop: &CancelFlag) -> Result<Solved, EstimateError> {
        let Self { estimator, point, .. } = *self;
        let m = estimator.sensor.channels();
        let s = estimator.solve(point, options, stop)?;
        Ok(Solved {
            states: s.point.states.as_flattened().to_vec(),
            sets: s.point.sets.clone(),
            covariance: s.covariance.as_slice().to_vec(),
            state_covariance: numbers(&s.state_covariance, D),
            misfit: numbers(&s.misfit, m),
            seen_variance: numbers(&s.seen_variance, m),
            defect: numbers(&s.defect[..estimator.record.t.len() - 1], D),
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
        let seen = RowMatrix::zeros(self.estimator.record.t.len() * M, state.width());
        self.estimator.score_groups(&self.point, &ParameterJacobian { seen, state }, groups)
    }

    fn places(&self) -> Result<[Vec<f64>; 3], EstimateError> {
        let (mut t, mut states, mut responses) = (Vec::new(), Vec::new(), Vec::new());
        for link in self.estimator.places(&self.point)? {
            for place in &link.places {
                t.push(place.t);
                states.extend_from_slice(&place.state);
                responses.push(place.response);
            }
        }
        Ok([t, states, numbers(&responses, D)])
    }

    fn filter(&self, windows: &[(usize, usize)], stop: &CancelFlag) -> Result<[Vec<f64>; 3], EstimateError> {
        let (mut first, mut last, mut covariance) = (Vec::new(), Vec::new(), Vec::new());
        for end in self.estimator.filter(&self.point, windows, &Options::default(), stop)? {
            first.extend_from_slice(&end.first);
            last.extend_from_slice(&end.last);
            covariance.push(end.covariance);
        }
        Ok([first, last, numbers(&covariance, D)])
    }

    fn innovations(&self, vague: &[f64]) -> Result<Vec<f64>, EstimateError> {
        let vague = vague.first_chunk().expect("one per state");
        let m = self.estimator.sensor.channels();
        let mut all = Vec::new();
        for own in self.estimator.innovations(&self.point, vague)? {
            all.extend_from_slice(&own[..m]);
        }
        Ok(all)
    }

    fn predict(&self, film: &[usize], t0: &[f64], times: &[Vec<f64>]) -> Result<Vec<f64>, EstimateError> {
        let mut starts = Vec::with_capacity(times.len());
        for i in 0..times.len() {
            starts.push((film[i], t0[i], self.point.states[i]));
        }
        let m = self.estimator.sensor.channels();
        let mut all = Vec::new();
        for own in self.estimator.predict(&self.point.sets, &starts, times)?.iter().flatten() {
            all.extend_from_slice(&own[..m]);
        }
        Ok(all)
    }
}

/// What a candidate with these values has more than the model, and its amplitudes.
fn added(values: &[f64], own: usize, indices: &[usize]) -> PyResult<(Vec<f64>, Vec<Role>)> {
    if values.len() < own || indices.iter().any(|&index| index >= values.len()) {
        return Err(PyValueError::new_err("a candidate has no parameter of that number"));
    }
    Ok((values[own..].to_vec(), indices.iter().map(|&index| Role::Model(index)).collect()))
}

/// The numbers of small matrices' first rows in C order.
fn numbers<const A: usize, const B: usize>(blocks: &[SMatrix<f64, A, B>], rows: usize) -> Vec<f64> {
    let mut all = Vec::with_capacity(rows * B * blocks.len());
    for block in blocks {
        for i in 0..rows {
            for j in 0..B {
                all.push(block[(i, j)]);
            }
        }
    }
    all
}
