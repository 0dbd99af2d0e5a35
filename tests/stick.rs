//! Friction that sticks, against closed forms.

use std::f64::consts::PI;

use approx::assert_relative_eq;
use udd::integrate::{Driver, Ending, Tolerance, propagate};
use udd::model::effects::{Effect, Kind, Treatment};
use udd::model::{DiskFamily, Family, Pendulum, PendulumFamily, System};
use udd::observe::Event;
use udd::run::{Outcome, Output, Run, Stop, trajectory};

const TIGHT: Tolerance = Tolerance { rtol: 1e-12, atol: 1e-14 };

/// `x'' + x = -mu sgn x'`: a pendulum without weight whose cable turns it back.
fn oscillator(mu: f64, treatment: Treatment, eps: f64) -> Pendulum<f64> {
    let effects = vec![Effect::new(Kind::CableTorque), Effect::new(Kind::Coulomb).with_treatment(treatment)];
    PendulumFamily { effects }.build(&[1.0, 1.0, 0.0, 0.0, 1.0, 0.0, mu, eps])
}

fn run<M: System<f64, D>, const D: usize>(system: &M, end: f64, x0: [f64; D]) -> Run<D> {
    trajectory(system, Output::Steps(0.0, end), x0, &TIGHT, false, &Stop::new()).unwrap()
}

fn named<'a, const D: usize>(
    events: &'a [Event<D>],
    system: &impl System<f64, D>,
    name: &str,
) -> Vec<&'a Event<D>> {
    events.iter().filter(|event| event.name(system) == name).collect()
}

#[test]
fn the_amplitude_falls_by_2_mu_per_half_cycle_and_then_it_sticks() {
    let mu = 0.1;
    let system = oscillator(mu, Treatment::SetValued, 0.05);
    let run = run(&system, 60.0, [0.0, 1.53]);
    let turns = named(&run.events, &system, "reversal");
    assert_eq!(turns.len(), 7);
    for (i, turn) in turns.iter().enumerate() {
        let i = (i + 1) as f64;
        // Each half cycle takes a time of pi, as without friction. 1e-12 per step, some hundred steps.
        assert_relative_eq!(turn.t, i * PI, max_relative = 1e-10);
        assert_relative_eq!(turn.x[1].abs(), 1.53 - 2.0 * mu * i, max_relative = 1e-10);
        assert!(turn.x[0].abs() < 1e-12);
    }
    // From 0.13 it comes to -0.07, within the dead band, and stays.
    let stuck = named(&run.events, &system, "stick");
    assert_eq!((stuck.len(), run.events.len()), (1, 8));
    assert_relative_eq!(stuck[0].t, 8.0 * PI, max_relative = 1e-10);
    assert_relative_eq!(stuck[0].x[1], 1.53 - 1.6, max_relative = 1e-9);
    assert_eq!(stuck[0].x[0], 0.0);
    assert_eq!(run.x[run.x.len() - 1], stuck[0].x);
    assert_eq!(run.outcome, Outcome::Finished);
}

#[test]
fn a_start_within_the_dead_band_never_moves() {
    let system = oscillator(0.1, Treatment::SetValued, 0.05);
    for x in [-0.1, -0.03, 0.0, 0.099] {
        let run = run(&system, 10.0, [0.0, x]);
        assert!(run.x.iter().all(|&state| state == [0.0, x]) && run.events.is_empty());
    }
    for x in [-0.101, 0.101] {
        let run = run(&system, 10.0, [0.0, x]);
        // It swings to the other side of the force's centre, and stays there.
        assert_relative_eq!(run.x[run.x.len() - 1][1], x.signum() * 0.2 - x, max_relative = 1e-8);
    }
}

/// The energy lost is friction's force times the way: exactly, half cycle by half cycle.
#[test]
fn the_energy_book_balances() {
    let mu = 0.07;
    let system = oscillator(mu, Treatment::SetValued, 0.05);
    let run = run(&system, 60.0, [0.3, 1.2]);
    let energy = |x: [f64; 2]| 0.5 * (x[0] * x[0] + x[1] * x[1]);
    let mut before = run.x[0];
    for event in &run.events {
        let way = (event.x[1] - before[1]).abs();
        assert!((energy(before) - energy(event.x) - mu * way).abs() < 1e-11);
        before = event.x;
    }
    assert!(run.events.len() > 5);
}

#[test]
fn a_disk_that_sticks_is_carried_to_its_edge() {
    let effects = vec![Effect::new(Kind::Coulomb).with_treatment(Treatment::SetValued)];
    let disk = DiskFamily { effects, edge: true };
    let disk = disk.build(&[0.05, 0.08, 9.81, 0.012, 0.103, 0.055, 0.02, 0.05]);
    // g Y = 0.00981 is less than the friction: the contact moves up at W, and Y stays.
    let run = run(&disk, 10.0, [0.0, 1e-3, 0.0, 0.3]);
    assert_eq!(run.outcome, Outcome::Ejected);
    let end = run.x[run.x.len() - 1];
    assert_eq!((end[0], end[1], end[3]), (0.0, 1e-3, 0.3));
    assert_relative_eq!(run.t[run.t.len() - 1], (0.0064f64 - 1e-6).sqrt() / 0.05, max_relative = 1e-12);
}
