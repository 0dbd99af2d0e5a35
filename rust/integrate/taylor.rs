//! The Taylor method.

use super::method::{Method, Point, Trial};
use super::tolerance::ErrorNorm;
use crate::model::System;
use crate::scalar::{Mask, Real, Scalar};
use crate::tape::{Jets, Tape};
use crate::unroll::vector;

/// The order of the method, whatever the tolerance: [`Taylor`] has the coefficients 0 to `ORDER`.
pub const ORDER: usize = 18;
const COEFFICIENTS: usize = ORDER + 1;

/// The Taylor series of the solution, from the model's [tape](crate::tape).
///
/// A step is as long as the series' last terms allow, so none is rejected for its error; its polynomial
/// is as accurate as its end. Tangents share the state's radius of convergence and so its steps.
#[derive(Clone, Debug)]
pub struct Taylor<'a, S, const D: usize> {
    tape: &'a Tape<D>,
    parameters: Vec<S>,
    jets: Jets<S, D, COEFFICIENTS>,
}

impl<'a, S: Scalar, const D: usize> Taylor<'a, S, D> {
    /// For the system with this tape and these parameters.
    pub fn new(tape: &'a Tape<D>, parameters: Vec<S>) -> Self {
        Self { tape, parameters, jets: Jets::new(tape) }
    }
}

impl<S: Scalar, const D: usize> Method<S, D> for Taylor<'_, S, D> {
    const ORDER: i32 = ORDER as i32;
    const EVALUATIONS: usize = 1;
    const SERIES: bool = true;
    const PROBES: &'static [f64] = &[0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0];

    fn set_parameters(&mut self, values: &[S]) {
        self.parameters.copy_from_slice(values);
    }

    #[inline(always)]
    fn begin(&mut self, _system: &impl System<S, D>, _at: &Point<S, D>, _lanes: S::Mask) {}

    #[inline(always)]
    fn attempt(
        &mut self,
        _system: &impl System<S, D>,
        at: &Point<S, D>,
        h: S::Real,
        norm: &impl ErrorNorm<S, D>,
    ) -> Trial<S, D> {
        self.jets.expand(self.tape, &self.parameters, S::lift(at.t), &at.x, &at.sides);
        let tolerance = norm.state();
        let radius = self.jets.radius(tolerance.rtol, tolerance.atol);
        let short = radius.less(h.abs());
        let size = S::Real::select(short, radius.zip(h, f64::copysign), h);
        // A radius that is not a number fails; an infinite one is that of a polynomial.
        let known = radius.less(S::Real::constant(f64::INFINITY)).or(S::Real::zero().less(radius));
        let error = S::Real::select(known, S::Real::zero(), S::Real::constant(f64::NAN));
        Trial { x: self.jets.at(size), size, error }
    }

    fn extend(&mut self, _system: &impl System<S, D>, _at: &Point<S, D>) {}

    #[inline(always)]
    fn accept(&mut self, _lanes: S::Mask) {}

    #[inline(always)]
    fn at(&self, dt: S::Real) -> [S; D] {
        self.jets.at(dt)
    }

    fn polynomial(&self, coefficients: &mut Vec<[S; D]>) -> S::Real {
        let series = self.jets.coefficients();
        coefficients.extend((0..COEFFICIENTS).map(|k| vector!(S, D; n => series[n][k])));
        S::Real::one()
    }
}
