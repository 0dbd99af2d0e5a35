//! Friction that sticks, against closed forms.

use std::array::from_fn;
use std::f64::consts::{PI, TAU};

use approx::assert_relative_eq;
use proptest::prelude::*;
use udd::analysis::{CancelFlag, Outcome, Output, Run, trajectory};
use udd::integrate::{Dopri5, Ending, Integrator, Taylor, Tolerance, propagate};
use udd::model::effects::{Contact, Contributions, Dry, Effect, EffectInputs, FrictionModel, Kind, Term};
use udd::model::stick_slip::{REVERSAL, Slider, Sticking};
use udd::model::{Disk, DiskFamily, Family, Pendulum, PendulumFamily, Sides, System, WithLuGre, choose};
use udd::observe::Event;
use udd::scalar::{Isa, Mask, Packet, Real, Scalar};
use udd::tape::Tape;

const TIGHT: Tolerance = Tolerance::new(1e-12, 1e-14);

/// `x'' + x = -mu sgn x'`: a pendulum without weight whose cable turns it back.
fn oscillator(mu: f64, treatment: FrictionModel, eps: f64) -> Pendulum<f64> {
    let effects = vec![Effect::new(Kind::CableTorque), Effect::new(Kind::Coulomb).with_treatment(treatment)];
    PendulumFamily { effects }.build(&[1.0, 1.0, 0.0, 0.0, 1.0, 0.0, mu, eps])
}

