//! The Taylor method.

use super::method::{Method, Point, Trial};
use super::tolerance::ErrorNorm;
use crate::model::System;
use crate::scalar::{Isa, Mask, Real, Scalar, Work};
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
    /// For the system with this tape and these parameters; the series is computed with these instructions.
    pub fn new(tape: &'a Tape<D>, parameters: Vec<S>, isa: Isa) -> Self {
        Self { tape, parameters, jets: Jets::new(tape, isa) }
    }

    /// How far the series may be followed: its last two terms are then as small as allowed.
    #[inline(always)]
    fn radius<E: ErrorNorm<S, D>>(&self, norm: &E) -> S::Real {
        let tolerance = norm.state();
        if !E::TANGENTS {
            return self.jets.radius(tolerance.rtol, tolerance.atol);
        }
        let series = self.jets.coefficients();
        let term = |k: usize| vector!(S, D; n => series[n][k]);
        let start = term(0);
        let reach = |k: usize| norm.of_step(&term(k), &start, &start).ln().scale(-1.0 / k as f64);
        reach(ORDER).min(reach(ORDER - 1)).exp()
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

    fn attempt(
        &mut self,
        _system: &impl System<S, D>,
        at: &Point<S, D>,
        h: S::Real,
        norm: &impl ErrorNorm<S, D>,
    ) -> Trial<S, D> {
        self.jets.isa().run(Attempt { method: self, at, h, norm })
    }

    fn extend(&mut self, _system: &impl System<S, D>, _at: &Point<S, D>) {}

    #[inline(always)]
    fn accept(&mut self, _lanes: S::Mask) {}

    fn at(&self, dt: S::Real) -> [S; D] {
        self.jets.at(dt)
    }

    fn real_at(&self, dt: S::Real) -> [S::Real; D] {
        self.jets.real_at(dt)
    }

    #[inline(always)]
    fn component(&self, n: usize) -> Option<&[S]> {
        Some(&self.jets.coefficients()[n])
    }

    fn polynomial(&self, coefficients: &mut Vec<[S; D]>) -> S::Real {
        let series = self.jets.coefficients();
        coefficients.extend((0..COEFFICIENTS).map(|k| vector!(S, D; n => series[n][k])));
        S::Real::one()
    }
}

/// A step, compiled once for each instruction set.
struct Attempt<'a, 'b, S: Scalar, const D: usize, E> {
    method: &'a mut Taylor<'b, S, D>,
    at: &'a Point<S, D>,
    h: S::Real,
    norm: &'a E,
}

impl<S: Scalar, const D: usize, E: ErrorNorm<S, D>> Work for Attempt<'_, '_, S, D, E> {
    type Output = Trial<S, D>;

    #[inline(always)]
    fn run<const L: usize>(self) -> Trial<S, D> {
        let Self { method, at, h, norm } = self;
        method.jets.expand_here(method.tape, &method.parameters, S::lift(at.t), &at.x, &at.sides);
        let radius = method.radius(norm);
        let short = radius.less(h.abs());
        let size = S::Real::select(short, radius.zip(h, f64::copysign), h);
        // A radius that is not a number fails; an infinite one is that of a polynomial.
        let known = radius.less(S::Real::constant(f64::INFINITY)).or(S::Real::zero().less(radius));
        let error = S::Real::select(known, S::Real::zero(), S::Real::constant(f64::NAN));
        Trial { x: method.jets.at_here(size), size, error }
    }
}
