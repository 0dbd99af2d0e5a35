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
    /// The stages' times.
    pub c: [f64; N],
    /// The stages' weights.
    pub a: [[f64; N]; N],
    /// The solution's weights minus those of the embedded one: the error estimate is `h Σ e_i k_i`.
    pub e: [f64; N],
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
    use super::{DormandPrince, Scheme, Tableau};

    const DP: Tableau<7, 4> = DormandPrince::TABLEAU;

    #[test]
    fn rows_sum_to_the_stage_times() {
        for i in 0..7 {
            let sum: f64 = DP.a[i].iter().sum();
            assert!((sum - DP.c[i]).abs() < 1e-14, "row {i}: {sum}");
        }
    }

    #[test]
    fn quadrature_conditions_hold_to_the_order() {
        for power in 0..DP.order {
            let sum: f64 = (0..7).map(|i| DP.a[6][i] * DP.c[i].powi(power)).sum();
            assert!((sum - 1.0 / f64::from(power + 1)).abs() < 1e-14, "power {power}");
            // The embedded solution has order 4, so the estimate vanishes up to there only.
            let error: f64 = (0..7).map(|i| DP.e[i] * DP.c[i].powi(power)).sum();
            assert_eq!(error.abs() < 1e-15, power < 4, "power {power}");
        }
    }

    #[test]
    fn the_extension_ends_at_the_new_state_with_the_new_rate() {
        for i in 0..7 {
            let value: f64 = DP.p[i].iter().sum();
            assert!((value - DP.a[6][i]).abs() < 1e-14, "value, stage {i}");
            let slope: f64 = (0..4).map(|j| (j + 1) as f64 * DP.p[i][j]).sum();
            let wanted = if i == 6 { 1.0 } else { 0.0 };
            assert!((slope - wanted).abs() < 1e-13, "slope, stage {i}");
        }
    }
}
