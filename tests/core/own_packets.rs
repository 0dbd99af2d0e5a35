//! Ensembles of models given as text: in packets they have the bits of runs one by one.

use std::sync::atomic::AtomicUsize;

use udd::analysis::{CancelFlag, Ensemble, EnsembleRun, ExecutionContext, MethodChoice};
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
    let by = [0.618, 0.414, 0.732, 0.236];
    let part = |i: usize, d: usize| centre[d] + 4.0 * (i as f64 * by[d]).fract() - 2.0;
    (0..n).map(|i| std::array::from_fn(|d| part(i, d))).collect()
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
