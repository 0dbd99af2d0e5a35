//! Time averages of the state and of the products of its components.

use crate::integrate::{Driver, ErrorNorm, Method};
use crate::model::System;
use crate::scalar::{Real, Scalar};

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
    #[inline(never)]
    pub fn add<M, S, E, K>(&mut self, driver: &Driver<M, S, D, E, K>, moved: R::Mask)
    where
        S: Scalar<Real = R, Mask = R::Mask>,
        M: System<S, D>,
        E: ErrorNorm<S, D> + Copy,
        K: Method<S, D>,
    {
        let size = R::select(moved, driver.size(), R::zero());
        self.time += size;
        for (node, weight) in NODES {
            let x = driver.dense_real(size.scale(node));
            let share = size.scale(weight);
            for n in 0..D {
                // Lanes that did not move may hold anything.
                let own = R::select(moved, x[n], R::zero());
                self.first[n] += own * share;
                for m in 0..D {
                    let other = R::select(moved, x[m], R::zero());
                    self.second[n][m] += own * other * share;
                }
            }
        }
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
