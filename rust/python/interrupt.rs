//! Long work: off the interpreter lock, stopped by Ctrl-C.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;

use crate::analysis::{CancelFlag, Stop};
use crate::integrate::Failure;
use crate::integrate::cancel::{self, Cancelled};

/// How often the calling thread looks for signals.
const POLL: Duration = Duration::from_millis(20);
/// The same of a thread that works: it may have to wait for the interpreter lock.
const POLL_AT_WORK: Duration = Duration::from_millis(50);

/// Runs `work` on another thread, from which it may use all cores, with the interpreter lock released.
///
/// The calling thread looks for signals meanwhile; on Ctrl-C it sets the [`CancelFlag`], waits for the work
/// to end, and raises `KeyboardInterrupt`. A panic becomes a `RuntimeError`.
pub fn run<T, E>(py: Python<'_>, work: impl FnOnce(&CancelFlag) -> Result<T, E> + Send) -> PyResult<T>
where
    T: Send,
    E: Into<PyErr> + Send,
{
    let (result, signal) = watch(py, &|| Ok(()), work)?;
    signal?;
    result.map_err(Into::into)
}

/// The same for work that has something to show when it is stopped: returns its result beside the
/// signal. `tick` is called now and then with the lock held, to show how far the work is; its error stops
/// the work as a signal does.
pub fn watch<T: Send>(
    py: Python<'_>,
    tick: &dyn Fn() -> PyResult<()>,
    work: impl FnOnce(&CancelFlag) -> T + Send,
) -> PyResult<(T, PyResult<()>)> {
    let (mut work, mut result) = (Some(work), None);
    let signal = watch_any(py, tick, &mut |stop| {
        result = work.take().map(|work| work(stop));
    })?;
    Ok((result.expect("the work has ended, without a panic"), signal))
}

/// The same, whatever the work: threads are compiled once.
fn watch_any(
    py: Python<'_>,
    tick: &dyn Fn() -> PyResult<()>,
    work: &mut (dyn FnMut(&CancelFlag) + Send),
) -> PyResult<PyResult<()>> {
    let stop = Arc::new(CancelFlag::new());
    let done = AtomicBool::new(false);
    let caller = thread::current();
    thread::scope(|scope| {
        let worker = scope.spawn(|| {
            let result = catch_unwind(AssertUnwindSafe(|| cancel::under(Some(stop.clone()), || work(&stop))));
            done.store(true, Ordering::Release);
            caller.unpark();
            result
        });
        let mut signal = Ok(());
        while !done.load(Ordering::Acquire) {
            py.detach(|| thread::park_timeout(POLL));
            if signal.is_ok() {
                signal = py.check_signals().and_then(|()| tick());
                if signal.is_err() {
                    stop.set();
                }
            }
        }
        ended(worker.join().and_then(|inner| inner), signal)
    })
}

/// The signal that came during work that has ended, or the error of work that ended in a panic.
fn ended(result: thread::Result<()>, signal: PyResult<()>) -> PyResult<PyResult<()>> {
    match result {
        Ok(()) => Ok(signal),
        Err(panic) if panic.is::<Cancelled>() => signal.and_then(|()| Err(PyKeyboardInterrupt::new_err(()))),
        Err(panic) => {
            let what = message(panic.as_ref());
            Err(PyRuntimeError::new_err(format!("internal error, please report it: {what}")))
        }
    }
}

/// As [`watch`], on the calling thread: for work of this thread alone, which may be shorter than the start of another one. The
/// work asks often whether it is to end, and signals are looked for then.
pub fn watch_here<T: Send>(
    py: Python<'_>,
    tick: &(dyn Fn(Python<'_>) -> PyResult<()> + Sync),
    work: impl FnOnce(&dyn Stop) -> T + Send,
) -> PyResult<(T, PyResult<()>)> {
    let (mut work, mut result) = (Some(work), None);
    let signal = watch_any_here(py, tick, &mut |stop| {
        result = work.take().map(|work| work(stop));
    })?;
    Ok((result.expect("the work has ended, without a panic"), signal))
}

fn watch_any_here(
    py: Python<'_>,
    tick: &(dyn Fn(Python<'_>) -> PyResult<()> + Sync),
    work: &mut (dyn FnMut(&dyn Stop) + Send),
) -> PyResult<PyResult<()>> {
    let signals = Signals {
        flag: Arc::new(CancelFlag::new()),
        tick,
        questions: AtomicU32::new(0),
        last: Mutex::new((Instant::now(), Ok(()))),
    };
    let result = py.detach(|| {
        catch_unwind(AssertUnwindSafe(|| cancel::under(Some(signals.flag.clone()), || work(&signals))))
    });
    let (_, signal) = signals.last.into_inner().unwrap_or_else(PoisonError::into_inner);
    ended(result, signal)
}

/// Signals during work on the calling thread.
struct Signals<'a> {
    flag: Arc<CancelFlag>,
    tick: &'a (dyn Fn(Python<'_>) -> PyResult<()> + Sync),
    /// How often the work asked.
    questions: AtomicU32,
    /// When signals were looked for, and what came.
    last: Mutex<(Instant, PyResult<()>)>,
}

impl Stop for Signals<'_> {
    #[inline]
    fn check(&self) -> Result<(), Failure> {
        // The clock takes as long as a short step.
        let questions = self.questions.load(Ordering::Relaxed).wrapping_add(1);
        self.questions.store(questions, Ordering::Relaxed);
        if questions.is_multiple_of(8) {
            self.look();
        }
        self.flag.check()
    }
}

impl Signals<'_> {
    #[inline(never)]
    fn look(&self) {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let (at, signal) = &mut *last;
        if at.elapsed() < POLL_AT_WORK || signal.is_err() {
            return;
        }
        *at = Instant::now();
        *signal = Python::attach(|py| py.check_signals().and_then(|()| (self.tick)(py)));
        if signal.is_err() {
            self.flag.set();
        }
    }
}

/// Looks for signals every so often in a loop that keeps the interpreter lock.
#[inline]
pub fn poll(py: Python<'_>, count: usize) -> PyResult<()> {
    const EVERY: usize = 1024;
    if count % EVERY == EVERY - 1 { py.check_signals() } else { Ok(()) }
}

fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("unknown")
}
