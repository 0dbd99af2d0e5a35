//! How accurate a run shall be.

use crate::scalar::elementary::inverse_rough;
use crate::scalar::{Dual, Mask, Real, Scalar, vector};
use crate::unroll::unroll;

/// How large the error of a step is.
pub trait ErrorNorm<S: Scalar, const D: usize> {
    /// The norm of the error of a step from one state to another: 1 where it is just allowed.
    fn of_step(&self, error: &[S; D], before: &[S; D], after: &[S; D]) -> S::Real;

    /// The weights of the terms of a series that starts with `start`.
    type Weights;
    fn weights(&self, start: &[S; D]) -> Self::Weights;

    /// The square of a term's norm.
    fn of_term(&self, term: &[S; D], weights: &Self::Weights) -> S::Real;

    /// The tolerance of the state alone.
    fn state(&self) -> &Tolerance;
}

/// The error that a step may make in component `n`: `atol + rtol |x_n|`.
///
/// The norm is the root mean square over the components of the error divided by that. Over duals
/// only the state's own error counts, not that of its derivatives, so that a run with tangents takes
/// the same steps as one without. See [`WithTangents`] where that is not enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Relative tolerance.
    pub rtol: f64,
    /// Absolute tolerance, in the state's own units.
    pub atol: f64,
    /// The longest step, whatever the error: of a pulse that is shorter than a step nothing may be seen.
    pub max_step: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self::new(1e-9, 1e-12)
    }
}

impl Tolerance {
    /// With steps as long as the error allows.
    pub const fn new(rtol: f64, atol: f64) -> Self {
        Self { rtol, atol, max_step: f64::INFINITY }
    }

    /// The tolerance whose norm over `D` components equals this one's over the live components; `idle` of them rest
    /// and have no error.
    pub fn filled<const D: usize>(&self, idle: usize) -> Self {
        let factor = ((D - idle) as f64 / D as f64).sqrt();
        Self { rtol: self.rtol * factor, atol: self.atol * factor, ..*self }
    }

    /// The norm of `error`: 1 where it is just allowed.
    #[inline(always)]
    pub fn norm<R: Real, const D: usize>(&self, error: [R; D], before: [R; D], after: [R; D]) -> R {
        let mut sum = R::zero();
        unroll!(n in 0..D => {
            let size = before[n].abs().max(after[n].abs());
            let ratio = error[n] / (size.scale(self.rtol) + R::constant(self.atol));
            sum += ratio * ratio;
        });
        sum.scale(1.0 / D as f64).sqrt()
    }

    /// Returns true where the [norm](Tolerance::norm) of `error` is not below a limit, or no number. It is known to 0.3 %,
    /// without divisions.
    #[inline(always)]
    pub fn exceeds<R: Real, const D: usize>(
        &self,
        limit: f64,
        error: [R; D],
        before: [R; D],
        after: [R; D],
    ) -> R::Mask {
        let mut sum = R::zero();
        unroll!(n in 0..D => {
            let size = before[n].abs().max(after[n].abs());
            let allowed = size.scale(self.rtol) + R::constant(self.atol);
            sum += (error[n] * inverse_rough(allowed)).square();
        });
        sum.less(R::constant(limit * limit * D as f64)).not()
    }
}

impl<S: Scalar, const D: usize> ErrorNorm<S, D> for Tolerance {
    #[inline(always)]
    fn of_step(&self, error: &[S; D], before: &[S; D], after: &[S; D]) -> S::Real {
        let real = |x: &[S; D]| vector!(S::Real, D; n => x[n].real());
        self.norm(real(error), real(before), real(after))
    }

    /// The inverse of what is allowed in each component, to 0.3 %.
    type Weights = [S::Real; D];

    #[inline(always)]
    fn weights(&self, start: &[S; D]) -> [S::Real; D] {
        vector!(S::Real, D; n => {
            let allowed = start[n].real().abs().scale(self.rtol) + S::Real::constant(self.atol);
            inverse_rough(allowed)
        })
    }

