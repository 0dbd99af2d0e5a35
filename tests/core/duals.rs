//! Dual numbers against an independent implementation (`num-dual`) and closed forms.

use num_dual::{Dual64, DualNum};
use proptest::prelude::*;
use udd::scalar::{Dual, Scalar};

type D1 = Dual<f64, 1>;

/// Equal up to the rounding of a few operations.
fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-13 * (1.0 + a.abs().max(b.abs()))
}

fn same(ours: D1, theirs: Dual64) -> bool {
    close(ours.re, theirs.re) && close(ours.d[0], theirs.eps)
}

proptest! {
    #[test]
    fn arithmetic(a in -5.0..5.0f64, da in -2.0..2.0f64, b in 0.1..5.0f64, db in -2.0..2.0f64) {
        let (x, y) = (D1 { re: a, d: [da] }, D1 { re: b, d: [db] });
        let (u, v) = (Dual64::new(a, da), Dual64::new(b, db));
        prop_assert!(same(x + y, u + v));
        prop_assert!(same(x - y, u - v));
        prop_assert!(same(x * y, u * v));
        prop_assert!(same(x / y, u / v));
        prop_assert!(same(-x, -u));
        prop_assert!(same(x.square(), u * u));
        prop_assert!(same(x.scale(3.5), u * 3.5));
        prop_assert!(same(x.times(b), u * b));
    }

    #[test]
    fn elementary_functions(a in 0.1..4.0f64, da in -2.0..2.0f64) {
        let (x, u) = (D1 { re: a, d: [da] }, Dual64::new(a, da));
        prop_assert!(same(x.sqrt(), u.sqrt()));
        prop_assert!(same(x.exp(), u.exp()));
        prop_assert!(same(x.ln(), u.ln()));
        prop_assert!(same((-x).sin(), (-u).sin()));
        prop_assert!(same((-x).cos(), (-u).cos()));
        prop_assert!(same((-x).tanh(), (-u).tanh()));
    }

    /// A dual of a dual gives mixed second derivatives: of `x^2 sin(y)`, `2 x cos(y)`.
    #[test]
    fn nesting(a in -3.0..3.0f64, b in -3.0..3.0f64) {
        type Outer = Dual<D1, 1>;
        let x = Outer { re: D1::variable(a, 0), d: [D1::fixed(0.0)] };
        let y = Outer { re: D1::fixed(b), d: [D1::fixed(1.0)] };
        let mixed = (x.square() * y.sin()).d[0].d[0];
        prop_assert!(close(mixed, 2.0 * a * b.cos()));
    }

    #[test]
    fn selection_takes_the_derivative_along(a in -3.0..3.0f64, b in -3.0..3.0f64) {
        prop_assume!(a != b);
        let (x, y) = (Dual::<f64, 2>::variable(a, 0), Dual::<f64, 2>::variable(b, 1));
        let least = Dual::select(x.less(y), x, y);
        prop_assert_eq!(least, if a < b { x } else { y });
    }
}
