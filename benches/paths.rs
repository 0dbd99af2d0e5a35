//! The core's hot paths: timed by criterion, run once for `count.py` to count their instructions, or with `--limit`
//! compared with the limit of the machine.

#[path = "paths/limit.rs"]
mod limit;

use std::hint::black_box;
use std::sync::atomic::AtomicUsize;
use std::time::Instant;

use criterion::{Criterion, Throughput};
use limit::Steps;
use nalgebra::{SMatrix, SVector};
use rayon::ThreadPoolBuilder;
use udd::analysis::{
    CancelFlag, Ensemble, ExecutionContext, Lyapunov, LyapunovOptions, MethodChoice, Output, Section,
    SectionRun, trajectory,
};
use udd::estimate::{
    DiskCamera, Estimator, FilmParameters, FreeParameter, Options, Record, Role, Sensor, Unknowns,
};
use udd::formula::{Expression, Names};
use udd::integrate::{Dopri5, Tolerance, propagate};
use udd::model::effects::{Effect, Kind};
use udd::model::{DiskFamily, DleFamily, Either, Family, FormulaFamily};
use udd::scalar::Isa;

/// The disk as the module has it.
type Four = Either<DiskFamily, FormulaFamily<4>>;

/// One piece of work, always the same, on one thread.
struct Path {
    name: &'static str,
    /// How much it is, in time units, points or frames.
    units: u64,
    work: Box<dyn Fn(Isa)>,
    /// Where it is the built-in series, what its steps are counted from.
    steps: Option<Box<dyn Fn() -> Steps>>,
}

impl Path {
    fn new(name: &'static str, units: u64, work: impl Fn(Isa) + 'static) -> Self {
        Self { name, units, work: Box::new(work), steps: None }
    }

    /// With what its steps are counted from.
    fn counted(mut self, steps: impl Fn() -> Steps + 'static) -> Self {
        self.steps = Some(Box::new(steps));
        self
    }
}

const START: [f64; 3] = [1.0, 1.0, 0.01];
const TIGHT: f64 = 1e-9;
const LOOSE: f64 = 1e-6;

fn tolerance(rtol: f64) -> Tolerance {
    Tolerance::new(rtol, 1e-3 * rtol)
}

fn in_context<T>(isa: Isa, work: impl FnOnce(ExecutionContext<'_>) -> T) -> T {
    let (done, stop) = (AtomicUsize::new(0), CancelFlag::new());
    black_box(work(ExecutionContext { threads: 1, isa, done: &done, stop: &stop }))
}

/// Spread over the cube of side 4 around the origin.
fn starts(n: u32) -> Vec<[f64; 3]> {
    let spread = |i: u32, by: f64| 4.0 * (f64::from(i) * by).fract() - 2.0;
    (0..n).map(|i| [spread(i, 0.618_034), spread(i, 0.414_214), spread(i, 0.732_051)]).collect()
}

/// Runs whose steps of the built-in series are counted.
fn series(values: Vec<Vec<f64>>, starts: Vec<[f64; 3]>, rtol: f64, derivatives: usize, time: f64) -> Steps {
    Steps { values, starts, tolerance: tolerance(rtol), derivatives, time }
}

fn drives(n: u32) -> Vec<Vec<f64>> {
    (0..n).map(|i| vec![0.05 + 9.95 * f64::from(i) / f64::from(n), 0.0]).collect()
}

fn ensemble<F: Family<3> + 'static>(
    name: &'static str,
    (family, values): (F, Vec<f64>),
    stepper: MethodChoice,
    rtol: f64,
    starts: Vec<[f64; 3]>,
    end: u32,
) -> Path {
    let units = u64::from(end) * starts.len() as u64;
    let values = [values];
    let work = move |isa| {
        let times = [0.0, f64::from(end)];
        let tolerance = tolerance(rtol);
        let (family, values, starts) = (&family, &values[..], &starts[..]);
        in_context(isa, |context| {
            Ensemble { family, values, starts, times: &times, tolerance, stepper }.run(context)
        });
    };
    Path::new(name, units, work)
}

/// A model as text, none of those whose series are written out: Lorenz's of 1963.
fn lorenz() -> (FormulaFamily<3>, Vec<f64>) {
    let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
    let equations = ["sigma*(y-x)", "x*(rho-z)-y", "x*y-beta*z"];
    let family =
        FormulaFamily::parse(&names(&["x", "y", "z"]), &equations, &names(&["sigma", "rho", "beta"]), &[]);
    (family.unwrap(), vec![10.0, 28.0, 8.0 / 3.0])
}

