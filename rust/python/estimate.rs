//! The estimator's door to Python: arrays in, arrays out.

use std::sync::Arc;

use nalgebra::{SMatrix, SVector};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::errors::FitError;
use super::interrupt;
use super::linearised::Linearised;
use super::model::AnyModel;
use crate::estimate::{
    AngleSensor, BASIS, Candidate, Columns, Direct, DiskCamera, EstimateError, Estimator, Free, Known,
    Options, PLACES_PER_LINK, Point, Probe, Record, Role, Rows, Sensor, Set,
};
use crate::integrate::Tolerance;
use crate::model::effects::Kind;
use crate::model::{Effect, Family, OwnFamily};

/// Frame by frame: time, what was seen, its information, whether the next frame is linked, which film it
/// belongs to; and how much of the noise each channel remembers.
type Data<'py> = (
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray3<'py, f64>,
    PyReadonlyArray1<'py, bool>,
    PyReadonlyArray1<'py, i64>,
    Vec<f64>,
);
/// States; of each film the model's parameters, the camera's, and the clock's error; what a solve left there.
type Start<'py> = (PyReadonlyArray2<'py, f64>, Vec<SetTuple>, Option<Py<Linearised>>);
type SetTuple = (Vec<f64>, Vec<f64>, f64);
/// Role, index, film (none: shared by all), prior mean and standard deviation.
type FreeTuple = (String, usize, Option<usize>, f64, f64);

/// A frame's flow is followed much more closely than the model's smallest assumed error.
const TOLERANCE: Tolerance = Tolerance { rtol: 1e-7, atol: 1e-9 };

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

fn rows<const K: usize>(array: &PyReadonlyArray2<'_, f64>, what: &str) -> PyResult<Vec<[f64; K]>> {
    let array = array.as_array();
    if array.ncols() != K {
        return Err(PyValueError::new_err(format!("{what} must have {K} columns, not {}", array.ncols())));
    }
    Ok(array.rows().into_iter().map(|row| std::array::from_fn(|k| row[k])).collect())
}

fn record<const M: usize>((t, seen, information, linked, film, memory): &Data<'_>) -> PyResult<Record<M>> {
    if information.as_array().shape()[1..] != [M, M] {
        return Err(PyValueError::new_err(format!("information must hold {M} x {M} matrices")));
    }
    let record = Record {
        t: list(t),
        seen: rows::<M>(seen, "seen")?.into_iter().map(SVector::from).collect(),
        information: information
            .as_array()
            .outer_iter()
            .map(|own| SMatrix::from_fn(|i, j| own[[i, j]]))
            .collect(),
        linked: list(linked),
        film: list(film).into_iter().map(|film| usize::try_from(film).unwrap_or(usize::MAX)).collect(),
        memory: memory.as_slice().try_into().map_err(|_| PyValueError::new_err("memory: one per channel"))?,
    };
    let n = record.t.len();
    let lengths = [record.seen.len(), record.information.len(), record.film.len(), record.linked.len() + 1];
    if n == 0 || lengths.iter().any(|&length| length != n) {
        return Err(PyValueError::new_err("t, seen, information, linked and film have different lengths"));
    }
    Ok(record)
}

fn frees(free: &[FreeTuple]) -> PyResult<Vec<Free>> {
    let one = |(role, index, film, mean, sd): &FreeTuple| {
        let role = match role.as_str() {
            "model" => Role::Model(*index),
            "camera" => Role::Camera(*index),
            "clock" => Role::Clock,
            other => return Err(PyValueError::new_err(format!("unknown role {other:?}"))),
        };
        Ok(Free { role, film: *film, mean: *mean, sd: *sd })
    };
    free.iter().map(one).collect()
}

/// The parameters of every film, of which the model has so many.
fn parameters<C: Sensor<D, M>, const D: usize, const M: usize>(
    sets: &[SetTuple],
    model: usize,
) -> PyResult<Vec<Set>> {
    let fits = |(own, camera, _): &SetTuple| own.len() == model && camera.len() == C::PARAMETERS.len();
    if sets.is_empty() || !sets.iter().all(fits) {
        return Err(PyValueError::new_err("every film needs the model's and the camera's parameters"));
    }
    Ok(sets.iter().cloned().map(|(model, camera, clock)| Set { model, camera, clock }).collect())
}

