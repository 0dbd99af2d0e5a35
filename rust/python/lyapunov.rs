//! `udd.lyapunov` and `udd.lyapunov_spectrum`.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::errors::room_for;
use super::interrupt;
use super::jobs::{self, Batch, outcome_code};
use super::model::{AnyModel, state, with_wide_model};
use crate::analysis::{
    CancelFlag, CovariantFrames, ExecutionContext, Exponents, Lyapunov, LyapunovOptions, frames as frames_of,
    rows,
};
use crate::integrate::{Dopri5, Failure, Taylor, Tolerance, order};
use crate::model::Family;
use crate::scalar::{Dual, Isa, constants};

/// Columns, one row for each orbit.
#[derive(Default)]
struct Table {
    value: Vec<f64>,
    standard_error: Vec<f64>,
    time: Vec<f64>,
    mean: Vec<f64>,
    product: Vec<f64>,
    end: Vec<f64>,
    outcome: Vec<u8>,
    /// Why the first orbit that failed did so.
    failure: Option<String>,
}

/// One orbit's entries in the columns.
struct Row<'a> {
    value: &'a [f64],
    standard_error: &'a [f64],
    time: f64,
    mean: &'a [f64],
    product: &'a [f64],
    end: &'a [f64],
    outcome: u8,
}

impl Table {
    fn push(&mut self, row: &Row<'_>) {
        self.value.extend_from_slice(row.value);
        self.standard_error.extend_from_slice(row.standard_error);
        self.time.push(row.time);
        self.mean.extend_from_slice(row.mean);
        self.product.extend_from_slice(row.product);
        self.end.extend_from_slice(row.end);
        self.outcome.push(row.outcome);
    }
}

fn table<F: Family<D>, const D: usize>(
    orbits: &Lyapunov<'_, F, D>,
    all: bool,
    context: ExecutionContext<'_>,
) -> Table {
    // For many states a single exponent does not pay for its compilation.
    if const { D <= 4 } && !all {
        return collect(&orbits.run::<1>(context));
    }
    collect(&orbits.run::<D>(context))
}

fn collect<const D: usize, const N: usize>(orbits: &[Option<Exponents<D, N>>]) -> Table {
    let mut table = Table::default();
    let lost = [[f64::NAN; D]; D];
    for orbit in orbits {
        if let (None, Some(Err(failure))) = (&table.failure, orbit.as_ref().map(|orbit| orbit.outcome)) {
            table.failure = Some(failure.to_string());
        }
        table.push(&match orbit {
            Some(orbit) => Row {
                value: &orbit.exponents.value,
                standard_error: &orbit.exponents.standard_error,
                time: orbit.exponents.time,
                mean: &orbit.moments.first,
                product: orbit.moments.second.as_flattened(),
                end: &orbit.x,
                outcome: outcome_code(orbit.outcome),
            },
            None => Row {
                value: &lost.as_flattened()[..N],
                standard_error: &lost.as_flattened()[..N],
                time: f64::NAN,
                mean: &lost.as_flattened()[..D],
                product: lost.as_flattened(),
                end: &lost.as_flattened()[..D],
                outcome: jobs::INTERRUPTED,
            },
        });
    }
    table
}