fn exponents<const N: usize>(name: &'static str, rtol: f64, values: Vec<Vec<f64>>, end: u32) -> Path {
    let units = u64::from(end) * values.len() as u64;
    let time = f64::from(end);
    let options = LyapunovOptions { time, transient: 0.1 * time, goal: 0.0, tolerance: tolerance(rtol) };
    let wanted = values.clone();
    let steps = move || series(wanted.clone(), vec![START], rtol, N, units as f64);
    let work = move |isa| {
        let orbits = Lyapunov { family: &DleFamily, values: &values, starts: &[START], options };
        in_context(isa, |context| orbits.run::<N>(context));
    };
    Path::new(name, units, work).counted(steps)
}

fn sections(name: &'static str, values: Vec<Vec<f64>>, count: usize) -> Path {
    let units = ((SKIPPED + count) * values.len()) as u64;
    let wanted = values.clone();
    let steps = move || {
        let ends = crossed(Isa::best(), &wanted, count);
        series(wanted.clone(), vec![START], TIGHT, 0, ends.iter().sum())
    };
    Path::new(name, units, move |isa| drop(crossed(isa, &values, count))).counted(steps)
}

/// So many points are found before those that are kept.
const SKIPPED: usize = 20;

/// Collects points of the section z = 0; returns the times of the last ones.
fn crossed(isa: Isa, values: &[Vec<f64>], count: usize) -> Vec<f64> {
    let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
    let (states, parameters) = (names(&["omega", "y", "z"]), names(&["w", "B"]));
    let function =
        Expression::parse("z", Names { states: &states, parameters: &parameters, inputs: &[], rates: true })
            .unwrap();
    let wanted = SectionRun {
        family: &DleFamily,
        values,
        starts: &[START],
        sections: &[Section { function, rising: true, falling: false }],
        skip: SKIPPED,
        count,
        end: 1e6,
        bounded: [true; 3],
        tolerance: tolerance(TIGHT),
    };
    let found = in_context(isa, |context| wanted.run(context));
    found.iter().flatten().map(|crossings| crossings.end.0).collect()
}

const DISK: [f64; 6] = [0.039, 0.08, 9.81, 0.012, 0.103, 0.055];

fn disk(name: &'static str, effects: &[(Kind, &[f64])], end: u32) -> Path {
    let values: Vec<f64> = DISK.iter().chain(effects.iter().flat_map(|(_, own)| *own)).copied().collect();
    let effects = effects.iter().map(|&(kind, _)| Effect::new(kind)).collect();
    let system = Four::First(DiskFamily { effects, edge: true }).build::<f64>(&values);
    let work = move |_| {
        let times: Vec<f64> = (0..=25 * end).map(|i| 0.04 * f64::from(i)).collect();
        let (x0, tolerance) = ([1.0, 0.01, -0.02, 0.3], tolerance(TIGHT));
        let (method, output) = (Dopri5::default(), Output::At(&times));
        black_box(
            trajectory(&system, method, output, x0, &tolerance, false, (&CancelFlag::new(), None)).unwrap(),
        );
    };
    Path::new(name, u64::from(end), work)
}

/// The drive and two constants of friction from a noise-free film, begun 5 % off.
fn fit(name: &'static str, frames: usize) -> Path {
    let family = DiskFamily { effects: vec![], edge: false };
    let (system, tight) = (family.build::<f64>(&DISK), tolerance(1e-10));
    let mut states = vec![[1.0, 0.01, -0.02, 0.3]];
    for i in 1..frames {
        states.push(propagate(&system, 0.0, 0.04, states[i - 1], &tight).unwrap());
    }
    let record = Record {
        t: (0..frames).map(|i| 0.04 * i as f64).collect(),
        seen: states.iter().map(|x| SVector::from([x[1], x[2], x[3]])).collect(),
        information: vec![SMatrix::from_diagonal(&SVector::from([4e6, 4e6, 1e4])); frames],
        linked: vec![true; frames - 1],
        film: vec![0; frames],
        memory: [0.0; 3],
    };
    let mut model = DISK.to_vec();
    let free = [0, 3, 4].map(|j| {
        model[j] *= 1.05;
        FreeParameter::unlimited(Role::Model(j), DISK[j], f64::INFINITY)
    });
    let estimator = Estimator {
        family,
        sensor: DiskCamera,
        record,
        free: free.to_vec(),
        diffusion: [3e-3, 1e-5, 1e-5, 1e-4].map(|q: f64| q / 0.2),
        tolerance: tolerance(1e-8),
        known: None,
    };
    let work = move |_| {
        let set = FilmParameters {
            model: model.clone(),
            camera: vec![0.0; DiskCamera::PARAMETERS.len()],
            clock: 0.0,
        };
        let start = Unknowns { states: states.clone(), sets: vec![set] };
        black_box(estimator.solve(start, &Options::default(), &CancelFlag::new()).unwrap());
    };
    Path::new(name, frames as u64, work)
}

