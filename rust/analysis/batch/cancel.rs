//! Asking work on other threads to end.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::integrate::Failure;

/// Set by one thread, looked at by the threads that work, at least every few microseconds.
#[derive(Debug, Default)]
pub struct CancelFlag(AtomicBool);

impl CancelFlag {
    /// Not set.
    pub const fn new() -> Self {
        Self(AtomicBool::new(false))
    }

    /// Asks all work that looks here to end.
    pub fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// [`Failure::Interrupted`] once set.
    #[inline]
    pub fn check(&self) -> Result<(), Failure> {
        if self.0.load(Ordering::Relaxed) { Err(Failure::Interrupted) } else { Ok(()) }
    }
}
