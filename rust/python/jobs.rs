//! Many runs at once: their parameters, starts and outcomes as arrays.

use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

use super::errors::ModelError;
use super::model::AnyModel;
use crate::integrate::Failure;
use crate::run::Outcome;

/// The outcome of a run as a number: its place in `udd`'s list of outcomes.
pub const FINISHED: u8 = 0;
pub const EJECTED: u8 = 1;
pub const FAILED: u8 = 3;
pub const INTERRUPTED: u8 = 4;
pub const CHATTERING: u8 = 6;

/// The number of an outcome.
pub fn outcome_code(outcome: Result<Outcome, Failure>) -> u8 {
    match outcome {
        Ok(Outcome::Finished) => FINISHED,
        Ok(Outcome::Ejected) => EJECTED,
        Ok(Outcome::Chattering) => CHATTERING,
        Err(_) => FAILED,
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

/// Rows of initial states.
pub fn starts<const D: usize>(starts: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; D]>> {
    let starts = starts.as_array();
    if starts.nrows() == 0 || starts.ncols() != D {
        let (rows, columns) = starts.dim();
        let message = format!("initial states of {D} numbers are needed, not {rows} rows of {columns}");
        return Err(ModelError::new_err(message));
    }
    Ok(starts.rows().into_iter().map(|row| std::array::from_fn(|n| row[n])).collect())
}

/// Values and starts come one for each run, or one for all.
pub fn agree(values: usize, starts: usize) -> PyResult<()> {
    if values == starts || values == 1 || starts == 1 {
        return Ok(());
    }
    let message = format!("there are {values} rows of parameters but {starts} initial states");
    Err(ModelError::new_err(message))
}
