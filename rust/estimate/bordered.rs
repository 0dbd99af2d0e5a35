//! Block-tridiagonal normal equations with borders.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::rows::{Rows, add, dot};
use super::{Columns, EstimateError, Linear, Record};
use crate::scalar::{Instructions, Isa, Work};

/// The normal equations of the least squares. The right-hand side is the last column of the borders, and of
/// the corner: it takes part in all that the parameters' columns do.
#[derive(Clone, Debug)]
pub struct Bordered<const D: usize> {
    /// Couples frame `i` with itself.
    pub diagonal: Vec<SMatrix<f64, D, D>>,
    /// Couples frame `i + 1` (rows) with frame `i` (columns).
    pub below: Vec<SMatrix<f64, D, D>>,
    /// `D` rows for each frame: its coupling with the parameters, and its right-hand side.
    pub border: Rows,
    /// The parameters' coupling with themselves, their right-hand side, and the sum of squares; from the diagonal
    /// on to the right.
    pub corner: Rows,
}

impl<const D: usize> Bordered<D> {
    /// The Gauss-Newton equations of a linearised record for the parameters of some columns, without priors.
    /// `precision[i]` is the inverse variance of the model's error over link `i`, per state.
    pub fn new<const M: usize>(
        linear: &Linear<D, M>,
        columns: &Columns,
        record: &Record<M>,
        precision: &[SVector<f64, D>],
    ) -> Self {
        Isa::best().run(Assembly { linear, columns, record, precision })
    }

    /// The number of parameters.
    pub fn parameters(&self) -> usize {
        self.corner.width() - 1
    }

    /// Adds a Gaussian prior on parameter `j`, now at `value`.
    pub fn prior(&mut self, j: usize, value: f64, mean: f64, sd: f64) {
        let (p, precision) = (self.parameters(), sd.powi(-2));
        let row = self.corner.row_mut(j);
        row[j] += precision;
        row[p] += precision * (mean - value);
    }

    /// By how much the linear model says that a step lowers the cost.
    pub fn promise(&self, states: &[SVector<f64, D>], parameters: &DVector<f64>) -> f64 {
        let p = self.parameters();
        let own = |i: usize| (0..D).map(|k| self.border.at(D * i + k, p) * states[i][k]).sum::<f64>();
        let states: f64 = (0..states.len()).map(own).sum();
        states + (0..p).map(|j| self.corner.at(j, p) * parameters[j]).sum::<f64>()
    }

    /// Eliminates the states.
    pub fn eliminate(self, t: &[f64]) -> Result<Eliminated<D>, EstimateError> {
        Isa::best().run(Elimination { system: self, t })
    }
}

struct Assembly<'a, const D: usize, const M: usize> {
    linear: &'a Linear<D, M>,
    columns: &'a Columns,
    record: &'a Record<M>,
    precision: &'a [SVector<f64, D>],
}

impl<const D: usize, const M: usize> Work for Assembly<'_, D, M> {
    type Output = Bordered<D>;

    #[inline(always)]
    fn run<V: Instructions>(self) -> Bordered<D> {
        let Self { linear, columns, record, precision } = self;
        let (n, p) = (record.t.len(), columns.seen.width());
        let mut system = Bordered {
            diagonal: vec![SMatrix::zeros(); n],
            below: vec![SMatrix::zeros(); n - 1],
            border: Rows::zeros(n * D, p + 1),
            corner: Rows::zeros(p + 1, p + 1),
        };
        // Misfits in units of their noise, of this frame and of the one before.
        let (mut now, mut before) = (Whitened::<D, M>::new(p), Whitened::<D, M>::new(p));
        let mut row = vec![0.0; p + 1];
        for i in 0..n {
            std::mem::swap(&mut now, &mut before);
            now.fill(linear, columns, record, i);
            for m in (0..M).filter(|&m| now.there[m]) {
                let memory = record.remembered(i, m, before.there[m]);
                let scale = (1.0 - memory * memory).sqrt().recip();
                for (to, &value) in row.iter_mut().zip(now.columns.row(m)) {
                    *to = scale * value;
                }
                let h = now.h[m] * scale;
                if memory != 0.0 {
                    let back = -memory * scale;
                    add(&mut row, back, before.columns.row(m));
                    let h_back = before.h[m] * back;
                    system.diagonal[i - 1] += h_back * h_back.transpose();
                    system.below[i - 1] += h * h_back.transpose();
                    for k in 0..D {
                        add(system.border.row_mut(D * (i - 1) + k), h_back[k], &row);
                    }
                }
                system.diagonal[i] += h * h.transpose();
                for k in 0..D {
                    add(system.border.row_mut(D * i + k), h[k], &row);
                }
                system.corner.add_square(&row, 1.0);
            }
        }
        for i in (0..n - 1).filter(|&i| record.linked[i]) {
            let link = &linear.flow[i];
            for k in 0..D {
                // w (x_{i+1} - a x_i - b theta) = -w defect
                let w = precision[i][k].sqrt();
                for (to, &value) in row.iter_mut().zip(columns.state.row(D * i + k)) {
                    *to = -w * value;
                }
                row[p] = -w * link.defect[k];
                let a: SVector<f64, D> = SVector::from_fn(|j, _| -w * link.a[(k, j)]);
                system.diagonal[i] += a * a.transpose();
                system.diagonal[i + 1][(k, k)] += w * w;
                for j in 0..D {
                    system.below[i][(k, j)] += w * a[j];
                    add(system.border.row_mut(D * i + j), a[j], &row);
                }
                add(system.border.row_mut(D * (i + 1) + k), w, &row);
                system.corner.add_square(&row, 1.0);
            }
        }
        system
    }
}

