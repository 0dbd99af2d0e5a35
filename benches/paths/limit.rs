//! How far from the machine's limit the series of the diffusionless Lorenz equations are.
//!
//! A processor that does nothing but multiply and add does so many instructions a second (the measured [`peak`]). A
//! step to the order `p` needs at least these, of which a product of numbers with derivatives takes several:
//!
//! ```text
//!                                                    products       sums and scalings
//! omega_{k+1} = (y_k - omega_k)/(k+1)                                     2 p
//! y_{k+1} = sum_j omega_j z_{k-j} / (k+1)           p (p + 1)/2           2 p
//! half_{k+1} = sum_j omega_j omega_{k+1-j} / 2      p (p + 3)/4            p
//! z_{k+1} = -half_{k+1} - 2 half_k/(k+1)                                   p
//! x(h) of three components                                                3 p
//! ```
//!
//! (the pairs of a square are `(k + 1)/2` products, its middle one among them, and one sum is left where two run side by
//! side), so that the limit is `peak lanes / (instructions a step * steps a time unit)`, with the lanes of a register
//! where many trajectories run side by side, and 1 where one runs alone. The other parts of a step (its size, its end,
//! events, orthonormal tangents) are the distance from the limit, and so is the waiting time for results.

use std::hint::black_box;
use std::time::Instant;

use udd::analysis::batch::rows;
use udd::integrate::{ErrorNorm, Integrator, Taylor, Tolerance, WithTangents, order};
use udd::model::{DleFamily, Family};
use udd::scalar::{Dual, InstructionSet, Isa, Packet, Scalar, Work};

/// Counts of the steps of a path.
pub struct Steps {
    pub values: Vec<Vec<f64>>,
    pub starts: Vec<[f64; 3]>,
    pub tolerance: Tolerance,
    /// The derivatives of the numbers: 0, 1 or 3.
    pub derivatives: usize,
    /// The time that all trajectories together are followed for.
    pub time: f64,
}

/// Steps are counted on so many trajectories at most, each up to this time.
const SAMPLE: usize = 32;
const SPAN: f64 = 100.0;

impl Steps {
    /// The least time that the work can take on one core, in seconds.
    pub fn least(&self, isa: Isa) -> f64 {
        let order = order(&self.tolerance) as f64;
        let products = 0.5 * order * (order + 1.0) + 0.25 * order * (order + 3.0);
        let linear = 9.0 * order;
        let jobs = self.values.len().max(self.starts.len());
        let (lanes, instructions) = match (jobs > 1, self.derivatives) {
            // Many trajectories: a register for the number and one for each derivative.
            (true, n) => (register(isa), (1 + 2 * n) as f64 * products + (1 + n) as f64 * linear),
            (false, 0) => (1, products + linear),
            // One: the number and up to three derivatives share a register.
            (false, _) => (1, 2.0 * products + linear),
        };
        let steps = self.time * self.per_time();
        steps * instructions / (lanes as f64 * peak(isa))
    }

    fn per_time(&self) -> f64 {
        match self.derivatives {
            0 => self.count::<f64, _>(self.tolerance, |x| x),
            1 => self.count::<Dual<f64, 1>, _>(WithTangents(self.tolerance), tangents),
            _ => self.count::<Dual<f64, 3>, _>(WithTangents(self.tolerance), tangents),
        }
    }

    fn count<S, E>(&self, norm: E, begin: impl Fn([f64; 3]) -> [S; 3]) -> f64
    where
        S: Scalar<Real = f64, Mask = bool>,
        E: ErrorNorm<S, 3> + Copy,
    {
        let jobs = self.values.len().max(self.starts.len());
        let tape = rows::tape(&DleFamily, &self.values).expect("a series");
        let (mut steps, mut time) = (0, 0.0);
        for job in (0..jobs).step_by(jobs.div_ceil(SAMPLE)) {
            let values: Vec<S> =
                rows::of(&self.values, job).iter().map(|&value| S::constant(value)).collect();
            let system = DleFamily.build(&values);
            let method = Taylor::new(&tape, values, order(&self.tolerance), Isa::best());
            let mut driver =
                Integrator::by(method, system, 0.0, begin(*rows::of(&self.starts, job)), None, &norm);
            while driver.t() < SPAN {
                driver.advance(SPAN).expect("a smooth run");
            }
            steps += driver.counts().accepted;
            time += SPAN;
        }
        steps as f64 / time
    }
}

/// The state with the first axes as tangents.
fn tangents<const N: usize>(x: [f64; 3]) -> [Dual<f64, N>; 3] {
    std::array::from_fn(|n| if n < N { Dual::variable(x[n], n) } else { Dual::fixed(x[n]) })
}

/// Lanes of a register.
fn register(isa: Isa) -> usize {
    match isa {
        Isa::Baseline => 1,
        Isa::Avx2 => 4,
        Isa::Avx512 => 8,
    }
}

/// Instructions a second that multiply and add, on one core: the best of several runs.
fn peak(isa: Isa) -> f64 {
    (0..50).map(|_| isa.run(Fused)).fold(0.0, f64::max)
}

struct Fused;

impl Work for Fused {
    type Output = f64;

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> f64 {
        match V::ISA {
            Isa::Avx512 => rate::<Packet<8, V>>(),
            Isa::Avx2 => rate::<Packet<4, V>>(),
            Isa::Baseline => rate::<f64>(),
        }
    }
}

/// Enough sums side by side that none is waited for, and few enough for the registers.
#[inline(always)]
fn rate<S: Scalar>() -> f64 {
    const SUMS: usize = 12;
    const ROUNDS: usize = 20_000;
    let (a, b) = (black_box(S::constant(0.999)), black_box(S::constant(1e-3)));
    let mut sums = [S::one(); SUMS];
    let begin = Instant::now();
    for _ in 0..ROUNDS {
        for sum in &mut sums {
            *sum = b.fused(*sum, a);
        }
    }
    black_box(sums);
    (ROUNDS * SUMS) as f64 / begin.elapsed().as_secs_f64()
}
