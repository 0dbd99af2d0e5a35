//! A Rosenbrock method, for stiff laws.

use nalgebra::{DMatrix, DVector};

use super::method::{Method, QUARTERS, Trial};
use crate::model::{StepStart, System};
use crate::scalar::{WIDTH, Wide, vector};
use crate::tolerance::ErrorNorm;

const STAGES: usize = 8;
const GAMMA: f64 = 0.21193756319429014;

/// Weights of the stages before in a stage's argument; the last row's and the last stage itself make the new
/// state.
const A: [[f64; STAGES - 1]; STAGES] = [
    [0.0; 7],
    [3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [2.849394379747939, 0.45842242204463923, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-6.954028509809101, 2.489845061869568, -10.358996098473584, 0.0, 0.0, 0.0, 0.0],
    [2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641, 0.0, 0.0, 0.0],
    [
        -7.502846399306121,
        2.561846144803919,
        -11.627539656261098,
        -0.18268767659942256,
        0.030198172008377946,
        0.0,
        0.0,
    ],
    [
        -7.502846399306121,
        2.561846144803919,
        -11.627539656261098,
        -0.18268767659942256,
        0.030198172008377946,
        1.0,
        0.0,
    ],
    [
        -7.502846399306121,
        2.561846144803919,
        -11.627539656261098,
        -0.18268767659942256,
        0.030198172008377946,
        1.0,
        1.0,
    ],
];

/// The same on the right-hand side, over the step's size.
const C: [[f64; STAGES - 1]; STAGES] = [
    [0.0; 7],
    [-14.155112264123755, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-17.97296035885952, -2.859693295451294, 0.0, 0.0, 0.0, 0.0, 0.0],
    [147.12150275711716, -1.41221402718213, 71.68940251302358, 0.0, 0.0, 0.0, 0.0],
    [165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306, 0.0, 0.0, 0.0],
    [
        24.854864614690072,
        -3.0009227002832186,
        47.4931110020768,
        5.5814197821558125,
        -0.6610691825249471,
        0.0,
        0.0,
    ],
    [
        30.91273214028599,
        -3.1208243349937974,
        77.79954646070892,
        34.28646028294783,
        -19.097331116725623,
        -28.087943162872662,
        0.0,
    ],
    [
        37.80277123390563,
        -3.2571969029072276,
        112.26918849496327,
        66.9347231244047,
        -40.06618937091002,
        -54.66780262877968,
        -9.48861652309627,
    ],
];

/// The stages' times, and the weights of the rates' derivative by time.
const TIMES: [f64; STAGES] =
    [0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1.0, 1.0, 1.0];
const SLOPES: [f64; STAGES] =
    [GAMMA, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734, 2.325825639765069, 0.0, 0.0, 0.0];

/// The stages' weights in the polynomial's inner coefficients.
const INNER: [[f64; STAGES]; 3] = [
    [
        25.948786856663858,
        -2.5579724845846235,
        10.433815404888879,
        -2.3679251022685204,
        0.524948541321073,
        1.1241088310450404,
        0.4272876194431874,
        -0.17202221070155493,
    ],
    [
        -9.91568850695171,
        -0.9689944594115154,
        3.0438037242978453,
        -24.495224566215796,
        20.176138334709044,
        15.98066361424651,
        -6.789040303419874,
        -6.710236069923372,
    ],
    [
        11.419903575922262,
        2.8879645146136994,
        72.92137995996029,
        80.12511834622643,
        -52.072871366152654,
        -59.78993625266729,
        -0.15582684282751913,
        4.883087185713722,
    ],
];

/// The rates' derivatives by the state, `[n][k]` that of rate `n` by component `k`, and by time.
type Slopes<const D: usize> = ([[f64; D]; D], [f64; D]);
/// The same at any time and state.
type SlopesAt<'a, const D: usize> = dyn Fn(&StepStart<f64, D>) -> Slopes<D> + 'a;

/// Rodas5P: G. Steinebach, BIT Numer. Math. 63 (2023) 27. Order 5 with an embedded order 4, stiffly accurate, each
/// stage a linear system with the same matrix; the continuous extension has order 4.
///
/// The derivatives of the law are exact, from dual numbers.
pub struct Rodas<'a, const D: usize> {
    /// The derivatives at any time and state. The type of the law is erased, as in all code that is compiled for this
    /// method.
    slopes_at: Box<SlopesAt<'a, D>>,
    /// The place of the derivatives that are known, and their values.
    known: Option<StepStart<f64, D>>,
    slopes: Slopes<D>,
    /// The last trial: its size, and its polynomial's coefficients over the part of it.
    h: f64,
    powers: [[f64; D]; 5],
}