fn run<M: System<f64, D>, const D: usize>(system: &M, end: f64, x0: [f64; D]) -> Run<D> {
    trajectory(
        system,
        Dopri5::default(),
        Output::Steps(0.0, end, 1),
        x0,
        &TIGHT,
        false,
        (&CancelFlag::new(), None),
    )
    .unwrap()
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
    let system = oscillator(mu, FrictionModel::SetValued, 0.05);
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
    let system = oscillator(0.1, FrictionModel::SetValued, 0.05);
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
fn the_energy_balances() {
    let mu = 0.07;
    let system = oscillator(mu, FrictionModel::SetValued, 0.05);
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
    let effects = vec![Effect::new(Kind::Coulomb).with_treatment(FrictionModel::SetValued)];
    let disk = DiskFamily { effects, edge: true };
    let disk = disk.build(&[0.05, 0.08, 9.81, 0.012, 0.103, 0.055, 0.02, 0.05]);
    // g Y = 0.00981 is less than the friction: the contact moves up at W, and Y stays.
    let run = run(&disk, 10.0, [0.0, 1e-3, 0.0, 0.3]);
    assert_eq!(run.outcome, Outcome::Ejected);
    let end = run.x[run.x.len() - 1];
    assert_eq!((end[0], end[1], end[3]), (0.0, 1e-3, 0.3));
    assert_relative_eq!(run.t[run.t.len() - 1], (0.0064f64 - 1e-6).sqrt() / 0.05, max_relative = 1e-12);
}

const DISK: [f64; 6] = [0.05, 0.08, 9.81, 0.012, 0.103, 0.055];

/// A drive that speeds up and down pulls at a disk that sticks, by `Y dW_c/dT`: it is let go when that and
/// its weight together exceed the friction.
#[test]
fn a_rippling_drive_lets_the_disk_go_in_time() {
    let effects = vec![
        Effect::new(Kind::Coulomb).with_treatment(FrictionModel::SetValued),
        Effect::new(Kind::DriveRipple),
    ];
    let (c, y, ripple, f) = (0.02, 1.5e-3, 0.5, 40.0);
    let values = [&DISK[..], &[c, 0.05, -ripple, 0.0, f]].concat();
    let disk = DiskFamily { effects, edge: true }.build(&values);
    // W_c = W (1 - r cos(2 pi f T)) in this phase.
    let pull = |t: f64| y * (9.81 + 0.05 * ripple * TAU * f * (TAU * f * t).sin());
    let run = run(&disk, 0.02, [0.0, y, 0.0, 0.0]);
    let slip = named(&run.events, &disk, "slip")[0];
    let wanted = ((c / y - 9.81) / (0.05 * ripple * TAU * f)).asin() / (TAU * f);
    assert_relative_eq!(slip.t, wanted, max_relative = 1e-10);
    assert_relative_eq!(pull(slip.t), c, max_relative = 1e-12);
    assert_eq!((slip.x[0], slip.x[1]), (0.0, y));
    assert_relative_eq!(
        slip.x[2],
        0.05 * (slip.t - ripple * (TAU * f * slip.t).sin() / (TAU * f)),
        max_relative = 1e-11
    );
    // It slides the way it was pulled, and sticks again when the pull is over.
    let stick = named(&run.events, &disk, "stick")[0];
    let way: Vec<_> = run.t.iter().zip(&run.x).filter(|(t, _)| (slip.t..stick.t).contains(t)).collect();
    assert!(way.len() > 5 && way[1..].iter().all(|(_, x)| x[0] > 0.0));
    assert!(pull(stick.t) < c);
}

/// A disk with the energy that went into it as one more state.
struct Booked(Disk<f64>, f64);

impl System<f64, 5> for Booked {
    fn rates(&self, t: f64, x: &[f64; 5], sides: &Sides<f64>) -> [f64; 5] {
        let [omega, y, z, beta, _] = *x;
        let own = self.0.rates(t, &[omega, y, z, beta], sides);
        let k = (0.103 - 0.055 * omega.abs()).max(0.012);
        // The drive lifts the weight; friction of both kinds takes.
        let power = 9.81 * self.0.w - k * omega * omega - self.1 * omega.abs();
        [own[0], own[1], own[2], own[3], power]
    }
    fn surfaces(&self) -> usize {
        self.0.surfaces()
    }
    fn surface(&self, j: usize, t: f64, x: &[f64; 5], sides: &Sides<f64>) -> f64 {
        self.0.surface(j, t, &[x[0], x[1], x[2], x[3]], sides)
    }
    fn switch(&self, j: usize, t: f64, x: &mut [f64; 5], sides: &mut Sides<f64>, here: bool) {
        let mut own = [x[0], x[1], x[2], x[3]];
        self.0.switch(j, t, &mut own, sides, here);
        x[..4].copy_from_slice(&own);
    }
    fn jumps(&self, j: usize) -> bool {
        self.0.jumps(j)
    }
}

#[test]
fn the_disk_s_energy_balances() {
    for (c, at_rest) in [(0.005, false), (0.05, true)] {
        let effects = vec![Effect::new(Kind::Coulomb).with_treatment(FrictionModel::SetValued)];
        let values = [&DISK[..], &[c, 0.05]].concat();
        let disk = DiskFamily { effects, edge: false }.build(&values);
        let energy = |x: [f64; 5]| 0.5 * (0.0032 + x[1] * x[1] + x[2] * x[2]) * x[0] * x[0] + 9.81 * x[2];
        let x0 = [3.0, 0.02, 0.0, 0.0, 0.0];
        let run = run(&Booked(disk, c), 3.0, x0);
        let mut largest = 0.0f64;
        for &x in &run.x {
            // 1e-12 per step of what is at most 1 m^2/s^2.
            assert!((energy(x) - energy(x0) - x[4]).abs() < 1e-10, "c = {c}: {x:?}");
            largest = largest.max(x[4].abs());
        }
        assert!(largest > 0.05);
        assert_eq!(run.x[run.x.len() - 1][0] == 0.0, at_rest, "c = {c}");
    }
}

/// A block on a belt that moves at speed `v`, held by a spring; `Omega` is its speed over the belt:
/// `dOmega/dT = -x + dry friction`, `dx/dT = Omega + v`.
struct Block<S> {
    v: f64,
    effects: Vec<Term<S>>,
}

impl<S: Scalar> Block<S> {
    fn new(v: f64, effects: &[Effect], values: &[f64]) -> Self {
        let values: Vec<S> = values.iter().map(|&v| S::constant(v)).collect();
        Self { v, effects: Term::list(effects, &values) }
    }

    fn force(&self, x: &[S; 2], contact: Contact<S>) -> (S, Dry<S>) {
        let zero = S::zero();
        let at = EffectInputs {
            t: zero,
            omega: x[0],
            speed: x[0],
            y: zero,
            z: zero,
            beta: x[1],
            k: zero,
            inertia: S::one(),
            w: zero,
            g: zero,
            radius: S::one(),
            contact,
        };
        let mut slots = Contributions::default();
        for term in &self.effects {
            term.enter(&|s| s, &at, &mut slots);
        }
        (slots.torque - x[1], slots.dry)
    }
}

impl<S: Scalar> Slider<S, 2> for Block<S> {
    const BAND: usize = 1;
    const STUCK: usize = 2;
    fn sticking(&self) -> Sticking {
        Sticking::of(&self.effects)
    }
    fn at_rest(&self, _t: S, x: &[S; 2], _sides: &Sides<S>) -> (S, Dry<S>) {
        self.force(&[S::zero(), x[1]], Contact::default())
    }
}

impl<S: Scalar> System<S, 2> for Block<S> {
    fn rates(&self, _t: S, x: &[S; 2], sides: &Sides<S>) -> [S; 2] {
        [self.held(self.force(x, self.contact(sides)).0, sides), x[0] + S::constant(self.v)]
    }
    fn surfaces(&self) -> usize {
        3
    }
    fn surface(&self, j: usize, t: S, x: &[S; 2], sides: &Sides<S>) -> S {
        if j == REVERSAL { x[0] } else { self.sliding_surface(j, t, x, sides) }
    }
    fn surface_name(&self, j: usize, side: bool) -> &'static str {
        if j == REVERSAL { "reversal" } else { self.contact_event(j, side) }
    }
    fn settle(&self, t: S, x: &[S; 2], sides: &mut Sides<S>) {
        self.settle_contact(t, x, sides);
    }
    fn switch(&self, j: usize, t: S, x: &mut [S; 2], sides: &mut Sides<S>, here: S::Mask) {
        self.switch_contact(j, t, x, sides, here);
    }
    fn jumps(&self, j: usize) -> bool {
        self.contact_jumps(j)
    }
}

