//! The estimator's door to Python: arrays in, arrays out.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::errors::FitError;
use super::fitted::{self, Array, Asked, Data, Fitted, fitted};
use super::interrupt;
use super::linearisation_cache::Linearised;
use super::model::AnyModel;
use crate::estimate::{
    AngleSensor, BASIS, Candidate, DiskCamera, EstimateError, FilmParameters, FreeParameter, FrequencyProbe,
    Options, PLACES_PER_LINK, Role, RowMatrix, Score, Sensor,
};
use crate::model::effects::Kind;
use crate::model::{DiskFamily, Effect, Either};

/// As `udd.fitting.estimator_input.Observations`.
#[derive(FromPyObject)]
struct Observations<'py> {
    t: PyReadonlyArray1<'py, f64>,
    seen: PyReadonlyArray2<'py, f64>,
    information: PyReadonlyArray3<'py, f64>,
    linked: PyReadonlyArray1<'py, bool>,
    film: PyReadonlyArray1<'py, i64>,
    autocorrelation: Vec<f64>,
}

/// As `udd.fitting.estimator_input.FilmParameters`.
#[derive(FromPyObject)]
struct FilmValues {
    model: Vec<f64>,
    camera: Vec<f64>,
    clock: f64,
}

/// As `udd.fitting.parameters.Free`.
#[derive(FromPyObject)]
struct Free {
    role: String,
    index: usize,
    film: Option<usize>,
    mean: f64,
    sd: f64,
    range: (f64, f64),
}

/// As `udd.fitting.estimator_input.EstimatorInput`.
#[derive(FromPyObject)]
struct EstimatorInput<'py> {
    model: Bound<'py, PyAny>,
    observations: Observations<'py>,
    states: PyReadonlyArray2<'py, f64>,
    films: Vec<FilmValues>,
    free: Vec<Free>,
    diffusion: Vec<f64>,
    linear: Option<Py<Linearised>>,
}

/// Three arrays.
type Three<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);

impl From<EstimateError> for PyErr {
    fn from(error: EstimateError) -> Self {
        match error {
            EstimateError::Cancelled => PyKeyboardInterrupt::new_err(()),
            EstimateError::Undetermined(ref which) => FitError::new_err((error.to_string(), which.clone())),
            other => FitError::new_err(other.to_string()),
        }
    }
}

fn list<T: Copy + numpy::Element>(array: &PyReadonlyArray1<'_, T>) -> Vec<T> {
    array.as_array().iter().copied().collect()
}

fn wide(array: &PyReadonlyArray2<'_, f64>) -> Array {
    let array = array.as_array();
    Array { shape: array.shape().to_vec(), numbers: array.iter().copied().collect() }
}

fn deep(array: &PyReadonlyArray3<'_, f64>) -> Array {
    let array = array.as_array();
    Array { shape: array.shape().to_vec(), numbers: array.iter().copied().collect() }
}

impl From<&Observations<'_>> for Data {
    fn from(observed: &Observations<'_>) -> Self {
        let film = list(&observed.film).into_iter().map(|film| usize::try_from(film).unwrap_or(usize::MAX));
        Self {
            t: list(&observed.t),
            seen: wide(&observed.seen),
            information: deep(&observed.information),
            linked: list(&observed.linked),
            film: film.collect(),
            autocorrelation: observed.autocorrelation.clone(),
        }
    }
}

impl From<FilmValues> for FilmParameters {
    fn from(FilmValues { model, camera, clock }: FilmValues) -> Self {
        Self { model, camera, clock }
    }
}

impl TryFrom<Free> for FreeParameter {
    type Error = PyErr;

    fn try_from(free: Free) -> PyResult<Self> {
        let role = match free.role.as_str() {
            "model" => Role::Model(free.index),
            "camera" => Role::Camera(free.index),
            "clock" => Role::Clock,
            other => return Err(PyValueError::new_err(format!("unknown role {other:?}"))),
        };
        Ok(Self { role, film: free.film, mean: free.mean, sd: free.sd, range: free.range })
    }
}

