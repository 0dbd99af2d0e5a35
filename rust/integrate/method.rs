//! The interface of a one-step method to the stepping loop.

use crate::model::{AnySystem, MOST_PROBES, StepStart, System};
use crate::scalar::{Scalar, vector};
use crate::tolerance::ErrorNorm;

/// The parts of a step that are examined: more of them in a long step, as of a high order.
pub(super) const QUARTERS: &[f64] = &[0.25, 0.5, 0.75, 1.0];
pub(super) const EIGHTHS: &[f64] = &[0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0];

/// The result of a trial step.
#[derive(Clone, Copy, Debug)]
pub struct Trial<S: Scalar, const D: usize> {
    /// The new state.
    pub x: [S; D],
    /// The step's size: the one asked for, or less where the method itself knows that it is too long.
    pub size: S::Real,
    /// The norm of the step's error: 1 where it is just allowed.
    pub error: S::Real,
}

/// A one-step method over lanes; it keeps what it needs from one step to the next.
pub trait Method<S: Scalar, const D: usize> {
    /// The order of the solution that is carried on.
    const ORDER: i32;
    /// Evaluations of the rates in a trial.
    const EVALUATIONS: usize;
    /// True if the polynomial is as accurate as the new state, so that a step can end anywhere on it.
    const SERIES: bool;
    /// The parts of a step at which switching surfaces are evaluated, so that one crossed twice is noticed, too.
    const PROBES: &'static [f64];

    /// How large a negative eigenvalue of the law may be, times a step's size, before the steps become unstable.
    fn stable(&self) -> f64 {
        f64::INFINITY
    }

    /// Takes over changed values of the system's parameters, where it works with them itself.
    fn set_parameters(&mut self, _values: &[S]) {}

    /// Gets ready to step from `at`, in these lanes; the others keep what they have.
    fn begin(&mut self, system: &impl System<S, D>, at: &StepStart<S, D>, lanes: S::Mask);

    /// Tries a step of size `h`.
    fn attempt(
        &mut self,
        system: &impl System<S, D>,
        at: &StepStart<S, D>,
        h: S::Real,
        norm: &impl ErrorNorm<S, D>,
    ) -> Trial<S, D>;

    /// Completes the polynomial of the last trial.
    fn extend(&mut self, system: &impl System<S, D>, at: &StepStart<S, D>);

    /// Goes on from the end of the last trial, in these lanes.
    fn begin_next(&mut self, lanes: S::Mask);

    /// The state at `dt` after the start of the last trial, on its polynomial.
    fn at(&self, dt: S::Real) -> [S; D];

    /// The same without derivatives, of at least these components.
    #[inline(always)]
    fn real_at(&self, dt: S::Real, _of: &[bool; D]) -> [S::Real; D] {
        let x = self.at(dt);
        vector!(S::Real, D; n => x[n].real())
    }

    /// The same at these parts of `h`, of which there are at most [`MOST_PROBES`].
    #[inline(always)]
    fn along(&self, h: S::Real, parts: &[f64], of: &[bool; D]) -> [[S::Real; D]; MOST_PROBES] {
        let mut states = [[S::Real::zero(); D]; MOST_PROBES];
        for i in 0..parts.len() {
            states[i] = self.real_at(h.scale(parts[i]), of);
        }
        states
    }

    /// The coefficients of one component's polynomial over the time since the step's start, lowest first,
    /// where the method has them at hand.
    #[inline(always)]
    fn component(&self, _n: usize) -> Option<&[S]> {
        None
    }

    /// The same polynomial's unit of time and its coefficients, lowest first: `x = Σ_k c_k (dt/unit)^k`.
    fn polynomial(&self, coefficients: &mut Vec<[S; D]>) -> S::Real;
}

/// The part of a [`Method`] that landing needs, whatever its type. See the methods of the same names.
pub(super) trait Course<S: Scalar, const D: usize> {
    fn begin(&mut self, law: &dyn AnySystem<S, D>, at: &StepStart<S, D>, lanes: S::Mask);
    fn begin_next(&mut self, lanes: S::Mask);
    fn at(&self, dt: S::Real) -> [S; D];
    fn real_at(&self, dt: S::Real, of: &[bool; D]) -> [S::Real; D];
    fn probes(&self) -> &'static [f64];
    fn series(&self) -> bool;
    fn polynomial(&self, coefficients: &mut Vec<[S; D]>) -> S::Real;
}

impl<S: Scalar, const D: usize, K: Method<S, D>> Course<S, D> for K {
    fn begin(&mut self, law: &dyn AnySystem<S, D>, at: &StepStart<S, D>, lanes: S::Mask) {
        Method::begin(self, &law, at, lanes);
    }
    fn begin_next(&mut self, lanes: S::Mask) {
        Method::begin_next(self, lanes);
    }
    fn at(&self, dt: S::Real) -> [S; D] {
        Method::at(self, dt)
    }
    fn real_at(&self, dt: S::Real, of: &[bool; D]) -> [S::Real; D] {
        Method::real_at(self, dt, of)
    }
    fn probes(&self) -> &'static [f64] {
        K::PROBES
    }
    fn series(&self) -> bool {
        K::SERIES
    }
    fn polynomial(&self, coefficients: &mut Vec<[S; D]>) -> S::Real {
        Method::polynomial(self, coefficients)
    }
}
