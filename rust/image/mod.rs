//! Images of rectangular marks on a moving disk, and the places of such marks in a picture.
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
