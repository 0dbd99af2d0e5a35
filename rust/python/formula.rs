//! Parsing of a formula's text by the core.

use pyo3::prelude::*;

use super::errors::ModelError;
use crate::formula::{Expression, Names};
use crate::machine::{self, When};

/// A formula's operations on a stack: what each is called, how many numbers it takes, and the number that it holds.
#[pyfunction]
#[pyo3(signature = (text, variables, parameters = Vec::new()))]
fn formula_operations(
    text: &str,
    variables: Vec<String>,
    parameters: Vec<String>,
) -> PyResult<Vec<(&'static str, usize, f64)>> {
    let names = Names { states: &variables, parameters: &parameters, inputs: &[], rates: false };
    let parsed = Expression::parse(text, names)
        .map_err(|mistake| ModelError::new_err(format!("the formula {mistake}")))?;
    Ok(parsed.ops().iter().map(|op| (op.name(), op.takes(), op.number())).collect())
}

/// Determines when models get machine code: "never", if it is "paying", or "always".
#[pyfunction]
fn make_machine_code(when: &str) -> PyResult<()> {
    machine::make_code(match when {
        "never" => When::Never,
        "paying" => When::Paying,
        "always" => When::Always,
        _ => return Err(ModelError::new_err(format!("expected never, paying or always, got {when:?}"))),
    });
    Ok(())
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(make_machine_code, module)?)?;
    module.add_function(wrap_pyfunction!(formula_operations, module)?)
}
