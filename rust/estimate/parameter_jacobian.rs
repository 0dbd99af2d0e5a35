//! Derivatives of the states and of the observations by parameters.

use nalgebra::SVector;

use super::link_propagation::{Law, TransitionRun, variable};
use super::link_response::{QuadraturePoints, Transition};
use super::row_matrix::RowMatrix;
use super::sensor::{Moment, rates};
use super::{EstimateError, Estimator, FilmParameters, FreeParameter, Role, Sensor, Unknowns};
use crate::analysis::batch::parallel::in_parts;
use crate::integrate::propagate;
use crate::model::{Family, System, sides_of};
use crate::scalar::{Scalar, constants, vector};
pub(super) use crate::scalar::{WIDTH, Wide};

/// Blocks of rows are worked on by so many at least.
const TOGETHER: usize = 16;

/// One column per parameter: `M` rows for each frame, of what is seen, and `D` for each link, of the state at
/// its end.
#[derive(Clone, Debug, Default)]
pub struct ParameterJacobian {
    pub seen: RowMatrix,
    pub state: RowMatrix,
}

impl ParameterJacobian {
    /// These columns with others to their right.
    pub fn beside(&self, other: &Self) -> Self {
        self.beside_all(std::slice::from_ref(other))
    }

    /// These columns with those of all others to their right.
    pub fn beside_all(&self, others: &[Self]) -> Self {
        let all = |rows: fn(&Self) -> &RowMatrix| {
            let parts: Vec<&RowMatrix> = std::iter::once(self).chain(others).map(rows).collect();
            RowMatrix::side_by_side(&parts)
        };
        Self { seen: all(|own| &own.seen), state: all(|own| &own.state) }
    }
}

/// The origin of time in the model's equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TimeOrigin {
    /// The record's own time.
    Record,
    /// Every frame's time starts at zero.
    Frame,
}

/// The derivatives without room in the first directions: by the state from component `first` on, then by some
/// parameters of the laws; and the columns of these, film by film.
pub(super) struct FurtherDirections<B> {
    pub first: usize,
    pub columns: Vec<Vec<usize>>,
    pub laws: Vec<Law<B, Wide>>,
}

/// Values of which those with the numbers of [`acting`] parameters are differentiated by, from direction `first` on.
pub(super) fn tagged(values: &[f64], own: &[(usize, usize)], first: usize) -> Vec<Wide> {
    let mut wide: Vec<Wide> = constants(values);
    for (k, &(_, number)) in own.iter().enumerate() {
        wide[number] = Wide::variable(values[number], first + k);
    }
    wide
}

/// Their columns.
pub(super) fn columns_of(own: &[(usize, usize)]) -> Vec<usize> {
    own.iter().map(|&(column, _)| column).collect()
}

/// A system whose numbers know their derivatives by some parameters, and those parameters' columns.
struct DifferentiatedSystem<B> {
    system: B,
    columns: Vec<usize>,
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// Which films have a law that knows the time, and a free clock that moves it.
    pub(super) fn timed(&self, point: &Unknowns<D>, plain: &[Law<F::Built<f64>, f64>]) -> Vec<bool> {
        let mut timed = vec![false; plain.len()];
        let clocked = |film| self.free.iter().any(|free| free.role == Role::Clock && free.acts_on(film));
        let clocked: Vec<bool> = (0..plain.len()).map(clocked).collect();
        for i in 0..self.record.t.len().saturating_sub(1) {
            let Some((film, start, end)) = self.link(point, i) else { continue };
            if clocked[film] && !timed[film] {
                let (system, x) = (&plain[film].system, vector!(f64, D; k => point.states[i][k]));
                timed[film] = rates_of(system, start, &x) != rates_of(system, end, &x);
            }
        }
        timed
    }

