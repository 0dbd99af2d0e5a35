//! Models as Python hands them over.

use std::sync::Arc;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyAttributeError, PyTypeError};
use pyo3::prelude::*;

use super::errors::{ModelError, room_for};
use super::interrupt;
use crate::analysis::batch::rows::tape;
use crate::estimate::{FormulaSensor, Moment, Sensor, seen};
use crate::formula::{Names, is_reserved};
use crate::latest::Latest;
use crate::model::effects::{Body, Formula, FrictionModel, Kind, Slot, Source};
use crate::model::{
    DiskFamily, DleFamily, Effect, Either, Family, FormulaFamily, MAX_INPUTS, Momentum, Observation,
    PendulumFamily, Signal, Signals, WithLuGre,
};

/// The most states and sensors of a user's own model.
const MAX_STATES: usize = 12;

/// Any model with its parameter values, in the order of its family's parameters.
///
/// Models of as many states share what is compiled for that number.
#[derive(Clone, Debug)]
pub enum AnyModel {
    /// Models of one state have a padding state.
    Two(Either<PendulumFamily, FormulaFamily<2>>, Vec<f64>),
    Three(Either<DleFamily, FormulaFamily<3>>, Vec<f64>),
    Four(Either<DiskFamily, FormulaFamily<4>>, Vec<f64>),
    /// With 5 or 6 states, padding included.
    Six(FormulaFamily<6>, Vec<f64>),
    /// With 7 to 12 states, padding included.
    Twelve(FormulaFamily<12>, Vec<f64>),
    /// With LuGre friction, whose bristles are one more state. Its law is not smooth, so it is compiled separately.
    BristledDisk(WithLuGre<DiskFamily>, Vec<f64>),
    /// The same for a pendulum.
    BristledPendulum(WithLuGre<PendulumFamily>, Vec<f64>),
}

/// Runs the expression with the model's family and values, whatever its dimension. The DLE is distinguished before:
/// its law is so short that a choice of the law at every stage costs a fifth.
macro_rules! with_model {
    ($model:expr, |$family:ident, $values:ident| $body:expr) => {
        match $model {
            $crate::python::model::AnyModel::Two($family, $values) => $body,
            $crate::python::model::AnyModel::Three($crate::model::Either::First($family), $values) => $body,
            $crate::python::model::AnyModel::Three($crate::model::Either::Second($family), $values) => $body,
            $crate::python::model::AnyModel::Four($family, $values) => $body,
            $crate::python::model::AnyModel::BristledDisk($family, $values) => $body,
            $crate::python::model::AnyModel::Six($family, $values) => $body,
            $crate::python::model::AnyModel::Twelve($family, $values) => $body,
            $crate::python::model::AnyModel::BristledPendulum($family, $values) => $body,
        }
    };
}
pub(crate) use with_model;

/// The same for work on packets and tangents, which takes long to compile: not for friction by bristles.
///
/// `tangents` are for single numbers, and models of as many states share what is compiled. Among `packets` single runs of
/// the DLE are compiled separately.
macro_rules! with_wide_model {
    (tangents: $model:expr, |$family:ident, $values:ident| $body:expr) => {
        $crate::python::model::with_wide_model!(@ $model, $values, $body,
            Two($family) Three($family) Four($family) Six($family) Twelve($family))
    };
    (packets: $model:expr, |$family:ident, $values:ident| $body:expr) => {
        $crate::python::model::with_wide_model!(@ $model, $values, $body, Two($family)
            Three($crate::model::Either::First($family)) Three($crate::model::Either::Second($family))
            Four($family) Six($family) Twelve($family))
    };
    (@ $model:expr, $values:ident, $body:expr, $($Kind:ident($held:pat))+) => {
        match $model {
            $($crate::python::model::AnyModel::$Kind($held, $values) => $body,)+
            other => return Err(other.too_much()),
        }
    };
}
pub(crate) use with_wide_model;

