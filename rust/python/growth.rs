//! Which components of a model grow in proportion to themselves.

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

use super::model::{AnyModel, state, with_model};
use crate::analysis;
use crate::model::Family;

/// The numbers of the components whose rates at these states, which are flat, vanish with them.
#[pyfunction]
fn growing_components(
    model: &Bound<'_, PyAny>,
    t: f64,
    states: PyReadonlyArray1<'_, f64>,
) -> PyResult<Vec<usize>> {
    let parsed = AnyModel::from_python(model)?;
    let (live, flat) = (parsed.states().len(), states.as_slice()?);
    with_model!(&parsed, |family, values| {
        let rows: PyResult<Vec<_>> = flat.chunks(live).map(|row| state(row, family.idle())).collect();
        Ok(analysis::growing_components(family, values, t, &rows?))
    })
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(growing_components, module)?)
}
