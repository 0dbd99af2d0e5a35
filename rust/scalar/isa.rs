//! The instruction set, chosen when the program runs. The crate's `unsafe` is here, in `lanes.rs` and
//! in `machine/memory.rs`.

use std::fmt::Debug;
use std::sync::OnceLock;

/// Lanes in a register of AVX-512, or in two of AVX2.
pub const LANES: usize = 8;

/// A set of vector instructions. Results do not depend on it, only speed does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Isa {
    /// The instructions of every machine of the architecture: SSE2 on x86-64, NEON on AArch64.
    Baseline,
    /// AVX2 with fused multiply-add.
    Avx2,
    Avx512,
}

/// Instructions as a type, for [packets](super::Packet) that are made of them.
///
/// Those beyond the [`Plain`] ones cannot be named outside of this crate: they are given to [`Work`] where
/// the machine has them. The type is empty, and aligned as a register of the set is.
pub trait InstructionSet: Copy + Debug + PartialEq + Send + Sync + 'static {
    const ISA: Isa;
}

/// The compiler's own code for plain loops, on any machine.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(16))]
pub struct Plain;
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Avx2;
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Avx512;

impl InstructionSet for Plain {
    const ISA: Isa = Isa::Baseline;
}
impl InstructionSet for Avx2 {
    const ISA: Isa = Isa::Avx2;
}
impl InstructionSet for Avx512 {
    const ISA: Isa = Isa::Avx512;
}

/// Work that is compiled once for each instruction set.
///
/// [`run`](Work::run) and all that it calls on the way must be `#[inline(always)]`: what stays a function
/// of its own is compiled for the baseline.
pub trait Work {
    type Output;
    /// Whether it gains from AVX-512 over single numbers, too: from its wider registers, or from their number.
    const WIDE: bool = false;
    fn run<V: InstructionSet>(self) -> Self::Output;
}

impl Isa {
    /// Whether machines that have no more than this are rare, as PCs without AVX2 are: not worth the long programs
    /// that are faster, each of which takes its time to compile.
    pub(crate) const fn is_rare(self) -> bool {
        cfg!(target_arch = "x86_64") && matches!(self, Isa::Baseline)
    }

    /// All that this machine has, the fastest last.
    pub fn available() -> Vec<Isa> {
        let mut list = vec![Isa::Baseline];
        #[cfg(target_arch = "x86_64")]
        {
            if has_avx2() {
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
    #[inline]
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

impl Isa {
    /// Does work over single numbers with these instructions, or with AVX2 where they are wider: nothing is
    /// gained by registers that are half empty, and every copy takes its time to compile.
    ///
    /// # Panics
    /// Where the machine lacks them.
    #[inline]
    pub fn run_narrow<W: Work>(self, work: W) -> W::Output {
        assert!(self <= Isa::best(), "this machine lacks {self:?}");
        #[cfg(target_arch = "x86_64")]
        if self >= Isa::Avx2 {
            // SAFETY: the machine has the instructions, as just seen.
            return unsafe { avx2(work) };
        }
        baseline(work)
    }
}

/// Does work with the instructions `V`, as a function of its own.
#[inline(always)]
pub(crate) fn run_with<V: InstructionSet, W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if const { matches!(V::ISA, Isa::Avx512) } {
            // SAFETY: `V` was given where the machine had been seen to have it.
            return unsafe { avx512(work) };
        }
        if const { matches!(V::ISA, Isa::Avx2) } {
            // SAFETY: the same.
            return unsafe { avx2(work) };
        }
    }
    baseline_apart(work)
}

// Few are asked for.
#[inline(never)]
fn baseline_apart<W: Work>(work: W) -> W::Output {
    work.run::<Plain>()
}

// `#[inline]` only so that the compiler spreads the copies over its units: all of them in one take minutes.
#[inline]
fn baseline<W: Work>(work: W) -> W::Output {
    work.run::<Plain>()
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    has_avx2()
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
}

#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "avx2,fma")]
fn avx2<W: Work>(work: W) -> W::Output {
    work.run::<Avx2>()
}

#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "avx2,fma,avx512f,avx512dq,avx512vl")]
fn avx512<W: Work>(work: W) -> W::Output {
    work.run::<Avx512>()
}
