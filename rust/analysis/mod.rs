//! Analyses of runs: ensembles, Lyapunov exponents, sections, shooting.

pub mod batch;
mod ensemble;
mod growth;
mod jacobian;
mod lyapunov;
mod periodic_schur;
mod poincare;
mod shooting;
mod stiffness;
mod trajectory;

pub use crate::integrate::{CancelFlag, Stop};
pub use batch::lanes::{LaneBatch, Start};
pub use batch::method_factory::{Dop853Factory, Dopri5Factory, MethodFactory, TaylorFactory};
pub use batch::rows;
pub use batch::scheduler::{
    BatchJob, ExecutionContext, Queue, ResultSink, rerun_failed, run_batch, run_one_by_one,
};
pub use batch::series_family::SeriesFamily;
pub use ensemble::{Ensemble, EnsembleRun, MethodChoice};
pub use growth::growing_components;
pub use jacobian::{Linearisation, higher, linear};
pub use lyapunov::block_average::{Average, BlockAverages};
pub use lyapunov::covariant::{CovariantFrames, frames};
pub use lyapunov::exponents::{Exponents, Lyapunov, LyapunovOptions};
pub use lyapunov::moments::Moments;
pub use periodic_schur::{Multiplier, multipliers};
pub use poincare::crossing::Crossing;
pub use poincare::section::{CrossingOutcome, Crossings, ESCAPE_BOUND, Section, SectionRun};
pub use shooting::{MOST_PARAMETERS, Segment, SegmentEnd, pieces};
pub use stiffness::Stiffness;
pub use trajectory::{Outcome, Output, Run, trajectory};
