//! Asking work on other threads to end.

use std::cell::RefCell;
use std::panic;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::Failure;

/// Asked every few microseconds whether the work is to end.
pub trait Stop: Sync {
    /// [`Failure::Interrupted`] if so.
    fn check(&self) -> Result<(), Failure>;
}

/// Set by one thread, looked at by the threads that work.
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

impl Stop for CancelFlag {
    fn check(&self) -> Result<(), Failure> {
        self.check()
    }
}

thread_local! {
    /// The flag that asks the work of this thread to end.
    static CURRENT: RefCell<Option<Arc<CancelFlag>>> = const { RefCell::new(None) };
}

/// The payload of the unwinding of cancelled work, whose result nobody uses.
#[derive(Debug)]
pub struct Cancelled;

/// Does work that a flag may ask to end wherever it [looks](look), on this thread.
pub fn under<T>(flag: Option<Arc<CancelFlag>>, work: impl FnOnce() -> T) -> T {
    struct Restored(Option<Arc<CancelFlag>>);
    impl Drop for Restored {
        fn drop(&mut self) {
            CURRENT.set(self.0.take());
        }
    }
    let _restored = Restored(CURRENT.replace(flag));
    work()
}

/// The flag that the work of this thread is done under.
pub fn current() -> Option<Arc<CancelFlag>> {
    CURRENT.with_borrow(Clone::clone)
}

/// Returns true if the work of this thread was asked to end.
pub fn is_asked() -> bool {
    CURRENT.with_borrow(|flag| flag.as_ref().is_some_and(|flag| flag.check().is_err()))
}

/// Ends the work of this thread, up to where it began, if it was asked to; other threads that share it look themselves.
pub fn look() {
    if is_asked() {
        panic::resume_unwind(Box::new(Cancelled));
    }
}