/// Runs the expression with the family and the values of a model given as text, whatever its number of states; the other
/// expression for a compiled model.
macro_rules! with_formula {
    ($model:expr, |$family:ident, $values:ident| $body:expr $(, else $other:expr)?) => {
        match $model {
            AnyModel::Two(Either::Second($family), $values) => $body,
            AnyModel::Three(Either::Second($family), $values) => $body,
            AnyModel::Four(Either::Second($family), $values) => $body,
            AnyModel::Six($family, $values) => $body,
            AnyModel::Twelve($family, $values) => $body,
            _ => { $($other)? }
        }
    };
}

/// The kinds of models that are compiled, beside the user's own; `udd.models` has a file of that name for each.
const KINDS: [&str; 3] = ["dle", "disk", "pendulum"];

/// The slot of a user's own effect, its formula, its parameters' names, and those of the amplitudes.
type FormulaSpec = (String, String, Vec<String>, Vec<String>);
/// An effect's name, momentum and treatment, and its formula where it is a user's own.
type EffectSpec = (String, Option<String>, Option<String>, Option<FormulaSpec>);
/// A Python model's `_spec`: kind, values, effects, edge.
type Spec = (String, Vec<f64>, Vec<EffectSpec>, bool);

impl AnyModel {
    /// Reads the attribute `_spec` of a Python model that is to be integrated.
    pub fn from_python(model: &Bound<'_, PyAny>) -> PyResult<Self> {
        let parsed = Self::parsed(model)?;
        if with_model!(&parsed, |family, _values| family.is_open()) {
            let names: Vec<String> = model.getattr("inputs")?.extract()?;
            let message = format!(
                "the model's inputs {} need signals: give inputs={{\"{}\": ...}}",
                names.join(", "),
                names[0]
            );
            return Err(ModelError::new_err(message));
        }
        Ok(parsed)
    }

    /// The same of one that is only asked what it consists of.
    fn parsed(model: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = model.py();
        let spec = model.getattr("_spec").and_then(|spec| spec.extract::<Spec>());
        let (kind, values, effects, edge) = match spec {
            Ok(spec) => spec,
            Err(error)
                if error.is_instance_of::<PyAttributeError>(py)
                    || error.is_instance_of::<PyTypeError>(py) =>
            {
                return Err(ModelError::new_err(format!(
                    "a model is needed (udd.DLE, udd.Disk, udd.Pendulum or a udd.Model), not {}",
                    model.get_type().name()?
                )));
            }
            // A Ctrl-C, for example, stays one.
            Err(error) => return Err(error),
        };
        let effects = effects.iter().map(effect).collect::<PyResult<Vec<_>>>()?;
        let bristles = bristled(&effects)?;
        if kind == "disk" {
            able(&effects, Body::Disk)?;
        }
        let model = match kind.as_str() {
            "dle" => AnyModel::Three(Either::First(DleFamily), values),
            "disk" if bristles => AnyModel::BristledDisk(WithLuGre(DiskFamily { effects, edge }), values),
            "disk" => AnyModel::Four(Either::First(DiskFamily { effects, edge }), values),
            "pendulum" => {
                able(&effects, Body::Pendulum)?;
                let family = PendulumFamily { effects };
                match bristles {
                    true => AnyModel::BristledPendulum(WithLuGre(family), values),
                    false => AnyModel::Two(Either::First(family), values),
                }
            }
            "own" => own(&model.getattr("_own")?.extract()?, values)?,
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
            AnyModel::Four(Either::First(family), _) | AnyModel::BristledDisk(WithLuGre(family), _) => {
                &family.effects
            }
            AnyModel::Two(Either::First(family), _) | AnyModel::BristledPendulum(WithLuGre(family), _) => {
                &family.effects
            }
            _ => &[],
        };
        if let Some(effect) = effects.iter().find(|effect| effect.treatment != FrictionModel::Smoothed) {
            let (name, treatment) = (effect.name(), effect.treatment.name());
            return Err(ModelError::new_err(format!(
                "a fit needs smoothed friction: give {name} the treatment smoothed, not {treatment}"
            )));
        }
        Ok(model)
    }

