//! Logarithms and powers to a few digits, for the size of steps: they are on the way from each step to the next,
//! where nothing else can be done meanwhile, and the root of an error forgives them much.

use super::logarithm::{TWO_52, split};
use super::{Real, round, two_to};

/// `log2(1 + f) / f` on sqrt(1/2) <= 1 + f <= sqrt(2); the logarithm is off by 8.6e-4.
const LOG2: [f64; 3] = [1.44515209, -0.75408137, 0.44507016];

/// `2^r` on `|r| <= 1/2`, off by 7.5e-5 of itself.
const EXP2: [f64; 4] = [0.99992806, 0.69326098, 0.24261122, 0.05517171];

/// The binary logarithm of a number that is not negative, to 8.6e-4; that of zero is -1023.
#[inline(always)]
pub fn log2_rough<R: Real>(x: R) -> R {
    let (m, exponent) = split(x);
    let k = exponent - R::constant(TWO_52 + 1023.0);
    let f = m - R::one();
    let series = LOG2.map(R::constant);
    let series = series[0].fused(f, series[1].fused(f, series[2]));
    R::select(x.less(R::constant(f64::INFINITY)), k.fused(f, series), x)
}

/// `2^x` to a relative 7.5e-5, for `x` between -1022 and 1023; beyond it stays at the ends' values.
#[inline(always)]
pub fn exp2_rough<R: Real>(x: R) -> R {
    let x = R::constant(1023.0).min(R::constant(-1022.0).max(x));
    let k = round(x);
    let r = x - k;
    let series = EXP2.map(R::constant);
    let series = series[0].fused(r, series[1].fused(r, series[2].fused(r, series[3])));
    series * two_to(k)
}

/// `x^power` to 4 % and 6.2 % of the power, for `x` that is not negative and a power between -1/2 and 1/2; zero
/// counts as 2^-1023.
///
/// A float's bits are its logarithm, nearly: linear between the powers of two.
#[inline(always)]
pub fn power_rough<R: Real>(x: R, power: f64) -> R {
    // In units of the exponent's last place; the low bits of the fraction are left out.
    const UNIT: f64 = (1u64 << 40) as f64;
    // The chord is above the curve, by 6.1 % at most: by this much in the mean of the logarithms.
    const CENTRE: f64 = 0.0573;
    let bits = x.each(|x| f64::from_bits((x.to_bits() >> 12) | TWO_52.to_bits()));
    let start = (1023.0 * (1.0 - power) - CENTRE) * UNIT + TWO_52 * (1.0 - power);
    R::constant(start).fused(bits, R::constant(power)).each(|bits| f64::from_bits(bits.to_bits() << 12))
}
