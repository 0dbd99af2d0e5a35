//! Zeros of functions of one variable.

use crate::scalar::{Mask, Real};

/// A zero of `f` between `a` and `b`, where it has the values `fa` and `fb` of opposite sign, in each of
/// the lanes; what the others get means nothing.
///
/// Regula falsi after Anderson & Björck (BIT 13 (1973) 253), with a bisection every third time, which
/// bounds the work. A lane stops where `|f| <= zero` or its bracket is down to rounding.
#[inline(always)]
pub fn bracketed<R: Real>(
    mut f: impl FnMut(R) -> R,
    (mut a, mut fa): (R, R),
    (mut b, mut fb): (R, R),
    zero: R,
    mut lanes: R::Mask,
) -> R {
    // A zero at the start of the bracket is the answer.
    let at_start = fa.abs().less(R::constant(f64::MIN_POSITIVE));
    b = R::select(lanes.and(at_start), a, b);
    lanes = lanes.and(at_start.not());
    for count in 1..=200 {
        let done = zero.less(fb.abs()).not().or(b.abs().scale(f64::EPSILON).less((b - a).abs()).not());
        lanes = lanes.and(done.not());
        if !lanes.any() {
            break;
        }
        let c = if count % 3 == 0 { (a + b).scale(0.5) } else { b - fb * (b - a) / (fb - fa) };
        let fc = f(c);
        let crossed = differ::<R>(fc, fb);
        // If the end `a` stays, weigh it down, so that it is replaced soon, too.
        let weight = R::one() - fc / fb;
        let weight = R::select(R::zero().less(weight), weight, R::constant(0.5));
        let kept = (a, fa * weight);
        let new = (R::select(crossed, b, kept.0), R::select(crossed, fb, kept.1));
        (a, fa) = (R::select(lanes, new.0, a), R::select(lanes, new.1, fa));
        (b, fb) = (R::select(lanes, c, b), R::select(lanes, fc, fb));
    }
    b
}

/// True if one of the two is negative and the other is not.
#[inline(always)]
fn differ<R: Real>(a: R, b: R) -> R::Mask {
    let (a, b) = (a.less(R::zero()), b.less(R::zero()));
    a.and(b.not()).or(b.and(a.not()))
}

#[cfg(test)]
mod tests {
    use super::bracketed;

    /// 200 calls bisect a bracket of 50 down to rounding.
    fn finds(f: fn(f64) -> f64, a: f64, b: f64, wanted: f64) {
        let mut calls = 0;
        let counted = |x| {
            calls += 1;
            f(x)
        };
        let found = bracketed(counted, (a, f(a)), (b, f(b)), 0.0, true);
        assert!((found - wanted).abs() < 1e-15, "{found} for {wanted}");
        assert!(calls <= 200, "{calls} calls");
    }

    #[test]
    fn finds_simple_and_flat_zeros() {
        finds(|x| x * x - 2.0, 0.0, 2.0, 2f64.sqrt());
        finds(|x| x.powi(9), -0.3, 1.0, 0.0);
        finds(|x| (x - 0.1).tanh() * 1e-20, 0.0, 50.0, 0.1);
        finds(|x| x - 0.75, 0.0, 0.75, 0.75);
    }
}