/// Friction that is larger at rest than in motion makes a driven block stick and slip for ever; friction
/// that does not lets it slide steadily.
#[test]
fn stribeck_friction_makes_a_block_stick_and_slip() {
    let (v, c, extra) = (0.3, 0.4, 0.6);
    let effects =
        [Kind::Coulomb, Kind::Stribeck].map(|k| Effect::new(k).with_treatment(FrictionModel::SetValued));
    let mut errors = Vec::new();
    for fade in [0.04, 0.01, 0.0025] {
        let block = Block::<f64>::new(v, &effects, &[c, 0.05, extra, fade, 0.05]);
        let run = run(&block, 60.0, [-0.1, 0.0]);
        let (sticks, slips) = (named(&run.events, &block, "stick"), named(&run.events, &block, "slip"));
        assert!(sticks.len() > 3 && slips.len() > 3);
        for slip in &slips {
            // Let go exactly where the spring pulls as hard as friction holds.
            assert_relative_eq!(slip.x[1], c + extra, max_relative = 1e-12);
        }
        let (stick, slip) = (sticks[2], slips.iter().find(|e| e.t > sticks[2].t).unwrap());
        assert_relative_eq!(slip.t - stick.t, (c + extra - stick.x[1]) / v, max_relative = 1e-11);
        // Every cycle is the same: sticking forgets.
        let period = sticks[3].t - sticks[2].t;
        assert_relative_eq!(period, sticks[2].t - sticks[1].t, max_relative = 1e-10);
        // The faster the friction fades, the closer to the block with one friction at rest and another one
        // in motion: it takes a time like the root of the width to get out of it.
        let jump: f64 = extra;
        errors.push((period - 2.0 * jump / v - TAU + 2.0 * (jump / v).atan()).abs());
    }
    for pair in errors.windows(2) {
        assert!((1.8..2.6).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
    assert!(errors[2] < 0.15, "{errors:?}");

    let steady = Block::<f64>::new(v, &effects[..1], &[c, 0.05]);
    let run = run(&steady, 60.0, [-0.1, 0.0]);
    let last = run.x[run.x.len() - 1];
    // It swings about the friction's own place; it sticks once at most and then only swings within v.
    assert!(last[0] < 0.0 && named(&run.events, &steady, "stick").len() <= 1, "{last:?}");
}

/// Where the smoothed law, Karnopp's band and the bristles come to, as their widths go to zero.
#[test]
fn all_treatments_agree_in_the_limit() {
    let mu = 0.1;
    let x0 = [0.5, 1.2];
    let at = |t: f64, treatment, eps| propagate(&oscillator(mu, treatment, eps), 0.0, t, x0, &TIGHT).unwrap();
    let bristled = |t: f64, eps| {
        let system = WithLuGre(oscillator(mu, FrictionModel::Lugre, eps));
        propagate(&system, 0.0, t, [x0[0], x0[1], 0.0], &TIGHT).unwrap()
    };
    // In motion, after two reversals.
    let sharp = at(8.0, FrictionModel::SetValued, 0.05);
    let distance = |x: [f64; 2]| (x[0] - sharp[0]).hypot(x[1] - sharp[1]);
    let (mut smooth, mut banded, mut bristles) = (Vec::new(), Vec::new(), Vec::new());
    for eps in [4e-3, 1e-3, 2.5e-4] {
        smooth.push(distance(at(8.0, FrictionModel::Smoothed, eps)));
        banded.push(distance(at(8.0, FrictionModel::Karnopp, eps)));
        let x = bristled(8.0, eps);
        bristles.push(distance([x[0], x[1]]));
    }
    println!("smoothed {smooth:?}, Karnopp {banded:?}, LuGre {bristles:?}");
    for i in 0..2 {
        // The smoothed law comes as its width; the bristles take a time like the root of theirs to turn over.
        assert!((3.6..4.4).contains(&(smooth[i] / smooth[i + 1])), "{smooth:?}");
        assert!((1.8..2.2).contains(&(bristles[i] / bristles[i + 1])), "{bristles:?}");
    }
    assert!(smooth[2] < 2e-5 && bristles[2] < 0.015);
    // Karnopp's band changes nothing where the block passes it: there the torque is too large to hold.
    assert!(banded.iter().all(|&d| d < 1e-10), "{banded:?}");

    // At rest: the set-valued law stays where the dead band holds it, Karnopp's too, up to the band's width;
    // the bristles hold it but for a slow creep, and the smoothed law creeps to the middle.
    let rest = at(60.0, FrictionModel::SetValued, 0.05);
    assert_eq!(rest[0], 0.0);
    for eps in [1e-2, 1e-3] {
        let karnopp = at(60.0, FrictionModel::Karnopp, eps);
        assert_eq!(karnopp[0], 0.0);
        assert!((karnopp[1] - rest[1]).abs() < eps, "{karnopp:?} {rest:?}");
    }
    let lugre = bristled(60.0, 1e-3);
    assert!((lugre[1] - rest[1]).abs() < 0.5 * 1e-3f64.sqrt() && lugre[0].abs() < 1e-9, "{lugre:?} {rest:?}");
    // In the bristles the deflection holds the load: stiffness mu/eps.
    assert_relative_eq!(lugre[2] * mu / 1e-3, -lugre[1], max_relative = 1e-6);
    let smoothed = at(600.0, FrictionModel::Smoothed, 0.01);
    assert!(smoothed[1].abs() < 1e-6, "{smoothed:?}");
}

/// Karnopp's band lets go and catches again at its own surfaces.
#[test]
fn karnopp_s_band_is_entered_and_left() {
    let (v, c, extra, band) = (0.3, 0.4, 0.6, 0.02);
    let effects =
        [Kind::Coulomb, Kind::Stribeck].map(|k| Effect::new(k).with_treatment(FrictionModel::Karnopp));
    let block = Block::<f64>::new(v, &effects, &[c, band, extra, 0.1, band]);
    let run = run(&block, 60.0, [-0.1, 0.0]);
    let mut seen = 0;
    for pair in run.events.windows(2) {
        let names = [pair[0].name(&block), pair[1].name(&block)];
        match names {
            ["stick", next] => assert_eq!(next, "slip"),
            // Let go, it has to get out of the band before it can be caught again.
            ["slip", next] => {
                assert_eq!(next, "band");
                assert_relative_eq!(pair[1].x[0], -band, max_relative = 1e-11);
                seen += 1;
            }
            _ => {}
        }
    }
    assert!(seen > 3);
}

/// Lanes stick, each at its own time, with the same bits as alone.
#[test]
fn lanes_have_the_bits_of_single_runs() {
    const L: usize = 4;
    let starts = [[0.0, 1.53], [0.3, 0.4], [0.0, 0.05], [-2.0, 0.3]];
    let end = 80.0;
    let effects = vec![
        Effect::new(Kind::CableTorque),
        Effect::new(Kind::Coulomb).with_treatment(FrictionModel::Karnopp),
        Effect::new(Kind::Stribeck).with_treatment(FrictionModel::SetValued),
    ];
    let family = PendulumFamily { effects };
    let values = [1.0, 1.0, 0.3, 0.01, 1.0, 0.0, 0.05, 0.01, 0.06, 0.5, 0.05];
    let wide = family.build(&values.map(<Packet<L>>::constant));
    let x0 = from_fn(|n| Packet::from_lanes(|i| starts[i][n]));
    let zero = Packet::constant(0.0);
    let mut driver: Integrator<_, Packet<L>, 2> = Integrator::new(&wide, zero, x0, None, &TIGHT);
    while (0..L).any(|i| driver.t().lane(i) < end) {
        let progress = driver.trial(Packet::constant(end));
        assert!(!progress.failed.any());
    }
    let one = family.build(&values);
    for (i, &start) in starts.iter().enumerate() {
        let mut single: Integrator<_, f64, 2> = Integrator::new(&one, 0.0, start, None, &TIGHT);
        while single.t() < end {
            single.advance(end).unwrap();
        }
        let lane: [f64; 2] = from_fn(|n| driver.x()[n].lane(i));
        assert_eq!(lane.map(f64::to_bits), single.x().map(f64::to_bits), "{start:?}");
        assert_eq!(lane[0], 0.0);
    }
}

/// The series knows the modes: the Taylor method sticks, slips and goes on as Dormand & Prince's does.
#[test]
fn methods_agree_on_when_it_sticks() {
    fn events<F: Family<D>, const D: usize>(family: &F, values: &[f64], x0: [f64; D]) -> (usize, f64) {
        let (system, tape) = (family.build(values), Tape::record(family, &[]).unwrap());
        let mut one: Integrator<_, f64, D> = Integrator::new(&system, 0.0, x0, None, &TIGHT);
        let series = Taylor::new(&tape, values.to_vec(), 18, Isa::best());
        let mut other: Integrator<_, f64, D, _, _> = Integrator::by(series, &system, 0.0, x0, None, &TIGHT);
        let (mut a, mut b) = (Vec::new(), Vec::new());
        while one.t() < 10.0 {
            if let Ending::Surface(j) = one.advance(10.0).unwrap() {
                a.push((j, one.t()));
            }
        }
        while other.t() < 10.0 {
            if let Ending::Surface(j) = other.advance(10.0).unwrap() {
                b.push((j, other.t()));
            }
        }
        assert_eq!(a.iter().map(|e| e.0).collect::<Vec<_>>(), b.iter().map(|e| e.0).collect::<Vec<_>>());
        let apart = a.iter().zip(&b).map(|(a, b)| (a.1 - b.1).abs()).fold(0.0, f64::max);
        let ends = one.x().iter().zip(other.x()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        (a.len(), apart.max(ends))
    }
    for treatment in [FrictionModel::SetValued, FrictionModel::Karnopp] {
        let dry = [Kind::Coulomb, Kind::Stribeck].map(|kind| Effect::new(kind).with_treatment(treatment));
        let pendulum = PendulumFamily { effects: dry.to_vec() };
        let (count, apart) =
            events(&pendulum, &[0.5, 0.25, 9.81, 0.002, 0.05, 0.05, 0.05, 1.0, 0.05], [0.0, 1.0]);
        // Errors of 1e-12 a step, which the disk amplifies while it slides.
        assert!(count > 10 && apart < 1e-9, "{treatment:?}: {count} events, {apart:e}");
        let ripple = Effect::new(Kind::DriveRipple);
        let disk = DiskFamily { effects: vec![dry[0].clone(), ripple], edge: false };
        let values = [&DISK[..], &[0.02, 0.05, -0.9, 0.0, 10.0]].concat();
        let (count, apart) = events(&disk, &values, [0.0, 1.7e-3, 0.0, 0.0]);
        assert!(count > 50 && apart < 1e-8, "{treatment:?}: {count} events, {apart:e}");
    }
}

/// A ball that bounces ever lower: infinitely often in a finite time.
struct Ball;

impl System<f64, 2> for Ball {
    fn rates(&self, _t: f64, x: &[f64; 2], _sides: &Sides<f64>) -> [f64; 2] {
        [x[1], -1.0]
    }
    fn surfaces(&self) -> usize {
        1
    }
    fn surface(&self, _j: usize, _t: f64, x: &[f64; 2], _sides: &Sides<f64>) -> f64 {
        x[0]
    }
    fn switch(&self, _j: usize, _t: f64, x: &mut [f64; 2], sides: &mut Sides<f64>, here: bool) {
        x[1] *= -0.9;
        x[0] = 0.0;
        sides[0] = choose(here, true, sides[0]);
    }
    fn jumps(&self, _j: usize) -> bool {
        true
    }
}

#[test]
fn chattering_is_an_outcome() {
    let tolerance = Tolerance::default();
    let times = [0.0, 1.0, 10.0, 40.0, 50.0];
    let run = trajectory(
        &Ball,
        Dopri5::default(),
        Output::At(&times),
        [1.0, 0.0],
        &tolerance,
        true,
        (&CancelFlag::new(), None),
    )
    .unwrap();
    assert_eq!(run.outcome, Outcome::Chattering);
    // It falls for sqrt 2, then flies for 2 sqrt 2 (0.9 + 0.9^2 + ...) = 18 sqrt 2.
    let end = run.t[run.t.len() - 1];
    // Its remaining flight once its height is below a step's 1e-12: about 1e-3.
    assert!((end - 19.0 * 2f64.sqrt()).abs() < 1e-3, "{end}");
    assert_eq!(run.t[..3], [0.0, 1.0, 10.0]);
    assert_eq!((run.t.len(), run.x.len()), (4, 4));
    assert!(run.events.len() < 400 && run.counts.evaluations < 50_000, "{:?}", run.counts);
}

/// A disk at rest on its bristles trembles about `Omega = 0` by less than the tolerance: no landing leads
/// back in time.
#[test]
fn bristles_at_rest_are_no_trap() {
    let effects =
        vec![Effect::new(Kind::Coulomb).with_treatment(FrictionModel::Lugre), Effect::new(Kind::CubicDrag)];
    let values = [0.0135, 0.08, 9.81, 0.012, 0.103, 0.055, 0.043, 0.0081, 0.0067];
    let disk = WithLuGre(DiskFamily { effects, edge: false }).build(&values);
    for k in 0..40 {
        let rtol = 4e-7 * 1.01f64.powi(k);
        let tolerance = Tolerance::new(rtol, 1e-3 * rtol);
        let start = [0.0, -0.0085, 0.0085, 0.0, 0.0];
        let mut driver: Integrator<_, f64, 5> = Integrator::new(&disk, 0.0, start, None, &tolerance);
        let mut before = 0.0;
        while driver.t() < 20.0 {
            driver.advance(20.0).unwrap();
            assert!(driver.t() >= before && driver.size() >= 0.0);
            before = driver.t();
            // Some 800 steps, and some dozen landings.
            assert!(driver.counts().evaluations < 100_000, "{:?}", driver.counts());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// From any start, at any tolerance, with any friction: the run ends, with bounded work, and while it
    /// sticks it is at rest and friction can hold it.
    #[test]
    fn any_run_that_sticks_ends(
        omega in prop_oneof![Just(0.0), Just(1e-13), Just(-1e-10), -5.0..5.0f64],
        theta in prop_oneof![Just(0.0), -3.0..3.0f64],
        c in prop_oneof![Just(0.0), 0.0..0.5f64],
        extra in prop_oneof![Just(0.0), 0.0..1.0f64],
        pull in -0.5..0.5f64,
        eps in 1e-4..0.1f64,
        karnopp in any::<bool>(),
        digits in 4.0..12.0f64,
    ) {
        let treatment = if karnopp { FrictionModel::Karnopp } else { FrictionModel::SetValued };
        let mut effects = vec![Effect::new(Kind::CableTorque)];
        effects.extend([Kind::Coulomb, Kind::Stribeck].map(|k| Effect::new(k).with_treatment(treatment)));
        // A cable that pulls to one side, so that it can be let go again.
        let values = [0.5, 0.25, 9.81, 0.01, 0.1, pull, c, eps, extra, 0.3, eps];
        let system = PendulumFamily { effects }.build(&values);
        let rtol = 10f64.powf(-digits);
        let tolerance = Tolerance::new(rtol, 1e-3 * rtol);
        let run = trajectory(&system, Dopri5::default(), Output::Steps(0.0, 10.0, 1), [omega, theta], &tolerance, false, (&CancelFlag::new(), None));
        let run = run.unwrap();
        prop_assert_eq!(run.outcome, Outcome::Finished);
        // At 1e-12 ten seconds take up to 3000 steps.
        prop_assert!(run.counts.evaluations < 100_000, "{:?}", run.counts);
        for event in named(&run.events, &system, "stick") {
            let torque = pull - 0.1 * event.x[1] - 9.81 * 0.5 * event.x[1].sin();
            prop_assert!(event.x[0] == 0.0 && torque.abs() <= (c + extra) * (1.0 + 1e-12));
        }
    }
}
