//! Block-tridiagonal normal equations with borders.

use nalgebra::{ArrayStorage, DMatrix, DVector, SMatrix, SVector};

use super::row_matrix::{OuterProductSum, RowMatrix, add, combine, dot, padded};
use super::{EstimateError, Linearisation, ParameterJacobian, Record};
use crate::integrate::cancel;
use crate::scalar::{InstructionSet, Isa, Real, Work, vector};

/// Whether the work is to end is asked once for so many frames.
const LOOKS: usize = 1024;

/// The normal equations of the least squares. The right-hand side is the last column of the borders, and of
/// the corner: it takes part in all that the parameters' columns do.
#[derive(Clone, Debug)]
pub struct Bordered<const D: usize> {
    /// Couples frame `i` with itself.
    pub diagonal: Vec<SMatrix<f64, D, D>>,
    /// Couples frame `i + 1` (rows) with frame `i` (columns).
    pub below: Vec<SMatrix<f64, D, D>>,
    /// `D` rows for each frame: its coupling with the parameters, and its right-hand side. The rest is padding.
    pub border: RowMatrix,
    /// The parameters' coupling with themselves, their right-hand side, and the sum of squares: a row for each,
    /// as wide as the border's, in which the numbers from the diagonal on to the right count.
    pub corner: RowMatrix,
}

impl<const D: usize> Bordered<D> {
    /// The Gauss-Newton equations of a linearised record for the parameters of some columns, without priors.
    /// `precision[i]` is the inverse variance of the model's error over link `i`, per state.
    pub fn new<const M: usize>(
        linear: &Linearisation<D, M>,
        columns: &ParameterJacobian,
        record: &Record<M>,
        precision: &[SVector<f64, D>],
    ) -> Self {
        Self::empty().anew(linear, columns, record, precision)
    }

    /// Room for none yet.
    pub(super) fn empty() -> Self {
        let none = || RowMatrix::zeros(0, 0);
        Self { diagonal: Vec::new(), below: Vec::new(), border: none(), corner: none() }
    }

    /// As [`new`](Self::new), in the memory of these equations: to allocate costs as much time as the work.
    pub(super) fn anew<const M: usize>(
        self,
        linear: &Linearisation<D, M>,
        columns: &ParameterJacobian,
        record: &Record<M>,
        precision: &[SVector<f64, D>],
    ) -> Self {
        f64::work(Isa::best(), Assembly { linear, columns, record, precision, room: self })
    }

    /// The number of parameters.
    pub fn parameters(&self) -> usize {
        self.corner.count() - 1
    }

    /// Adds a Gaussian prior on parameter `j`, now at `value`.
    pub fn prior(&mut self, j: usize, value: f64, mean: f64, sd: f64) {
        let (p, precision) = (self.parameters(), sd.powi(-2));
        let row = self.corner.row_mut(j);
        row[j] += precision;
        row[p] += precision * (mean - value);
    }

    /// Gives the padding states at the end of every frame a weight of one: they stay at zero, and change neither the
    /// cost nor the determinant.
    pub(super) fn hold(&mut self, idle: usize) {
        for k in D - idle..D {
            self.diagonal.iter_mut().for_each(|own| own[(k, k)] = 1.0);
            self.below.iter_mut().for_each(|link| link[(k, k)] = 0.0);
        }
    }

    /// Eliminates the states.
    pub fn eliminate(self, t: &[f64]) -> Result<ReducedSystem<D>, EstimateError> {
        f64::work(Isa::best(), Elimination { system: self, t })
    }
}

struct Assembly<'a, const D: usize, const M: usize> {
    linear: &'a Linearisation<D, M>,
    columns: &'a ParameterJacobian,
    record: &'a Record<M>,
    precision: &'a [SVector<f64, D>],
    room: Bordered<D>,
}

