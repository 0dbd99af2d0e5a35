//! Exact relations of the models, and exact solutions.
//!
//! Time averages that are exact on every bounded orbit follow from total derivatives, so over a finite
//! time they hold with a known boundary term. The integrals are carried along as further components.

use std::array::from_fn;

use udd::integrate::{Integrator, Tolerance, propagate};
use udd::model::{Disk, DiskFamily, Dle, Family, Sides, System};
use udd::scalar::Dual;

const TIGHT: Tolerance = Tolerance::new(1e-12, 1e-13);

/// Components for a state of up to four and up to six integrals.
const T: usize = 10;

/// A system of `D` components and integrals along its orbit, which start at component 4.
struct WithIntegrals<'a, M, const D: usize>(&'a M, &'a (dyn Fn(&[f64; D]) -> [f64; 6] + Sync));

impl<const D: usize, M: System<f64, D>> WithIntegrals<'_, M, D> {
    fn state(x: &[f64; T]) -> [f64; D] {
        from_fn(|i| x[i])
    }
}

impl<const D: usize, M: System<f64, D>> System<f64, T> for WithIntegrals<'_, M, D> {
    fn rates(&self, t: f64, x: &[f64; T], sides: &Sides<f64>) -> [f64; T] {
        let own = Self::state(x);
        let (rates, integrands) = (self.0.rates(t, &own, sides), (self.1)(&own));
        from_fn(|i| match i {
            0..4 => rates.get(i).copied().unwrap_or(0.0),
            _ => integrands[i - 4],
        })
    }
    fn surfaces(&self) -> usize {
        self.0.surfaces()
    }
    fn surface(&self, j: usize, t: f64, x: &[f64; T], sides: &Sides<f64>) -> f64 {
        self.0.surface(j, t, &Self::state(x), sides)
    }
}

/// The state at `end` and the integrals up to there.
fn integrals<M: System<f64, D>, const D: usize>(
    system: &M,
    x0: [f64; D],
    end: f64,
    integrands: &(dyn Fn(&[f64; D]) -> [f64; 6] + Sync),
) -> ([f64; D], [f64; 6]) {
    let start = from_fn(|i| if i < D { x0[i] } else { 0.0 });
    let x = propagate(&WithIntegrals(system, integrands), 0.0, end, start, &TIGHT).unwrap();
    (from_fn(|i| x[i]), from_fn(|i| x[4 + i]))
}

/// The error of an integral over the time is what steps of this tolerance leave, `rtol` times the
/// integrand's largest values times the number of steps, about 1e4.
fn equal(a: f64, b: f64, time: f64, what: &str) {
    assert!((a - b).abs() / time < 1e-9, "{what}: {a} and {b}");
}

#[test]
fn averages_of_the_dle() {
    for (w, b, x0) in
        [(1.0, 0.0, [1.0, 1.0, 0.01]), (7.1, 0.0, [1.0, 1.0, 0.01]), (3.7, 0.2, [1.9, 1.9, -3.2])]
    {
        let end = 500.0;
        let dle = Dle { w, b };
        let (x, [oy, oo, oz, z, zz, yy_ooz]) =
            integrals(&dle, x0, end, &|&[o, y, z]| [o * y, o * o, o * z, z, z * z, y * y + o * o * z]);
        let change = |f: fn([f64; 3]) -> f64| f(x) - f(x0);
        // z' = w - omega y - B w z
        equal(oy, w * end - b * w * z - change(|x| x[2]), end, "<omega y> = w (1 - B <z>)");
        // (omega^2)'/2 = omega y - omega^2
        equal(oo, oy - change(|x| x[0] * x[0] / 2.0), end, "<omega^2> = <omega y>");
        // y' = omega z
        equal(oz, change(|x| x[1]), end, "<omega z> = 0");
        // (y^2 + z^2)'/2 = w z - B w z^2
        equal(w * z, b * w * zz + change(|x| (x[1] * x[1] + x[2] * x[2]) / 2.0), end, "<z> = B <z^2>");
        // (omega y)' = y^2 - omega y + omega^2 z
        equal(yy_ooz, oy + change(|x| x[0] * x[1]), end, "<y^2> + <omega^2 z> = <omega y>");
        // The averages themselves, their boundary terms being below 40 over the time.
        assert!((oo / end - w * (1.0 - b * z / end)).abs() < 40.0 / end);
    }
}

