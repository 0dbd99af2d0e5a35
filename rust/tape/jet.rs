//! The Taylor coefficients of a solution.

use std::array::from_fn;

use super::Tape;
use super::node::{INVERSE, hold};
use crate::model::Sides;
use crate::scalar::Scalar;

/// Room for the Taylor coefficients of a solution of `D` equations, of orders 0 to `N - 1`.
#[derive(Clone, Debug)]
pub struct Jets<S, const D: usize, const N: usize> {
    work: Vec<[S; N]>,
    held: Vec<S>,
    state: [[S; N]; D],
}

impl<S: Scalar, const D: usize, const N: usize> Jets<S, D, N> {
    /// The highest order.
    pub const ORDER: usize = N - 1;

    /// Room for this tape; [`expand`](Jets::expand) allocates nothing.
    pub fn new(tape: &Tape<D>) -> Self {
        const { assert!(N >= 4 && N <= INVERSE.len(), "between 3 and 32 orders") };
        let zero = [S::zero(); N];
        Self { work: vec![zero; tape.slots], held: Vec::with_capacity(tape.held.len()), state: [zero; D] }
    }

    /// The coefficients of the solution through the state `x` at time `t`, all laws taken on these
    /// sides of their surfaces.
    ///
    /// # Panics
    /// Where the room was made for another tape, or parameters are missing.
    #[inline(always)]
    pub fn expand(&mut self, tape: &Tape<D>, parameters: &[S], t: S, x: &[S; D], sides: &Sides<S>) {
        hold(&tape.held, parameters, sides, &mut self.held);
        let (work, held) = (&mut self.work[..tape.slots], &self.held[..]);
        for n in 0..D {
            work[n][0] = x[n];
        }
        for step in &tape.steps {
            step.start(work, held, t, sides);
        }
        for n in 0..D {
            work[n][1] = work[usize::from(tape.rates[n])][0];
        }
        for k in 1..N - 1 {
            for step in &tape.steps {
                step.next(work, held, sides, k);
            }
            for n in 0..D {
                work[n][k + 1] = work[usize::from(tape.rates[n])][k].scale(INVERSE[k + 1]);
            }
        }
        self.state = from_fn(|n| work[n]);
    }

    /// The coefficients of each component, order 0 first.
    #[inline(always)]
    pub fn coefficients(&self) -> &[[S; N]; D] {
        &self.state
    }
}
