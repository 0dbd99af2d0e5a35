//! Zeros of functions of one variable.

/// A zero of `f` between `a` and `b`, where it has the values `fa` and `fb` of opposite sign.
///
/// Regula falsi after Anderson & Björck (BIT 13 (1973) 253), with a bisection every third time, which
/// bounds the work. It stops where `|f| <= zero` or the bracket is down to rounding.
pub fn bracketed(
    mut f: impl FnMut(f64) -> f64,
    (mut a, mut fa): (f64, f64),
    (mut b, mut fb): (f64, f64),
    zero: f64,
) -> f64 {
    if fa == 0.0 {
        return a;
    }
    for count in 1..=200 {
        if fb.abs() <= zero || (b - a).abs() <= f64::EPSILON * b.abs() {
            break;
        }
        let c = if count % 3 == 0 { 0.5 * (a + b) } else { b - fb * (b - a) / (fb - fa) };
        let fc = f(c);
        if (fc < 0.0) != (fb < 0.0) {
            (a, fa) = (b, fb);
        } else {
            // The end `a` stays: weigh it down, so that it too is replaced soon.
            let weight = 1.0 - fc / fb;
            fa *= if weight > 0.0 { weight } else { 0.5 };
        }
        (b, fb) = (c, fc);
    }
    b
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
        let found = bracketed(counted, (a, f(a)), (b, f(b)), 0.0);
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
