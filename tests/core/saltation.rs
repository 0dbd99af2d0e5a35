//! Tangents through jumps of the law: saltation matrices against closed forms and differences of runs.

use std::array::from_fn;
use std::f64::consts::PI;

use approx::assert_relative_eq;
use udd::integrate::{Ending, Failure, Integrator, Tolerance, pass, propagate};
use udd::model::effects::{Effect, FrictionModel, Kind};
use udd::model::{Disk, DiskFamily, Family, MAX_SURFACES, PendulumFamily, Sides, System, choose, sides_of};
use udd::scalar::{Dual, Mask, Scalar};

const TIGHT: Tolerance = Tolerance::new(1e-12, 1e-14);

/// A block on a belt that moves at speed `v`, held by a spring: `x'' = -x + k` sliding, carried along while
/// `x < s`. Friction at rest is larger than in motion, so that it goes on for ever.
#[derive(Clone, Copy)]
struct Belt<S> {
    v: S,
    s: S,
    k: S,
}

impl<S: Scalar> System<S, 2> for Belt<S> {
    fn rates(&self, _t: S, x: &[S; 2], sides: &Sides<S>) -> [S; 2] {
        let (slides, sticks) = ([x[1], self.k - x[0]], [self.v, S::zero()]);
        from_fn(|n| S::select(sides[0], slides[n], sticks[n]))
    }
    fn surfaces(&self) -> usize {
        1
    }
    fn surface(&self, _j: usize, _t: S, x: &[S; 2], sides: &Sides<S>) -> S {
        S::select(sides[0], self.v - x[1], x[0] - self.s)
    }
    fn switch(&self, _j: usize, _t: S, x: &mut [S; 2], sides: &mut Sides<S>, here: S::Mask) {
        x[1] = S::select(here.and(sides[0]), self.v, x[1]);
        sides[0] = choose(here, sides[0].not(), sides[0]);
    }
    fn jumps(&self, _j: usize) -> bool {
        true
    }
}

/// The period: it is carried from `2 k - s` to `s`, then it swings back.
fn period<S: Scalar>(belt: &Belt<S>, angle: impl Fn(S) -> S) -> S {
    let jump = belt.s - belt.k;
    jump.scale(2.0) / belt.v + S::constant(2.0 * PI) - angle(jump / belt.v).scale(2.0)
}

/// `arctan` with its derivative.
fn arctan<const N: usize>(x: Dual<f64, N>) -> Dual<f64, N> {
    Dual { re: x.re.atan(), d: x.d.map(|d| d / (1.0 + x.re * x.re)) }
}

#[test]
fn stick_slip_on_a_belt_has_its_period() {
    let belt = Belt { v: 0.3, s: 1.0, k: 0.4 };
    let mut driver: Integrator<_, f64, 2> = Integrator::new(&belt, 0.0, [0.0, 0.0], None, &TIGHT);
    let mut times = Vec::new();
    while times.len() < 12 {
        if driver.advance(200.0).unwrap() != Ending::Free {
            times.push(driver.t());
        }
    }
    for (i, pair) in times.windows(3).enumerate().skip(2) {
        // Two switches a period; 1e-12 per step.
        assert_relative_eq!(pair[2] - pair[0], period(&belt, f64::atan), max_relative = 1e-11);
        let carried = i % 2 == 0;
        let stuck = 2.0 * (belt.s - belt.k) / belt.v;
        let wanted = if carried { stuck } else { period(&belt, f64::atan) - stuck };
        assert_relative_eq!(pair[1] - pair[0], wanted, max_relative = 1e-11);
    }
}

