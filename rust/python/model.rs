//! Models as Python hands them over.

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::{PyAttributeError, PyTypeError};
use pyo3::prelude::*;

use super::errors::ModelError;
use crate::model::effects::{Body, Kind, Slot, Treatment};
use crate::model::{
    Bristled, DiskFamily, DleFamily, Effect, Family, Momentum, PendulumFamily, System, sides_of,
};

/// Any model with its parameter values, in the order of its family's parameters.
#[derive(Clone, Debug)]
pub enum AnyModel {
    Dle(DleFamily, Vec<f64>),
    Disk(DiskFamily, Vec<f64>),
    Pendulum(PendulumFamily, Vec<f64>),
    /// With LuGre friction, whose bristles are one more state.
    BristledDisk(Bristled<DiskFamily>, Vec<f64>),
    BristledPendulum(Bristled<PendulumFamily>, Vec<f64>),
}

/// Runs the expression with the model's family and values, whatever its dimension.
macro_rules! with_model {
    ($model:expr, |$family:ident, $values:ident| $body:expr) => {
        match $model {
            $crate::python::model::AnyModel::Dle($family, $values) => $body,
            $crate::python::model::AnyModel::Disk($family, $values) => $body,
            $crate::python::model::AnyModel::Pendulum($family, $values) => $body,
            $crate::python::model::AnyModel::BristledDisk($family, $values) => $body,
            $crate::python::model::AnyModel::BristledPendulum($family, $values) => $body,
        }
    };
}
pub(crate) use with_model;

/// The same for work on packets, which is compiled for each instruction set: friction by bristles, rarely
/// wanted there, would double the time that takes.
macro_rules! with_wide_model {
    ($model:expr, |$family:ident, $values:ident| $body:expr) => {
        match $model {
            $crate::python::model::AnyModel::Dle($family, $values) => $body,
            $crate::python::model::AnyModel::Disk($family, $values) => $body,
            $crate::python::model::AnyModel::Pendulum($family, $values) => $body,
            _ => {
                let message = "friction with the treatment lugre is for udd.simulate; here take set-valued";
                return Err($crate::python::errors::ModelError::new_err(message));
            }
        }
    };
}
pub(crate) use with_wide_model;

/// An effect's name, momentum and treatment.
type EffectSpec = (String, Option<String>, Option<String>);
/// What a Python model's `_spec` holds: kind, values, effects, edge.
type Spec = (String, Vec<f64>, Vec<EffectSpec>, bool);

impl AnyModel {
    /// Reads the attribute `_spec` of a Python model.
    pub fn from_python(model: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = model.py();
        let spec = model.getattr("_spec").and_then(|spec| spec.extract::<Spec>());
        let (kind, values, effects, edge) = match spec {
            Ok(spec) => spec,
            Err(error)
                if error.is_instance_of::<PyAttributeError>(py)
                    || error.is_instance_of::<PyTypeError>(py) =>
            {
                return Err(ModelError::new_err(format!(
                    "a model is needed (udd.DLE, udd.Disk or udd.Pendulum), not {}",
                    model.get_type().name()?
                )));
            }
            // A Ctrl-C, for example, stays one.
            Err(error) => return Err(error),
        };
        let effects = effects.iter().map(effect).collect::<PyResult<Vec<_>>>()?;
        let bristles = bristled(&effects)?;
        let model = match kind.as_str() {
            "dle" => AnyModel::Dle(DleFamily, values),
            "disk" if bristles => AnyModel::BristledDisk(Bristled(DiskFamily { effects, edge }), values),
            "disk" => AnyModel::Disk(DiskFamily { effects, edge }, values),
            "pendulum" => {
                if let Some(other) =
                    effects.iter().find(|effect| !effect.kind.spec().bodies.contains(&Body::Pendulum))
                {
                    let name = other.kind.spec().name;
                    let message = format!("the effect {name} acts on a disk, not on a pendulum");
                    return Err(ModelError::new_err(message));
                }
                let family = PendulumFamily { effects };
                match bristles {
                    true => AnyModel::BristledPendulum(Bristled(family), values),
                    false => AnyModel::Pendulum(family, values),
                }
            }
            _ => return Err(ModelError::new_err(format!("unknown kind of model: {kind}"))),
        };
        let wanted = with_model!(&model, |family, _values| family.parameters().len());
        if model.values().len() != wanted {
            let given = model.values().len();
            return Err(ModelError::new_err(format!("the model takes {wanted} parameters, not {given}")));
        }
        Ok(model)
    }

