//! Sine and cosine.

use super::far_angle::reduce;
use super::{Real, WHOLE, cubic, linear};
use crate::scalar::Mask;

/// pi/2 in two parts of 36 bits and the rest: multiples of the first two by up to 2^17 are exact.
const RIGHT_ANGLE: [f64; 3] = [
    f64::from_bits(0x3ff921fb54440000),
    f64::from_bits(0x3d868c234c4c0000),
    f64::from_bits(0x3b298a2e03707345),
];

/// `(sin(r)/r - 1) / r^2` in powers of `r^2`, on `|r| <= pi/4`; the sine is off by 4e-18 of itself.
const SIN: [f64; 6] = [
    -0.16666666666666632,
    0.00833333333332242,
    -0.00019841269829812475,
    2.7557313693599847e-06,
    -2.5050758387937708e-08,
    1.5896811975693176e-10,
];

/// `(cos(r) - 1 + r^2/2) / r^4` in powers of `r^2`, on `|r| <= pi/4`; the cosine is off by 5e-20.
const COS: [f64; 6] = [
    0.0416666666666666,
    -0.0013888888888874131,
    2.4801587289487016e-05,
    -2.7557314353789286e-07,
    2.087572347902242e-09,
    -1.1359658842341324e-11,
];

/// Beyond this angle the multiples of a right angle are taken away by whole numbers.
const FAR: f64 = 2e5;

/// Sine and cosine of an angle in rad, together.
///
/// Both are within 1 ulp, for angles of any size. The sine is odd and the cosine even to the last bit.
#[inline(always)]
pub fn sin_cos<R: Real>(x: R) -> (R, R) {
    // The quarter turns, whose last two bits are the quadrant, and what is left of the angle, r + tail.
    let mut turned = x.scale(std::f64::consts::FRAC_2_PI) + R::constant(WHOLE);
    let q = turned - R::constant(WHOLE);
    // This difference is exact, and so is the next one where it comes out below 2^-21.
    let left = x - q.scale(RIGHT_ANGLE[0]);
    let second = q.scale(RIGHT_ANGLE[1]);
    let shorter = left - second;
    let third = q.scale(RIGHT_ANGLE[2]) - ((left - shorter) - second);
    let mut r = shorter - third;
    let mut tail = (shorter - r) - third;
    let far = R::constant(FAR).less(x.abs());
    if far.any() {
        for lane in far.lanes() {
            let (turns, left, rest) = reduce(x.lane(lane));
            turned.set_lane(lane, WHOLE + turns);
            r.set_lane(lane, left);
            tail.set_lane(lane, rest);
        }
    }

    let z = r * r;
    let (z2, half) = (z * z, z.scale(0.5));
    let cube = z * r;
    let series = cubic(z, z2, [SIN[1], SIN[2], SIN[3], SIN[4]]) + (z2 * z2).scale(SIN[5]);
    let sin = r - ((z * (tail.scale(0.5) - cube * series) - tail) - cube.scale(SIN[0]));

    let series = cubic(z, z2, [COS[0], COS[1], COS[2], COS[3]]) + (z2 * z2) * linear(z, [COS[4], COS[5]]);
    let most = R::one() - half;
    let cos = most + (((R::one() - most) - half) + (z2 * series - r * tail));

    // An odd quadrant swaps the two; bits 1 of q and of q + 1 are their signs.
    let odd = turned.each(|q| f64::from_bits((q.to_bits() & 1) << 62));
    let odd = R::zero().less(odd);
    let (s, c) = (R::select(odd, cos, sin), R::select(odd, sin, cos));
    let s = s.zip(turned, |v, q| f64::from_bits(v.to_bits() ^ ((q.to_bits() & 2) << 62)));
    let c = c.zip(turned, |v, q| f64::from_bits(v.to_bits() ^ ((q.to_bits().wrapping_add(1) & 2) << 62)));
    (s, c)
}
