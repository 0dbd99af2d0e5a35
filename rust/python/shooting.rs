//! The core of `udd.equilibria`, `udd.periodic_orbit` and `udd.continuation`.

use nalgebra::DMatrix;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::errors::{ModelError, room_for};
use super::interrupt;
use super::jobs;
use super::model::{AnyModel, state, with_model, with_wide_model};
use crate::analysis::{
    CancelFlag, MOST_PARAMETERS, Multiplier, Segment, SegmentEnd, higher, linear, multipliers, pieces,
};
use crate::integrate::{Failure, Tolerance};
use crate::model::Family;

/// Pieces of orbits: their ends, with derivatives by their starts and by up to two parameters.
///
/// `values` has one row of parameter values for each piece, `starts` likewise; each begins at time `t` and
/// lasts `spans`. Returns a dict of arrays.
#[pyfunction]
fn shoot<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    values: PyReadonlyArray2<'py, f64>,
    starts: PyReadonlyArray2<'py, f64>,
    t: PyReadonlyArray1<'py, f64>,
    spans: PyReadonlyArray1<'py, f64>,
    wanted: Vec<usize>,
    rtol: f64,
    atol: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let model = AnyModel::from_python(model)?.undriven()?;
    let tolerance = Tolerance::new(rtol, atol);
    let rows = jobs::values(&model, &values)?;
    let (t, spans) = (t.as_slice()?, spans.as_slice()?);
    if wanted.len() > MOST_PARAMETERS || wanted.iter().any(|&p| p >= model.values().len()) {
        return Err(ModelError::new_err(format!(
            "at most {MOST_PARAMETERS} of the parameters can be wanted"
        )));
    }
    let (flown, dimension) = with_wide_model!(tangents: &model, |family, _values| {
        let starts = jobs::starts(&starts, family.idle())?;
        if [rows.len(), t.len(), spans.len()] != [starts.len(); 3] {
            return Err(ModelError::new_err("pieces need as many parameters, times and spans as starts"));
        }
        // Pieces, their ends with derivatives, and these in columns.
        let numbers = starts[0].len() * (starts[0].len() + 2 + MOST_PARAMETERS) + model.values().len();
        room_for(&format!("{} pieces", starts.len()), starts.len() as f64 * numbers as f64 * 24.0)?;
        let mut list = Vec::with_capacity(starts.len());
        for (i, values) in rows.into_iter().enumerate() {
            list.push(Segment { values, t: t[i], x: starts[i], span: spans[i] });
        }
        (run(py, family, &list, &wanted, &tolerance)?, starts[0].len())
    });
    let dict = PyDict::new(py);
    let (count, live) = (t.len(), model.states().len());
    let set = |name: &str, values: Vec<f64>, width: usize, shape: &[usize]| {
        let rows = jobs::live(values, dimension * width, live * width);
        dict.set_item(name, PyArray1::from_vec(py, rows).reshape(shape.to_vec())?)
    };
    // The columns of padding states are cut here, the rows in `set`.
    let by_state = jobs::live(flown.by_state, dimension, live);
    set("x", flown.x, 1, &[count, live])?;
    set("by_state", by_state, live, &[count, live, live])?;
    set("by_parameter", flown.by_parameter, MOST_PARAMETERS, &[count, live, MOST_PARAMETERS])?;
    set("rate", flown.rate, 1, &[count, live])?;
    Ok(dict)
}

/// The ends of all pieces, their dimension forgotten.
#[derive(Default)]
struct Flat {
    x: Vec<f64>,
    by_state: Vec<f64>,
    by_parameter: Vec<f64>,
    rate: Vec<f64>,
}

fn run<F: Family<D>, const D: usize>(
    py: Python<'_>,
    family: &F,
    list: &[Segment<D>],
    wanted: &[usize],
    tolerance: &Tolerance,
) -> PyResult<Flat> {
    let flown = interrupt::run(py, |stop: &CancelFlag| -> Result<_, Failure> {
        pieces(family, list, wanted, tolerance, stop)
    })?;
    let mut flat = Flat::default();
    for SegmentEnd { x, by_state, by_parameter, rate } in &flown {
        flat.x.extend_from_slice(x);
        flat.by_state.extend_from_slice(by_state.as_flattened());
        flat.by_parameter.extend_from_slice(by_parameter.as_flattened());
        flat.rate.extend_from_slice(rate);
    }
    Ok(flat)
}

/// The rates at a state with their first derivatives by the state and by all parameters, and where asked for
/// their second and third by the state. Returns a dict of arrays.
#[pyfunction]
fn expansion<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    t: f64,
    x: Vec<f64>,
    all: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let model = AnyModel::from_python(model)?.undriven()?;
    let d = x.len();
    let (rate, by_state, by_parameter, surfaces, more) = with_model!(&model, |family, values| {
        let x = state(&x, family.idle())?;
        let found = linear(family, values, t, &x);
        let more = if all { higher(family, values, t, &x) } else { Default::default() };
        // Every axis leaves out padding states.
        let cut = |numbers: Vec<f64>, axes: u32| {
            let mut numbers = numbers;
            for axis in 0..axes {
                let inner = d.pow(axis);
                numbers = jobs::live(numbers, x.len() * inner, d * inner);
            }
            numbers
        };
        let by_state = cut(found.by_state.as_flattened().to_vec(), 2);
        let by_parameter = cut(found.by_parameter.into_flattened(), 1);
        let more = (cut(more.0, 3), cut(more.1, 4));
        (cut(found.rate.to_vec(), 1), by_state, by_parameter, found.surfaces, more)
    });
    let dict = PyDict::new(py);
    let set = |name: &str, values: Vec<f64>, shape: &[usize]| {
        dict.set_item(name, PyArray1::from_vec(py, values).reshape(shape.to_vec())?)
    };
    let (parameters, crossed, wide) = (by_parameter.len() / d, surfaces.len(), if all { d } else { 0 });
    set("rate", rate, &[d])?;
    set("by_state", by_state, &[d, d])?;
    set("by_parameter", by_parameter, &[parameters, d])?;
    set("surfaces", surfaces, &[crossed])?;
    set("second", more.0, &[wide; 3])?;
    set("third", more.1, &[wide; 4])?;
    Ok(dict)
}

/// The eigenvalues of the product of square factors (m, n, n), the first of them the first to act, largest
/// first: logarithms of their sizes, their phases, their conditions; `None` where the iteration does not converge.
#[pyfunction]
fn floquet<'py>(
    py: Python<'py>,
    factors: PyReadonlyArray3<'py, f64>,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let factors = factors.as_array();
    let (count, n, columns) = factors.dim();
    if count == 0 || n != columns {
        return Err(ModelError::new_err("square factors are needed"));
    }
    let list: Vec<_> =
        (0..count).map(|i| DMatrix::from_fn(n, n, |row, column| factors[[i, row, column]])).collect();
    let Some(found) = multipliers(&list) else { return Ok(None) };
    let dict = PyDict::new(py);
    let column = |get: &dyn Fn(&Multiplier) -> f64| PyArray1::from_iter(py, found.iter().map(get));
    dict.set_item("log", column(&|one| one.log))?;
    dict.set_item("re", column(&|one| one.phase.re))?;
    dict.set_item("im", column(&|one| one.phase.im))?;
    dict.set_item("condition", column(&|one| one.condition))?;
    Ok(Some(dict))
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(shoot, module)?)?;
    module.add_function(wrap_pyfunction!(expansion, module)?)?;
    module.add_function(wrap_pyfunction!(floquet, module)?)
}