impl<'a, const D: usize> Rodas<'a, D> {
    /// For this law, over numbers with derivatives.
    pub fn new(system: impl System<Wide, D> + 'a) -> Self {
        let none = ([[0.0; D]; D], [0.0; D]);
        let slopes_at = Box::new(move |at: &StepStart<f64, D>| {
            let (mut by_state, mut by_time) = none;
            // By the components of the state, then by time.
            for first in (0..=D).step_by(WIDTH) {
                let x = vector!(Wide, D; n => Wide::along(at.x[n], n, first));
                let rates = system.rates(Wide::along(at.t, D, first), &x, &at.sides);
                for n in 0..D {
                    for k in first..(D + 1).min(first + WIDTH) {
                        let slope = if k < D { &mut by_state[n][k] } else { &mut by_time[n] };
                        *slope = rates[n].d[k - first];
                    }
                }
            }
            (by_state, by_time)
        });
        Self { slopes_at, known: None, slopes: none, h: 0.0, powers: [[0.0; D]; 5] }
    }

    /// Finds the derivatives where a step starts, unless they are known from one that failed.
    fn differentiate(&mut self, at: &StepStart<f64, D>) {
        let same = |known: &StepStart<f64, D>| (known.t, known.x, known.sides) == (at.t, at.x, at.sides);
        if self.known.as_ref().is_some_and(same) {
            return;
        }
        self.slopes = (self.slopes_at)(at);
        self.known = Some(*at);
    }
}

impl<const D: usize> Method<f64, D> for Rodas<'_, D> {
    const ORDER: i32 = 5;
    const EVALUATIONS: usize = STAGES;
    const SERIES: bool = false;
    const PROBES: &'static [f64] = QUARTERS;

    fn begin(&mut self, _system: &impl System<f64, D>, _at: &StepStart<f64, D>, _lanes: bool) {}

    fn attempt(
        &mut self,
        system: &impl System<f64, D>,
        at: &StepStart<f64, D>,
        h: f64,
        norm: &impl ErrorNorm<f64, D>,
    ) -> Trial<f64, D> {
        self.h = h;
        self.powers = [[0.0; D]; 5];
        self.powers[0] = at.x;
        // A step of less than 1e-307, as the end of a run may leave, changes no state by more than a tolerance.
        if (GAMMA * h).recip().is_infinite() {
            return Trial { x: at.x, size: h, error: 0.0 };
        }
        self.differentiate(at);
        let (by_state, by_time) = &self.slopes;
        let matrix = DMatrix::from_fn(D, D, |n, k| f64::from(n == k) / (GAMMA * h) - by_state[n][k]).lu();
        let mut stages = [[0.0; D]; STAGES];
        let mut x = at.x;
        for i in 0..STAGES {
            x = at.x;
            let mut before = [0.0; D];
            for j in 0..i {
                for n in 0..D {
                    x[n] += A[i][j] * stages[j][n];
                    before[n] += C[i][j] * stages[j][n];
                }
            }
            let rates = system.rates(at.t + TIMES[i] * h, &x, &at.sides);
            let right = |n: usize| rates[n] + h * SLOPES[i] * by_time[n] + before[n] / h;
            match matrix.solve(&DVector::from_fn(D, |n, _| right(n))) {
                Some(found) => stages[i].copy_from_slice(found.as_slice()),
                None => return Trial { x: at.x, size: h, error: f64::NAN },
            }
        }
        let last = stages[STAGES - 1];
        x = vector!(f64, D; n => x[n] + last[n]);
        // (1 - s) x0 + s (x1 + (1 - s) (k1 + s (k2 + s k3))) in powers of s.
        for n in 0..D {
            let k =
                INNER.map(|weights| weights.iter().zip(&stages).map(|(w, stage)| w * stage[n]).sum::<f64>());
            self.powers[1][n] = x[n] - at.x[n] + k[0];
            self.powers[2][n] = k[1] - k[0];
            self.powers[3][n] = k[2] - k[1];
            self.powers[4][n] = -k[2];
        }
        Trial { x, size: h, error: norm.of_step(&last, &at.x, &x) }
    }

    fn extend(&mut self, _system: &impl System<f64, D>, _at: &StepStart<f64, D>) {}

    fn begin_next(&mut self, _lanes: bool) {}

    fn at(&self, dt: f64) -> [f64; D] {
        let part = if self.h == 0.0 { 0.0 } else { dt / self.h };
        vector!(f64, D; n => self.powers.iter().rev().fold(0.0, |sum, power| sum * part + power[n]))
    }

    fn polynomial(&self, coefficients: &mut Vec<[f64; D]>) -> f64 {
        coefficients.extend_from_slice(&self.powers);
        self.h
    }
}
