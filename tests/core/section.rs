//! Sections: crossings of surfaces along trajectories, and the formulas that surfaces are given by.

use std::sync::atomic::AtomicUsize;

use crate::counting::allocations;
use udd::analysis::{
    CancelFlag, CrossingOutcome, Crossings, ExecutionContext, Output, Section, SectionRun, trajectory,
};
use udd::formula::{Expression, Names, Place, Program};
use udd::integrate::{Dopri5, Integrator, Taylor, Tolerance};
use udd::model::{DiskFamily, DleFamily, Family};
use udd::scalar::Isa;
use udd::tape::Tape;

const TIGHT: Tolerance = Tolerance::new(1e-13, 1e-15);
const START: [f64; 3] = [1.0, 1.0, 0.01];
const DISK: [f64; 6] = [0.014, 0.08, 9.81, 0.012, 0.103, 0.055];

fn names(of: &[&str]) -> Vec<String> {
    of.iter().map(|&name| name.to_owned()).collect()
}

fn section<F: Family<D>, const D: usize>(family: &F, text: &str, direction: i32) -> Section {
    let states = match D {
        3 => names(&["omega", "y", "z"]),
        _ => names(&["Omega", "Y", "Z", "beta"]),
    };
    let parameters: Vec<String> = family.parameters().into_iter().map(|p| p.name).collect();
    let function =
        Expression::parse(text, Names { states: &states, parameters: &parameters, inputs: &[], rates: true })
            .unwrap();
    Section { function, rising: direction >= 0, falling: direction <= 0 }
}

/// How many crossings are left out and wanted, until when, how accurately, by how many threads, with what.
#[derive(Clone, Copy)]
struct How {
    skip: usize,
    count: usize,
    end: f64,
    tolerance: Tolerance,
    threads: usize,
    isa: Isa,
}

impl How {
    fn many(count: usize) -> Self {
        Self { skip: 0, count, end: 1e6, tolerance: TIGHT, threads: 1, isa: Isa::best() }
    }
}

fn collect<F: Family<D>, const D: usize>(
    family: &F,
    values: &[Vec<f64>],
    starts: &[[f64; D]],
    list: &[(&str, i32)],
    how: How,
) -> Vec<Crossings<D>> {
    let sections: Vec<Section> = list.iter().map(|(text, way)| section(family, text, *way)).collect();
    let How { skip, count, end, tolerance, threads, isa } = how;
    let mut bounded = [true; D];
    bounded[D - 1] = D == 3;
    let (done, stop) = (AtomicUsize::new(0), CancelFlag::new());
    let all =
        SectionRun { family, values, starts, sections: &sections, skip, count, end, bounded, tolerance };
    let context = ExecutionContext { threads, isa, done: &done, stop: &stop };
    all.run(context).into_iter().map(Option::unwrap).collect()
}

fn dle(w: f64, list: &[(&str, i32)], how: How) -> Crossings<3> {
    collect(&DleFamily, &[vec![w, 0.0]], &[START], list, how).remove(0)
}

/// The states at these times by Dormand & Prince's method, which shares no polynomial with the sections.
fn elsewhere<const D: usize>(
    family: &impl Family<D>,
    values: &[f64],
    x0: [f64; D],
    t: &[f64],
) -> Vec<[f64; D]> {
    let times: Vec<f64> = std::iter::once(0.0).chain(t.iter().copied()).collect();
    let run = trajectory(
        family.build(values),
        Dopri5::default(),
        Output::At(&times),
        x0,
        &TIGHT,
        false,
        (&CancelFlag::new(), None),
    );
    run.unwrap().x[1..].to_vec()
}

fn near(a: &[f64], b: &[f64], within: f64) {
    let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < within, "{a:?} and {b:?} differ by {worst:e}");
}

