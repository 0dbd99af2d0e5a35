//! The library of effects as data, from which `udd.effects` makes its constructors.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::model::effects::{Body, EffectParameter, FrictionModel, Kind, Momentum, Role, Slot};

/// Every effect: a list of dicts with the keys name, title, equation, meaning, bodies, slots, momenta, treatments
/// and parameters; each parameter is a dict with the keys name, unit, default, range, role, scan and along.
#[pyfunction]
fn effect_library(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let list = PyList::empty(py);
    for kind in Kind::ALL {
        let spec = kind.spec();
        let entry = PyDict::new(py);
        entry.set_item("name", spec.name)?;
        entry.set_item("title", spec.title)?;
        entry.set_item("equation", spec.equation)?;
        entry.set_item("meaning", spec.meaning)?;
        entry.set_item("bodies", spec.bodies.iter().map(|&body: &Body| body.name()).collect::<Vec<_>>())?;
        entry.set_item("slots", spec.slots.iter().map(|&slot: &Slot| slot.name()).collect::<Vec<_>>())?;
        entry.set_item("momenta", spec.momenta.iter().map(|&m: &Momentum| m.name()).collect::<Vec<_>>())?;
        let treatments: &[FrictionModel] = if kind.dry() { FrictionModel::ALL } else { &[] };
        entry.set_item(
            "treatments",
            treatments.iter().map(|&t: &FrictionModel| t.name()).collect::<Vec<_>>(),
        )?;
        let parameters = spec.parameters.iter().map(|p| parameter(py, p)).collect::<PyResult<Vec<_>>>()?;
        entry.set_item("parameters", parameters)?;
        list.append(entry)?;
    }
    Ok(list)
}

fn parameter<'py>(py: Python<'py>, p: &EffectParameter) -> PyResult<Bound<'py, PyDict>> {
    let (role, scan, along): (&str, &[f64], &str) = match p.role {
        Role::Amplitude => ("amplitude", &[], ""),
        Role::Shape(values) => ("shape", values, ""),
        Role::Frequency => ("frequency", &[], ""),
        Role::Scanned(what) => ("scanned", &[], what),
    };
    let entry = PyDict::new(py);
    entry.set_item("name", p.name)?;
    entry.set_item("unit", p.unit)?;
    entry.set_item("default", p.default)?;
    entry.set_item("range", p.range)?;
    entry.set_item("role", role)?;
    entry.set_item("scan", scan.to_vec())?;
    entry.set_item("along", along)?;
    Ok(entry)
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(effect_library, module)?)
}
