//! Results in registers.

use crate::machine::{Place, Register};

/// The registers that keep results.
const KEPT: std::ops::Range<u8> = 5..15;

/// The latest results, which stay in registers until others need these: a result waits for its way through memory.
#[derive(Default)]
pub(super) struct Kept {
    /// In each register the place of the result and its width, oldest first by the last number.
    results: [Option<(Place, usize, usize)>; KEPT.end as usize - KEPT.start as usize],
    time: usize,
}

impl Kept {
    /// The register that keeps the number stored at a place.
    pub(super) fn of(&mut self, place: Place, width: usize) -> Option<Register> {
        self.time += 1;
        let is_here = |kept: &Option<(Place, usize, usize)>| matches!(kept, Some((p, w, _)) if (*p, *w) == (place, width));
        let i = self.results.iter().position(is_here)?;
        self.results[i] = Some((place, width, self.time));
        Some(Self::register(i))
    }

    /// The register for a result: that of an earlier result at its place, or the one that was used longest ago.
    pub(super) fn room(&mut self, place: Place, width: usize) -> Register {
        self.time += 1;
        let age = |i: &usize| match self.results[*i] {
            Some((other, w, _)) if (other, w) == (place, width) => 0,
            kept => kept.map_or(1, |(.., used)| used + 1),
        };
        let i = (0..self.results.len()).min_by_key(age).expect("a register");
        self.results[i] = Some((place, width, self.time));
        Self::register(i)
    }

    fn register(i: usize) -> Register {
        Register(KEPT.start + u8::try_from(i).expect("sixteen registers"))
    }
}