fn problem<F, C, const D: usize, const M: usize>(
    (family, values, sensor): (F, Vec<f64>, C),
    data: &Data<'_>,
    (states, sets, linear): &Start<'_>,
    free: &[FreeTuple],
    diffusion: &[f64],
) -> PyResult<(Estimator<F, C, D, M>, Point<D>)>
where
    F: Family<D> + 'static,
    C: Sensor<D, M> + 'static,
{
    let diffusion = diffusion
        .try_into()
        .map_err(|_| PyValueError::new_err(format!("diffusion must have {D} numbers")))?;
    let record = record(data)?;
    let sets = parameters::<C, D, M>(sets, values.len())?;
    let point = Point { states: rows(states, "states")?, sets };
    let films = point.sets.len();
    if point.states.len() != record.t.len() || record.film.iter().any(|&film| film >= films) {
        return Err(PyValueError::new_err("states and parameters do not fit the record"));
    }
    let free = frees(free)?;
    for free in &free {
        let (index, most) = match free.role {
            Role::Model(index) => (index, values.len()),
            Role::Camera(index) => (index, C::PARAMETERS.len()),
            Role::Clock => (0, 1),
        };
        if index >= most || free.film.is_some_and(|film| film >= films) {
            return Err(PyValueError::new_err(format!("there is no parameter {index} of {most}")));
        }
    }
    let mut estimator =
        Estimator { family, sensor, record, free, diffusion, tolerance: TOLERANCE, known: None };
    estimator.known = linear.as_ref().and_then(|linear| linear.get().known(&estimator));
    Ok((estimator, point))
}

/// An array of `shape` from its numbers in C order.
fn array<'py, const N: usize>(
    py: Python<'py>,
    shape: [usize; N],
    numbers: impl IntoIterator<Item = f64>,
) -> PyResult<Bound<'py, PyAny>>
where
    [usize; N]: numpy::ndarray::IntoDimension,
{
    let flat: Vec<f64> = numbers.into_iter().collect();
    Ok(PyArray1::from_vec(py, flat).reshape(shape)?.into_any())
}

/// The numbers of small matrices in C order.
fn numbers<const A: usize, const B: usize>(blocks: &[SMatrix<f64, A, B>]) -> impl Iterator<Item = f64> + '_ {
    blocks.iter().flat_map(|m| (0..A).flat_map(move |i| (0..B).map(move |j| m[(i, j)])))
}

macro_rules! each_family {
    ($model:expr, $call:ident ( $($argument:expr),* )) => {
        match $model {
            AnyModel::Disk(family, values) => $call((family, values, DiskCamera), $($argument),*),
            AnyModel::Pendulum(family, values) => $call((family, values, AngleSensor), $($argument),*),
            AnyModel::Own1(family, values) => $call(seen_as_it_is(family, values), $($argument),*),
            AnyModel::Own2(family, values) => $call(seen_as_it_is(family, values), $($argument),*),
            AnyModel::Own3(family, values) => $call(seen_as_it_is(family, values), $($argument),*),
            AnyModel::Own4(family, values) => $call(seen_as_it_is(family, values), $($argument),*),
            other => Err(unseen(&other)),
        }
    };
}

/// A user's own model with what sees its states.
fn seen_as_it_is<const D: usize>(
    family: OwnFamily<D>,
    values: Vec<f64>,
) -> (OwnFamily<D>, Vec<f64>, Direct<D>) {
    let states = family.states();
    (family, values, Direct { angles: std::array::from_fn(|n| states[n].1) })
}

/// Why a model cannot be compared with measurements.
fn unseen(model: &AnyModel) -> PyErr {
    PyValueError::new_err(match model {
        AnyModel::Own5(..) | AnyModel::Own6(..) => "a model that is fitted has at most 4 states",
        _ => "a camera sees a disk or a pendulum",
    })
}