fn paths() -> Vec<Path> {
    let one = || vec![vec![1.0, 0.0]];
    let dle = || (DleFamily, vec![1.0, 0.0]);
    vec![
        ensemble("trajectory", dle(), MethodChoice::Taylor, TIGHT, vec![START], 10_000)
            .counted(|| series(vec![vec![1.0, 0.0]], vec![START], TIGHT, 0, 1e4)),
        ensemble("trajectory by dopri5", dle(), MethodChoice::Dopri5, LOOSE, vec![START], 2_000),
        ensemble("starts", dle(), MethodChoice::Taylor, LOOSE, starts(400), 100)
            .counted(|| series(vec![vec![1.0, 0.0]], starts(400), LOOSE, 0, 4e4)),
        ensemble("starts by dopri5", dle(), MethodChoice::Dopri5, LOOSE, starts(400), 100),
        ensemble("trajectory of own model", lorenz(), MethodChoice::Taylor, TIGHT, vec![START], 500),
        ensemble("starts of own model", lorenz(), MethodChoice::Taylor, LOOSE, starts(400), 10),
        exponents::<1>("exponents", LOOSE, drives(64), 500),
        exponents::<3>("spectrum", TIGHT, one(), 2_000),
        exponents::<3>("spectra", TIGHT, drives(64), 100),
        sections("section", one(), 1_000),
        sections("sections", drives(64), 100),
        disk("disk", &[], 500),
        disk("disk with effects", &[(Kind::QuadraticDrag, &[1e-4]), (Kind::Relaxation, &[1.0])], 50),
        fit("fit", 100),
    ]
}

/// The function that callgrind counts.
#[inline(never)]
fn counted(work: &dyn Fn(Isa)) {
    work(Isa::Avx2);
}

/// Prints the rates of the built-in series beside those that the machine could reach.
fn limits() {
    println!("{:24}{:>12}{:>12}{:>24}", "", "a second", "at most", "of the machine's limit");
    for isa in Isa::available().into_iter().filter(|&isa| isa > Isa::Baseline) {
        for Path { name, units, work, steps } in paths() {
            let Some(steps) = steps else { continue };
            let least = steps().least(isa);
            let mut spent = f64::INFINITY;
            for _ in 0..30 {
                let begin = Instant::now();
                work(isa);
                spent = spent.min(begin.elapsed().as_secs_f64());
            }
            let (rate, most) = (units as f64 / spent, units as f64 / least);
            println!(
                "{:24}{rate:12.3e}{most:12.3e}{:22.0} %",
                format!("{name}, {isa:?}"),
                100.0 * rate / most
            );
        }
    }
}

fn speed() {
    let mut criterion = Criterion::default().sample_size(20).without_plots().configure_from_args();
    let mut group = criterion.benchmark_group("paths");
    for Path { name, units, work, .. } in paths() {
        group.throughput(Throughput::Elements(units));
        group.bench_function(name, |bencher| bencher.iter(|| work(Isa::best())));
    }
    group.finish();
}

fn main() {
    // Also for work that takes all cores by itself: what other threads do is not counted.
    let alone = ThreadPoolBuilder::new().num_threads(1).use_current_thread();
    alone.build_global().expect("the first pool");
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match &arguments[..] {
        // Without a name: the names. Valgrind knows no AVX-512.
        [mode] if mode == "--count" && Isa::available().contains(&Isa::Avx2) => {
            paths().iter().for_each(|path| println!("{}", path.name));
        }
        [mode] if mode == "--count" => {}
        // Cargo adds the last argument.
        [mode, ..] if mode == "--limit" => limits(),
        [mode, name] if mode == "--count" => {
            let path = paths().into_iter().find(|path| path.name == name).expect("no such path");
            counted(&path.work);
        }
        _ => speed(),
    }
}
