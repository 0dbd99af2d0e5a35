//! The score of candidates: what each would do for the fit, without fitting it.

use nalgebra::{DMatrix, DVector};

use super::gauss_newton::undetermined;
use super::linearise::{TimeOrigin, invert};
use super::{EstimateError, Estimator, Linear, Point, Role, Sensor};
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

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// Scores candidates around a minimum. Each group is a family that holds this model's own
    /// parameters first and then those of more effects, all amplitudes zero, with the values of all its
    /// parameters and the amplitudes' roles. The states and all free parameters are eliminated.
    pub fn score(
        &self,
        point: &Point<D>,
        groups: &[(F, Vec<f64>, Vec<Role>)],
    ) -> Result<Score, EstimateError> {
        let mut linear = self.linearise(point, &self.roles())?;
        for (family, values, roles) in groups {
            let wider = Point { model: values.clone(), ..point.clone() };
            linear = linear.beside(&self.linearise_as(family, &wider, roles, TimeOrigin::Record)?);
        }
        self.score_columns(point, &linear)
    }

    /// The score of the columns that follow those of the free parameters.
    pub(super) fn score_columns(
        &self,
        point: &Point<D>,
        linear: &Linear<D, M>,
    ) -> Result<Score, EstimateError> {
        let own = self.free.len();
        let reduced = self.equations(point, linear).eliminate(&self.record.t)?;
        let all = reduced.schur.nrows();
        let more = all - own;
        let matrix = reduced.schur.view((0, 0), (own, own)).into_owned();
        let cross = reduced.schur.view((0, own), (own, more)).into_owned();
        let corner = reduced.schur.view((own, own), (more, more)).into_owned();
        let gradient = reduced.gradient.rows(own, more).into_owned();
        let alone = corner.diagonal();
        if own == 0 {
            return Ok(Score { gradient, information: corner, alone });
        }
        let covariance = invert(&matrix).ok_or_else(undetermined)?;
        let solved = covariance * &cross;
        Ok(Score {
            gradient: gradient - solved.tr_mul(&reduced.gradient.rows(0, own)),
            information: corner - cross.tr_mul(&solved),
            alone,
        })
    }
}