/// Once it has stuck nothing is left of a perturbation but a shift in time: the monodromy matrix has
/// determinant 0 (one exponent is minus infinity) and keeps the flow's own direction.
#[test]
fn sticking_leaves_one_direction() {
    type N = Dual<f64, 2>;
    let belt = Belt { v: 0.3, s: 1.0, k: 0.4 };
    let dual = Belt { v: N::fixed(belt.v), s: N::fixed(belt.s), k: N::fixed(belt.k) };
    let x0 = [0.1, -0.4];
    let start = from_fn(|n| N::variable(x0[n], n));
    let mut driver: Integrator<_, f64, 2> = Integrator::new(&belt, 0.0, x0, None, &TIGHT);
    while driver.advance(10.0).unwrap() == Ending::Free {}
    let sticks = driver.t();
    let cut = |t: f64| propagate(&dual, 0.0, t, start, &TIGHT).unwrap();
    let det = |x: [N; 2]| x[0].d[0] * x[1].d[1] - x[0].d[1] * x[1].d[0];
    let (before, after) = (cut(sticks - 0.1), cut(sticks + 0.1));
    // The oscillation keeps areas.
    assert_relative_eq!(det(before), 1.0, max_relative = 1e-10);
    assert_eq!((after[1].re, after[1].d), (0.3, [0.0; 2]));
    assert_eq!(det(after), 0.0);
    assert!(after[0].d[0].hypot(after[0].d[1]) > 0.1);

    // Over a period of the motion that it comes to.
    let whole = cut(3.0 + period(&belt, f64::atan));
    let whole = propagate(
        &dual,
        0.0,
        period(&belt, f64::atan),
        from_fn(|n| N { re: whole[n].re, d: from_fn(|i| f64::from(n == i)) }),
        &TIGHT,
    )
    .unwrap();
    assert!(det(whole).abs() < 1e-10, "{whole:?}");
    let flow = belt.rates(0.0, &whole.map(|v| v.re), &sides_of(&belt, 0.0, &whole.map(|v| v.re)));
    for n in 0..2 {
        let moved = whole[n].d[0] * flow[0] + whole[n].d[1] * flow[1];
        assert_relative_eq!(moved, flow[n], max_relative = 1e-9, epsilon = 1e-10);
    }
}

/// The time after many switches depends on the parameters as the closed form of the period does.
#[test]
fn the_phase_depends_on_parameters_as_the_period_does() {
    type N = Dual<f64, 3>;
    let belt = Belt { v: N::variable(0.3, 0), s: N::variable(1.0, 1), k: N::variable(0.4, 2) };
    let one = period(&belt, arctan);
    // Carried from release to release and a bit beyond: x = s + v t there, but for the spring.
    let start = [belt.s, belt.v];
    let end = propagate(&belt, 0.0, 5.0 * one.re + 0.2, start, &TIGHT).unwrap();
    // At 0.2 after the release, x = k + (s - k) cos t + v sin t, x' its derivative; the release comes
    // later by the change of five periods.
    let jump = belt.s - belt.k;
    let t = N::constant(5.0 * one.re + 0.2) - one.scale(5.0);
    let exact = [belt.k + jump * t.cos() + belt.v * t.sin(), belt.v * t.cos() - jump * t.sin()];
    for n in 0..2 {
        assert_relative_eq!(end[n].re, exact[n].re, max_relative = 1e-10);
        for i in 0..3 {
            assert_relative_eq!(end[n].d[i], exact[n].d[i], max_relative = 1e-8);
        }
    }
}

/// Two laws, one on each side of the surface `x + y/2 = t/4`, whose rates differ.
struct Kinked;

impl<S: Scalar> System<S, 2> for Kinked {
    fn rates(&self, _t: S, x: &[S; 2], sides: &Sides<S>) -> [S; 2] {
        let (right, left) =
            ([S::one() + x[1], -x[0] - S::constant(0.5)], [S::one(), S::constant(0.3) - x[1]]);
        from_fn(|n| S::select(sides[0], right[n], left[n]))
    }
    fn surfaces(&self) -> usize {
        1
    }
    fn surface(&self, _j: usize, t: S, x: &[S; 2], _sides: &Sides<S>) -> S {
        x[0] + x[1].scale(0.5) - t.scale(0.25)
    }
    fn jumps(&self, _j: usize) -> bool {
        true
    }
}

#[test]
fn the_saltation_matrix_is_the_book_s() {
    type N = Dual<f64, 2>;
    let (t, at) = (0.4, [-0.2, 0.6]);
    let all = [true; MAX_SURFACES];
    let real: Sides<f64> = from_fn(|j| j > 0);
    let (before, after) = (Kinked.rates(t, &at, &real), Kinked.rates(t, &at, &all));
    let normal = [1.0, 0.5];
    let dot = |f: [f64; 2]| normal[0] * f[0] + normal[1] * f[1] - 0.25;

    let mut x = from_fn(|n| N::variable(at[n], n));
    let mut sides = real;
    let grazes = pass(&Kinked, 0, t, 0.1, &mut x, &mut sides, true);
    assert!(sides[0] && !grazes && x.map(|v| v.re) == at);
    let matrix: [[f64; 2]; 2] = x.map(|v| v.d);
    for n in 0..2 {
        for i in 0..2 {
            let one = f64::from(n == i);
            let exact = one + (after[n] - before[n]) * normal[i] / dot(before);
            // Rounding of a difference over 1e-6.
            assert_relative_eq!(matrix[n][i], exact, max_relative = 1e-9, epsilon = 1e-9);
        }
    }
    let det = matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0];
    assert_relative_eq!(det, dot(after) / dot(before), max_relative = 1e-9);
}

