//! What happened when.

use crate::integrate::{Ending, Steps};
use crate::model::System;

/// Events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// A switching surface was crossed to this side.
    Surface(usize, bool),
    /// The wall of the model's domain was reached.
    Wall,
}

/// Something that happened on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<const D: usize> {
    pub kind: EventKind,
    pub t: f64,
    pub x: [f64; D],
}

impl<const D: usize> Event<D> {
    /// The event at the end of the run's last step, if there is one.
    pub fn seen(ending: Ending, run: &dyn Steps<D>) -> Option<Self> {
        let kind = match ending {
            Ending::Free => return None,
            Ending::Surface(j) => EventKind::Surface(j, run.sides()[j]),
            Ending::Wall => EventKind::Wall,
        };
        Some(Self { kind, t: run.t(), x: *run.x() })
    }

    /// Its name, as the model gives it.
    pub fn name(&self, system: &impl System<f64, D>) -> &'static str {
        match self.kind {
            EventKind::Surface(j, side) => system.surface_name(j, side),
            EventKind::Wall => "edge",
        }
    }
}