impl<const D: usize, const M: usize> Work for Assembly<'_, D, M> {
    type Output = Bordered<D>;
    const WIDE: bool = D == 4;

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Bordered<D> {
        let Self { linear, columns, record, precision, room: mut system } = self;
        let (n, p) = (record.t.len(), columns.seen.width());
        let width = padded(p + 1);
        for (matrices, count) in [(&mut system.diagonal, n), (&mut system.below, n - 1)] {
            matrices.clear();
            matrices.resize(count, zeros());
        }
        system.border.become_zeros(n * D, width);
        system.corner.become_zeros(p + 1, width);
        let mut squares = OuterProductSum::new(width, 1.0);
        // Misfits in units of their noise, of this frame and of the one before.
        let (mut one, mut other) = (Whitened::<D, M>::new(width), Whitened::<D, M>::new(width));
        let (mut now, mut before) = (&mut one, &mut other);
        let mut rows = RowMatrix::zeros(M.max(D), width);
        for i in 0..n {
            if i.is_multiple_of(LOOKS) {
                cancel::look();
            }
            std::mem::swap(&mut now, &mut before);
            now.fill::<V>(linear, columns, record, i);
            // The shares of this frame and of the one before in each row.
            let (mut h, mut h_back) = ([[0.0; M]; D], [[0.0; M]; D]);
            let mut remembered = false;
            for m in 0..M {
                let row = rows.row_mut(m);
                row.fill(0.0);
                if !now.there[m] {
                    continue;
                }
                let memory = record.remembered(i, m, before.there[m]);
                let scale = (1.0 - memory * memory).sqrt().recip();
                add::<V>(row, scale, now.columns.row(m));
                for k in 0..D {
                    h[k][m] = now.h[m][k] * scale;
                }
                if memory != 0.0 {
                    remembered = true;
                    let back = -memory * scale;
                    add::<V>(row, back, before.columns.row(m));
                    for k in 0..D {
                        h_back[k][m] = before.h[m][k] * back;
                    }
                }
                squares.push::<V>(row, &mut system.corner);
            }
            let rows = &rows.numbers()[..M * width];
            add_products(&mut system.diagonal[i], &h, &h);
            for k in 0..D {
                combine::<V>(system.border.row_mut(D * i + k), &h[k], rows);
            }
            if remembered {
                add_products(&mut system.diagonal[i - 1], &h_back, &h_back);
                add_products(&mut system.below[i - 1], &h, &h_back);
                for k in 0..D {
                    combine::<V>(system.border.row_mut(D * (i - 1) + k), &h_back[k], rows);
                }
            }
        }
        for i in 0..n - 1 {
            if !record.linked[i] {
                continue;
            }
            let link = &linear.flow[i];
            let mut a = [[0.0; D]; D];
            for k in 0..D {
                // w (x_{i+1} - a x_i - b theta) = -w defect
                let (w, row) = (precision[i][k].sqrt(), rows.row_mut(k));
                let slopes = columns.state.row(D * i + k);
                for j in 0..p {
                    row[j] = -w * slopes[j];
                }
                row[p] = -w * link.defect[k];
                row[p + 1..].fill(0.0);
                system.diagonal[i + 1][(k, k)] += w * w;
                for j in 0..D {
                    a[j][k] = -w * link.slope(k, j);
                    system.below[i][(k, j)] += w * a[j][k];
                }
                add::<V>(system.border.row_mut(D * (i + 1) + k), w, row);
                squares.push::<V>(row, &mut system.corner);
            }
            add_products(&mut system.diagonal[i], &a, &a);
            for j in 0..D {
                combine::<V>(system.border.row_mut(D * i + j), &a[j], &rows.numbers()[..D * width]);
            }
        }
        squares.flush::<V>(&mut system.corner);
        system
    }
}

/// A small matrix of zeros, made where it is wanted.
#[inline(always)]
pub(super) fn zeros<const R: usize, const C: usize>() -> SMatrix<f64, R, C> {
    SMatrix::from_array_storage(ArrayStorage([[0.0; R]; C]))
}

/// Adds the products of all lists `a` with all lists `b` to a matrix.
#[inline(always)]
fn add_products<const D: usize, const K: usize>(
    to: &mut SMatrix<f64, D, D>,
    a: &[[f64; K]; D],
    b: &[[f64; K]; D],
) {
    for c in 0..D {
        for r in 0..D {
            let mut sum = -0.0;
            for k in 0..K {
                sum += a[r][k] * b[c][k];
            }
            to[(r, c)] += sum;
        }
    }
}

/// A frame's misfits in units of their noise, which are then independent, with their derivatives.
struct Whitened<const D: usize, const M: usize> {
    there: [bool; M],
    h: [SVector<f64, D>; M],
    /// By the parameters, and the misfits themselves behind them.
    columns: RowMatrix,
}

