//! The orthonormal frame that an orbit carries along, and its covariant Lyapunov vectors.

use nalgebra::SMatrix;

use crate::analysis::CancelFlag;
use crate::analysis::batch::step_budget::StepBudget;
use crate::analysis::lyapunov::tangent_frame::tangents;
use crate::integrate::{Ending, Failure, Integrator, Method, Tolerance, WithTangents};
use crate::model::System;
use crate::scalar::{Dual, Mask};

/// The part of a tangent outside the span of those before it, as a share of the tangent, below which rounding hides it.
const PARALLEL: f64 = 1e-6;
/// Growth of a direction beyond which, or beyond the inverse of which, a product of triangles is no longer a number.
const LARGEST_GROWTH: f64 = 1e290;

/// Where an orbit and its tangents were at equal distances of time.
#[derive(Clone, Debug)]
pub struct CovariantFrames<const D: usize> {
    /// The states, from the start on, one more than there are intervals.
    pub states: Vec<[f64; D]>,
    /// The logarithms of how much each direction of the frame grew in each interval.
    pub growth: Vec<[f64; D]>,
    /// The covariant vectors at each state, each of length 1: `covariant[k][i]` is the vector `i` at the
    /// state `k`.
    pub covariant: Vec<[[f64; D]; D]>,
}

/// Follows an orbit from `x0` for `count` intervals of length `dt`. `idle` states at the end are padding.
///
/// In each interval the frame is multiplied by the flow's derivative and made orthonormal again, which
/// leaves a triangular matrix; in a long interval this happens more than once. Run backwards through these, almost any vectors of the spans of the first 1,
/// 2, ... directions converge to the covariant ones (F. Ginelli et al., Physical Review Letters 99 (2007)
/// 130601); those of the last intervals are not converged.
///
/// # Errors
/// Where the run fails, ends on the wall, or a tangent grows or dies out beyond the range of numbers: in an interval that
/// is too long, or where a contact sticks.
pub fn frames<M, K, const D: usize>(
    system: M,
    method: K,
    (x0, idle): ([f64; D], usize),
    (dt, count): (f64, usize),
    tolerance: &Tolerance,
    stop: &CancelFlag,
) -> Result<CovariantFrames<D>, Failure>
where
    M: System<Dual<f64, D>, D>,
    K: Method<Dual<f64, D>, D>,
{
    let norm = WithTangents(*tolerance);
    let start = tangents(x0, idle);
    let mut driver = Integrator::by(method, system, 0.0, start, None, &norm).with_wall();
    let mut states = vec![x0];
    let mut bases = vec![matrix(&start)];
    let mut triangles = Vec::with_capacity(count);
    let mut budget = StepBudget::new(0, 0.0, count as f64 * dt);
    for k in 0..count {
        stop.check()?;
        let end = (k + 1) as f64 * dt;
        let mut triangle = SMatrix::<f64, D, D>::identity();
        while driver.t() < end {
            stop.check()?;
            if driver.advance(end)? == Ending::Wall {
                return Err(Failure::LeftDomain { t: driver.t() });
            }
            if budget.exceeded(driver.counts().accepted, driver.t()) {
                return Err(Failure::EverShorter { t: driver.t() });
            }
            let carried = matrix(driver.x());
            let (q, r) = triangular(carried);
            if driver.t() < end && !is_nearly_parallel(&carried, &r) {
                continue;
            }
            // A long interval has several such products, of which each is accurate.
            triangle = r * triangle;
            if !triangle
                .diagonal()
                .iter()
                .all(|length| (1.0 / LARGEST_GROWTH..LARGEST_GROWTH).contains(length))
            {
                return Err(Failure::LostTangent { t: driver.t() });
            }
            let x = driver.x().map(|x| x.re);
            let renewed = std::array::from_fn(|n| Dual { re: x[n], d: std::array::from_fn(|i| q[(n, i)]) });
            driver.set_state(Mask::from_lanes(|_| true), renewed);
        }
        states.push(driver.x().map(|x| x.re));
        bases.push(matrix(driver.x()));
        triangles.push(triangle);
    }
    let growth = triangles.iter().map(|r| std::array::from_fn(|i| r[(i, i)].ln())).collect();
    let covariant = backwards(&bases, &triangles, stop)?;
    Ok(CovariantFrames { states, growth, covariant })
}

/// Whether a tangent lies almost in the span of those before it, as after a long time all do.
fn is_nearly_parallel<const D: usize>(carried: &SMatrix<f64, D, D>, r: &SMatrix<f64, D, D>) -> bool {
    !(0..D).all(|i| r[(i, i)] >= PARALLEL * carried.column(i).norm())
}

/// The tangents as columns.
fn matrix<const D: usize>(x: &[Dual<f64, D>; D]) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|n, i| x[n].d[i])
}

/// An orthonormal matrix times an upper triangular one with a positive diagonal (Gram-Schmidt).
fn triangular<const D: usize>(mut q: SMatrix<f64, D, D>) -> (SMatrix<f64, D, D>, SMatrix<f64, D, D>) {
    let mut r = SMatrix::zeros();
    for i in 0..D {
        for j in 0..i {
            let along = q.column(i).dot(&q.column(j));
            r[(j, i)] += along;
            let part = q.column(j) * along;
            q.set_column(i, &(q.column(i) - part));
        }
        let length = q.column(i).norm();
        r[(i, i)] = length;
        q.set_column(i, &(q.column(i) / length));
    }
    (q, r)
}

/// The covariant vectors, from the last interval to the first.
fn backwards<const D: usize>(
    bases: &[SMatrix<f64, D, D>],
    triangles: &[SMatrix<f64, D, D>],
    stop: &CancelFlag,
) -> Result<Vec<[[f64; D]; D]>, Failure> {
    // Coordinates in the frame: upper triangular with columns of length 1.
    let mut inside = SMatrix::<f64, D, D>::identity();
    let mut covariant = vec![[[0.0; D]; D]; bases.len()];
    for k in (0..bases.len()).rev() {
        stop.check()?;
        if let Some(r) = triangles.get(k) {
            inside = substituted(r, inside);
        }
        for i in 0..D {
            let column = inside.column(i).normalize();
            inside.set_column(i, &column);
        }
        let vectors = bases[k] * inside;
        covariant[k] = std::array::from_fn(|i| std::array::from_fn(|n| vectors[(n, i)]));
    }
    Ok(covariant)
}

/// `r^-1 c` for upper triangular `r` and `c`.
fn substituted<const D: usize>(r: &SMatrix<f64, D, D>, c: SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let mut x = c;
    for i in 0..D {
        for n in (0..=i).rev() {
            let known: f64 = (n + 1..=i).map(|m| r[(n, m)] * x[(m, i)]).sum();
            x[(n, i)] = (c[(n, i)] - known) / r[(n, n)];
        }
    }
    x
}
