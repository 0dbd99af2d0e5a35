//! Which method takes the steps, before it is known over which scalar.

use crate::integrate::{Dop853, Dopri5, Method, Taylor};
use crate::scalar::{Isa, Scalar};
use crate::tape::Tape;

/// Makes a method for systems of `D` equations over any scalar.
pub trait MethodFactory<const D: usize>: Sync {
    type Method<S: Scalar>: Method<S, D>;

    /// Whether it needs no rates in packets, but the tape alone.
    const SERIES: bool = false;
    /// Whether ensembles of families whose rates are compiled for packets run by it in packets.
    const PACKETS: bool = false;

    /// Whether steps are so long, and so is what is compiled for them, that single runs forget the type of the model,
    /// unless its law is short.
    const FORGETS: bool = false;

    /// The method for systems whose parameters have these values.
    fn make<S: Scalar>(&self, values: Vec<S>) -> Self::Method<S>;
}

/// Dormand & Prince's pair.
#[derive(Clone, Copy, Debug)]
pub struct Dopri5Factory;

impl<const D: usize> MethodFactory<D> for Dopri5Factory {
    type Method<S: Scalar> = Dopri5<S, D>;

    const PACKETS: bool = true;

    fn make<S: Scalar>(&self, _values: Vec<S>) -> Dopri5<S, D> {
        Dopri5::default()
    }
}

/// The method of order 8.
#[derive(Clone, Copy, Debug)]
pub struct Dop853Factory;

impl<const D: usize> MethodFactory<D> for Dop853Factory {
    type Method<S: Scalar> = Dop853<S, D>;

    // Use another method for many fast runs: its twelve stages in packets are not worth their compilation.
    const PACKETS: bool = false;
    const FORGETS: bool = true;

    fn make<S: Scalar>(&self, _values: Vec<S>) -> Dop853<S, D> {
        Dop853::default()
    }
}

/// The Taylor method.
#[derive(Clone, Copy, Debug)]
pub struct TaylorFactory<'a, const D: usize> {
    pub tape: &'a Tape<D>,
    pub order: usize,
    /// The instructions that series are computed with.
    pub isa: Isa,
}

impl<'a, const D: usize> MethodFactory<D> for TaylorFactory<'a, D> {
    type Method<S: Scalar> = Taylor<'a, S, D>;

    const SERIES: bool = true;
    const PACKETS: bool = true;

    fn make<S: Scalar>(&self, values: Vec<S>) -> Taylor<'a, S, D> {
        Taylor::new(self.tape, values, self.order, self.isa)
    }
}
