//! Who drives it: whole runs and what is derived from them.

mod blocks;
mod crossing;
mod ensemble;
mod expansion;
mod fleet;
mod frame;
mod frames;
mod lyapunov;
mod moments;
pub mod parallel;
mod polynomial;
mod recipe;
pub mod rows;
mod section;
mod ship;
mod shooting;
mod signs;
mod stiffness;
mod stop;
mod trajectory;

pub use blocks::{Average, Blocks};
pub use crossing::Crossed;
pub use ensemble::{Ensemble, Passage, Stepper};
pub use expansion::{Linear, higher, linear};
pub use fleet::{Crew, Fleet, Queue, Yields, sail, sail_again};
pub use frames::{Frames, frames};
pub use lyapunov::{Exponents, Lyapunov, LyapunovOptions};
pub use moments::Moments;
pub use recipe::{ByDop853, ByDopri5, ByTaylor, Recipe};
pub use section::{Crossings, Ended, FAR, Section, Sections};
pub use ship::{Ship, Start};
pub use shooting::{Flown, MOST_PARAMETERS, Piece, pieces};
pub use stiffness::Stiffness;
pub use stop::Stop;
pub use trajectory::{Outcome, Output, Run, trajectory};
