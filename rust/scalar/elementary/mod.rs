//! The elementary functions, the same bits for every width and instruction set.
//!
//! Each is one straight line of IEEE additions, multiplications, divisions and bit operations, with
//! masks where the formula changes. The arguments are reduced as by Cody and Waite (*Software Manual
//! for the Elementary Functions*, 1980): the constant that is subtracted a whole number of times is
//! cut into parts short enough that the products are exact. Sums are ordered as in Sun's fdlibm, so that
//! the last addition makes nearly all of the error. The coefficients are Remez fits, made with 60
//! digits and rounded to double; each says on what interval and how far it is off. A unit in the last
//! place (ulp) is the distance to the next number.
//!
//! ```
//! use udd::scalar::{Packet, Real, Scalar, elementary};
//! let angle: Packet<4> = Packet::new([0.1, 1.0, 10.0, 100.0]);
//! let (sin, cos) = elementary::sin_cos(angle);
//! assert_eq!(sin.lane(2).to_bits(), elementary::sin_cos(10.0_f64).0.to_bits());
//! assert!((cos.lane(3) - 100f64.cos()).abs() < 2e-16);
//! ```

mod angle;
mod approximate;
mod exponential;
mod far_angle;
mod logarithm;
mod tangent;

pub use angle::sin_cos;
pub use approximate::{exp2_rough, inverse_rough, log2_rough, power_rough};
pub use exponential::exp;
pub use logarithm::ln;
pub use tangent::tanh;

use super::Real;

/// `x` to a power: zero and infinity have theirs where the exponent is not zero, a negative `x` has none.
///
/// The relative error stays below `(1 + |exponent ln x|) 2.5e-16`, that of rounding the logarithm.
#[inline(always)]
pub fn pow<R: Real>(x: R, exponent: f64) -> R {
    exp(ln(x).scale(exponent))
}

/// 1.5 * 2^52: added to a number below 2^51 in size it leaves the nearest whole number in the last bits.
const WHOLE: f64 = 6755399441055744.0;

/// The nearest whole number, the even one of two; `|x| < 2^51`.
#[inline(always)]
fn round<R: Real>(x: R) -> R {
    (x + R::constant(WHOLE)) - R::constant(WHOLE)
}

/// `2^k` for a whole `k` from -1022 to 1023: the exponent field is written by hand.
#[inline(always)]
fn two_to<R: Real>(k: R) -> R {
    (k + R::constant(WHOLE + 1023.0)).each(|biased| f64::from_bits(biased.to_bits() << 52))
}

/// `c[0] + c[1] x + c[2] x^2 + c[3] x^3`, with short chains of operations.
#[inline(always)]
fn cubic<R: Real>(x: R, square: R, c: [f64; 4]) -> R {
    linear(x, [c[0], c[1]]) + square * linear(x, [c[2], c[3]])
}

/// `c[0] + c[1] x`.
#[inline(always)]
fn linear<R: Real>(x: R, c: [f64; 2]) -> R {
    R::constant(c[0]) + x.scale(c[1])
}
