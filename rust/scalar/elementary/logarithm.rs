//! The natural logarithm.

use super::exponential::LN_2;
use super::{Real, cubic};

/// `(ln((1 + s)/(1 - s)) / s - 2) / s^2` in powers of `s^2`, on `|s| <= 0.1716`; with it the logarithm of
/// a number near 1 is off by 3e-18 of itself.
const LN: [f64; 7] = [
    0.6666666666666734,
    0.3999999999941419,
    0.2857142874251949,
    0.222221985576594,
    0.18183565224724874,
    0.15314025422940752,
    0.14796220993341158,
];

const ROOT_HALF: u64 = std::f64::consts::FRAC_1_SQRT_2.to_bits();
pub(super) const ONE: u64 = 1f64.to_bits();

/// A positive normal number as `2^k m`, with `m` from sqrt(1/2) to sqrt(2). Returns `m` and `k` beyond
/// -1023 as the last bits of `2^52`.
#[inline(always)]
pub(super) fn split<R: Real>(x: R) -> (R, R) {
    // The exponent field counts up where the fraction passes the root.
    let moved = x.each(|x| f64::from_bits(x.to_bits().wrapping_add(ONE - ROOT_HALF)));
    let fraction = moved.each(|v| f64::from_bits((v.to_bits() & 0x000f_ffff_ffff_ffff) + ROOT_HALF));
    let exponent = moved.each(|v| f64::from_bits((v.to_bits() >> 52) | TWO_52.to_bits()));
    (fraction, exponent)
}

/// 2^52.
pub(super) const TWO_52: f64 = 4503599627370496.0;

/// The natural logarithm, within 1 ulp; of denormal numbers too.
#[inline(always)]
pub fn ln<R: Real>(x: R) -> R {
    let tiny = x.less(R::constant(f64::MIN_POSITIVE));
    // 2^54
    let (m, exponent) = split(R::select(tiny, x.scale(18014398509481984.0), x));
    let bias = R::select(tiny, R::constant(TWO_52 + 1023.0 + 54.0), R::constant(TWO_52 + 1023.0));
    let k = exponent - bias;

    let f = m - R::one();
    let s = f / (R::constant(2.0) + f);
    let (z, z2) = (s * s, (s * s) * (s * s));
    let series = cubic(z, z2, [LN[0], LN[1], LN[2], LN[3]])
        + (z2 * z2) * (R::constant(LN[4]) + z.scale(LN[5]) + z2.scale(LN[6]));
    let half = (f * f).scale(0.5);
    let value = k.scale(LN_2[0]) - ((half - (s * (half + z * series) + k.scale(LN_2[1]))) - f);

    let least = R::constant(f64::from_bits(1));
    let edge = R::select(x.less(R::zero()), R::constant(f64::NAN), R::constant(f64::NEG_INFINITY));
    let value = R::select(x.less(R::constant(f64::INFINITY)), value, x);
    R::select(x.less(least), edge, value)
}
