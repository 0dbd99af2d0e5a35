//! What a camera makes of a rectangular mark on a moving disk, and where in a picture such marks are.
//!
//! Knows no model and no Python: numbers in, numbers out. The tracker's inner loop.

mod coverage;
mod lens;
mod mark_localization;
mod pose_fit;

pub use coverage::{Local, Mark, Motion, Pose, Window, coverage, window};
pub use lens::Lens;
pub use mark_localization::{Appearance, MarkObservation, Plane, locate};
pub use pose_fit::{MarkSet, PoseFit, PoseRate, PoseStep, align};
