//! The core's errors as Python exceptions.

use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};
use pyo3::prelude::*;

use crate::integrate::Failure;
use crate::memory::{self, Shortage};

pyo3::import_exception!(udd.errors, FitError);
pyo3::import_exception!(udd.errors, IntegrationError);
pyo3::import_exception!(udd.errors, ModelError);

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> PyErr {
        match failure {
            Failure::Interrupted => PyKeyboardInterrupt::new_err(()),
            full @ Failure::NoRoom { .. } => PyMemoryError::new_err(full.to_string()),
            other => IntegrationError::new_err(format!("the integration failed: {other}")),
        }
    }
}

/// So many things for which there is no room.
pub fn short_of(what: &str, shortage: Shortage) -> PyErr {
    PyMemoryError::new_err(format!("{what} {shortage}"))
}

/// Asks for the bytes that so many things take, before they are taken.
pub fn room_for(what: &str, bytes: f64) -> PyResult<()> {
    memory::require(bytes).map_err(|shortage| short_of(what, shortage))
}

/// Refuse what does not fit into memory: `what`, in the plural, takes so many bytes.
#[pyfunction]
fn require_memory(what: &str, bytes: f64) -> PyResult<()> {
    room_for(what, bytes)
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(require_memory, module)?)
}
