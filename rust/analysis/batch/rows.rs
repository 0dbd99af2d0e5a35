//! Rows of parameters and states: one for each run, or a single one for all.

use crate::model::Family;
use crate::tape::Tape;

/// The number of runs that two lists of rows give.
pub fn count<A, B>(values: &[A], starts: &[B]) -> usize {
    values.len().max(starts.len())
}

/// The row of a run.
pub fn of<T>(rows: &[T], run: usize) -> &T {
    &rows[run.min(rows.len() - 1)]
}

/// The tape that serves runs with all of these values; none where no series follows the law.
///
/// A parameter that is zero in all rows need not be computed. Other parameters stay open, so that a run's bits do not
/// depend on the other runs.
pub fn tape<F: Family<D>, const D: usize>(family: &F, rows: &[Vec<f64>]) -> Option<Tape<D>> {
    let width = rows.first().map_or(0, Vec::len);
    let known: Vec<_> = (0..width).map(|i| rows.iter().all(|row| row[i] == 0.0).then_some(0.0)).collect();
    Tape::record(family, &known).ok()
}
