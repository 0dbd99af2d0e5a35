//! Frames of tangents.

use crate::analysis::batch::lanes::work;
use crate::integrate::{ErrorNorm, Integrator, Method};
use crate::model::System;
use crate::scalar::{Dual, InstructionSet, Isa, Mask, Real, Work, vector};
use crate::unroll::unroll;

/// The state with `N` orthonormal tangents that no symmetry singles out. The padding states at the end are separate
/// from the others: with as many tangents as states, the last tangents lie along them.
pub fn tangents<R: Real, const D: usize, const N: usize>(x: [f64; D], idle: usize) -> [Dual<R, N>; D] {
    let mut frame = vector!(Dual<R, N>, D; n => Dual::fixed(R::constant(x[n])));
    for n in 0..D {
        for i in 0..N {
            // Any numbers without a pattern.
            let d = match n.max(i) < D - idle {
                true => ((n * N + i + 1) as f64 * 1.618).sin() + if n == i { 1.5 } else { 0.0 },
                false => f64::from(u8::from(n == i)),
            };
            frame[n].d[i] = R::constant(d);
        }
    }
    orthonormalise(&frame).0
}

/// The state with its tangents made orthonormal, and the length that each had once the ones before it
/// were taken out (modified Gram-Schmidt: the diagonal of R in a QR decomposition).
///
/// A tangent that has vanished, as where a contact sticks, has length 0; it is replaced by some direction
/// perpendicular to the ones before it, so that the others go on.
#[inline(always)]
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
        unroll!(n in 0..D => { square += x[n].d[i] * x[n].d[i]; });
        lengths[i] = square.sqrt();
        let inverse = R::one() / lengths[i];
        unroll!(n in 0..D => { x[n].d[i] = x[n].d[i] * inverse; });
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
    unroll!(n in 0..D => { along += x[n].d[i] * x[n].d[j]; });
    unroll!(n in 0..D => { x[n].d[i] -= along * x[n].d[j]; });
}

/// Puts the axis with the most room beside the tangents before `i` in its place, in these lanes.
#[cold]
fn replace<R: Real, const D: usize, const N: usize>(x: &mut [Dual<R, N>; D], i: usize, lanes: R::Mask) {
    for lane in 0..R::LANES {
        if !lanes.lane(lane) {
            continue;
        }
        let mut own = [[0.0; N]; D];
        for n in 0..D {
            own[n] = vector!(f64, N; j => x[n].d[j].lane(lane));
        }
        let new = roomiest(&own, i);
        for n in 0..D {
            x[n].d[i].set_lane(lane, new[n]);
        }
    }
}

/// The axis with the most room beside the first `count` tangents, made perpendicular to them.
fn roomiest<const D: usize, const N: usize>(x: &[[f64; N]; D], count: usize) -> [f64; D] {
    let taken = |n: usize| x[n][..count].iter().map(|d| d.powi(2)).sum::<f64>();
    let axis = (0..D).min_by(|&a, &b| taken(a).total_cmp(&taken(b))).unwrap_or(0);
    let mut new = vector!(f64, D; n => if n == axis { 1.0 } else { 0.0 });
    for j in 0..count {
        let mut along = 0.0;
        for n in 0..D {
            along += new[n] * x[n][j];
        }
        for n in 0..D {
            new[n] -= along * x[n][j];
        }
    }
    let length = new.iter().map(|v| v * v).sum::<f64>().sqrt();
    vector!(f64, D; n => new[n] / length)
}

/// The logarithm of a tangent's length.
fn log_length<R: Real, const D: usize, const N: usize>(x: &[Dual<R, N>; D], i: usize, lane: usize) -> f64 {
    let mut square = 0.0;
    for x in x {
        square += x.d[i].lane(lane).powi(2);
    }
    0.5 * f64::ln(square)
}

/// How much tangents had grown when they were last made orthonormal: `ln(product) + sum`, so that a step
/// costs a multiplication.
#[derive(Clone, Copy, Debug)]
pub struct LogGrowth<R, const N: usize> {
    product: [R; N],
    sum: [R; N],
    /// Steps since the tangents were made orthonormal by turn.
    steps: R,
}