    /// The rows of the free parameters at the links' ends, and what is [further](Transition::further) there; some films' laws are [timed](Estimator::timed).
    pub(super) fn own_state_rows(
        &self,
        point: &Unknowns<D>,
        flow: &mut [Transition<D>],
        plain: &[Law<F::Built<f64>, f64>],
        timed: &[bool],
        rows: &mut RowMatrix,
    ) -> Result<(), EstimateError> {
        let (p, live) = (self.free.len(), self.live());
        rows.become_zeros(flow.len() * D, p);
        self.further_rows(point, flow, rows)?;
        if p == 0 {
            return Ok(());
        }
        let films = 0..point.sets.len();
        let models: Vec<_> = films.clone().map(|film| acting(&self.free, film, model)).collect();
        let clocks: Vec<_> = films.map(|film| acting(&self.free, film, clock)).collect();
        in_blocks(rows, D, &|i, rows| {
            if self.record.linked[i] {
                let link = &flow[i];
                let film = self.record.film[i];
                let dt = self.record.t[i + 1] - self.record.t[i];
                for n in 0..D {
                    let row = &mut rows[n * p..(n + 1) * p];
                    for k in 0..models[film].len().min(WIDTH.saturating_sub(live)) {
                        row[models[film][k].0] = link.slopes[n][live + k];
                    }
                    // A slower clock lets the flow run on for longer.
                    for &(column, _) in &clocks[film] {
                        row[column] = link.end_rate[n] * dt;
                    }
                }
                if timed[film] {
                    // And begin later: by its start s the flow of x' = f(t, x) changes as -A f(s, x), A its
                    // derivative by x. Without forces in time that is minus the rate at its end.
                    let x = vector!(f64, D; k => point.states[i][k]);
                    let departure =
                        rates_of(&plain[film].system, self.record.t[i] * point.sets[film].pace(), &x);
                    let later = (link.end_rate - link.a() * SVector::from(departure)) * self.record.t[i];
                    for n in 0..D {
                        for &(column, _) in &clocks[film] {
                            rows[n * p + column] += later[n];
                        }
                    }
                }
            }
        });
        // The directions of padding states serve parameters.
        for slopes in flow.iter_mut().flat_map(|link| &mut link.slopes) {
            (live..D.min(WIDTH)).for_each(|k| slopes[k] = 0.0);
        }
        Ok(())
    }

    /// Derivatives without room in the first directions need another pass.
    fn further_rows(
        &self,
        point: &Unknowns<D>,
        flow: &mut [Transition<D>],
        rows: &mut RowMatrix,
    ) -> Result<(), EstimateError> {
        let live = self.live();
        for FurtherDirections { first, columns, laws } in self.beyond(point) {
            let slopes = self.each_link(
                point,
                &laws,
                &|follower, i, (_, start, end), slopes: &mut [[f64; WIDTH]; D]| {
                    let x = variable(&point.states[i], first..live);
                    let (last, _) =
                        follower.follow(TransitionRun { start, end, x, places: &[], met: &mut [] })?;
                    for k in 0..D {
                        slopes[k] = last[k].d;
                    }
                    Ok(())
                },
                &[[0.0; WIDTH]; D],
                Vec::new(),
            )?;
            let states = live.saturating_sub(first).min(WIDTH);
            for (i, slopes) in slopes.iter().enumerate() {
                for k in 0..states {
                    flow[i].further[first - WIDTH + k] = vector!(f64, D; n => slopes[n][k]);
                }
                for (k, &column) in columns[self.record.film[i]].iter().enumerate() {
                    for n in 0..D {
                        rows.row_mut(D * i + n)[column] = slopes[n][states + k];
                    }
                }
            }
        }
        Ok(())
    }

    /// The laws of all films over numbers that are differentiated by the state, as far as it finds room, and behind it by
    /// the first of the film's free parameters.
    pub(super) fn own_laws(&self, point: &Unknowns<D>) -> Vec<Law<F::Built<Wide>, Wide>> {
        self.laws(point, &|film, values| {
            let own = acting(&self.free, film, model);
            tagged(values, &own[..own.len().min(WIDTH.saturating_sub(self.live()))], self.live())
        })
    }

