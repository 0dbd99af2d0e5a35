//! `udd.lyapunov`.

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use rayon::prelude::*;

use super::errors::{IntegrationError, ModelError};
use super::interrupt;
use super::model::{AnyModel, state, with_model};
use crate::integrate::{Failure, Tolerance};
use crate::model::Family;
use crate::run::{Exponent, LyapunovOptions, Stop, largest_exponent};
use crate::scalar::Dual;

fn exponent<F: Family<D>, const D: usize>(
    family: &F,
    values: &[f64],
    x0: [f64; D],
    options: &LyapunovOptions,
    stop: &Stop,
) -> Result<Exponent, Failure> {
    let values: Vec<_> = values.iter().map(|&value| Dual::fixed(value)).collect();
    largest_exponent(&family.build(&values), x0, options, stop)
}

/// A failure at one value of the parameter that is swept.
struct At(f64, Failure);

impl From<At> for PyErr {
    fn from(At(value, failure): At) -> PyErr {
        match failure {
            Failure::Interrupted => failure.into(),
            other => IntegrationError::new_err(format!(
                "the integration failed at parameter value {value}: {other}"
            )),
        }
    }
}

type Columns<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<bool>>);

/// Largest exponents of a model for each value of one of its parameters, on all cores: exponents,
/// standard errors, and whether each met the goal.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
fn lyapunov<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    index: usize,
    values: PyReadonlyArray1<'py, f64>,
    state0: Vec<f64>,
    time: f64,
    transient: f64,
    goal: f64,
    rtol: f64,
    atol: f64,
) -> PyResult<Columns<'py>> {
    let model = AnyModel::from_python(model)?;
    if index >= model.values().len() {
        return Err(ModelError::new_err(format!("the model has no parameter number {index}")));
    }
    let swept = values.as_slice()?.to_vec();
    let options = LyapunovOptions { time, transient, goal, tolerance: Tolerance { rtol, atol } };
    let list = with_model!(&model, |family, plain| {
        let x0 = state(&state0)?;
        interrupt::run(py, |stop| {
            let one = |&value: &f64| {
                let mut values = plain.clone();
                values[index] = value;
                exponent(family, &values, x0, &options, stop).map_err(|failure| At(value, failure))
            };
            swept.par_iter().with_max_len(1).map(one).collect::<Result<Vec<_>, At>>()
        })?
    });
    let value = PyArray1::from_vec(py, list.iter().map(|e| e.value).collect());
    let error = PyArray1::from_vec(py, list.iter().map(|e| e.standard_error).collect());
    let converged = PyArray1::from_vec(py, list.iter().map(|e| e.converged).collect());
    Ok((value, error, converged))
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(lyapunov, module)?)
}
