//! The estimator against dense linear algebra, finite differences and a simulated truth.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use proptest::prelude::*;
use udd::analysis::CancelFlag;
use udd::estimate::{
    Bordered, CachedLinearisation, Candidate, DiskCamera, Estimator, FilmParameters, FormulaSensor,
    FreeParameter, Moment, Options, Record, Role, RowMatrix, Sensor, Unknowns,
};
use udd::integrate::{Tolerance, propagate};
use udd::model::effects::{Effect, Kind, Momentum};
use udd::model::{DiskFamily, Family, FormulaFamily, System, sides_of};

const PAPER: [f64; 6] = [0.039, 0.08, 9.81, 0.012, 0.103, 0.055];

/// Reproducible noise, normal to the precision needed here: twelve uniform numbers summed.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

fn family(effects: &[(Kind, Option<Momentum>)]) -> DiskFamily {
    let effects = effects.iter().map(|&(kind, momentum)| Effect::new(kind).with_momentum(momentum)).collect();
    DiskFamily { effects, edge: false }
}

type Problem = Estimator<DiskFamily, DiskCamera, 4, 3>;

/// A camera's record of `n` frames of a run, with its true states.
fn film(family: &DiskFamily, values: &[f64], n: usize, seed: u64) -> (Record<3>, Vec<[f64; 4]>) {
    let tolerance = Tolerance::new(1e-10, 1e-12);
    let disk = family.build(values);
    let mut noise = Noise(seed);
    let mut x = [1.0, 0.01, -0.02, 0.3];
    let (mut t, mut states, mut seen) = (0.0, Vec::new(), Vec::new());
    for i in 0..n {
        if i > 0 {
            x = propagate(&disk, t, t + 0.04, x, &tolerance).unwrap();
            t += 0.04;
        }
        states.push(x);
        seen.push(SVector::from([
            x[1] + 5e-4 * noise.normal(),
            x[2] + 5e-4 * noise.normal(),
            x[3] + 0.01 * noise.normal(),
        ]));
    }
    let information = SMatrix::from_diagonal(&SVector::from([4e6, 4e6, 1e4]));
    let times = (0..n).map(|i| 0.04 * i as f64).collect();
    let record = Record {
        t: times,
        seen,
        information: vec![information; n],
        linked: vec![true; n - 1],
        film: vec![0; n],
        memory: [0.0; 3],
    };
    (record, states)
}

fn problem(family: DiskFamily, record: Record<3>, free: Vec<FreeParameter>) -> Problem {
    let diffusion = [3e-3, 1e-5, 1e-5, 1e-4].map(|q: f64| q / 0.04f64.sqrt());
    let tolerance = Tolerance::new(1e-8, 1e-10);
    Estimator { family, sensor: DiskCamera, record, free, diffusion, tolerance, known: None }
}

fn free(role: Role, mean: f64, sd: f64) -> FreeParameter {
    FreeParameter::unlimited(role, mean, sd)
}

/// One film's point.
fn point(states: Vec<[f64; 4]>, model: Vec<f64>) -> Unknowns<4> {
    Unknowns {
        states,
        sets: vec![FilmParameters { model, camera: vec![0.0; DiskCamera::PARAMETERS.len()], clock: 0.0 }],
    }
}

/// Residuals at a point: misfits of the frames, and defects of the links.
fn residuals(estimator: &Problem, point: &Unknowns<4>) -> (Vec<SVector<f64, 3>>, Vec<SVector<f64, 4>>) {
    let linear = estimator.linearise(point).unwrap();
    (linear.misfits(), linear.defects())
}

