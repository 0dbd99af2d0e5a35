//! Who drives it: whole runs and what is derived from them.

mod lyapunov;
mod stop;
mod trajectory;

pub use lyapunov::{Exponent, LyapunovOptions, largest_exponent};
pub use stop::Stop;
pub use trajectory::{Outcome, Output, Run, trajectory};
