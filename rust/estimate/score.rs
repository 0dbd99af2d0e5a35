//! The score of candidates: what each would do for the fit, without fitting it.

use nalgebra::{DMatrix, DVector};

use super::bordered::Bordered;
use super::gauss_newton::undetermined;
use super::linearise::invert;
use super::link_response::QuadraturePoints;
use super::parameter_jacobian::{ParameterJacobian, TimeOrigin};
use super::row_matrix::RowMatrix;
use super::{EstimateError, Estimator, FreeParameter, Linearisation, Role, Sensor, Unknowns};
use crate::analysis::batch::parallel::try_map;
use crate::integrate::cancel;
use crate::model::Family;

/// The candidates' amplitudes near zero, everything else optimal: the cost falls by
/// `2 gradient . c - c . information c` when they take the values `c`.
#[derive(Clone, Debug)]
pub struct Score {
    pub gradient: DVector<f64>,
    pub information: DMatrix<f64>,
    /// The information on each amplitude were all free parameters known: where `information` is much
    /// smaller, the free parameters already absorb the candidate.
    pub alone: DVector<f64>,
}

/// An effect that a model may lack: a family that holds this model's own parameters first and then its own,
/// with their values, and which of all are its amplitudes, at zero.
#[derive(Clone, Debug)]
pub struct Candidate<F> {
    pub family: F,
    pub more: Vec<f64>,
    pub amplitudes: Vec<Role>,
}

/// How many columns are scored in one solve, about.
const BATCH: usize = 24;

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// Scores candidates around a minimum, all together. The states and all free parameters are eliminated.
    pub fn score(&self, point: &Unknowns<D>, candidates: &[Candidate<F>]) -> Result<Score, EstimateError> {
        let linear = self.around(point)?;
        let places = self.places(point)?;
        let one = |candidate| {
            cancel::look();
            self.candidate_columns(point, &places, candidate, TimeOrigin::Record)
        };
        let more: Vec<ParameterJacobian> = candidates.iter().map(one).collect();
        let size = more.iter().map(|own| own.seen.width()).sum();
        let columns = linear.columns.beside_all(&more);
        let scores = self.score_beside(point, &linear, &columns, &[size])?;
        Ok(scores.into_iter().next().expect("one group"))
    }

    /// The columns of a candidate's amplitudes.
    pub(super) fn candidate_columns(
        &self,
        point: &Unknowns<D>,
        places: &[QuadraturePoints<D>],
        candidate: &Candidate<F>,
        origin: TimeOrigin,
    ) -> ParameterJacobian {
        let wider = |model: &Vec<f64>| [model.as_slice(), &candidate.more].concat();
        let values: Vec<Vec<f64>> = point.sets.iter().map(|set| wider(&set.model)).collect();
        let one = |&role: &Role| FreeParameter::unlimited(role, 0.0, f64::INFINITY);
        let free: Vec<FreeParameter> = candidate.amplitudes.iter().map(one).collect();
        self.columns(point, places, (&candidate.family, &values), &free, origin)
    }

    /// Scores columns in groups of these sizes, each group as if it were alone.
    ///
    /// # Panics
    /// Where the groups are not as many columns as there are.
    pub fn score_groups(
        &self,
        point: &Unknowns<D>,
        columns: &ParameterJacobian,
        groups: &[usize],
    ) -> Result<Vec<Score>, EstimateError> {
        let linear = self.around(point)?;
        let mut batches: Vec<(usize, Vec<usize>)> = Vec::new();
        let mut first = 0;
        for &size in groups {
            match batches.last_mut() {
                Some((_, sizes)) if sizes.iter().sum::<usize>() + size <= BATCH => sizes.push(size),
                _ => batches.push((first, vec![size])),
            }
            first += size;
        }
        let scores = try_map(batches.len(), &|i| {
            let (first, sizes) = &batches[i];
            let end = first + sizes.iter().sum::<usize>();
            let part = |rows: &RowMatrix| rows.part(*first..end);
            let more = ParameterJacobian { seen: part(&columns.seen), state: part(&columns.state) };
            self.score_beside(point, &linear, &linear.columns.beside(&more), sizes)
        })?;
        Ok(scores.concat())
    }

    /// The scores of the columns that follow those of the free parameters in `columns`, in groups.
    pub(super) fn score_beside(
        &self,
        point: &Unknowns<D>,
        linear: &Linearisation<D, M>,
        columns: &ParameterJacobian,
        groups: &[usize],
    ) -> Result<Vec<Score>, EstimateError> {
        let own = self.free.len();
        let mut system = Bordered::new(linear, columns, &self.record, &self.precision());
        self.add_priors(point, &mut system);
        let reduced = system.eliminate(&self.record.t)?;
        let matrix = reduced.schur.view((0, 0), (own, own)).into_owned();
        let covariance = invert(&matrix).ok_or_else(|| undetermined(&self.free, &matrix))?;
        let mut first = own;
        let one = |&size: &usize| {
            let start = first;
            first += size;
            let cross = reduced.schur.view((0, start), (own, size)).into_owned();
            let corner = reduced.schur.view((start, start), (size, size)).into_owned();
            let solved = &covariance * &cross;
            Score {
                gradient: reduced.gradient.rows(start, size) - solved.tr_mul(&reduced.gradient.rows(0, own)),
                alone: corner.diagonal(),
                information: corner - cross.tr_mul(&solved),
            }
        };
        Ok(groups.iter().map(one).collect())
    }
}
