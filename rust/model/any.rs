//! A system whose type is forgotten.

use super::{EnclosedSurfaces, MOST_PROBES, Piece, Probes, Sides, StepStart, System};
use crate::formula::StageWeights;
use crate::scalar::Scalar;

/// Any [`System`]. Code that runs rarely is compiled for a `dyn AnySystem`: once for each kind of number instead of
/// once for each model.
pub trait AnySystem<S: Scalar, const D: usize>: Sync {
    /// See the methods of the same names of [`System`].
    fn rates(&self, t: S, x: &[S; D], sides: &Sides<S>) -> [S; D];
    fn staged(
        &self,
        weights: &StageWeights,
        from: (S::Real, &[S; D], S::Real),
        sides: &Sides<S>,
        stages: &mut [[S; D]],
    ) -> Option<[S; D]>;
    fn surfaces(&self) -> usize;
    fn surface(&self, j: usize, t: S, x: &[S; D], sides: &Sides<S>) -> S;
    fn is_steady(&self, j: usize, sides: &Sides<S>) -> bool;
    fn enclosing(&self, lane: usize) -> Option<Box<dyn EnclosedSurfaces<D> + '_>>;
    fn watched(&self) -> [bool; D];
    fn surface_name(&self, j: usize, side: bool) -> &'static str;
    fn settle(&self, t: S, x: &[S; D], sides: &mut Sides<S>);
    fn switch(&self, j: usize, t: S, x: &mut [S; D], sides: &mut Sides<S>, here: S::Mask);
    fn jumps(&self, j: usize) -> bool;
    fn wall(&self, x: &[S; D]) -> Option<S>;
    fn clock(&self) -> Option<usize>;
    fn next_knot(&self, t: S::Real, sides: &Sides<S>, end: S::Real) -> Option<f64>;
    fn clock_side(&self, t: S::Real, forwards: bool) -> bool;
    fn input(&self, k: usize, t: S::Real, sides: &Sides<S>) -> Piece<S>;
    fn surface_along(
        &self,
        j: usize,
        at: &StepStart<S, D>,
        probes: &Probes<'_, S::Real, D>,
    ) -> [S::Real; MOST_PROBES];
}

impl<S: Scalar, const D: usize, M: System<S, D>> AnySystem<S, D> for M {
    fn rates(&self, t: S, x: &[S; D], sides: &Sides<S>) -> [S; D] {
        System::rates(self, t, x, sides)
    }
    fn staged(
        &self,
        weights: &StageWeights,
        from: (S::Real, &[S; D], S::Real),
        sides: &Sides<S>,
        stages: &mut [[S; D]],
    ) -> Option<[S; D]> {
        System::staged(self, weights, from, sides, stages)
    }
    fn surfaces(&self) -> usize {
        System::surfaces(self)
    }
    fn surface(&self, j: usize, t: S, x: &[S; D], sides: &Sides<S>) -> S {
        System::surface(self, j, t, x, sides)
    }
    fn is_steady(&self, j: usize, sides: &Sides<S>) -> bool {
        System::is_steady(self, j, sides)
    }
    fn enclosing(&self, lane: usize) -> Option<Box<dyn EnclosedSurfaces<D> + '_>> {
        System::enclosing(self, lane)
    }
    fn watched(&self) -> [bool; D] {
        System::watched(self)
    }
    fn surface_name(&self, j: usize, side: bool) -> &'static str {
        System::surface_name(self, j, side)
    }
    fn settle(&self, t: S, x: &[S; D], sides: &mut Sides<S>) {
        System::settle(self, t, x, sides);
    }
    fn switch(&self, j: usize, t: S, x: &mut [S; D], sides: &mut Sides<S>, here: S::Mask) {
        System::switch(self, j, t, x, sides, here);
    }
    fn jumps(&self, j: usize) -> bool {
        System::jumps(self, j)
    }
    fn wall(&self, x: &[S; D]) -> Option<S> {
        System::wall(self, x)
    }
    fn clock(&self) -> Option<usize> {
        System::clock(self)
    }
    fn next_knot(&self, t: S::Real, sides: &Sides<S>, end: S::Real) -> Option<f64> {
        System::next_knot(self, t, sides, end)
    }
    fn clock_side(&self, t: S::Real, forwards: bool) -> bool {
        System::clock_side(self, t, forwards)
    }
    fn input(&self, k: usize, t: S::Real, sides: &Sides<S>) -> Piece<S> {
        System::input(self, k, t, sides)
    }
    fn surface_along(
        &self,
        j: usize,
        at: &StepStart<S, D>,
        probes: &Probes<'_, S::Real, D>,
    ) -> [S::Real; MOST_PROBES] {
        System::surface_along(self, j, at, probes)
    }
}

impl<S: Scalar, const D: usize> System<S, D> for &dyn AnySystem<S, D> {
    fn rates(&self, t: S, x: &[S; D], sides: &Sides<S>) -> [S; D] {
        AnySystem::rates(&**self, t, x, sides)
    }
    fn staged(
        &self,
        weights: &StageWeights,
        from: (S::Real, &[S; D], S::Real),
        sides: &Sides<S>,
        stages: &mut [[S; D]],
    ) -> Option<[S; D]> {
        AnySystem::staged(&**self, weights, from, sides, stages)
    }
    fn surfaces(&self) -> usize {
        AnySystem::surfaces(&**self)
    }
    fn surface(&self, j: usize, t: S, x: &[S; D], sides: &Sides<S>) -> S {
        AnySystem::surface(&**self, j, t, x, sides)
    }
    fn is_steady(&self, j: usize, sides: &Sides<S>) -> bool {
        AnySystem::is_steady(&**self, j, sides)
    }
    fn enclosing(&self, lane: usize) -> Option<Box<dyn EnclosedSurfaces<D> + '_>> {
        AnySystem::enclosing(&**self, lane)
    }
    fn watched(&self) -> [bool; D] {
        AnySystem::watched(&**self)
    }
    fn surface_name(&self, j: usize, side: bool) -> &'static str {
        AnySystem::surface_name(&**self, j, side)
    }
    fn settle(&self, t: S, x: &[S; D], sides: &mut Sides<S>) {
        AnySystem::settle(&**self, t, x, sides);
    }
    fn switch(&self, j: usize, t: S, x: &mut [S; D], sides: &mut Sides<S>, here: S::Mask) {
        AnySystem::switch(&**self, j, t, x, sides, here);
    }
    fn jumps(&self, j: usize) -> bool {
        AnySystem::jumps(&**self, j)
    }
    fn wall(&self, x: &[S; D]) -> Option<S> {
        AnySystem::wall(&**self, x)
    }
    fn clock(&self) -> Option<usize> {
        AnySystem::clock(&**self)
    }
    fn next_knot(&self, t: S::Real, sides: &Sides<S>, end: S::Real) -> Option<f64> {
        AnySystem::next_knot(&**self, t, sides, end)
    }
    fn clock_side(&self, t: S::Real, forwards: bool) -> bool {
        AnySystem::clock_side(&**self, t, forwards)
    }
    fn input(&self, k: usize, t: S::Real, sides: &Sides<S>) -> Piece<S> {
        AnySystem::input(&**self, k, t, sides)
    }
    fn surface_along(
        &self,
        j: usize,
        at: &StepStart<S, D>,
        probes: &Probes<'_, S::Real, D>,
    ) -> [S::Real; MOST_PROBES] {
        AnySystem::surface_along(&**self, j, at, probes)
    }
}
