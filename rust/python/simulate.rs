//! `udd.simulate`.

use std::ffi::CString;
use std::sync::atomic::{AtomicBool, Ordering};

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::errors::{IntegrationError, ModelError, room_for};
use super::interrupt;
use super::jobs;
use super::model::{AnyModel, state, with_model};
use crate::analysis::{MethodChoice, Output, Run, Stiffness, Stop, rows, trajectory};
use crate::integrate::{Dop853, Dopri5, Failure, Rodas, Taylor, Tolerance, order};
use crate::model::{self, Family, System};
use crate::observe::Record;
use crate::scalar::{Isa, constants};

/// By `auto` states are given at so many places of each step.
const WITHIN: usize = 8;

/// A finished run, its dimension forgotten: states are flat.
struct Flat {
    dimension: usize,
    t: Vec<f64>,
    x: Vec<f64>,
    event_kinds: Vec<&'static str>,
    event_t: Vec<f64>,
    event_x: Vec<f64>,
    outcome: &'static str,
    /// The method that took the steps.
    method: &'static str,
    counts: (u64, u64, u64, u64),
    record: Option<Box<dyn Piecewise>>,
}

/// A run as a function of time.
trait Piecewise: Send + Sync {
    fn span(&self) -> (f64, f64);
    /// The number of live states.
    fn dimension(&self) -> usize;
    /// Appends the state at `t`; false outside the run.
    fn append(&self, t: f64, out: &mut Vec<f64>) -> bool;
}

/// A run with so many padding states at the end.
struct Recorded<const D: usize> {
    record: Record<D>,
    idle: usize,
}

impl<const D: usize> Piecewise for Recorded<D> {
    fn span(&self) -> (f64, f64) {
        self.record.span()
    }
    fn dimension(&self) -> usize {
        D - self.idle
    }
    fn append(&self, t: f64, out: &mut Vec<f64>) -> bool {
        self.record.at(t).map(|x| out.extend_from_slice(&x[..D - self.idle])).is_some()
    }
}

/// How steps are taken, as it is called in Python.
pub fn stepper(method: &str) -> PyResult<MethodChoice> {
    match method {
        "dopri5" => Ok(MethodChoice::Dopri5),
        "dop853" => Ok(MethodChoice::Dop853),
        "taylor" => Ok(MethodChoice::Taylor),
        "auto" => Ok(MethodChoice::Auto),
        _ => Err(ModelError::new_err(format!("no method is called {method:?}"))),
    }
}

/// The method of a single run.
#[derive(Clone, Copy)]
enum RunMethod {
    Explicit(MethodChoice),
    /// The implicit method, for stiff laws.
    Rodas,
}

fn run<F: Family<D>, const D: usize>(
    family: &F,
    values: &[f64],
    by: RunMethod,
    (output, x0): (Output<'_>, [f64; D]),
    (tolerance, keep): (&Tolerance, bool),
    (stop, stiffness): (&dyn Stop, Option<&Stiffness>),
) -> Result<Flat, PyErr> {
    let system = || family.build(values);
    let (idle, order) = (family.idle(), order(tolerance));
    let tolerance = &tolerance.filled::<D>(idle);
    let (stiff, stop) = ((stop, None), (stop, stiffness));
    let rodas = || {
        let method = Rodas::new(family.build(&constants(values)));
        let system: &dyn model::AnySystem<f64, D> = &system();
        trajectory(system, method, output, x0, tolerance, keep, stiff)
    };
    // A step of twelve stages is long, and so is what is compiled for it.
    let stages = || match const { <F::Built<f64> as System<f64, D>>::SMOOTH } {
        true => trajectory(system(), Dop853::default(), output, x0, tolerance, keep, stop),
        false => {
            let system: &dyn model::AnySystem<f64, D> = &system();
            trajectory(system, Dop853::default(), output, x0, tolerance, keep, stop)
        }
    };
    let tape = match by {
        RunMethod::Explicit(MethodChoice::Taylor | MethodChoice::Auto) => {
            rows::tape(family, &[values.to_vec()])
        }
        _ => None,
    };
    let series = || {
        let tape = tape.as_ref()?;
        let method = Taylor::new(tape, values.to_vec(), order, Isa::best());
        Some(trajectory(system(), method, output, x0, tolerance, keep, stop))
    };
    let (method, run) = match by {
        RunMethod::Rodas => ("rodas", rodas()),
        RunMethod::Explicit(MethodChoice::Dopri5) => {
            ("dopri5", trajectory(system(), Dopri5::default(), output, x0, tolerance, keep, stop))
        }
        RunMethod::Explicit(MethodChoice::Dop853) => ("dop853", stages()),
        RunMethod::Explicit(MethodChoice::Taylor) => {
            let message = "the model's law has a comparison or an arc tangent, which no power series follows here; use \
                           method=\"dop853\"";
            ("taylor", series().ok_or_else(|| ModelError::new_err(message))?)
        }
        RunMethod::Explicit(MethodChoice::Auto) => match series() {
            None => ("dop853", stages()),
            Some(Err(failure)) if tape.as_ref().is_some_and(|tape| tape.hands_over(&failure)) => {
                ("dop853", stages())
            }
            Some(run) => ("taylor", run),
        },
    };
    let (method, run) = match run {
        Err(Failure::Stiff { .. }) => ("rodas", rodas()),
        run => (method, run),
    };
    let Run { t, x, events, outcome, counts, record } = run?;
    let system = system();
    let (mut event_kinds, mut event_t, mut event_x) = (Vec::new(), Vec::new(), Vec::new());
    for event in &events {
        event_kinds.push(event.name(&system));
        event_t.push(event.t);
        event_x.extend_from_slice(&event.x[..D - idle]);
    }
    Ok(Flat {
        dimension: D - idle,
        t,
        x: jobs::live(x.into_flattened(), D, D - idle),
        event_kinds,
        event_t,
        event_x,
        outcome: outcome.name(),
        method,
        counts: (counts.accepted, counts.rejected, counts.evaluations, counts.grazes),
        record: record.map(|record| Box::new(Recorded { record, idle }) as Box<dyn Piecewise>),
    })
}

/// A dense run: calling it with times gives the states, flat.
#[pyclass(frozen, module = "udd._core")]
struct Dense(Box<dyn Piecewise>);

#[pymethods]
impl Dense {
    /// The first and the last time.
    #[getter]
    fn span(&self) -> (f64, f64) {
        self.0.span()
    }

    fn __call__<'py>(
        &self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let times = t.as_slice()?;
        let what = format!("the states at {} times", times.len());
        room_for(&what, (times.len() * self.0.dimension()) as f64 * 8.0)?;
        let mut out = Vec::with_capacity(times.len() * self.0.dimension());
        for (i, &t) in times.iter().enumerate() {
            interrupt::poll(py, i)?;
            if !self.0.append(t, &mut out) {
                let (first, last) = self.0.span();
                let message = format!("t = {t} lies outside the run, which goes from {first} to {last}");
                return Err(IntegrationError::new_err(message));
            }
        }
        Ok(PyArray1::from_vec(py, out))
    }
}