    /// The laws over numbers that are differentiated by the states and the free parameters that find no room there.
    pub(super) fn beyond(&self, point: &Unknowns<D>) -> Vec<FurtherDirections<F::Built<Wide>>> {
        let films = 0..point.sets.len();
        let models: Vec<_> = films.map(|film| acting(&self.free, film, model)).collect();
        let most = models.iter().map(Vec::len).max().unwrap_or(0);
        let (mut all, live) = (Vec::new(), self.live());
        for first in (WIDTH..live + most).step_by(WIDTH) {
            let (from, to) = (first.saturating_sub(live), (first + WIDTH).saturating_sub(live));
            let mut own = Vec::new();
            for model in &models {
                own.push(&model[from.min(model.len())..to.min(model.len())]);
            }
            let mut columns = Vec::new();
            for own in &own {
                columns.push(columns_of(own));
            }
            let behind = live.saturating_sub(first);
            let laws = self.laws(point, &|film, values| tagged(values, own[film], behind));
            all.push(FurtherDirections { first, columns, laws });
        }
        all
    }

    /// The columns of parameters that may belong to another family of models, to which each film's values are
    /// given.
    pub(super) fn columns(
        &self,
        point: &Unknowns<D>,
        places: &[QuadraturePoints<D>],
        (family, values): (&F, &[Vec<f64>]),
        free: &[FreeParameter],
        origin: TimeOrigin,
    ) -> ParameterJacobian {
        let (n, p) = (self.record.t.len(), free.len());
        let mut columns =
            ParameterJacobian { seen: RowMatrix::zeros(n * M, p), state: RowMatrix::zeros((n - 1) * D, p) };
        if p == 0 {
            return columns;
        }
        let actors: Vec<Vec<DifferentiatedSystem<F::Built<Wide>>>> =
            values.iter().enumerate().map(|(film, values)| actors(family, film, values, free)).collect();
        let systems: Vec<F::Built<f64>> =
            (0..).zip(values).map(|(film, values)| family.build_for(film, values)).collect();

        in_blocks(&mut columns.seen, M, &|i, rows| {
            let film = self.record.film[i];
            let set = &point.sets[film];
            let t = match origin {
                TimeOrigin::Record => self.record.t[i] * set.pace(),
                TimeOrigin::Frame => 0.0,
            };
            let x = &point.states[i];
            let rate = systems[film].rates(t, x, &sides_of(&systems[film], t, x));
            // The parameters of the model are seen through the rate, by a camera that looks at it.
            let by_rate = self.seen_by_rate(set, t, x, &rate);
            if by_rate.as_flattened().iter().all(|&v| v == 0.0) {
                return;
            }
            for actor in &actors[film] {
                let x = vector!(Wide, D; k => Wide::constant(x[k]));
                let rates = rates(&actor.system, Wide::constant(t), &x);
                for (k, &column) in actor.columns.iter().enumerate() {
                    for m in 0..M {
                        let mut moved = -0.0;
                        for n in 0..D {
                            moved += by_rate[m][n] * rates[n].d[k];
                        }
                        rows[m * p + column] += moved;
                    }
                }
            }
        });

        in_blocks(&mut columns.state, D, &|i, rows| {
            if !self.record.linked[i] {
                return;
            }
            let (film, link) = (self.record.film[i], &places[i]);
            let exact = link.switched && origin == TimeOrigin::Record;
            if exact {
                for actor in &actors[film] {
                    let Some(end) = self.along(point, i, &actor.system) else { continue };
                    for (k, &column) in actor.columns.iter().enumerate() {
                        for n in 0..D {
                            rows[n * p + column] = end[n].d[k];
                        }
                    }
                }
            }
            for place in if exact { &[] } else { &link.places[..] } {
                let t = if origin == TimeOrigin::Record { place.t } else { place.since };
                for actor in &actors[film] {
                    let x = vector!(Wide, D; k => Wide::constant(place.state[k]));
                    let rates = rates(&actor.system, Wide::constant(t), &x);
                    for (k, &column) in actor.columns.iter().enumerate() {
                        for n in 0..D {
                            let mut moved = -0.0;
                            for m in 0..D {
                                moved += place.response[(n, m)] * rates[m].d[k];
                            }
                            rows[n * p + column] += moved;
                        }
                    }
                }
            }
        });
        columns
    }