    /// The same for a fit, which needs laws without jumps.
    pub fn to_fit(model: &Bound<'_, PyAny>) -> PyResult<Self> {
        let model = Self::from_python(model)?;
        let effects: &[Effect] = match &model {
            AnyModel::Dle(..) => &[],
            AnyModel::Disk(family, _) | AnyModel::BristledDisk(Bristled(family), _) => &family.effects,
            AnyModel::Pendulum(family, _) | AnyModel::BristledPendulum(Bristled(family), _) => {
                &family.effects
            }
        };
        if let Some(effect) = effects.iter().find(|effect| effect.treatment != Treatment::Smoothed) {
            let (name, treatment) = (effect.kind.spec().name, effect.treatment.name());
            return Err(ModelError::new_err(format!(
                "a fit needs smoothed friction: give {name} the treatment smoothed, not {treatment}"
            )));
        }
        Ok(model)
    }

    /// The parameter values.
    pub fn values(&self) -> &[f64] {
        with_model!(self, |_family, values| values)
    }
}

/// Whether the effects' friction comes from bristles.
fn bristled(effects: &[Effect]) -> PyResult<bool> {
    let bristles = |effect: &&Effect| effect.treatment == Treatment::Lugre;
    if !effects.iter().any(|effect| bristles(&effect)) {
        return Ok(false);
    }
    if effects.iter().any(|effect| effect.kind.dry() && !bristles(&effect)) {
        let message =
            "where one effect has the treatment lugre all dry friction must have it: it shares the bristles";
        return Err(ModelError::new_err(message));
    }
    if !effects.iter().filter(bristles).any(|effect| effect.kind == Kind::Coulomb) {
        let message = "stribeck with the treatment lugre needs coulomb beside it: without friction at speed the bristles would follow any motion at once";
        return Err(ModelError::new_err(message));
    }
    Ok(true)
}

fn effect((name, momentum, treatment): &EffectSpec) -> PyResult<Effect> {
    let kind = Kind::ALL.iter().copied().find(|kind| kind.spec().name == name);
    let kind = kind.ok_or_else(|| ModelError::new_err(format!("no effect is called {name}")))?;
    let momentum = match momentum.as_deref() {
        None => None,
        Some("consistent") => Some(Momentum::Consistent),
        Some("constraint") => Some(Momentum::Constraint),
        Some(other) => {
            return Err(ModelError::new_err(format!(
                "momentum must be consistent or constraint, not {other}"
            )));
        }
    };
    let velocity = kind.spec().slots.iter().any(|slot| matches!(slot, Slot::Lateral | Slot::Vertical));
    if velocity != momentum.is_some() || momentum.is_some_and(|m| !kind.spec().momenta.contains(&m)) {
        return Err(ModelError::new_err(format!("the effect {name} cannot enter the momentum that way")));
    }
    let treatment = match treatment.as_deref() {
        None => Treatment::Smoothed,
        Some(given) => {
            let found = Treatment::ALL.iter().copied().find(|treatment| treatment.name() == given);
            found.filter(|_| kind.dry()).ok_or_else(|| {
                ModelError::new_err(format!("the effect {name} has no treatment called {given}"))
            })?
        }
    };
    Ok(Effect::new(kind).with_momentum(momentum).with_treatment(treatment))
}

/// The state as an array of the dimension asked for.
pub fn state<const D: usize>(values: &[f64]) -> PyResult<[f64; D]> {
    values
        .try_into()
        .map_err(|_| ModelError::new_err(format!("the state needs {D} numbers, not {}", values.len())))
}

/// Names and units of a model's parameters, in order.
#[pyfunction]
fn model_parameters(model: &Bound<'_, PyAny>) -> PyResult<Vec<(String, &'static str)>> {
    let model = AnyModel::from_python(model)?;
    let list = with_model!(&model, |family, _values| family.parameters());
    Ok(list.into_iter().map(|p| (p.name, p.unit)).collect())
}

/// The right-hand side at `n` times and states, both flat; returns `n` rates, flat.
#[pyfunction]
fn rates<'py>(
    model: &Bound<'py, PyAny>,
    t: PyReadonlyArray1<'py, f64>,
    states: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    fn all<F: Family<D>, const D: usize>(
        family: &F,
        values: &[f64],
        t: &[f64],
        flat: &[f64],
    ) -> PyResult<Vec<f64>> {
        if flat.len() != t.len() * D {
            let message = format!("{} states of {D} numbers are needed, not {} numbers", t.len(), flat.len());
            return Err(ModelError::new_err(message));
        }
        let system = family.build(values);
        let mut out = Vec::with_capacity(flat.len());
        for (&t, x) in t.iter().zip(flat.as_chunks::<D>().0) {
            out.extend(system.rates(t, x, &sides_of(&system, t, x)));
        }
        Ok(out)
    }
    let parsed = AnyModel::from_python(model)?;
    let (t, states) = (t.as_slice()?, states.as_slice()?);
    let out = with_model!(&parsed, |family, values| all(family, values, t, states))?;
    Ok(PyArray1::from_vec(model.py(), out))
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(model_parameters, module)?)?;
    module.add_function(wrap_pyfunction!(rates, module)?)
}
