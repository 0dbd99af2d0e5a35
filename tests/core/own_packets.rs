//! Models given as text: in packets they have the bits of runs one by one.

use std::sync::atomic::AtomicUsize;

use udd::analysis::{
    CancelFlag, Ensemble, EnsembleRun, ExecutionContext, Lyapunov, LyapunovOptions, MethodChoice, Section,
    SectionRun,
};
use udd::formula::{Expression, Names};
use udd::integrate::Tolerance;
use udd::model::FormulaFamily;
use udd::scalar::Isa;
use udd::tape::Tape;

const VALUES: [f64; 2] = [1.5, 0.3];

fn model<const D: usize>(states: [&str; D], equations: [&str; D]) -> FormulaFamily<D> {
    let names = ["k", "c"].map(str::to_owned);
    FormulaFamily::parse(&states.map(str::to_owned), &equations, &names, &[]).unwrap()
}

/// Spread over a cube of side 4 around `centre`.
fn starts<const D: usize>(n: usize, centre: [f64; D]) -> Vec<[f64; D]> {
    let by = [0.618, 0.414, 0.732, 0.236, 0.303, 0.141, 0.718, 0.577, 0.261, 0.891, 0.685, 0.526];
    let part = |i: usize, d: usize| centre[d] + 4.0 * (i as f64 * by[d]).fract() - 2.0;
    (0..n).map(|i| std::array::from_fn(|d| part(i, d))).collect()
}

/// A chain of Duffing oscillators, padded with unused states up to `D`.
fn chain<const D: usize>(oscillators: usize) -> FormulaFamily<D> {
    let name = |letter: &str| (0..oscillators).map(|i| format!("{letter}{i}")).collect::<Vec<_>>();
    let (x, v) = (name("x"), name("v"));
    let mut equations = v.clone();
    for i in 0..oscillators {
        let pulls =
            (0..oscillators).filter(|j| i.abs_diff(*j) == 1).map(|j| format!("+c*({}-{})", x[j], x[i]));
        equations.push(format!("-k*{}-{}^3{}", x[i], x[i], pulls.collect::<String>()));
    }
    let texts: Vec<&str> = equations.iter().map(String::as_str).collect();
    FormulaFamily::parse(&[x, v].concat(), &texts, &["k", "c"].map(str::to_owned), &[]).unwrap()
}

/// How many runs fail, after comparing all of them with runs one by one.
fn failures<const D: usize>(family: &FormulaFamily<D>, centre: [f64; D], times: &[f64], rtol: f64) -> usize {
    let tape = Tape::record(family, &[None, None]).unwrap();
    assert!(!tape.is_unrolled());
    let (starts, values, stop) = (starts(21, centre), [VALUES.to_vec()], CancelFlag::new());
    let tolerance = Tolerance::new(rtol, 1e-3 * rtol);
    let run = |starts: &[[f64; D]], isa, threads| -> Vec<EnsembleRun<D>> {
        let done = AtomicUsize::new(0);
        let all =
            Ensemble { family, values: &values, starts, times, tolerance, stepper: MethodChoice::Taylor };
        let all = all.run(ExecutionContext { threads, isa, done: &done, stop: &stop });
        all.into_iter().map(Option::unwrap).collect()
    };
    let told = |passage: &EnsembleRun<D>| {
        let bits = |x: &[f64; D]| x.map(f64::to_bits);
        let states: Vec<_> = passage.states.iter().map(bits).collect();
        (states, passage.t.to_bits(), bits(&passage.x), format!("{:?}", passage.outcome))
    };
    let alone: Vec<_> = starts.iter().flat_map(|&x| run(&[x], Isa::Baseline, 1)).collect();
    for isa in Isa::available() {
        // Counts that leave lanes empty, and more than there are lanes.
        for (n, threads) in [(2, 1), (3, 1), (11, 1), (21, 1), (21, 2)] {
            let together = run(&starts[..n], isa, threads);
            assert_eq!(together.len(), n);
            for (i, (one, single)) in together.iter().zip(&alone).enumerate() {
                assert_eq!(told(one), told(single), "{isa:?}, run {i} of {n}, {:?}", starts[i]);
            }
        }
    }
    alone.iter().filter(|passage| passage.outcome.is_err()).count()
}

const TIMES: [f64; 5] = [0.0, 0.01, 0.5, 0.51, 6.0];

#[test]
fn smooth_laws() {
    for rtol in [1e-6, 1e-9] {
        let oscillator = model(["x", "v"], ["v", "k*(1-x^2)*v-x+c*cos(1.2*t)"]);
        assert_eq!(failures(&oscillator, [0.1, 0.2], &TIMES, rtol), 0);
        let lorenz = model(["x", "y", "z"], ["10*(y-x)", "x*(28-z)-y", "x*y-8/3*z"]);
        assert_eq!(failures(&lorenz, [0.0, 0.0, 20.0], &TIMES, rtol), 0);
        let bend = "(3-cos(2*(a-b)))";
        let pendulum = model(
            ["a", "b", "p", "q"],
            [
                "p",
                "q",
                &format!("(-3*sin(a)-sin(a-2*b)-2*sin(a-b)*(q^2+p^2*cos(a-b)))/{bend}"),
                &format!("2*sin(a-b)*(2*p^2+2*cos(a)+q^2*cos(a-b))/{bend}"),
            ],
        );
        assert_eq!(failures(&pendulum, [0.5, 0.1, 0.0, 0.0], &TIMES, rtol), 0);
    }
}

