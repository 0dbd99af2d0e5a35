//! Poincaré sections: crossings of surfaces on dense output.

pub(crate) mod crossing;
pub(crate) mod dense_output;
mod hidden;
pub(crate) mod section;
pub(crate) mod sign_changes;
