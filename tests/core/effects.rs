//! Properties of every effect of the library, including future ones.

use std::array::from_fn;

use proptest::prelude::*;
use udd::integrate::{Tolerance, propagate};
use udd::model::effects::{Contact, Contributions, EffectInputs, FrictionModel, Kind, Role, Slot, Term};
use udd::model::{Disk, DiskFamily, Effect, Family, Momentum, PendulumFamily, System, sides_of};
use udd::scalar::{Dual, Scalar};

const PLAIN: [f64; 6] = [0.039, 0.08, 9.81, 0.012, 0.103, 0.055];

/// Every effect, in each way it can enter.
fn all() -> Vec<Effect> {
    let ways = |kind: Kind| match kind.spec().momenta {
        [] if kind.dry() => [FrictionModel::Smoothed, FrictionModel::SetValued, FrictionModel::Karnopp]
            .map(|treatment| Effect::new(kind).with_treatment(treatment))
            .to_vec(),
        [] => vec![Effect::new(kind)],
        momenta => momenta.iter().map(|&m| Effect::new(kind).with_momentum(Some(m))).collect(),
    };
    Kind::ALL.iter().flat_map(|&kind| ways(kind)).collect()
}

/// Parameter values: amplitudes of a typical size, the others at their defaults.
fn values(effect: &Effect, amplitude: f64) -> Vec<f64> {
    let of = |p: &udd::model::effects::EffectParameter| match p.role {
        Role::Amplitude => amplitude,
        _ => p.default,
    };
    effect.kind().unwrap().spec().parameters.iter().map(of).collect()
}

fn family(effect: &Effect) -> DiskFamily {
    DiskFamily { effects: vec![effect.clone()], edge: false }
}

fn with(effect: &Effect, amplitude: f64) -> Disk<f64> {
    family(effect).build(&[&PLAIN[..], &values(effect, amplitude)].concat())
}

fn rates<S: Scalar, const D: usize>(system: &impl System<S, D>, t: S, x: &[S; D]) -> [S; D] {
    system.rates(t, x, &sides_of(system, t, x))
}

prop_compose! {
    /// A time and a state on the disk, off the kinks.
    fn anywhere()(
        t in 0.0..60.0f64,
        omega in prop_oneof![-12.0..-1.8f64, -1.5..-0.1f64, 0.1..1.5f64, 1.8..12.0f64],
        radius in 0.005..0.07f64,
        angle in 0.0..std::f64::consts::TAU,
        beta in -20.0..20.0f64,
    ) -> (f64, [f64; 4]) {
        (t, [omega, radius * angle.sin(), radius * angle.cos(), beta])
    }
}