#[test]
fn elimination_equals_a_dense_solve() {
    let mut noise = Noise(7);
    let (n, p) = (6, 3);
    let size = 2 * n + p;
    // A random positive definite matrix with the right pattern: J^T J of a chain of residuals.
    let mut j = DMatrix::<f64>::zeros(6 * n, size);
    let mut rhs = DVector::<f64>::zeros(size);
    for i in 0..n {
        for row in 6 * i..6 * i + 6 {
            let columns = (2 * i..(2 * i + 4).min(2 * n)).chain(2 * n..size);
            columns.for_each(|c| j[(row, c)] = noise.normal());
        }
    }
    rhs.iter_mut().for_each(|b| *b = noise.normal());
    let full = j.transpose() * &j;
    let mut border = RowMatrix::zeros(2 * n, p + 1);
    let mut corner = RowMatrix::zeros(p + 1, p + 1);
    for i in 0..2 * n {
        (0..p).for_each(|j| border.row_mut(i)[j] = full[(i, 2 * n + j)]);
        border.row_mut(i)[p] = rhs[i];
    }
    for i in 0..p {
        (i..p).for_each(|j| corner.row_mut(i)[j] = full[(2 * n + i, 2 * n + j)]);
        corner.row_mut(i)[p] = rhs[2 * n + i];
    }
    let system = Bordered::<2> {
        diagonal: (0..n).map(|i| full.fixed_view::<2, 2>(2 * i, 2 * i).into_owned()).collect(),
        below: (0..n - 1).map(|i| full.fixed_view::<2, 2>(2 * i + 2, 2 * i).into_owned()).collect(),
        border,
        corner,
    };
    let t: Vec<f64> = (0..n).map(|i| i as f64).collect();
    let reduced = system.eliminate(&t).unwrap();
    let parameters = reduced.schur.clone().lu().solve(&reduced.gradient).unwrap();
    let states = reduced.states(&parameters);
    let expected = full.clone().lu().solve(&rhs).unwrap();
    for (i, state) in states.iter().enumerate() {
        let wanted = expected.fixed_rows::<2>(2 * i).into_owned();
        approx::assert_relative_eq!(*state, wanted, max_relative = 1e-9);
    }
    approx::assert_relative_eq!(parameters, expected.rows(2 * n, p).into_owned(), max_relative = 1e-9);

    let inverse = full.try_inverse().unwrap();
    let covariance = reduced.schur.clone().try_inverse().unwrap();
    for (i, own) in reduced.uncertain(&covariance).covariance().iter().enumerate() {
        let expected = inverse.fixed_view::<2, 2>(2 * i, 2 * i).into_owned();
        approx::assert_relative_eq!(*own, expected, max_relative = 1e-8);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Every derivative that the equations use, against central differences.
    #[test]
    fn derivatives_equal_finite_differences(
        // Beyond the kink of the friction at 1.65 rad/s, where derivatives jump.
        omega in 4.0f64..8.0, y in -0.03f64..0.03, z in -0.05f64..0.05, beta in -3.0f64..3.0,
        y0 in -2e-3f64..2e-3, tilt in -0.05f64..0.05, lag in -5e-3f64..5e-3, row in -0.03f64..0.03,
    ) {
        // A law that knows the time, a while after its start.
        let family = family(&[(Kind::Relaxation, Some(Momentum::Consistent)), (Kind::DriveRipple, None)]);
        let values = [PAPER.as_slice(), &[4.0, 0.3, -0.2, 1.7]].concat();
        let (mut record, _) = film(&family, &values, 2, 3);
        record.t.iter_mut().for_each(|t| *t += 30.0);
        let mut roles: Vec<Role> = (0..values.len()).map(Role::Model).collect();
        roles.extend((0..DiskCamera::PARAMETERS.len()).map(Role::Camera));
        roles.push(Role::Clock);
        let mut estimator = problem(family, record, Vec::new());
        // Tight, so that the differences see the flow and not the integrator.
        estimator.tolerance = Tolerance::new(1e-13, 1e-14);
        let states = vec![[omega, y, z, beta], [omega, y, z, beta]];
        let camera = vec![y0, 1e-3, tilt, 5e-3, 1e-3, -5e-4, lag, row, 1e-5, 0.01, 0.02, -0.01];
        let point = Unknowns { states, sets: vec![FilmParameters { model: values, camera, clock: 1e-3 }] };
        estimator.free = roles.iter().map(|&role| free(role, 0.0, f64::INFINITY)).collect();
        let linear = estimator.linearise(&point).unwrap();

        let step = |scale: f64| 1e-5 * scale.abs().max(1e-2);
        for (j, free) in estimator.free.iter().enumerate() {
            let h = step(point.get(free));
            let (mut up, mut down) = (point.clone(), point.clone());
            up.shift(free, h);
            down.shift(free, -h);
            let (e_up, r_up) = residuals(&estimator, &up);
            let (e_down, r_down) = residuals(&estimator, &down);
            // The residuals fall where h and Phi rise.
            let g = (e_down[0] - e_up[0]) / (2.0 * h);
            let b = (r_down[0] - r_up[0]) / (2.0 * h);
            let role = free.role;
            for k in 0..4 {
                // Gauss' rule at three places of a link and the dense output there are good to this.
                let scale = b.norm().max(1e-3);
                prop_assert!((linear.columns.state.at(k, j) - b[k]).abs() < 1e-4 * scale, "b {role:?} {k}");
            }
            for m in 0..3 {
                let found = linear.columns.seen.at(m, j);
                prop_assert!((found - g[m]).abs() < 1e-5 * g.norm().max(1e-3), "g {role:?} {m}");
            }
        }
        for k in 0..4 {
            let h = step(point.states[0][k]);
            let (mut up, mut down) = (point.clone(), point.clone());
            up.states[0][k] += h;
            down.states[0][k] -= h;
            let (e_up, r_up) = residuals(&estimator, &up);
            let (e_down, r_down) = residuals(&estimator, &down);
            let a = (r_down[0] - r_up[0]) / (2.0 * h);
            let by_state = linear.flow[0].a();
            let column = by_state.column(k);
            prop_assert!((column - a).norm() < 1e-5 * a.norm().max(1.0), "a {k}");
            let seen = (e_down[0] - e_up[0]) / (2.0 * h);
            prop_assert!((linear.sights[0].h.column(k) - seen).norm() < 1e-5, "h {k}");
        }
    }
}

/// The camera's error in a delay is of third order in time, that in an exposure's mean of fourth.
#[test]
fn a_camera_follows_paths_to_the_second_order() {
    let disk = family(&[]).build(&PAPER);
    let tolerance = Tolerance::new(1e-13, 1e-15);
    let from_frame = |t: f64| propagate(&disk, 0.0, 0.02 + t, [7.0, 0.02, 0.03, 0.5], &tolerance).unwrap();
    let x = from_frame(0.0);
    let rate = disk.rates(0.02, &x, &sides_of(&disk, 0.02, &x));
    let look = |name: &str, value: f64| {
        let own = |&(own, _): &(&str, _)| if own == name { value } else { 0.0 };
        let camera: Vec<f64> = DiskCamera::PARAMETERS.iter().map(own).collect();
        SVector::from(
            DiskCamera.observe(&camera, &Moment { t: 0.02, x: &x, rate: &rate, parameters: &PAPER }),
        )
    };
    let seen = |state: [f64; 4]| SVector::from([state[1], state[2], state[3]]);
    // By Gauss' rule at three places, exact to the fifth order.
    let mean = |e: f64| {
        let aside = e / 2.0 * 0.6f64.sqrt();
        let sides = seen(from_frame(-aside)) + seen(from_frame(aside));
        (sides * 5.0 + seen(x) * 8.0) / 18.0
    };
    let late = |h: f64| (look("row", -h / x[2]) - seen(from_frame(h))).norm();
    let lagging = |h: f64| (look("lag", -h)[2] - from_frame(h)[3]).abs();
    let blurred = |e: f64| (look("shutter", e * e / 24.0) - mean(e)).norm();
    for (left, order) in
        [(late(4e-3) / late(2e-3), 3), (lagging(4e-3) / lagging(2e-3), 3), (blurred(0.01) / blurred(5e-3), 4)]
    {
        approx::assert_relative_eq!(left.log2(), f64::from(order), epsilon = 0.2);
    }
}

/// Twenty seconds of a chaotic run, parameters a quarter off: the fit finds them within its errors.
#[test]
fn a_chaotic_record_gives_its_parameters_back() {
    let truth = [PAPER.as_slice(), &[5.0]].concat();
    let family = family(&[(Kind::Relaxation, Some(Momentum::Constraint))]);
    let (record, _) = film(&family, &truth, 500, 11);
    let roles = [0, 3, 4, 5, 6];
    let free = roles.iter().map(|&j| free(Role::Model(j), truth[j], f64::INFINITY)).collect();
    let mut estimator = problem(family, record, free);
    let states = (0..500)
        .map(|i| {
            let seen = &estimator.record.seen;
            let (a, b) = (i.max(1) - 1, (i + 1).min(499));
            [(seen[b][2] - seen[a][2]) / (0.04 * (b - a) as f64), seen[i][0], seen[i][1], seen[i][2]]
        })
        .collect();
    let mut model = truth.clone();
    roles.iter().for_each(|&j| model[j] *= 0.75);
    let mut point = point(states, model);
    let mut last = None;
    for level in [[0.1, 1e-4, 1e-4, 1e-3], [0.02, 3e-5, 3e-5, 3e-4], [3e-3, 1e-5, 1e-5, 1e-4]] {
        estimator.diffusion = level.map(|q: f64| q / 0.04f64.sqrt());
        let solution = estimator.solve(point, &Options::default(), &CancelFlag::new()).unwrap();
        assert!(solution.converged, "{level:?} took {} steps", solution.iterations);
        point = solution.point.clone();
        last = Some(solution);
    }
    let solution = last.unwrap();
    for (k, &j) in roles.iter().enumerate() {
        let se = solution.covariance[(k, k)].sqrt();
        let z = (solution.point.sets[0].model[j] - truth[j]) / se;
        println!("{j}: {:.5} +- {se:.5}, truth {:.5}", solution.point.sets[0].model[j], truth[j]);
        assert!(z.abs() < 4.0, "parameter {j} is {z:.1} standard errors off");
    }
    // The assumed model error is larger than the true one (none), so the cost stays below its expectation of
    // 1500 - 5 - 4 but is dominated by the 1500 misfits, whose sum scatters by sqrt(2 * 1500) = 55.
    let cost = solution.cost.total();
    assert!((1500.0 - 6.0 * 55.0..1500.0 + 4.0 * 55.0).contains(&cost), "{:?}", solution.cost);
}

/// The score's estimate of an absent effect agrees with a fit that has it.
#[test]
fn the_score_foretells_the_fit() {
    let with = family(&[(Kind::Relaxation, Some(Momentum::Constraint))]);
    let weak = [PAPER.as_slice(), &[0.3]].concat();
    let (record, states) = film(&with, &weak, 250, 5);
    let free: Vec<FreeParameter> =
        [0, 3].iter().map(|&j| free(Role::Model(j), PAPER[j], f64::INFINITY)).collect();
    let stop = CancelFlag::new();
    let plain = problem(family(&[]), record.clone(), free.clone());
    let start = point(states, PAPER.to_vec());
    let fitted = plain.solve(start, &Options::default(), &stop).unwrap();
    let mut values = fitted.point.sets[0].model.clone();
    values.push(0.0);
    let candidate = Candidate { family: with.clone(), more: vec![0.0], amplitudes: vec![Role::Model(6)] };
    let score = plain.score(&fitted.point, &[candidate]).unwrap();
    let estimate = score.gradient[0] / score.information[(0, 0)];
    let drop = score.gradient[0].powi(2) / score.information[(0, 0)];

    let mut more = free;
    more.push(self::free(Role::Model(6), 0.0, f64::INFINITY));
    let full = problem(with, record, more);
    let start = point(fitted.point.states.clone(), values);
    let refitted = full.solve(start, &Options::default(), &stop).unwrap();
    // Equal up to the curvature of the model over so small an effect.
    let b = refitted.point.sets[0].model[6];
    assert!((estimate - b).abs() < 0.1 * b.abs().max(score.information[(0, 0)].powf(-0.5)), "{estimate} {b}");
    let gained = fitted.cost.total() - refitted.cost.total();
    assert!((drop - gained).abs() < 0.1 * gained.max(1.0), "{drop} {gained}");
}

/// A minimum outside a parameter's range is approached, and not reached.
#[test]
fn a_parameter_stays_within_its_range() {
    let family = family(&[(Kind::Relaxation, Some(Momentum::Constraint))]);
    let (record, states) = film(&family, &[PAPER.as_slice(), &[0.3]].concat(), 250, 5);
    let limited = FreeParameter { range: (0.5, 2.0), ..free(Role::Model(6), 1.0, f64::INFINITY) };
    let start = point(states, [PAPER.as_slice(), &[1.0]].concat());
    let solution =
        problem(family, record, vec![limited]).solve(start, &Options::default(), &CancelFlag::new()).unwrap();
    let b = solution.point.sets[0].model[6];
    assert!((0.5..0.7).contains(&b), "{b}");
}

/// The next solve reuses a linearisation at its start, and only there.
#[test]
fn a_known_linearisation_is_not_made_again() {
    let (record, states) = film(&family(&[]), &PAPER, 100, 6);
    let free: Vec<FreeParameter> =
        [0, 3].iter().map(|&j| free(Role::Model(j), PAPER[j], f64::INFINITY)).collect();
    let mut estimator = problem(family(&[]), record, free);
    let solve = |estimator: &Estimator<_, _, 4, 3>, from: &Unknowns<4>| {
        estimator.solve(from.clone(), &Options::default(), &CancelFlag::new()).unwrap()
    };
    let end = solve(&estimator, &point(states, PAPER.to_vec()));
    estimator.known =
        Some(CachedLinearisation { point: Arc::new(end.point.clone()), linear: end.linear.clone() });
    let again = solve(&estimator, &end.point);
    assert!(Arc::ptr_eq(&again.linear, &end.linear));
    assert_eq!(again.covariance, end.covariance);

    let mut elsewhere = end.point.clone();
    elsewhere.sets[0].model[0] *= 1.001;
    let other = solve(&estimator, &elsewhere);
    estimator.known = None;
    assert_eq!(other.point, solve(&estimator, &elsewhere).point);
}

/// The names `x0, x1, ...`
fn names(prefix: &str, count: usize) -> Vec<String> {
    (0..count).map(|i| format!("{prefix}{i}")).collect()
}

/// An estimate of a family of three states and one parameter, all filled up to `D`, seen as they are.
fn filled_up<const D: usize>(
    family: &FormulaFamily<3>,
    film: &[[f64; 3]],
    parameters: usize,
) -> (Estimator<FormulaFamily<D>, FormulaSensor<D>, D, D>, Unknowns<D>) {
    let up = |x: &[f64; 3]| std::array::from_fn(|k| x.get(k).copied().unwrap_or(0.0));
    let seen = SVector::from_fn(|k, _| if k < 2 { 25.0 } else { 0.0 });
    let mut record = Record::<D> {
        t: (0..film.len()).map(|i| 0.02 * i as f64).collect(),
        seen: film.iter().map(|x| SVector::from(up(x))).collect(),
        information: vec![SMatrix::from_diagonal(&seen); film.len()],
        linked: vec![true; film.len() - 1],
        film: vec![0; film.len()],
        memory: [0.0; D],
    };
    // A new run begins in the middle; one frame is not seen; noise remembers itself.
    record.linked[40] = false;
    record.information[20] = SMatrix::zeros();
    record.memory[0] = 0.3;
    let free = |p| free(Role::Model(p), 0.0, f64::INFINITY);
    let family = family.filled::<D>();
    let estimator = Estimator {
        sensor: FormulaSensor::of(&family),
        family,
        record,
        free: (0..parameters).map(free).collect(),
        diffusion: [0.1; D],
        tolerance: Tolerance::new(1e-7, 1e-9),
        known: None,
    };
    let model = [10.0, 28.0, 8.0 / 3.0, 1.0, 1.0, 1.0, 0.0][..parameters].to_vec();
    let states = film.iter().map(up).collect();
    (estimator, Unknowns { states, sets: vec![FilmParameters { model, camera: Vec::new(), clock: 0.0 }] })
}

/// Results that padding states must not change: cost, evidence, parameters and states with covariances, predictions,
/// innovations, and the score of a further term.
fn estimate<const D: usize>(film: &[[f64; 3]]) -> Vec<f64> {
    let equations = ["p0*(x1 - p3*x0)", "x0*(p1 - p4*x2) - p5*x1 + p6", "x0*x1 - p2*x2"];
    let family = FormulaFamily::<3>::parse(&names("x", 3), &equations, &names("p", 7), &[]).unwrap();
    let (estimator, start) = filled_up::<D>(&family, film, 7);
    let stop = CancelFlag::new();
    let found = estimator.solve(start, &Options::default(), &stop).unwrap();
    assert!(found.converged);
    let mut all = vec![found.cost.total(), found.evidence, found.iterations as f64];
    all.extend(&found.point.sets[0].model);
    all.extend(found.covariance.iter());
    for (x, covariance) in found.point.states.iter().zip(&found.state_covariance) {
        all.extend(&x[..3]);
        all.extend(covariance.fixed_view::<3, 3>(0, 0).iter());
        assert!(x[3..].iter().all(|&idle| idle == 0.0));
    }
    for own in estimator.innovations(&found.point, &[10.0; D]).unwrap() {
        all.extend(own[..3].iter().filter(|v| v.is_finite()));
    }
    let starts = [(0, 0.0, found.point.states[0])];
    all.extend(&estimator.predict(&found.point.sets, &starts, &[vec![0.1, 0.5]]).unwrap()[0][1][..3]);
    for end in estimator.filter(&found.point, &[(0, 15)], &Options::default(), &stop).unwrap() {
        all.extend(&end.last[..3]);
        all.extend(end.covariance.fixed_view::<3, 3>(0, 0).iter());
    }
    let wider = ["p0*(x1 - p3*x0) + p7*x2", "x0*(p1 - p4*x2) - p5*x1 + p6", "x0*x1 - p2*x2 + p8*x1^2"];
    let wider = FormulaFamily::<3>::parse(&names("x", 3), &wider, &names("p", 9), &[]).unwrap();
    let candidate = Candidate {
        family: wider.filled::<D>(),
        more: vec![0.0; 2],
        amplitudes: vec![Role::Model(7), Role::Model(8)],
    };
    let score = estimator.score(&found.point, &[candidate]).unwrap();
    all.extend(score.gradient.iter().chain(score.information.iter()).chain(score.alone.iter()));
    all
}

#[test]
fn idle_states_change_nothing() {
    let equations = ["10*(x1 - x0)", "x0*(28 - x2) - x1", "x0*x1 - 8/3*x2"];
    let family = FormulaFamily::<3>::parse(&names("x", 3), &equations, &[], &[]).unwrap();
    let (system, tolerance) = (family.build::<f64>(&[]), Tolerance::new(1e-10, 1e-12));
    let (mut noise, mut x, mut film) = (Noise(11), [-5.0, -6.0, 22.0], Vec::new());
    for _ in 0..90 {
        film.push(std::array::from_fn(|k| x[k] + 0.2 * noise.normal()));
        x = propagate(&system, 0.0, 0.02, x, &tolerance).unwrap();
    }
    let wanted = estimate::<3>(&film);
    for found in [estimate::<6>(&film), estimate::<8>(&film), estimate::<12>(&film)] {
        assert_eq!(found.len(), wanted.len());
        for (i, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
            // Cost and evidence to rounding, which in the rest grows to 1e-7 of the smallest numbers: the third state is not
            // seen, and seven parameters are free.
            let accuracy = if i < 2 { 1e-11 } else { 1e-6 };
            approx::assert_relative_eq!(found, wanted, max_relative = accuracy, epsilon = 1e-9);
        }
    }
}

/// The derivatives of what twelve states become by all states and by fourteen parameters, which takes four turns of eight
/// directions, against finite differences.
#[test]
fn derivatives_of_many_states_equal_finite_differences() {
    const D: usize = 12;
    let equation = |i: usize| {
        let (next, before, last) = ((i + 1) % D, (i + D - 1) % D, (i + D - 2) % D);
        format!("p{i}*(x{next} - x{last})*x{before} - p12*x{i} + p13*cos(x{i})")
    };
    let equations: Vec<String> = (0..D).map(equation).collect();
    let texts: Vec<&str> = equations.iter().map(String::as_str).collect();
    let family = FormulaFamily::<D>::parse(&names("x", D), &texts, &names("p", 14), &[]).unwrap();
    let free = |p| free(Role::Model(p), 0.0, f64::INFINITY);
    let record = Record::<D> {
        t: vec![0.0, 0.1],
        seen: vec![SVector::zeros(); 2],
        information: vec![SMatrix::identity(); 2],
        linked: vec![true],
        film: vec![0; 2],
        memory: [0.0; D],
    };
    let estimator = Estimator {
        sensor: FormulaSensor::of(&family),
        family,
        record,
        free: (0..14).map(free).collect(),
        diffusion: [1.0; D],
        tolerance: Tolerance::new(1e-12, 1e-12),
        known: None,
    };
    let model: Vec<f64> = (0..14).map(|p| 1.0 + 0.1 * p as f64).collect();
    let x: [f64; D] = std::array::from_fn(|k| (1.3 * k as f64).sin() + 0.5);
    let at = |x: [f64; D], model: Vec<f64>| Unknowns {
        states: vec![x, [0.0; D]],
        sets: vec![FilmParameters { model, camera: Vec::new(), clock: 0.0 }],
    };
    let linear = estimator.linearise(&at(x, model.clone())).unwrap();
    let (a, h) = (linear.flow[0].a(), 1e-5);
    let ends = |moved: [&Unknowns<D>; 2]| {
        let [above, below] = moved.map(|point| estimator.linearise(point).unwrap().defects()[0]);
        (below - above) / (2.0 * h)
    };
    for k in 0..D {
        let moved = [h, -h].map(|h| {
            let mut x = x;
            x[k] += h;
            at(x, model.clone())
        });
        // Differences are good to h^2 and to 1e-12/h.
        approx::assert_relative_eq!(a.column(k).into_owned(), ends([&moved[0], &moved[1]]), epsilon = 1e-6);
    }
    for p in 0..14 {
        let moved = [h, -h].map(|h| {
            let mut model = model.clone();
            model[p] += h;
            at(x, model)
        });
        let wanted = ends([&moved[0], &moved[1]]);
        for n in 0..D {
            approx::assert_relative_eq!(linear.columns.state.at(n, p), wanted[n], epsilon = 1e-6);
        }
    }
    for m in 0..D {
        assert_eq!(linear.sights[0].h.row(m), SMatrix::<f64, D, D>::identity().row(m));
    }
    // A forcing's response: of a small one, constant over the link, the sum over its places.
    let places = &estimator.places(&at(x, model.clone())).unwrap()[0].places;
    let total = places.iter().fold(SMatrix::<f64, D, D>::zeros(), |sum, place| sum + place.response);
    // By the mean over the link of the flow from there: (1 + a)/2 to the second order in its length.
    let rough = (SMatrix::<f64, D, D>::identity() + a) * 0.05;
    assert!((total - rough).abs().max() < 0.01 && total.abs().max() > 0.09);
}
