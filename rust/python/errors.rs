//! The core's errors as Python exceptions.

use pyo3::PyErr;
use pyo3::exceptions::PyKeyboardInterrupt;

use crate::integrate::Failure;

pyo3::import_exception!(udd.errors, FitError);
pyo3::import_exception!(udd.errors, IntegrationError);
pyo3::import_exception!(udd.errors, ModelError);

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> PyErr {
        match failure {
            Failure::Interrupted => PyKeyboardInterrupt::new_err(()),
            other => IntegrationError::new_err(format!("the integration failed: {other}")),
        }
    }
}
