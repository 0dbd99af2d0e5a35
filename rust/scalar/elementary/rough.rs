//! Logarithm and exponential to six digits, for the size of steps: they are on the way from each step
//! to the next, where nothing else can be done meanwhile.

use super::logarithm::{TWO_52, split};
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
