//! What a change of parameters does to the states and to what is seen.

use super::flow::{Link, Places};
use super::follow::{Law, Way};
use super::rows::Rows;
use super::{EstimateError, Estimator, Free, Point, Role, Sensor};
use crate::integrate::propagate;
use crate::model::{Family, System, sides_of};
use crate::run::parallel::in_parts;
use crate::scalar::{Dual, Scalar};

/// Blocks of rows are worked on by so many at least.
const TOGETHER: usize = 16;
/// In how many directions one evaluation differentiates.
pub const WIDTH: usize = 8;
pub(super) type Wide = Dual<f64, WIDTH>;

/// One column per parameter: `M` rows for each frame, of what is seen, and `D` for each link, of the state at
/// its end.
#[derive(Clone, Debug, Default)]
pub struct Columns {
    pub seen: Rows,
    pub state: Rows,
}

impl Columns {
    /// These columns with others to their right.
    pub fn beside(&self, other: &Self) -> Self {
        Self { seen: self.seen.beside(&other.seen), state: self.state.beside(&other.state) }
    }
}

/// From where time counts in the model's equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TimeOrigin {
    /// The record's own time.
    Record,
    /// Every frame's time starts at zero.
    Frame,
}

/// Laws that are differentiated by some parameters, and the columns of these, film by film.
pub(super) struct Beyond<B> {
    pub columns: Vec<Vec<usize>>,
    pub laws: Vec<Law<B, Wide>>,
}

/// Values of which those with these numbers are differentiated by, from direction `first` on.
pub(super) fn tagged(values: &[f64], numbers: impl Iterator<Item = usize>, first: usize) -> Vec<Wide> {
    let mut wide: Vec<Wide> = values.iter().map(|&v| Wide::constant(v)).collect();
    numbers.enumerate().for_each(|(k, number)| wide[number] = Wide::variable(values[number], first + k));
    wide
}

