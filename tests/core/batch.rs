//! Many runs: the same bits however they are spread, the right numbers, and no allocation as they go on.

use std::sync::atomic::AtomicUsize;

use crate::counting::allocations;
use udd::analysis::{
    BatchJob, CancelFlag, Ensemble, ExecutionContext, Lyapunov, LyapunovOptions, MethodChoice, Queue,
    ResultSink, run_batch,
};
use udd::integrate::Tolerance;
use udd::model::effects::Kind;
use udd::model::{DiskFamily, DleFamily, Effect, Family};
use udd::scalar::{Isa, Real};

const TOLERANCE: Tolerance = Tolerance::new(1e-9, 1e-12);

/// Does work in every context: threads and instruction sets.
fn on_each<T>(mut work: impl FnMut(ExecutionContext<'_>) -> T) -> Vec<(String, T)> {
    let stop = CancelFlag::new();
    let mut all = Vec::new();
    for isa in Isa::available() {
        for threads in [1, 2, 3] {
            let done = AtomicUsize::new(0);
            let result = work(ExecutionContext { threads, isa, done: &done, stop: &stop });
            all.push((format!("{isa:?}, {threads} threads"), result));
        }
    }
    all
}

fn starts(n: usize) -> Vec<[f64; 3]> {
    let part = |i: usize, by: f64| 4.0 * (i as f64 * by).fract() - 2.0;
    (0..n).map(|i| [part(i, 0.618), part(i, 0.414), part(i, 0.732)]).collect()
}

/// Says of every job how many lanes its packet began with.
struct Lanes;

impl BatchJob for Lanes {
    type Yield = usize;
    const PACKETS: bool = true;

    #[inline(always)]
    fn run_batch<R: Real>(&self, queue: &Queue<'_>, results: &mut ResultSink<'_, usize>) {
        while let Some(job) = queue.take() {
            results.push(job, queue.lanes::<R>());
        }
    }
}

/// Where jobs are few none of the threads fills a packet with them while others go without.
#[test]
fn threads_share_few_jobs() {
    let one_by_one =
        |queue: &Queue<'_>, results: &mut ResultSink<'_, _>| Lanes.run_batch::<f64>(queue, results);
    for (jobs, most) in [(3, [3, 3, 3]), (20, [20, 10, 7])] {
        for (context, lanes) in
            on_each(|context| (context.threads, run_batch(Some(&Lanes), &one_by_one, jobs, context)))
        {
            let (threads, lanes) = lanes;
            assert!(lanes.iter().flatten().all(|&lanes| lanes <= most[threads - 1]), "{context}: {lanes:?}");
        }
    }
}

#[test]
fn an_ensemble_has_the_same_bits_everywhere() {
    let starts = starts(37);
    for values in [vec![vec![1.0, 0.0]], (0..37).map(|i| vec![0.5 + 0.1 * f64::from(i), 0.1]).collect()] {
        for stepper in [MethodChoice::Taylor, MethodChoice::Dopri5] {
            let times = [0.0, 1.0, 7.5, 60.0];
            let ensemble = Ensemble {
                family: &DleFamily,
                values: &values,
                starts: &starts,
                times: &times,
                tolerance: TOLERANCE,
                stepper,
            };
            let bits = |context: ExecutionContext<'_>| -> Vec<u64> {
                let all = ensemble.run(context).into_iter().flatten();
                all.flat_map(|run| run.states).flatten().map(f64::to_bits).collect()
            };
            let found = on_each(bits);
            assert_eq!(found[0].1.len(), 37 * 4 * 3);
            for (context, bits) in &found {
                assert!(*bits == found[0].1, "{stepper:?}, {context}");
            }
        }
    }
}

#[test]
fn a_disks_ensemble_has_the_same_bits_everywhere() {
    let family = DiskFamily { effects: vec![Effect::new(Kind::QuadraticDrag)], edge: true };
    let mut values: Vec<f64> = vec![0.039, 0.08, 9.81, 0.012, 0.103, 0.055];
    values.resize(family.parameters().len(), 1e-4);
    let starts: Vec<[f64; 4]> = (0..11).map(|i| [3.0 + 0.1 * f64::from(i), 0.005, 0.0, 0.0]).collect();
    for stepper in [MethodChoice::Taylor, MethodChoice::Dopri5] {
        let ensemble = Ensemble {
            family: &family,
            values: &[values.clone()],
            starts: &starts,
            times: &[0.0, 5.0],
            tolerance: TOLERANCE,
            stepper,
        };
        let bits = |context: ExecutionContext<'_>| -> Vec<u64> {
            let all = ensemble.run(context).into_iter().flatten();
            all.flat_map(|run| [run.t.to_bits()].into_iter().chain(run.x.map(f64::to_bits))).collect()
        };
        let found = on_each(bits);
        for (context, bits) in &found {
            assert!(*bits == found[0].1, "{stepper:?}, {context}");
        }
    }
}

