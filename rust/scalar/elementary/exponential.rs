//! The exponential function.

use super::{Real, cubic, linear, round, two_to};

/// ln 2, its first 40 bits and the rest: a multiple of the first part by less than 2^13 is exact.
pub(super) const LN_2: [f64; 2] = [f64::from_bits(0x3fe62e42fefa2000), f64::from_bits(0x3d69ef35793c7673)];

/// `(e^r - 1 - r) / r^2` on `|r| <= ln(2)/2`; with it `e^r` is off by 4e-18 of itself.
const EXP: [f64; 10] = [
    0.5000000000000011,
    0.16666666666666413,
    0.041666666666530155,
    0.00833333333349447,
    0.0013888888943630168,
    0.0001984126950656423,
    2.480149309880978e-05,
    2.7557586385781026e-06,
    2.7630248421148927e-07,
    2.5000058019160498e-08,
];

/// `e^x` as `2^k (1 + a + b)`, `k` whole, `|a| < 0.35` and `|b|` smaller; `|x| < 1000`.
#[inline(always)]
pub(super) fn split<R: Real>(x: R) -> (R, R, R) {
    let k = round(x.scale(std::f64::consts::LOG2_E));
    let a = x - k.scale(LN_2[0]);
    let rest = k.scale(LN_2[1]);
    let r = a - rest;
    let (r2, r4) = (r * r, (r * r) * (r * r));
    let series = cubic(r, r2, [EXP[0], EXP[1], EXP[2], EXP[3]])
        + r4 * (cubic(r, r2, [EXP[4], EXP[5], EXP[6], EXP[7]]) + r4 * linear(r, [EXP[8], EXP[9]]));
    (k, a, r2 * series - rest)
}

/// The exponential function, within 1 ulp; denormal results too.
#[inline(always)]
pub fn exp<R: Real>(x: R) -> R {
    // Beyond these the result is infinite or zero. NaN stays NaN.
    let x = R::constant(710.0).min(R::constant(-746.0).max(x));
    let (k, a, b) = split(x);
    // 2^k itself may be too large or too small for a number; only the last product is rounded.
    let half = round(k.scale(0.5));
    (R::one() + (a + b)) * two_to(half) * two_to(k - half)
}
