//! Effects and models that are given as text: they compute what the compiled ones do.

use std::array::from_fn;
use std::sync::Arc;

use crate::counting::allocations;
use proptest::prelude::*;
use udd::formula::Mistake;
use udd::model::effects::{Formula, Kind, Slot};
use udd::model::{
    DiskFamily, DleFamily, Effect, Family, FormulaFamily, Momentum, PendulumFamily, System, sides_of,
};
use udd::scalar::{Dual, LANES, Packet, Plain, Real, Scalar};
use udd::tape::Tape;

const PLAIN: [f64; 6] = [0.039, 0.08, 9.81, 0.012, 0.103, 0.055];

/// An effect of the library with its values, its slot, the same as a formula, and that one's amplitudes.
type Twin = (Kind, &'static [f64], Slot, &'static str, &'static [&'static str]);

/// Effects of the library with their values, and the same as text.
const TWINS: [Twin; 9] = [
    (Kind::QuadraticDrag, &[1e-3], Slot::Torque, "-c*abs(Omega)*Omega", &["c"]),
    (Kind::Coulomb, &[1e-3, 0.05], Slot::Torque, "-c*tanh(Omega/eps)", &["c", "eps"]),
    (Kind::UnevenDisk, &[0.01, 0.02, 3.0], Slot::Torque, "a*sin(n*beta) + b*cos(n*beta)", &["a", "b", "n"]),
    (Kind::RadialFriction, &[0.2], Slot::Friction, "c*(Y^2 + Z^2)", &["c"]),
    (Kind::Tilt, &[0.02], Slot::Torque, "a*g*Z", &["a"]),
    (Kind::Relaxation, &[5.0], Slot::Vertical, "-b*W*Z", &["b"]),
    (Kind::LateralSlip, &[0.3], Slot::Lateral, "-c*Y", &["c"]),
    (Kind::DriveDrift, &[0.01], Slot::Vertical, "a*W*t", &["a"]),
    (
        Kind::LoadDrive,
        &[0.1],
        Slot::Vertical,
        "a*W*(Z*Omega^2 + Y*(g*Y - k*Omega - W*Z*Omega)/inertia)/g",
        &["a"],
    ),
];

fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(|&name| name.to_owned()).collect()
}

fn formula(slot: Slot, text: &str, parameters: &[&str], amplitudes: &[&str]) -> Result<Formula, Mistake> {
    Formula::parse("own", slot, text, &names(parameters), &names(amplitudes))
}

/// Both ways to enter where there are two, in the library's form and as text.
fn twins() -> Vec<(Effect, Effect, &'static [f64])> {
    let mut list = Vec::new();
    for (kind, values, slot, text, parameters) in TWINS {
        let own = Effect::formula(Arc::new(
            formula(slot, text, parameters, &parameters[..1]).unwrap_or_else(|_| {
                formula(slot, text, parameters, &parameters[..2]).expect("linear in one parameter or two")
            }),
        ));
        let momenta = kind.spec().momenta;
        if momenta.is_empty() {
            list.push((Effect::new(kind), own.clone(), values));
        }
        for &momentum in momenta {
            let entering = |effect: Effect| effect.with_momentum(Some(momentum));
            list.push((entering(Effect::new(kind)), entering(own.clone()), values));
        }
    }
    list
}

fn rates<S: Scalar, const D: usize>(system: &impl System<S, D>, t: S, x: &[S; D]) -> [S; D] {
    system.rates(t, x, &sides_of(system, t, x))
}

/// The rates of both disks over numbers made of plain ones by `of`.
fn both<S: Scalar>(
    (library, own, values): &(Effect, Effect, &[f64]),
    of: impl Fn(f64, usize) -> S,
    (t, x): (f64, [f64; 4]),
) -> [[S; 4]; 2] {
    [library, own].map(|effect| {
        let disk = DiskFamily { effects: vec![effect.clone()], edge: false };
        let p: Vec<S> = PLAIN.iter().chain(*values).enumerate().map(|(i, &v)| of(v, 10 + i)).collect();
        rates(&disk.build(&p), of(t, 0), &from_fn(|n| of(x[n], 1 + n)))
    })
}