/// Exponents of drives from order to chaos, one and all of them.
#[test]
fn exponents_have_the_same_bits_everywhere() {
    let values: Vec<Vec<f64>> = (0..21).map(|i| vec![0.25 + 0.4 * f64::from(i), 0.0]).collect();
    let options = LyapunovOptions { time: 150.0, transient: 20.0, goal: 0.02, tolerance: TOLERANCE };
    let orbits = Lyapunov { family: &DleFamily, values: &values, starts: &[[1.0, 1.0, 0.01]], options };
    let one = |context: ExecutionContext<'_>| -> Vec<u64> {
        let all = orbits.run::<1>(context).into_iter().flatten();
        all.flat_map(|e| [e.exponents.value[0], e.exponents.standard_error[0], e.t])
            .map(f64::to_bits)
            .collect()
    };
    let three = |context: ExecutionContext<'_>| -> Vec<u64> {
        let all = orbits.run::<3>(context).into_iter().flatten();
        all.flat_map(|e| e.exponents.value.into_iter().chain(e.moments.second.into_iter().flatten()))
            .map(f64::to_bits)
            .collect()
    };
    let (ones, threes) = (on_each(one), on_each(three));
    assert_eq!((ones[0].1.len(), threes[0].1.len()), (21 * 3, 21 * 12));
    for (context, bits) in ones.iter().chain(&threes) {
        let expected = if bits.len() == 63 { &ones[0].1 } else { &threes[0].1 };
        assert!(bits == expected, "{context}");
    }
}

/// Digits on which independent integrators agree, by each method in packets.
#[test]
fn reference_states() {
    let starts = [[1.0, 1.0, 0.01]; 9];
    let (expected, stop) = ([0.32011311025, -0.38840279112, -0.23230343728], CancelFlag::new());
    for stepper in [MethodChoice::Taylor, MethodChoice::Dopri5] {
        let ensemble = Ensemble {
            family: &DleFamily,
            values: &[vec![1.0, 0.0]],
            starts: &starts,
            times: &[0.0, 10.0, 30.0],
            tolerance: Tolerance::new(1e-13, 1e-16),
            stepper,
        };
        let done = AtomicUsize::new(0);
        let context = ExecutionContext { threads: 1, isa: Isa::best(), done: &done, stop: &stop };
        for run in ensemble.run(context).into_iter().flatten() {
            for (value, exact) in run.states[2].iter().zip(expected) {
                // The last digit given, and rounding grown by e^(0.21 * 30) = 550.
                assert!((value - exact).abs() < 2e-11, "{stepper:?} {:?}", run.states[2]);
            }
        }
    }
}

/// Runs of ten times the length allocate as often, with all instructions that the machine has.
fn same_for_longer_runs(name: &str, work: impl Fn(ExecutionContext<'_>, f64)) {
    // The machine is asked once what it has.
    Isa::best();
    for isa in Isa::available() {
        let (done, stop) = (AtomicUsize::new(0), CancelFlag::new());
        // On the thread that counts.
        let context = ExecutionContext { threads: 1, isa, done: &done, stop: &stop };
        let [short, long] = [1.0, 10.0].map(|times| allocations(|| work(context, times)));
        assert!(short > 0, "nothing is counted");
        assert_eq!(short, long, "{name}, {isa:?}");
    }
}

/// One orbit, and more than two packets' worth.
#[test]
fn nothing_is_allocated_as_runs_go_on() {
    for n in [1, 19] {
        let values: Vec<Vec<f64>> = (0..n).map(|i| vec![1.0 + 0.3 * f64::from(i), 0.0]).collect();
        let (family, starts, tolerance) = (&DleFamily, &[[1.0, 1.0, 0.01]], TOLERANCE);
        for stepper in [MethodChoice::Taylor, MethodChoice::Dopri5] {
            same_for_longer_runs(&format!("{n} by {stepper:?}"), |context, times| {
                let times = &[0.0, 1.0, 20.0 * times];
                let all = Ensemble { family, values: &values, starts, times, tolerance, stepper };
                assert!(all.run(context).iter().flatten().all(|run| run.states.len() == 3));
            });
        }
        let orbits = |times: f64| Lyapunov {
            family,
            values: &values,
            starts,
            options: LyapunovOptions { time: 60.0 * times, transient: 10.0, goal: 0.0, tolerance },
        };
        same_for_longer_runs(&format!("{n} largest exponents"), |context, times| {
            let found = orbits(times).run::<1>(context);
            assert!(found.iter().flatten().all(|orbit| orbit.t == 60.0 * times));
        });
        same_for_longer_runs(&format!("{n} spectra"), |context, times| {
            let found = orbits(times).run::<3>(context);
            assert!(found.iter().flatten().all(|orbit| orbit.t == 60.0 * times));
        });
    }
}