#[test]
fn crossings_are_those_of_an_independent_run() {
    // Until t = 30 errors grow by exp(0.21 t) = 500, from 1e-13 per step.
    let how = How { end: 30.0, ..How::many(1000) };
    for (text, of) in [
        ("z", (|x| x[2]) as fn(&[f64; 3]) -> f64),
        ("omega - y", |x| x[0] - x[1]),
        ("y^2 + z^2 = 1", |x| x[1] * x[1] + x[2] * x[2] - 1.0),
        ("z'", |x| 1.0 - x[0] * x[1]),
    ] {
        let found = dle(1.0, &[(text, 0)], how);
        assert_eq!(found.ended, CrossingOutcome::TimeRanOut);
        assert!(found.residual <= 1e-12, "{text}: {:e}", found.residual);
        let other = elsewhere(&DleFamily, &[1.0, 0.0], START, &found.t);
        for (x, other) in found.x.iter().zip(&other) {
            near(x, other, 1e-8);
            assert!(of(x).abs() <= 1e-12, "{text} = {:e} at {x:?}", of(x));
        }
        // None is missing: on a fine grid the function changes its sign as often.
        let grid: Vec<f64> = (1..3000).map(|i| f64::from(i) * 0.01).collect();
        let signs: Vec<bool> =
            elsewhere(&DleFamily, &[1.0, 0.0], START, &grid).iter().map(|x| of(x) > 0.0).collect();
        let changes = (of(&START) > 0.0) != signs[0];
        let changes = usize::from(changes) + signs.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert_eq!(found.t.len(), changes, "{text}");
    }
}

#[test]
fn periodic_orbits_return_in_their_period() {
    // The symmetric orbits of physics.md: half a period from one upward crossing of z = 0 to the next. At
    // w = 7.1 what is left of the transient after `skip` crossings is below 1e-10: it decays in 2250.
    for (w, period, skip) in [(7.1, 3.98808575286, 30_000), (10.0, 3.35832224912, 2_000)] {
        let found = dle(w, &[("z", 1)], How { skip, ..How::many(9) });
        assert_eq!((found.ended, found.t.len()), (CrossingOutcome::Finished, 9));
        for pair in found.t.windows(3) {
            // The period is given to 11 decimals; the clock at 6e4 ticks in 7e-12.
            assert!((pair[2] - pair[0] - period).abs() < 1e-9, "{w}: {}", pair[2] - pair[0]);
            assert!((pair[1] - pair[0] - 0.5 * period).abs() < 1e-9, "{w}: {}", pair[1] - pair[0]);
        }
    }
}

#[test]
fn directions_alternate_and_tell_the_slope() {
    let how = How::many(400);
    let (both, up, down) =
        (dle(3.0, &[("z", 0)], how), dle(3.0, &[("z", 1)], how), dle(3.0, &[("z", -1)], how));
    let rate = |x: &[f64; 3]| 3.0 - x[0] * x[1];
    assert!(up.x.iter().all(|x| rate(x) > 0.0) && down.x.iter().all(|x| rate(x) < 0.0));
    // The start is above.
    for (k, t) in both.t.iter().enumerate() {
        let own = if k % 2 == 0 { &down } else { &up };
        assert_eq!(t.to_bits(), own.t[k / 2].to_bits());
    }
}

/// Nor on whether a single trajectory's steps are passed over for what their coefficients' sizes tell, which those of
/// packets are not.
#[test]
fn bits_do_not_depend_on_packets_threads_or_instructions() {
    same_bits(&[("z", 1), ("omega = y", 0), ("z' * y - sin(t)/w", -1)]);
    same_bits(&[("z = 0.4", 0)]);
}

