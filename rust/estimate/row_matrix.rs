//! Many rows of one length, and the sums over them that fits are made of.
//!
//! Loops run along a row, over numbers that do not depend on each other: they give the same bits with any
//! instructions.

use crate::scalar::{InstructionSet, Work, run_with};

/// Rows of the same length, one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RowMatrix {
    width: usize,
    numbers: Vec<f64>,
}

impl RowMatrix {
    /// So many rows of `width` zeros.
    pub fn zeros(rows: usize, width: usize) -> Self {
        Self { width, numbers: vec![0.0; rows * width] }
    }

    /// Makes them so many rows of `width` zeros.
    pub(super) fn become_zeros(&mut self, rows: usize, width: usize) {
        self.width = width;
        self.numbers.clear();
        self.numbers.resize(rows * width, 0.0);
    }

    /// The length of a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// How many rows there are; none can be counted where they have no length.
    pub fn count(&self) -> usize {
        self.numbers.len().checked_div(self.width).unwrap_or(0)
    }

    /// Row `i`.
    #[inline(always)]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.numbers[i * self.width..(i + 1) * self.width]
    }

    /// All rows, one after the other.
    #[inline(always)]
    pub(super) fn numbers(&self) -> &[f64] {
        &self.numbers
    }

    #[inline(always)]
    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.numbers[i * self.width..(i + 1) * self.width]
    }

    #[inline(always)]
    pub(super) fn numbers_mut(&mut self) -> &mut [f64] {
        &mut self.numbers
    }

    /// Number `j` of row `i`.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.row(i)[j]
    }

    /// Blocks of so many rows, as one slice each; empty ones where rows have no length.
    pub fn blocks_mut(&mut self, rows: usize) -> impl Iterator<Item = &mut [f64]> {
        self.numbers.chunks_mut((rows * self.width).max(1))
    }

    /// Some columns of all rows.
    pub fn part(&self, columns: std::ops::Range<usize>) -> Self {
        let rows = self.count();
        let mut part = Self::zeros(rows, columns.len());
        for i in 0..rows {
            part.row_mut(i).copy_from_slice(&self.row(i)[columns.clone()]);
        }
        part
    }

    /// These rows with those of `other` set to their right.
    pub fn beside(&self, other: &Self) -> Self {
        Self::side_by_side(&[self, other])
    }

    /// The rows of all parts, from left to right.
    pub fn side_by_side(parts: &[&Self]) -> Self {
        let rows = parts.iter().map(|part| part.count()).max().unwrap_or(0);
        let mut all = Self::zeros(rows, parts.iter().map(|part| part.width).sum());
        for i in 0..rows {
            let mut rest = all.row_mut(i);
            for part in parts {
                let own;
                (own, rest) = rest.split_at_mut(part.width);
                own.copy_from_slice(part.row(i));
            }
        }
        all
    }
}

/// Numbers that are taken together: what one instruction does at its best.
const CHUNK: usize = 8;

/// The least width that holds so many numbers and leaves no rest of a chunk.
pub(super) fn padded(width: usize) -> usize {
    width.max(1).next_multiple_of(CHUNK)
}

/// Rows that are collected before their squares are summed, and rows of the sum that are made together.
const COLLECTED: usize = 28;
const TOGETHER: usize = 4;

/// A sum of products of rows with themselves, from the diagonal on to the right.
pub(super) struct OuterProductSum {
    rows: RowMatrix,
    collected: usize,
    sign: f64,
}

impl OuterProductSum {
    /// For rows of this width; the sign says whether they are added or subtracted.
    pub fn new(width: usize, sign: f64) -> Self {
        Self { rows: RowMatrix::zeros(COLLECTED, width), collected: 0, sign }
    }

    /// Room for a row, whose square belongs to `sum`.
    #[inline(always)]
    pub fn push<V: InstructionSet>(&mut self, row: &[f64], sum: &mut RowMatrix) {
        self.rows.row_mut(self.collected).copy_from_slice(row);
        self.collected += 1;
        if self.collected == COLLECTED {
            self.flush::<V>(sum);
        }
    }

    /// Adds what was collected, with these instructions. The part left of the diagonal is only partly filled.
    #[inline(always)]
    pub fn flush<V: InstructionSet>(&mut self, sum: &mut RowMatrix) {
        run_with::<V, _>(Flush { squares: self, sum });
    }
}

/// Long, and the same whatever the rows are of: a function for each instruction set.
struct Flush<'a> {
    squares: &'a mut OuterProductSum,
    sum: &'a mut RowMatrix,
}

