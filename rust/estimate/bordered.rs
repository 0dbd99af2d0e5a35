//! Block-tridiagonal normal equations with borders.

use nalgebra::{Cholesky, Const, DMatrix, DVector, Dyn, OMatrix, SMatrix, SVector};

use super::{EstimateError, Linear, Record};

/// `D` rows, one per state, and one column per border.
pub type Block<const D: usize> = OMatrix<f64, Const<D>, Dyn>;

/// The normal equations: `diagonal[i]` couples frame `i` with itself, `below[i]` frame `i + 1` with
/// frame `i`, `border[i]` frame `i` with the parameters, `corner` the parameters with themselves.
#[derive(Clone, Debug)]
pub struct Bordered<const D: usize> {
    pub diagonal: Vec<SMatrix<f64, D, D>>,
    pub below: Vec<SMatrix<f64, D, D>>,
    pub rhs: Vec<SVector<f64, D>>,
    pub border: Vec<Block<D>>,
    pub corner: DMatrix<f64>,
    pub corner_rhs: DVector<f64>,
}

impl<const D: usize> Bordered<D> {
    /// The Gauss-Newton equations of a linearised record, without priors. `precision[i]` is the inverse
    /// variance of the model's error over link `i`, per state; zero where frames are not linked.
    pub fn new<const M: usize>(
        linear: &Linear<D, M>,
        record: &Record<M>,
        precision: &[SVector<f64, D>],
    ) -> Self {
        let n = record.t.len();
        let p = linear.columns();
        let mut system = Self {
            diagonal: vec![SMatrix::zeros(); n],
            below: vec![SMatrix::zeros(); n - 1],
            rhs: vec![SVector::zeros(); n],
            border: vec![Block::zeros(p); n],
            corner: DMatrix::zeros(p, p),
            corner_rhs: DVector::zeros(p),
        };
        for i in 0..n {
            let (h, g, e) = (&linear.h[i], &linear.g[i], &linear.misfit[i]);
            let information = record.information[i];
            let weighted = h.transpose() * information;
            system.diagonal[i] += weighted * h;
            system.rhs[i] += weighted * e;
            system.border[i] += weighted * g;
            let weighted = information * g;
            system.corner += g.tr_mul(&weighted);
            system.corner_rhs += weighted.tr_mul(e);
        }
        for i in (0..n - 1).filter(|&i| record.linked[i]) {
            let (a, b, r) = (&linear.a[i], &linear.b[i], &linear.defect[i]);
            let q = SMatrix::<f64, D, D>::from_diagonal(&precision[i]);
            let (qa, qb, qr) = (q * a, q * b, q * r);
            system.diagonal[i] += a.transpose() * qa;
            system.diagonal[i + 1] += q;
            system.below[i] -= qa;
            system.rhs[i] += a.transpose() * qr;
            system.rhs[i + 1] -= qr;
            system.border[i] += a.transpose() * &qb;
            system.border[i + 1] -= &qb;
            system.corner += b.tr_mul(&qb);
            system.corner_rhs += qb.tr_mul(r);
        }
        system
    }

    /// Adds a Gaussian prior on border `j`, now at `value`.
    pub fn prior(&mut self, j: usize, value: f64, mean: f64, sd: f64) {
        let precision = sd.powi(-2);
        self.corner[(j, j)] += precision;
        self.corner_rhs[j] += precision * (mean - value);
    }

    /// Levenberg-Marquardt damping: the diagonal grows by the factor `1 + lambda`.
    pub fn damp(&mut self, lambda: f64) {
        for block in &mut self.diagonal {
            for k in 0..D {
                block[(k, k)] *= 1.0 + lambda;
            }
        }
        for j in 0..self.corner.nrows() {
            self.corner[(j, j)] *= 1.0 + lambda;
        }
    }

    /// Eliminates the states.
    pub fn eliminate(self, t: &[f64]) -> Result<Eliminated<D>, EstimateError> {
        let Self { diagonal, below, mut rhs, mut border, mut corner, mut corner_rhs } = self;
        let n = diagonal.len();
        let mut pivots = Vec::with_capacity(n);
        let mut gains: Vec<SMatrix<f64, D, D>> = Vec::with_capacity(n - 1);
        for i in 0..n {
            let mut pivot = diagonal[i];
            if i > 0 {
                let gain = gains[i - 1];
                pivot -= gain.transpose() * below[i - 1].transpose();
                let (done, rest) = rhs.split_at_mut(i);
                rest[0] -= gain.transpose() * done[i - 1];
                let (done, rest) = border.split_at_mut(i);
                rest[0] -= gain.transpose() * &done[i - 1];
            }
            let pivot = Cholesky::new(pivot).ok_or(EstimateError::Singular { t: t[i] })?;
            let solved = pivot.solve(&border[i]);
            corner -= border[i].tr_mul(&solved);
            corner_rhs -= solved.tr_mul(&rhs[i]);
            if i + 1 < n {
                gains.push(pivot.solve(&below[i].transpose()));
            }
            pivots.push(pivot);
        }
        Ok(Eliminated { pivots, gains, rhs, border, schur: corner, gradient: corner_rhs })
    }
}

/// The normal equations after the states were eliminated.
#[derive(Clone, Debug)]
pub struct Eliminated<const D: usize> {
    pivots: Vec<Cholesky<f64, Const<D>>>,
    /// `gains[i] = pivot_i^{-1} below_i^T`.
    gains: Vec<SMatrix<f64, D, D>>,
    rhs: Vec<SVector<f64, D>>,
    border: Vec<Block<D>>,
    /// The parameters' matrix and right-hand side with the states optimal: `schur dtheta = gradient`.
    pub schur: DMatrix<f64>,
    pub gradient: DVector<f64>,
}

impl<const D: usize> Eliminated<D> {
    /// The change of the states that goes with a change of the parameters.
    pub fn states(&self, parameters: &DVector<f64>) -> Vec<SVector<f64, D>> {
        let n = self.pivots.len();
        let mut change: Vec<SVector<f64, D>> = vec![SVector::zeros(); n];
        for i in (0..n).rev() {
            let mut x = self.pivots[i].solve(&(self.rhs[i] - &self.border[i] * parameters));
            if i + 1 < n {
                x -= self.gains[i] * change[i + 1];
            }
            change[i] = x;
        }
        change
    }

    /// The covariance of each frame's state, the parameters' uncertainty (covariance `parameters`)
    /// included.
    pub fn state_covariance(&self, parameters: &DMatrix<f64>) -> Vec<SMatrix<f64, D, D>> {
        let n = self.pivots.len();
        let mut covariance: Vec<SMatrix<f64, D, D>> = vec![SMatrix::zeros(); n];
        let mut conditional: SMatrix<f64, D, D> = SMatrix::zeros();
        let mut response = Block::<D>::zeros(self.schur.ncols());
        for i in (0..n).rev() {
            let mut own = self.pivots[i].inverse();
            let mut column = self.pivots[i].solve(&self.border[i]);
            if i + 1 < n {
                own += self.gains[i] * conditional * self.gains[i].transpose();
                column -= self.gains[i] * &response;
            }
            conditional = own;
            response = column;
            covariance[i] = own + &response * parameters * response.transpose();
        }
        covariance
    }
}