    #[inline(always)]
    fn of_term(&self, term: &[S; D], weights: &[S::Real; D]) -> S::Real {
        let mut sum = S::Real::zero();
        unroll!(n in 0..D => { sum += (term[n].real() * weights[n]).square(); });
        sum.scale(1.0 / D as f64)
    }

    fn state(&self) -> &Tolerance {
        self
    }
}

/// The state's tolerance, and every tangent to the same relative tolerance of its length.
///
/// Where the state comes to rest its own error vanishes and no longer bounds the step size; the
/// tangents' still does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WithTangents(pub Tolerance);

impl<R: Real, const D: usize, const N: usize> ErrorNorm<Dual<R, N>, D> for WithTangents {
    #[inline(always)]
    fn of_step(&self, error: &[Dual<R, N>; D], before: &[Dual<R, N>; D], after: &[Dual<R, N>; D]) -> R {
        let mut worst = self.0.of_step(error, before, after);
        for i in 0..N {
            let allowed = square(before, i).max(square(after, i)).scale(self.0.rtol * self.0.rtol);
            let ratio = (square(error, i) / allowed).sqrt();
            // A tangent of no length has no error; what is not a number stays.
            worst = R::select(R::zero().less(allowed).and(ratio.less(worst).not()), ratio, worst);
        }
        worst
    }

    /// The state's, and the inverse square of what is allowed for each tangent; zero for one of no length.
    type Weights = ([R; D], [R; N]);

    #[inline(always)]
    fn weights(&self, start: &[Dual<R, N>; D]) -> ([R; D], [R; N]) {
        let tangents = vector!(R, N; i => {
            let allowed = square(start, i).scale(self.0.rtol * self.0.rtol);
            R::select(R::zero().less(allowed), inverse_rough(allowed), R::zero())
        });
        (self.0.weights(start), tangents)
    }

    #[inline(always)]
    fn of_term(&self, term: &[Dual<R, N>; D], weights: &([R; D], [R; N])) -> R {
        let mut worst = self.0.of_term(term, &weights.0);
        unroll!(i in 0..N => {
            let own = square(term, i) * weights.1[i];
            worst = R::select(own.less(worst), worst, own);
        });
        worst
    }

    fn state(&self) -> &Tolerance {
        &self.0
    }
}

/// The norm with tangents, or that of the state alone: runs by either share what is compiled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaybeTangents {
    pub tolerance: Tolerance,
    pub tangents: bool,
}

impl<R: Real, const D: usize, const N: usize> ErrorNorm<Dual<R, N>, D> for MaybeTangents {
    #[inline(always)]
    fn of_step(&self, error: &[Dual<R, N>; D], before: &[Dual<R, N>; D], after: &[Dual<R, N>; D]) -> R {
        match self.tangents {
            true => WithTangents(self.tolerance).of_step(error, before, after),
            false => self.tolerance.of_step(error, before, after),
        }
    }

    type Weights = ([R; D], [R; N]);

    #[inline(always)]
    fn weights(&self, start: &[Dual<R, N>; D]) -> ([R; D], [R; N]) {
        match self.tangents {
            true => WithTangents(self.tolerance).weights(start),
            false => (self.tolerance.weights(start), [R::zero(); N]),
        }
    }

    #[inline(always)]
    fn of_term(&self, term: &[Dual<R, N>; D], weights: &([R; D], [R; N])) -> R {
        match self.tangents {
            true => WithTangents(self.tolerance).of_term(term, weights),
            false => self.tolerance.of_term(term, &weights.0),
        }
    }

    fn state(&self) -> &Tolerance {
        &self.tolerance
    }
}

/// The square of the length of tangent `i`.
#[inline(always)]
fn square<R: Real, const D: usize, const N: usize>(x: &[Dual<R, N>; D], i: usize) -> R {
    let mut sum = R::zero();
    unroll!(n in 0..D => { sum += x[n].d[i] * x[n].d[i]; });
    sum
}
