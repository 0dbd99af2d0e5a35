//! What a camera makes of a rectangular mark on a moving disk, and where in a picture such a mark is.
//!
//! Knows no model and no Python: numbers in, numbers out. The tracker's inner loop.

mod coverage;
mod locate;

pub use coverage::{Local, Mark, Motion, Pose, Window, coverage, window};
pub use locate::{Look, Plane, Sighting, locate};