impl<const D: usize, const M: usize> Whitened<D, M> {
    fn new(width: usize) -> Self {
        Self { there: [false; M], h: [zeros(); M], columns: RowMatrix::zeros(M, width) }
    }

    #[inline(always)]
    fn fill<V: InstructionSet>(
        &mut self,
        linear: &Linearisation<D, M>,
        columns: &ParameterJacobian,
        record: &Record<M>,
        i: usize,
    ) {
        let root = root(&record.information[i]);
        let (sight, p) = (&linear.sights[i], columns.seen.width());
        for m in 0..M {
            self.there[m] = root[(m, m)] != 0.0;
            let row = self.columns.row_mut(m);
            row.fill(0.0);
            let mut h: SVector<f64, D> = zeros();
            for c in m..M {
                let weight = root[(m, c)];
                if weight == 0.0 {
                    continue;
                }
                for k in 0..D {
                    h[k] += sight.h[(c, k)] * weight;
                }
                add::<V>(&mut row[..p], weight, columns.seen.row(M * i + c));
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
    let mut root = zeros();
    for m in 0..M {
        if rest[(m, m)] <= 1e-12 * information[(m, m)] {
            continue;
        }
        let own = rest[(m, m)].sqrt();
        for c in m..M {
            root[(m, c)] = rest[(m, c)] / own;
        }
        for r in m..M {
            for c in m..M {
                rest[(r, c)] -= root[(m, r)] * root[(m, c)];
            }
        }
    }
    root
}

struct Elimination<'a, const D: usize> {
    system: Bordered<D>,
    t: &'a [f64],
}

impl<const D: usize> Work for Elimination<'_, D> {
    type Output = Result<ReducedSystem<D>, EstimateError>;
    const WIDE: bool = D == 4;

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Self::Output {
        // Frame by frame, what is eliminated takes the place of what it was.
        let Bordered { diagonal: mut pivots, below: mut links, border: mut solved, mut corner } = self.system;
        let (n, p, width) = (pivots.len(), corner.count() - 1, solved.width());
        let (mut log_determinant, all) = (0.0, corner.at(p, p));
        let mut squares = OuterProductSum::new(width, -1.0);
        let mut rest = vec![0.0; D * width];
        for i in 0..n {
            if i.is_multiple_of(LOOKS) {
                cancel::look();
            }
            let mut pivot = pivots[i];
            if i > 0 {
                let link = &links[i - 1];
                for r in 0..D {
                    for c in r..D {
                        pivot[(r, c)] -= row_product(link, r, link, c);
                    }
                }
            }
            let pivot = root(&pivot).transpose();
            let mut product = 1.0;
            for k in 0..D {
                if pivot[(k, k)].is_nan() || pivot[(k, k)] <= 0.0 {
                    return Err(EstimateError::Singular { t: self.t[i] });
                }
                product *= pivot[(k, k)];
            }
            log_determinant += 2.0 * f64::ln(product);
            let inverse = lower_inverse(&pivot);
            // The border less what the frame before says of it, in units of the pivot.
            let (before, own) = solved.numbers_mut().split_at_mut(D * i * width);
            let (before, own) = (&before[before.len().saturating_sub(D * width)..], &mut own[..D * width]);
            if i > 0 {
                for k in 0..D {
                    let factors = vector!(f64, D; j => -links[i - 1][(k, j)]);
                    combine::<V>(&mut own[k * width..(k + 1) * width], &factors, before);
                }
            }
            rest.copy_from_slice(own);
            for k in 0..D {
                let row = &mut own[k * width..(k + 1) * width];
                let factors = vector!(f64, D; j => inverse[(k, j)]);
                row.fill(0.0);
                combine::<V>(row, &factors[..=k], &rest);
                squares.push::<V>(row, &mut corner);
            }
            if i + 1 < n {
                links[i] = times_transposed(&links[i], &inverse);
            }
            pivots[i] = pivot;
        }
        squares.flush::<V>(&mut corner);
        let explained = all - corner.at(p, p);
        let schur = DMatrix::from_fn(p, p, |i, j| corner.at(i.min(j), i.max(j)));
        let gradient = DVector::from_fn(p, |j, _| corner.at(j, p));
        Ok(ReducedSystem { pivots, links, solved, corner, schur, gradient, log_determinant, explained })
    }
}

/// `a b^T`
#[inline(always)]
fn times_transposed<const D: usize>(a: &SMatrix<f64, D, D>, b: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let mut product = zeros();
    for r in 0..D {
        for c in 0..D {
            product[(r, c)] = row_product(a, r, b, c);
        }
    }
    product
}

/// The product of two matrices' rows.
#[inline(always)]
fn row_product<const D: usize>(a: &SMatrix<f64, D, D>, r: usize, b: &SMatrix<f64, D, D>, c: usize) -> f64 {
    let mut sum = -0.0;
    for k in 0..D {
        sum += a[(r, k)] * b[(c, k)];
    }
    sum
}

/// The normal equations after the states were eliminated.
#[derive(Clone, Debug)]
pub struct ReducedSystem<const D: usize> {
    /// Lower triangular.
    pivots: Vec<SMatrix<f64, D, D>>,
    /// The coupling of frame `i + 1` with frame `i`, in units of the pivot of `i`.
    links: Vec<SMatrix<f64, D, D>>,
    /// The borders in units of the pivots.
    solved: RowMatrix,
    corner: RowMatrix,
    /// The parameters' matrix and right-hand side with the states optimal: `schur dtheta = gradient`.
    pub schur: DMatrix<f64>,
    pub gradient: DVector<f64>,
    /// Logarithm of the determinant of the states' part.
    pub log_determinant: f64,
    /// The decrease in the sum of squares by the states alone.
    explained: f64,
}

impl<const D: usize> ReducedSystem<D> {
    /// Room for other equations.
    pub(super) fn into_room(self) -> Bordered<D> {
        Bordered { diagonal: self.pivots, below: self.links, border: self.solved, corner: self.corner }
    }