#[test]
fn volumes_of_the_dle_contract_at_the_exact_rate() {
    type N = Dual<f64, 3>;
    for (w, b) in [(1.0, 0.0), (3.7, 0.2)] {
        let dle = Dle { w: N::fixed(w), b: N::fixed(b) };
        let x0 = from_fn(|i| N::variable([1.0, 1.0, 0.01][i], i));
        let time = 5.0;
        let x = propagate(&dle, 0.0, time, x0, &TIGHT).unwrap();
        let [a, b_, c] = x.map(|v| v.d);
        let determinant = a[0] * (b_[1] * c[2] - b_[2] * c[1]) - a[1] * (b_[0] * c[2] - b_[2] * c[0])
            + a[2] * (b_[0] * c[1] - b_[1] * c[0]);
        // The sum of the exponents is -(1 + B w).
        assert!((determinant.ln() / time + 1.0 + b * w).abs() < 1e-8, "{determinant}");
    }
}

fn disk(w: f64, g: f64) -> Disk<f64> {
    DiskFamily { effects: vec![], edge: false }.build(&[w, 0.08, g, 0.012, 0.103, 0.055])
}

#[test]
fn averages_of_the_full_model() {
    // 3.9 and 5.5 cm/s cross the edge, which is ignored.
    for w in [0.014, 0.039, 0.055, 0.088] {
        let end = 60.0;
        let x0 = [3.0, 0.005, 0.0, 0.0];
        let (x, [yo, z, friction, ..]) = integrals(&disk(w, 9.81), x0, end, &|&[o, y, z, _]| {
            let k = f64::max(0.103 - 0.055 * o.abs(), 0.012);
            [y * o, z, k * o * o, 0.0, 0.0, 0.0]
        });
        let change = |f: fn([f64; 4]) -> f64| f(x) - f(x0);
        equal(yo, w * end - change(|x| x[2]), end, "<Y Omega> = W");
        equal(w * z, change(|x| (x[1] * x[1] + x[2] * x[2]) / 2.0), end, "<Z> = 0");
        let energy = change(|x| (0.0032 + x[1] * x[1] + x[2] * x[2]) * x[0] * x[0] / 2.0 + 9.81 * x[2]);
        equal(friction, 9.81 * w * end - energy, end, "<k Omega^2> = g W");
    }
}

#[test]
fn without_gravity_the_disk_at_rest_is_lifted() {
    let x = propagate(&disk(0.039, 0.0), 0.0, 1.5, [0.0, 0.01, -0.03, 2.0], &TIGHT).unwrap();
    // A straight line is integrated exactly.
    for (got, wanted) in x.iter().zip([0.0, 0.01, -0.03 + 0.039 * 1.5, 2.0]) {
        assert!((got - wanted).abs() < 1e-15, "{x:?}");
    }
}

#[test]
fn without_drive_the_centre_stays_on_a_circle() {
    let disk = disk(0.0, 9.81);
    let mut driver: Integrator<_, f64, _> = Integrator::new(&disk, 0.0, [0.0, 0.03, 0.04, 0.0], None, &TIGHT);
    while driver.t() < 10.0 {
        driver.advance(10.0).unwrap();
        let [_, y, z, _] = *driver.x();
        assert!((y.hypot(z) - 0.05).abs() < 1e-11, "{:e} at {}", y.hypot(z) - 0.05, driver.t());
    }
}

#[test]
fn the_axis_is_a_solution() {
    let x = propagate(&Dle { w: 2.0, b: 0.0 }, 0.0, 3.0, [0.0, 0.0, -1.0], &TIGHT).unwrap();
    assert!(x[0] == 0.0 && x[1] == 0.0 && (x[2] - 5.0).abs() < 1e-14, "{x:?}");
}

#[test]
fn mirrored_starts_give_mirrored_runs() {
    // Every operation is odd or even in the mirrored components, so the runs agree to the last bit.
    let (x0, mirror) = ([3.0, 0.005, 0.01, 0.5], |x: [f64; 4]| [-x[0], -x[1], x[2], -x[3]]);
    let disk = disk(0.088, 9.81);
    let run = |x0| propagate(&disk, 0.0, 10.0, x0, &Tolerance::default()).unwrap();
    assert_eq!(run(mirror(x0)), mirror(run(x0)));
    let dle = Dle { w: 1.0, b: 0.0 };
    let run = |x0| propagate(&dle, 0.0, 50.0, x0, &Tolerance::default()).unwrap();
    let [o, y, z] = run([1.0, 1.0, 0.01]);
    assert_eq!(run([-1.0, -1.0, 0.01]), [-o, -y, z]);
}