fn same_bits(list: &[(&str, i32)]) {
    let rows: Vec<Vec<f64>> = (0..21).map(|i| vec![0.3 + 0.45 * f64::from(i), 0.0]).collect();
    let how = How { skip: 3, tolerance: Tolerance::default(), ..How::many(60) };
    let alone: Vec<Crossings<3>> = rows
        .iter()
        .map(|row| collect(&DleFamily, std::slice::from_ref(row), &[START], list, how).remove(0))
        .collect();
    for isa in Isa::available() {
        for threads in [1, 2] {
            let together = collect(&DleFamily, &rows, &[START], list, How { isa, threads, ..how });
            for (one, other) in alone.iter().zip(&together) {
                let bits = |c: &Crossings<3>| -> Vec<u64> {
                    c.t.iter().chain(c.x.as_flattened()).map(|v| v.to_bits()).collect()
                };
                assert_eq!(bits(one), bits(other), "{isa:?}, {threads} threads");
                assert_eq!((&one.which, one.ended), (&other.which, other.ended));
            }
        }
    }
}

#[test]
fn several_surfaces_are_crossed_in_order() {
    let list = [("z", 1), ("y", 0), ("omega - y", -1)];
    let how = How { end: 300.0, ..How::many(10_000) };
    let together = dle(1.0, &list, how);
    assert!(together.t.is_sorted());
    for (k, own) in list.iter().enumerate() {
        let alone = dle(1.0, &[*own], how);
        let same: Vec<f64> = (0..together.t.len())
            .filter(|&i| usize::from(together.which[i]) == k)
            .map(|i| together.t[i])
            .collect();
        assert_eq!(alone.t, same);
    }
}

#[test]
fn a_zero_at_the_end_of_a_step_counts_once() {
    let values = vec![1.0, 0.0];
    let tape = Tape::record(&DleFamily, &[None, Some(0.0)]).unwrap();
    let tolerance = Tolerance::default();
    let taylor = Taylor::new(&tape, values.clone(), 18, Isa::Baseline);
    let mut driver = Integrator::by(taylor, DleFamily.build(&values), 0.0, START, None, &tolerance);
    for _ in 0..12 {
        driver.advance(1e3).unwrap();
        let (t, z) = (driver.t(), driver.x()[2]);
        let how = How { end: 40.0, tolerance, ..How::many(99) };
        // The clock is on the surface exactly at this step's end, and so is the state.
        let found = dle(1.0, &[(&format!("t - {t:?}"), 0)], how);
        assert_eq!(found.t, [t]);
        let found = dle(1.0, &[(&format!("z = {z:?}"), 0)], how);
        assert_eq!(found.t.iter().filter(|own| (*own - t).abs() < 1e-9).count(), 1, "{:?}, {t}", found.t);
    }
}

#[test]
fn a_start_on_the_surface_is_no_crossing() {
    let how = How::many(20);
    let first = dle(2.0, &[("z", 1)], how);
    for k in [0, 7] {
        // Going on from a point gives the next ones, not the point itself.
        let on = collect(&DleFamily, &[vec![2.0, 0.0]], &[first.x[k]], &[("z", 1)], How::many(3)).remove(0);
        for i in 0..3 {
            near(&on.x[i], &first.x[k + 1 + i], 1e-9);
            assert!((on.t[i] + first.t[k] - first.t[k + 1 + i]).abs() < 1e-9);
        }
    }
}

#[test]
fn poles_and_jumps_are_no_crossings() {
    let how = How { end: 100.0, ..How::many(1000) };
    let crossed = dle(1.0, &[("z", 0)], how).t.len();
    assert!(crossed > 20);
    assert_eq!(dle(1.0, &[("1/z", 0)], how).t.len(), 0);
    assert_eq!(dle(1.0, &[("z/abs(z)", 0)], how).t.len(), 0);
    // Touched at every crossing, crossed at none.
    assert_eq!(dle(1.0, &[("z^2", 0)], how).t.len(), 0);
    // Where it is no number it has no sign: ln z + 1 is zero at z = 1/e from above only.
    let found = dle(1.0, &[("ln(z) + 1", 0)], how);
    assert!(found.x.iter().all(|x| (x[2] - (-1f64).exp()).abs() < 1e-12) && !found.x.is_empty());
}

