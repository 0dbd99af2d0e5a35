//! Many runs at once: lanes of a packet, threads, and how they are stopped.

pub(crate) mod lanes;
pub(crate) mod method_factory;
pub mod parallel;
pub mod rows;
pub(crate) mod scheduler;
pub(crate) mod series_family;
pub(crate) mod step_budget;