/// Minimises the cost; see `rust/estimate`.
#[pyfunction]
fn solve<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    data: Data<'py>,
    start: Start<'py>,
    free: Vec<FreeTuple>,
    diffusion: Vec<f64>,
    until: (usize, f64),
) -> PyResult<Bound<'py, PyDict>> {
    fn run<'py, F: Family<D> + 'static, C: Sensor<D, M> + 'static, const D: usize, const M: usize>(
        model: (F, Vec<f64>, C),
        py: Python<'py>,
        (data, start): (&Data<'py>, &Start<'py>),
        free: &[FreeTuple],
        diffusion: &[f64],
        options: &Options,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (estimator, point) = problem(model, data, start, free, diffusion)?;
        let s = interrupt::run(py, |stop| estimator.solve(point, options, stop))?;
        let (n, p) = (estimator.record.t.len(), estimator.free.len());
        let result = PyDict::new(py);
        result.set_item("states", array(py, [n, D], s.point.states.iter().flatten().copied())?)?;
        let sets = s.point.sets.iter().cloned().map(|set| (set.model, set.camera, set.clock));
        result.set_item("sets", sets.collect::<Vec<SetTuple>>())?;
        result.set_item("covariance", array(py, [p, p], s.covariance.iter().copied())?)?;
        result.set_item("state_covariance", array(py, [n, D, D], numbers(&s.state_covariance))?)?;
        result.set_item("misfit", array(py, [n, M], numbers(&s.misfit))?)?;
        result.set_item("seen_variance", array(py, [n, M], numbers(&s.seen_variance))?)?;
        result.set_item("defect", array(py, [n - 1, D], numbers(&s.defect[..n - 1]))?)?;
        result.set_item("cost", (s.cost.misfit, s.cost.defect, s.cost.prior))?;
        result.set_item("evidence", s.evidence)?;
        result.set_item("converged", s.converged)?;
        result.set_item("iterations", s.iterations)?;
        let known = Known { point: Arc::new(s.point), linear: s.linear };
        result.set_item("linear", Py::new(py, Linearised::new(estimator, known))?)?;
        Ok(result)
    }
    let options = Options { iterations: until.0, decrease: until.1 };
    each_family!(AnyModel::to_fit(model)?, run(py, (&data, &start), &free, &diffusion, &options))
}

/// A candidate's family, its values, and where the amplitudes stand among them.
type Group<F> = (F, Vec<f64>, Vec<usize>);
/// Three arrays.
type Three<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);

