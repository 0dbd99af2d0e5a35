//! Tapes and the power series that they give.

use std::array::from_fn;

use proptest::prelude::*;
use udd::integrate::{ErrorNorm, Tolerance};
use udd::model::effects::{FrictionModel, Kind, Role};
use udd::model::{
    DiskFamily, DleFamily, Effect, Family, FormulaFamily, MAX_SURFACES, Parameter, PendulumFamily, Sides,
    System, sides_of,
};
use udd::scalar::{Dual, InstructionSet, Isa, LANES, Mask, Packet, Plain, Real, Scalar, Work};
use udd::tape::{HIGH, Jets, Tape};

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

/// The disk without effects, with each one, and with all torques at once.
fn disks() -> Vec<(DiskFamily, Vec<f64>)> {
    let mut sets: Vec<Vec<Effect>> = all().into_iter().map(|effect| vec![effect]).collect();
    sets.push(vec![]);
    let together = |effect: &Effect| effect.momentum.is_none() && effect.treatment == FrictionModel::Smoothed;
    sets.push(all().into_iter().filter(together).collect());
    let with = |effects: Vec<Effect>| {
        let own = effects.iter().flat_map(|effect| values(effect, 1e-3));
        let p = PLAIN.into_iter().chain(own).collect();
        (DiskFamily { effects, edge: false }, p)
    };
    sets.into_iter().map(with).collect()
}

fn close(a: f64, b: f64, by: f64) -> bool {
    (a - b).abs() <= by
}

