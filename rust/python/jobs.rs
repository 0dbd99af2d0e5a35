//! Many runs at once: their parameters, starts and outcomes as arrays.

use std::sync::atomic::{AtomicUsize, Ordering};

use numpy::PyReadonlyArray2;
use numpy::ndarray::ArrayView1;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use super::errors::ModelError;
use super::interrupt;
use super::model::AnyModel;
use crate::analysis::{ExecutionContext, Outcome};
use crate::integrate::{Failure, Tolerance};
use crate::scalar::Isa;

/// The outcome of a run as a number: its place in `udd`'s list of outcomes.
pub const FINISHED: u8 = 0;
pub const EJECTED: u8 = 1;
pub const TIME_RAN_OUT: u8 = 2;
pub const FAILED: u8 = 3;
pub const INTERRUPTED: u8 = 4;
pub const ESCAPED: u8 = 5;
pub const CHATTERING: u8 = 6;

/// The number of a run's outcome.
pub fn outcome_code(outcome: Result<Outcome, Failure>) -> u8 {
    match outcome {
        Ok(Outcome::Finished) => FINISHED,
        Ok(Outcome::Ejected) => EJECTED,
        Ok(Outcome::Chattering) => CHATTERING,
        Err(failure) => failure_code(failure),
    }
}

/// The number of a failure.
pub fn failure_code(failure: Failure) -> u8 {
    match failure {
        Failure::Chattering { .. } => CHATTERING,
        Failure::Interrupted => INTERRUPTED,
        _ => FAILED,
    }
}

/// As `udd.simulation.batch.Batch`.
#[derive(FromPyObject)]
pub struct Batch<'py> {
    model: Bound<'py, PyAny>,
    values: PyReadonlyArray2<'py, f64>,
    pub starts: PyReadonlyArray2<'py, f64>,
    rtol: f64,
    atol: f64,
    max_step: f64,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
}

impl<'py> Batch<'py> {
    pub fn model(&self) -> PyResult<AnyModel> {
        AnyModel::from_python(&self.model)
    }

    pub fn tolerance(&self) -> Tolerance {
        Tolerance { rtol: self.rtol, atol: self.atol, max_step: self.max_step }
    }

    pub fn rows(&self, model: &AnyModel) -> PyResult<Vec<Vec<f64>>> {
        values(model, &self.values)
    }

    pub fn jobs(&self) -> Jobs<'_, 'py> {
        Jobs { threads: self.threads, done: AtomicUsize::new(0), progress: &self.progress }
    }
}

/// Jobs that Python watches: on so many threads (0 for one per core), each counted when it is done.
pub struct Jobs<'a, 'py> {
    threads: usize,
    done: AtomicUsize,
    /// Called with the number of jobs done.
    progress: &'a Option<Bound<'py, PyAny>>,
}

impl Jobs<'_, '_> {
    /// As [`interrupt::watch`]: what the work on all threads results in, and a signal that came meanwhile.
    pub fn watch<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(ExecutionContext<'_>) -> T + Send,
    ) -> PyResult<(T, PyResult<()>)> {
        let (threads, done, progress) = (self.threads, &self.done, self.progress);
        let tick = || match progress {
            Some(call) => call.call1((done.load(Ordering::Relaxed),)).map(drop),
            None => Ok(()),
        };
        interrupt::watch(py, &tick, |stop| work(ExecutionContext { threads, isa: Isa::best(), done, stop }))
    }
}

/// A signal without a message: on Ctrl-C what is finished is kept, and rows that are not say so.
pub fn lost(py: Python<'_>, signal: PyResult<()>, outcomes: &[u8]) -> PyResult<()> {
    match signal {
        Err(error) if error.is_instance_of::<PyKeyboardInterrupt>(py) && outcomes.contains(&INTERRUPTED) => {
            Ok(())
        }
        signal => signal,
    }
}

/// Rows of parameter values.
pub fn values(model: &AnyModel, values: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Vec<f64>>> {
    let values = values.as_array();
    let wanted = model.values().len();
    if values.nrows() == 0 || values.ncols() != wanted {
        let (rows, columns) = values.dim();
        let message = format!("rows of {wanted} parameter values are needed, not {rows} rows of {columns}");
        return Err(ModelError::new_err(message));
    }
    Ok(values.rows().into_iter().map(|row| row.to_vec()).collect())
}

/// Rows of initial states, padded at the end with `idle` zeros.
pub fn starts<const D: usize>(starts: &PyReadonlyArray2<'_, f64>, idle: usize) -> PyResult<Vec<[f64; D]>> {
    let (starts, wanted) = (starts.as_array(), D - idle);
    if starts.nrows() == 0 || starts.ncols() != wanted {
        let (rows, columns) = starts.dim();
        let message = format!("initial states of {wanted} numbers are needed, not {rows} rows of {columns}");
        return Err(ModelError::new_err(message));
    }
    let state = |row: ArrayView1<'_, f64>| std::array::from_fn(|n| row.get(n).copied().unwrap_or(0.0));
    Ok(starts.rows().into_iter().map(state).collect())
}

/// The first `live` numbers of each row of `width`: those of live states.
pub fn live(numbers: Vec<f64>, width: usize, live: usize) -> Vec<f64> {
    if width == live {
        return numbers;
    }
    numbers.chunks_exact(width).flat_map(|row| &row[..live]).copied().collect()
}

/// Values and starts come one for each run, or one for all.
pub fn agree(values: usize, starts: usize) -> PyResult<()> {
    if values == starts || values == 1 || starts == 1 {
        return Ok(());
    }
    let message = format!("there are {values} rows of parameters but {starts} initial states");
    Err(ModelError::new_err(message))
}
