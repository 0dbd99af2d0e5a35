//! The Python module `udd._core`: conversion, errors, interrupts; no numerics.

mod effects;
mod ensemble;
mod errors;
mod estimate;
mod fitted;
mod formula;
mod growth;
mod image;
mod interrupt;
mod jobs;
mod linearisation_cache;
mod lyapunov;
mod model;
mod section;
mod shooting;
mod simulate;

use pyo3::prelude::*;

/// Every solve takes and gives back some megabytes: this allocator keeps them for the next, where the system's
/// returns them and gets them back page by page.
#[cfg(feature = "allocator")]
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// The compiled core of udd.
#[pymodule(gil_used = false)]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    errors::register(module)?;
    effects::register(module)?;
    model::register(module)?;
    formula::register(module)?;
    growth::register(module)?;
    simulate::register(module)?;
    lyapunov::register(module)?;
    section::register(module)?;
    ensemble::register(module)?;
    shooting::register(module)?;
    estimate::register(module)?;
    image::register(module)?;
    // Redundant with the stub, which would have to repeat it.
    module.delattr("__all__")?;
    Ok(())
}