/// A tape's rates and those of its model, with no parameter known in advance and with all.
fn same_rates<const D: usize, F: Family<D>>(family: &F, p: &[f64], t: f64, x: [f64; D]) {
    let system = family.build(p);
    let sides = sides_of(&system, t, &x);
    let rates = system.rates(t, &x, &sides);
    let known: Vec<Option<f64>> = p.iter().copied().map(Some).collect();
    for fixed in [&vec![None; p.len()], &known] {
        let tape = Tape::record(family, fixed).unwrap();
        let taped = tape.rates(p, t, &x, &sides);
        for n in 0..D {
            // Products are taken in another order; terms of up to 10 times the rate cancel.
            assert!(close(taped[n], rates[n], 1e-13 * (1.0 + rates[n].abs())), "{n}: {taped:?} {rates:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn a_tape_has_the_rates_of_its_model(
        t in 0.0..60.0f64,
        omega in -12.0..12.0f64,
        radius in 0.005..0.07f64,
        angle in 0.0..std::f64::consts::TAU,
        beta in -20.0..20.0f64,
    ) {
        for (family, p) in disks() {
            same_rates(&family, &p, t, [omega, radius * angle.sin(), radius * angle.cos(), beta]);
        }
        same_rates(&DleFamily, &[7.1, 0.2], t, [omega, beta, 40.0 * radius]);
        for effect in all().into_iter().filter(|e| e.momentum.is_none() && e.treatment == FrictionModel::Smoothed) {
            let p = [&[0.05, 0.0057, 9.81, 0.012][..], &values(&effect, 0.1)].concat();
            same_rates(&PendulumFamily { effects: vec![effect] }, &p, t, [omega, beta]);
        }
    }
}

#[test]
fn what_a_known_parameter_removes_is_left_out() {
    let damped = Tape::record(&DleFamily, &[]).unwrap();
    let plain = Tape::record(&DleFamily, &[None, Some(0.0)]).unwrap();
    // y - omega, omega z, omega y, w - omega y.
    assert_eq!((plain.steps().len(), plain.held().len()), (4, 1));
    assert_eq!(damped.steps().len(), 6);
    assert!(plain.is_unrolled(), "rust/tape/specialised.rs has another tape for the DLE than is recorded");
    assert!(
        damped.is_unrolled(),
        "rust/tape/specialised.rs has another tape for the damped DLE than is recorded"
    );
    let effect = Effect::new(Kind::EccentricMass);
    let disk = |effects| DiskFamily { effects, edge: false };
    let without = Tape::record(&disk(vec![]), &[]).unwrap();
    assert!(without.is_unrolled(), "rust/tape/specialised.rs has another tape for the disk than is recorded");
    let zero: Vec<Option<f64>> = [None; 6].into_iter().chain([Some(0.0); 2]).collect();
    let absent = Tape::record(&disk(vec![effect]), &zero).unwrap();
    assert_eq!(absent.steps().len(), without.steps().len());
    // The written series rounds otherwise: a disk has it whatever is zero, or whatever is zero does not have it.
    assert!(!absent.is_unrolled());
    assert_eq!(Tape::record(&disk(vec![]), &[Some(0.0)]).unwrap(), without);
}

/// A small system whose solution is known in closed form.
#[derive(Clone, Copy)]
struct Closed<S>([S; 2]);
#[derive(Clone, Copy, PartialEq)]
struct ClosedFamily;

impl<S: Scalar> System<S, 8> for Closed<S> {
    /// Solutions through 1/2 at t = 0, in turn: `e^t/2`, `tan(t + c)`, `sqrt(t + 1/4)`, `1/(2 - t)`, then
    /// functions of the time alone.
    fn rates(&self, t: S, x: &[S; 8], _sides: &Sides<S>) -> [S; 8] {
        let (a, b) = (self.0[0], self.0[1]);
        [
            x[0],
            S::one() + x[1].square(),
            S::constant(0.5) / x[2],
            x[3] * x[3],
            (t * a + b).sin() + (t * a + b).cos(),
            (t * a + b).tanh(),
            (t * a + b).ln() + (t * a + b).exp(),
            (t * a + b).sqrt() / (t + b),
        ]
    }
}

impl Family<8> for ClosedFamily {
    type Built<S: Scalar> = Closed<S>;
    fn parameters(&self) -> Vec<Parameter> {
        ["a", "b"].map(|name| Parameter { name: name.to_owned(), unit: "" }).to_vec()
    }
    fn build<S: Scalar>(&self, values: &[S]) -> Closed<S> {
        Closed([values[0], values[1]])
    }
}

#[test]
fn series_of_closed_forms() {
    const N: usize = 25;
    let tape = Tape::record(&ClosedFamily, &[]).unwrap();
    let mut jets = Jets::<f64, 8, N>::new(&tape, Isa::best());
    let (a, b) = (0.7, 1.3);
    jets.expand(&tape, &[a, b], 0.0, &[0.5; 8], &[true; MAX_SURFACES]);
    // All radii of convergence exceed 1: the nearest singularities are those of tan at 1.11, of ln and
    // sqrt at b/a, of the quotient at b, and of tanh at sqrt(b^2 + pi^2/4)/a.
    for dt in [-0.1, 0.05, 0.1] {
        let x = jets.at(dt);
        let u = a * dt + b;
        let expected = [
            0.5 * f64::exp(dt),
            (dt + 0.5f64.atan()).tan(),
            (dt + 0.25f64).sqrt(),
            1.0 / (2.0 - dt),
            0.5 + (u.sin() - b.sin() + b.cos() - u.cos()) / a,
            0.5 + (u.cosh() / b.cosh()).ln() / a,
            0.5 + (u * u.ln() - u - b * b.ln() + b + u.exp() - b.exp()) / a,
        ];
        for n in 0..7 {
            // The square root's radius is 1/4: its truncation at 0.1 is 0.4^25/25 = 4e-12.
            let allowed = if n == 2 { 1e-11 } else { 4e-15 };
            assert!(close(x[n], expected[n], allowed), "{n} at {dt}: {} {}", x[n], expected[n]);
        }
        // Without a closed form: Gauss-Legendre with 5 nodes over the interval.
        let nodes = [0.0, 0.538_469_310_105_683_1, 0.906_179_845_938_664];
        let weights = [0.568_888_888_888_888_9, 0.478_628_670_499_366_47, 0.236_926_885_056_189_08];
        let f = |s: f64| (a * s + b).sqrt() / (s + b);
        let mut sum = weights[0] * f(dt / 2.0);
        for i in 1..3 {
            sum += weights[i] * (f(dt / 2.0 * (1.0 + nodes[i])) + f(dt / 2.0 * (1.0 - nodes[i])));
        }
        // The rule's error is of order (dt/2)^11.
        assert!(close(x[7], 0.5 + sum * dt / 2.0, 1e-14), "{} at {dt}", x[7]);
    }
    // e^t/2 itself: 1/(2 k!).
    let mut factorial = 1.0;
    for k in 1..N {
        factorial *= k as f64;
        let c = jets.coefficients()[0][k];
        assert!(close(c * factorial * 2.0, 1.0, 1e-14), "{k}: {c}");
    }
}

/// Over one step every disk agrees with its own equation, on both sides of the friction's kink: the polynomial's
/// slope is the rates.
#[test]
fn polynomials_solve_the_equations() {
    const N: usize = 25;
    for (family, p) in disks() {
        let tape = Tape::record(&family, &[]).unwrap();
        let system = family.build(&p);
        let mut jets = Jets::<f64, 4, N>::new(&tape, Isa::best());
        for x0 in [[1.0, 0.01, 0.03, 0.4], [-4.0, 0.01, 0.03, 0.4]] {
            let sides = sides_of(&system, 0.3, &x0);
            jets.expand(&tape, &p, 0.3, &x0, &sides);
            // The poles of tanh(Omega/eps) are near for the smoothed dry friction.
            let h = 1e-3;
            for dt in [0.0, 0.5 * h, h] {
                let x = jets.at(dt);
                let rates = system.rates(0.3 + dt, &x, &sides);
                for (n, (series, rate)) in jets.coefficients().iter().zip(rates).enumerate() {
                    let slope: f64 = (1..N).rev().map(|k| k as f64 * series[k] * dt.powi(k as i32 - 1)).sum();
                    let allowed = 1e-12 * (1.0 + rate.abs());
                    assert!(close(slope, rate, allowed), "{:?} {n}: {slope} {rate}", family.effects);
                }
            }
        }
    }
}

/// Steps of the radius, up to `end`, in every lane.
#[inline(never)]
fn run<S: Scalar, const D: usize, const N: usize>(
    tape: &Tape<D>,
    system: &impl System<S, D>,
    (p, mut x, end): (&[S], [S; D], f64),
    (rtol, isa): (f64, Isa),
) -> [S; D] {
    let mut jets = Jets::<S, D, N>::new(tape, isa);
    let (mut t, end) = (S::Real::constant(0.0), S::Real::constant(end));
    while t.less(end).any() {
        let sides = sides_of(system, S::lift(t), &x);
        jets.expand(tape, p, S::lift(t), &x, &sides);
        let norm = Tolerance::new(rtol, rtol * 1e-3);
        let h = jets.radius(jets.order(), &norm, &norm.weights(&x)).min(end - t);
        x = jets.at(h);
        t += h;
    }
    x
}

fn dle(w: f64, b: f64, x0: [f64; 3], end: f64, rtol: f64) -> [f64; 3] {
    let tape = Tape::record(&DleFamily, &[]).unwrap();
    let p = [w, b];
    run::<f64, 3, 21>(&tape, &DleFamily.build(&p), (&p, x0, end), (rtol, Isa::best()))
}

/// Digits on which independent integrators agree.
#[test]
fn known_states() {
    let cases = [
        (7.1, 0.0, [1.0, 1.0, 0.01], 10.0, [2.73182986436, -3.08519098040, -3.12651694271]),
        (1.0, 0.0, [1.0, 1.0, 0.01], 10.0, [0.97664030875, 0.98317480213, 0.04343309237]),
        (1.0, 0.0, [1.0, 1.0, 0.01], 30.0, [0.32011311025, -0.38840279112, -0.23230343728]),
        (3.7, 0.2, [3.7f64.sqrt(), 3.7f64.sqrt(), -3.2], 10.0, [0.76514351119, 1.60344735353, 3.21882737548]),
    ];
    for (w, b, x0, end, expected) in cases {
        let x = dle(w, b, x0, end, 1e-12);
        for n in 0..3 {
            // Half of the last digit, and chaos over t = 30.
            assert!(close(x[n], expected[n], 3e-11), "w = {w}: {x:?} {expected:?}");
        }
    }
}

/// The error of a step is of order N in its size.
#[test]
fn order_of_convergence() {
    const N: usize = 9;
    let tape = Tape::record(&DleFamily, &[]).unwrap();
    let p = [7.1, 0.1];
    let exact = |h| {
        let mut jets = Jets::<f64, 3, 25>::new(&tape, Isa::best());
        jets.expand(&tape, &p, 0.0, &[1.0, 1.0, 0.01], &[true; MAX_SURFACES]);
        jets.at(h)
    };
    let mut jets = Jets::<f64, 3, N>::new(&tape, Isa::best());
    jets.expand(&tape, &p, 0.0, &[1.0, 1.0, 0.01], &[true; MAX_SURFACES]);
    let error = |h: f64| {
        let (x, y) = (jets.at(h), exact(h));
        (0..3).map(|n| (x[n] - y[n]).abs()).fold(0.0, f64::max)
    };
    let order = (error(0.1) / error(0.05)).log2();
    assert!((order - N as f64).abs() < 0.3, "order {order}");
}

/// Derivatives of a run with respect to the start, against differences of runs.
#[test]
fn tangents() {
    type T = Dual<f64, 3>;
    let tape = Tape::record(&DleFamily, &[None, Some(0.0)]).unwrap();
    let p = [7.1, 0.0].map(T::fixed);
    let x0 = [1.0, 1.0, 0.01];
    let state = from_fn(|n| T::variable(x0[n], n));
    let x = run::<T, 3, 21>(&tape, &DleFamily.build(&p), (&p, state, 3.0), (1e-12, Isa::best()));
    let h = 1e-5;
    for i in 0..3 {
        let moved = |by: f64| {
            let mut x0 = x0;
            x0[i] += by;
            dle(7.1, 0.0, x0, 3.0, 1e-12)
        };
        let (up, down) = (moved(h), moved(-h));
        for n in 0..3 {
            let difference = (up[n] - down[n]) / (2.0 * h);
            // Runs are accurate to 1e-11, differences to h^2 times a third derivative of about 10.
            assert!(close(x[n].d[i], difference, 1e-5), "{n} {i}: {} {difference}", x[n].d[i]);
        }
    }
}

/// Test that runs once for each instruction set.
struct Bits<'a, F, const D: usize> {
    family: &'a F,
    tape: &'a Tape<D>,
    p: &'a [f64],
    x0: [f64; D],
    end: f64,
}

impl<F: Family<D>, const D: usize> Bits<'_, F, D> {
    /// The lanes start at slightly different states.
    fn lane(&self, l: usize) -> [f64; D] {
        self.x0.map(|x| x * (1.0 + 0.01 * l as f64))
    }

    fn one(&self, l: usize, isa: Isa) -> [u64; D] {
        let system = self.family.build(self.p);
        run::<f64, D, 21>(self.tape, &system, (self.p, self.lane(l), self.end), (1e-9, isa)).map(f64::to_bits)
    }

    fn many<const L: usize, V: InstructionSet>(&self, isa: Isa) -> Vec<[u64; D]> {
        let p: Vec<Packet<L, V>> = self.p.iter().map(|&v| Packet::constant(v)).collect();
        let x0 = from_fn(|n| Packet::from_lanes(|l| self.lane(l)[n]));
        let system = self.family.build(&p);
        let x = run::<Packet<L, V>, D, 21>(self.tape, &system, (&p, x0, self.end), (1e-9, isa));
        (0..L).map(|l| x.map(|v| v.lane(l).to_bits())).collect()
    }

    /// The second lane as one of a packet of tangents.
    fn tangents<V: InstructionSet>(&self, isa: Isa) -> [u64; D] {
        type T<V> = Dual<Packet<LANES, V>, 1>;
        let p: Vec<T<V>> = self.p.iter().map(|&v| Dual::constant(v)).collect();
        let x0 = from_fn(|n| Dual::variable(Packet::from_lanes(|l| self.lane(l)[n]), 0));
        let system = self.family.build(&p);
        let x = run::<T<V>, D, 21>(self.tape, &system, (&p, x0, self.end), (1e-9, isa));
        x.map(|v| v.re.lane(1).to_bits())
    }
}

