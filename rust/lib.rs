//! The core of `udd`, the laboratory of the upward-driven disk.
//!
//! Data flows one way; nothing below knows what stands above it:
//! [`scalar`] (what a number is) → [`machine`] (code made at run time) → [`formula`] (what a user writes) → [`model`] (what is
//! integrated) → [`tape`] (its power series) → [`integrate`] (how a step is taken) → [`observe`] (what is seen on the way) → [`analysis`] (runs, sections,
//! exponents) → [`estimate`] (what measured motion says about the model) → `python` (pyo3 only, behind the feature `python`).
//! [`image`], the inner loop of the tracker, and [`memory`] use none of these. The files
//! `sides`, `tolerance`, `failure` and `latest` are below all layers.

// Formulas over components are read with their indices.
#![allow(clippy::needless_range_loop)]

pub mod analysis;
pub mod estimate;
mod failure;
pub mod formula;
pub mod image;
pub mod integrate;
mod inverse;
mod latest;
pub mod machine;
pub mod memory;
pub mod model;
pub mod observe;
pub mod scalar;
mod sides;
pub mod tape;
mod tolerance;
mod unroll;

#[cfg(feature = "python")]
mod python;
