//! What a change of parameters does to the states and to what is seen.

use rayon::prelude::*;

use super::flow::Link;
use super::rows::Rows;
use super::{Estimator, Free, Point, Role, Sensor};
use crate::integrate::propagate;
use crate::model::{Family, System, sides_of};
use crate::scalar::{Dual, Scalar};

/// In how many parameters one evaluation differentiates.
const WIDTH: usize = 8;
type Wide = Dual<f64, WIDTH>;

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
    /// The columns of parameters at a point. They may belong to another family, to which each film's model
    /// values are given.
    pub(super) fn columns(
        &self,
        point: &Point<D>,
        flow: &[Link<D>],
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
        let cameras: Vec<_> = (0..values.len()).map(|film| acting(free, film, camera)).collect();

        let seen: Vec<&mut [f64]> = columns.seen.blocks_mut(M).collect();
        seen.into_par_iter().enumerate().for_each(|(i, rows)| {
            let film = self.record.film[i];
            let set = &point.sets[film];
            let t = match origin {
                TimeOrigin::Record => self.record.t[i] * set.pace(),
                TimeOrigin::Frame => 0.0,
            };
            let x = &point.states[i];
            let rate = systems[film].rates(t, x, &sides_of(&systems[film], t, x));
            self.camera_columns(set, x, &rate, &cameras[film], rows);
            // The parameters of the model are seen through the rate, by a camera that looks at it.
            let by_rate = self.seen_by_rate(&set.camera, x, &rate);
            if by_rate.iter().flatten().all(|&v| v == 0.0) {
                return;
            }
            for actor in &actors[film] {
                let rates = rates(&actor.system, t, x);
                for (k, &column) in actor.columns.iter().enumerate() {
                    for m in 0..M {
                        rows[m * p + column] += (0..D).map(|n| by_rate[m][n] * rates[n].d[k]).sum::<f64>();
                    }
                }
            }
        });

        let clocks: Vec<usize> = (0..p).filter(|&j| free[j].role == Role::Clock).collect();
        let state: Vec<&mut [f64]> = columns.state.blocks_mut(D).collect();
        state.into_par_iter().enumerate().filter(|(i, _)| self.record.linked[*i]).for_each(|(i, rows)| {
            let (film, link) = (self.record.film[i], &flow[i]);
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
                    let rates = rates(&actor.system, t, &place.state);
                    for (k, &column) in actor.columns.iter().enumerate() {
                        for n in 0..D {
                            let moved: f64 = (0..D).map(|m| place.response[(n, m)] * rates[m].d[k]).sum();
                            rows[n * p + column] += moved;
                        }
                    }
                }
            }
            let dt = self.record.t[i + 1] - self.record.t[i];
            for &column in clocks.iter().filter(|&&j| free[j].acts_on(film)) {
                for n in 0..D {
                    // A slower clock lets the flow run on for longer.
                    rows[n * p + column] = link.arrival[n] * dt;
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

    /// The columns of the camera's parameters in one frame.
    fn camera_columns(
        &self,
        set: &super::Set,
        x: &[f64; D],
        rate: &[f64; D],
        own: &[(usize, usize)],
        rows: &mut [f64],
    ) {
        let width = rows.len() / M;
        let (x, rate) = (x.map(Wide::constant), rate.map(Wide::constant));
        for chunk in own.chunks(WIDTH) {
            let mut camera: Vec<Wide> = set.camera.iter().map(|&v| Wide::constant(v)).collect();
            for (k, &(_, number)) in chunk.iter().enumerate() {
                camera[number] = Wide::variable(set.camera[number], k);
            }
            let seen = self.sensor.observe(&camera, &x, &rate);
            for (k, &(column, _)) in chunk.iter().enumerate() {
                for m in 0..M {
                    rows[m * width + column] = seen[m].d[k];
                }
            }
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

fn model(role: Role) -> Option<usize> {
    if let Role::Model(number) = role { Some(number) } else { None }
}

fn camera(role: Role) -> Option<usize> {
    if let Role::Camera(number) = role { Some(number) } else { None }
}

/// The columns of those free parameters of one film that play a part, with their numbers in it.
fn acting(free: &[Free], film: usize, part: fn(Role) -> Option<usize>) -> Vec<(usize, usize)> {
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
            let mut wide: Vec<Wide> = values.iter().map(|&v| Wide::constant(v)).collect();
            for (k, &(_, number)) in chunk.iter().enumerate() {
                wide[number] = Wide::variable(values[number], k);
            }
            Actor { system: family.build(&wide), columns: chunk.iter().map(|&(column, _)| column).collect() }
        })
        .collect()
}

fn rates<const D: usize>(system: &impl System<Wide, D>, t: f64, x: &[f64; D]) -> [Wide; D] {
    let (t, x) = (Wide::constant(t), x.map(Wide::constant));
    system.rates(t, &x, &sides_of(system, t, &x))
}