struct On<'a, F, const D: usize>(&'a Bits<'a, F, D>, Isa);

impl<F: Family<D>, const D: usize> Work for On<'_, F, D> {
    type Output = (Vec<[u64; D]>, [u64; D], [u64; D]);
    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Self::Output {
        (self.0.many::<LANES, V>(self.1), self.0.tangents::<V>(self.1), self.0.one(1, self.1))
    }
}

/// Each instruction set gives a single trajectory the same bits.
fn same_bits_alone<F: Family<D>, const D: usize>(bits: &Bits<'_, F, D>) {
    for isa in Isa::available() {
        assert_eq!(bits.one(1, isa), bits.one(1, Isa::Baseline), "{isa:?}");
    }
}

fn same_bits<F: Family<D>, const D: usize>(bits: &Bits<'_, F, D>) {
    let alone: Vec<[u64; D]> = (0..8).map(|l| bits.one(l, Isa::Baseline)).collect();
    assert_eq!(bits.many::<2, Plain>(Isa::best()), alone[..2]);
    for isa in Isa::available() {
        let (many, tangents, one) = isa.run(On(bits, isa));
        assert_eq!(many, alone[..many.len()], "{isa:?}");
        assert_eq!((tangents, one), (alone[1], alone[1]), "{isa:?}");
    }
}

