//! Machine code made while the program runs: straight arithmetic on arrays of numbers.
//!
//! An interpreter spends its time between operations. Code for a [`Listing`] of operations has no such time, and the same
//! operations in the same order give the same bits. Without the feature `machine-code`, and on machines without AVX2,
//! [`Code::new`] returns `None`, and the operations are interpreted.

mod allocate;
mod codes;
#[cfg(all(feature = "machine-code", target_arch = "x86_64"))]
mod encode;
#[cfg_attr(not(all(feature = "machine-code", target_arch = "x86_64")), allow(dead_code))]
mod listing;
#[cfg(all(feature = "machine-code", target_arch = "x86_64"))]
mod memory;
#[cfg(not(all(feature = "machine-code", target_arch = "x86_64")))]
mod no_memory;
#[cfg(not(all(feature = "machine-code", target_arch = "x86_64")))]
use no_memory as memory;

pub use codes::{Codes, When, make_code, shared};
pub use listing::{Array, Listing, Operand, Operation, Place, Register};
pub use memory::Code;
