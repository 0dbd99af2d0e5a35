//! Nothing is allocated inside the step loop, but where a step is searched over intervals. For whole runs see `batch.rs`.

use crate::counting::allocations;
use udd::integrate::{Dopri5, Ending, Integrator, Method, Taylor, Tolerance};
use udd::model::effects::{Effect, FrictionModel, Kind};
use udd::model::{DiskFamily, DleFamily, Family, System};
use udd::scalar::Isa;
use udd::tape::Tape;

const START: [f64; 3] = [1.0, 1.0, 0.01];
const TOLERANCE: Tolerance = Tolerance::new(1e-8, 1e-11);

/// Steps to `end` without asking the heap for anything; returns their number.
fn nothing_in_steps<M: System<f64, D>, const D: usize, K: Method<f64, D>>(
    mut driver: Integrator<M, f64, D, Tolerance, K>,
    end: f64,
) -> usize {
    Isa::best();
    let mut steps = 0;
    let asked = allocations(|| {
        while driver.t() < end && driver.advance(end) != Ok(Ending::Wall) {
            steps += 1;
        }
    });
    assert_eq!((asked, driver.t()), (0, end), "in {steps} steps");
    steps
}

#[test]
fn steps_by_either_method() {
    let values = [1.0, 0.0];
    let dle = DleFamily.build(&values);
    assert!(
        nothing_in_steps(Integrator::by(Dopri5::default(), dle, 0.0, START, None, &TOLERANCE), 100.0) > 100
    );
    let tape = Tape::record(&DleFamily, &[None, Some(0.0)]).unwrap();
    for isa in Isa::available() {
        let taylor = Taylor::new(&tape, values.to_vec(), 18, isa);
        assert!(nothing_in_steps(Integrator::by(taylor, dle, 0.0, START, None, &TOLERANCE), 100.0) > 50);
    }
}

/// A disk that slips, sticks and meets its friction's kink, until shortly before it leaves the wheels.
#[test]
fn steps_over_surfaces() {
    let effects = vec![Effect::new(Kind::QuadraticDrag), Effect::new(Kind::Relaxation)];
    let values = [0.039, 0.08, 9.81, 0.012, 0.103, 0.055, 1e-4, 1.0];
    let disk = DiskFamily { effects, edge: true }.build(&values);
    let driver = Integrator::by(Dopri5::default(), &disk, 0.0, [3.0, 0.005, 0.0, 0.0], None, &TOLERANCE);
    assert!(nothing_in_steps(driver.with_wall(), 3.0) > 100);
}

/// The law of a contact at rest over intervals takes room, a few times in each step at rest.
#[test]
fn steps_of_a_contact_that_sticks() {
    let effects = vec![Effect::new(Kind::Coulomb).with_treatment(FrictionModel::SetValued)];
    let values = [0.039, 0.08, 9.81, 0.012, 0.103, 0.055, 5e-3, 0.05];
    let disk = DiskFamily { effects, edge: true }.build(&values);
    let mut driver =
        Integrator::by(Dopri5::default(), &disk, 0.0, [3.0, 0.005, 0.0, 0.0], None, &TOLERANCE).with_wall();
    let mut steps = 0;
    let asked = allocations(|| {
        while driver.t() < 3.0 && driver.advance(3.0) != Ok(Ending::Wall) {
            steps += 1;
        }
    });
    assert!(asked < 4 * steps, "{asked} times in {steps} steps");
}