#[test]
fn every_end_has_its_name() {
    let ends = |values: [f64; 2], start: [f64; 3], end: f64| {
        collect(&DleFamily, &[values.to_vec()], &[start], &[("z - 7", 1)], How { end, ..How::many(5) })
            .remove(0)
    };
    // The z-axis is an orbit: z = z0 + w t.
    let axis = ends([2.0, 0.0], [0.0, 0.0, 0.0], 1e9);
    assert_eq!((axis.ended, axis.t.as_slice()), (CrossingOutcome::Escaped, &[3.5][..]));
    let early = ends([2.0, 0.0], [0.0, 0.0, 0.0], 1e3);
    assert_eq!((early.ended, early.end.0), (CrossingOutcome::TimeRanOut, 1e3));
    assert!(matches!(ends([f64::NAN, 0.0], START, 10.0).ended, CrossingOutcome::Failed(_)));

    let disk = DiskFamily { effects: vec![], edge: true };
    let values = vec![DISK.to_vec(), [&[0.05], &DISK[1..]].concat()];
    let starts = [[3.0, 0.005, 0.0, 0.0], [0.0, 0.0, 0.0799, 0.0]];
    let found = collect(&disk, &values, &starts, &[("Z", 1)], How { end: 100.0, ..How::many(9) });
    assert_eq!((found[0].ended, found[1].ended), (CrossingOutcome::Finished, CrossingOutcome::Ejected));
    assert!((found[1].end.1[1].hypot(found[1].end.1[2]) - 0.08).abs() < 1e-12);
}

#[test]
fn rates_on_a_section_take_the_side_of_the_step() {
    // Turning points of the speed lie anywhere around the friction's kink; the independent run lands on it.
    let disk = DiskFamily { effects: vec![], edge: false };
    let start = [0.0, 1e-3, 0.04, 0.0];
    let how = How { end: 6.0, ..How::many(1000) };
    let found = collect(&disk, &[DISK.to_vec()], &[start], &[("Omega'", 0)], how).remove(0);
    assert!(found.t.len() > 5 && found.residual < 1e-11, "{} {:e}", found.t.len(), found.residual);
    let around: Vec<f64> = found.t.iter().flat_map(|t| [t - 1e-4, *t, t + 1e-4]).collect();
    let speeds: Vec<f64> = elsewhere(&disk, &DISK, start, &around).iter().map(|x| x[0]).collect();
    for (speeds, x) in speeds.chunks(3).zip(&found.x) {
        assert!((speeds[1] - x[0]).abs() < 1e-8);
        assert!((speeds[0] < speeds[1]) == (speeds[2] < speeds[1]), "no turning point: {speeds:?}");
    }
}

#[test]
fn laws_without_a_series_have_sections_too() {
    // The same section by the other method, which the sections fall back on: its polynomial is of order 4.
    let tolerance = Tolerance::new(1e-10, 1e-13);
    let found = dle(1.0, &[("z", 1)], How { tolerance, ..How::many(4) });
    let mut driver: Integrator<_, f64, 3, Tolerance, Dopri5<f64, 3>> =
        Integrator::new(DleFamily.build(&[1.0, 0.0]), 0.0, START, None, &tolerance);
    for (t, x) in found.t.iter().zip(&found.x) {
        while driver.t() < *t {
            driver.advance(*t).unwrap();
        }
        near(driver.x(), x, 1e-7);
    }
}

// --- formulas

fn value(text: &str) -> f64 {
    let (states, parameters) = (names(&["omega", "y", "z"]), names(&["w", "tilt.angle"]));
    let names = Names { states: &states, parameters: &parameters, inputs: &[], rates: true };
    let parsed = Expression::parse(text, names).unwrap_or_else(|mistake| panic!("{text} {mistake}"));
    let place = Place { t: 0.25, x: &[2.0, -3.0, 0.5], rates: &[7.0, 11.0, 13.0], inputs: &[] };
    Program::of([&parsed]).value(&place, &[5.0, 0.1])
}

