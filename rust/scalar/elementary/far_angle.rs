//! The reduction of angles far from zero by right angles.

use std::f64::consts::FRAC_PI_2;

/// The binary digits of 2/pi, with 64 zeros before the point (from an integer series; mpmath agrees).
const TURNS: [u64; 21] = [
    0x0000000000000000,
    0xa2f9836e4e441529,
    0xfc2757d1f534ddc0,
    0xdb6295993c439041,
    0xfe5163abdebbc561,
    0xb7246e3a424dd2e0,
    0x06492eea09d1921c,
    0xfe1deb1cb129a73e,
    0xe88235f52ebb4484,
    0xe99c7026b45f7e41,
    0x3991d639835339f4,
    0x9c845f8bbdf9283b,
    0x1ff897ffde05980f,
    0xef2f118b5a0a6d1f,
    0x6d367ecf27cb09b7,
    0x4f463f669e5fea2d,
    0x7527bac7ebe5f17b,
    0x3d0739f78a5292ea,
    0x6bfb5fb11f8d5d08,
    0x56033046fc7b6bab,
    0xf0cfbc209af4361d,
];

/// The rounding error of `FRAC_PI_2`.
const REST: f64 = 6.123233995736766e-17;

/// The number of right angles nearest to `x`, modulo 4, and what is left, as a sum of two numbers; `|x| >= 1`.
///
/// All digits of 2/pi that count are multiplied by `x` as whole numbers: those before them make full turns, those
/// after them are below 2^-137 of a right angle (M. H. Payne and R. N. Hanek, ACM SIGNUM Newsletter 18 (1983) 19).
/// No number is closer to a multiple of a right angle than 2^-62, so that 75 bits are left at least.
#[cold]
#[inline(never)]
pub(super) fn reduce(x: f64) -> (f64, f64, f64) {
    if !x.is_finite() {
        return (0.0, f64::NAN, f64::NAN);
    }
    // |x| is whole * 2^exponent.
    let bits = x.to_bits();
    let whole = (bits & 0x000f_ffff_ffff_ffff) | 0x0010_0000_0000_0000;
    let exponent = ((bits >> 52) & 0x7ff) as i64 - 1075;
    // The digit that makes two right angles of the last one of `whole`, and those after it.
    let first = (exponent + 62) as usize;
    let digits = |i: usize| {
        let (word, shift) = (first / 64 + i, first % 64);
        let after = if shift == 0 { 0 } else { TURNS[word + 1] >> (64 - shift) };
        u128::from((TURNS[word] << shift) | after)
    };
    // The product, lowest word first; what is beyond 192 bits are full turns.
    let factor = u128::from(whole);
    let low = digits(2) * factor;
    let middle = digits(1) * factor + (low >> 64);
    let high = (digits(0) * factor + (middle >> 64)) as u64;
    let (middle, low) = (middle as u64, low as u64);
    // Two bits of right angles, then a fraction, of which the nearest whole number is taken away.
    let fraction = [(high << 2) | (middle >> 62), (middle << 2) | (low >> 62), low << 2];
    let beyond = fraction[0] >> 63 == 1;
    let turns = (high >> 62).wrapping_add(u64::from(beyond)) & 3;
    let size = if beyond { negated(fraction) } else { fraction };
    let (a, b) = two_numbers(size);

    // Times a right angle.
    let product = a * FRAC_PI_2;
    let rest = a.mul_add(FRAC_PI_2, -product) + (a * REST + b * FRAC_PI_2);
    let left = product + rest;
    let tail = (product - left) + rest;
    if beyond == (x < 0.0) { (signed(turns, x), left, tail) } else { (signed(turns, x), -left, -tail) }
}

/// The turns of `x` from those of its size.
fn signed(turns: u64, x: f64) -> f64 {
    if x < 0.0 { -(turns as f64) } else { turns as f64 }
}

/// 1 less a fraction of 192 bits.
fn negated([high, middle, low]: [u64; 3]) -> [u64; 3] {
    let (low, carry) = (!low).overflowing_add(1);
    let (middle, carry) = (!middle).overflowing_add(u64::from(carry));
    [(!high).wrapping_add(u64::from(carry)), middle, low]
}

/// A fraction of 192 bits as a sum of two numbers.
fn two_numbers([mut high, mut middle, mut low]: [u64; 3]) -> (f64, f64) {
    let mut scale = 1.0;
    while high == 0 && middle | low != 0 {
        (high, middle, low) = (middle, low, 0);
        scale *= 2f64.powi(-64);
    }
    let zeros = high.leading_zeros();
    if zeros > 0 && zeros < 64 {
        high = (high << zeros) | (middle >> (64 - zeros));
        middle = (middle << zeros) | (low >> (64 - zeros));
        scale *= 2f64.powi(-(zeros as i32));
    }
    // 53 bits are a number; of the next 64 it is rounded.
    let a = (high >> 11) as f64;
    let b = ((high << 53) | (middle >> 11)) as f64;
    (a * 2f64.powi(-53) * scale, b * 2f64.powi(-117) * scale)
}