impl Work for Flush<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: InstructionSet>(self) {
        let Self { squares: OuterProductSum { rows, collected, sign }, sum } = self;
        let (width, count) = (sum.width(), sum.count());
        let rows = &rows.numbers[..*collected * width];
        for first in 0..count.div_ceil(TOGETHER) {
            let first = first * TOGETHER;
            let many = TOGETHER.min(count - first);
            for start in first / CHUNK..width.div_ceil(CHUNK) {
                let start = start * CHUNK;
                if many == TOGETHER && start + CHUNK <= width {
                    let mut sums = [[0.0; CHUNK]; TOGETHER];
                    for i in 0..*collected {
                        let row = &rows[i * width..(i + 1) * width];
                        let factors: &[f64; TOGETHER] = row[first..].first_chunk().expect("rows of the sum");
                        let chunk: &[f64; CHUNK] = row[start..].first_chunk().expect("a whole chunk");
                        for j in 0..TOGETHER {
                            for k in 0..CHUNK {
                                sums[j][k] += factors[j] * chunk[k];
                            }
                        }
                    }
                    for j in 0..TOGETHER {
                        add::<V>(&mut sum.row_mut(first + j)[start..start + CHUNK], *sign, &sums[j]);
                    }
                    continue;
                }
                for j in first..first + many {
                    let end = width.min(start + CHUNK);
                    let to = &mut sum.numbers[j * width..][start..end];
                    for i in 0..*collected {
                        let row = &rows[i * width..(i + 1) * width];
                        add::<V>(to, *sign * row[j], &row[start..end]);
                    }
                }
            }
        }
        *collected = 0;
    }
}

/// The product of two rows.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<CHUNK>(), b.as_chunks::<CHUNK>());
    let mut sums = [0.0; CHUNK];
    for c in 0..a.len() {
        for k in 0..CHUNK {
            sums[k] += a[c][k] * b[c][k];
        }
    }
    let (mut whole, mut rest) = (-0.0, -0.0);
    for k in 0..CHUNK {
        whole += sums[k];
    }
    for k in 0..a_rest.len() {
        rest += a_rest[k] * b_rest[k];
    }
    whole + rest
}

/// Adds multiples of rows that lie one after the other, each as wide as `to`, with the caller's instructions.
#[inline(always)]
pub(super) fn combine<V: InstructionSet>(to: &mut [f64], factors: &[f64], rows: &[f64]) {
    if const { V::ISA.is_rare() } {
        combine_apart(to, factors, rows)
    } else {
        combine_here(to, factors, rows)
    }
}

#[inline(never)]
fn combine_apart(to: &mut [f64], factors: &[f64], rows: &[f64]) {
    combine_here(to, factors, rows);
}

#[inline(always)]
fn combine_here(to: &mut [f64], factors: &[f64], rows: &[f64]) {
    let width = to.len();
    let count = factors.len().min(rows.len() / width);
    let (chunks, rest) = to.as_chunks_mut::<CHUNK>();
    for c in 0..chunks.len() {
        let mut sum = chunks[c];
        for j in 0..count {
            let row: &[f64; CHUNK] = rows[j * width + c * CHUNK..].first_chunk().expect("as wide");
            for k in 0..CHUNK {
                sum[k] += factors[j] * row[k];
            }
        }
        chunks[c] = sum;
    }
    if rest.is_empty() {
        return;
    }
    let done = width - rest.len();
    for j in 0..count {
        let row = &rows[j * width + done..(j + 1) * width];
        for k in 0..rest.len() {
            rest[k] += factors[j] * row[k];
        }
    }
}

/// Adds a multiple of a row to another, with the caller's instructions.
#[inline(always)]
pub(super) fn add<V: InstructionSet>(to: &mut [f64], factor: f64, row: &[f64]) {
    if const { V::ISA.is_rare() } { add_apart(to, factor, row) } else { add_here(to, factor, row) }
}

#[inline(never)]
fn add_apart(to: &mut [f64], factor: f64, row: &[f64]) {
    add_here(to, factor, row);
}

#[inline(always)]
fn add_here(to: &mut [f64], factor: f64, row: &[f64]) {
    let ((to, to_rest), (row, row_rest)) = (to.as_chunks_mut::<CHUNK>(), row.as_chunks::<CHUNK>());
    for c in 0..to.len() {
        for k in 0..CHUNK {
            to[c][k] += factor * row[c][k];
        }
    }
    for k in 0..to_rest.len() {
        to_rest[k] += factor * row_rest[k];
    }
}
