//! On which side of its switching surfaces a law is taken.

use crate::scalar::{Mask, Scalar};

/// The most switching surfaces a model can have.
pub const MAX_SURFACES: usize = 6;

/// On which side of each switching surface the law is taken: true where its function is positive.
pub type Sides<S> = [<S as Scalar>::Mask; MAX_SURFACES];

/// `yes` in the lanes where `mask` is true, `no` in the others.
#[inline(always)]
pub fn choose<M: Mask>(mask: M, yes: M, no: M) -> M {
    mask.and(yes).or(mask.not().and(no))
}
