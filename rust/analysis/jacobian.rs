//! The law's own derivatives at a state.

use crate::model::{Family, System, sides_of};
use crate::scalar::{Dual, Scalar, WIDTH, Wide, constants, vector};

/// The rates at a state and their first derivatives.
#[derive(Clone, Debug)]
pub struct Linearisation<const D: usize> {
    pub rate: [f64; D],
    /// `by_state[n][k]` is the derivative of rate `n` by component `k`.
    pub by_state: [[f64; D]; D],
    /// `by_parameter[p][n]` is the derivative of rate `n` by parameter `p`.
    pub by_parameter: Vec<[f64; D]>,
    /// The functions of the switching surfaces.
    pub surfaces: Vec<f64>,
}

/// The rates and their first derivatives, on the side of every switching surface that the state lies on.
pub fn linear<F: Family<D>, const D: usize>(
    family: &F,
    values: &[f64],
    t: f64,
    x: &[f64; D],
) -> Linearisation<D> {
    let (mut rate, mut by_state, mut by_parameter) = ([0.0; D], [[0.0; D]; D], vec![[0.0; D]; values.len()]);
    // By the components of the state, then by the parameters.
    let directions = D + values.len();
    for first in (0..directions).step_by(WIDTH) {
        let mut varied = Vec::with_capacity(values.len());
        for (p, &value) in values.iter().enumerate() {
            varied.push(Wide::along(value, D + p, first));
        }
        let rates = at(&family.build(&varied), t, &vector!(Wide, D; n => Wide::along(x[n], n, first)));
        for n in 0..D {
            rate[n] = rates[n].re;
            for k in first..directions.min(first + WIDTH) {
                let slope = if k < D { &mut by_state[n][k] } else { &mut by_parameter[k - D][n] };
                *slope = rates[n].d[k - first];
            }
        }
    }
    let system = family.build(values);
    let sides = sides_of(&system, t, x);
    let mut surfaces = Vec::with_capacity(system.surfaces());
    for j in 0..system.surfaces() {
        surfaces.push(system.surface(j, t, x, &sides));
    }
    Linearisation { rate, by_state, by_parameter, surfaces }
}

/// The second and third derivatives, `[n][i][j]` and `[n][i][j][k]` flat.
pub fn higher<F: Family<D>, const D: usize>(
    family: &F,
    values: &[f64],
    t: f64,
    x: &[f64; D],
) -> (Vec<f64>, Vec<f64>) {
    type Third = Dual<Dual<Dual<f64, 1>, 1>, 1>;
    let fixed: Vec<Third> = constants(values);
    let system = family.build(&fixed);
    let mut second = vec![0.0; D * D * D];
    let mut third = vec![0.0; D * D * D * D];
    // One number along three directions holds their mixed derivative.
    for i in 0..D {
        for j in i..D {
            for k in j..D {
                let along = |n: usize, m: usize| if n == m { 1.0 } else { 0.0 };
                let start = vector!(Third, D; n => {
                    let inner = Dual { re: x[n], d: [along(n, i)] };
                    let middle = Dual { re: inner, d: [Dual::constant(along(n, j))] };
                    Dual { re: middle, d: [Dual::constant(along(n, k))] }
                });
                let rates = at(&system, t, &start);
                for (n, rate) in rates.iter().enumerate() {
                    let mixed = rate.d[0].d[0].d[0];
                    for [a, b, c] in [[i, j, k], [i, k, j], [j, i, k], [j, k, i], [k, i, j], [k, j, i]] {
                        third[((n * D + a) * D + b) * D + c] = mixed;
                    }
                    for (a, b, value) in
                        [(i, j, rate.re.d[0].d[0]), (i, k, rate.d[0].re.d[0]), (j, k, rate.d[0].d[0].re)]
                    {
                        second[(n * D + a) * D + b] = value;
                        second[(n * D + b) * D + a] = value;
                    }
                }
            }
        }
    }
    (second, third)
}

fn at<S: Scalar, const D: usize>(system: &impl System<S, D>, t: f64, x: &[S; D]) -> [S; D] {
    let time = S::constant(t);
    system.rates(time, x, &sides_of(system, time, x))
}