/// Whole runs over jumps that are passed, against differences of runs.
#[test]
fn tangents_of_runs_agree_with_differences() {
    type N = Dual<f64, 2>;
    // The surface is passed once, from left to right.
    let x0 = [-1.0, 0.2];
    let end = 1.6;
    let run = |x0| propagate(&Kinked, 0.0, end, x0, &TIGHT).unwrap();
    let exact = propagate(&Kinked, 0.0, end, from_fn(|n| N::variable(x0[n], n)), &TIGHT).unwrap();
    let mut driver: Integrator<_, f64, 2> = Integrator::new(&Kinked, 0.0, x0, None, &TIGHT);
    let mut passed = 0;
    while driver.t() < end {
        passed += usize::from(driver.advance(end).unwrap() != Ending::Free);
    }
    assert_eq!(passed, 1);
    differ(run, x0, exact);

    // Dry friction: four reversals, on to a point between them.
    let effects = vec![
        Effect::new(Kind::CableTorque),
        Effect::new(Kind::Coulomb).with_treatment(FrictionModel::SetValued),
    ];
    let family = PendulumFamily { effects };
    let values = [1.0, 1.0, 0.0, 0.02, 1.0, 0.0, 0.1, 0.05];
    let plain = family.build(&values);
    let dual = family.build(&values.map(N::fixed));
    let x0 = [0.3, 1.5];
    let run = |x0| propagate(&plain, 0.0, 13.5, x0, &TIGHT).unwrap();
    let exact = propagate(&dual, 0.0, 13.5, from_fn(|n| N::variable(x0[n], n)), &TIGHT).unwrap();
    differ(run, x0, exact);
}

fn differ(run: impl Fn([f64; 2]) -> [f64; 2], x0: [f64; 2], exact: [Dual<f64, 2>; 2]) {
    for i in 0..2 {
        let shifted = |by: f64| run(from_fn(|n| x0[n] + by * f64::from(n == i)));
        let h = 1e-5;
        let (up, down) = (shifted(h), shifted(-h));
        for n in 0..2 {
            // Runs are accurate to 1e-11, and h^2 times a third derivative of order 1.
            assert_relative_eq!(
                exact[n].d[i],
                (up[n] - down[n]) / (2.0 * h),
                max_relative = 1e-6,
                epsilon = 1e-5
            );
        }
    }
}

/// A way down to a surface at which the law jumps, arriving there at this speed at time 1.
struct Slowing(f64);

impl<S: Scalar> System<S, 2> for Slowing {
    fn rates(&self, t: S, _x: &[S; 2], sides: &Sides<S>) -> [S; 2] {
        let down = -(t - S::one()).square() - S::constant(self.0);
        [down, S::select(sides[0], S::one(), S::constant(2.0))]
    }
    fn surfaces(&self) -> usize {
        1
    }
    fn surface(&self, _j: usize, _t: S, x: &[S; 2], _sides: &Sides<S>) -> S {
        x[0]
    }
    fn jumps(&self, _j: usize) -> bool {
        true
    }
}

#[test]
fn grazing_is_flagged() {
    type N = Dual<f64, 1>;
    for (speed, flagged) in [(0.3, 0), (1e-2, 0), (1e-4, 0), (1e-7, 1), (0.0, 1)] {
        let x0 = [N::variable(1.0 / 3.0 + speed, 0), N::fixed(0.0)];
        let mut driver: Integrator<_, N, 2> = Integrator::new(Slowing(speed), 0.0, x0, Some(0.3), &TIGHT);
        while driver.t() < 2.0 {
            driver.advance(2.0).unwrap();
        }
        assert_eq!(driver.counts().grazes, flagged, "speed {speed}");
        if flagged == 0 {
            // One above another meets the surface 1/speed later, and y grows by 1 instead of 2 till then.
            assert_relative_eq!(driver.x()[1].d[0], -1.0 / speed, max_relative = 1e-3);
        } else {
            assert_eq!(driver.x()[1].d[0], 0.0);
        }
    }
}

/// A disk on tilted wheels with dry friction, which sticks now and then and moves chaotically in between.
/// Without `corrected` tangents pass the jumps of the law as if there were none.
struct Sticky<S> {
    disk: Disk<S>,
    corrected: bool,
}