/// Runs a model from a state, at the given times or, where none are given, from 0 to `end` with every
/// accepted step. Returns a dict.
#[pyfunction]
#[pyo3(signature = (model, times, end, state0, rtol, atol, max_step, method, dense))]
fn simulate<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    times: Option<PyReadonlyArray1<'py, f64>>,
    end: f64,
    state0: Vec<f64>,
    rtol: f64,
    atol: f64,
    max_step: f64,
    method: &str,
    dense: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let model = AnyModel::from_python(model)?;
    let tolerance = Tolerance { rtol, atol, max_step };
    let by = if method == "rodas" { RunMethod::Rodas } else { RunMethod::Explicit(stepper(method)?) };
    // The predefined models are not stiff, but stability limits their steps when they stop.
    let watched = model.is_own();
    let stiffness = Stiffness::new(method == "auto");
    let is_warned = AtomicBool::new(method == "auto");
    let warn = |py: Python<'_>| match stiffness.recognised() {
        Some(t) if !is_warned.swap(true, Ordering::Relaxed) => stiff(py, method, t),
        _ => Ok(()),
    };
    let times = times.as_ref().map(PyReadonlyArray1::as_slice).transpose()?;
    if let Some(times) = times {
        // Times and states here, and what is made of them.
        let numbers = times.len() as f64 * (2.0 + 3.0 * state0.len() as f64);
        room_for(&format!("the states at {} times", times.len()), numbers * 8.0)?;
    }
    let times = times.map(<[f64]>::to_vec);
    // The long steps of a series are not looked at by their ends alone, unless it was asked for.
    let within = if method == "auto" { WITHIN } else { 1 };
    let output = times.as_deref().map_or(Output::Steps(0.0, end, within), Output::At);
    let flat = with_model!(&model, |family, values| {
        let x0 = state(&state0, family.idle())?;
        if family.build(values).wall(&x0).is_some_and(|value: f64| value <= 0.0) {
            let message = "the initial state lies outside the disk: Y^2 + Z^2 must be below R^2 (or use edge=\"ignore\")";
            return Err(ModelError::new_err(message));
        }
        let work = |stop: &dyn Stop| {
            run(family, values, by, (output, x0), (&tolerance, dense), (stop, watched.then_some(&stiffness)))
        };
        let (flat, signal) = interrupt::watch_here(py, &warn, work)?;
        signal?;
        flat?
    });
    warn(py)?;

    let table = |values: Vec<f64>| PyArray1::from_vec(py, values);
    let rows = flat.t.len();
    let events = flat.event_t.len();
    let dict = PyDict::new(py);
    dict.set_item("t", table(flat.t))?;
    dict.set_item("state", table(flat.x).reshape([rows, flat.dimension])?)?;
    dict.set_item("event_kind", flat.event_kinds)?;
    dict.set_item("event_t", table(flat.event_t))?;
    dict.set_item("event_state", table(flat.event_x).reshape([events, flat.dimension])?)?;
    dict.set_item("outcome", flat.outcome)?;
    dict.set_item("method", flat.method)?;
    dict.set_item("counts", flat.counts)?;
    dict.set_item("dense", flat.record.map(Dense))?;
    Ok(dict)
}

/// Warns of a run by this method that was found stiff at this time.
fn stiff(py: Python<'_>, method: &str, t: f64) -> PyResult<()> {
    let message = format!(
        "the model is stiff at t = {t}: the steps of method=\"{method}\" are held down by stability, not by accuracy; \
         method=\"rodas\" takes longer ones"
    );
    let category = py.import("udd.errors")?.getattr("StiffnessWarning")?;
    // To where the user called `udd.simulate`, two calls above this one.
    PyErr::warn(py, &category, CString::new(message)?.as_c_str(), 3)
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Dense>()?;
    module.add_function(wrap_pyfunction!(simulate, module)?)
}
