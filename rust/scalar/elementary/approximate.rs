//! Powers, logarithm and exponential to a few digits, for the size of steps: they are on the way from each
//! step to the next, where nothing else can be done meanwhile.

use super::logarithm::{ONE, TWO_52, split};
use super::{Real, cubic, linear, round, two_to};

/// `log2(1 + f) / f` on sqrt(1/2) <= 1 + f <= sqrt(2); the logarithm is off by 3e-7.
const LOG2: [f64; 7] = [
    1.442699695833642,
    -0.7213758341612124,
    0.48046627577548634,
    -0.3589630391132563,
    0.2972500229231337,
    -0.2726877054065929,
    0.17066107652095733,
];

/// `2^r` on `|r| <= 1/2`, off by 7.5e-8 of itself.
const EXP2: [f64; 6] = [
    1.000000071651336,
    0.6931469670464935,
    0.2402211972498375,
    0.055507132892191155,
    0.009675541405601588,
    0.0013276469048922213,
];

/// The binary logarithm of a number that is not negative, to 3.1e-7; that of zero is -1023.
#[inline(always)]
pub fn log2_rough<R: Real>(x: R) -> R {
    let (m, exponent) = split(x);
    let k = exponent - R::constant(TWO_52 + 1023.0);
    let f = m - R::one();
    let f2 = f * f;
    let series = cubic(f, f2, [LOG2[0], LOG2[1], LOG2[2], LOG2[3]])
        + (f2 * f2) * (linear(f, [LOG2[4], LOG2[5]]) + f2.scale(LOG2[6]));
    R::select(x.less(R::constant(f64::INFINITY)), k + f * series, x)
}

/// `2^x` to a relative 8e-8, for `x` between -1022 and 1023; beyond it stays at the ends' values.
#[inline(always)]
pub fn exp2_rough<R: Real>(x: R) -> R {
    let x = R::constant(1023.0).min(R::constant(-1022.0).max(x));
    let k = round(x);
    let r = x - k;
    let r2 = r * r;
    let series =
        cubic(r, r2, [EXP2[0], EXP2[1], EXP2[2], EXP2[3]]) + (r2 * r2) * linear(r, [EXP2[4], EXP2[5]]);
    series * two_to(k)
}

/// Where a power lies beside the line through the powers of two, halved, in units of the exponent: with it
/// the error is as large upwards as downwards.
const CENTRE: f64 = 0.0573;

/// `x` to a power from -1/4 to 0, within 4 %, for an `x` that is not negative; of zero a large number.
///
/// Read as a whole number, a float's bits are nearly a straight line over its logarithm (the line that
/// J. F. Blinn, IEEE Computer Graphics and Applications 17 (1997) 80, draws roots with), so that a power is a
/// multiplication of the bits.
#[inline(always)]
pub fn power_rough<R: Real>(x: R, power: f64) -> R {
    // All but the last twelve bits, as the last bits of 2^52.
    let bits = x.each(|x| f64::from_bits((x.to_bits() >> 12) | TWO_52.to_bits()));
    let start = (1023.0 * (1.0 - power) - CENTRE) * TWO_40 + TWO_52 * (1.0 - power);
    let root = bits.scale(power) + R::constant(start);
    root.each(|bits| f64::from_bits(bits.to_bits() << 12))
}

/// `1/x` within 0.3 %, for an `x` above zero: the line through the powers of two (see [`power_rough`]) and a step
/// of Newton's, where a division would be waited for.
#[inline(always)]
pub fn inverse_rough<R: Real>(x: R) -> R {
    /// Twice the bits of 1, less what makes the error of the step's result smallest.
    const TURNED: u64 = 2 * ONE - (0.101 * TWO_52) as u64;
    let first = x.each(|x| f64::from_bits(TURNED.wrapping_sub(x.to_bits())));
    first * (R::constant(2.0) - x * first)
}

/// 2^40.
const TWO_40: f64 = 1099511627776.0;
