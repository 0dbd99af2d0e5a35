//! How a step is taken.
//!
//! [`tableau`] holds methods as data, [`step()`] is pure, [`step_size`] chooses step sizes, [`root`] finds
//! zeros; a [`Method`] takes steps and has their polynomials. [`Integrator`] puts them together: the one
//! stepping loop, on which every derived object is built.

pub mod cancel;
mod dop853;
mod event_location;
mod integrator;
mod method;
mod propagate;
mod rodas;
pub mod root;
mod runge_kutta;
mod saltation;
pub mod step_size;
mod steps;
pub mod tableau;
mod taylor;
pub mod zeros;

pub use cancel::{CancelFlag, Stop};
pub use dop853::Dop853Scheme;
pub use integrator::{Counts, Ending, Integrator, Progress};
pub use method::{Method, Trial};
pub use propagate::propagate;
pub use rodas::Rodas;
pub use runge_kutta::{Dop853, Dopri5, RungeKutta, step};
pub use saltation::pass;
pub use steps::Steps;
pub use taylor::{Taylor, order};

pub use crate::failure::Failure;
pub use crate::model::{MOST_PROBES, Probes, StepStart, TARGETS, WALL};
pub use crate::tolerance::{ErrorNorm, MaybeTangents, Tolerance, WithTangents};