/// Gradient and information of candidates' amplitudes at zero, everything else optimal, and the
/// information were the free parameters known.
#[pyfunction]
fn score<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    data: Data<'py>,
    start: Start<'py>,
    free: Vec<FreeTuple>,
    diffusion: Vec<f64>,
    candidates: Vec<(Bound<'py, PyAny>, Vec<usize>)>,
) -> PyResult<Three<'py>> {
    fn run<'py, F: Family<D> + 'static, C: Sensor<D, M> + 'static, const D: usize, const M: usize>(
        model: (F, Vec<f64>, C),
        py: Python<'py>,
        (data, start): (&Data<'py>, &Start<'py>),
        free: &[FreeTuple],
        diffusion: &[f64],
        groups: Vec<Group<F>>,
    ) -> PyResult<Three<'py>> {
        let own = model.1.len();
        let (estimator, point) = problem(model, data, start, free, diffusion)?;
        let candidate = |(family, values, indices): Group<F>| {
            if values.len() < own || indices.iter().any(|&index| index >= values.len()) {
                return Err(PyValueError::new_err("a candidate has no parameter of that number"));
            }
            let amplitudes = indices.into_iter().map(Role::Model).collect();
            Ok(Candidate { family, more: values[own..].to_vec(), amplitudes })
        };
        let candidates = groups.into_iter().map(candidate).collect::<PyResult<Vec<_>>>()?;
        let score = interrupt::run(py, |_| estimator.score(&point, &candidates))?;
        let c = score.gradient.len();
        Ok((
            array(py, [c], score.gradient.iter().copied())?,
            array(py, [c, c], score.information.iter().copied())?,
            array(py, [c], score.alone.iter().copied())?,
        ))
    }
    /// The candidates' families; all must be of the model's own kind.
    fn groups<F>(
        candidates: Vec<(Bound<'_, PyAny>, Vec<usize>)>,
        own: impl Fn(AnyModel) -> Option<(F, Vec<f64>)>,
    ) -> PyResult<Vec<Group<F>>> {
        let one = |(model, indices): (Bound<'_, PyAny>, Vec<usize>)| {
            let (family, values) = own(AnyModel::to_fit(&model)?)
                .ok_or_else(|| PyValueError::new_err("a candidate is a model of another kind"))?;
            Ok((family, values, indices))
        };
        candidates.into_iter().map(one).collect()
    }
    macro_rules! scored {
        ($Kind:ident, $model:expr) => {{
            let groups = groups(candidates, |m| match m {
                AnyModel::$Kind(family, values) => Some((family, values)),
                _ => None,
            })?;
            run($model, py, (&data, &start), &free, &diffusion, groups)
        }};
    }
    match AnyModel::to_fit(model)? {
        AnyModel::Disk(family, values) => scored!(Disk, (family, values, DiskCamera)),
        AnyModel::Pendulum(family, values) => scored!(Pendulum, (family, values, AngleSensor)),
        AnyModel::Own1(family, values) => scored!(Own1, seen_as_it_is(family, values)),
        AnyModel::Own2(family, values) => scored!(Own2, seen_as_it_is(family, values)),
        AnyModel::Own3(family, values) => scored!(Own3, seen_as_it_is(family, values)),
        AnyModel::Own4(family, values) => scored!(Own4, seen_as_it_is(family, values)),
        other => Err(unseen(&other)),
    }
}

/// The score of a drive ripple at each of many frequencies: `(f, 2)`, `(f, 2, 2)` and `(f, 2)`.
#[pyfunction]
fn score_ripples<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    data: Data<'py>,
    start: Start<'py>,
    free: Vec<FreeTuple>,
    diffusion: Vec<f64>,
    frequencies: Vec<f64>,
) -> PyResult<Three<'py>> {
    let AnyModel::Disk(family, values) = AnyModel::to_fit(model)? else {
        return Err(PyValueError::new_err("only a disk has a drive"));
    };
    let highest = frequencies.iter().copied().fold(0.0, f64::max);
    let basis = std::array::from_fn(|k| highest * (k + 1) as f64 / BASIS as f64);
    let (mut wide, mut more, mut amplitudes) = (family.clone(), Vec::new(), Vec::new());
    for &f in &basis {
        wide.effects.push(Effect::new(Kind::DriveRipple));
        let first = values.len() + more.len();
        amplitudes.extend([Role::Model(first), Role::Model(first + 1)]);
        more.extend([0.0, 0.0, f]);
    }
    let probe = Probe { candidate: Candidate { family: wide, more, amplitudes }, frequencies: basis };
    let (estimator, point) = problem((family, values, DiskCamera), &data, &start, &free, &diffusion)?;
    let scores = interrupt::run(py, |_| estimator.score_waves(&point, &probe, &frequencies))?;
    let n = scores.len();
    Ok((
        array(py, [n, 2], scores.iter().flat_map(|s| s.gradient.iter().copied()))?,
        array(py, [n, 2, 2], scores.iter().flat_map(|s| s.information.iter().copied()))?,
        array(py, [n, 2], scores.iter().flat_map(|s| s.alone.iter().copied()))?,
    ))
}

