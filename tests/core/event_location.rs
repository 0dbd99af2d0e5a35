//! Steps end on switching surfaces and on the wall.

use std::cell::Cell;

use proptest::prelude::*;
use udd::integrate::{Ending, Failure, Integrator, Tolerance, propagate};
use udd::model::effects::{Effect, Kind};
use udd::model::{Disk, DiskFamily, Family, PendulumFamily, Sides, System};
use udd::scalar::{Dual, Scalar};

fn disk(w: f64, edge: bool) -> Disk<f64> {
    DiskFamily { effects: vec![], edge }.build(&[w, 0.08, 9.81, 0.012, 0.103, 0.055])
}

const KINK: f64 = (0.103 - 0.012) / 0.055;

#[test]
fn the_disk_lands_on_its_surfaces_to_1e12() {
    let disk = disk(0.088, false);
    let mut driver: Integrator<_, f64, _> =
        Integrator::new(&disk, 0.0, [3.0, 0.005, 0.0, 0.0], None, &Tolerance::default());
    let mut seen = [0; 2];
    let mut before = 3.0;
    while driver.t() < 60.0 {
        let ending = driver.advance(60.0).unwrap();
        let omega = driver.x()[0];
        if let Ending::Surface(j) = ending {
            seen[j] += 1;
            let off = if j == 0 { omega } else { omega.abs() - KINK };
            assert!(off.abs() < 1e-12, "surface {j} missed by {off:e} at {}", driver.t());
        }
        // No accepted step goes across.
        let across = |a: f64, b: f64, at: f64| {
            (a - at > 1e-12 && b - at < -1e-12) || (a - at < -1e-12 && b - at > 1e-12)
        };
        for at in [0.0, KINK, -KINK] {
            assert!(!across(before, omega, at), "{before} to {omega} at {}", driver.t());
        }
        before = omega;
    }
    assert!(seen[0] > 20 && seen[1] > 40, "{seen:?}");
    // Each reversal passes the kink once slowing down and once speeding up.
    assert!((seen[1] as i64 - 2 * seen[0] as i64).abs() <= 2, "{seen:?}");
    println!("{seen:?} {:?}", driver.counts());
}

#[test]
fn a_run_over_kinks_converges_with_the_tolerance() {
    let disk = disk(0.088, false);
    let x0 = [3.0, 0.005, 0.0, 0.0];
    let run = |rtol| propagate(&disk, 0.0, 3.0, x0, &Tolerance::new(rtol, 1e-3 * rtol)).unwrap();
    let exact = run(1e-13);
    for rtol in [1e-6, 1e-8, 1e-10] {
        let x = run(rtol);
        // The error per unit step is proportional to the tolerance; the flow amplifies it by less than 1e3.
        assert!((x[0] - exact[0]).abs() < 1e3 * rtol, "{rtol}: {}", x[0] - exact[0]);
    }
}

/// Derivatives over many kinks agree with central differences.
#[test]
fn tangents_pass_the_kinks() {
    type N = Dual<f64, 5>;
    let tight = Tolerance::new(1e-12, 1e-14);
    let plain = [0.088, 0.08, 9.81, 0.012, 0.103, 0.055];
    let x0 = [3.0, 0.005, 0.0, 0.0];
    let family = DiskFamily { effects: vec![], edge: false };
    let mut values = plain.map(N::fixed);
    values[0] = N::variable(plain[0], 4);
    let x =
        propagate(&family.build(&values), 0.0, 2.0, std::array::from_fn(|i| N::variable(x0[i], i)), &tight)
            .unwrap();
    for i in 0..5 {
        let shifted = |by: f64| {
            let (mut x, mut p) = (x0, plain);
            if i < 4 {
                x[i] += by
            } else {
                p[0] += by
            }
            propagate(&family.build(&p), 0.0, 2.0, x, &tight).unwrap()
        };
        let step = 1e-6;
        let (up, down) = (shifted(step), shifted(-step));
        for n in 0..4 {
            let difference = (up[n] - down[n]) / (2.0 * step);
            // Rounding of the runs over the step, and the step's square times a third derivative.
            let allowed = 1e-5 * (1.0 + x[n].d[i].abs()) * 10.0;
            assert!((x[n].d[i] - difference).abs() < allowed, "d x{n}/d {i}: {} {difference}", x[n].d[i]);
        }
    }
}