fn film_parameters(films: Vec<FilmValues>) -> Vec<FilmParameters> {
    films.into_iter().map(FilmParameters::from).collect()
}

impl EstimatorInput<'_> {
    /// The problem that is asked of this model, by one who takes it and what is asked.
    fn with<T>(self, build: impl FnOnce(AnyModel, Asked<'_>) -> PyResult<T>) -> PyResult<T> {
        let (data, states) = (Data::from(&self.observations), wide(&self.states));
        let asked = Asked {
            data: Some(&data),
            states: &states,
            sets: film_parameters(self.films),
            free: self.free.into_iter().map(FreeParameter::try_from).collect::<PyResult<_>>()?,
            diffusion: &self.diffusion,
            linear: self.linear.as_ref().map(Py::get),
        };
        build(AnyModel::to_fit(&self.model)?, asked)
    }

    fn fitted(self) -> PyResult<Box<dyn Fitted>> {
        self.with(fitted)
    }
}

/// An array of a shape from its numbers in C order.
fn array<'py>(py: Python<'py>, shape: &[usize], numbers: Vec<f64>) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray1::from_vec(py, numbers).reshape(shape.to_vec())?.into_any())
}

/// Scores, one after the other: gradients, information and what each amplitude has alone.
fn arrays<'py>(py: Python<'py>, scores: &[Score], shapes: [&[usize]; 3]) -> PyResult<Three<'py>> {
    let all = |part: fn(&Score) -> &[f64]| scores.iter().flat_map(part).copied().collect();
    Ok((
        array(py, shapes[0], all(|score| score.gradient.as_slice()))?,
        array(py, shapes[1], all(|score| score.information.as_slice()))?,
        array(py, shapes[2], all(|score| score.alone.as_slice()))?,
    ))
}

/// Minimises the cost; see `rust/estimate`.
#[pyfunction]
fn solve<'py>(
    py: Python<'py>,
    problem: EstimatorInput<'py>,
    iterations: usize,
    decrease: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let options = Options { iterations, decrease };
    let fitted = problem.fitted()?;
    let size = fitted.size();
    let (n, p, d, m) = (size.frames, size.free, size.states, size.channels);
    let s = interrupt::run(py, |stop| fitted.solve(&options, stop))?;
    let result = PyDict::new(py);
    result.set_item("states", array(py, &[n, d], s.states)?)?;
    let sets = s.sets.into_iter().map(|set| (set.model, set.camera, set.clock));
    result.set_item("sets", sets.collect::<Vec<_>>())?;
    result.set_item("covariance", array(py, &[p, p], s.covariance)?)?;
    result.set_item("state_covariance", array(py, &[n, d, d], s.state_covariance)?)?;
    result.set_item("misfit", array(py, &[n, m], s.misfit)?)?;
    result.set_item("seen_variance", array(py, &[n, m], s.seen_variance)?)?;
    result.set_item("defect", array(py, &[n - 1, d], s.defect)?)?;
    result.set_item("cost", (s.cost.misfit, s.cost.defect, s.cost.prior))?;
    result.set_item("evidence", s.evidence)?;
    result.set_item("converged", s.converged)?;
    result.set_item("iterations", s.iterations)?;
    result.set_item("linear", Py::new(py, s.linear)?)?;
    Ok(result)
}

/// Gradient and information of candidates' amplitudes at zero, everything else optimal, and the
/// information were the free parameters known.
#[pyfunction]
fn score<'py>(
    py: Python<'py>,
    problem: EstimatorInput<'py>,
    candidates: Vec<(Bound<'py, PyAny>, Vec<usize>)>,
) -> PyResult<Three<'py>> {
    let fitted = problem.fitted()?;
    let one = |(model, indices): (Bound<'_, PyAny>, _)| Ok((AnyModel::to_fit(&model)?, indices));
    let candidates = candidates.into_iter().map(one).collect::<PyResult<Vec<_>>>()?;
    let score = interrupt::run(py, |_| fitted.score(candidates))?;
    let c = score.gradient.len();
    arrays(py, &[score], [&[c], &[c, c], &[c]])
}