fn close(a: f64, b: f64) -> bool {
    // A few roundings of sums whose terms cancel.
    (a - b).abs() <= 1e-12 * (1.0 + a.abs())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Over numbers, and over duals in every direction, those of duals in the flow included.
    #[test]
    fn a_formula_computes_what_the_library_does(
        t in 0.0..60.0f64,
        omega in prop_oneof![-12.0..-0.1f64, 0.1..12.0f64],
        radius in 0.005..0.07f64,
        angle in 0.0..std::f64::consts::TAU,
        beta in -20.0..20.0f64,
    ) {
        type N = Dual<f64, 2>;
        let at = (t, [omega, radius * angle.sin(), radius * angle.cos(), beta]);
        for pair in twins() {
            for moved in [0, 1, 2, 3, 4, 10, 12, 13, 16, 17] {
                let of = |v: f64, i: usize| if i == moved { N::variable(v, 1) } else { N::fixed(v) };
                let [a, b] = both(&pair, of, at);
                for n in 0..4 {
                    prop_assert!(close(a[n].re, b[n].re), "{:?}: {a:?} {b:?}", pair.1);
                    // A derivative is as large as the rate over what is moved.
                    let size = 1.0 + (1.0 + a[n].re.abs()) / 1e-3;
                    prop_assert!((a[n].d[1] - b[n].d[1]).abs() <= 1e-12 * (size + a[n].d[1].abs()), "{:?}", pair.1);
                }
            }
        }
    }
}

/// Derivatives of splines, in the coordinate and in each coefficient, against differences.
#[test]
fn splines_have_derivatives() {
    type N = Dual<f64, 1>;
    let own = ["a", "b", "c", "d", "e"];
    for text in [
        "spline(Z, -0.03, 0.04, a, b, c, d, e)",
        "periodic(beta, 0, 6.5, a, b, c, d, e)",
        "periodic(atan2(Y, Z), -3, 3.3, a, b, c, d, e)",
    ] {
        let effect = Effect::formula(Arc::new(formula(Slot::Vertical, text, &own, &own).unwrap()));
        let disk = DiskFamily { effects: vec![effect], edge: false };
        let values: Vec<f64> = PLAIN.into_iter().chain([0.02, 0.07, -0.02, 0.04, 0.03]).collect();
        for (z, beta) in [(0.013, 1.0), (-0.0299, -9.3), (0.05, 6.4)] {
            let x = [1.0, 0.01, z, beta];
            for moved in [2, 3, 10, 11, 12, 13, 14] {
                let at = |by: f64| {
                    let (mut x, mut p) = (x, values.clone());
                    if moved < 4 {
                        x[moved] += by
                    } else {
                        p[moved - 4] += by
                    }
                    rates(&disk.build(&p), 0.0, &x)
                };
                let of = |v: f64, i: usize| N { re: v, d: [f64::from(i == moved)] };
                let p: Vec<N> = values.iter().enumerate().map(|(i, &v)| of(v, 4 + i)).collect();
                let exact = rates(&disk.build(&p), N::fixed(0.0), &from_fn(|n| of(x[n], n)));
                let (up, down) = (at(1e-6), at(-1e-6));
                for n in 0..4 {
                    let difference = (up[n] - down[n]) / 2e-6;
                    // Roundings of rates of 30 over the step, and a third derivative of 1e6.
                    assert!(
                        (exact[n].d[0] - difference).abs() < 1e-6 + 1e-6 * difference.abs(),
                        "{text} {moved} {n}"
                    );
                }
            }
        }
    }
}

/// A packet's lanes have the bits of single numbers, comparisons included.
#[test]
fn packets_have_the_bits_of_numbers() {
    type P = Packet<LANES, Plain>;
    let text = "spline(Y, -0.01, 0.05, e, f, h, l, m) + periodic(beta, 0, 3, e, f, h, l) + c*(atan2(Y, Z - 0.02) + atan(beta) + bspline(3*Omega) + bspline(Omega - 1) + abs(Z) + Omega^3*exp(-Y) - 1/(2 + cos(beta)))";
    let own = Effect::formula(Arc::new(
        formula(Slot::Vertical, text, &["e", "f", "h", "l", "m", "c"], &[]).unwrap(),
    ));
    let disk = DiskFamily { effects: vec![own], edge: false };
    let values: Vec<f64> = PLAIN.into_iter().chain([0.1, 0.7, -0.2, 0.4, 0.3, 0.1]).collect();
    let at = |lane: usize| {
        let s = lane as f64;
        [0.7 * s - 1.0, 0.01 * s, 0.03 - 0.02 * s, s]
    };
    let wide: Vec<P> = values.iter().map(|&v| P::constant(v)).collect();
    let x: [P; 4] = from_fn(|n| P::from_lanes(|lane| at(lane)[n]));
    let together = rates(&disk.build(&wide), P::constant(0.5), &x);
    for lane in 0..LANES {
        let alone = rates(&disk.build(&values), 0.5, &at(lane));
        assert_eq!(from_fn(|n| together[n].lane(lane).to_bits()), alone.map(f64::to_bits), "{lane}");
    }
}

