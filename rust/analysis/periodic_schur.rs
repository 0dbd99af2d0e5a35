//! Periodic Schur decomposition: the eigenvalues of a product of matrices that is never formed.
//!
//! In the product of an orbit's derivatives the weak multipliers are lost in the rounding of the strong ones.
//! The periodic QR algorithm (A. Bojanczyk, G. H. Golub & P. Van Dooren, SPIE 1770 (1992) 31; D. Kressner,
//! Numerical Methods for General and Structured Eigenvalue Problems (2005), ch. 4) makes each factor
//! triangular by unitary matrices that cancel between neighbours: a multiplier is the product of one diagonal
//! entry of each, with an error relative to the factors, not to the product.

use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// Sweeps for each eigenvalue, beyond which there is none.
const MOST_SWEEPS: usize = 200;
/// At first, and after so many more sweeps, one without a shift: it sorts the eigenvalues by their sizes.
const UNSHIFTED: usize = 7;
/// An eigenvalue of a real product with a smaller angle from the real axis is real.
const REAL: f64 = 1e-9;

/// One eigenvalue of a product: `phase * exp(log)`.
#[derive(Clone, Copy, Debug)]
pub struct Multiplier {
    pub log: f64,
    /// A number of absolute value 1.
    pub phase: C,
    /// The relative change of the eigenvalue for one of the size 1 of every factor: a bound to first order, but
    /// for the conditioning of the eigenvectors.
    pub condition: f64,
}

/// The eigenvalues of `factors[m - 1] * ... * factors[0]`, square real matrices, largest first; conjugate pairs
/// are so to the bit. `None` where the iteration does not converge.
pub fn multipliers(factors: &[DMatrix<f64>]) -> Option<Vec<Multiplier>> {
    let n = factors.first()?.nrows();
    let mut product = Product::of(factors);
    product.make_hessenberg();
    let mut high = n;
    while high > 1 {
        high = product.deflate(high)?;
    }
    let mut found: Vec<_> = (0..n).map(|j| product.eigenvalue(j)).collect();
    found.sort_by(|a, b| b.log.total_cmp(&a.log));
    pair(&mut found);
    Some(found)
}

/// The factors, all of them triangular but for the last, a Hessenberg matrix in the end.
struct Product {
    last: DMatrix<C>,
    /// From the first one on.
    triangular: Vec<DMatrix<C>>,
    n: usize,
}

/// Of two rows: `[c, s; -conj(s), c]`.
#[derive(Clone, Copy)]
struct Rotation {
    c: f64,
    s: C,
}

impl Rotation {
    /// Makes the second of two entries zero.
    fn annihilating(a: C, b: C) -> Self {
        let (p, q) = (a.norm(), b.norm());
        let r = p.hypot(q);
        if q == 0.0 || !r.is_finite() {
            Self { c: 1.0, s: C::new(0.0, 0.0) }
        } else if p == 0.0 {
            Self { c: 0.0, s: C::new(1.0, 0.0) }
        } else {
            Self { c: p / r, s: a / p * b.conj() / r }
        }
    }

    fn rows(self, matrix: &mut DMatrix<C>, k: usize) {
        for j in 0..matrix.ncols() {
            let (a, b) = (matrix[(k - 1, j)], matrix[(k, j)]);
            matrix[(k - 1, j)] = a * self.c + b * self.s;
            matrix[(k, j)] = b * self.c - a * self.s.conj();
        }
    }

    /// From the right by the inverse.
    fn columns(self, matrix: &mut DMatrix<C>, k: usize) {
        for i in 0..matrix.nrows() {
            let (a, b) = (matrix[(i, k - 1)], matrix[(i, k)]);
            matrix[(i, k - 1)] = a * self.c + b * self.s.conj();
            matrix[(i, k)] = b * self.c - a * self.s;
        }
    }
}

impl Product {
    fn of(factors: &[DMatrix<f64>]) -> Self {
        let n = factors[0].nrows();
        let complex = |a: &DMatrix<f64>| a.map(|x| C::new(x, 0.0));
        let (last, first) = factors.split_last().expect("there is a factor");
        let mut turn = DMatrix::identity(n, n);
        let mut triangular = Vec::with_capacity(first.len());
        for factor in first {
            let (q, mut r) = (complex(factor) * turn).qr().unpack();
            r.fill_lower_triangle(C::new(0.0, 0.0), 1);
            triangular.push(r);
            turn = q;
        }
        Self { last: complex(last) * turn, triangular, n }
    }

