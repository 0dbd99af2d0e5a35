//! What is integrated.
//!
//! A model is a right-hand side written once, generic over the [`Scalar`]: [`Dle`], [`Disk`],
//! [`Pendulum`]. If its law has a kink it names a surface, a smooth function of the state that is
//! zero there; the integrator freezes the side of each surface within a step, so that every step sees
//! a smooth law, and lands on the surface before it changes the side.

mod any;
mod disk;
mod dle;
pub mod effects;
mod either;
mod formula_model;
mod inputs;
mod lugre;
mod observation;
mod pendulum;
mod sliding_mode;
pub mod stick_slip;
mod surface_along;
mod targets;

pub use any::AnySystem;
pub use disk::{Disk, DiskFamily};
pub use dle::{Dle, DleFamily};
pub use effects::{Effect, FrictionModel, Momentum};
pub use either::Either;
pub use formula_model::{FormulaFamily, MAX_INPUTS, Own};
pub use inputs::{COEFFICIENTS as PIECE_COEFFICIENTS, Inputs, Piece, Signal, Signals};
pub use lugre::WithLuGre;
pub use observation::Observation;
pub use pendulum::{Pendulum, PendulumFamily};
pub use stick_slip::Sticking;
pub use targets::{MOST_PROBES, Probes, StepStart, TARGETS, Targets, WALL, surface_in_turn, suspects};

use crate::formula::StageWeights;
use crate::scalar::{Enclosed, Mask, Real, Scalar};
pub use crate::sides::{MAX_SURFACES, Sides, choose};

/// A system of `D` ordinary differential equations.
pub trait System<S: Scalar, const D: usize>: Sync {
    /// True if there is neither a switching surface nor a wall: what deals with them is then not compiled.
    const SMOOTH: bool = false;

    /// The right-hand side at time `t` and state `x`, each piecewise law continued smoothly from
    /// the given side of its surface.
    fn rates(&self, t: S, x: &[S; D], sides: &Sides<S>) -> [S; D];

    /// Computes the rates at all stages of a Runge-Kutta step but the first, which is given, by code that the law has for
    /// whole steps. Returns the new state, or nothing if there is no such code.
    #[inline(always)]
    fn staged(
        &self,
        _weights: &StageWeights,
        _from: (S::Real, &[S; D], S::Real),
        _sides: &Sides<S>,
        _stages: &mut [[S; D]],
    ) -> Option<[S; D]> {
        None
    }

    /// How many switching surfaces there are.
    fn surfaces(&self) -> usize {
        0
    }

    /// The function whose zero is surface `j`. It may use the sides of the surfaces before `j`.
    fn surface(&self, _j: usize, _t: S, _x: &[S; D], _sides: &Sides<S>) -> S {
        S::one()
    }

    /// Returns true if the function of surface `j` changes no faster than the state, as a linear one does: then a few places
    /// within a step show how it bends. The [enclosing](System::enclosing) law finds the zeros of all others.
    fn is_steady(&self, _j: usize, _sides: &Sides<S>) -> bool {
        true
    }

