//! Runge-Kutta methods as data.

/// An explicit embedded Runge-Kutta pair with a continuous extension.
///
/// Stage `i` is `k_i = f(t + c_i h, x + h Σ_j a_ij k_j)`. The first `stages` of them make a step: the new
/// state is the argument of the last of these, so that its rate is the first of the next step. The
/// rest serves the extension alone.
#[derive(Clone, Copy, Debug)]
pub struct Tableau<const N: usize, const P: usize> {
    /// Order of the solution that is carried on.
    pub order: i32,
    /// How many stages a step takes.
    pub stages: usize,
    /// The real stability interval's length.
    pub stable: f64,
    /// The stages' times.
    pub c: [f64; N],
    /// The stages' weights.
    pub a: [[f64; N]; N],
    /// The solution's weights minus those of the embedded one: the error estimate is `h Σ e_i k_i`.
    pub e: [f64; N],
    /// The same for a second embedded solution, of lower order, which keeps the first from being too sure.
    pub e_low: Option<[f64; N]>,
    /// The continuous extension: `x(t + θ h) = x + h Σ_i k_i Σ_j p_ij θ^(j+1)`.
    pub p: [[f64; P]; N],
}

/// A method whose numbers are known when the program is compiled.
pub trait Scheme<const N: usize, const P: usize>: Copy + Send + Sync + 'static {
    const TABLEAU: Tableau<N, P>;
}

/// Dormand & Prince, J. Comput. Appl. Math. 6 (1980) 19: order 5 with an embedded order 4; the
/// continuous extension of order 4 is Shampine's, Math. Comp. 46 (1986) 135.
#[derive(Clone, Copy, Debug)]
pub struct DormandPrince;

impl Scheme<7, 4> for DormandPrince {
    const TABLEAU: Tableau<7, 4> = Tableau {
        order: 5,
        stable: 3.3,
        stages: 7,
        c: [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0],
        a: [
            [0.0; 7],
            [0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0, 0.0],
            [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0, 0.0],
            [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0, 0.0],
            [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0],
        ],
        e: [
            71.0 / 57600.0,
            0.0,
            -71.0 / 16695.0,
            71.0 / 1920.0,
            -17253.0 / 339200.0,
            22.0 / 525.0,
            -1.0 / 40.0,
        ],
        e_low: None,
        p: [
            [1.0, -8048581381.0 / 2820520608.0, 8663915743.0 / 2820520608.0, -12715105075.0 / 11282082432.0],
            [0.0; 4],
            [
                0.0,
                131558114200.0 / 32700410799.0,
                -68118460800.0 / 10900136933.0,
                87487479700.0 / 32700410799.0,
            ],
            [0.0, -1754552775.0 / 470086768.0, 14199869525.0 / 1410260304.0, -10690763975.0 / 1880347072.0],
            [
                0.0,
                127303824393.0 / 49829197408.0,
                -318862633887.0 / 49829197408.0,
                701980252875.0 / 199316789632.0,
            ],
            [0.0, -282668133.0 / 205662961.0, 2019193451.0 / 616988883.0, -1453857185.0 / 822651844.0],
            [0.0, 40617522.0 / 29380423.0, -110615467.0 / 29380423.0, 69997945.0 / 29380423.0],
        ],
    };
}

#[cfg(test)]
mod tests {
    use super::super::dop853::Dop853Scheme;
    use super::{DormandPrince, Scheme, Tableau};

    /// Quadrature by all stages: `sum of weights * c^power`.
    fn moment<const N: usize, const P: usize>(t: &Tableau<N, P>, weights: &[f64; N], power: i32) -> f64 {
        (0..N).map(|i| weights[i] * t.c[i].powi(power)).sum()
    }

    /// Conditions that any pair's numbers meet, to the rounding of numbers of this size.
    fn consistent<const N: usize, const P: usize>(t: &Tableau<N, P>, embedded: i32, rounding: f64) {
        for i in 0..N {
            let sum: f64 = t.a[i].iter().sum();
            assert!((sum - t.c[i]).abs() < rounding, "row {i}: {sum}");
        }
        let step = t.stages - 1;
        for power in 0..t.order {
            let sum = moment(t, &t.a[step], power);
            assert!((sum - 1.0 / f64::from(power + 1)).abs() < rounding, "power {power}: {sum}");
            // The estimate vanishes up to the embedded solution's order only.
            let error = moment(t, &t.e, power);
            assert_eq!(error.abs() < 1e-3 * rounding.sqrt(), power < embedded, "power {power}: {error}");
        }
        for i in 0..N {
            let value: f64 = t.p[i].iter().sum();
            assert!((value - t.a[step][i]).abs() < 10.0 * rounding, "the extension's value, stage {i}");
            let slope: f64 = (0..P).map(|j| (j + 1) as f64 * t.p[i][j]).sum();
            let wanted = if i == step { 1.0 } else { 0.0 };
            assert!((slope - wanted).abs() < 100.0 * rounding, "the extension's slope, stage {i}: {slope}");
        }
        for power in 0..P as i32 {
            // The extension integrates polynomials exactly too: at half the step here.
            let half: [f64; N] =
                std::array::from_fn(|i| (0..P).map(|j| t.p[i][j] * 0.5f64.powi(j as i32 + 1)).sum());
            let sum = moment(t, &half, power);
            let wanted = 0.5f64.powi(power + 1) / f64::from(power + 1);
            assert!((sum - wanted).abs() < 10.0 * rounding, "the extension, power {power}: {sum}");
        }
    }

    #[test]
    fn dopri5_is_consistent() {
        consistent(&DormandPrince::TABLEAU, 4, 1e-14);
    }

    #[test]
    fn dop853_is_consistent() {
        // Its weights go up to 100.
        let t = Dop853Scheme::TABLEAU;
        consistent(&t, 5, 1e-13);
        let low = t.e_low.unwrap();
        for power in 0..5 {
            assert_eq!(moment(&t, &low, power).abs() < 1e-12, power < 3, "power {power}");
        }
    }
}