    /// The names of the live components, and which of them are angles, which may grow without limit.
    pub fn states(&self) -> Vec<(String, bool)> {
        let names: &[&str] = match self {
            AnyModel::Three(Either::First(_), _) => &["omega", "y", "z"],
            AnyModel::Four(Either::First(_), _) => &["Omega", "Y", "Z", "beta"],
            AnyModel::Two(Either::First(_), _) => &["Omega", "theta"],
            AnyModel::BristledDisk(..) => &["Omega", "Y", "Z", "beta", "bristle"],
            AnyModel::BristledPendulum(..) => &["Omega", "theta", "bristle"],
            AnyModel::Two(Either::Second(family), _) => return family.states(),
            AnyModel::Three(Either::Second(family), _) => return family.states(),
            AnyModel::Four(Either::Second(family), _) => return family.states(),
            AnyModel::Six(family, _) => return family.states(),
            AnyModel::Twelve(family, _) => return family.states(),
        };
        names.iter().map(|&name| (name.to_owned(), matches!(name, "beta" | "theta"))).collect()
    }

    /// Refuses one with measured inputs, which are known for as long as its record lasts.
    pub fn undriven(self) -> PyResult<Self> {
        if with_model!(&self, |family, _values| family.inputs()) == 0 {
            return Ok(self);
        }
        Err(ModelError::new_err(
            "a model with measured inputs is for udd.simulate, udd.ensemble, udd.fit, udd.discover and udd.forecast: \
             its law is known for as long as its record lasts",
        ))
    }

    /// The family of a user's own model with padding states up to the largest number.
    pub fn widest(&self) -> Option<FormulaFamily<MAX_STATES>> {
        Some(match self {
            AnyModel::Two(Either::Second(family), _) => family.filled(),
            AnyModel::Three(Either::Second(family), _) => family.filled(),
            AnyModel::Four(Either::Second(family), _) => family.filled(),
            AnyModel::Six(family, _) => family.filled(),
            AnyModel::Twelve(family, _) => family.clone(),
            _ => return None,
        })
    }

    /// The reason why a model with bristles is refused.
    pub fn too_much(&self) -> PyErr {
        ModelError::new_err("friction with the treatment lugre is for udd.simulate; here take set-valued")
    }

    /// Returns true for a model given as text.
    pub fn is_own(&self) -> bool {
        with_formula!(self, |_family, _values| true, else false)
    }

    /// The parameter values.
    pub fn values(&self) -> &[f64] {
        with_model!(self, |_family, values| values)
    }
}

/// The parts of a user-defined model, as `udd.models.formula_model.FormulaText`.
#[derive(FromPyObject)]
struct FormulaModelSpec<'py> {
    states: Vec<String>,
    equations: Vec<String>,
    parameters: Vec<String>,
    angles: Vec<String>,
    inputs: Vec<String>,
    /// Each input's delay: a parameter's name.
    delays: Vec<Option<String>>,
    /// The inputs' signals, record by record.
    records: Vec<Vec<InputSignal<'py>>>,
    /// The number of the record that counts where none is named.
    record: usize,
    observe: Vec<ChannelSpec>,
}

/// A sensor's channel: its name, the formula, the parameter of its delay, and whether it is an angle.
type ChannelSpec = (String, String, Option<String>, bool);

/// As `udd.InputSignal`.
#[derive(FromPyObject)]
struct InputSignal<'py> {
    t: PyReadonlyArray1<'py, f64>,
    values: PyReadonlyArray1<'py, f64>,
    #[pyo3(attribute("pieces"))]
    coefficients: PyReadonlyArray2<'py, f64>,
}

impl InputSignal<'_> {
    fn read(&self, delay: Option<usize>) -> PyResult<Signal> {
        let t = self.t.as_slice()?.to_vec();
        let pieces = self.coefficients.as_slice()?.as_chunks().0.to_vec();
        match self.values.as_slice()? {
            [.., last] if t.len() == pieces.len() + 1 => Ok(Signal::new(t, pieces, *last, delay)),
            _ => Err(ModelError::new_err("an input needs a polynomial between each two samples")),
        }
    }
}

