//! What `udd.equilibria`, `udd.periodic_orbit` and `udd.continuation` are made of.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::errors::ModelError;
use super::interrupt;
use super::jobs;
use super::model::{AnyModel, state, with_wide_model};
use crate::integrate::{Failure, Tolerance};
use crate::model::Family;
use crate::run::{Flown, MOST_PARAMETERS, Piece, Stop, higher, linear, pieces};

/// Pieces of orbits: their ends, with derivatives by their starts and by up to two parameters.
///
/// `values` has one row of parameter values for each piece, `starts` likewise; each begins at time `t` and
/// lasts `spans`. Returns a dict of arrays.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
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
    let model = AnyModel::from_python(model)?;
    let tolerance = Tolerance { rtol, atol };
    let rows = jobs::values(&model, &values)?;
    let (t, spans) = (t.as_slice()?, spans.as_slice()?);
    if wanted.len() > MOST_PARAMETERS || wanted.iter().any(|&p| p >= model.values().len()) {
        return Err(ModelError::new_err(format!(
            "at most {MOST_PARAMETERS} of the parameters can be wanted"
        )));
    }
    let dict = PyDict::new(py);
    with_wide_model!(&model, |family, _values| {
        let starts = jobs::starts(&starts)?;
        let count = starts.len();
        if [rows.len(), t.len(), spans.len()] != [count; 3] {
            return Err(ModelError::new_err("pieces need as many parameters, times and spans as starts"));
        }
        let list: Vec<_> = (0..count)
            .map(|i| Piece { values: rows[i].clone(), t: t[i], x: starts[i], span: spans[i] })
            .collect();
        let dimension = starts[0].len();
        let flown = run(py, family, &list, &wanted, &tolerance)?;
        let flat = |of: &dyn Fn(&Flown<_>) -> Vec<f64>| -> Vec<f64> { flown.iter().flat_map(of).collect() };
        let set = |name: &str, values: Vec<f64>, shape: &[usize]| {
            dict.set_item(name, PyArray1::from_vec(py, values).reshape(shape.to_vec())?)
        };
        set("x", flat(&|f| f.x.to_vec()), &[count, dimension])?;
        set("by_state", flat(&|f| f.by_state.as_flattened().to_vec()), &[count, dimension, dimension])?;
        let by_parameter = flat(&|f| f.by_parameter.as_flattened().to_vec());
        set("by_parameter", by_parameter, &[count, dimension, MOST_PARAMETERS])?;
        set("rate", flat(&|f| f.rate.to_vec()), &[count, dimension])?;
    });
    Ok(dict)
}

fn run<F: Family<D>, const D: usize>(
    py: Python<'_>,
    family: &F,
    list: &[Piece<D>],
    wanted: &[usize],
    tolerance: &Tolerance,
) -> PyResult<Vec<Flown<D>>> {
    interrupt::run(py, |stop: &Stop| -> Result<_, Failure> { pieces(family, list, wanted, tolerance, stop) })
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
    let model = AnyModel::from_python(model)?;
    let dict = PyDict::new(py);
    with_wide_model!(&model, |family, values| {
        let x = state(&x)?;
        let (d, found) = (x.len(), linear(family, values, t, &x));
        let set = |name: &str, values: Vec<f64>, shape: Vec<usize>| {
            dict.set_item(name, PyArray1::from_vec(py, values).reshape(shape)?)
        };
        set("rate", found.rate.to_vec(), vec![d])?;
        set("by_state", found.by_state.as_flattened().to_vec(), vec![d, d])?;
        let parameters = found.by_parameter.len();
        set("by_parameter", found.by_parameter.into_flattened(), vec![parameters, d])?;
        set("surfaces", found.surfaces.clone(), vec![found.surfaces.len()])?;
        let (second, third) = if all { higher(family, values, t, &x) } else { Default::default() };
        let wide = if all { d } else { 0 };
        set("second", second, vec![wide; 3])?;
        set("third", third, vec![wide; 4])?;
    });
    Ok(dict)
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(shoot, module)?)?;
    module.add_function(wrap_pyfunction!(expansion, module)?)
}
