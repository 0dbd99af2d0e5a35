//! Time averages of the state and of the products of its components.

use super::ship::work;
use crate::integrate::{Driver, ErrorNorm, Method};
use crate::model::System;
use crate::scalar::{Instructions, Isa, Real, Scalar, Work};
use crate::unroll::unroll;

/// Gauss-Legendre nodes on `[0, 1]` and their weights: exact for products of polynomials of degree 5.
const NODES: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

/// Integrals over time, or averages once divided by it.
#[derive(Clone, Copy, Debug)]
pub struct Moments<R, const D: usize> {
    pub time: R,
    /// Of each component.
    pub first: [R; D],
    /// Of each product of two components.
    pub second: [[R; D]; D],
}

impl<R: Real, const D: usize> Moments<R, D> {
    pub fn zero() -> Self {
        Self { time: R::zero(), first: [R::zero(); D], second: [[R::zero(); D]; D] }
    }

    /// Adds the last step of the lanes that moved.
    #[inline(always)]
    pub fn add<M, S, E, K>(&mut self, isa: Isa, driver: &Driver<M, S, D, E, K>, moved: R::Mask)
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
        for sum in self.first.iter_mut().chain(self.second.iter_mut().flatten()) {
            sum.set_lane(lane, 0.0);
        }
    }

    /// The averages of a lane.
    pub fn lane(&self, lane: usize) -> Moments<f64, D> {
        let time = self.time.lane(lane);
        let mean = |sum: R| sum.lane(lane) / time;
        Moments { time, first: self.first.map(mean), second: self.second.map(|row| row.map(mean)) }
    }
}

struct Addition<'a, M, S: Scalar, const D: usize, E, K> {
    moments: &'a mut Moments<S::Real, D>,
    driver: &'a Driver<M, S, D, E, K>,
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
    fn run<V: Instructions>(self) {
        let Self { moments, driver, moved } = self;
        let size = S::Real::select(moved, driver.size(), S::Real::zero());
        moments.time += size;
        for (node, weight) in NODES {
            let x = driver.dense_real(size.scale(node));
            let share = size.scale(weight);
            unroll!(n in 0..D => {
                // Lanes that did not move may hold anything.
                let own = S::Real::select(moved, x[n], S::Real::zero());
                moments.first[n] += own * share;
                unroll!(m in 0..D => {
                    let other = S::Real::select(moved, x[m], S::Real::zero());
                    moments.second[n][m] += own * other * share;
                });
            });
        }
    }
}