/// The kink of `abs(Omega)` is landed on, so that the solution still has a power series, and so have
/// the cells of a spline; other kinks have none.
#[test]
fn smooth_formulas_have_series() {
    let recorded = |slot, text: &str| {
        let own = Effect::formula(Arc::new(formula(slot, text, &["c"], &["c"]).unwrap()));
        Tape::record(&DiskFamily { effects: vec![own], edge: false }, &[]).is_ok()
    };
    assert!(recorded(Slot::Torque, "-c*abs(Omega)*Omega^2"));
    assert!(recorded(Slot::Vertical, "c*W*ln(2 + sin(beta))*tanh(t)"));
    assert!(!recorded(Slot::Torque, "c*abs(Z)"));
    assert!(!recorded(Slot::Torque, "c*bspline(Omega)"));
    assert!(!recorded(Slot::Torque, "c*atan2(Y, Z)"));
    let own = ["a", "b", "c", "d"];
    let bent = formula(Slot::Torque, "spline(Z, 0, 1, a, b, c, d)", &own, &own).unwrap();
    let bent = DiskFamily { effects: vec![Effect::formula(Arc::new(bent))], edge: false };
    assert!(Tape::record(&bent, &[]).is_ok());
}

#[test]
fn what_is_no_effect_is_refused() {
    let mistake = |slot, text: &str, own: &[&str], linear: &[&str]| {
        formula(slot, text, own, linear).expect_err(text).to_string()
    };
    for (text, own, linear, wanted) in [
        ("c*q", &["c"][..], &["c"][..], "unknown name q"),
        ("c*atan2(Y)", &["c"][..], &["c"][..], "needs two numbers after atan2"),
        ("c*Omega'", &["c"], &["c"], "may not use rates"),
        ("sin(c*Z)", &["c"], &["c"], "not proportional to c"),
        ("a*b*Z", &["a", "b"], &["a", "b"], "not proportional to a, b"),
        ("a*Z + 1", &["a"], &["a"], "not proportional"),
        ("Z/a", &["a"], &["a"], "not proportional"),
        ("a*Z", &["a", "b"], &["a"], "does not use its parameter b"),
        ("W*Z", &["W"], &[], "cannot have a parameter called W"),
        ("sin*Z", &["sin"], &[], "cannot have a parameter called sin"),
        ("c = Z", &["c"], &["c"], "has ="),
        ("spline(Z, 0, 1, a, b, c)", &["a", "b", "c"], &["a"], "needs spline(x, low, high, c0, c1, ...)"),
        ("spline(Z, 1, 0, a, b, c, d)", &["a", "b", "c", "d"], &["a"], "needs spline(x, low, high"),
        ("spline(Z, 0, 1, a, c, b, d)", &["a", "b", "c", "d"], &["a"], "needs spline(x, low, high"),
        ("spline(Z, 0, 1, a, b, c, d)", &["a", "b", "c", "d"], &["a"], "not proportional to a"),
        ("spline(a*Z, 0, 1, a, b, c, d)", &["a", "b", "c", "d"], &["a", "b", "c", "d"], "not proportional"),
        ("c*W*theta", &["c"], &["c"], "mixes what only a disk has"),
    ] {
        let found = mistake(Slot::Torque, text, own, linear);
        assert!(found.contains(wanted), "{text}: {found}");
    }
    assert!(mistake(Slot::Vertical, "c*theta", &["c"], &["c"]).contains("mixes"));
    // A formula that is jointly linear in its amplitudes is an effect.
    assert!(formula(Slot::Torque, "-(a*Z - Y*b/(1 + n^2))*2", &["a", "b", "n"], &["a", "b"]).is_ok());
    assert!(formula(Slot::Torque, "sin(t)*Z", &[], &[]).is_ok());
}

// --- models

fn dle() -> FormulaFamily<3> {
    let texts = ["y - omega", "omega*z", "w - omega*y - B*w*z"];
    FormulaFamily::parse(&names(&["omega", "y", "z"]), &texts, &names(&["w", "B"]), &[]).unwrap()
}

