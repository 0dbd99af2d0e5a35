//! Frames of tangents.

use crate::scalar::{Dual, Mask, Real};

/// The state with `N` orthonormal tangents that no symmetry singles out.
pub fn tangents<R: Real, const D: usize, const N: usize>(x: [f64; D]) -> [Dual<R, N>; D] {
    let mut frame = x.map(|x| Dual::fixed(R::constant(x)));
    for (n, component) in frame.iter_mut().enumerate() {
        for (i, d) in component.d.iter_mut().enumerate() {
            // Any numbers without a pattern.
            *d = R::constant(((n * N + i + 1) as f64 * 1.618).sin() + if n == i { 1.5 } else { 0.0 });
        }
    }
    orthonormalise(&frame).0
}

/// The state with its tangents made orthonormal, and the length that each had once the ones before it
/// were taken out (modified Gram-Schmidt: the diagonal of R in a QR decomposition).
///
/// A tangent that has vanished, as where a contact sticks, has length 0; it is replaced by some direction
/// perpendicular to the ones before it, so that the others go on.
#[inline(never)]
pub fn orthonormalise<R: Real, const D: usize, const N: usize>(
    x: &[Dual<R, N>; D],
) -> ([Dual<R, N>; D], [R; N]) {
    let mut x = *x;
    let mut lengths = [R::zero(); N];
    for i in 0..N {
        for j in 0..i {
            subtract(&mut x, i, j);
        }
        let mut square = R::zero();
        for n in 0..D {
            square += x[n].d[i] * x[n].d[i];
        }
        lengths[i] = square.sqrt();
        let inverse = R::one() / lengths[i];
        for n in 0..D {
            x[n].d[i] = x[n].d[i] * inverse;
        }
        let gone = lengths[i].less(R::constant(1e-150));
        if gone.any() {
            lengths[i] = R::select(gone, R::zero(), lengths[i]);
            replace(&mut x, i, gone);
        }
    }
    (x, lengths)
}

/// Takes the part along tangent `j` out of tangent `i`.
#[inline(always)]
fn subtract<R: Real, const D: usize, const N: usize>(x: &mut [Dual<R, N>; D], i: usize, j: usize) {
    let mut along = R::zero();
    for n in 0..D {
        along += x[n].d[i] * x[n].d[j];
    }
    for n in 0..D {
        x[n].d[i] -= along * x[n].d[j];
    }
}

/// Puts the axis with the most room beside the tangents before `i` in its place, in these lanes.
#[cold]
fn replace<R: Real, const D: usize, const N: usize>(x: &mut [Dual<R, N>; D], i: usize, lanes: R::Mask) {
    for lane in (0..R::LANES).filter(|&lane| lanes.lane(lane)) {
        let taken = |n: usize| (0..i).map(|j| x[n].d[j].lane(lane).powi(2)).sum::<f64>();
        let axis = (0..D).min_by(|&a, &b| taken(a).total_cmp(&taken(b))).unwrap_or(0);
        let mut new: [f64; D] = std::array::from_fn(|n| if n == axis { 1.0 } else { 0.0 });
        for j in 0..i {
            let along: f64 = (0..D).map(|n| new[n] * x[n].d[j].lane(lane)).sum();
            for n in 0..D {
                new[n] -= along * x[n].d[j].lane(lane);
            }
        }
        let length = new.iter().map(|v| v * v).sum::<f64>().sqrt();
        for n in 0..D {
            x[n].d[i].set_lane(lane, new[n] / length);
        }
    }
}