/// The latest models without values and records, each with the texts that it was parsed from.
static LATEST: Latest<(Vec<Vec<String>>, Vec<ChannelSpec>), AnyModel> = Latest::new();

/// A model of the user's own; equal texts are parsed once.
fn own(spec: &FormulaModelSpec<'_>, values: Vec<f64>) -> PyResult<AnyModel> {
    let FormulaModelSpec { states, equations, parameters, angles, inputs, delays, records, record, observe } =
        spec;
    let texts = [states, equations, parameters, angles, inputs].map(Clone::clone);
    let mut model = LATEST.get((texts.to_vec(), observe.clone()), || own_law(spec))?;
    let delay =
        |name: &Option<String>| name.as_ref().and_then(|name| parameters.iter().position(|p| p == name));
    let delays: Vec<Option<usize>> = delays.iter().map(delay).collect();
    let mut signals = Vec::with_capacity(records.len());
    for record in records {
        if record.len() != inputs.len() || delays.len() != inputs.len() {
            return Err(ModelError::new_err("each record needs a signal for every input"));
        }
        let own = record.iter().zip(&delays).map(|(signal, &delay)| signal.read(delay));
        signals.push(Signals::new(own.collect::<PyResult<_>>()?));
    }
    with_formula!(&mut model, |family, numbers| {
        family.set_records(signals, *record);
        *numbers = values;
    });
    Ok(model)
}

/// The same without values and records.
fn own_law(spec: &FormulaModelSpec<'_>) -> PyResult<AnyModel> {
    let FormulaModelSpec { states, equations, parameters, angles, inputs, observe, .. } = spec;
    let all = || states.iter().chain(parameters).chain(inputs);
    for (i, name) in all().enumerate() {
        let what = match i {
            _ if i < states.len() => "state",
            _ if i < states.len() + parameters.len() => "parameter",
            _ => "input",
        };
        if is_reserved(name) {
            let message =
                format!("a {what} cannot be called {name}, which means something else in a formula");
            return Err(ModelError::new_err(message));
        }
        if all().filter(|other| *other == name).count() > 1 {
            return Err(ModelError::new_err(format!("the name {name} is given twice")));
        }
    }
    if states.len() != equations.len() {
        let message = format!("there are {} states but {} equations", states.len(), equations.len());
        return Err(ModelError::new_err(message));
    }
    if inputs.len() > MAX_INPUTS {
        let message = format!("a model has at most {MAX_INPUTS} inputs, not {}", inputs.len());
        return Err(ModelError::new_err(message));
    }
    let observation = observation(observe, Names { states, parameters, inputs: &[], rates: true })?;
    let texts: Vec<&str> = equations.iter().map(String::as_str).collect();
    macro_rules! parsed {
        ($($count:pat => $Kind:ident<$D:literal> |$family:ident| $held:expr),+) => {
            match states.len() {
                $($count => FormulaFamily::<$D>::parse(states, &texts, parameters, inputs).map(|family| {
                    let $family = family.with_angles(angles).with_observation(observation);
                    AnyModel::$Kind($held, Vec::new())
                }),)+
                n => return Err(ModelError::new_err(format!("a model has 1 to 12 states, not {n}"))),
            }
        };
    }
    parsed!(
        1..=2 => Two<2> |own| Either::Second(own),
        3 => Three<3> |own| Either::Second(own),
        4 => Four<4> |own| Either::Second(own),
        5..=6 => Six<6> |own| own,
        7..=12 => Twelve<12> |own| own
    )
    .map_err(|(n, mistake)| ModelError::new_err(format!("the equation of {} {mistake}", states[n])))
}

/// The observation of a user-defined model by sensors.
fn observation(channels: &[ChannelSpec], names: Names<'_>) -> PyResult<Observation> {
    if channels.len() > MAX_STATES {
        let message = format!("a model has at most {MAX_STATES} sensors, not {}", channels.len());
        return Err(ModelError::new_err(message));
    }
    let mut texts = Vec::with_capacity(channels.len());
    for (_, formula, delay, angle) in channels {
        let delay = delay.as_ref().and_then(|name| names.parameters.iter().position(|own| own == name));
        texts.push((formula.as_str(), delay, *angle));
    }
    Observation::parse(&texts, names)
        .map_err(|(n, mistake)| ModelError::new_err(format!("what {} sees {mistake}", channels[n].0)))
}