#[test]
fn a_start_on_a_surface_takes_the_flow_s_side() {
    let disk = disk(0.014, false);
    for (y, sign) in [(1e-3, 1.0), (-1e-3, -1.0)] {
        let mut driver: Integrator<_, f64, _> =
            Integrator::new(&disk, 0.0, [0.0, y, 0.04, 0.0], None, &Tolerance::default());
        assert_eq!(driver.advance(1.0).unwrap(), Ending::Free);
        assert!(driver.x()[0] * sign > 0.0);
    }
}

#[test]
fn runs_go_backwards_too() {
    let disk = disk(0.088, false);
    let tight = Tolerance::new(1e-12, 1e-15);
    let x0 = [3.0, 0.005, 0.0, 0.0];
    let there = propagate(&disk, 0.0, 1.0, x0, &tight).unwrap();
    let back = propagate(&disk, 1.0, 0.0, there, &tight).unwrap();
    for n in 0..4 {
        // Backward in time the friction's contraction, exp(-1/s * about 5 s), becomes growth.
        assert!((back[n] - x0[n]).abs() < 1e-8, "{back:?}");
    }
}

#[test]
fn the_wall_ends_the_run_at_1e12() {
    let disk = disk(0.039, true);
    let mut driver: Integrator<_, f64, _> =
        Integrator::new(&disk, 0.0, [0.0, 1e-3, 0.04, 0.0], None, &Tolerance::default()).with_wall();
    let ending = loop {
        match driver.advance(1000.0).unwrap() {
            Ending::Wall => break Ending::Wall,
            ending if driver.t() == 1000.0 => break ending,
            _ => {}
        }
    };
    assert_eq!(ending, Ending::Wall);
    let [_, y, z, _] = *driver.x();
    assert!((y * y + z * z - 0.0064).abs() < 1e-12 * 0.0064);
}

/// A particle under the law `x'' = -1` left of 0 and `x'' = -1 - x` right of it, which is continuous.
/// `rates` are counted.
struct Parabola<'a>(&'a Cell<u64>);

// The tests use one thread.
unsafe impl Sync for Parabola<'_> {}

impl<S: Scalar> System<S, 2> for Parabola<'_> {
    fn rates(&self, _t: S, x: &[S; 2], sides: &Sides<S>) -> [S; 2] {
        self.0.set(self.0.get() + 1);
        [x[1], S::select(sides[0], -S::one() - x[0], -S::one())]
    }
    fn surfaces(&self) -> usize {
        1
    }
    fn surface(&self, _j: usize, _t: S, x: &[S; 2], _sides: &Sides<S>) -> S {
        x[0]
    }
}

/// Crossings of the surface by a parabola that rises to `height` above it.
fn crossings(height: f64) -> Result<(usize, f64, u64), Failure> {
    let calls = Cell::new(0);
    let system = Parabola(&calls);
    let x0 = [height - 0.5, 1.0];
    let mut driver: Integrator<_, f64, _> =
        Integrator::new(&system, 0.0, x0, Some(2.0), &Tolerance::default());
    let mut count = 0;
    while driver.t() < 2.0 {
        count += usize::from(matches!(driver.advance(2.0)?, Ending::Surface(_)));
    }
    Ok((count, driver.x()[0], calls.get()))
}

#[test]
fn a_surface_crossed_twice_in_a_step_is_seen() {
    // The first trial step would go over both crossings. Right of 0 the flight takes 2 atan(v) instead
    // of 2 v, v being the speed on entering.
    for height in [0.3, 0.1, 1e-2, 1e-4, 1e-6] {
        let (count, end, calls) = crossings(height).unwrap();
        assert_eq!(count, 2, "height {height}");
        let v = f64::sqrt(2.0 * height);
        let exact = height - 0.5 * (1.0 + 2.0 * (v - v.atan())).powi(2);
        assert!((end - exact).abs() < 1e-8, "height {height}: ends at {end} for {exact}");
        assert!(calls < 400, "height {height}: {calls} evaluations");
    }
}