impl<S: Scalar> Sticky<S> {
    fn new(corrected: bool) -> Self {
        let effects = vec![
            Effect::new(Kind::Coulomb).with_treatment(FrictionModel::SetValued),
            Effect::new(Kind::Tilt),
        ];
        let values = [0.03, 0.08, 9.81, 0.012, 0.103, 0.055, 0.02, 0.05, 0.3].map(S::constant);
        Self { disk: DiskFamily { effects, edge: false }.build(&values), corrected }
    }
}

impl<S: Scalar> System<S, 4> for Sticky<S> {
    fn rates(&self, t: S, x: &[S; 4], sides: &Sides<S>) -> [S; 4] {
        self.disk.rates(t, x, sides)
    }
    fn surfaces(&self) -> usize {
        self.disk.surfaces()
    }
    fn surface(&self, j: usize, t: S, x: &[S; 4], sides: &Sides<S>) -> S {
        self.disk.surface(j, t, x, sides)
    }
    fn settle(&self, t: S, x: &[S; 4], sides: &mut Sides<S>) {
        self.disk.settle(t, x, sides);
    }
    fn switch(&self, j: usize, t: S, x: &mut [S; 4], sides: &mut Sides<S>, here: S::Mask) {
        self.disk.switch(j, t, x, sides, here);
    }
    fn jumps(&self, j: usize) -> bool {
        self.corrected && self.disk.jumps(j)
    }
}

/// The mean growth rate of a tangent along one orbit is that of a neighbouring orbit's distance.
#[test]
fn exponents_through_stick_and_slip_are_those_of_neighbours() {
    type N = Dual<f64, 1>;
    let (start, piece, pieces) = ([3.0, 0.005, 0.0, 0.0], 0.25, 1200);
    let growth = |corrected: bool| {
        let (system, wide) = (Sticky::<f64>::new(true), Sticky::<N>::new(corrected));
        let (mut x, mut tangent) = (start, [0.5; 4]);
        let mut shadow: [f64; 4] = from_fn(|n| x[n] + 1e-8 * tangent[n]);
        let (mut by_tangent, mut by_shadow, mut stuck) = (0.0, 0.0, 0);
        for i in 0..pieces {
            let (t, end) = (piece * f64::from(i), piece * f64::from(i + 1));
            let dual =
                propagate(&wide, t, end, from_fn(|n| N { re: x[n], d: [tangent[n]] }), &TIGHT).unwrap();
            shadow = propagate(&system, t, end, shadow, &TIGHT).unwrap();
            x = propagate(&system, t, end, x, &TIGHT).unwrap();
            // Lengths in which the components count alike; the orientation does not act back.
            let length = |d: [f64; 4]| (d[0].powi(2) + (1e2 * d[1]).powi(2) + (1e2 * d[2]).powi(2)).sqrt();
            let (grown, apart) = (length(dual.map(|v| v.d[0])), length(from_fn(|n| shadow[n] - x[n])));
            tangent = dual.map(|v| v.d[0] / grown);
            by_tangent += grown.ln();
            by_shadow += (apart / 1e-8).ln();
            shadow = from_fn(|n| x[n] + (shadow[n] - x[n]) * 1e-8 / apart);
            stuck += usize::from(x[0] == 0.0);
        }
        let time = piece * f64::from(pieces);
        (by_tangent / time, by_shadow / time, stuck)
    };
    let (tangent, shadow, stuck) = growth(true);
    assert!(stuck > 20 && tangent > 0.2, "{tangent}, stuck {stuck} times");
    // The shadow feels the second order, 1e-8 of the first but for near grazes.
    assert_relative_eq!(tangent, shadow, max_relative = 2e-4);
    assert!((growth(false).0 - shadow).abs() > 1e-3 * shadow);
}

/// A law that pushes back from either side of a surface, and knows no way to stay on it.
struct Restless;

impl<S: Scalar> System<S, 2> for Restless {
    fn rates(&self, _t: S, _x: &[S; 2], sides: &Sides<S>) -> [S; 2] {
        [S::select(sides[0], -S::one(), S::one()), S::one()]
    }
    fn surfaces(&self) -> usize {
        1
    }
    fn surface(&self, _j: usize, _t: S, x: &[S; 2], _sides: &Sides<S>) -> S {
        x[0]
    }
    fn jumps(&self, _j: usize) -> bool {
        true
    }
}

#[test]
fn a_law_that_switches_without_end_fails_and_does_not_hang() {
    let end = propagate(&Restless, 0.0, 10.0, [0.7, 0.0], &Tolerance::default());
    let Err(Failure::Chattering { t }) = end else { panic!("{end:?}") };
    assert!((t - 0.7).abs() < 1e-6);
}