/// A frame's misfits in units of their noise, which are then independent, with their derivatives.
struct Whitened<const D: usize, const M: usize> {
    there: [bool; M],
    h: [SVector<f64, D>; M],
    /// By the parameters, and the misfits themselves as the last column.
    columns: Rows,
}

impl<const D: usize, const M: usize> Whitened<D, M> {
    fn new(parameters: usize) -> Self {
        Self { there: [false; M], h: [SVector::zeros(); M], columns: Rows::zeros(M, parameters + 1) }
    }

    #[inline(always)]
    fn fill(&mut self, linear: &Linear<D, M>, columns: &Columns, record: &Record<M>, i: usize) {
        let root = root(&record.information[i]);
        let (sight, p) = (&linear.sights[i], self.columns.width() - 1);
        for m in 0..M {
            self.there[m] = root[(m, m)] != 0.0;
            let row = self.columns.row_mut(m);
            row.fill(0.0);
            let mut h = SVector::zeros();
            for c in m..M {
                let weight = root[(m, c)];
                h += sight.h.row(c).transpose() * weight;
                add(row, weight, columns.seen.row(M * i + c));
                row[p] += weight * sight.misfit[c];
            }
            self.h[m] = h;
        }
    }
}

/// The upper triangular root of a matrix of information, `root^T root`, which may have rows of zeros.
#[inline(always)]
pub(super) fn root<const M: usize>(information: &SMatrix<f64, M, M>) -> SMatrix<f64, M, M> {
    let mut rest = *information;
    let mut root = SMatrix::zeros();
    for m in 0..M {
        if rest[(m, m)] <= 1e-12 * information[(m, m)] {
            continue;
        }
        let own = rest[(m, m)].sqrt();
        for c in m..M {
            root[(m, c)] = rest[(m, c)] / own;
        }
        for (r, c) in (m..M).flat_map(|r| (m..M).map(move |c| (r, c))) {
            rest[(r, c)] -= root[(m, r)] * root[(m, c)];
        }
    }
    root
}

struct Elimination<'a, const D: usize> {
    system: Bordered<D>,
    t: &'a [f64],
}

impl<const D: usize> Work for Elimination<'_, D> {
    type Output = Result<Eliminated<D>, EstimateError>;

    #[inline(always)]
    fn run<V: Instructions>(self) -> Self::Output {
        let Bordered { diagonal, below, border: mut solved, mut corner } = self.system;
        let (n, p) = (diagonal.len(), corner.width() - 1);
        let (mut pivots, mut links) = (Vec::with_capacity(n), Vec::with_capacity(n));
        let (mut log_determinant, mut own) = (0.0, vec![0.0; D * (p + 1)]);
        let width = p + 1;
        for i in 0..n {
            let mut pivot = diagonal[i];
            if i > 0 {
                let link: &SMatrix<f64, D, D> = &links[i - 1];
                pivot -= link * link.transpose();
            }
            let singular = || EstimateError::Singular { t: self.t[i] };
            let pivot = root(&pivot).transpose();
            if (0..D).any(|k| pivot[(k, k)].is_nan() || pivot[(k, k)] <= 0.0) {
                return Err(singular());
            }
            log_determinant += 2.0 * (0..D).map(|k| pivot[(k, k)].ln()).sum::<f64>();
            // The border less what the frame before says of it, in units of the pivot.
            for k in 0..D {
                let (done, rest) = own.split_at_mut(k * width);
                let row = &mut rest[..width];
                row.copy_from_slice(solved.row(D * i + k));
                if i > 0 {
                    for j in 0..D {
                        add(row, -links[i - 1][(k, j)], solved.row(D * (i - 1) + j));
                    }
                }
                for j in 0..k {
                    add(row, -pivot[(k, j)], &done[j * width..(j + 1) * width]);
                }
                let inverse = pivot[(k, k)].recip();
                row.iter_mut().for_each(|value| *value *= inverse);
            }
            for k in 0..D {
                let row = &own[k * width..(k + 1) * width];
                solved.row_mut(D * i + k).copy_from_slice(row);
                corner.add_square(row, -1.0);
            }
            if i + 1 < n {
                links.push(behind(&below[i], &pivot));
            }
            pivots.push(pivot);
        }
        let schur = DMatrix::from_fn(p, p, |i, j| corner.at(i.min(j), i.max(j)));
        let gradient = DVector::from_fn(p, |j, _| corner.at(j, p));
        Ok(Eliminated { pivots, links, solved, schur, gradient, log_determinant })
    }
}