/// Refuses effects that this body cannot have.
fn able(effects: &[Effect], body: Body) -> PyResult<()> {
    match effects.iter().find(|effect| !effect.bodies().contains(&body)) {
        None => Ok(()),
        Some(other) => {
            let bodies: Vec<_> = other.bodies().iter().map(|body| body.name()).collect();
            Err(ModelError::new_err(format!(
                "the effect {} acts on a {}, not on a {}",
                other.name(),
                bodies.join(" or "),
                body.name()
            )))
        }
    }
}

/// Whether the effects' friction comes from bristles.
fn bristled(effects: &[Effect]) -> PyResult<bool> {
    let bristles = |effect: &&Effect| effect.treatment == FrictionModel::Lugre;
    if !effects.iter().any(|effect| bristles(&effect)) {
        return Ok(false);
    }
    if effects.iter().any(|effect| effect.kind().is_some_and(Kind::dry) && !bristles(&effect)) {
        let message =
            "where one effect has the treatment lugre all dry friction must have it: it shares the bristles";
        return Err(ModelError::new_err(message));
    }
    if !effects.iter().filter(bristles).any(|effect| effect.kind() == Some(Kind::Coulomb)) {
        let message = "stribeck with the treatment lugre needs coulomb beside it: without friction at speed the bristles would follow any motion at once";
        return Err(ModelError::new_err(message));
    }
    Ok(true)
}

fn effect((name, momentum, treatment, formula): &EffectSpec) -> PyResult<Effect> {
    let effect = match formula {
        Some(own) => Effect::formula(Arc::new(self::formula(name, own)?)),
        None => {
            let kind = Kind::ALL.iter().copied().find(|kind| kind.spec().name == name);
            Effect::new(kind.ok_or_else(|| ModelError::new_err(format!("no effect is called {name}")))?)
        }
    };
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
    let allowed = match &effect.source {
        Source::Library(kind) => momentum.is_none_or(|m| kind.spec().momenta.contains(&m)),
        Source::Formula(_) => true,
    };
    // An effect enters the momentum by default where it can at all.
    if effect.momentum.is_some() != momentum.is_some() || !allowed {
        return Err(ModelError::new_err(format!("the effect {name} cannot enter the momentum that way")));
    }
    let treatment = match treatment.as_deref() {
        None => FrictionModel::Smoothed,
        Some(given) => {
            let found = FrictionModel::ALL.iter().copied().find(|treatment| treatment.name() == given);
            found.filter(|_| effect.kind().is_some_and(Kind::dry)).ok_or_else(|| {
                ModelError::new_err(format!("the effect {name} has no treatment called {given}"))
            })?
        }
    };
    Ok(effect.with_momentum(momentum).with_treatment(treatment))
}

/// A user's own effect.
fn formula(name: &str, (slot, text, parameters, amplitudes): &FormulaSpec) -> PyResult<Formula> {
    let found = Slot::ALL.iter().copied().find(|known| known.name() == slot);
    let slot = found.ok_or_else(|| {
        let known: Vec<_> = Slot::ALL.iter().map(|slot| slot.name()).collect();
        ModelError::new_err(format!("the slot must be one of {}, not {slot:?}", known.join(", ")))
    })?;
    Formula::parse(name, slot, text, parameters, amplitudes).map_err(|mistake| {
        let (shown, long) = (text.chars().take(80).collect::<String>(), text.chars().count() > 80);
        ModelError::new_err(format!("the formula \"{shown}{}\" {mistake}", if long { "..." } else { "" }))
    })
}

/// Checks a user's own effect; the bodies that it can act on.
#[pyfunction]
fn formula_bodies(name: &str, spec: FormulaSpec) -> PyResult<Vec<&'static str>> {
    Ok(formula(name, &spec)?.bodies().iter().map(|body| body.name()).collect())
}

