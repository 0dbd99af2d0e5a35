//! Explicit Runge-Kutta pairs.

use std::marker::PhantomData;

use super::dop853::Dop853Scheme;
use super::method::{EIGHTHS, Method, QUARTERS, Trial};
use super::tableau::{DormandPrince, Scheme};
use crate::formula::StageWeights;
use crate::model::{MOST_PROBES, Sides, StepStart, System};
use crate::scalar::{Real, Scalar, vector};
use crate::tolerance::ErrorNorm;
use crate::unroll::unroll;

/// The state whose components are these. Many of them, or those with derivatives, are taken in a loop: unrolled, the
/// twelve stages of six are the longest functions of all.
macro_rules! components {
    ($n:ident => $component:expr) => {
        if const { D <= 4 && size_of::<S>() == size_of::<S::Real>() } {
            vector!(S, D; $n => $component)
        } else {
            let mut all = [S::zero(); D];
            for $n in 0..D {
                all[$n] = $component;
            }
            all
        }
    };
}

/// The rates at all stages and the new state of a step of size `h` from time `t` and state `x`, whose
/// rate is `first`. The last of the stages that make a step is the rate at the new state.
///
/// It is a pure function, and generic over the scalar: `h` has one value per lane and no derivatives.
/// The sides of the switching surfaces stay as given, so the step sees a smooth law.
#[inline(always)]
pub fn step<T: Scheme<N, P>, S: Scalar, const D: usize, const N: usize, const P: usize>(
    system: &impl System<S, D>,
    t: S::Real,
    x: &[S; D],
    first: &[S; D],
    h: S::Real,
    sides: &Sides<S>,
) -> ([S; D], [[S; D]; N]) {
    let mut stages = [*first; N];
    let mut new = *x;
    if const { apart::<S>() } {
        for i in 1..T::TABLEAU.stages {
            new = stage::<T, S, D, N, P>(i, x, &stages, h);
            stages[i] = system.rates(S::lift(t + h.scale(const { &T::TABLEAU }.c[i])), &new, sides);
        }
        return (new, stages);
    }
    unroll!(i in 1..N => {
        if i < T::TABLEAU.stages {
            new = stage::<T, S, D, N, P>(i, x, &stages, h);
            stages[i] = system.rates(S::lift(t + h.scale(T::TABLEAU.c[i])), &new, sides);
        }
    });
    (new, stages)
}

/// The argument of stage `i`.
#[inline(always)]
fn stage<T: Scheme<N, P>, S: Scalar, const D: usize, const N: usize, const P: usize>(
    i: usize,
    x: &[S; D],
    stages: &[[S; D]; N],
    h: S::Real,
) -> [S; D] {
    if const { apart::<S>() } {
        let mut new = combined_apart(&const { &T::TABLEAU }.a[i][..i], stages, h);
        for n in 0..D {
            new[n] = x[n] + new[n];
        }
        return new;
    }
    components!(n => x[n] + combine(&T::TABLEAU.a[i], stages, i, n).times(h))
}

/// `h` times the sums of all stages with these weights, in every component.
#[inline(always)]
fn combined<S: Scalar, const D: usize, const N: usize>(
    weights: &'static [f64; N],
    stages: &[[S; D]; N],
    count: usize,
    h: S::Real,
) -> [S; D] {
    if const { apart::<S>() } {
        return combined_apart(&weights[..count.min(N)], stages, h);
    }
    components!(n => combine(weights, stages, count, n).times(h))
}

/// Returns true if operations on a number are long, as with derivatives that are not in vector registers: such steps are made
/// of functions and loops, not written out.
const fn apart<S: Scalar>() -> bool {
    size_of::<S>() > size_of::<S::Real>() && S::Real::LANES == 1
}

/// `Σ_(j < count) weights_j k_j` for component `n`, the zero weights left out.
#[inline(always)]
fn combine<S: Scalar, const D: usize, const N: usize>(
    weights: &[f64; N],
    stages: &[[S; D]; N],
    count: usize,
    n: usize,
) -> S {
    let mut sum = stages[0][n].scale(weights[0]);
    unroll!(j in 1..N => {
        if j < count && weights[j] != 0.0 {
            sum += stages[j][n].scale(weights[j]);
        }
    });
    sum
}

/// As [`combined`], a function of its own.
#[inline(never)]
fn combined_apart<S: Scalar, const D: usize>(weights: &[f64], stages: &[[S; D]], h: S::Real) -> [S; D] {
    let mut all = [S::zero(); D];
    for n in 0..D {
        let mut sum = stages[0][n].scale(weights[0]);
        for j in 1..weights.len() {
            if weights[j] != 0.0 {
                sum += stages[j][n].scale(weights[j]);
            }
        }
        all[n] = sum.times(h);
    }
    all
}