    /// A rotation of rows `k - 1` and `k` of the last factor; the others stay triangular.
    fn rotate(&mut self, k: usize, mut rotation: Rotation) {
        rotation.rows(&mut self.last, k);
        for matrix in &mut self.triangular {
            rotation.columns(matrix, k);
            rotation = Rotation::annihilating(matrix[(k - 1, k - 1)], matrix[(k, k - 1)]);
            rotation.rows(matrix, k);
            matrix[(k, k - 1)] = C::new(0.0, 0.0);
        }
        rotation.columns(&mut self.last, k);
    }

    /// Entry (`k`, `j`) of the last factor becomes zero.
    fn annihilate(&mut self, k: usize, j: usize) {
        self.rotate(k, Rotation::annihilating(self.last[(k - 1, j)], self.last[(k, j)]));
        self.last[(k, j)] = C::new(0.0, 0.0);
    }

    fn make_hessenberg(&mut self) {
        for j in 0..self.n.saturating_sub(2) {
            for k in (j + 2..self.n).rev() {
                self.annihilate(k, j);
            }
        }
    }

    /// Sweeps until one of the rows below `high` is alone; where the last block then ends.
    fn deflate(&mut self, high: usize) -> Option<usize> {
        for sweep in 0..MOST_SWEEPS {
            let low = self.low(high);
            if low == high - 1 {
                return Some(high - 1);
            }
            let (top, below) = self.first_column(low, high, sweep.is_multiple_of(UNSHIFTED) || sweep == 1);
            self.rotate(low + 1, Rotation::annihilating(top, below));
            for k in low + 2..high {
                self.annihilate(k, k - 2);
            }
        }
        None
    }

    /// Where the block that ends before `high` begins; entries below the diagonal that are rounding become zero.
    fn low(&mut self, high: usize) -> usize {
        for k in (1..high).rev() {
            let around = self.last[(k - 1, k - 1)].norm() + self.last[(k, k)].norm();
            if self.last[(k, k - 1)].norm() <= f64::EPSILON * around {
                self.last[(k, k - 1)] = C::new(0.0, 0.0);
                return k;
            }
        }
        0
    }

    /// The first column of the block less its shift, but for a factor.
    fn first_column(&self, low: usize, high: usize, unshifted: bool) -> (C, C) {
        let (top, below) = (self.last[(low, low)], self.last[(low + 1, low)]);
        if unshifted {
            return (top, below);
        }
        let size = high - low;
        let mut rest = DMatrix::<C>::identity(size, size);
        for matrix in &self.triangular {
            rest = matrix.view((low, low), (size, size)) * rest;
            // A factor common to all does not matter; without it, products overflow.
            let largest = rest.iter().map(|x| x.norm()).fold(0.0, f64::max);
            if largest > 0.0 {
                rest /= C::new(largest, 0.0);
            }
        }
        let block = self.last.view((low, low), (size, size)) * &rest;
        let (i, j) = (size - 2, size - 1);
        let half = (block[(i, i)] - block[(j, j)]) / 2.0;
        let root = (half * half + block[(i, j)] * block[(j, i)]).sqrt();
        let middle = (block[(i, i)] + block[(j, j)]) / 2.0;
        let (one, other) = (middle + root, middle - root);
        // Wilkinson's shift: the eigenvalue of the last two rows that is nearer to the last entry.
        let near = |x: &C| (*x - block[(j, j)]).norm();
        let shift = if near(&one) < near(&other) { one } else { other };
        (top * rest[(0, 0)] - shift, below * rest[(0, 0)])
    }

    fn eigenvalue(&self, j: usize) -> Multiplier {
        let (mut log, mut phase, mut condition) = (0.0, C::new(1.0, 0.0), 0.0);
        for matrix in self.triangular.iter().chain([&self.last]) {
            let entry = matrix[(j, j)];
            let size = entry.norm();
            log += size.ln();
            phase *= if size > 0.0 { entry / size } else { C::new(1.0, 0.0) };
            condition += matrix.norm() / size;
        }
        Multiplier { log, phase: phase / phase.norm(), condition }
    }
}