/// The number of steps after which several tangents are made orthonormal again: until then they lose only a few digits.
const TURN: f64 = 4.0;

impl<R: Real, const N: usize> LogGrowth<R, N> {
    pub fn none() -> Self {
        Self { product: [R::one(); N], sum: [R::zero(); N], steps: R::zero() }
    }

    /// Begins with another orbit in a lane, where its state is `x`.
    pub fn begin<const D: usize>(&mut self, x: &[Dual<R, N>; D], lane: usize) {
        self.steps.set_lane(lane, 0.0);
        self.restart(x, lane);
    }

    /// Counts a lane's from now on, where its state is `x`.
    pub fn restart<const D: usize>(&mut self, x: &[Dual<R, N>; D], lane: usize) {
        for i in 0..N {
            self.product[i].set_lane(lane, 1.0);
            self.sum[i].set_lane(lane, -log_length(x, i, lane));
        }
    }

    /// The logarithms of a lane's, where its state is `x`.
    pub fn lane<const D: usize>(&self, x: &[Dual<R, N>; D], lane: usize) -> [f64; N] {
        let before = |i: usize| self.sum[i].lane(lane) + self.product[i].lane(lane).ln();
        vector!(f64, N; i => before(i) + log_length(x, i, lane))
    }

    /// Makes the tangents in the lanes that moved orthonormal again, if necessary, and adds their growth. Several
    /// tangents lean towards each other with every step; they must be orthonormal where
    /// asked for in `told`; a single one only must not leave the range of numbers.
    #[inline(always)]
    pub fn keep<M, const D: usize, E, K>(
        &mut self,
        isa: Isa,
        driver: &mut Integrator<M, Dual<R, N>, D, E, K>,
        (moved, told): (R::Mask, R::Mask),
    ) where
        M: System<Dual<R, N>, D>,
        E: ErrorNorm<Dual<R, N>, D> + Copy,
        K: Method<Dual<R, N>, D>,
    {
        let lanes;
        if const { N == 1 } {
            let mut square = R::zero();
            unroll!(n in 0..D => { square += driver.x()[n].d[0] * driver.x()[n].d[0]; });
            let near = R::constant(1e-40).less(square).and(square.less(R::constant(1e40)));
            lanes = moved.and(near.not());
        } else {
            let steps = self.steps + R::select(moved, R::one(), R::zero());
            let due = steps.less(R::constant(TURN)).not();
            self.steps = R::select(due, R::zero(), steps);
            lanes = moved.and(due.or(told));
        }
        if lanes.any() {
            work::<R, _>(isa, Renewal { growth: self, driver, lanes });
        }
    }

    #[inline(always)]
    fn add(&mut self, lengths: [R; N], lanes: R::Mask) {
        unroll!(n in 0..N => {
            let grown = R::select(lanes, self.product[n] * lengths[n], self.product[n]);
            self.product[n] = grown;
            // A length of zero stays one.
            let far = grown.less(R::constant(1e-100)).or(R::constant(1e100).less(grown));
            if far.any() {
                self.sum[n] = R::select(far, self.sum[n] + grown.ln(), self.sum[n]);
                self.product[n] = R::select(far, R::one(), grown);
            }
        });
    }
}

struct Renewal<'a, M, R: Real, const D: usize, const N: usize, E, K> {
    growth: &'a mut LogGrowth<R, N>,
    driver: &'a mut Integrator<M, Dual<R, N>, D, E, K>,
    lanes: R::Mask,
}

impl<M, R: Real, const D: usize, const N: usize, E, K> Work for Renewal<'_, M, R, D, N, E, K>
where
    M: System<Dual<R, N>, D>,
    E: ErrorNorm<Dual<R, N>, D> + Copy,
    K: Method<Dual<R, N>, D>,
{
    type Output = ();

    #[inline(always)]
    fn run<V: InstructionSet>(self) {
        let (x, lengths) = orthonormalise(self.driver.x());
        self.driver.set_state(self.lanes, x);
        self.growth.add(lengths, self.lanes);
    }
}
