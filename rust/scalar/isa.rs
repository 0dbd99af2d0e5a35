//! The instruction set, chosen when the program runs. All of the crate's `unsafe` is here.

use std::sync::OnceLock;

/// Lanes in a packet, the same for every instruction set: one AVX-512 register, two of AVX2, four of SSE2.
pub const LANES: usize = 8;

/// A set of vector instructions. Results do not depend on it, only speed does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Isa {
    /// What every machine of the architecture has: SSE2 on x86-64, NEON on AArch64.
    Baseline,
    Avx2,
    Avx512,
}

/// Work that is compiled once for each instruction set, with packets of `L` lanes.
///
/// [`run`](Work::run) and all that it calls on the way must be `#[inline(always)]`: what stays a function
/// of its own is compiled for the baseline.
pub trait Work {
    type Output;
    fn run<const L: usize>(self) -> Self::Output;
}

impl Isa {
    /// All that this machine has, the fastest last.
    pub fn available() -> Vec<Isa> {
        let mut list = vec![Isa::Baseline];
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2") {
                list.push(Isa::Avx2);
            }
            if has_avx512() {
                list.push(Isa::Avx512);
            }
        }
        list
    }

    /// The fastest that this machine has.
    pub fn best() -> Isa {
        static BEST: OnceLock<Isa> = OnceLock::new();
        *BEST.get_or_init(|| *Isa::available().last().unwrap_or(&Isa::Baseline))
    }

    /// Does the work with these instructions.
    ///
    /// # Panics
    /// Where the machine lacks them.
    pub fn run<W: Work>(self, work: W) -> W::Output {
        assert!(self <= Isa::best(), "this machine lacks {self:?}");
        #[cfg(target_arch = "x86_64")]
        match self {
            // SAFETY: the machine has the instructions, as just seen.
            Isa::Avx512 => return unsafe { avx512(work) },
            // SAFETY: the same.
            Isa::Avx2 => return unsafe { avx2(work) },
            Isa::Baseline => {}
        }
        baseline(work)
    }
}

#[inline(never)]
fn baseline<W: Work>(work: W) -> W::Output {
    work.run::<LANES>()
}

#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2<W: Work>(work: W) -> W::Output {
    work.run::<LANES>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512dq,avx512vl")]
fn avx512<W: Work>(work: W) -> W::Output {
    work.run::<LANES>()
}