#[test]
fn same_bits_for_every_width_and_instruction_set() {
    let tape = Tape::record(&DleFamily, &[None, Some(0.0)]).unwrap();
    same_bits(&Bits { family: &DleFamily, tape: &tape, p: &[3.9, 0.0], x0: [1.0, 1.0, 0.01], end: 50.0 });
    let tape = Tape::record(&DleFamily, &[]).unwrap();
    same_bits(&Bits { family: &DleFamily, tape: &tape, p: &[3.7, 0.2], x0: [1.0, 1.0, 0.01], end: 50.0 });
    // Disks are run one by one.
    for (family, p) in disks() {
        let tape = Tape::record(&family, &[]).unwrap();
        same_bits_alone(&Bits { family: &family, tape: &tape, p: &p, x0: [3.0, 0.01, 0.03, 0.4], end: 0.2 });
    }
}

/// Tangents side by side in lanes, where the machine has them, are those computed one by one.
#[test]
fn tangents_in_lanes_have_the_same_bits() {
    in_lanes::<2>();
    in_lanes::<3>();
    in_lanes::<4>();
}

fn in_lanes<const N: usize>() {
    let tape = Tape::record(&DleFamily, &[None, Some(0.0)]).unwrap();
    let p = [Dual::variable(1.3, N - 1), Dual::constant(0.0)];
    let system = DleFamily.build(&p);
    let x0 = from_fn(|n| Dual { re: [1.0, 1.0, 0.01][n], d: from_fn(|i| if i == n { 1.0 } else { 0.0 }) });
    let ends = Isa::available().into_iter().map(|isa| {
        let x = run::<Dual<f64, N>, 3, { HIGH + 1 }>(&tape, &system, (&p, x0, 5.0), (1e-9, isa));
        x.map(|v| (v.re.to_bits(), v.d.map(f64::to_bits)))
    });
    let ends: Vec<_> = ends.collect();
    assert!(ends.iter().all(|end| *end == ends[0]), "{N} derivatives");
}