/// A Runge-Kutta pair as a [`Method`].
#[derive(Clone, Copy, Debug)]
pub struct RungeKutta<T, S: Scalar, const D: usize, const N: usize, const P: usize> {
    /// The start of the last trial, its size and its stages' rates.
    x: [S; D],
    h: S::Real,
    stages: [[S; D]; N],
    /// The rate at the point reached.
    first: [S; D],
    /// True if the last trial has computed the stages of the extension, too.
    extended: bool,
    scheme: PhantomData<T>,
}

/// Dormand & Prince's pair of order 5(4).
pub type Dopri5<S, const D: usize> = RungeKutta<DormandPrince, S, D, 7, 4>;

/// Dormand & Prince's method of order 8(5, 3) as in the program DOP853.
pub type Dop853<S, const D: usize> = RungeKutta<Dop853Scheme, S, D, 16, 7>;

impl<T, S: Scalar, const D: usize, const N: usize, const P: usize> Default for RungeKutta<T, S, D, N, P> {
    fn default() -> Self {
        let zero = [S::zero(); D];
        let h = S::Real::zero();
        Self { x: zero, h, stages: [zero; N], first: zero, extended: false, scheme: PhantomData }
    }
}

impl<T, S, const D: usize, const N: usize, const P: usize> RungeKutta<T, S, D, N, P>
where
    T: Scheme<N, P>,
    S: Scalar,
{
    /// The new state of a step by the law's own code for whole steps, which gives all stages.
    #[inline(always)]
    fn staged(&mut self, system: &impl System<S, D>, at: &StepStart<S, D>, h: S::Real) -> Option<[S; D]> {
        if const { !S::IS_PLAIN || S::Real::LANES > 1 } {
            return None;
        }
        let table = const { &T::TABLEAU };
        let weights = StageWeights {
            number: usize::from(table.order > 5),
            stages: table.stages,
            c: &table.c,
            a: table.a.as_flattened(),
        };
        self.stages[0] = self.first;
        let x = system.staged(&weights, (at.t, &at.x, h), &at.sides, &mut self.stages);
        self.extended = x.is_some();
        x
    }

    /// The coefficient of `h θ^(j+1)` in component `n`, of the numbers or of a part of them.
    #[inline(always)]
    fn power<A: Scalar>(&self, j: usize, n: usize, part: impl Fn(S) -> A) -> A {
        let mut power = part(self.stages[0][n]).scale(T::TABLEAU.p[0][j]);
        for i in 1..N {
            if T::TABLEAU.p[i][j] != 0.0 {
                power += part(self.stages[i][n]).scale(T::TABLEAU.p[i][j]);
            }
        }
        power
    }

    /// `dt` as a part of the last trial.
    #[inline(always)]
    fn theta(&self, dt: S::Real) -> S::Real {
        // No step, no way along it.
        let moving = S::Real::zero().less(self.h * self.h);
        S::Real::select(moving, dt / self.h, S::Real::zero())
    }
}

