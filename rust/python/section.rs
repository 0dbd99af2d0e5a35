//! `udd.poincare`, and what is built upon it.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::errors::{ModelError, room_for, short_of};
use super::jobs::{self, Batch};
use super::model::with_wide_model;
use crate::analysis::{CrossingOutcome, Crossings, ExecutionContext, Section, SectionRun};
use crate::formula::{Expression, Names};
use crate::memory;
use crate::model::Family;

fn code(ended: CrossingOutcome) -> u8 {
    match ended {
        CrossingOutcome::Finished => jobs::FINISHED,
        CrossingOutcome::Ejected => jobs::EJECTED,
        CrossingOutcome::TimeRanOut => jobs::TIME_RAN_OUT,
        CrossingOutcome::Failed(failure) => jobs::failure_code(failure),
        CrossingOutcome::Interrupted => jobs::INTERRUPTED,
        CrossingOutcome::Escaped => jobs::ESCAPED,
    }
}

fn parse(text: &str, direction: i32, states: &[String], parameters: &[String]) -> PyResult<Section> {
    let names = Names { states, parameters, inputs: &[], rates: true };
    let wrong = |what: String| Err(ModelError::new_err(format!("the section {text:?} {what}")));
    match Expression::parse(text, names) {
        Err(mistake) => wrong(mistake.to_string()),
        Ok(function) if !function.varies() => {
            wrong(format!("never changes: it contains neither the state ({}) nor t", states.join(", ")))
        }
        Ok(function) => Ok(Section { function, rising: direction >= 0, falling: direction <= 0 }),
    }
}

/// Columns, one row for each trajectory.
struct Table {
    count: usize,
    points: Vec<f64>,
    t: Vec<f64>,
    which: Vec<u8>,
    found: Vec<u64>,
    residual: Vec<f64>,
    end: Vec<f64>,
    t_end: Vec<f64>,
    outcome: Vec<u8>,
}

impl Table {
    fn new(rows: usize, count: usize, dimension: usize) -> PyResult<Self> {
        let mut table = Self {
            count,
            points: Vec::new(),
            t: Vec::new(),
            which: Vec::new(),
            found: Vec::new(),
            residual: Vec::new(),
            end: Vec::new(),
            t_end: Vec::new(),
            outcome: Vec::new(),
        };
        let points = rows.saturating_mul(count);
        let bytes = rows as f64 * count as f64 * (8.0 * (dimension + 1) as f64 + 1.0);
        let what = format!("{points} points");
        // In this table, and trajectory by trajectory before.
        room_for(&what, bytes)?;
        room_for(&what, 2.0 * bytes)?;
        memory::reserve(&mut table.points, points.saturating_mul(dimension))
            .and_then(|()| memory::reserve(&mut table.t, points))
            .and_then(|()| memory::reserve(&mut table.which, points))
            .map_err(|shortage| short_of(&what, shortage))?;
        Ok(table)
    }

    /// The points of a trajectory: where, when, and of which surface; then its end, and how large the surfaces'
    /// functions are.
    fn push(
        &mut self,
        (points, t, which): (&[f64], &[f64], &[u8]),
        (t_end, end, outcome): (f64, &[f64], u8),
        residual: f64,
    ) {
        let found = t.len();
        let missing = self.count - found;
        self.points.extend_from_slice(points);
        self.points.resize(self.points.len() + missing * end.len(), f64::NAN);
        self.t.extend_from_slice(t);
        self.t.resize(self.t.len() + missing, f64::NAN);
        self.which.extend_from_slice(which);
        self.which.resize(self.which.len() + missing, 0);
        self.found.push(found as u64);
        self.end.extend_from_slice(end);
        self.t_end.push(t_end);
        self.residual.push(residual);
        self.outcome.push(outcome);
    }
}

fn collect<F: Family<D>, const D: usize>(
    sections: &SectionRun<'_, F, D>,
    mut table: Table,
    context: ExecutionContext<'_>,
) -> Table {
    let all = sections.run(context);
    if all.iter().any(|one| one.as_ref().is_none_or(|found| found.ended == CrossingOutcome::Interrupted)) {
        // Room for points that never came is not even filled.
        table.count = all.iter().flatten().map(|found| found.t.len()).max().unwrap_or(0);
    }
    for crossings in all {
        match crossings {
            Some(Crossings { t, x, which, residual, end, ended }) => {
                table.push((x.as_flattened(), &t, &which), (end.0, &end.1, code(ended)), residual);
            }
            None => table.push((&[], &[], &[]), (f64::NAN, &[f64::NAN; D], jobs::INTERRUPTED), 0.0),
        }
    }
    table
}

/// Where trajectories cross surfaces.
///
/// A section is the zero of an expression of the state, its rates, the time and the parameters, crossed
/// where it rises (direction 1), falls (-1), or either (0). The first `skip` crossings are left out. Returns a
/// dict of columns; on Ctrl-C with what there is.
#[pyfunction]
fn sections<'py>(
    py: Python<'py>,
    batch: Batch<'py>,
    section: Vec<(String, i32)>,
    skip: usize,
    count: usize,
    t_max: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let model = batch.model()?.undriven()?;
    if section.is_empty() || section.len() > usize::from(u8::MAX) {
        return Err(ModelError::new_err(format!("{} sections cannot be used at once", section.len())));
    }
    if count == 0 {
        return Err(ModelError::new_err("at least one point must be asked for"));
    }
    let (names, angles): (Vec<String>, Vec<bool>) = model.states().into_iter().unzip();
    let rows = batch.rows(&model)?;
    let watched = batch.jobs();
    let (table, dimension, signal) = with_wide_model!(packets: &model, |family, _values| {
        let parameters: Vec<String> = family.parameters().into_iter().map(|p| p.name).collect();
        let surfaces = section.iter().map(|(text, direction)| parse(text, *direction, &names, &parameters));
        let surfaces = surfaces.collect::<PyResult<Vec<_>>>()?;
        let starts = jobs::starts(&batch.starts, family.idle())?;
        jobs::agree(rows.len(), starts.len())?;
        let dimension = starts[0].len();
        let table = Table::new(rows.len().max(starts.len()), count, dimension)?;
        let sections = SectionRun {
            family,
            values: &rows,
            starts: &starts,
            sections: &surfaces,
            skip,
            count,
            end: t_max,
            bounded: std::array::from_fn(|n| angles.get(n) == Some(&false)),
            tolerance: batch.tolerance(),
        };
        let (table, signal) = watched.watch(py, |context| collect(&sections, table, context))?;
        (table, dimension, signal)
    });
    jobs::lost(py, signal, &table.outcome)?;
    let (runs, count) = (table.outcome.len(), table.count);
    let dict = PyDict::new(py);
    let cut = |numbers| PyArray1::from_vec(py, jobs::live(numbers, dimension, names.len()));
    dict.set_item("points", cut(table.points).reshape([runs, count, names.len()])?)?;
    dict.set_item("t", PyArray1::from_vec(py, table.t).reshape([runs, count])?)?;
    dict.set_item("which", PyArray1::from_vec(py, table.which).reshape([runs, count])?)?;
    dict.set_item("found", PyArray1::from_vec(py, table.found))?;
    dict.set_item("residual", PyArray1::from_vec(py, table.residual))?;
    dict.set_item("end", cut(table.end).reshape([runs, names.len()])?)?;
    dict.set_item("t_end", PyArray1::from_vec(py, table.t_end))?;
    dict.set_item("outcome", PyArray1::from_vec(py, table.outcome))?;
    Ok(dict)
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(sections, module)?)
}
