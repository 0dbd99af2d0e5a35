//! How a step is taken.
//!
//! [`tableau`] holds the method as data, [`step()`] is pure, [`control`] chooses step sizes, [`Dense`]
//! is the continuous extension, [`root`] finds zeros. [`Driver`] puts them together: the one stepping
//! loop, on which every derived object is built.

pub mod control;
mod dense;
mod driver;
mod landing;
mod propagate;
pub mod root;
mod saltation;
mod step;
pub mod tableau;
mod tolerance;

pub use dense::Dense;
pub use driver::{Counts, Driver, Ending};
pub use propagate::{propagate, propagate_from};
pub use saltation::pass;
pub use step::{Step, step};
pub use tolerance::{ErrorNorm, Failure, Tolerance, WithTangents};