    /// The surfaces of this lane over intervals, where the law has them.
    fn enclosing(&self, _lane: usize) -> Option<Box<dyn EnclosedSurfaces<D> + '_>> {
        None
    }

    /// The components of the state that the surfaces and the wall depend on: only these are looked at within
    /// a step.
    fn watched(&self) -> [bool; D] {
        [true; D]
    }

    /// The name of the event in which the state reaches this side of surface `j`.
    fn surface_name(&self, _j: usize, _side: bool) -> &'static str {
        ""
    }

    /// Completes the sides of a state that lies exactly on a surface, where the law says more than the
    /// surface's sign.
    fn settle(&self, _t: S, _x: &[S; D], _sides: &mut Sides<S>) {}

    /// Passes surface `j`, on which the state lies, in the lanes `here`: changes its side and, where the
    /// law asks for it, other sides and the state (a contact that stops sticks).
    fn switch(&self, j: usize, _t: S, _x: &mut [S; D], sides: &mut Sides<S>, here: S::Mask) {
        sides[j] = choose(here, sides[j].not(), sides[j]);
    }

    /// Returns true if the rates or the state jump at surface `j`. Elsewhere the law is continuous.
    fn jumps(&self, _j: usize) -> bool {
        false
    }

    /// The boundary of the model's domain: positive inside, and the run ends where it becomes zero.
    fn wall(&self, _x: &[S; D]) -> Option<S> {
        None
    }

    /// The surface that only time passes, where the law has measured [inputs](Inputs): one behind the
    /// [others](System::surfaces). Runs do not look for it; they stop at its [knots](System::next_knot).
    fn clock(&self) -> Option<usize> {
        None
    }

    /// The next time in the direction of `end`, and not beyond it, at which the clock's surface is passed.
    fn next_knot(&self, _t: S::Real, _sides: &Sides<S>, _end: S::Real) -> Option<f64> {
        None
    }

    /// The side of the clock's surface on which a run lies that starts here, forwards or backwards.
    fn clock_side(&self, _t: S::Real, _forwards: bool) -> bool {
        true
    }

    /// The polynomial that input `k` is at this time.
    fn input(&self, _k: usize, _t: S::Real, _sides: &Sides<S>) -> Piece<S> {
        Piece { origin: S::zero(), coefficients: [0.0; PIECE_COEFFICIENTS] }
    }

    /// The function of surface `j` at these places of a step, on the sides of the step's start.
    #[inline(always)]
    fn surface_along(
        &self,
        j: usize,
        at: &StepStart<S, D>,
        probes: &Probes<'_, S::Real, D>,
    ) -> [S::Real; MOST_PROBES] {
        surface_in_turn(self, j, at, probes)
    }
}

impl<S: Scalar, const D: usize, M: System<S, D>> System<S, D> for &M {
    const SMOOTH: bool = M::SMOOTH;

    #[inline(always)]
    fn rates(&self, t: S, x: &[S; D], sides: &Sides<S>) -> [S; D] {
        (**self).rates(t, x, sides)
    }
    #[inline(always)]
    fn staged(
        &self,
        weights: &StageWeights,
        from: (S::Real, &[S; D], S::Real),
        sides: &Sides<S>,
        stages: &mut [[S; D]],
    ) -> Option<[S; D]> {
        (**self).staged(weights, from, sides, stages)
    }
    #[inline(always)]
    fn surfaces(&self) -> usize {
        (**self).surfaces()
    }
    #[inline(always)]
    fn surface(&self, j: usize, t: S, x: &[S; D], sides: &Sides<S>) -> S {
        (**self).surface(j, t, x, sides)
    }
    #[inline(always)]
    fn is_steady(&self, j: usize, sides: &Sides<S>) -> bool {
        (**self).is_steady(j, sides)
    }
    fn enclosing(&self, lane: usize) -> Option<Box<dyn EnclosedSurfaces<D> + '_>> {
        (**self).enclosing(lane)
    }
    #[inline(always)]
    fn watched(&self) -> [bool; D] {
        (**self).watched()
    }
    fn surface_name(&self, j: usize, side: bool) -> &'static str {
        (**self).surface_name(j, side)
    }
    #[inline(always)]
    fn settle(&self, t: S, x: &[S; D], sides: &mut Sides<S>) {
        (**self).settle(t, x, sides);
    }
    #[inline(always)]
    fn switch(&self, j: usize, t: S, x: &mut [S; D], sides: &mut Sides<S>, here: S::Mask) {
        (**self).switch(j, t, x, sides, here);
    }
    #[inline(always)]
    fn jumps(&self, j: usize) -> bool {
        (**self).jumps(j)
    }
    #[inline(always)]
    fn wall(&self, x: &[S; D]) -> Option<S> {
        (**self).wall(x)
    }
    #[inline(always)]
    fn clock(&self) -> Option<usize> {
        (**self).clock()
    }
    fn next_knot(&self, t: S::Real, sides: &Sides<S>, end: S::Real) -> Option<f64> {
        (**self).next_knot(t, sides, end)
    }
    fn clock_side(&self, t: S::Real, forwards: bool) -> bool {
        (**self).clock_side(t, forwards)
    }
    fn input(&self, k: usize, t: S::Real, sides: &Sides<S>) -> Piece<S> {
        (**self).input(k, t, sides)
    }
    #[inline(always)]
    fn surface_along(
        &self,
        j: usize,
        at: &StepStart<S, D>,
        probes: &Probes<'_, S::Real, D>,
    ) -> [S::Real; MOST_PROBES] {
        (**self).surface_along(j, at, probes)
    }
}

