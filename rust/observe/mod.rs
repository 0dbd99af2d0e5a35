//! Output during a run: samples at given times, and events.

mod event;
mod record;
mod sample;

pub use event::{Event, EventKind};
pub use record::Record;
pub use sample::Samples;
