//! One of two models of the same dimension.

use super::{EnclosedSurfaces, Family, MOST_PROBES, Parameter, Piece, Probes, Sides, StepStart, System};
use crate::formula::StageWeights;
use crate::scalar::Scalar;

/// A model of one kind or of another, distinguished at run time.
///
/// Code over models is compiled once for each: two models that share an `Either` share the code.
#[derive(Clone, Debug, PartialEq)]
pub enum Either<A, B> {
    First(A),
    Second(B),
}

/// Asks the one that there is.
macro_rules! ask {
    ($either:expr, $model:ident => $answer:expr) => {
        match $either {
            Either::First($model) => $answer,
            Either::Second($model) => $answer,
        }
    };
}

impl<A, B, S, const D: usize> System<S, D> for Either<A, B>
where
    S: Scalar,
    A: System<S, D>,
    B: System<S, D>,
{
    const SMOOTH: bool = A::SMOOTH && B::SMOOTH;

    #[inline(always)]
    fn rates(&self, t: S, x: &[S; D], sides: &Sides<S>) -> [S; D] {
        ask!(self, model => model.rates(t, x, sides))
    }
    #[inline(always)]
    fn staged(
        &self,
        weights: &StageWeights,
        from: (S::Real, &[S; D], S::Real),
        sides: &Sides<S>,
        stages: &mut [[S; D]],
    ) -> Option<[S; D]> {
        ask!(self, model => model.staged(weights, from, sides, stages))
    }
    #[inline(always)]
    fn surfaces(&self) -> usize {
        ask!(self, model => model.surfaces())
    }
    #[inline(always)]
    fn surface(&self, j: usize, t: S, x: &[S; D], sides: &Sides<S>) -> S {
        ask!(self, model => model.surface(j, t, x, sides))
    }
    #[inline(always)]
    fn is_steady(&self, j: usize, sides: &Sides<S>) -> bool {
        ask!(self, model => model.is_steady(j, sides))
    }
    fn enclosing(&self, lane: usize) -> Option<Box<dyn EnclosedSurfaces<D> + '_>> {
        ask!(self, model => model.enclosing(lane))
    }
    #[inline(always)]
    fn watched(&self) -> [bool; D] {
        ask!(self, model => model.watched())
    }
    fn surface_name(&self, j: usize, side: bool) -> &'static str {
        ask!(self, model => model.surface_name(j, side))
    }
    #[inline(always)]
    fn settle(&self, t: S, x: &[S; D], sides: &mut Sides<S>) {
        ask!(self, model => model.settle(t, x, sides));
    }
    #[inline(always)]
    fn switch(&self, j: usize, t: S, x: &mut [S; D], sides: &mut Sides<S>, here: S::Mask) {
        ask!(self, model => model.switch(j, t, x, sides, here));
    }
    #[inline(always)]
    fn jumps(&self, j: usize) -> bool {
        ask!(self, model => model.jumps(j))
    }
    #[inline(always)]
    fn wall(&self, x: &[S; D]) -> Option<S> {
        ask!(self, model => model.wall(x))
    }
    #[inline(always)]
    fn clock(&self) -> Option<usize> {
        ask!(self, model => model.clock())
    }
    fn next_knot(&self, t: S::Real, sides: &Sides<S>, end: S::Real) -> Option<f64> {
        ask!(self, model => model.next_knot(t, sides, end))
    }
    fn clock_side(&self, t: S::Real, forwards: bool) -> bool {
        ask!(self, model => model.clock_side(t, forwards))
    }
    fn input(&self, k: usize, t: S::Real, sides: &Sides<S>) -> Piece<S> {
        ask!(self, model => model.input(k, t, sides))
    }
    #[inline(always)]
    fn surface_along(
        &self,
        j: usize,
        at: &StepStart<S, D>,
        probes: &Probes<'_, S::Real, D>,
    ) -> [S::Real; MOST_PROBES] {
        ask!(self, model => model.surface_along(j, at, probes))
    }
}

impl<A: Family<D>, B: Family<D>, const D: usize> Family<D> for Either<A, B> {
    type Built<S: Scalar> = Either<A::Built<S>, B::Built<S>>;

    // The gain of packets for one of them does not pay for compiling the other.
    const PACKETS: bool = A::PACKETS && B::PACKETS;

    fn goes_in_packets(&self) -> bool {
        ask!(self, family => family.goes_in_packets())
    }

    fn law(&self) -> Option<u64> {
        ask!(self, family => family.law())
    }

    fn idle(&self) -> usize {
        ask!(self, family => family.idle())
    }

    fn parameters(&self) -> Vec<Parameter> {
        ask!(self, family => family.parameters())
    }

    #[inline]
    fn build<S: Scalar>(&self, values: &[S]) -> Either<A::Built<S>, B::Built<S>> {
        match self {
            Either::First(family) => Either::First(family.build(values)),
            Either::Second(family) => Either::Second(family.build(values)),
        }
    }

    fn rates_at(&self, values: &[f64], system: &Self::Built<f64>, t: f64, x: &[f64; D]) -> [f64; D] {
        match (self, system) {
            (Either::First(family), Either::First(system)) => family.rates_at(values, system, t, x),
            (Either::Second(family), Either::Second(system)) => family.rates_at(values, system, t, x),
            _ => unreachable!("a system of the other family"),
        }
    }

    fn build_for<S: Scalar>(&self, record: usize, values: &[S]) -> Either<A::Built<S>, B::Built<S>> {
        match self {
            Either::First(family) => Either::First(family.build_for(record, values)),
            Either::Second(family) => Either::Second(family.build_for(record, values)),
        }
    }

    fn inputs(&self) -> usize {
        ask!(self, family => family.inputs())
    }

    fn is_open(&self) -> bool {
        ask!(self, family => family.is_open())
    }

    fn build_at<S: Scalar>(&self, values: &[S], inputs: Vec<S>) -> Either<A::Built<S>, B::Built<S>> {
        match self {
            Either::First(family) => Either::First(family.build_at(values, inputs)),
            Either::Second(family) => Either::Second(family.build_at(values, inputs)),
        }
    }
}