/// The surfaces of a law over a stretch of time and state.
pub trait EnclosedSurfaces<const D: usize> {
    /// All values and slopes of the function of surface `j`.
    fn enclosed_surface(&self, j: usize, t: Enclosed, x: &[Enclosed; D], sides: &Sides<Enclosed>)
    -> Enclosed;
    /// Those of the wall.
    fn enclosed_wall(&self, x: &[Enclosed; D]) -> Option<Enclosed>;
}

impl<M: System<Enclosed, D>, const D: usize> EnclosedSurfaces<D> for M {
    fn enclosed_surface(
        &self,
        j: usize,
        t: Enclosed,
        x: &[Enclosed; D],
        sides: &Sides<Enclosed>,
    ) -> Enclosed {
        System::surface(self, j, t, x, sides)
    }
    fn enclosed_wall(&self, x: &[Enclosed; D]) -> Option<Enclosed> {
        System::wall(self, x)
    }
}

/// A number of a law as one without a spread.
fn enclosed<S: Scalar>(number: S, lane: usize) -> Enclosed {
    Enclosed::constant(number.real().lane(lane))
}

/// The sides on which a state lies, by the sign of each surface's function.
#[inline(always)]
pub fn sides_of<S: Scalar, const D: usize>(system: &impl System<S, D>, t: S, x: &[S; D]) -> Sides<S> {
    let mut sides = [S::mask(true); MAX_SURFACES];
    for j in 0..system.surfaces() {
        let value = system.surface(j, t, x, &sides);
        sides[j] = S::zero().less(value);
    }
    if let Some(clock) = system.clock() {
        sides[clock] = S::mask(system.clock_side(t.real(), true));
    }
    system.settle(t, x, &mut sides);
    sides
}

/// A parameter of a model or an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its name; an effect's parameter is called `effect.name`.
    pub name: String,
    /// SI unit; empty where dimensionless.
    pub unit: &'static str,
}

/// A model with its numbers left open, so that the same structure can be built over plain numbers
/// and over duals that differentiate with respect to any of its parameters.
pub trait Family<const D: usize>: Clone + PartialEq + Send + Sync {
    /// The system it builds.
    type Built<S: Scalar>: System<S, D>;

    /// True if its rates are compiled for packets, which methods without series need: worth it for a short law only.
    const PACKETS: bool = false;

    /// Returns true if many runs can go in packets, one in each lane: the law is smooth and has no wall. Others run one by
    /// one, with the same bits.
    fn goes_in_packets(&self) -> bool {
        false
    }

    /// How many states at the end only fill up the number that the analysis is compiled for: they rest, and nothing
    /// depends on them.
    fn idle(&self) -> usize {
        0
    }

    /// A number that all families with the same law, and no others, have; none if the law is compiled.
    fn law(&self) -> Option<u64> {
        None
    }

    /// The parameters, in the order in which [`Family::build`] takes their values.
    fn parameters(&self) -> Vec<Parameter>;

    /// The system with these parameter values; one with measured inputs feels those of the record that it is of.
    fn build<S: Scalar>(&self, values: &[S]) -> Self::Built<S>;

    /// The rates at a single place of a system that it built, by the law's own words if it jumps there.
    fn rates_at(&self, _values: &[f64], system: &Self::Built<f64>, t: f64, x: &[f64; D]) -> [f64; D] {
        System::<f64, D>::rates(system, t, x, &sides_of(system, t, x))
    }

    /// The same with the measured inputs of this record.
    fn build_for<S: Scalar>(&self, _record: usize, values: &[S]) -> Self::Built<S> {
        self.build(values)
    }

    /// How many measured inputs there are.
    fn inputs(&self) -> usize {
        0
    }

    /// Returns true if it has inputs of which nothing was measured.
    fn is_open(&self) -> bool {
        false
    }

    /// The system with these values of its inputs, which do not change in time.
    fn build_at<S: Scalar>(&self, values: &[S], _inputs: Vec<S>) -> Self::Built<S> {
        self.build(values)
    }
}

pub(crate) fn parameter(name: &str, unit: &'static str) -> Parameter {
    Parameter { name: name.to_owned(), unit }
}