/// The largest exponent of each orbit, or all of them. Returns a dict of columns.
#[pyfunction]
fn lyapunov<'py>(
    py: Python<'py>,
    batch: Batch<'py>,
    all: bool,
    time: f64,
    transient: f64,
    goal: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let model = batch.model()?.undriven()?;
    let options = LyapunovOptions { time, transient, goal, tolerance: batch.tolerance() };
    let rows = batch.rows(&model)?;
    let jobs = batch.jobs();
    let (table, dimension, signal) = with_wide_model!(packets: &model, |family, _values| {
        let starts = jobs::starts(&batch.starts, family.idle())?;
        jobs::agree(rows.len(), starts.len())?;
        let orbits = Lyapunov { family, values: &rows, starts: &starts, options };
        let dimension = starts[0].len();
        // Averages of states and their products, orbit by orbit and then in columns.
        let (orbits_wanted, numbers) = (rows.len().max(starts.len()), dimension * (dimension + 4) + 4);
        room_for(&format!("{orbits_wanted} orbits"), orbits_wanted as f64 * numbers as f64 * 16.0)?;
        let (table, signal) = jobs.watch(py, |context| table(&orbits, all, context))?;
        (table, dimension, signal)
    });
    signal?;
    let count = table.time.len();
    let live = model.states().len();
    let wide = |values: Vec<f64>, wanted: usize| {
        let width = values.len() / count;
        let cut = jobs::live(values, width, wanted);
        PyArray1::from_vec(py, cut).reshape([count, wanted])
    };
    let wanted = if all { live } else { 1 };
    // Those of padding states: the rows at the end, then the columns.
    let product =
        jobs::live(jobs::live(table.product, dimension * dimension, live * dimension), dimension, live);
    let dict = PyDict::new(py);
    dict.set_item("value", wide(table.value, wanted)?)?;
    dict.set_item("standard_error", wide(table.standard_error, wanted)?)?;
    dict.set_item("time", PyArray1::from_vec(py, table.time))?;
    dict.set_item("mean", wide(table.mean, live)?)?;
    dict.set_item("product", PyArray1::from_vec(py, product).reshape([count, live, live])?)?;
    dict.set_item("end", wide(table.end, live)?)?;
    dict.set_item("outcome", PyArray1::from_vec(py, table.outcome))?;
    dict.set_item("failure", table.failure)?;
    Ok(dict)
}

/// An orbit's states, the growth of its frame and its covariant vectors, at `count` distances `dt` of time.
#[pyfunction]
fn frames<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    state0: Vec<f64>,
    dt: f64,
    count: usize,
    rtol: f64,
    atol: f64,
    max_step: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let model = AnyModel::from_python(model)?.undriven()?;
    let tolerance = Tolerance { rtol, atol, max_step };
    let (states, growth, covariant, dimension) = with_wide_model!(packets: &model, |family, values| {
        let x0 = state(&state0, family.idle())?;
        // States and growth, three matrices on the way and what is made of them.
        let numbers = x0.len() as f64 * (3.0 + 4.0 * x0.len() as f64);
        room_for(&format!("{count} intervals"), (count as f64 + 1.0) * numbers * 8.0)?;
        let found = interrupt::run(py, |stop| follow(family, values, x0, (dt, count), &tolerance, stop))?;
        let flat = found.covariant.as_flattened().as_flattened().to_vec();
        (found.states.into_flattened(), found.growth.into_flattened(), flat, x0.len())
    });
    let dict = PyDict::new(py);
    let live = model.states().len();
    let cut = |numbers| PyArray1::from_vec(py, jobs::live(numbers, dimension, live));
    dict.set_item("states", cut(states).reshape([count + 1, live])?)?;
    dict.set_item("growth", cut(growth).reshape([count, live])?)?;
    let covariant = jobs::live(covariant, dimension * dimension, live * dimension);
    dict.set_item("covariant", cut(covariant).reshape([count + 1, live, live])?)?;
    Ok(dict)
}

fn follow<F: Family<D>, const D: usize>(
    family: &F,
    values: &[f64],
    x0: [f64; D],
    span: (f64, usize),
    tolerance: &Tolerance,
    stop: &CancelFlag,
) -> Result<CovariantFrames<D>, Failure> {
    let wide: Vec<Dual<f64, D>> = constants(values);
    // The steps are those of a run for exponents, and share what is compiled for it.
    if let Some(tape) = &rows::tape(family, &[values.to_vec()]) {
        let method = Taylor::new(tape, wide.clone(), order(tolerance), Isa::best());
        match frames_of(family.build(&wide), method, (x0, family.idle()), span, tolerance, stop) {
            Err(failure) if tape.hands_over(&failure) => {}
            found => return found,
        }
    }
    frames_of(family.build(&wide), Dopri5::default(), (x0, family.idle()), span, tolerance, stop)
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(frames, module)?)?;
    module.add_function(wrap_pyfunction!(lyapunov, module)?)
}