/// A system whose numbers know their derivatives by some parameters, and those parameters' columns.
struct Actor<B> {
    system: B,
    columns: Vec<usize>,
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// The rows of the free parameters at the links' ends.
    pub(super) fn own_state_rows(
        &self,
        point: &Point<D>,
        flow: &[Link<D>],
        rows: &mut Rows,
    ) -> Result<(), EstimateError> {
        let p = self.free.len();
        rows.become_zeros(flow.len() * D, p);
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
                    for (&(column, _), slope) in models[film].iter().zip(&link.slopes[n][D..]) {
                        row[column] = *slope;
                    }
                    // A slower clock lets the flow run on for longer.
                    clocks[film].iter().for_each(|&(column, _)| row[column] = link.arrival[n] * dt);
                }
            }
        });
        // Those that found no room beside the state go the way again.
        for Beyond { columns, laws } in self.beyond(point) {
            let slopes = self.each_link(
                point,
                &laws,
                &|follower, i, (_, start, end)| {
                    let x = point.states[i].map(Wide::constant);
                    let (last, _) = follower.follow(Way { start, end, x, places: &[], met: &mut [] })?;
                    Ok(last.map(|x| x.d))
                },
                &[[0.0; WIDTH]; D],
                Vec::new(),
            )?;
            for (i, slopes) in slopes.iter().enumerate() {
                for (k, &column) in columns[self.record.film[i]].iter().enumerate() {
                    (0..D).for_each(|n| rows.row_mut(D * i + n)[column] = slopes[n][k]);
                }
            }
        }
        Ok(())
    }

    /// The laws of all films over numbers that are differentiated by the state and, behind it, by the first of
    /// the film's free parameters.
    pub(super) fn own_laws(&self, point: &Point<D>) -> Vec<Law<F::Built<Wide>, Wide>> {
        const { assert!(D < WIDTH) };
        let first = |film| acting(&self.free, film, model).into_iter().take(WIDTH - D);
        self.laws(point, |film, values| tagged(values, first(film).map(|(_, number)| number), D))
    }

    /// The laws over numbers that are differentiated by the free parameters that find no room there.
    pub(super) fn beyond(&self, point: &Point<D>) -> Vec<Beyond<F::Built<Wide>>> {
        let films = 0..point.sets.len();
        let models: Vec<_> = films.map(|film| acting(&self.free, film, model)).collect();
        let most = models.iter().map(Vec::len).max().unwrap_or(0);
        let chunk = |first: usize| {
            let own = |film: usize| models[film].iter().skip(first).take(WIDTH);
            let columns = (0..models.len()).map(|film| own(film).map(|&(column, _)| column).collect());
            let numbers = |film| own(film).map(|&(_, number)| number);
            let laws = self.laws(point, |film, values| tagged(values, numbers(film), 0));
            Beyond { columns: columns.collect(), laws }
        };
        (WIDTH - D..most).step_by(WIDTH).map(chunk).collect()
    }

    /// The columns of parameters that may belong to another family of models, to which each film's values are
    /// given.
    pub(super) fn columns(
        &self,
        point: &Point<D>,
        places: &[Places<D>],
        (family, values): (&F, &[Vec<f64>]),
        free: &[Free],
        origin: TimeOrigin,
    ) -> Columns {
        let (n, p) = (self.record.t.len(), free.len());
        let mut columns = Columns { seen: Rows::zeros(n * M, p), state: Rows::zeros((n - 1) * D, p) };
        if p == 0 {
            return columns;
        }
        let actors: Vec<Vec<Actor<F::Built<Wide>>>> =
            values.iter().enumerate().map(|(film, values)| actors(family, film, values, free)).collect();
        let systems: Vec<F::Built<f64>> = values.iter().map(|values| family.build(values)).collect();

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
            let by_rate = self.seen_by_rate(&set.camera, x, &rate);
            if by_rate.iter().flatten().all(|&v| v == 0.0) {
                return;
            }
            for actor in &actors[film] {
                let rates = rates(&actor.system, Wide::constant(t), &x.map(Wide::constant));
                for (k, &column) in actor.columns.iter().enumerate() {
                    for m in 0..M {
                        rows[m * p + column] += (0..D).map(|n| by_rate[m][n] * rates[n].d[k]).sum::<f64>();
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
                    self.along(point, i, &actor.system, |n, end| {
                        for (k, &column) in actor.columns.iter().enumerate() {
                            rows[n * p + column] = end.d[k];
                        }
                    });
                }
            }
            for place in link.places.iter().filter(|_| !exact) {
                let t = if origin == TimeOrigin::Record { place.t } else { place.since };
                for actor in &actors[film] {
                    let rates = rates(&actor.system, Wide::constant(t), &place.state.map(Wide::constant));
                    for (k, &column) in actor.columns.iter().enumerate() {
                        for n in 0..D {
                            let moved: f64 = (0..D).map(|m| place.response[(n, m)] * rates[m].d[k]).sum();
                            rows[n * p + column] += moved;
                        }
                    }
                }
            }
        });
        columns
    }

    /// Follows link `i` with its parameters' derivatives, to take each component of its end.
    fn along(
        &self,
        point: &Point<D>,
        i: usize,
        system: &impl System<Wide, D>,
        mut take: impl FnMut(usize, Wide),
    ) {
        let Some((_, start, end)) = self.link(point, i) else { return };
        let x = point.states[i].map(Wide::constant);
        // The flow went this way already.
        if let Ok(there) = propagate(system, start, end, x, &self.tolerance) {
            (0..D).for_each(|n| take(n, there[n]));
        }
    }

    /// The derivatives of what is seen by the state's rate.
    fn seen_by_rate(&self, camera: &[f64], x: &[f64; D], rate: &[f64; D]) -> [[f64; D]; M] {
        let camera: Vec<Dual<f64, D>> = camera.iter().map(|&v| Dual::constant(v)).collect();
        let x = x.map(Dual::constant);
        let mut k = 0;
        let rate = rate.map(|v| {
            k += 1;
            Dual::variable(v, k - 1)
        });
        self.sensor.observe(&camera, &x, &rate).map(|seen| seen.d)
    }
}

/// Works on all blocks of so many rows, each given its number.
fn in_blocks(rows: &mut Rows, many: usize, work: &(dyn Fn(usize, &mut [f64]) + Sync)) {
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

fn clock(role: Role) -> Option<usize> {
    (role == Role::Clock).then_some(0)
}

/// The columns of those free parameters of one film that play a part, with their numbers in it.
pub(super) fn acting(free: &[Free], film: usize, part: fn(Role) -> Option<usize>) -> Vec<(usize, usize)> {
    let own = free.iter().enumerate().filter(|(_, free)| free.acts_on(film));
    own.filter_map(|(column, free)| Some((column, part(free.role)?))).collect()
}

/// The systems of one film that differentiate by all of the model's parameters that are free.
fn actors<F: Family<D>, const D: usize>(
    family: &F,
    film: usize,
    values: &[f64],
    free: &[Free],
) -> Vec<Actor<F::Built<Wide>>> {
    acting(free, film, model)
        .chunks(WIDTH)
        .map(|chunk| {
            let wide = tagged(values, chunk.iter().map(|&(_, number)| number), 0);
            Actor { system: family.build(&wide), columns: chunk.iter().map(|&(column, _)| column).collect() }
        })
        .collect()
}

#[inline(always)]
pub(super) fn rates<const D: usize>(system: &impl System<Wide, D>, t: Wide, x: &[Wide; D]) -> [Wide; D] {
    system.rates(t, x, &sides_of(system, t, x))
}