/// A single disk's sums are computed in one register where there is one; those of packets and tangents are not.
#[test]
fn a_disks_written_series_has_the_same_bits() {
    const N: usize = HIGH + 1;
    type T = Dual<f64, 2>;
    let family = DiskFamily { effects: vec![], edge: false };
    let tape = Tape::record(&family, &[]).unwrap();
    let x0 = [3.0, 0.01, 0.03, 0.4];
    for isa in Isa::available() {
        let system = family.build(&PLAIN);
        let alone = run::<f64, 4, N>(&tape, &system, (&PLAIN, x0, 2.0), (1e-9, isa));
        let p = PLAIN.map(T::constant);
        let tangents = run::<T, 4, N>(&tape, &family.build(&p), (&p, x0.map(T::constant), 2.0), (1e-9, isa));
        let p = PLAIN.map(Packet::<2>::constant);
        let packet = run::<Packet<2>, 4, N>(
            &tape,
            &family.build(&p),
            (&p, x0.map(Packet::constant), 2.0),
            (1e-9, isa),
        );
        assert_eq!(tangents.map(|x| x.re.to_bits()), alone.map(f64::to_bits), "{isa:?}");
        assert_eq!(packet.map(|x| x.lane(1).to_bits()), alone.map(f64::to_bits), "{isa:?}");
    }
}