    /// The decrease in the cost that the linear model predicts for a change of the parameters, the states optimal.
    pub fn promise(&self, parameters: &DVector<f64>) -> f64 {
        self.explained + self.gradient.dot(parameters)
    }

    /// The change of the states that goes with a change of the parameters.
    pub fn states(&self, parameters: &DVector<f64>) -> Vec<SVector<f64, D>> {
        let (n, p) = (self.pivots.len(), parameters.len());
        let mut change: Vec<SVector<f64, D>> = vec![zeros(); n];
        for i in (0..n).rev() {
            let mut x: SVector<f64, D> = zeros();
            for k in 0..D {
                let row = self.solved.row(D * i + k);
                x[k] = row[p] - dot(&row[..p], parameters.as_slice());
            }
            if i + 1 < n {
                x -= self.links[i].transpose() * change[i + 1];
            }
            change[i] = self.pivots[i].tr_solve_lower_triangular_unchecked(&x);
        }
        change
    }

    /// How uncertain the states are, given the parameters' covariance.
    pub fn uncertain(&self, parameters: &DMatrix<f64>) -> Covariances<D> {
        let (n, width) = (parameters.nrows(), padded(parameters.nrows()));
        let mut root = RowMatrix::zeros(n, width);
        if let Some(lower) = nalgebra::Cholesky::new(parameters.clone()) {
            let lower = lower.l();
            for j in 0..n {
                for c in 0..=j {
                    root.row_mut(j)[c] = lower[(j, c)];
                }
            }
        }
        Isa::best().run_narrow(StateCovariance { of: self, root })
    }
}

/// The states' uncertainty, frame by frame.
#[derive(Clone, Debug)]
pub struct Covariances<const D: usize> {
    /// A root of the parameters' covariance: its columns are independent changes. The rest is zero.
    pub root: RowMatrix,
    /// Their covariance were the parameters known.
    pub conditional: Vec<SMatrix<f64, D, D>>,
    /// `D` rows for each frame: its derivatives by those changes.
    pub shifts: RowMatrix,
}

impl<const D: usize> Covariances<D> {
    /// The covariance of each frame's state, the parameters' uncertainty included.
    pub fn covariance(&self) -> Vec<SMatrix<f64, D, D>> {
        Isa::best().run_narrow(FullCovariance(self))
    }

    /// The variance of what is seen, given how it changes with each frame's state and with the parameters.
    pub fn seen<const M: usize>(&self, linear: &Linearisation<D, M>) -> Vec<SVector<f64, M>> {
        Isa::best().run_narrow(SeenVariance { of: self, linear })
    }
}

struct FullCovariance<'a, const D: usize>(&'a Covariances<D>);