fn mistake(text: &str) -> String {
    let (states, parameters) = (names(&["omega", "y", "z"]), names(&["w"]));
    Expression::parse(text, Names { states: &states, parameters: &parameters, inputs: &[], rates: true })
        .unwrap_err()
        .to_string()
}

#[test]
fn formulas_mean_what_they_do_on_paper() {
    for (text, wanted) in [
        ("1 + 2*3 - 4/2", 5.0),
        ("-y^2", -9.0),
        ("(-y)^2", 9.0),
        ("2^3^2", 512.0),
        ("omega**-1", 0.5),
        ("2 - -omega", 4.0),
        ("8/omega/omega", 2.0),
        ("omega' - y' + z'", 9.0),
        ("omega = y", 5.0),
        ("w t + 1".replace(' ', "*").replace("*+*", "+").as_str(), 2.25),
        ("tilt.angle * 10", 1.0),
        ("abs(y) - sqrt(9)", 0.0),
        ("omega^0.5 - sqrt(omega)", 0.0),
        ("1e3 + .5 + 2.E-1", 1000.7),
        ("cos(pi)", -1.0),
        ("y^3", -27.0),
        ("tan(z) - sin(z)/cos(z)", 0.0),
        ("sinh(z)^2 - cosh(z)^2", -1.0),
        ("log(omega) - ln(2)", 0.0),
        ("bspline(z) - (1.5^3 - 4*0.5^3)/6", 0.0),
        ("bspline(-2*z)", 1.0 / 6.0),
        ("bspline(y)", 0.0),
        ("+z", 0.5),
    ] {
        assert!((value(text) - wanted).abs() < 1e-15 * wanted.abs().max(1.0), "{text}: {}", value(text));
    }
    // The power of a number that is not constant, by exp and ln.
    assert!((value("w^omega") - 25.0).abs() < 1e-13);
    assert!(value("y^0.3").is_nan());
}

#[test]
fn mistakes_are_named() {
    for (text, wanted) in [
        ("q - 1", "unknown name q; allowed are the state omega, y, z, its rates omega', y', z', the time t"),
        ("", "is empty"),
        ("z +", "ends where a number or a name is needed"),
        ("(z", "lacks a closing bracket"),
        ("z)", "has ) where an operator is needed"),
        ("2 z", "has z where an operator is needed"),
        ("z = 1 = 2", "more than one ="),
        ("sin z", "needs a bracket after sin"),
        ("w' + z", "only the state's components have rates"),
        ("z & 1", "has the character '&'"),
        ("1.2.3 z", "has 1.2.3, which is no number"),
        ("z^2000", "whole exponent beyond 1024"),
        ("__import__", "unknown name __import__"),
        ("z; y", "has the character ';'"),
    ] {
        assert!(mistake(text).contains(wanted), "{text}: {}", mistake(text));
    }
    assert!(mistake(&"z+".repeat(6000)).contains("longer than 10000 characters"));
    for open in ["(", "-", "sin(", "2^"] {
        assert!(mistake(&format!("{}z", open.repeat(200))).contains("nested deeper than 100"), "{open}");
    }
}

/// Crossings take room; those left out take none, for one trajectory and in packets.
#[test]
fn nothing_is_allocated_for_crossings_left_out() {
    let (list, tolerance) = ([("z", 1), ("omega - y", 0)], Tolerance::default());
    Isa::best();
    for n in [1, 19] {
        let rows: Vec<Vec<f64>> = (0..n).map(|i| vec![1.0 + 0.3 * f64::from(i), 0.0]).collect();
        for isa in Isa::available() {
            // The first run also makes what a thread keeps.
            let [_, short, long] = [20, 20, 200].map(|skip| {
                let how = How { skip, tolerance, isa, ..How::many(5) };
                allocations(|| collect(&DleFamily, &rows, &[START], &list, how))
            });
            assert!(short > 0, "nothing is counted");
            assert_eq!(short, long, "{n}, {isa:?}");
        }
    }
}