/// Terms that are skipped where they vanish change no bit, and do not change which series is written out: a run's bits
/// do not depend on the other runs of its packet.
#[test]
fn what_vanishes_changes_no_bit() {
    const N: usize = HIGH + 1;
    let open = Tape::record(&DleFamily, &[]).unwrap();
    for (w, fixed) in [(7.1, [None, Some(0.0)]), (0.0, [Some(0.0), None]), (0.0, [Some(0.0), Some(0.0)])] {
        let p = [w, 0.0];
        let tape = Tape::record(&DleFamily, &fixed).unwrap();
        assert!(tape.is_unrolled());
        let [some, all] = [&tape, &open].map(|tape| {
            run::<f64, 3, N>(tape, &DleFamily.build(&p), (&p, [1.0, 1.0, 0.01], 20.0), (1e-9, Isa::best()))
        });
        assert_eq!(some.map(f64::to_bits), all.map(f64::to_bits), "w = {w}, {fixed:?}");
    }
}

/// A law with a comparison of its own.
#[derive(Clone, Copy, PartialEq)]
struct Compares;
impl<S: Scalar> System<S, 1> for Compares {
    fn rates(&self, _t: S, x: &[S; 1], _sides: &Sides<S>) -> [S; 1] {
        [S::select(x[0].less(S::one()), x[0], S::one())]
    }
}
impl Family<1> for Compares {
    type Built<S: Scalar> = Compares;
    fn parameters(&self) -> Vec<Parameter> {
        vec![]
    }
    fn build<S: Scalar>(&self, _values: &[S]) -> Compares {
        Compares
    }
}

#[test]
fn a_law_with_comparisons_is_refused() {
    let error = Tape::record(&Compares, &[]).unwrap_err();
    assert!(error.to_string().contains("comparison"));
}

/// Expressions of the state, the time and two parameters, without poles near the start: products, quotients and
/// functions, and many linear operations in a row.
fn expression() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        4 => prop::sample::select(vec!["x", "y", "z"]).prop_map(str::to_owned),
        2 => prop::sample::select(vec!["t", "k", "c", "2", "(-0.5)", "1.5"]).prop_map(str::to_owned),
    ];
    leaf.prop_recursive(5, 24, 2, |inner| {
        let pair = (inner.clone(), inner.clone());
        let binary = (prop::sample::select(vec!["+", "-", "+", "-", "*", "*"]), pair);
        prop_oneof![
            8 => binary.prop_map(|(op, (a, b))| format!("({a}{op}{b})")),
            1 => inner.clone().prop_map(|a| format!("(-{a})")),
            1 => inner.clone().prop_map(|a| format!("({a})^2")),
            1 => (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("({a}/(3+({b})^2))")),
            1 => (prop::sample::select(vec!["sin", "cos", "tanh"]), inner).prop_map(|(f, a)| format!("{f}({a})")),
        ]
    })
}

