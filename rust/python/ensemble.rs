//! `udd.ensemble`.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::errors::{room_for, short_of};
use super::jobs::{self, Batch, outcome_code};
use super::model::with_wide_model;
use super::simulate::stepper;
use crate::analysis::{Ensemble, EnsembleRun, ExecutionContext, rows};
use crate::memory;
use crate::model::Family;

/// Columns, one row for each run.
struct Table {
    times: usize,
    states: Vec<f64>,
    end: Vec<f64>,
    t_end: Vec<f64>,
    outcome: Vec<u8>,
}

impl Table {
    fn new(runs: usize, times: usize, dimension: usize) -> PyResult<Self> {
        let mut table =
            Self { times, states: Vec::new(), end: Vec::new(), t_end: Vec::new(), outcome: Vec::new() };
        let numbers = runs.saturating_mul(times).saturating_mul(dimension);
        let what = format!("{runs} runs of {times} states");
        // In this table, and run by run before.
        room_for(&what, numbers as f64 * 8.0)?;
        room_for(&what, numbers as f64 * 16.0)?;
        memory::reserve(&mut table.states, numbers).map_err(|shortage| short_of(&what, shortage))?;
        Ok(table)
    }

    /// The states that a run met, one after the other, and its end.
    fn push(&mut self, states: &[f64], t: f64, x: &[f64], outcome: u8) {
        self.states.extend_from_slice(states);
        self.states.resize(self.states.len() + self.times * x.len() - states.len(), f64::NAN);
        self.end.extend_from_slice(x);
        self.t_end.push(t);
        self.outcome.push(outcome);
    }
}

fn collect<F: Family<D>, const D: usize>(
    ensemble: &Ensemble<'_, F, D>,
    mut table: Table,
    context: ExecutionContext<'_>,
) -> Table {
    for passage in ensemble.run(context) {
        match passage {
            Some(EnsembleRun { states, t, x, outcome }) => {
                table.push(states.as_flattened(), t, &x, outcome_code(outcome));
            }
            None => table.push(&[], f64::NAN, &[f64::NAN; D], jobs::INTERRUPTED),
        }
    }
    table
}

/// The states of many runs at these times. Returns a dict of columns; on Ctrl-C with what there is.
#[pyfunction]
fn ensemble<'py>(
    py: Python<'py>,
    batch: Batch<'py>,
    times: PyReadonlyArray1<'py, f64>,
    method: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let model = batch.model()?;
    let (tolerance, stepper) = (batch.tolerance(), stepper(method)?);
    let times = times.as_slice()?.to_vec();
    if times.is_empty() {
        return Err(super::errors::ModelError::new_err("at least one time is needed"));
    }
    let values = batch.rows(&model)?;
    let watched = batch.jobs();
    let (table, dimension, signal) = with_wide_model!(packets: &model, |family, _values| {
        let starts = jobs::starts(&batch.starts, family.idle())?;
        jobs::agree(values.len(), starts.len())?;
        let dimension = starts[0].len();
        let table = Table::new(rows::count(&values, &starts), times.len(), dimension)?;
        let ensemble =
            Ensemble { family, values: &values, starts: &starts, times: &times, tolerance, stepper };
        let (table, signal) = watched.watch(py, |context| collect(&ensemble, table, context))?;
        (table, dimension, signal)
    });
    jobs::lost(py, signal, &table.outcome)?;
    let runs = table.outcome.len();
    let dict = PyDict::new(py);
    let live = model.states().len();
    let cut = |numbers| PyArray1::from_vec(py, jobs::live(numbers, dimension, live));
    dict.set_item("states", cut(table.states).reshape([runs, times.len(), live])?)?;
    dict.set_item("end", cut(table.end).reshape([runs, live])?)?;
    dict.set_item("t_end", PyArray1::from_vec(py, table.t_end))?;
    dict.set_item("outcome", PyArray1::from_vec(py, table.outcome))?;
    Ok(dict)
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(ensemble, module)?)
}