    /// The end of link `i`, followed with its parameters' derivatives.
    fn along(&self, point: &Unknowns<D>, i: usize, system: &impl System<Wide, D>) -> Option<[Wide; D]> {
        let (_, start, end) = self.link(point, i)?;
        let x = vector!(Wide, D; k => Wide::constant(point.states[i][k]));
        // The flow went this way already.
        propagate(system, start, end, x, &self.tolerance.filled::<D>(self.family.idle())).ok()
    }

    /// The derivatives of what is seen by the state's rate; a sensor's delay plays no part.
    fn seen_by_rate(&self, set: &FilmParameters, t: f64, x: &[f64; D], rate: &[f64; D]) -> [[f64; D]; M] {
        let x = vector!(Wide, D; k => Wide::constant(x[k]));
        let (camera, parameters) = (constants(&set.camera), constants(&set.model));
        let mut slopes = [[0.0; D]; M];
        for first in (0..D).step_by(WIDTH) {
            let rate: [Wide; D] = variable(rate, first..D);
            let at = Moment { t: Wide::constant(t), x: &x, rate: &rate, parameters: &parameters };
            let seen = self.sensor.observe(&camera, &at);
            for m in 0..M {
                for k in first..D.min(first + WIDTH) {
                    slopes[m][k] = seen[m].d[k - first];
                }
            }
        }
        slopes
    }
}

/// Works on all blocks of so many rows, each given its number.
fn in_blocks(rows: &mut RowMatrix, many: usize, work: &(dyn Fn(usize, &mut [f64]) + Sync)) {
    let mut blocks: Vec<&mut [f64]> = rows.blocks_mut(many).collect();
    in_parts(&mut blocks, TOGETHER, &|first, part| {
        for (j, block) in part.iter_mut().enumerate() {
            work(first + j, block);
        }
    });
}

pub(super) fn model(role: Role) -> Option<usize> {
    if let Role::Model(number) = role { Some(number) } else { None }
}

pub(super) fn camera(role: Role) -> Option<usize> {
    if let Role::Camera(number) = role { Some(number) } else { None }
}

pub(super) fn clock(role: Role) -> Option<usize> {
    (role == Role::Clock).then_some(0)
}

/// The columns of those free parameters of one film that play a part, with their numbers in it.
pub(super) fn acting(
    free: &[FreeParameter],
    film: usize,
    part: fn(Role) -> Option<usize>,
) -> Vec<(usize, usize)> {
    let own = free.iter().enumerate().filter(|(_, free)| free.acts_on(film));
    own.filter_map(|(column, free)| Some((column, part(free.role)?))).collect()
}

/// The systems of one film that differentiate by all of the model's parameters that are free.
fn actors<F: Family<D>, const D: usize>(
    family: &F,
    film: usize,
    values: &[f64],
    free: &[FreeParameter],
) -> Vec<DifferentiatedSystem<F::Built<Wide>>> {
    acting(free, film, model)
        .chunks(WIDTH)
        .map(|chunk| DifferentiatedSystem {
            system: family.build_for(film, &tagged(values, chunk, 0)),
            columns: columns_of(chunk),
        })
        .collect()
}

pub(super) fn rates_of<const D: usize>(system: &impl System<f64, D>, t: f64, x: &[f64; D]) -> [f64; D] {
    system.rates(t, x, &sides_of(system, t, x))
}
