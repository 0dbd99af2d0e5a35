//! Codes that are made when they pay.

use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::scalar::{Isa, LANES, Real, Scalar};

/// The programs whose codes are kept for equal ones.
const RECENT: usize = 16;

/// A copy of an equal program among the latest ones, which shares its codes, or the program itself. A call with the same
/// equations has the code of an earlier call, whatever the parameters are.
pub fn shared<P: Clone + PartialEq>(latest: &Mutex<Vec<P>>, program: P) -> P {
    let mut programs = latest.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(i) = programs.iter().position(|other| *other == program) {
        programs[i..].rotate_left(1);
        return programs[programs.len() - 1].clone();
    }
    if programs.len() == RECENT {
        programs.remove(0);
    }
    programs.push(program.clone());
    program
}

/// When code is made. Results have the same bits in any case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum When {
    Never,
    /// After enough runs.
    Paying,
    /// Before the first run.
    Always,
}

static WHEN: AtomicU8 = AtomicU8::new(When::Paying as u8);

/// Determines when code is made from now on. Code is not used while it is [`Never`](When::Never) made.
pub fn make_code(when: When) {
    WHEN.store(when as u8, Ordering::Relaxed);
}

fn is_made(when: When) -> bool {
    WHEN.load(Ordering::Relaxed) == when as u8
}

/// The codes of a program for some kinds of numbers. Copies of the program share them.
#[derive(Debug)]
pub struct Codes<C>(Arc<[Slot<C>; 6]>);

#[derive(Debug)]
struct Slot<C> {
    runs: AtomicU32,
    code: OnceLock<Option<C>>,
}

impl<C> Codes<C> {
    /// The code for numbers of this type, made by `make` after so many runs. `variant`, 0 or 1, distinguishes two codes for
    /// the same numbers.
    #[inline(always)]
    pub fn get<S: Scalar>(
        &self,
        variant: usize,
        runs: u32,
        make: impl FnOnce(usize) -> Option<C>,
    ) -> Option<&C> {
        const { assert!(LANES > 2, "packets have other numbers of lanes") };
        let lanes = S::Real::LANES;
        let kind = match lanes {
            _ if !S::IS_PLAIN => return None,
            1 => 0,
            LANES => 2,
            _ if lanes == 2 * LANES => 4,
            _ => return None,
        };
        let slot = &self.0[kind + variant];
        match slot.code.get() {
            Some(_) if is_made(When::Never) => None,
            Some(code) => code.as_ref(),
            None => slot.count(runs, || make(lanes)),
        }
    }
}

impl<C> Slot<C> {
    #[inline(never)]
    fn count(&self, runs: u32, make: impl FnOnce() -> Option<C>) -> Option<&C> {
        if Isa::best() == Isa::Baseline || is_made(When::Never) {
            return None;
        }
        if self.runs.fetch_add(1, Ordering::Relaxed) < runs && !is_made(When::Always) {
            return None;
        }
        self.code.get_or_init(make).as_ref()
    }
}

impl<C> Default for Codes<C> {
    fn default() -> Self {
        let slot = || Slot { runs: AtomicU32::new(0), code: OnceLock::new() };
        Self(Arc::new([slot(), slot(), slot(), slot(), slot(), slot()]))
    }
}

impl<C> Clone for Codes<C> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<C> PartialEq for Codes<C> {
    /// Programs are equal whether they have code or not.
    fn eq(&self, _other: &Self) -> bool {
        true
    }
}
