//! The score of an effect at very many frequencies.

use std::f64::consts::TAU;

use nalgebra::{Const, DMatrix, Dyn, OMatrix};
use rayon::prelude::*;

use super::linearise::TimeOrigin;
use super::{EstimateError, Estimator, Linear, Point, Role, Score, Sensor};
use crate::model::Family;

type Rows<const R: usize> = OMatrix<f64, Const<R>, Dyn>;

/// How many frequencies are scored in one solve.
const BATCH: usize = 24;

/// An effect `a cos(2 pi f t) + b sin(2 pi f t)` at a few frequencies, in one family: within a frame,
/// every other frequency is a combination of these.
pub struct Probe<F> {
    /// The model with the effect added once per frequency, all amplitudes zero.
    pub family: F,
    /// Its parameters.
    pub values: Vec<f64>,
    /// The amplitudes `a, b` of each.
    pub roles: Vec<Role>,
    /// The frequencies, Hz.
    pub frequencies: Vec<f64>,
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
        point: &Point<D>,
        probe: &Probe<F>,
        frequencies: &[f64],
    ) -> Result<Vec<Score>, EstimateError> {
        let base = self.linearise(point, &self.roles())?;
        let wider = Point { model: probe.values.clone(), ..point.clone() };
        let responses = self.linearise_as(&probe.family, &wider, &probe.roles, TimeOrigin::Frame)?;
        let longest = self.record.t.windows(2).map(|p| p[1] - p[0]).fold(0.0, f64::max);
        let shares = shares(&probe.frequencies, longest, frequencies);
        let batches: Vec<Vec<Score>> = frequencies
            .par_chunks(BATCH)
            .zip(shares.par_chunks(BATCH))
            .map(|(frequencies, shares)| {
                let linear = base.clone().beside(&self.waves(&responses, frequencies, shares, point.clock));
                let score = self.score_columns(point, &linear)?;
                Ok((0..frequencies.len())
                    .map(|k| Score {
                        gradient: score.gradient.rows(2 * k, 2).into_owned(),
                        information: score.information.view((2 * k, 2 * k), (2, 2)).into_owned(),
                        alone: score.alone.rows(2 * k, 2).into_owned(),
                    })
                    .collect())
            })
            .collect::<Result<_, EstimateError>>()?;
        Ok(batches.concat())
    }

    /// The columns of waves from the responses to the probe's.
    fn waves(
        &self,
        responses: &Linear<D, M>,
        frequencies: &[f64],
        shares: &[DMatrix<f64>],
        clock: f64,
    ) -> Linear<D, M> {
        let mut linear = responses.clone();
        for i in 0..self.record.t.len() {
            let phases = frequencies.iter().map(|f| TAU * f * self.record.t[i] * (1.0 + clock));
            linear.g[i] = combined(&responses.g[i], shares, phases.clone());
            linear.b[i] = combined(&responses.b[i], shares, phases);
        }
        linear
    }
}

/// Two columns per wave, its `cos` and `sin`, from the responses to the probe's waves.
fn combined<const R: usize>(
    responses: &Rows<R>,
    shares: &[DMatrix<f64>],
    phases: impl Iterator<Item = f64>,
) -> Rows<R> {
    let mut columns = Rows::<R>::zeros(2 * shares.len());
    for (k, (share, phase)) in shares.iter().zip(phases).enumerate() {
        let local = responses * share;
        let (c, s) = (local.column(0), local.column(1));
        let (sin, cos) = phase.sin_cos();
        // cos(phase + local) and sin(phase + local)
        columns.set_column(2 * k, &(c * cos - s * sin));
        columns.set_column(2 * k + 1, &(c * sin + s * cos));
    }
    columns
}

/// How `cos` and `sin` of each frequency are made of those of the basis, on `[0, longest]`: least squares
/// on a fine grid. With a basis that spans the frequencies asked for, three are good to 1e-6.
fn shares(basis: &[f64], longest: f64, frequencies: &[f64]) -> Vec<DMatrix<f64>> {
    const POINTS: usize = 17;
    let time = |row: usize| longest * row as f64 / (POINTS - 1) as f64;
    let wave =
        |f: f64, column: usize, t: f64| if column == 0 { (TAU * f * t).cos() } else { (TAU * f * t).sin() };
    let made_of = DMatrix::from_fn(POINTS, 2 * basis.len(), |row, c| wave(basis[c / 2], c % 2, time(row)));
    let svd = made_of.svd(true, true);
    frequencies
        .iter()
        .map(|&f| {
            let wanted = DMatrix::from_fn(POINTS, 2, |row, c| wave(f, c, time(row)));
            svd.solve(&wanted, 1e-9).expect("both factors were computed")
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
