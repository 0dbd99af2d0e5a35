//! Several numbers at once: the lanes of a SIMD register.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::isa::{self, InstructionSet, Isa, LANES, Plain, Work};
use super::{Mask, Real, Scalar, elementary, lanes};

/// `L` numbers that go through the same operations, one trajectory each, by the instructions `V`.
///
/// A lane's bits depend neither on these nor on `L`: nothing is reordered, and fused only where
/// [`Scalar::fused`] says so. It is aligned as a register is, and no more: numbers with derivatives would be half empty,
/// and AMD's Zen 3 reads from such places more slowly.
///
/// ```
/// use udd::scalar::{Packet, Real, Scalar};
/// let x: Packet<4> = Packet::new([1.0, 4.0, 9.0, 16.0]);
/// let small = x.less(Packet::constant(5.0));
/// assert_eq!(Packet::select(small, x, x.sqrt()).lane(3), 4.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Packet<const L: usize, V = Plain>([f64; L], [V; 0]);

/// One truth value per lane: all bits set where it is true.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct LaneMask<const L: usize, V = Plain>([f64; L], [V; 0]);

impl<const L: usize, V: InstructionSet> Packet<L, V> {
    /// The packet with these lanes.
    #[inline(always)]
    pub fn new(lanes: [f64; L]) -> Self {
        Self(lanes, [])
    }
}

impl<const L: usize, V: InstructionSet> PartialEq for LaneMask<L, V> {
    fn eq(&self, other: &Self) -> bool {
        (0..L).all(|i| self.lane(i) == other.lane(i))
    }
}

impl<const L: usize, V: InstructionSet> LaneMask<L, V> {
    #[inline(always)]
    fn new(lanes: [f64; L]) -> Self {
        Self(lanes, [])
    }
}

#[inline(always)]
fn each<const L: usize>(mut lane: impl FnMut(usize) -> f64) -> [f64; L] {
    let mut all = [0.0; L];
    for i in 0..L {
        all[i] = lane(i);
    }
    all
}

/// The representation of a truth value in a mask.
#[inline(always)]
fn truth(value: bool) -> f64 {
    f64::from_bits(if value { !0 } else { 0 })
}

impl<const L: usize, V: InstructionSet> Mask for LaneMask<L, V> {
    #[inline(always)]
    fn from_lanes(mut lane: impl FnMut(usize) -> bool) -> Self {
        Self::new(each(|i| truth(lane(i))))
    }
    #[inline(always)]
    fn lane(self, i: usize) -> bool {
        self.0[i].to_bits() != 0
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        Self::new(lanes::and::<L, V>(&self.0, &other.0))
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        Self::new(lanes::or::<L, V>(&self.0, &other.0))
    }
    #[inline(always)]
    fn not(self) -> Self {
        Self::new(lanes::not::<L, V>(&self.0))
    }
    #[inline(always)]
    fn bits(self) -> u64 {
        lanes::bits::<L, V>(&self.0)
    }
}

macro_rules! operators {
    ($($Op:ident :: $op:ident),+) => {$(
        impl<const L: usize, V: InstructionSet> $Op for Packet<L, V> {
            type Output = Self;
            #[inline(always)]
            fn $op(self, other: Self) -> Self {
                Self::new(lanes::$op::<L, V>(&self.0, &other.0))
            }
        }
    )+};
}
operators! { Add::add, Sub::sub, Mul::mul, Div::div }

impl<const L: usize, V: InstructionSet> Neg for Packet<L, V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(lanes::neg::<L, V>(&self.0))
    }
}

impl<const L: usize, V: InstructionSet> AddAssign for Packet<L, V> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize, V: InstructionSet> SubAssign for Packet<L, V> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const L: usize, V: InstructionSet> Real for Packet<L, V> {
    const LANES: usize = L;

