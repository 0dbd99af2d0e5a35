//! The core's errors as Python exceptions.

use pyo3::PyErr;
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};

use crate::integrate::Failure;

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