/// The state as an array of the dimension asked for, padded at the end with `idle` zeros.
pub fn state<const D: usize>(values: &[f64], idle: usize) -> PyResult<[f64; D]> {
    let wanted = D - idle;
    if values.len() != wanted {
        return Err(ModelError::new_err(format!("the state needs {wanted} numbers, not {}", values.len())));
    }
    Ok(std::array::from_fn(|n| values.get(n).copied().unwrap_or(0.0)))
}

/// Whether the model's solutions have power series, which the Taylor method needs.
#[pyfunction]
fn has_series(model: &Bound<'_, PyAny>) -> PyResult<bool> {
    let model = AnyModel::parsed(model)?;
    Ok(with_model!(&model, |family, values| tape(family, &[values.to_vec()]).is_some()))
}

/// The kinds of models that are compiled.
#[pyfunction]
fn model_kinds() -> Vec<&'static str> {
    KINDS.to_vec()
}

/// Names and units of a model's parameters, in order.
#[pyfunction]
fn model_parameters(model: &Bound<'_, PyAny>) -> PyResult<Vec<(String, &'static str)>> {
    let model = AnyModel::parsed(model)?;
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
        py: Python<'_>,
        family: &F,
        values: &[f64],
        t: &[f64],
        flat: &[f64],
    ) -> PyResult<Vec<f64>> {
        let live = D - family.idle();
        if flat.len() != t.len() * live {
            let message =
                format!("{} states of {live} numbers are needed, not {} numbers", t.len(), flat.len());
            return Err(ModelError::new_err(message));
        }
        let system = family.build(values);
        room_for(&format!("the rates of {} states", t.len()), flat.len() as f64 * 8.0)?;
        let mut out = Vec::with_capacity(flat.len());
        for (i, (&t, x)) in t.iter().zip(flat.chunks_exact(live)).enumerate() {
            interrupt::poll(py, i)?;
            let x = state(x, family.idle())?;
            out.extend_from_slice(&family.rates_at(values, &system, t, &x)[..live]);
        }
        Ok(out)
    }
    let parsed = AnyModel::from_python(model)?;
    let (t, states) = (t.as_slice()?, states.as_slice()?);
    let out = with_model!(&parsed, |family, values| all(model.py(), family, values, t, states))?;
    Ok(PyArray1::from_vec(model.py(), out))
}

/// The observation of a user-defined model by sensors, frame by frame.
#[pyfunction]
fn observed<'py>(
    model: &Bound<'py, PyAny>,
    t: PyReadonlyArray1<'py, f64>,
    states: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let parsed = AnyModel::from_python(model)?;
    let (t, flat, values) = (t.as_slice()?, states.as_slice()?, parsed.values());
    let family = parsed.widest().ok_or_else(|| ModelError::new_err("a udd.Model is needed"))?;
    let (system, live) = (family.build(values), family.states().len());
    let sensor = FormulaSensor::of(&family);
    let numbers = t.len() * sensor.channels();
    room_for(&format!("the channels of {} frames", t.len()), numbers as f64 * 8.0)?;
    let mut out = Vec::with_capacity(numbers);
    for (i, (&t, row)) in t.iter().zip(flat.chunks_exact(live)).enumerate() {
        interrupt::poll(model.py(), i)?;
        let mut x = [0.0; MAX_STATES];
        x[..live].copy_from_slice(row);
        let rate = family.rates_at(values, &system, t, &x);
        let at = Moment { t, x: &x, rate: &rate, parameters: values };
        out.extend_from_slice(&seen(&sensor, &system, &[], &at)[..sensor.channels()]);
    }
    Ok(PyArray1::from_vec(model.py(), out))
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(formula_bodies, module)?)?;
    module.add_function(wrap_pyfunction!(has_series, module)?)?;
    module.add_function(wrap_pyfunction!(model_kinds, module)?)?;
    module.add_function(wrap_pyfunction!(model_parameters, module)?)?;
    module.add_function(wrap_pyfunction!(observed, module)?)?;
    module.add_function(wrap_pyfunction!(rates, module)?)
}
