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
    if k < 2 {
        return S::zero();
    }
    if k == 2 {
        return a[1] * b[1];
    }
    let pairs = (k - 1) / 2;
    let (a_low, a_high) = (&a[1..=pairs], &a[k - pairs..k]);
    let (b_low, b_high) = (&b[1..=pairs], &b[k - pairs..k]);
    let pair = |q: usize| a_low[pairs - 1 - q] * b_high[q] + a_high[q] * b_low[pairs - 1 - q];
    let mut sum = pair(0);
    if k.is_multiple_of(2) {
        sum = a[k / 2] * b[k / 2] + sum;
    }
    sum_of(pairs, sum, pair)
}

/// `sum of a[j] a[k-j] for j in 1..k`, at half the cost.
#[inline(always)]
pub fn inner_square<S: Scalar, const N: usize>(a: &[S; N], k: usize) -> S {
    if k < 2 {
        return S::zero();
    }
    if k == 2 {
        return a[1].square();
    }
    let pairs = (k - 1) / 2;
    let (low, high) = (&a[1..=pairs], &a[k - pairs..k]);
    let pair = |q: usize| low[pairs - 1 - q] * high[q];
    let half = sum_of(pairs, pair(0), pair);
    let sum = half + half;
    if k.is_multiple_of(2) { sum + a[k / 2].square() } else { sum }
}

/// The sum of the pairs, of which `first` is the first one.
#[inline(always)]
fn sum_of<S: Scalar>(pairs: usize, first: S, pair: impl Fn(usize) -> S) -> S {
    if pairs == 1 {
        return first;
    }
    let (mut even, mut odd) = (first, pair(1));
    let mut q = 2;
    while q + 1 < pairs {
        even += pair(q);
        odd += pair(q + 1);
        q += 2;
    }
    if q < pairs {
        even += pair(q);
    }
    even + odd
}

/// Coefficient `k` of the product.
#[inline(always)]
pub fn product<S: Scalar, const N: usize>(a: &[S; N], b: &[S; N], k: usize) -> S {
    match k {
        0 => a[0] * b[0],
        1 => a[0] * b[1] + a[1] * b[0],
        _ => inner(a, b, k) + (a[0] * b[k] + a[k] * b[0]),
    }
}

/// Coefficient `k` of the square.
#[inline(always)]
pub fn square<S: Scalar, const N: usize>(a: &[S; N], k: usize) -> S {
    match k {
        0 => a[0].square(),
        1 => (a[0] + a[0]) * a[1],
        _ => inner_square(a, k) + (a[0] + a[0]) * a[k],
    }
}