impl<const D: usize> Work for FullCovariance<'_, D> {
    type Output = Vec<SMatrix<f64, D, D>>;

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Self::Output {
        let Covariances { conditional, shifts, .. } = self.0;
        let mut covariance = conditional.clone();
        for i in 0..covariance.len() {
            let all = &mut covariance[i];
            for r in 0..D {
                for c in r..D {
                    all[(r, c)] += dot(shifts.row(D * i + r), shifts.row(D * i + c));
                    all[(c, r)] = all[(r, c)];
                }
            }
        }
        covariance
    }
}

struct SeenVariance<'a, const D: usize, const M: usize> {
    of: &'a Covariances<D>,
    linear: &'a Linearisation<D, M>,
}

impl<const D: usize, const M: usize> Work for SeenVariance<'_, D, M> {
    type Output = Vec<SVector<f64, M>>;

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Self::Output {
        let Covariances { root, conditional, shifts } = self.of;
        let mut moved = vec![0.0; root.width()];
        let mut variances: Vec<SVector<f64, M>> = vec![zeros(); conditional.len()];
        for i in 0..variances.len() {
            let h = &self.linear.sights[i].h;
            for m in 0..M {
                moved.fill(0.0);
                let by_state = vector!(f64, D; k => h[(m, k)]);
                combine::<V>(&mut moved, &by_state, &shifts.numbers()[D * i * shifts.width()..]);
                combine::<V>(&mut moved, self.linear.columns.seen.row(M * i + m), root.numbers());
                let mut known = -0.0;
                for k in 0..D {
                    let mut along = -0.0;
                    for j in 0..D {
                        along += conditional[i][(k, j)] * by_state[j];
                    }
                    known += by_state[k] * along;
                }
                variances[i][m] = known + dot(&moved, &moved);
            }
        }
        variances
    }
}

struct StateCovariance<'a, const D: usize> {
    of: &'a ReducedSystem<D>,
    root: RowMatrix,
}

impl<const D: usize> Work for StateCovariance<'_, D> {
    type Output = Covariances<D>;

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Self::Output {
        let ReducedSystem { pivots, links, solved, .. } = self.of;
        let (n, width) = (pivots.len(), self.root.width());
        let (mut states, mut shifts) = (vec![zeros(); n], RowMatrix::zeros(n * D, width));
        let mut conditional: SMatrix<f64, D, D> = zeros();
        let (mut alone, mut factors) = (RowMatrix::zeros(D, width), vec![0.0; self.root.count()]);
        for i in (0..n).rev() {
            // The inverse of the pivot, and with it what this frame takes from the next.
            let inverse = lower_inverse(&pivots[i]);
            let linked = i + 1 < n;
            let taken = if linked { links[i] * inverse } else { zeros() };
            conditional = inverse.tr_mul(&inverse) + taken.tr_mul(&(conditional * taken));
            let (own, next) = shifts.numbers_mut()[D * i * width..].split_at_mut(D * width);
            for j in 0..D {
                // More of a parameter takes from the state what it explains.
                let explained = solved.row(D * i + j);
                for c in 0..factors.len() {
                    factors[c] = -explained[c];
                }
                let row = alone.row_mut(j);
                row.fill(0.0);
                combine::<V>(row, &factors, self.root.numbers());
            }
            for k in 0..D {
                let row = &mut own[k * width..(k + 1) * width];
                combine::<V>(row, &vector!(f64, D; j => inverse[(j, k)]), alone.numbers());
                if linked {
                    combine::<V>(row, &vector!(f64, D; j => -taken[(j, k)]), next);
                }
            }
            states[i] = conditional;
        }
        Covariances { root: self.root, conditional: states, shifts }
    }
}

/// The inverse of a lower triangular matrix.
#[inline(always)]
fn lower_inverse<const D: usize>(lower: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let mut inverse = zeros();
    for c in 0..D {
        for r in c..D {
            let mut known = -0.0;
            for k in c..r {
                known += lower[(r, k)] * inverse[(k, c)];
            }
            inverse[(r, c)] = (if r == c { 1.0 } else { 0.0 } - known) / lower[(r, r)];
        }
    }
    inverse
}