/// The model from text is recorded as the built-in one is, so that its series are unrolled too.
#[test]
fn a_model_as_text_has_the_tape_of_the_compiled_one() {
    for fixed in [&[None, None][..], &[None, Some(0.0)]] {
        let (own, built_in) =
            (Tape::record(&dle(), fixed).unwrap(), Tape::record(&DleFamily, fixed).unwrap());
        assert_eq!(own, built_in);
    }
    let x = [1.3, -0.4, 2.5];
    assert_eq!(
        rates(&dle().build(&[1.7, 0.2]), 0.0, &x).map(f64::to_bits),
        rates(&DleFamily.build(&[1.7, 0.2]), 0.0, &x).map(f64::to_bits)
    );
}

/// So is the disk, whatever the order of the operands and however its numbers are named.
#[test]
fn the_disk_in_other_words_has_its_series() {
    let parameters = names(&["W", "k0", "k1", "k2", "g", "R"]);
    let states = names(&["Omega", "Y", "Z", "beta"]);
    let record = |texts: [&str; 4]| {
        let family = FormulaFamily::<4>::parse(&states, &texts, &parameters, &[]).unwrap();
        Tape::record(&family, &[None; 6]).unwrap()
    };
    let one = record([
        "(g*Y - max(k1 - k2*abs(Omega), k0)*Omega - W*Z*Omega)/(R^2/2 + Y^2 + Z^2)",
        "Z*Omega",
        "W - Y*Omega",
        "Omega",
    ]);
    let other = record([
        "(Y*g - Omega*max(-abs(Omega)*k2 + k1, k0) - Omega*(Z*W))/(Z*Z + (Y^2 + 0.5*R*R))",
        "Omega*Z",
        "-(Omega*Y) + W",
        "Omega",
    ]);
    assert!(one.is_unrolled() && other.is_unrolled());
    // Another drive in one of the equations is another law.
    let mixed = record([
        "(g*Y - max(k1 - k2*abs(Omega), k0)*Omega - W*Z*Omega)/(R^2/2 + Y^2 + Z^2)",
        "Z*Omega",
        "g - Y*Omega",
        "Omega",
    ]);
    assert!(!mixed.is_unrolled());
}

#[test]
fn equations_that_cannot_be_used_are_named() {
    let mistake = |texts: &[&str; 2]| {
        let (n, mistake) =
            FormulaFamily::<2>::parse(&names(&["x", "v"]), texts, &names(&["k"]), &[]).unwrap_err();
        format!("{n}: {mistake}")
    };
    assert!(mistake(&["v", "-q*x"]).starts_with("1: has the unknown name q; allowed are the state x, v"));
    assert!(mistake(&["x'", "-k*x"]).starts_with("0: has x', but this formula may not use rates"));
    assert!(mistake(&["v", "v = 2"]).contains("only the right-hand side"));
}

/// Evaluation takes no memory, however deep the formula.
#[test]
fn nothing_is_allocated_in_an_evaluation() {
    let deep = format!("{}c*Z{}", "(1 - Y*".repeat(8), ")".repeat(8));
    for (text, linear) in [("c*Z", &["c"][..]), (deep.as_str(), &[])] {
        let own = formula(Slot::Vertical, text, &["c"], linear).unwrap();
        let disk = DiskFamily { effects: vec![Effect::formula(Arc::new(own))], edge: false };
        let disk = disk.build(&[&PLAIN[..], &[0.1]].concat());
        let x = [1.0, 0.01, 0.02, 0.3];
        assert_eq!(allocations(|| std::hint::black_box(rates(&disk, 0.0, &x))), 0, "{text}");
    }
    let own = dle().build(&[1.0, 0.2]);
    assert_eq!(allocations(|| std::hint::black_box(rates(&own, 0.0, &[1.0, 1.0, 0.01]))), 0);
}

/// A pendulum's own names mean the disk's quantities at its bob.
#[test]
fn a_pendulum_has_names_of_its_own() {
    let of = |text: &str| {
        let own = formula(Slot::Torque, text, &["c"], &["c"]).unwrap();
        let family = PendulumFamily { effects: vec![Effect::formula(Arc::new(own))] };
        rates(&family.build(&[0.5, 0.25, 9.81, 0.0, 0.3]), 0.0, &[1.5, 0.7])
    };
    assert_eq!(of("c*length*sin(theta)"), of("c*Y"));
    assert_eq!(of("c*theta"), of("c*beta"));
    let disk = Effect::formula(Arc::new(formula(Slot::Torque, "c*Y", &["c"], &["c"]).unwrap()));
    assert_eq!(disk.momentum, None::<Momentum>);
}
