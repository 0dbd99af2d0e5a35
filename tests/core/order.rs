//! Orders of convergence, measured: the slope of the error over the step size in a log-log plot.

use std::array::from_fn;

use udd::integrate::tableau::DormandPrince;
use udd::integrate::{Dop853, Dopri5, Method, StepStart, Tolerance, step};
use udd::model::{DiskFamily, Dle, Family, System, sides_of};
use udd::scalar::{Dual, Scalar};

/// `n` equal steps over `[0, end]`.
fn fixed<S: Scalar<Real = f64>, const D: usize>(
    system: &impl System<S, D>,
    x0: [S; D],
    end: f64,
    n: usize,
) -> [S; D] {
    let h = end / n as f64;
    let mut x = x0;
    for i in 0..n {
        let t = i as f64 * h;
        let sides = sides_of(system, S::lift(t), &x);
        let rate = system.rates(S::lift(t), &x, &sides);
        x = step::<DormandPrince, _, D, 7, 4>(system, t, &x, &rate, h, &sides).0;
    }
    x
}

/// Least-squares slope of `log error` over `log h`.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(h, e)| (h.ln(), e.ln())).collect();
    let (mx, my) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let sxy: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    let sxx: f64 = logs.iter().map(|(x, _)| (x - mx).powi(2)).sum();
    sxy / sxx
}

fn distance<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (0..D).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// The tolerance that the issue asks for.
const WITHIN: f64 = 0.1;
/// Steps over the interval; the reference takes 16 times as many as the finest, which makes its own
/// error 1e-6 of the smallest measured.
const COUNTS: [usize; 5] = [64, 90, 128, 180, 256];
const REFERENCE: usize = 4096;

#[test]
fn states_of_the_dle_are_of_order_5() {
    let dle = Dle { w: 1.0, b: 0.2 };
    let x0 = [1.0, 1.0, 0.01];
    let exact = fixed(&dle, x0, 4.0, REFERENCE);
    let points = COUNTS.map(|n| (1.0 / n as f64, distance(fixed(&dle, x0, 4.0, n), exact)));
    assert!((slope(&points) - 5.0).abs() < WITHIN, "slope {} of {points:?}", slope(&points));
}

#[test]
fn tangents_of_the_dle_are_of_order_5() {
    type N = Dual<f64, 4>;
    // Directions 0..3 are the initial state's, direction 3 the drive.
    let dle = Dle { w: N::variable(1.0, 3), b: N::fixed(0.2) };
    let x0: [N; 3] = from_fn(|i| N::variable([1.0, 1.0, 0.01][i], i));
    let flat = |x: [N; 3]| -> [f64; 12] { from_fn(|i| x[i / 4].d[i % 4]) };
    let exact = flat(fixed(&dle, x0, 4.0, REFERENCE));
    let points = COUNTS.map(|n| (1.0 / n as f64, distance(flat(fixed(&dle, x0, 4.0, n)), exact)));
    assert!((slope(&points) - 5.0).abs() < WITHIN, "slope {} of {points:?}", slope(&points));
}

#[test]
fn tangents_of_the_disk_are_of_order_5_on_a_smooth_piece() {
    type N = Dual<f64, 8>;
    // Over 0.1 s from 3 rad/s no surface is met.
    let family = DiskFamily { effects: vec![], edge: false };
    let plain = [0.088, 0.08, 9.81, 0.012, 0.103, 0.055];
    let values: Vec<N> =
        (0..6).map(|i| if i < 4 { N::variable(plain[i], 4 + i) } else { N::fixed(plain[i]) }).collect();
    let disk = family.build(&values);
    let x0: [N; 4] = from_fn(|i| N::variable([3.0, 0.01, -0.02, 0.0][i], i));
    let flat = |x: [N; 4]| -> [f64; 32] { from_fn(|i| x[i / 8].d[i % 8]) };
    let exact = flat(fixed(&disk, x0, 0.1, 1024));
    let points =
        [16, 24, 32, 48, 64].map(|n| (1.0 / n as f64, distance(flat(fixed(&disk, x0, 0.1, n)), exact)));
    assert!((slope(&points) - 5.0).abs() < WITHIN, "slope {} of {points:?}", slope(&points));
}

/// The error of the polynomial of one step, at this part of it, for steps of these sizes.
fn inside_a_step<K: Method<f64, 3> + Default>(theta: f64, sizes: [f64; 5]) -> [(f64, f64); 5] {
    let dle = Dle { w: 1.0, b: 0.2 };
    let x0 = [1.0, 1.0, 0.01];
    let start = StepStart { t: 0.0, x: x0, sides: sides_of(&dle, 0.0, &x0) };
    sizes.map(|h| {
        let mut method = K::default();
        method.begin(&dle, &start, true);
        method.attempt(&dle, &start, h, &Tolerance::default());
        method.extend(&dle, &start);
        (h, distance(method.at(theta * h), fixed(&dle, x0, theta * h, 64)))
    })
}

/// Over one step the polynomial's error is `h^5` (order 4).
#[test]
fn dense_output_is_of_order_4() {
    for theta in [0.3, 0.62] {
        let points = inside_a_step::<Dopri5<f64, 3>>(theta, [0.08, 0.06, 0.04, 0.03, 0.02]);
        assert!((slope(&points) - 5.0).abs() < WITHIN, "slope {} at {theta}", slope(&points));
    }
}

/// `n` equal steps of any method over `[0, end]`.
fn stepped<K: Method<f64, 3> + Default>(dle: &Dle<f64>, x0: [f64; 3], end: f64, n: usize) -> [f64; 3] {
    let (mut method, h) = (K::default(), end / n as f64);
    let mut at = StepStart { t: 0.0, x: x0, sides: sides_of(dle, 0.0, &x0) };
    for _ in 0..n {
        method.begin(dle, &at, true);
        at.x = method.attempt(dle, &at, h, &Tolerance::default()).x;
        at.t += h;
    }
    at.x
}

#[test]
fn dop853_is_of_order_8() {
    let dle = Dle { w: 1.0, b: 0.2 };
    let x0 = [1.0, 1.0, 0.01];
    let exact = fixed(&dle, x0, 4.0, REFERENCE);
    let points = [6, 7, 8, 10, 12]
        .map(|n| (1.0 / n as f64, distance(stepped::<Dop853<f64, 3>>(&dle, x0, 4.0, n), exact)));
    // Terms of order 9 still show at the longest step.
    assert!((slope(&points) - 8.0).abs() < 3.0 * WITHIN, "slope {} of {points:?}", slope(&points));
}

/// Over one step the polynomial's error is `h^8` (order 7).
#[test]
fn the_extension_of_dop853_is_of_order_7() {
    for theta in [0.3, 0.62] {
        let points = inside_a_step::<Dop853<f64, 3>>(theta, [0.8, 0.65, 0.52, 0.42, 0.34]);
        assert!((slope(&points) - 8.0).abs() < 3.0 * WITHIN, "slope {} at {theta}", slope(&points));
    }
}