/// Times (n, q), states (n, q, d) and responses (n, q, d, d) at q places of each of n links: what a unit
/// forcing of each equation there adds to the state at the link's end.
#[pyfunction]
fn responses<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    data: Data<'py>,
    start: Start<'py>,
) -> PyResult<Three<'py>> {
    fn run<'py, F: Family<D> + 'static, C: Sensor<D, M> + 'static, const D: usize, const M: usize>(
        model: (F, Vec<f64>, C),
        py: Python<'py>,
        (data, start): (&Data<'py>, &Start<'py>),
    ) -> PyResult<Three<'py>> {
        let (estimator, point) = problem(model, data, start, &[], &[1.0; D])?;
        let links = interrupt::run(py, |_| estimator.places(&point))?;
        let n = links.len();
        let places = || links.iter().flat_map(|link| link.places);
        let response: Vec<_> = places().map(|p| p.response).collect();
        Ok((
            array(py, [n, PLACES_PER_LINK], places().map(|p| p.t))?,
            array(py, [n, PLACES_PER_LINK, D], places().flat_map(|p| p.state))?,
            array(py, [n, PLACES_PER_LINK, D, D], numbers(&response))?,
        ))
    }
    each_family!(AnyModel::to_fit(model)?, run(py, (&data, &start)))
}

/// Gradient of each group of columns, its information, and the information were the free parameters known: the
/// groups one after the other, the information flat. A column is what its amplitude adds to the state at
/// every link's end (n - 1, d, c); nothing to what is seen.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
fn score_columns<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    data: Data<'py>,
    start: Start<'py>,
    free: Vec<FreeTuple>,
    diffusion: Vec<f64>,
    at_end: PyReadonlyArray3<'py, f64>,
    groups: Vec<usize>,
) -> PyResult<Three<'py>> {
    fn columns(array: &PyReadonlyArray3<'_, f64>) -> Rows {
        let array = array.as_array();
        let (blocks, rows, width) = array.dim();
        let mut columns = Rows::zeros(blocks * rows, width);
        for (i, own) in array.rows().into_iter().enumerate() {
            columns.row_mut(i).iter_mut().zip(own).for_each(|(to, &value)| *to = value);
        }
        columns
    }
    fn run<'py, F: Family<D> + 'static, C: Sensor<D, M> + 'static, const D: usize, const M: usize>(
        model: (F, Vec<f64>, C),
        py: Python<'py>,
        (data, start): (&Data<'py>, &Start<'py>),
        free: &[FreeTuple],
        diffusion: &[f64],
        at_end: &PyReadonlyArray3<'py, f64>,
        groups: &[usize],
    ) -> PyResult<Three<'py>> {
        let (estimator, point) = problem(model, data, start, free, diffusion)?;
        let (n, c) = (estimator.record.t.len(), groups.iter().sum::<usize>());
        if at_end.as_array().shape() != [n - 1, D, c] {
            let message = format!("columns must have the shape ({}, {D}, {c})", n - 1);
            return Err(PyValueError::new_err(message));
        }
        let columns = Columns { state: columns(at_end), seen: Rows::zeros(n * M, c) };
        let scores = interrupt::run(py, |_| estimator.score_groups(&point, &columns, groups))?;
        let squares = groups.iter().map(|size| size * size).sum();
        Ok((
            array(py, [c], scores.iter().flat_map(|s| s.gradient.iter().copied()))?,
            array(py, [squares], scores.iter().flat_map(|s| s.information.iter().copied()))?,
            array(py, [c], scores.iter().flat_map(|s| s.alone.iter().copied()))?,
        ))
    }
    let call = (&data, &start);
    each_family!(AnyModel::to_fit(model)?, run(py, call, &free, &diffusion, &at_end, &groups))
}