/// Eigenvalues of a real product are real or come in pairs.
fn pair(found: &mut [Multiplier]) {
    let mut open: Vec<usize> = Vec::new();
    for k in 0..found.len() {
        if found[k].phase.im.abs() > REAL {
            open.push(k);
        } else {
            found[k].phase = C::new(found[k].phase.re.signum(), 0.0);
        }
    }
    while let Some(k) = open.pop() {
        let away = |&i: &usize| {
            let apart = (found[i].phase - found[k].phase.conj()).norm();
            apart + (found[i].log - found[k].log).abs()
        };
        let Some(place) = (0..open.len()).min_by(|&a, &b| away(&open[a]).total_cmp(&away(&open[b]))) else {
            found[k].phase = C::new(found[k].phase.re.signum(), 0.0);
            return;
        };
        let i = open.remove(place);
        let sum = found[i].phase + found[k].phase.conj();
        let phase = sum / sum.norm();
        let log = 0.5 * (found[i].log + found[k].log);
        let upper = if phase.im > 0.0 { phase } else { phase.conj() };
        (found[i].log, found[k].log) = (log, log);
        (found[i.min(k)].phase, found[i.max(k)].phase) = (upper, upper.conj());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(factors: &[DMatrix<f64>]) -> Vec<C> {
        let found = multipliers(factors).unwrap();
        found.iter().map(|one| one.phase * one.log.exp()).collect()
    }

    /// A number without structure; the same every time.
    fn matrix(n: usize, seed: u64) -> DMatrix<f64> {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        DMatrix::from_fn(n, n, |_, _| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        })
    }

    #[test]
    fn a_product_of_few_factors_has_the_eigenvalues_of_the_product() {
        for n in 1..=6 {
            for m in [1, 2, 3, 7] {
                let factors: Vec<_> = (0..m).map(|i| matrix(n, (31 * n + 7 * m + i) as u64)).collect();
                let product = factors.iter().fold(DMatrix::identity(n, n), |p, a| a * p);
                let mut known: Vec<C> = product.complex_eigenvalues().iter().copied().collect();
                let scale = product.norm();
                for value in values(&factors) {
                    let (k, away) = known
                        .iter()
                        .enumerate()
                        .map(|(k, one)| (k, (one - value).norm()))
                        .min_by(|a, b| a.1.total_cmp(&b.1))
                        .unwrap();
                    // The product itself gives the weak multipliers only to its rounding.
                    assert!(away < 1e-11 * scale, "{n} {m}: {value} off by {away:e} of {scale:e}");
                    known.remove(k);
                }
            }
        }
    }

    /// Factors `B_{i+1} D B_i^-1` have the product's eigenvalues `D^m` exactly.
    #[test]
    fn weak_ones_are_right_beside_strong_ones() {
        let (n, m) = (4, 40);
        let bases: Vec<_> = (0..m).map(|i| matrix(n, i as u64 + 5) + DMatrix::identity(n, n) * 2.0).collect();
        let sizes = [8.0, 1.01, -0.9, 0.02];
        let diagonal = DMatrix::from_diagonal(&nalgebra::DVector::from_row_slice(&sizes));
        let factors: Vec<_> = (0..m)
            .map(|i| &bases[(i + 1) % m] * &diagonal * bases[i].clone().try_inverse().unwrap())
            .collect();
        let found = multipliers(&factors).unwrap();
        // From 8^40 = 1e36 down to 0.02^40 = 1e-68.
        for (one, size) in found.iter().zip(sizes) {
            assert!((one.log - m as f64 * size.abs().ln()).abs() < 1e-11, "{size}: {}", one.log);
            assert_eq!(one.phase, C::new(1.0, 0.0));
        }
    }

    #[test]
    fn a_pair_beside_a_strong_one_keeps_its_angle() {
        let (n, m) = (3, 30);
        let bases: Vec<_> =
            (0..m).map(|i| matrix(n, i as u64 + 50) + DMatrix::identity(n, n) * 2.0).collect();
        let (a, b) = (0.99 * 0.3_f64.cos(), 0.99 * 0.3_f64.sin());
        let middle = DMatrix::from_row_slice(3, 3, &[5.0, 0.0, 0.0, 0.0, a, -b, 0.0, b, a]);
        let factors: Vec<_> =
            (0..m).map(|i| &bases[(i + 1) % m] * &middle * bases[i].clone().try_inverse().unwrap()).collect();
        let found = values(&factors);
        let known = C::from_polar(0.99_f64.powi(m as i32), 0.3 * m as f64);
        let known = if known.im > 0.0 { known } else { known.conj() };
        assert!((found[1] - known).norm() < 1e-11 && found[2] == found[1].conj(), "{found:?} {known}");
    }

    #[test]
    fn a_direction_that_dies_out_has_the_multiplier_zero() {
        let mut factors: Vec<_> = (0..4).map(|i| matrix(3, i + 90)).collect();
        factors[1].row_mut(2).fill(0.0);
        let found = values(&factors);
        let product = factors.iter().fold(DMatrix::identity(3, 3), |p, a| a * p);
        assert!(found[2].norm() < 1e-17, "{found:?}");
        assert!(((found[0] + found[1] + found[2]).re - product.trace()).abs() < 1e-14);
    }
}
