//! Products of power series, one coefficient at a time.
//!
//! The order of the sums is the same for every width of the numbers. Terms come in pairs, from the
//! middle of the series outwards, so that the coefficients found last enter last: a single trajectory
//! waits for them as shortly as possible. Two sums run side by side, so that a packet's additions
//! need not wait for each other.

use crate::scalar::Scalar;

/// `sum of a[j] b[k-j] for j in 1..k`, the coefficient `k` of the product without its first and last term.
#[inline(always)]
pub fn inner<S: Scalar, const N: usize>(a: &[S; N], b: &[S; N], k: usize) -> S {
    let pairs = k.saturating_sub(1) / 2;
    let (a_low, a_high) = (&a[1..=pairs], &a[k - pairs..k]);
    let (b_low, b_high) = (&b[1..=pairs], &b[k - pairs..k]);
    // Adding -0 changes nothing, not even the sign of a zero.
    let (mut even, mut odd) = (S::constant(-0.0), S::constant(-0.0));
    if k >= 2 && k.is_multiple_of(2) {
        even += a[k / 2] * b[k / 2];
    }
    let outwards = a_low.rchunks_exact(2).zip(b_high.chunks_exact(2));
    for ((al, bh), (bl, ah)) in outwards.zip(b_low.rchunks_exact(2).zip(a_high.chunks_exact(2))) {
        even += al[1] * bh[0] + ah[0] * bl[1];
        odd += al[0] * bh[1] + ah[1] * bl[0];
    }
    if !pairs.is_multiple_of(2) {
        even += a_low[0] * b_high[pairs - 1] + a_high[pairs - 1] * b_low[0];
    }
    even + odd
}

/// `sum of a[j] a[k-j] for j in 1..k`, at half the cost.
#[inline(always)]
pub fn inner_square<S: Scalar, const N: usize>(a: &[S; N], k: usize) -> S {
    let pairs = k.saturating_sub(1) / 2;
    let (low, high) = (&a[1..=pairs], &a[k - pairs..k]);
    let (mut even, mut odd) = (S::constant(-0.0), S::constant(-0.0));
    for (low, high) in low.rchunks_exact(2).zip(high.chunks_exact(2)) {
        even += low[1] * high[0];
        odd += low[0] * high[1];
    }
    if !pairs.is_multiple_of(2) {
        even += low[0] * high[pairs - 1];
    }
    let half = even + odd;
    let sum = half + half;
    if k >= 2 && k.is_multiple_of(2) { sum + a[k / 2].square() } else { sum }
}
