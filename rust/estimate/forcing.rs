//! What forcings of any form would do: they are scored from the flow's response, without a model of them.

use std::array::from_fn;

use nalgebra::{Const, Dyn, OMatrix, SMatrix};
use rayon::prelude::*;

use super::bordered::Block;
use super::linearise::Wide;
use super::{EstimateError, Estimator, Linear, Point, Score, Sensor};
use crate::integrate::propagate;
use crate::model::Family;
use crate::scalar::Scalar;

/// Places between 0 and 1 with their weights (Gauss-Legendre), by their number.
const PLACES: [&[(f64, f64)]; 4] = [
    &[],
    &[(0.5, 1.0)],
    &[(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)],
    &[(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)],
];

/// A place within a link, and what acts there.
#[derive(Clone, Copy, Debug)]
pub struct Place<const D: usize> {
    pub t: f64,
    pub state: [f64; D],
    /// Column `m` is what a unit forcing of equation `m` here adds to the state at the link's end, the
    /// place's share of the link's time included.
    pub response: SMatrix<f64, D, D>,
}

impl<const D: usize> Place<D> {
    fn nowhere() -> Self {
        Self { t: 0.0, state: [0.0; D], response: SMatrix::zeros() }
    }
}

/// Columns of unknown amplitudes: what each adds to the state at every link's end, and to what is seen.
#[derive(Clone, Debug)]
pub struct Columns<const D: usize, const M: usize> {
    pub b: Vec<Block<D>>,
    pub g: Vec<OMatrix<f64, Const<M>, Dyn>>,
}

/// How many columns are scored in one solve, about.
const BATCH: usize = 24;

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// The most places in a link.
    pub const MOST_PLACES: usize = PLACES.len() - 1;

    /// The response of the flow at a few places of every link, `nodes` one after the other for each; zero where
    /// frames are not linked.
    ///
    /// A forcing `f(x, t)` of equation `m` adds `sum response[m] f` to the state at the link's end: an integral
    /// by Gauss' rule.
    ///
    /// # Panics
    /// For more than [`MOST_PLACES`](Self::MOST_PLACES) nodes.
    pub fn responses(&self, point: &Point<D>, nodes: usize) -> Result<Vec<Place<D>>, EstimateError> {
        let places = PLACES[nodes];
        let system = self.family.build(&point.model.iter().map(|&v| Wide::constant(v)).collect::<Vec<_>>());
        let pace = 1.0 + point.clock;
        let one = |i: usize| {
            if !self.record.linked[i] {
                return Ok(vec![Place::nowhere(); nodes]);
            }
            let failed = |source| EstimateError::Integration { t: self.record.t[i], source };
            let (start, end) = (self.record.t[i] * pace, self.record.t[i + 1] * pace);
            let mut x: [Wide; D] = from_fn(|k| Wide::variable(point.states[i][k], k));
            let (mut t, mut found) = (start, Vec::with_capacity(nodes));
            for &(place, weight) in places {
                let next = start + place * (end - start);
                x = propagate(&system, t, next, x, &self.tolerance).map_err(failed)?;
                t = next;
                found.push((t, x, weight * (end - start)));
            }
            let last = tangent(&propagate(&system, t, end, x, &self.tolerance).map_err(failed)?);
            let place = |(t, x, share): (f64, [Wide; D], f64)| {
                // From here to the end: all the way, less the way up to here.
                let here = tangent(&x).try_inverse().unwrap_or_else(SMatrix::zeros);
                Place { t, state: x.map(|x| x.re), response: last * here * share }
            };
            Ok(found.into_iter().map(place).collect())
        };
        let links = 0..self.record.linked.len();
        let all: Vec<Vec<Place<D>>> = links.into_par_iter().map(one).collect::<Result<_, _>>()?;
        Ok(all.concat())
    }

    /// Scores columns in groups of these sizes, each group as if it were alone.
    ///
    /// # Panics
    /// Where the groups are not as many columns as there are.
    pub fn score_groups(
        &self,
        point: &Point<D>,
        columns: &Columns<D, M>,
        groups: &[usize],
    ) -> Result<Vec<Score>, EstimateError> {
        let base = self.linearise(point, &self.roles())?;
        let mut batches: Vec<(usize, Vec<usize>)> = Vec::new();
        let mut first = 0;
        for &size in groups {
            match batches.last_mut() {
                Some((_, sizes)) if sizes.iter().sum::<usize>() + size <= BATCH => sizes.push(size),
                _ => batches.push((first, vec![size])),
            }
            first += size;
        }
        let scores: Vec<Vec<Score>> = batches
            .par_iter()
            .map(|(first, sizes)| {
                let count = sizes.iter().sum();
                let score = self.score_columns(point, &base.with_columns(columns, *first, count))?;
                let mut start = 0;
                let part = |&size: &usize| {
                    let own = start;
                    start += size;
                    Score {
                        gradient: score.gradient.rows(own, size).into_owned(),
                        information: score.information.view((own, own), (size, size)).into_owned(),
                        alone: score.alone.rows(own, size).into_owned(),
                    }
                };
                Ok(sizes.iter().map(part).collect())
            })
            .collect::<Result<_, EstimateError>>()?;
        Ok(scores.concat())
    }
}

impl<const D: usize, const M: usize> Linear<D, M> {
    /// This linearisation with some of these columns set beside its own.
    fn with_columns(&self, columns: &Columns<D, M>, first: usize, count: usize) -> Self {
        let mut linear = self.clone();
        linear.g = columns.g.iter().map(|g| g.columns(first, count).into_owned()).collect();
        linear.b = columns.b.iter().map(|b| b.columns(first, count).into_owned()).collect();
        self.clone().beside(&linear)
    }
}

/// The derivatives of a state as a matrix.
fn tangent<const D: usize>(x: &[Wide; D]) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|m, k| x[m].d[k])
}
