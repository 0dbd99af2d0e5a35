//! A model recorded once, as a list of operations, and its power series.
//!
//! A model's rates are evaluated once over [symbols](Symbol), which gives a [`Tape`]. The tape yields
//! what repeated evaluation of the rates cannot: the Taylor coefficients of the solution, order by
//! order ([`Jets`]), over any [`Scalar`]: one trajectory, a packet, tangents, packets of tangents.

mod compile;
mod disk_series;
mod dle_series;
mod fuse;
mod group;
mod jet;
mod node;
mod record;
mod series;
mod specialised;
mod step_radius;
mod symbol;

pub use jet::{HIGH, Jets, LOW};
pub use node::{Invariant, Node, Step};
pub use record::Unrecordable;
pub use symbol::{Function, SurfaceSideRef, Symbol};

use crate::failure::Failure;
use crate::model::Sides;
use crate::scalar::Scalar;

/// The operations that give the rates of a system of `D` equations.
///
/// ```
/// use udd::model::{DleFamily, MAX_SURFACES};
/// use udd::tape::Tape;
/// // Without damping, B = 0: two products.
/// let tape = Tape::record(&DleFamily, &[None, Some(0.0)]).unwrap();
/// let x = [1.0, 2.0, 3.0];
/// assert_eq!(tape.rates(&[7.1, 0.0], 0.0, &x, &[true; MAX_SURFACES]), [1.0, 3.0, 5.1]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Tape<const D: usize> {
    /// Values that do not change along a solution, each made of earlier ones.
    pub(crate) held: Vec<Invariant>,
    /// The values that change along a solution; a step uses the results of earlier steps.
    pub(crate) steps: Vec<Step>,
    /// The slots of the rates.
    pub(crate) rates: [u16; D],
    /// How many series there are; the first `D` are the state.
    pub(crate) slots: usize,
    /// The steps as they are interpreted.
    program: fuse::Program,
    known: specialised::Specialised,
    levels_off: bool,
    in_pieces: bool,
    switches_held: bool,
    driven: bool,
}

impl<const D: usize> Tape<D> {
    /// The values that change along a solution, in the order of evaluation.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The same, but each step of its series is interpreted by itself: for comparisons, no bit changes.
    pub fn unfused(&self) -> Self {
        let program = fuse::Program::of(&self.steps, &self.rates, self.slots, false);
        Self { program, ..self.clone() }
    }

    /// Returns true if the law can level off so far that the terms of its series vanish, as exp and tanh do.
    #[inline(always)]
    pub fn levels_off(&self) -> bool {
        self.levels_off
    }

    /// Returns true if the law has splines: then a series is that of one of their cells.
    #[inline(always)]
    pub fn is_in_pieces(&self) -> bool {
        self.in_pieces
    }

    /// Returns true if [held](Tape::held) values depend on the sides of surfaces.
    #[inline(always)]
    pub fn switches_held(&self) -> bool {
        self.switches_held
    }

    /// Returns true if the law has measured inputs, whose [pieces](Jets::set_inputs) a step has to know.
    #[inline(always)]
    pub fn is_driven(&self) -> bool {
        self.driven
    }

    /// Returns true if its series are computed by a program of their own.
    pub fn is_unrolled(&self) -> bool {
        self.known != specialised::Specialised::Not
    }

    /// Returns true if a method that needs no power series may do better after one along this tape failed.
    ///
    /// The laws whose series are written out have no poles: where these overflow, steps of any method are too
    /// short for the run ever to end.
    pub fn hands_over(&self, failure: &Failure) -> bool {
        !self.is_unrolled() && failure.is_of_series()
    }

    /// The values that do not change along a solution, in the order of evaluation.
    pub fn held(&self) -> &[Invariant] {
        &self.held
    }

    /// The rates at time `t` and state `x`, with these values of the parameters.
    ///
    /// # Panics
    /// Where there are fewer parameters than the model has.
    #[inline(always)]
    pub fn rates<S: Scalar>(&self, parameters: &[S], t: S, x: &[S; D], sides: &Sides<S>) -> [S; D] {
        let mut held = vec![S::zero(); self.held.len()];
        node::hold(&self.held, parameters, sides, &mut held);
        let mut work = vec![[S::zero()]; self.slots];
        for n in 0..D {
            work[n][0] = x[n];
        }
        for step in &self.steps {
            step.start(&mut work, &held, t, sides);
        }
        self.rates.map(|slot| work[usize::from(slot)][0])
    }
}
