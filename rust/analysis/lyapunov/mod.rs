//! Lyapunov exponents, covariant vectors, and their errors.

pub(crate) mod block_average;
pub(crate) mod covariant;
pub(crate) mod exponents;
pub(crate) mod moments;
pub(crate) mod tangent_frame;
