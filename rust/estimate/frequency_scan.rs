//! The score of an effect at very many frequencies.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, SMatrix};

use super::parameter_jacobian::{ParameterJacobian, TimeOrigin};
use super::row_matrix::RowMatrix;
use super::score::Candidate;
use super::{EstimateError, Estimator, Score, Sensor, Unknowns};
use crate::analysis::batch::parallel::try_map;
use crate::model::Family;

/// How many frequencies are scored in one solve.
const BATCH: usize = 12;

/// How many waves all others are made of.
pub const BASIS: usize = 3;
/// How a wave's cosine and sine are made of the cosines and sines of those.
type Share = SMatrix<f64, { 2 * BASIS }, 2>;
/// The contribution of those to one row.
type Local = [f64; 2 * BASIS];

/// An effect `a cos(2 pi f t) + b sin(2 pi f t)` at a few frequencies, in one family: within a frame,
/// every other frequency is a combination of these.
pub struct FrequencyProbe<F> {
    /// The effect once per frequency, with the amplitudes `a, b` of each.
    pub candidate: Candidate<F>,
    /// The frequencies, Hz.
    pub frequencies: [f64; BASIS],
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// Scores the amplitudes `a, b` at each frequency, one frequency at a time.
    ///
    /// The response to a wave over one frame is linear in the wave: the responses to the probe's waves,
    /// with time counted from the frame's start, are computed once and combined with the phase that a
    /// frequency has at each frame. Effects of the model that depend on time themselves are taken at
    /// time zero here; that changes a response only to second order.
    pub fn score_waves(
        &self,
        point: &Unknowns<D>,
        probe: &FrequencyProbe<F>,
        frequencies: &[f64],
    ) -> Result<Vec<Score>, EstimateError> {
        let linear = self.around(point)?;
        let places = self.places(point)?;
        let responses = self.candidate_columns(point, &places, &probe.candidate, TimeOrigin::Frame);
        let steps = self.record.t.windows(2).zip(&self.record.linked).filter(|(_, linked)| **linked);
        let longest = steps.map(|(pair, _)| pair[1] - pair[0]).fold(0.0, f64::max);
        let shares = shares(&probe.frequencies, longest, frequencies);
        let batches = try_map(frequencies.len().div_ceil(BATCH), &|i| {
            let own = i * BATCH..frequencies.len().min((i + 1) * BATCH);
            let waves = self.waves(point, &responses, &frequencies[own.clone()], &shares[own.clone()]);
            self.score_beside(point, &linear, &linear.columns.beside(&waves), &vec![2; own.len()])
        })?;
        Ok(batches.concat())
    }

    /// The columns of waves from the responses to the probe's.
    fn waves(
        &self,
        point: &Unknowns<D>,
        responses: &ParameterJacobian,
        frequencies: &[f64],
        shares: &[Share],
    ) -> ParameterJacobian {
        let n = self.record.t.len();
        let width = 2 * frequencies.len();
        let mut waves = ParameterJacobian {
            seen: RowMatrix::zeros(n * M, width),
            state: RowMatrix::zeros((n - 1) * D, width),
        };
        for i in 0..n {
            let pace = point.sets[self.record.film[i]].pace();
            let links = if i + 1 < n { D } else { 0 };
            for (k, (f, share)) in frequencies.iter().zip(shares).enumerate() {
                let (sin, cos) = (TAU * f * self.record.t[i] * pace).sin_cos();
                // cos(phase + local) and sin(phase + local), of the local waves' shares.
                let (in_cos, in_sin) = (share.column(0), share.column(1));
                let in_both: [Local; 2] =
                    [(in_cos * cos - in_sin * sin).into(), (in_cos * sin + in_sin * cos).into()];
                let combined = |local: &Local| {
                    let mut both = [0.0; 2];
                    for j in 0..2 * BASIS {
                        both[0] += local[j] * in_both[0][j];
                        both[1] += local[j] * in_both[1][j];
                    }
                    both
                };
                for row in M * i..M * (i + 1) {
                    let both = combined(&local(&responses.seen, row));
                    waves.seen.row_mut(row)[2 * k..2 * k + 2].copy_from_slice(&both);
                }
                for row in D * i..D * i + links {
                    let both = combined(&local(&responses.state, row));
                    waves.state.row_mut(row)[2 * k..2 * k + 2].copy_from_slice(&both);
                }
            }
        }
        waves
    }
}

fn local(responses: &RowMatrix, row: usize) -> Local {
    *responses.row(row).first_chunk().expect("a column for each wave of the basis")
}

/// How `cos` and `sin` of each frequency are made of those of the basis, on `[0, longest]`: least squares
/// on a fine grid. With a basis that spans the frequencies asked for, three are good to 1e-6.
fn shares(basis: &[f64; BASIS], longest: f64, frequencies: &[f64]) -> Vec<Share> {
    const POINTS: usize = 17;
    let time = |row: usize| longest * row as f64 / (POINTS - 1) as f64;
    let wave =
        |f: f64, column: usize, t: f64| if column == 0 { (TAU * f * t).cos() } else { (TAU * f * t).sin() };
    let made_of = DMatrix::from_fn(POINTS, 2 * BASIS, |row, c| wave(basis[c / 2], c % 2, time(row)));
    let svd = made_of.svd(true, true);
    frequencies
        .iter()
        .map(|&f| {
            let wanted = DMatrix::from_fn(POINTS, 2, |row, c| wave(f, c, time(row)));
            let found = svd.solve(&wanted, 1e-9).expect("both factors were computed");
            Share::from_column_slice(found.as_slice())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_frequencies_make_all_between() {
        let (basis, longest) = ([2.0, 4.0, 6.0], 0.04);
        for f in [0.05, 1.0, 3.3, 5.9] {
            let share = &shares(&basis, longest, &[f])[0];
            for t in [0.0, 0.013, 0.031, 0.04] {
                let made: Vec<f64> = (0..2)
                    .map(|c| {
                        (0..6)
                            .map(|k| {
                                let angle = TAU * basis[k / 2] * t;
                                share[(k, c)] * if k % 2 == 0 { angle.cos() } else { angle.sin() }
                            })
                            .sum()
                    })
                    .collect();
                assert!((made[0] - (TAU * f * t).cos()).abs() < 1e-5, "{f} {t} {made:?}");
                assert!((made[1] - (TAU * f * t).sin()).abs() < 1e-5, "{f} {t} {made:?}");
            }
        }
    }
}
