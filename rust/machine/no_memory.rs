//! In place of code in executable memory: this build has none.

use super::Listing;
use crate::scalar::Scalar;
use crate::sides::Sides;

#[derive(Debug)]
pub enum Code {}

impl Code {
    pub fn new(_listing: Listing) -> Option<Self> {
        None
    }

    pub fn run<S: Scalar>(&self, _function: usize, _work: &mut [S], _held: &[S], _sides: &Sides<S>) {
        match *self {}
    }

    pub fn run_step<S: Scalar>(
        &self,
        _function: usize,
        _arrays: (&mut [S], &mut [S]),
        _held: &[S],
        _sides: &Sides<S>,
    ) {
        match *self {}
    }
}
