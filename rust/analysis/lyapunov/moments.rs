//! Time averages of the state and of the products of its components.

use crate::analysis::batch::lanes::work;
use crate::integrate::{ErrorNorm, Integrator, Method};
use crate::model::System;
use crate::scalar::{InstructionSet, Isa, Real, Scalar, Work, vector};
use crate::unroll::unroll;

/// Gauss-Legendre nodes on `[0, 1]` and their weights: exact for products of polynomials of degree 7.
const NODES: [f64; 8] = [
    0.019_855_071_751_231_884,
    0.101_666_761_293_186_64,
    0.237_233_795_041_835_5,
    0.408_282_678_752_175_1,
    0.591_717_321_247_825,
    0.762_766_204_958_164_5,
    0.898_333_238_706_813_4,
    0.980_144_928_248_768_1,
];
const WEIGHTS: [f64; 8] = [
    0.050_614_268_145_188_13,
    0.111_190_517_226_687_24,
    0.156_853_322_938_943_63,
    0.181_341_891_689_181,
    0.181_341_891_689_181,
    0.156_853_322_938_943_63,
    0.111_190_517_226_687_24,
    0.050_614_268_145_188_13,
];

/// Integrals over time, or averages once divided by it.
#[derive(Clone, Copy, Debug)]
pub struct Moments<R, const D: usize> {
    pub time: R,
    /// Of each component.
    pub first: [R; D],
    /// The mean of each product of two components; during the run only those whose second component is not before the
    /// first.
    pub second: [[R; D]; D],
}

impl<R: Real, const D: usize> Moments<R, D> {
    pub fn zero() -> Self {
        Self { time: R::zero(), first: [R::zero(); D], second: [[R::zero(); D]; D] }
    }

    /// Adds the last step of the lanes that moved.
    #[inline(always)]
    pub fn add<M, S, E, K>(&mut self, isa: Isa, driver: &Integrator<M, S, D, E, K>, moved: R::Mask)
    where
        S: Scalar<Real = R, Mask = R::Mask>,
        M: System<S, D>,
        E: ErrorNorm<S, D> + Copy,
        K: Method<S, D>,
    {
        work::<R, _>(isa, Addition { moments: self, driver, moved });
    }

    /// Forgets a lane.
    pub fn clear(&mut self, lane: usize) {
        self.time.set_lane(lane, 0.0);
        for n in 0..D {
            self.first[n].set_lane(lane, 0.0);
            for m in 0..D {
                self.second[n][m].set_lane(lane, 0.0);
            }
        }
    }

    /// The averages of a lane.
    pub fn lane(&self, lane: usize) -> Moments<f64, D> {
        let time = self.time.lane(lane);
        let mean = |sum: R| sum.lane(lane) / time;
        let first = vector!(f64, D; n => mean(self.first[n]));
        let mut second = [[0.0; D]; D];
        for n in 0..D {
            second[n] = vector!(f64, D; m => mean(self.second[n.min(m)][n.max(m)]));
        }
        Moments { time, first, second }
    }
}

struct Addition<'a, M, S: Scalar, const D: usize, E, K> {
    moments: &'a mut Moments<S::Real, D>,
    driver: &'a Integrator<M, S, D, E, K>,
    moved: S::Mask,
}

impl<M, S, const D: usize, E, K> Work for Addition<'_, M, S, D, E, K>
where
    S: Scalar,
    M: System<S, D>,
    E: ErrorNorm<S, D> + Copy,
    K: Method<S, D>,
{
    type Output = ();

    #[inline(always)]
    fn run<V: InstructionSet>(self) {
        let Self { moments, driver, moved } = self;
        let size = S::Real::select(moved, driver.size(), S::Real::zero());
        moments.time += size;
        let states = driver.method().along(size, &NODES, &[true; D]);
        for i in 0..NODES.len() {
            let (x, share) = (&states[i], size.scale(WEIGHTS[i]));
            unroll!(n in 0..D => {
                // Lanes that did not move may hold anything.
                let own = S::Real::select(moved, x[n], S::Real::zero()) * share;
                moments.first[n] += own;
                unroll!(m in 0..D => {
                    if m >= n {
                        moments.second[n][m] += S::Real::select(moved, x[m], S::Real::zero()) * own;
                    }
                });
            });
        }
    }
}
