//! Nothing is allocated inside the step loop.

use std::alloc::{GlobalAlloc, Layout, System as Heap};
use std::cell::Cell;
use std::sync::atomic::AtomicUsize;

use udd::integrate::{Dopri5, Driver, Ending, Method, Taylor, Tolerance};
use udd::model::effects::{Effect, Kind, Treatment};
use udd::model::{DiskFamily, DleFamily, Family, System};
use udd::run::{Crew, Ensemble, Lyapunov, LyapunovOptions, Section, Sections, Stepper, Stop};
use udd::scalar::Isa;
use udd::tape::{Expression, Names, Tape};

/// Counts what each thread asks the heap for.
struct Counting;

thread_local!(static COUNT: Cell<usize> = const { Cell::new(0) });

fn count() {
    COUNT.set(COUNT.get() + 1);
}

// SAFETY: everything is handed on to the system's own allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { Heap.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { Heap.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        unsafe { Heap.realloc(old, layout, size) }
    }
    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        unsafe { Heap.dealloc(old, layout) }
    }
}

#[global_allocator]
static HEAP: Counting = Counting;

fn allocations<T>(work: impl FnOnce() -> T) -> usize {
    let before = COUNT.get();
    std::hint::black_box(work());
    COUNT.get() - before
}

/// Ten times as long a run over the same jobs, with all instructions that the machine has, allocates as often.
fn same_for_longer_runs(work: impl Fn(Crew<'_>, f64)) {
    // The machine is asked once what it has.
    Isa::best();
    for isa in Isa::available() {
        let (done, stop) = (AtomicUsize::new(0), Stop::new());
        // On the thread that counts.
        let crew = Crew { threads: 1, isa, done: &done, stop: &stop };
        let [short, long] = [1.0, 10.0].map(|times| allocations(|| work(crew, times)));
        assert!(short > 0, "nothing is counted");
        assert_eq!(short, long, "{isa:?}");
    }
}

const START: [f64; 3] = [1.0, 1.0, 0.01];
const TOLERANCE: Tolerance = Tolerance { rtol: 1e-8, atol: 1e-11 };

/// One drive, or more than two packets' worth.
fn drives(n: u32) -> Vec<Vec<f64>> {
    (0..n).map(|i| vec![1.0 + 0.3 * f64::from(i), 0.0]).collect()
}

fn ensemble(stepper: Stepper, n: u32) {
    let values = drives(n);
    same_for_longer_runs(|crew, times| {
        let times = [0.0, 1.0, 20.0 * times];
        let (family, tolerance) = (&DleFamily, TOLERANCE);
        let all = Ensemble { family, values: &values, starts: &[START], times: &times, tolerance, stepper };
        assert!(all.run(crew).iter().flatten().all(|run| run.states.len() == 3));
    });
}

#[test]
fn one_trajectory_by_taylor() {
    ensemble(Stepper::Taylor, 1);
}

#[test]
fn packets_by_taylor() {
    ensemble(Stepper::Taylor, 19);
}

#[test]
fn one_trajectory_by_dopri5() {
    ensemble(Stepper::Dopri5, 1);
}

#[test]
fn packets_by_dopri5() {
    ensemble(Stepper::Dopri5, 19);
}

fn exponents<const N: usize>(n: u32) {
    let values = drives(n);
    same_for_longer_runs(|crew, times| {
        let options =
            LyapunovOptions { time: 60.0 * times, transient: 10.0, goal: 0.0, tolerance: TOLERANCE };
        let orbits = Lyapunov { family: &DleFamily, values: &values, starts: &[START], options };
        assert!(orbits.run::<N>(crew).iter().flatten().all(|orbit| orbit.t == 60.0 * times));
    });
}

#[test]
fn one_largest_exponent() {
    exponents::<1>(1);
}

#[test]
fn packets_of_largest_exponents() {
    exponents::<1>(19);
}

#[test]
fn one_spectrum() {
    exponents::<3>(1);
}

#[test]
fn packets_of_spectra() {
    exponents::<3>(19);
}

/// Crossings are kept; those that are left out cost nothing.
fn sections(n: u32) {
    let values = drives(n);
    let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
    let (states, parameters) = (names(&["omega", "y", "z"]), names(&["w", "B"]));
    let surfaces = [("z", true, false), ("omega - y", true, true)].map(|(text, rising, falling)| Section {
        function: Expression::parse(text, Names { states: &states, parameters: &parameters }).unwrap(),
        rising,
        falling,
    });
    same_for_longer_runs(|crew, times| {
        let all = Sections {
            family: &DleFamily,
            values: &values,
            starts: &[START],
            sections: &surfaces,
            skip: (20.0 * times) as usize,
            count: 5,
            end: 1e6,
            bounded: [true; 3],
            tolerance: TOLERANCE,
        };
        assert!(all.run(crew).iter().flatten().all(|found| found.t.len() == 5));
    });
}

#[test]
fn one_section() {
    sections(1);
}

#[test]
fn packets_of_sections() {
    sections(19);
}

/// Steps to `end` without asking the heap for anything; returns their number.
fn nothing_in_steps<M: System<f64, D>, const D: usize, K: Method<f64, D>>(
    mut driver: Driver<M, f64, D, Tolerance, K>,
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
    assert!(nothing_in_steps(Driver::by(Dopri5::default(), dle, 0.0, START, None, &TOLERANCE), 100.0) > 100);
    let tape = Tape::record(&DleFamily, &[None, Some(0.0)]).unwrap();
    for isa in Isa::available() {
        let taylor = Taylor::new(&tape, values.to_vec(), 18, isa);
        assert!(nothing_in_steps(Driver::by(taylor, dle, 0.0, START, None, &TOLERANCE), 100.0) > 50);
    }
}

/// A disk that slips, sticks and meets its friction's kink, with every kind of term in its equations.
#[test]
fn steps_over_surfaces() {
    let effects = vec![
        Effect::new(Kind::QuadraticDrag),
        Effect::new(Kind::Coulomb).with_treatment(Treatment::SetValued),
        Effect::new(Kind::Relaxation),
    ];
    let values = [0.039, 0.08, 9.81, 0.012, 0.103, 0.055, 1e-4, 5e-3, 0.05, 1.0];
    let disk = DiskFamily { effects, edge: true }.build(&values);
    let driver = Driver::by(Dopri5::default(), &disk, 0.0, [3.0, 0.005, 0.0, 0.0], None, &TOLERANCE);
    assert!(nothing_in_steps(driver.with_wall(), 60.0) > 100);
}
