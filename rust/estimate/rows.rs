//! Many rows of one length, and the sums over them that fits are made of.
//!
//! Loops run along a row, over numbers that do not depend on each other: they give the same bits with any
//! instructions.

/// Rows of the same length, one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    width: usize,
    numbers: Vec<f64>,
}

impl Rows {
    /// So many rows of `width` zeros.
    pub fn zeros(rows: usize, width: usize) -> Self {
        Self { width, numbers: vec![0.0; rows * width] }
    }

    /// The length of a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// How many rows there are; none can be counted where they have no length.
    fn count(&self) -> usize {
        self.numbers.len().checked_div(self.width).unwrap_or(0)
    }

    /// Row `i`.
    #[inline(always)]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.numbers[i * self.width..(i + 1) * self.width]
    }

    #[inline(always)]
    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.numbers[i * self.width..(i + 1) * self.width]
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
        let rows = self.count().max(other.count());
        let mut all = Self::zeros(rows, self.width + other.width);
        for i in 0..rows {
            let row = all.row_mut(i);
            row[..self.width].copy_from_slice(self.row(i));
            row[self.width..].copy_from_slice(other.row(i));
        }
        all
    }

    /// Adds the product of a row with itself, from the diagonal on to the right, to these rows.
    #[inline(always)]
    pub(super) fn add_square(&mut self, row: &[f64], sign: f64) {
        for (j, &factor) in row.iter().enumerate() {
            if factor != 0.0 {
                add(&mut self.row_mut(j)[j..], sign * factor, &row[j..]);
            }
        }
    }
}

/// The product of two rows.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Adds a multiple of a row to another.
#[inline(always)]
pub(super) fn add(to: &mut [f64], factor: f64, row: &[f64]) {
    for (to, &value) in to.iter_mut().zip(row) {
        *to += factor * value;
    }
}
