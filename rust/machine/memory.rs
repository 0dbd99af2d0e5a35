//! Code in executable memory, and its calls: the only unsafe part.

use memmap2::{Mmap, MmapMut};

use super::Listing;
use super::encode::encode;
use super::listing::Array;
use crate::scalar::{Isa, Mask, Real, Scalar};
use crate::sides::Sides;

/// Code in executable memory.
#[derive(Debug)]
pub struct Code {
    memory: Mmap,
    step: usize,
    lanes: usize,
    constants: Vec<f64>,
    starts: Vec<usize>,
    extents: [usize; 4],
}

/// The arrays in the order of [`Array`].
type Entry = unsafe extern "sysv64" fn(*mut f64, *mut f64, *const f64, *const f64, *const f64);

impl Code {
    /// Puts a listing into memory; `None` if the machine lacks the instructions or the system refuses such memory.
    pub fn new(listing: Listing) -> Option<Self> {
        if Isa::best() < listing.isa {
            return None;
        }
        let (bytes, mut starts) = encode(&listing).ok()?;
        // Nothing begins at the end.
        starts.pop();
        let mut memory = MmapMut::map_anon(bytes.len()).ok()?;
        memory.copy_from_slice(&bytes);
        let memory = memory.make_exec().ok()?;
        let Listing { step, lanes, constants, extents, .. } = listing;
        Some(Self { memory, step, lanes, constants, starts, extents })
    }

    /// Runs a function of a listing without stages.
    ///
    /// # Panics
    /// As [`run_step`](Self::run_step).
    #[inline]
    pub fn run<S: Scalar>(&self, function: usize, work: &mut [S], held: &[S], sides: &Sides<S>) {
        self.run_step(function, (work, &mut []), held, sides);
    }

    /// Runs a function with the rates at the stages of a step.
    ///
    /// # Panics
    /// If an array is shorter than the code needs, there is no such function, or the code is for other numbers.
    #[inline]
    pub fn run_step<S: Scalar>(
        &self,
        function: usize,
        (work, stages): (&mut [S], &mut [S]),
        held: &[S],
        sides: &Sides<S>,
    ) {
        let [work_length, stages_length, held_length, sides_length] = self.extents;
        assert!(S::IS_PLAIN && S::Real::LANES == self.lanes, "code for other numbers");
        assert!(
            work_length <= work.len()
                && stages_length <= stages.len()
                && held_length <= held.len()
                && sides_length <= sides.len(),
            "arrays that are too short for this code"
        );
        let bits = |side: S::Mask| f64::from_bits(if side.lane(0) { !0 } else { 0 });
        let mut masks = [0.0; crate::sides::MAX_SURFACES];
        let sides: *const f64 = if size_of::<S::Mask>() == size_of::<S>() {
            sides.as_ptr().cast()
        } else {
            assert!(self.lanes == 1 && self.extents[Array::Sides as usize] <= masks.len());
            if sides_length > 0 {
                masks = sides.map(bits);
            }
            masks.as_ptr()
        };
        let start = self.starts[function];
        let (work, held): (*mut f64, *const f64) = (work.as_mut_ptr().cast(), held.as_ptr().cast());
        let stages: *mut f64 = stages.as_mut_ptr().cast();
        let mut from = 0;
        // A range in steps would divide.
        while from < self.lanes {
            // SAFETY: a whole function of this signature begins here, and the machine has its instructions. A plain
            // number is `lanes` numbers side by side, as is a mask of its size, and the arrays are as long as the
            // function needs, as just checked.
            unsafe {
                let entry = std::mem::transmute::<*const u8, Entry>(self.memory.as_ptr().add(start));
                let shifted = |array: *const f64| array.wrapping_add(from);
                let (work, stages) = (work.wrapping_add(from), stages.wrapping_add(from));
                entry(work, stages, shifted(held), shifted(sides), self.constants.as_ptr());
            }
            from += self.step;
        }
    }
}