#[test]
fn grazing_is_not_a_trap() {
    for height in [0.0, 1e-9, 1e-12, 1e-14, 1e-16, -1e-16, -1e-14, -1e-12, -1e-9] {
        let (count, end, calls) = crossings(height).unwrap();
        assert!(count <= 3, "height {height}: {count} crossings");
        assert!((end - (height - 0.5)).abs() < 1e-10, "height {height}: ends at {end}");
        assert!(calls < 2000, "height {height}: {calls} evaluations");
    }
}

proptest! {
    /// From any start, at any tolerance: every event lies on its surface, the work is bounded, and the
    /// run agrees with a tight one.
    #[test]
    fn any_run_lands_and_ends(
        w in 0.0..0.1f64,
        omega in prop_oneof![Just(0.0), Just(KINK), Just(-KINK), -15.0..15.0f64],
        y in prop_oneof![Just(0.0), -0.05..0.05f64],
        z in -0.05..0.05f64,
        digits in 4.0..12.0f64,
    ) {
        let disk = disk(w, false);
        let rtol = 10f64.powf(-digits);
        let tolerance = Tolerance::new(rtol, 1e-3 * rtol);
        let x0 = [omega, y, z, 0.0];
        let mut driver: Integrator<_, f64, _> = Integrator::new(&disk, 0.0, x0, None, &tolerance);
        while driver.t() < 0.5 {
            let ending = driver.advance(0.5).unwrap();
            let speed = driver.x()[0].abs();
            if let Ending::Surface(j) = ending {
                let off = [speed, speed - KINK][j].abs();
                prop_assert!(off < 2e-12, "surface {j} missed by {off:e}");
            }
            // At 1e-12 a run of 0.5 s takes up to 1000 steps.
            prop_assert!(driver.counts().evaluations < 20_000, "{:?}", driver.counts());
        }
        let tight = propagate(&disk, 0.0, 0.5, x0, &Tolerance::new(1e-13, 1e-16)).unwrap();
        for n in 0..4 {
            // Errors of up to 100 steps, amplified by up to 100 over half a second.
            let allowed = 1e4 * rtol * [15.0, 0.1, 0.1, 5.0][n];
            prop_assert!((driver.x()[n] - tight[n]).abs() < allowed, "{:?} and {tight:?}", driver.x());
        }
    }
}

#[test]
fn an_end_that_is_no_number_fails() {
    let disk = DiskFamily { effects: vec![], edge: false }.build(&[0.039, 0.08, 9.81, 0.012, 0.103, 0.055]);
    for end in [f64::NAN, f64::INFINITY] {
        let run = propagate(&disk, 0.0, end, [0.0, 1e-3, 0.04, 0.0], &Tolerance::default());
        assert!(matches!(run, Err(Failure::NotFinite { .. })), "{run:?}");
    }
}

/// A disk or a pendulum that comes to rest stays on the surface `Omega = 0` to within rounding: the run
/// goes on all the same, whatever the tolerance.
#[test]
fn rest_is_no_obstacle() {
    let disk = DiskFamily { effects: Vec::new(), edge: false };
    let mut seed = 11u64;
    let mut uniform = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    for k in 0..600 {
        let tolerance = Tolerance::new([1e-9, 1e-7, 1e-6][k % 3], [1e-12, 1e-10, 1e-9][k % 3]);
        let built = disk.build(&[[0.0, 1e-6, 1e-4][k % 3], 0.08, 9.81, 0.012, 0.103, 0.055]);
        let start = [2.0 * uniform(), 0.1 * uniform(), 0.1 * uniform(), 0.0];
        let end = propagate(&built, 0.0, 60.0, start, &tolerance);
        assert!(end.is_ok(), "{start:?}: {end:?}");
    }
    let dry = Effect::new(Kind::Coulomb);
    let pendulum = PendulumFamily { effects: vec![dry] }.build(&[0.3, 0.09, 9.81, 0.05, 0.01, 0.05]);
    for k in 0..40 {
        let tolerance = Tolerance::new(1e-8, [1e-9, 1e-12][k % 2]);
        let end = propagate(&pendulum, 0.0, 200.0, [0.0, 2.0 * uniform()], &tolerance).unwrap();
        // Dry friction smoothed over eps lets it creep to the bottom.
        assert!(end[0].abs() < 1e-6, "{end:?}");
    }
}