/// From each window of frames alone: the state at its first frame, at its last, and the covariance there.
#[pyfunction]
fn filter<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    data: Data<'py>,
    start: Start<'py>,
    diffusion: Vec<f64>,
    windows: Vec<(usize, usize)>,
) -> PyResult<Three<'py>> {
    fn run<'py, F: Family<D> + 'static, C: Sensor<D, M> + 'static, const D: usize, const M: usize>(
        model: (F, Vec<f64>, C),
        py: Python<'py>,
        (data, start): (&Data<'py>, &Start<'py>),
        diffusion: &[f64],
        windows: &[(usize, usize)],
    ) -> PyResult<Three<'py>> {
        let (estimator, point) = problem(model, data, start, &[], diffusion)?;
        if windows.iter().any(|&(first, last)| first >= last || last >= estimator.record.t.len()) {
            return Err(PyValueError::new_err("a window reaches beyond the record"));
        }
        let options = Options::default();
        let ends = interrupt::run(py, |stop| estimator.filter(&point, windows, &options, stop))?;
        let n = ends.len();
        Ok((
            array(py, [n, D], ends.iter().flat_map(|end| end.first))?,
            array(py, [n, D], ends.iter().flat_map(|end| end.last))?,
            array(
                py,
                [n, D, D],
                ends.iter().flat_map(|end| end.covariance.transpose().iter().copied().collect::<Vec<_>>()),
            )?,
        ))
    }
    each_family!(AnyModel::to_fit(model)?, run(py, (&data, &start), &diffusion, &windows))
}

/// Innovations (n, m) in units of their standard deviations, all parameters held; NaN where nothing was seen or too
/// little was known. `vague` is what is known of a state where a run starts.
#[pyfunction]
fn innovations<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    data: Data<'py>,
    start: Start<'py>,
    diffusion: Vec<f64>,
    vague: Vec<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    fn run<'py, F: Family<D> + 'static, C: Sensor<D, M> + 'static, const D: usize, const M: usize>(
        model: (F, Vec<f64>, C),
        py: Python<'py>,
        (data, start): (&Data<'py>, &Start<'py>),
        diffusion: &[f64],
        vague: &[f64],
    ) -> PyResult<Bound<'py, PyAny>> {
        let (estimator, point) = problem(model, data, start, &[], diffusion)?;
        let vague =
            vague.try_into().map_err(|_| PyValueError::new_err(format!("vague must have {D} numbers")))?;
        let found = interrupt::run(py, |_| estimator.innovations(&point, vague))?;
        array(py, [found.len(), M], found.into_iter().flatten())
    }
    each_family!(AnyModel::to_fit(model)?, run(py, (&data, &start), &diffusion, &vague))
}

/// What would be seen at `times[k]`, increasing, after start `k` of film `film[k]` at `t0[k]`, by the model alone.
#[pyfunction]
fn predict<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    sets: Vec<SetTuple>,
    film: Vec<usize>,
    t0: PyReadonlyArray1<'py, f64>,
    states: PyReadonlyArray2<'py, f64>,
    times: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyAny>> {
    type Arrays<'a, 'py> =
        (&'a PyReadonlyArray1<'py, f64>, &'a PyReadonlyArray2<'py, f64>, &'a PyReadonlyArray2<'py, f64>);
    fn run<'py, F: Family<D> + 'static, C: Sensor<D, M> + 'static, const D: usize, const M: usize>(
        (family, values, sensor): (F, Vec<f64>, C),
        py: Python<'py>,
        sets: Vec<SetTuple>,
        film: &[usize],
        (t0, states, times): Arrays<'_, 'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let sets = parameters::<C, D, M>(&sets, values.len())?;
        let starts = rows::<D>(states, "states")?;
        let starts: Vec<_> = film.iter().zip(list(t0)).zip(starts).map(|((&f, t), x)| (f, t, x)).collect();
        let times: Vec<Vec<f64>> = times.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
        let (k, h) = (starts.len(), times.first().map_or(0, Vec::len));
        if times.len() != k || film.iter().any(|&film| film >= sets.len()) {
            return Err(PyValueError::new_err("starts, times and films do not fit together"));
        }
        let estimator = Estimator {
            family,
            sensor,
            record: Record::default(),
            free: Vec::new(),
            diffusion: [1.0; D],
            tolerance: TOLERANCE,
            known: None,
        };
        let seen = interrupt::run(py, |_| estimator.predict(&sets, &starts, &times))?;
        array(py, [k, h, M], seen.into_iter().flatten().flatten())
    }
    each_family!(AnyModel::to_fit(model)?, run(py, sets, &film, (&t0, &states, &times)))
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