#[test]
fn descriptions_are_complete() {
    for &kind in Kind::ALL {
        let spec = kind.spec();
        for text in [spec.name, spec.title, spec.equation, spec.meaning] {
            assert!(!text.is_empty(), "{}", spec.name);
        }
        assert!(!spec.slots.is_empty() && spec.equation.contains('='), "{}", spec.name);
        let velocity = spec.slots.iter().any(|slot| matches!(slot, Slot::Lateral | Slot::Vertical));
        assert_eq!(velocity, !spec.momenta.is_empty(), "{}", spec.name);
        for p in spec.parameters {
            assert!(p.range.0 <= p.default && p.default <= p.range.1, "{}.{}", spec.name, p.name);
            if p.role == Role::Amplitude {
                assert_eq!(p.default, 0.0, "{}.{}", spec.name, p.name);
            }
        }
        let amplitudes = spec.parameters.iter().filter(|p| p.role == Role::Amplitude).count();
        assert!(amplitudes >= 1, "{}", spec.name);
        let same = Kind::ALL.iter().filter(|other| other.spec().name == spec.name).count();
        assert_eq!(same, 1, "{}", spec.name);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn zero_amplitude_changes_nothing((t, x) in anywhere()) {
        let plain = rates(&DiskFamily { effects: vec![], edge: false }.build(&PLAIN), t, &x);
        for effect in all() {
            let changed = rates(&with(&effect, 0.0), t, &x);
            for n in 0..4 {
                // The terms of the third equation are summed in another order.
                prop_assert!((changed[n] - plain[n]).abs() <= 1e-13 * (1.0 + plain[n].abs()), "{effect:?}");
            }
        }
    }

    #[test]
    fn an_amplitude_changes_the_equation_it_enters((t, x) in anywhere()) {
        let plain = rates(&DiskFamily { effects: vec![], edge: false }.build(&PLAIN), t, &x);
        for effect in all() {
            let changed = rates(&with(&effect, 0.1), t, &x);
            let differs = |n: usize| (changed[n] - plain[n]).abs() > 1e-12;
            let spec = effect.kind().unwrap().spec();
            let has = |slot| spec.slots.contains(&slot);
            prop_assert!(has(Slot::Lateral) || !differs(1), "{effect:?} changes dY/dT");
            prop_assert!(has(Slot::Vertical) || !differs(2), "{effect:?} changes dZ/dT");
            prop_assert!(!differs(3));
            let constraint_only = effect.momentum == Some(Momentum::Constraint);
            prop_assert!(!constraint_only || !differs(0), "{effect:?} changes dOmega/dT");
        }
    }

    /// Derivatives from duals, with respect to the state and every parameter, against central
    /// differences.
    #[test]
    fn duals_agree_with_differences((t, x) in anywhere()) {
        type N = Dual<f64, 1>;
        // Where a pendulum's load changes sign, its size bends within less than the differences' steps.
        let load = x[3].cos() + PLAIN[1] * x[0] * x[0] / PLAIN[2];
        for effect in all().into_iter().filter(|e| e.kind() != Some(Kind::LoadCoulomb) || load.abs() > 0.1) {
            let plain = [&PLAIN[..], &values(&effect, 0.1)].concat();
            for i in 0..4 + plain.len() {
                let at = |shift: f64| {
                    let (mut x, mut p) = (x, plain.clone());
                    if i < 4 { x[i] += shift } else { p[i - 4] += shift }
                    rates(&family(&effect).build(&p), t, &x)
                };
                let tagged = |value: f64, mine: bool| if mine { N::variable(value, 0) } else { N::fixed(value) };
                let p: Vec<N> = plain.iter().enumerate().map(|(k, &v)| tagged(v, i == 4 + k)).collect();
                let state = from_fn(|k| tagged(x[k], i == k));
                let exact = rates(&family(&effect).build(&p), N::fixed(t), &state);
                let size = if i < 4 { x[i] } else { plain[i - 4] }.abs();
                // Fourth-order differences over 3e-4 of a typical size.
                let h = 3e-4 * size.max(0.01);
                let (a, b, c, d) = (at(-2.0 * h), at(-h), at(h), at(2.0 * h));
                for n in 0..4 {
                    let difference = (a[n] - 8.0 * b[n] + 8.0 * c[n] - d[n]) / (12.0 * h);
                    // Rounding of the rates over the step, and the truncation where laws bend over eps.
                    let rounding = 1e-14 * (1.0 + a[n].abs() + d[n].abs()) / h;
                    let allowed = 100.0 * rounding + 1e-4 * (exact[n].d[0].abs() + difference.abs());
                    prop_assert!(
                        (exact[n].d[0] - difference).abs() <= allowed,
                        "{effect:?}: d rate {n} / d {i}: {} and {difference}", exact[n].d[0]
                    );
                }
            }
        }
    }

    /// The exact equation of motion: `dJ/dT = g Y - k Omega + torque` with
    /// `J = I Omega + Z u - Y W_c`, differentiated along the flow; an effect on the constraint
    /// alone leaves `I dOmega/dT = g Y - k Omega - Z W Omega`.
    #[test]
    fn angular_momentum_is_consistent((t, x) in anywhere()) {
        type N = Dual<f64, 1>;
        let [w, radius, g, k0, k1, k2] = PLAIN;
        for effect in all() {
            let own = values(&effect, 0.1);
            let flow = rates(&with(&effect, 0.1), t, &x);
            let time = N { re: t, d: [1.0] };
            let [omega, y, z, beta]: [N; 4] = from_fn(|n| N { re: x[n], d: [flow[n]] });
            let speed = if x[0] > 0.0 { omega } else { -omega };
            let slow = k1 - k2 * x[0].abs() > k0;
            let k = if slow { N::fixed(k1) - speed.scale(k2) } else { N::fixed(k0) };
            let inertia = N::fixed(radius * radius / 2.0) + y.square() + z.square();
            let at = EffectInputs {
                t: time, omega, speed, y, z, beta, k, inertia,
                w: N::fixed(w), g: N::fixed(g), radius: N::fixed(radius),
                contact: Contact { sign: N::fixed(x[0].signum()), bristle: N::fixed(0.0) },
            };
            let term = &Term::list(std::slice::from_ref(&effect), &own)[0];
            let mut slots = Contributions::default();
            term.enter(&N::fixed, &at, &mut slots);

            let moment = (at.g * y - (k + slots.friction) * omega + slots.torque).re;
            // The contact's velocity from the flow.
            let scale = moment.abs() + (inertia.re * flow[0]).abs() + 1e-3;
            prop_assert!((flow[1] - (x[2] * x[0] + slots.lateral.re)).abs() < 1e-13);
            prop_assert!((flow[2] - (-x[1] * x[0] + w + slots.vertical.re)).abs() < 1e-13);
            if effect.momentum == Some(Momentum::Constraint) {
                let left = inertia.re * flow[0];
                prop_assert!((left - (moment - x[2] * w * x[0])).abs() < 1e-12 * scale, "{effect:?}");
            } else {
                let (u, w_c) = (slots.lateral, N::fixed(w) + slots.vertical);
                let momentum = inertia * omega + z * u - y * w_c;
                prop_assert!((momentum.d[0] - moment).abs() < 1e-12 * scale, "{effect:?}: {} {moment}", momentum.d[0]);
            }
        }
    }
}

/// Over a run with reversals and kinks the derivative with respect to each amplitude agrees with a
/// central difference of runs.
#[test]
fn sensitivities_of_runs_agree_with_differences() {
    type N = Dual<f64, 1>;
    let x0 = [0.0, 1e-3, 0.04, 0.3];
    let tight = Tolerance::new(1e-12, 1e-14);
    for effect in all() {
        for (i, p) in effect.kind().unwrap().spec().parameters.iter().enumerate() {
            if p.role != Role::Amplitude {
                continue;
            }
            let plain = [&PLAIN[..], &values(&effect, 1e-3)].concat();
            let run = |by: f64| {
                let mut p = plain.clone();
                p[6 + i] += by;
                propagate(&family(&effect).build(&p), 0.0, 0.5, x0, &tight).unwrap()
            };
            let tagged: Vec<N> =
                (0..plain.len()).map(|k| N { re: plain[k], d: [f64::from(k == 6 + i)] }).collect();
            let exact =
                propagate(&family(&effect).build(&tagged), 0.0, 0.5, x0.map(N::fixed), &tight).unwrap();
            let h = 1e-5;
            let (up, down) = (run(h), run(-h));
            for n in 0..4 {
                let difference = (up[n] - down[n]) / (2.0 * h);
                // Runs are accurate to about 1e-10; the third derivative is at most 1e4 times the first.
                let allowed = 1e-10 / h + 1e-5 * exact[n].d[0].abs();
                assert!(
                    (exact[n].d[0] - difference).abs() < allowed,
                    "{effect:?} {}: d x{n}: {} {difference}",
                    p.name,
                    exact[n].d[0]
                );
            }
        }
    }
}

/// A pendulum of the disk's geometry feels torque and friction as the undriven disk does.
#[test]
fn effects_act_alike_on_pendulum_and_disk() {
    // The load on a pendulum's pivot has the rod's length in it.
    let alike = |e: &Effect| e.momentum.is_none() && e.kind() != Some(Kind::LoadCoulomb);
    for effect in all().into_iter().filter(alike) {
        let own = values(&effect, 0.1);
        let (length, theta) = (0.05, 0.4f64);
        let inertia = 0.0032 + length * length;
        let pendulum = PendulumFamily { effects: vec![effect.clone()] }
            .build(&[&[length, inertia, 9.81, 0.012][..], &own].concat());
        let disk = DiskFamily { effects: vec![effect.clone()], edge: false }
            .build(&[&[0.0, 0.08, 9.81, 0.012, 0.012, 0.0][..], &own].concat());
        // The same place and speed; gravity's own torque, opposite by the models' conventions, is left out.
        for omega in [-2.0, 0.5] {
            let x = [omega, length * theta.sin(), -length * theta.cos(), theta];
            let (a, b) = (rates(&pendulum, 1.0, &[omega, theta])[0], rates(&disk, 1.0, &x)[0]);
            let plain = -9.81 * x[1] / inertia;
            let plain_disk = 9.81 * x[1] / inertia;
            assert!(
                ((a - plain) - (b - plain_disk)).abs() < 1e-11,
                "{effect:?}: {} {}",
                a - plain,
                b - plain_disk
            );
        }
    }
}

/// Dry friction under load brakes a pendulum by the tension of its rod, under a push as under a pull.
#[test]
fn load_coulomb_brakes_by_the_force_along_the_rod() {
    let (length, f) = (0.5, 0.004);
    let family = |effects| PendulumFamily { effects };
    let plain = [length, length * length, 9.81, 0.01];
    for (omega, theta) in [(3.0, 0.4f64), (-3.0, 0.4), (0.5, 2.9)] {
        let x = [omega, theta];
        let with = family(vec![Effect::new(Kind::LoadCoulomb)]).build(&[&plain[..], &[f, 0.05]].concat());
        let without = family(vec![]).build(&plain);
        let added = (rates(&with, 0.0, &x)[0] - rates(&without, 0.0, &x)[0]) * length * length;
        let tension: f64 = theta.cos() + length * omega * omega / 9.81;
        assert!((added + f * tension.abs() * (omega / 0.05).tanh()).abs() < 1e-8, "{omega} {theta}: {added}");
    }
}
