//! Reference states on which independent integrators agree to the digits given.

use udd::integrate::{Tolerance, propagate};
use udd::model::{Disk, DiskFamily, Dle, Family};

fn tight() -> Tolerance {
    Tolerance::new(1e-15, 1e-15)
}

/// Asserts that `got` rounds to `wanted`, whose digits end at `unit`; one unit is left for the
/// reference's own rounding.
fn agrees<const D: usize>(got: &[f64], wanted: [f64; D], unit: f64, what: &str) {
    for n in 0..D {
        assert!((got[n] - wanted[n]).abs() <= unit, "{what}, component {n}: {} for {}", got[n], wanted[n]);
    }
}

#[test]
fn dle() {
    let cases = [
        (1.0, 0.0, [1.0, 1.0, 0.01], 10.0, [0.97664030875, 0.98317480213, 0.04343309237]),
        (1.0, 0.0, [1.0, 1.0, 0.01], 30.0, [0.32011311025, -0.38840279112, -0.23230343728]),
        (7.1, 0.0, [1.0, 1.0, 0.01], 10.0, [2.73182986436, -3.08519098040, -3.12651694271]),
        (3.7, 0.2, [3.7f64.sqrt(), 3.7f64.sqrt(), -3.2], 10.0, [0.76514351119, 1.60344735353, 3.21882737548]),
        (
            3.7,
            0.2,
            [3.7f64.sqrt(), 3.7f64.sqrt(), -3.2],
            100.0,
            [1.71475462137, 0.53438908815, -0.05743429282],
        ),
    ];
    for (w, b, x0, t, wanted) in cases {
        let x = propagate(&Dle { w, b }, 0.0, t, x0, &tight()).unwrap();
        // By t = 100 the flow has amplified the rounding of 5e4 steps to 2e-11.
        agrees(&x, wanted, if t == 100.0 { 3e-11 } else { 1e-11 }, &format!("w = {w}, B = {b}, t = {t}"));
    }
}

fn disk(w: f64) -> Disk<f64> {
    DiskFamily { effects: vec![], edge: false }.build(&[w, 0.08, 9.81, 0.012, 0.103, 0.055])
}

#[test]
fn full_model() {
    let x = propagate(&disk(0.014), 0.0, 1.0, [0.0, 1e-3, 0.04, 0.0], &tight()).unwrap();
    agrees(&x, [14.9706688195], 1e-10, "W = 0.014, Omega");
    agrees(&x[1..], [0.004251571054, -0.050389104409], 1e-12, "W = 0.014, centre");
    let x = propagate(&disk(0.088), 0.0, 5.0, [3.0, 0.005, 0.0, 0.0], &tight()).unwrap();
    agrees(&x, [-12.75829282], 1e-8, "W = 0.088, Omega");
    agrees(&x[1..], [0.000867902072, -0.024075474092], 1e-12, "W = 0.088, centre");
}