/// `below lower^-T` for a lower triangular matrix.
#[inline(always)]
fn behind<const D: usize>(below: &SMatrix<f64, D, D>, lower: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let mut link = SMatrix::zeros();
    for r in 0..D {
        for c in 0..D {
            let known: f64 = (0..c).map(|j| link[(r, j)] * lower[(c, j)]).sum();
            link[(r, c)] = (below[(r, c)] - known) / lower[(c, c)];
        }
    }
    link
}

/// The normal equations after the states were eliminated.
#[derive(Clone, Debug)]
pub struct Eliminated<const D: usize> {
    /// Lower triangular.
    pivots: Vec<SMatrix<f64, D, D>>,
    /// What couples frame `i + 1` with frame `i`, in units of the pivot of `i`.
    links: Vec<SMatrix<f64, D, D>>,
    /// The borders in units of the pivots.
    solved: Rows,
    /// The parameters' matrix and right-hand side with the states optimal: `schur dtheta = gradient`.
    pub schur: DMatrix<f64>,
    pub gradient: DVector<f64>,
    /// Logarithm of the determinant of the states' part.
    pub log_determinant: f64,
}

impl<const D: usize> Eliminated<D> {
    /// The change of the states that goes with a change of the parameters.
    pub fn states(&self, parameters: &DVector<f64>) -> Vec<SVector<f64, D>> {
        let (n, p) = (self.pivots.len(), parameters.len());
        let mut change: Vec<SVector<f64, D>> = vec![SVector::zeros(); n];
        for i in (0..n).rev() {
            let mut x = SVector::from_fn(|k, _| {
                let row = self.solved.row(D * i + k);
                row[p] - dot(&row[..p], parameters.as_slice())
            });
            if i + 1 < n {
                x -= self.links[i].transpose() * change[i + 1];
            }
            change[i] = self.pivots[i].tr_solve_lower_triangular_unchecked(&x);
        }
        change
    }

    /// How uncertain the states are, given the parameters' covariance.
    pub fn uncertain(&self, parameters: &DMatrix<f64>) -> Uncertain<D> {
        Isa::best().run(StateCovariance { of: self, root: lower_root(parameters) })
    }
}

/// The states' uncertainty, frame by frame.
#[derive(Clone, Debug)]
pub struct Uncertain<const D: usize> {
    /// A root of the parameters' covariance: its columns are independent changes.
    pub root: DMatrix<f64>,
    /// Their covariance were the parameters known.
    pub conditional: Vec<SMatrix<f64, D, D>>,
    /// `D` rows for each frame: by how much they move with each of those changes.
    pub shifts: Rows,
}

impl<const D: usize> Uncertain<D> {
    /// The covariance of each frame's state, the parameters' uncertainty included.
    pub fn covariance(&self) -> Vec<SMatrix<f64, D, D>> {
        let moved =
            |i: usize| SMatrix::from_fn(|r, c| dot(self.shifts.row(D * i + r), self.shifts.row(D * i + c)));
        self.conditional.iter().enumerate().map(|(i, own)| own + moved(i)).collect()
    }
}

fn lower_root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    nalgebra::Cholesky::new(covariance.clone()).map_or_else(|| DMatrix::zeros(n, n), |lower| lower.l())
}

struct StateCovariance<'a, const D: usize> {
    of: &'a Eliminated<D>,
    root: DMatrix<f64>,
}

impl<const D: usize> Work for StateCovariance<'_, D> {
    type Output = Uncertain<D>;

    #[inline(always)]
    fn run<V: Instructions>(self) -> Self::Output {
        let Eliminated { pivots, links, solved, .. } = self.of;
        let (n, p) = (pivots.len(), self.root.nrows());
        let (mut states, mut shifts) = (vec![SMatrix::zeros(); n], Rows::zeros(n * D, p));
        let mut conditional: SMatrix<f64, D, D> = SMatrix::zeros();
        let (mut response, mut own) = (Rows::zeros(D, p), Rows::zeros(D, p));
        for i in (0..n).rev() {
            let back = pivots[i].transpose().try_inverse().unwrap_or_else(SMatrix::zeros);
            let link = if i + 1 < n { links[i].transpose() } else { SMatrix::zeros() };
            conditional =
                back * (SMatrix::identity() + link * conditional * link.transpose()) * back.transpose();
            for k in 0..D {
                let row = own.row_mut(k);
                row.copy_from_slice(&solved.row(D * i + k)[..p]);
                for j in 0..D {
                    add(row, -link[(k, j)], response.row(j));
                }
            }
            for k in 0..D {
                let row = response.row_mut(k);
                row.fill(0.0);
                for j in k..D {
                    add(row, back[(k, j)], own.row(j));
                }
            }
            for k in 0..D {
                let shift = shifts.row_mut(D * i + k);
                for (j, &value) in response.row(k).iter().enumerate() {
                    for (c, to) in shift.iter_mut().enumerate().take(j + 1) {
                        // More of a parameter takes from the state what it explains.
                        *to -= value * self.root[(j, c)];
                    }
                }
            }
            states[i] = conditional;
        }
        Uncertain { root: self.root, conditional: states, shifts }
    }
}
