//! What a camera makes of a rectangular mark on a moving disk, and where in a picture such marks are.
//!
//! Knows no model and no Python: numbers in, numbers out. The tracker's inner loop.

mod align;
mod coverage;
mod lens;
mod locate;

pub use align::{Body, Fit, Speed, Step, align};
pub use coverage::{Local, Mark, Motion, Pose, Window, coverage, window};
pub use lens::Lens;
pub use locate::{Look, Plane, Sighting, locate};
