//! The model's flow from each frame to the next, and how it responds to what is added on the way.

use std::array::from_fn;

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::{EstimateError, Estimator, Point, Sensor};
use crate::integrate::{Driver, Failure, MOST_STEPS, Tolerance, propagate};
use crate::model::{Family, System, sides_of};
use crate::scalar::{Dual, Scalar};

/// Places within a link with their weights, as parts of its time (Gauss-Legendre).
const PLACES: [(f64, f64); PLACES_PER_LINK] =
    [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
/// How many of them there are.
pub const PLACES_PER_LINK: usize = 3;

/// A state with its derivatives by the state at the frame before.
type Tangent<const D: usize> = [Dual<f64, D>; D];

/// A place within a link, and what acts there.
#[derive(Clone, Copy, Debug)]
pub struct Place<const D: usize> {
    /// In the model's time, since the frame before and in all.
    pub since: f64,
    pub t: f64,
    pub state: [f64; D],
    /// Column `m` is what a unit forcing of equation `m` here adds to the state at the link's end, the
    /// place's share of the link's time included. A forcing `f(x, t)` adds the sum of `response f` over
    /// the places: an integral by Gauss' rule.
    pub response: SMatrix<f64, D, D>,
}

/// What becomes of a frame's state until the next frame.
#[derive(Clone, Debug)]
pub struct Link<const D: usize> {
    /// The next frame's state less what the model makes of this one.
    pub defect: SVector<f64, D>,
    /// The derivative of what the model makes by this frame's state.
    pub a: SMatrix<f64, D, D>,
    /// Whether the law switched on the way: derivatives by its parameters then jump between the places.
    pub switched: bool,
    /// The rate at the end.
    pub arrival: SVector<f64, D>,
    pub places: [Place<D>; PLACES_PER_LINK],
}

impl<const D: usize> Link<D> {
    fn none() -> Self {
        let place = Place { since: 0.0, t: 0.0, state: [0.0; D], response: SMatrix::zeros() };
        let zero = SVector::zeros();
        let places = [place; PLACES_PER_LINK];
        Self { defect: zero, a: SMatrix::zeros(), switched: false, arrival: zero, places }
    }
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// The systems of all films over any number.
    pub(super) fn systems<S: Scalar>(&self, point: &Point<D>) -> Vec<F::Built<S>> {
        let lifted = |values: &[f64]| values.iter().map(|&v| S::constant(v)).collect::<Vec<_>>();
        point.sets.iter().map(|set| self.family.build(&lifted(&set.model))).collect()
    }

    /// The film, start and end of link `i` in the model's time, where its frames are linked.
    pub(super) fn link(&self, point: &Point<D>, i: usize) -> Option<(usize, f64, f64)> {
        let film = self.record.film[i];
        let pace = point.sets[film].pace();
        self.record.linked[i].then(|| (film, self.record.t[i] * pace, self.record.t[i + 1] * pace))
    }

    fn lost(&self, i: usize) -> impl Fn(Failure) -> EstimateError {
        let t = self.record.t[i];
        move |source| EstimateError::Integration { t, source }
    }

    /// Every link; those of frames that are not linked are all zero.
    pub fn flow(&self, point: &Point<D>) -> Result<Vec<Link<D>>, EstimateError> {
        let systems: Vec<F::Built<Dual<f64, D>>> = self.systems(point);
        let one = |i: usize| {
            let Some((film, start, end)) = self.link(point, i) else { return Ok(Link::none()) };
            let x: Tangent<D> = from_fn(|k| Dual::variable(point.states[i][k], k));
            follow(&systems[film], (start, end), x, &point.states[i + 1], &self.tolerance)
                .map_err(self.lost(i))
        };
        (0..self.record.linked.len()).into_par_iter().map(one).collect()
    }

    /// The links' defects alone.
    pub(super) fn defects(&self, point: &Point<D>) -> Result<Vec<SVector<f64, D>>, EstimateError> {
        let systems: Vec<F::Built<f64>> = self.systems(point);
        let one = |i: usize| {
            let Some((film, start, end)) = self.link(point, i) else { return Ok(SVector::zeros()) };
            let there = propagate(&systems[film], start, end, point.states[i], &self.tolerance)
                .map_err(self.lost(i))?;
            Ok(SVector::from_fn(|k, _| point.states[i + 1][k] - there[k]))
        };
        (0..self.record.linked.len()).into_par_iter().map(one).collect()
    }
}

fn follow<const D: usize>(
    system: &impl System<Dual<f64, D>, D>,
    (start, end): (f64, f64),
    x: Tangent<D>,
    next: &[f64; D],
    tolerance: &Tolerance,
) -> Result<Link<D>, Failure> {
    let mut driver: Driver<_, Dual<f64, D>, D> = Driver::new(system, start, x, Some(end - start), tolerance);
    let mut met = [x; PLACES_PER_LINK];
    let mut ahead = 0;
    let (sides, mut switched) = (*driver.sides(), false);
    while driver.t() != end {
        driver.advance(end)?;
        switched |= *driver.sides() != sides;
        if driver.counts().accepted > MOST_STEPS {
            return Err(Failure::TooManySteps { t: driver.t(), limit: MOST_STEPS });
        }
        while ahead < PLACES_PER_LINK {
            let since = start + PLACES[ahead].0 * (end - start) - driver.from();
            if since > driver.size() {
                break;
            }
            met[ahead] = if since < driver.size() { driver.dense(since) } else { *driver.x() };
            ahead += 1;
        }
    }
    let last = *driver.x();
    let a = tangent(&last);
    let time = Dual::constant(end);
    let arrival = system.rates(time, &last, &sides_of(system, time, &last));
    let places = from_fn(|q| {
        let (place, weight) = PLACES[q];
        let since = place * (end - start);
        // From here to the end: all the way, less the way up to here.
        let here = tangent(&met[q]).try_inverse().unwrap_or_else(SMatrix::zeros);
        let response = a * here * (weight * (end - start));
        Place { since, t: start + since, state: met[q].map(|x| x.re), response }
    });
    Ok(Link {
        defect: SVector::from_fn(|k, _| next[k] - last[k].re),
        a,
        switched,
        arrival: SVector::from_fn(|k, _| arrival[k].re),
        places,
    })
}

/// The derivatives of a state as a matrix.
fn tangent<const D: usize>(x: &Tangent<D>) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|m, k| x[m].d[k])
}