/// More states than usual, some of them padding.
#[test]
fn chains_of_oscillators() {
    for rtol in [1e-6, 1e-9] {
        assert_eq!(failures(&chain::<6>(3), [0.0; 6], &TIMES, rtol), 0);
        assert_eq!(failures(&chain::<12>(6), [0.0; 12], &TIMES, rtol), 0);
        assert_eq!(failures(&chain::<12>(4), [0.0; 12], &TIMES, rtol), 0);
    }
}

/// Every elementary function and every way to divide, and laws that level off.
#[test]
fn elementary_functions() {
    for rtol in [1e-6, 1e-9] {
        let tanh = model(["x", "v"], ["v", "tanh(k*v)-x"]);
        assert_eq!(failures(&tanh, [0.5, 0.5], &TIMES, rtol), 0);
        let steep = model(["x", "v", "u"], ["v", "-tanh(40*v)-x", "exp(-u)-1/(2+u^2)"]);
        assert_eq!(failures(&steep, [0.5, 0.5, 0.5], &TIMES, rtol), 0);
        let roots = model(["x", "v"], ["sqrt(9+x^2)-3*ln(9+v^2)", "-v/(1+x^2)+c/(4+sin(x))-k"]);
        assert_eq!(failures(&roots, [0.0, 0.0], &TIMES, rtol), 0);
    }
}

/// Runs that end where the state becomes infinite, or the law has no value, beside those that go on.
#[test]
fn a_run_that_fails_leaves_the_others_alone() {
    for rtol in [1e-6, 1e-9] {
        let burst = model(["x", "y"], ["x^2-c*x", "k*(x-y)"]);
        let levels = model(["x", "y", "z"], ["exp(x)-k", "z", "-y-c*z"]);
        let root = model(["x", "y", "z"], ["-k", "sqrt(x+4)-y", "x*y"]);
        for failed in [
            failures(&burst, [0.0, 0.0], &TIMES, rtol),
            failures(&levels, [0.0, 0.0, 0.0], &TIMES, rtol),
            failures(&root, [3.5, 0.0, 0.0], &TIMES, rtol),
        ] {
            assert!(0 < failed && failed < 21, "{failed} of 21 failed");
        }
    }
}

/// Exponents and crossings of a surface that depends on the rates, in packets and one by one.
#[test]
fn exponents_and_sections() {
    let family = model(["x", "y", "z"], ["10*(y-x)", "x*(28-z)-y", "x*y-8/3*z"]);
    let (starts, values, stop) = (starts(11, [1.0, 1.0, 20.0]), [VALUES.to_vec()], CancelFlag::new());
    let tolerance = Tolerance::new(1e-8, 1e-10);
    let names = ["x", "y", "z"].map(str::to_owned);
    let names = Names { states: &names, parameters: &[], inputs: &[], rates: true };
    let function = Expression::parse("z' - y/3", names).unwrap();
    let sections = [Section { function, rising: true, falling: false }];
    let run = |starts: &[[f64; 3]], isa| -> Vec<Vec<u64>> {
        let done = AtomicUsize::new(0);
        let context = ExecutionContext { threads: 1, isa, done: &done, stop: &stop };
        let options = LyapunovOptions { time: 12.0, transient: 1.0, goal: 0.0, tolerance };
        let orbits = Lyapunov { family: &family, values: &values, starts, options };
        let exponents = orbits.run::<1>(context).into_iter().flatten();
        let exponents = exponents.map(|orbit| [orbit.exponents.value[0], orbit.x[0], orbit.x[2]].to_vec());
        let all = SectionRun {
            family: &family,
            values: &values,
            starts,
            sections: &sections,
            skip: 1,
            count: 5,
            end: 20.0,
            bounded: [true; 3],
            tolerance,
        };
        let points = all.run(context).into_iter().flatten().map(|found| found.x.into_flattened());
        let bits = |row: Vec<f64>| row.into_iter().map(f64::to_bits).collect();
        exponents.chain(points).map(bits).collect()
    };
    let alone: Vec<_> = starts.iter().map(|&x| run(&[x], Isa::Baseline)).collect();
    assert!(alone.iter().all(|rows| rows.len() == 2 && rows[1].len() == 15));
    for isa in Isa::available() {
        let together = run(&starts, isa);
        for (i, rows) in alone.iter().enumerate() {
            assert_eq!([&together[i], &together[i + 11]], [&rows[0], &rows[1]], "{isa:?}, run {i}");
        }
    }
}
