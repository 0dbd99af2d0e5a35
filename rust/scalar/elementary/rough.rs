//! Rough logarithm and exponential, for the size of steps: they are on the way from each step to the
//! next, where nothing else can be done meanwhile, and a step that is a per cent longer does no harm.

use super::Real;

const TWO_52: f64 = 4_503_599_627_370_496.0;

/// The binary logarithm of a number that is not negative, to 0.01; that of zero is -1023, that of what is
/// infinite or not a number 1024.
#[inline(always)]
pub fn log2_rough<R: Real>(x: R) -> R {
    x.each(|x| {
        let exponent = f64::from_bits((x.to_bits() >> 52) | TWO_52.to_bits()) - (TWO_52 + 1023.0);
        let m = f64::from_bits((x.to_bits() & ((1 << 52) - 1)) | 1f64.to_bits()) - 1.0;
        exponent + m * (1.346_5 - 0.346_5 * m)
    })
}

/// `2^x` to 0.3 %, for `x` between -1021.9 and 1022.9; beyond it stays at the ends' values.
#[inline(always)]
pub fn exp2_rough<R: Real>(x: R) -> R {
    // Adding this leaves the whole part of x + 1023 in the last bits.
    const SHIFT: f64 = 6_755_399_441_055_744.0 + 1023.0;
    R::constant(1022.9).min(R::constant(-1021.9).max(x)).each(|x| {
        let shifted = (x - 0.5) + SHIFT;
        let f = x - (shifted - SHIFT);
        f64::from_bits(shifted.to_bits() << 52) * (1.0 + f * (0.656_5 + 0.343_5 * f))
    })
}
