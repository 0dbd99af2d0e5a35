//! The hyperbolic tangent.

use super::exponential::split;
use super::{Real, linear, two_to};

/// Up to here by the fraction, from here by the exponential function.
const BEND: f64 = 0.55;

/// Numerator and denominator of `(tanh(x)/x - 1) / x^2` in powers of `x^2`, which agree with it at the
/// six Chebyshev points of `x^2 <= 0.55^2`; `tanh x` is off by 3e-19 of itself.
const TOP: [f64; 3] = [-0.3333333333333333, -0.020501988651856828, -0.0001993193747645329];
const BOTTOM: [f64; 4] = [1.0, 0.46150596595556953, 0.023295582601796934, 0.00020668511298039153];

/// The hyperbolic tangent, within 1 ulp; odd to the last bit.
#[inline(always)]
pub fn tanh<R: Real>(x: R) -> R {
    let size = x.abs();
    let near = size.less(R::constant(BEND));

    // Near zero |x| + |x|^3 TOP/BOTTOM.
    let z = size * size;
    let z2 = z * z;
    let top = R::constant(TOP[0]) + z.scale(TOP[1]) + z2.scale(TOP[2]);
    let bottom = linear(z, [BOTTOM[0], BOTTOM[1]]) + z2 * linear(z, [BOTTOM[2], BOTTOM[3]]);

    // Far from it 1 - 2 / (e^(2|x|) + 1), with the denominator as a sum of two numbers, divided by 2^k;
    // beyond 22 it is 1.
    let (k, a, b) = split(R::constant(22.0).min(size).scale(2.0));
    let share = two_to(-k);
    let sum = a + b;
    let known = R::one() + share;
    let whole = known + sum;
    let rest = ((known - whole) + sum) + ((a - sum) + b);

    let top = R::select(near, size * z * top, share.scale(-2.0));
    let bottom = R::select(near, bottom, whole);
    let rest = R::select(near, R::zero(), rest);
    let start = R::select(near, size, R::one());

    let quotient = top / bottom;
    let value = start + quotient;
    let lost = ((start - value) + quotient) - quotient * rest / bottom;
    let value = value + lost;
    value.zip(x, |v, x| f64::from_bits(v.to_bits() | (x.to_bits() & (-0f64).to_bits())))
}