    #[inline(always)]
    fn work<W: Work>(isa: Isa, work: W) -> W::Output {
        if const { V::ISA as u8 == Isa::Baseline as u8 } {
            isa.run(work)
        } else {
            isa::run_with::<V, W>(work)
        }
    }
    #[inline(always)]
    fn from_lanes(lane: impl FnMut(usize) -> f64) -> Self {
        Self::new(each(lane))
    }
    #[inline(always)]
    fn lane(self, i: usize) -> f64 {
        self.0[i]
    }
    #[inline(always)]
    fn set_lane(&mut self, i: usize, value: f64) {
        self.0[i] = value;
    }
    #[inline(always)]
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        Self::new(each(|i| f(self.0[i])))
    }
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self::new(each(|i| f(self.0[i], other.0[i])))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self::new(lanes::abs::<L, V>(&self.0))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::new(lanes::max::<L, V>(&self.0, &other.0))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::new(lanes::min::<L, V>(&self.0, &other.0))
    }
}

impl<const L: usize, V: InstructionSet> Scalar for Packet<L, V> {
    type Real = Self;
    type Mask = LaneMask<L, V>;
    type Register = Packet<LANES, V>;
    // Few lanes may be aligned with gaps.
    const IS_PLAIN: bool = size_of::<Self>() == size_of::<[f64; L]>();

    #[inline(always)]
    fn register(self, i: usize) -> Packet<LANES, V> {
        Packet::new(each(|lane| self.0[i * LANES + lane]))
    }
    #[inline(always)]
    fn set_register(&mut self, i: usize, lanes: Packet<LANES, V>) {
        self.0[i * LANES..][..LANES].copy_from_slice(&lanes.0);
    }
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::new([value; L])
    }
    #[inline(always)]
    fn lift(value: Self) -> Self {
        value
    }
    #[inline(always)]
    fn real(self) -> Self {
        self
    }
    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        self * Self::constant(factor)
    }
    #[inline(always)]
    fn times(self, factor: Self) -> Self {
        self * factor
    }
    #[inline(always)]
    fn fused(self, a: Self, b: Self) -> Self {
        Self::new(lanes::fused::<L, V>(&a.0, &b.0, &self.0))
    }
    #[inline(always)]
    fn fused_times(self, a: Self, b: Self) -> Self {
        self.fused(a, b)
    }
    #[inline(always)]
    fn less(self, other: Self) -> LaneMask<L, V> {
        LaneMask::new(lanes::less::<L, V>(&self.0, &other.0))
    }
    #[inline(always)]
    fn select(mask: LaneMask<L, V>, yes: Self, no: Self) -> Self {
        Self::new(lanes::select::<L, V>(&mask.0, &yes.0, &no.0))
    }
    #[inline(always)]
    fn mask(value: bool) -> LaneMask<L, V> {
        LaneMask::new([truth(value); L])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::new(lanes::sqrt::<L, V>(&self.0))
    }
    // Not inlined: models use these seldom, and their code is long over eight lanes. Hot code calls `elementary`
    // itself.
    #[inline(never)]
    fn exp(self) -> Self {
        isa::run_with::<V, _>(Exp(self))
    }
    #[inline(never)]
    fn ln(self) -> Self {
        isa::run_with::<V, _>(Ln(self))
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    #[inline(always)]
    fn cos(self) -> Self {
        self.sin_cos().1
    }
    #[inline(never)]
    fn tanh(self) -> Self {
        isa::run_with::<V, _>(Tanh(self))
    }
    #[inline(never)]
    fn atan2(self, x: Self) -> Self {
        self.zip(x, f64::atan2)
    }
    #[inline(never)]
    fn sin_cos(self) -> (Self, Self) {
        isa::run_with::<V, _>(SinCos(self))
    }
}

/// Elementary functions with the packet's own instructions: functions of their own would else be compiled for the
/// baseline, with a call for every operation.
macro_rules! functions {
    ($($Name:ident: $function:ident -> $Output:ty),+) => {$(
        struct $Name<R>(R);

        impl<R: Real> Work for $Name<R> {
            type Output = $Output;

            #[inline(always)]
            fn run<V: InstructionSet>(self) -> $Output {
                elementary::$function(self.0)
            }
        }
    )+};
}
functions! { Exp: exp -> R, Ln: ln -> R, Tanh: tanh -> R, SinCos: sin_cos -> (R, R) }