impl<T, S, const D: usize, const N: usize, const P: usize> Method<S, D> for RungeKutta<T, S, D, N, P>
where
    T: Scheme<N, P>,
    S: Scalar,
{
    const ORDER: i32 = T::TABLEAU.order;
    const EVALUATIONS: usize = N - 1;
    const SERIES: bool = false;
    const PROBES: &'static [f64] = if T::TABLEAU.order > 5 { EIGHTHS } else { QUARTERS };

    fn stable(&self) -> f64 {
        T::TABLEAU.stable
    }

    #[inline(always)]
    fn begin(&mut self, system: &impl System<S, D>, at: &StepStart<S, D>, lanes: S::Mask) {
        let rate = system.rates(S::lift(at.t), &at.x, &at.sides);
        self.first = vector!(S, D; n => S::select(lanes, rate[n], self.first[n]));
    }

    #[inline(always)]
    fn attempt(
        &mut self,
        system: &impl System<S, D>,
        at: &StepStart<S, D>,
        h: S::Real,
        norm: &impl ErrorNorm<S, D>,
    ) -> Trial<S, D> {
        let x = self.staged(system, at, h).unwrap_or_else(|| {
            let (x, stages) = step::<T, S, D, N, P>(system, at.t, &at.x, &self.first, h, &at.sides);
            self.stages = stages;
            x
        });
        let (stages, count) = (&self.stages, T::TABLEAU.stages);
        let error = combined(&const { &T::TABLEAU }.e, stages, count, h);
        let mut error = norm.of_step(&error, &at.x, &x);
        if let Some(low) = &const { &T::TABLEAU }.e_low {
            // Hairer's combination, which behaves as h^8.
            let low = combined(low, stages, count, h);
            let (square, low) = (error * error, norm.of_step(&low, &at.x, &x));
            let both = square + (low * low).scale(0.01);
            error = S::Real::select(S::Real::zero().less(both), square / both.sqrt(), error);
        }
        (self.x, self.h) = (at.x, h);
        Trial { x, size: h, error }
    }

    #[inline(always)]
    fn extend(&mut self, system: &impl System<S, D>, at: &StepStart<S, D>) {
        if self.extended {
            return;
        }
        for i in T::TABLEAU.stages..N {
            let x = stage::<T, S, D, N, P>(i, &self.x, &self.stages, self.h);
            self.stages[i] = system.rates(S::lift(at.t + self.h.scale(T::TABLEAU.c[i])), &x, &at.sides);
        }
    }

    #[inline(always)]
    fn begin_next(&mut self, lanes: S::Mask) {
        let last = &self.stages[T::TABLEAU.stages - 1];
        self.first = vector!(S, D; n => S::select(lanes, last[n], self.first[n]));
    }

    #[inline(always)]
    fn at(&self, dt: S::Real) -> [S; D] {
        let theta = self.theta(dt);
        components!(n => {
            let mut sum = S::zero();
            for j in (0..P).rev() {
                sum = sum.times(theta) + self.power(j, n, |s| s);
            }
            self.x[n] + sum.times(theta).times(self.h)
        })
    }

    #[inline(always)]
    fn along(&self, h: S::Real, parts: &[f64], of: &[bool; D]) -> [[S::Real; D]; MOST_PROBES] {
        let mut states = [[S::Real::zero(); D]; MOST_PROBES];
        for n in 0..D {
            if !of[n] {
                continue;
            }
            let powers = vector!(S::Real, P; j => self.power(j, n, S::real));
            for i in 0..parts.len() {
                let theta = self.theta(h.scale(parts[i]));
                let mut sum = S::Real::zero();
                for j in (0..P).rev() {
                    sum = sum * theta + powers[j];
                }
                states[i][n] = self.x[n].real() + sum * theta * self.h;
            }
        }
        states
    }

    fn polynomial(&self, coefficients: &mut Vec<[S; D]>) -> S::Real {
        coefficients.push(self.x);
        for j in 0..P {
            coefficients.push(components!(n => self.power(j, n, |s| s).times(self.h)));
        }
        self.h
    }
}

#[cfg(test)]
mod tests {
    use super::super::tableau::DormandPrince;
    use super::*;
    use crate::model::{Family, FormulaFamily, MAX_SURFACES};
    use crate::scalar::Isa;

    /// The new state and the stages of a step, by the law's code and without it.
    fn steps<T: Scheme<N, P>, const N: usize, const P: usize>(texts: &[&str; 3]) -> [Vec<u64>; 2] {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let family =
            FormulaFamily::<3>::parse(&names(&["x", "y", "z"]), texts, &names(&["a", "b"]), &[]).unwrap();
        let system = family.build(&[0.7, -1.3]);
        let mut sides = [true; MAX_SURFACES];
        sides[1] = false;
        let at = StepStart { t: 0.5, x: [0.3, -2.1, 1.7], sides };
        let mut method = RungeKutta::<T, f64, 3, N, P>::default();
        method.begin(&system, &at, true);
        let mut coded = None;
        for _ in 0..2000 {
            coded = method.staged(&system, &at, 0.1).map(|x| (x, method.stages));
        }
        let (x, mut stages) = step::<T, f64, 3, N, P>(&system, at.t, &at.x, &method.first, 0.1, &at.sides);
        for i in T::TABLEAU.stages..N {
            let x = stage::<T, f64, 3, N, P>(i, &at.x, &stages, 0.1);
            stages[i] = system.rates(at.t + 0.1 * T::TABLEAU.c[i], &x, &at.sides);
        }
        let has_code = cfg!(feature = "machine-code") && Isa::best() > Isa::Baseline;
        assert_eq!((coded.is_some(), method.extended), (has_code, has_code));
        let bits = |(x, stages): ([f64; 3], [[f64; 3]; N])| {
            x.iter().chain(stages.as_flattened()).map(|value| value.to_bits()).collect()
        };
        [bits(coded.unwrap_or((x, stages))), bits((x, stages))]
    }

    #[test]
    fn code_for_whole_steps_keeps_their_bits() {
        for texts in [
            ["y - x", "x*z", "a - x*y"],
            ["y", "cos(1.1*t)*a - x^3 - b*sin(y)", "0"],
            ["-a*sin(y) - 0.04*x - 0.2*sign(x)", "x", "0"],
            ["x*a - t", "abs(x)*y - max(y, z)", "sign(x)*t/(1 + z^2)"],
            ["exp(-x^2)*b", "z", "where(x > y, x^a, sqrt(1 + y^2))"],
        ] {
            let [coded, plain] = steps::<DormandPrince, 7, 4>(&texts);
            assert_eq!(coded, plain, "{texts:?}");
            let [coded, plain] = steps::<Dop853Scheme, 16, 7>(&texts);
            assert_eq!(coded, plain, "{texts:?}");
        }
    }
}
