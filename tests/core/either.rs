//! Two models behind one type are what they are by themselves.

use udd::integrate::{Counts, Ending, Integrator, Tolerance};
use udd::model::effects::{Effect, FrictionModel, Kind};
use udd::model::{AnySystem, DiskFamily, Either, Family, FormulaFamily, System, sides_of};
use udd::scalar::{Dual, Scalar, constants};

type Four = Either<DiskFamily, FormulaFamily<4>>;

const VALUES: [f64; 8] = [0.039, 0.08, 9.81, 0.012, 0.103, 0.055, 0.003, 0.05];

fn own() -> FormulaFamily<4> {
    let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
    let equations = ["b-a*d", "c*t", "d-k1*a", "k2*k3*a"];
    let parameters = names(&["k1", "k2", "k3", "k4", "k5", "k6", "k7", "k8"]);
    FormulaFamily::parse(&names(&["a", "b", "c", "d"]), &equations, &parameters, &[]).unwrap()
}

/// Compares all that a system says at a state, on both sides of every surface.
fn same<S: Scalar<Real = f64, Mask = bool> + PartialEq>(one: &impl System<S, 4>, other: &impl System<S, 4>) {
    let (t, x): (S, [S; 4]) = (S::constant(0.7), [-0.8, 0.01, -0.02, 0.3].map(S::constant));
    let sides = sides_of(one, t, &x);
    assert!(sides == sides_of(other, t, &x));
    assert_eq!((one.surfaces(), one.watched()), (other.surfaces(), other.watched()));
    assert!(one.wall(&x) == other.wall(&x));
    assert!(one.rates(t, &x, &sides) == other.rates(t, &x, &sides));
    for j in 0..one.surfaces() {
        assert!(one.surface(j, t, &x, &sides) == other.surface(j, t, &x, &sides));
        assert_eq!(one.jumps(j), other.jumps(j));
        let (mut a, mut b) = ((x, sides), (x, sides));
        one.switch(j, t, &mut a.0, &mut a.1, true);
        other.switch(j, t, &mut b.0, &mut b.1, true);
        assert!(a == b, "surface {j}");
        for side in [false, true] {
            assert_eq!(one.surface_name(j, side), other.surface_name(j, side));
        }
        assert!(one.rates(t, &x, &a.1) == other.rates(t, &x, &b.1));
    }
}

/// A run of a disk that sticks and slips: where it got to and what it took.
fn run(system: impl System<f64, 4>) -> ([f64; 4], Counts) {
    let x0 = [1.0, 0.01, -0.02, 0.3];
    let mut driver: Integrator<_, f64, 4> = Integrator::new(system, 0.0, x0, None, &Tolerance::default());
    let mut landed = 0;
    while driver.t() < 20.0 {
        landed += usize::from(driver.advance(20.0).unwrap() != Ending::Free);
    }
    assert!(landed > 10, "{landed}");
    (*driver.x(), driver.counts())
}

#[test]
fn a_forgotten_type_is_the_one_that_it_was() {
    let friction = Effect::new(Kind::Coulomb).with_treatment(FrictionModel::SetValued);
    let disk = DiskFamily { effects: vec![friction], edge: true }.build(&VALUES);
    let forgotten: &dyn AnySystem<f64, 4> = &disk;
    same::<f64>(&disk, &forgotten);
    assert_eq!(run(&disk), run(forgotten));
}

#[test]
fn either_is_the_one_that_it_holds() {
    let friction = Effect::new(Kind::Coulomb).with_treatment(FrictionModel::SetValued);
    let disk = DiskFamily { effects: vec![friction], edge: true };
    let (first, second) = (Four::First(disk.clone()), Four::Second(own()));
    assert_eq!(first.parameters(), disk.parameters());
    assert_eq!(second.parameters(), own().parameters());
    same::<f64>(&disk.build(&VALUES), &first.build(&VALUES));
    same::<f64>(&own().build(&VALUES), &second.build(&VALUES));
    let wide: Vec<Dual<f64, 1>> = constants(&VALUES);
    same(&disk.build(&wide), &first.build(&wide));
    same(&own().build(&wide), &second.build(&wide));
}
