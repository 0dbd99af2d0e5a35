//! A single run, whatever its model and its method.

use super::integrator::{Counts, Ending, Integrator};
use super::method::Method;
use crate::failure::Failure;
use crate::model::{Sides, System};
use crate::tolerance::ErrorNorm;

/// So many steps are taken without a look at anything but the time.
const MOST: usize = 64;

/// A [`Integrator`] over plain numbers, its model and its method forgotten: what looks at every step of a run is then
/// compiled once for each number of states. See the integrator's methods of the same names.
pub trait Steps<const D: usize> {
    /// Takes accepted steps up to `end`, until one reaches the time `wanted` or does not end freely, but only so many
    /// that a request to stop need not wait. The steps before the last one are not to be looked at.
    fn advance(&mut self, end: f64, wanted: f64) -> Result<Ending, Failure>;
    fn t(&self) -> f64;
    fn x(&self) -> &[f64; D];
    fn sides(&self) -> &Sides<f64>;
    fn from(&self) -> f64;
    fn size(&self) -> f64;
    fn dense(&self, dt: f64) -> [f64; D];
    fn counts(&self) -> Counts;
    /// The last trial's polynomial, as [`Method::polynomial`].
    fn polynomial(&self, coefficients: &mut Vec<[f64; D]>) -> f64;
    /// The rates at another time and state, on the sides that the law is taken on.
    fn rates(&self, t: f64, x: &[f64; D]) -> [f64; D];
    /// As [`Method::stable`].
    fn stable(&self) -> f64;
    /// As [`Method::SERIES`].
    fn is_series(&self) -> bool;
}

impl<M, E, K, const D: usize> Steps<D> for Integrator<M, f64, D, E, K>
where
    M: System<f64, D>,
    E: ErrorNorm<f64, D> + Copy,
    K: Method<f64, D>,
{
    fn advance(&mut self, end: f64, wanted: f64) -> Result<Ending, Failure> {
        let wanted = wanted.min(end);
        for _ in 1..MOST {
            let ending = self.advance(end)?;
            if ending != Ending::Free || self.t() >= wanted {
                return Ok(ending);
            }
        }
        self.advance(end)
    }
    fn t(&self) -> f64 {
        self.t()
    }
    fn x(&self) -> &[f64; D] {
        self.x()
    }
    fn sides(&self) -> &Sides<f64> {
        self.sides()
    }
    fn from(&self) -> f64 {
        self.from()
    }
    fn size(&self) -> f64 {
        self.size()
    }
    fn dense(&self, dt: f64) -> [f64; D] {
        self.dense(dt)
    }
    fn counts(&self) -> Counts {
        self.counts()
    }
    fn polynomial(&self, coefficients: &mut Vec<[f64; D]>) -> f64 {
        self.method().polynomial(coefficients)
    }
    fn rates(&self, t: f64, x: &[f64; D]) -> [f64; D] {
        self.system().rates(t, x, self.sides())
    }
    fn stable(&self) -> f64 {
        self.method().stable()
    }
    fn is_series(&self) -> bool {
        K::SERIES
    }
}
