//! Who drives it: whole runs and what is derived from them.

mod ensemble;
mod fleet;
mod lyapunov;
mod recipe;
mod ship;
mod stop;
mod trajectory;

pub use ensemble::{Ensemble, Passage, Stepper, known};
pub use fleet::{Crew, Fleet, Queue, sail};
pub use lyapunov::{Exponent, LyapunovOptions, largest_exponent};
pub use recipe::{ByDopri5, ByTaylor, Recipe};
pub use ship::{Ship, Start};
pub use stop::Stop;
pub use trajectory::{Outcome, Output, Run, trajectory};