/// The score of a drive ripple at each of many frequencies: `(f, 2)`, `(f, 2, 2)` and `(f, 2)`.
#[pyfunction]
fn score_ripples<'py>(
    py: Python<'py>,
    problem: EstimatorInput<'py>,
    frequencies: Vec<f64>,
) -> PyResult<Three<'py>> {
    let scores = problem.with(|model, asked| {
        let AnyModel::Four(Either::First(family), values) = model else {
            return Err(PyValueError::new_err("only a disk has a drive"));
        };
        let probe = ripple_probe(&family, values.len(), &frequencies);
        let fit = fitted::problem((family, &values, DiskCamera), |_| None, asked)?;
        interrupt::run(py, |_| fit.estimator.score_waves(&fit.point, &probe, &frequencies))
    })?;
    let n = scores.len();
    arrays(py, &scores, [&[n, 2], &[n, 2, 2], &[n, 2]])
}

/// Ripples of the drive at a basis of frequencies, added to a disk that has so many parameters.
fn ripple_probe(family: &DiskFamily, known: usize, frequencies: &[f64]) -> FrequencyProbe<DiskFamily> {
    let highest = frequencies.iter().copied().fold(0.0, f64::max);
    let basis = std::array::from_fn(|k| highest * (k + 1) as f64 / BASIS as f64);
    let (mut wide, mut more, mut amplitudes) = (family.clone(), Vec::new(), Vec::new());
    for &f in &basis {
        wide.effects.push(Effect::new(Kind::DriveRipple));
        let first = known + more.len();
        amplitudes.extend([Role::Model(first), Role::Model(first + 1)]);
        more.extend([0.0, 0.0, f]);
    }
    FrequencyProbe { candidate: Candidate { family: wide, more, amplitudes }, frequencies: basis }
}

/// Times (n, q), states (n, q, d) and responses (n, q, d, d) at q places of each of n links: what a unit
/// forcing of each equation there adds to the state at the link's end.
#[pyfunction]
fn responses<'py>(py: Python<'py>, problem: EstimatorInput<'py>) -> PyResult<Three<'py>> {
    let fitted = problem.fitted()?;
    let [t, states, responses] = interrupt::run(py, |_| fitted.places())?;
    let (n, q, d) = (t.len() / PLACES_PER_LINK, PLACES_PER_LINK, fitted.size().states);
    Ok((array(py, &[n, q], t)?, array(py, &[n, q, d], states)?, array(py, &[n, q, d, d], responses)?))
}

/// Gradient of each group of columns, its information, and the information were the free parameters known: the
/// groups one after the other, the information flat. A column is what its amplitude adds to the state at
/// every link's end (n - 1, d, c); nothing to what is seen.
#[pyfunction]
fn score_columns<'py>(
    py: Python<'py>,
    problem: EstimatorInput<'py>,
    at_end: PyReadonlyArray3<'py, f64>,
    groups: Vec<usize>,
) -> PyResult<Three<'py>> {
    let fitted = problem.fitted()?;
    let (n, d, c) = (fitted.size().frames, fitted.size().states, groups.iter().sum::<usize>());
    let at_end = deep(&at_end);
    if at_end.shape != [n - 1, d, c] {
        let message = format!("columns must have the shape ({}, {d}, {c})", n - 1);
        return Err(PyValueError::new_err(message));
    }
    let mut columns = RowMatrix::zeros((n - 1) * d, c);
    for (i, own) in at_end.numbers.chunks(c.max(1)).enumerate() {
        columns.row_mut(i).copy_from_slice(own);
    }
    let scores = interrupt::run(py, |_| fitted.score_groups(columns, &groups))?;
    let squares = groups.iter().map(|size| size * size).sum();
    arrays(py, &scores, [&[c], &[squares], &[c]])
}