/// The bits of all coefficients; one for all that are no numbers.
fn coefficients<S: Scalar>(
    tape: &Tape<3>,
    isa: Isa,
    x: impl Fn(usize) -> S,
    parts: impl Fn(S) -> Vec<f64>,
) -> Vec<u64> {
    const N: usize = HIGH + 1;
    let mut jets = Jets::<S, 3, N>::new(tape, isa);
    let sides = from_fn(|_| S::mask(true));
    jets.expand(tape, &[x(3), x(4)], S::constant(0.7), &from_fn(x), &sides);
    let bits = |value: f64| if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() };
    jets.coefficients().iter().flatten().flat_map(|&c| parts(c)).map(bits).collect()
}

/// The same of packets, by their own instructions.
struct PacketBits<'a>(&'a Tape<3>, Isa, &'a [f64; 5]);

impl Work for PacketBits<'_> {
    type Output = Vec<u64>;
    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Vec<u64> {
        let Self(tape, isa, x) = self;
        let lane = |n: usize| Packet::<LANES, V>::from_lanes(|l| x[n] * (1.0 + 0.1 * l as f64));
        coefficients(tape, isa, lane, |c| (0..LANES).map(|l| c.lane(l)).collect())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Steps that are interpreted as one have the bits of those interpreted one by one, over every kind of number.
    #[test]
    fn fused_steps_change_no_bit(
        texts in [expression(), expression(), expression()],
        x in prop::array::uniform5(prop_oneof![Just(0.0), -1.5..1.5f64]),
    ) {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        let family = FormulaFamily::<3>::parse(&names(&["x", "y", "z"]), &texts, &names(&["k", "c"]), &[]).unwrap();
        let tape = Tape::record(&family, &[]).unwrap();
        prop_assume!(!tape.is_unrolled());
        let apart = tape.unfused();
        for isa in Isa::available() {
            let alone = |tape| coefficients::<f64>(tape, isa, |n| x[n], |c| vec![c]);
            prop_assert_eq!(alone(&tape), alone(&apart));
            let tangents = |tape| {
                let one = |n: usize| Dual::<f64, 3>::variable(x[n], n % 3);
                coefficients(tape, isa, one, |c| vec![c.re, c.d[0], c.d[1], c.d[2]])
            };
            prop_assert_eq!(tangents(&tape), tangents(&apart));
            prop_assert_eq!(isa.run(PacketBits(&tape, isa, &x)), isa.run(PacketBits(&apart, isa, &x)));
        }
    }
}

/// Where a coefficient is not finite the radius says so.
#[test]
fn a_radius_that_is_no_number() {
    let tape = Tape::record(&DleFamily, &[]).unwrap();
    let mut jets = Jets::<f64, 3, 21>::new(&tape, Isa::best());
    let norm = Tolerance::new(1e-9, 1e-12);
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        let x = [bad, 1.0, 1.0];
        jets.expand(&tape, &[1.0, 0.0], 0.0, &x, &[true; MAX_SURFACES]);
        assert!(jets.radius(jets.order(), &norm, &norm.weights(&x)).is_nan(), "{bad}");
    }
    // At rest every step is good.
    let x = [1.0, 1.0, 0.0];
    jets.expand(&tape, &[1.0, 0.0], 0.0, &x, &[true; MAX_SURFACES]);
    assert!(jets.radius(jets.order(), &norm, &norm.weights(&x)) > 1e6);
}