/// From each window of frames alone: the state at its first frame, at its last, and the covariance there.
#[pyfunction]
fn filter<'py>(
    py: Python<'py>,
    problem: EstimatorInput<'py>,
    windows: Vec<(usize, usize)>,
) -> PyResult<Three<'py>> {
    let fitted = problem.fitted()?;
    let (frames, d, n) = (fitted.size().frames, fitted.size().states, windows.len());
    if windows.iter().any(|&(first, last)| first >= last || last >= frames) {
        return Err(PyValueError::new_err("a window reaches beyond the record"));
    }
    let [first, last, covariance] = interrupt::run(py, |stop| fitted.filter(&windows, stop))?;
    Ok((array(py, &[n, d], first)?, array(py, &[n, d], last)?, array(py, &[n, d, d], covariance)?))
}

/// Innovations (n, m) in units of their standard deviations, all parameters held; NaN where nothing was seen or too
/// little was known. `vague` is what is known of a state where a run starts.
#[pyfunction]
fn innovations<'py>(
    py: Python<'py>,
    problem: EstimatorInput<'py>,
    vague: Vec<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let fitted = problem.fitted()?;
    let size = fitted.size();
    if vague.len() != size.states {
        return Err(PyValueError::new_err(format!("vague must have {} numbers", size.states)));
    }
    let found = interrupt::run(py, |_| fitted.innovations(&vague))?;
    array(py, &[size.frames, size.channels], found)
}

/// Predicts the observations at `times[k]`, increasing, after start `k` of film `film[k]` at `t0[k]`, by the model
/// alone.
#[pyfunction]
fn predict<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    films: Vec<FilmValues>,
    film: Vec<usize>,
    t0: PyReadonlyArray1<'py, f64>,
    states: PyReadonlyArray2<'py, f64>,
    times: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let (t0, states, sets) = (list(&t0), wide(&states), film_parameters(films));
    let films = sets.len();
    let times: Vec<Vec<f64>> = times.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
    let asked = Asked { data: None, states: &states, sets, free: Vec::new(), diffusion: &[], linear: None };
    let fitted = fitted(AnyModel::to_fit(model)?, asked)?;
    let k = film.len().min(t0.len()).min(states.shape[0]);
    if times.len() != k || film.iter().any(|&film| film >= films) {
        return Err(PyValueError::new_err("starts, times and films do not fit together"));
    }
    let h = times.first().map_or(0, Vec::len);
    let seen = interrupt::run(py, |_| fitted.predict(&film, &t0, &times))?;
    array(py, &[k, h, fitted.size().channels], seen)
}

/// Names and units of a camera's parameters, for measurements of the `"disk"` or a `"pendulum"`.
#[pyfunction]
fn camera_parameters(kind: &str) -> PyResult<Vec<(&'static str, &'static str)>> {
    match kind {
        "disk" => Ok(DiskCamera::PARAMETERS.to_vec()),
        "pendulum" => Ok(AngleSensor::PARAMETERS.to_vec()),
        "own" => Ok(Vec::new()),
        other => Err(PyValueError::new_err(format!("no camera sees a {other:?}"))),
    }
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Linearised>()?;
    module.add_function(wrap_pyfunction!(solve, module)?)?;
    module.add_function(wrap_pyfunction!(score, module)?)?;
    module.add_function(wrap_pyfunction!(score_ripples, module)?)?;
    module.add_function(wrap_pyfunction!(responses, module)?)?;
    module.add_function(wrap_pyfunction!(score_columns, module)?)?;
    module.add_function(wrap_pyfunction!(filter, module)?)?;
    module.add_function(wrap_pyfunction!(innovations, module)?)?;
    module.add_function(wrap_pyfunction!(predict, module)?)?;
    module.add_function(wrap_pyfunction!(camera_parameters, module)?)
}
