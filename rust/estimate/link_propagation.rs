//! Links followed one after the other.

use std::ops::Range;

use super::{EstimateError, Estimator, Role, Sensor, Unknowns};
use crate::analysis::batch::parallel::try_in_parts;
use crate::integrate::{ErrorNorm, Failure, Integrator, MaybeTangents, Method, Taylor, Tolerance, order};
use crate::model::{AnySystem, Family, System};
use crate::scalar::{Dual, Isa, Scalar, Wide, vector};
use crate::tape::Tape;

/// A link takes a few steps. If a fit diverges, for example near a formula's pole, it would take very many, and the
/// fit should turn back at once.
const MOST_STEPS: u64 = 1000;
/// A thread takes at least so many links: their integrator is made once for all.
const TOGETHER: usize = 64;

/// A film's model with its parameters' values, over any number.
pub(super) struct Law<B, S> {
    pub values: Vec<S>,
    pub system: B,
}

type BySeries<'a, const D: usize> =
    Integrator<&'a dyn AnySystem<Wide, D>, Wide, D, MaybeTangents, Taylor<'a, Wide, D>>;

/// The integrator of one film's links. It is compiled once for each number of states: a series is of the law's tape,
/// and
/// beside so many derivatives a call costs little.
pub(super) enum TransitionIntegrator<'a, const D: usize> {
    /// By the law's power series: most links take one step. If it fails the other one takes the link.
    Series(Box<BySeries<'a, D>>, Tolerance),
    /// By a Runge-Kutta method, where the law has no series.
    Stages(Box<Integrator<&'a dyn AnySystem<Wide, D>, Wide, D>>),
}

/// A link on the way from its start.
pub(super) struct TransitionRun<'a, const D: usize> {
    pub start: f64,
    pub end: f64,
    pub x: [Wide; D],
    /// Places on the way, as parts of it, and the states met there.
    pub places: &'a [f64],
    pub met: &'a mut [[Wide; D]],
}

/// A link's film, its start and its end in the model's time.
pub(super) type Span = (usize, f64, f64);
/// Where a link ends, and whether the law switched on the way.
pub(super) type End<const D: usize> = ([Wide; D], bool);

impl<'a, const D: usize> TransitionIntegrator<'a, D> {
    fn new<M: System<Wide, D>>(
        tape: Option<(&'a Tape<D>, usize)>,
        law: &'a Law<M, Wide>,
        tolerance: &Tolerance,
    ) -> Self {
        let (x, system): (_, &dyn AnySystem<Wide, D>) = ([Wide::zero(); D], &law.system);
        match tape {
            Some((tape, order)) => {
                let method = Taylor::new(tape, law.values.clone(), order, Isa::best());
                let norm = MaybeTangents { tolerance: *tolerance, tangents: false };
                let driver = Integrator::by(method, system, 0.0, x, Some(1.0), &norm);
                Self::Series(Box::new(driver), *tolerance)
            }
            None => Self::Stages(Box::new(Integrator::new(system, 0.0, x, Some(1.0), tolerance))),
        }
    }

    /// Follows a link; the first trial step is all of it.
    pub fn follow(&mut self, way: TransitionRun<'_, D>) -> Result<End<D>, Failure> {
        match self {
            Self::Series(driver, tolerance) => {
                let TransitionRun { start, end, x, places, met } = way;
                match follow(driver, TransitionRun { start, end, x, places, met: &mut *met }) {
                    Err(failure) if failure.is_of_series() => {
                        let mut stages: Integrator<_, Wide, D> =
                            Integrator::new(*driver.system(), start, x, Some(end - start), tolerance);
                        follow(&mut stages, TransitionRun { start, end, x, places, met })
                    }
                    found => found,
                }
            }
            Self::Stages(driver) => follow(driver, way),
        }
    }
}

fn follow<M, E, K, const D: usize>(
    driver: &mut Integrator<M, Wide, D, E, K>,
    way: TransitionRun<'_, D>,
) -> Result<End<D>, Failure>
where
    M: System<Wide, D>,
    E: ErrorNorm<Wide, D> + Copy,
    K: Method<Wide, D>,
{
    let TransitionRun { start, end, x, places, met } = way;
    driver.start(true, start, x, Some(end - start));
    let (mut steps, mut ahead) = (0, 0);
    let (sides, mut switched) = (*driver.sides(), false);
    while driver.t() != end {
        driver.advance(end)?;
        // Switches by time alone need no further care.
        switched |= (0..driver.system().surfaces()).any(|j| driver.sides()[j] != sides[j]);
        steps += 1;
        if steps > MOST_STEPS {
            return Err(Failure::TooManySteps { t: driver.t(), limit: MOST_STEPS });
        }
        while ahead < places.len() {
            let since = start + places[ahead] * (end - start) - driver.from();
            if since > driver.size() {
                break;
            }
            met[ahead] = if since < driver.size() { driver.dense(since) } else { *driver.x() };
            ahead += 1;
        }
    }
    Ok((*driver.x(), switched))
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// The law of every film over any number, each from its model's values.
    pub(super) fn laws<S: Scalar>(
        &self,
        point: &Unknowns<D>,
        lifted: &dyn Fn(usize, &[f64]) -> Vec<S>,
    ) -> Vec<Law<F::Built<S>, S>> {
        let mut laws = Vec::with_capacity(point.sets.len());
        for (film, set) in point.sets.iter().enumerate() {
            let values = lifted(film, &set.model);
            laws.push(Law { system: self.family.build_for(film, &values), values });
        }
        laws
    }

    /// The same over plain numbers.
    pub(super) fn plain_laws(&self, point: &Unknowns<D>) -> Vec<Law<F::Built<f64>, f64>> {
        self.laws(point, &|_, values| values.to_vec())
    }

    /// The film, start and end of link `i` in the model's time, where its frames are linked.
    pub(super) fn link(&self, point: &Unknowns<D>, i: usize) -> Option<Span> {
        let film = self.record.film[i];
        let pace = point.sets[film].pace();
        self.record.linked[i].then(|| (film, self.record.t[i] * pace, self.record.t[i + 1] * pace))
    }

    /// The model's operations. Fixed parameters that are zero in all films are left out.
    fn tape(&self, point: &Unknowns<D>) -> Option<Tape<D>> {
        let free = |p: usize| self.free.iter().any(|free| free.role == Role::Model(p));
        let zero = |p: usize| point.sets.iter().all(|set| set.model[p] == 0.0) && !free(p);
        let known: Vec<_> = (0..point.sets[0].model.len()).map(|p| zero(p).then_some(0.0)).collect();
        Tape::record(&self.family, &known).ok()
    }

    /// Calls `one` for every link with its number, its span and the place of its result; `none` for frames that are
    /// not linked. It is kept where `found` was.
    #[allow(clippy::type_complexity, reason = "a name for it would take as many parameters")]
    pub(super) fn each_link<T: Clone + Send + Sync>(
        &self,
        point: &Unknowns<D>,
        laws: &[Law<F::Built<Wide>, Wide>],
        one: &(dyn Fn(&mut TransitionIntegrator<'_, D>, usize, Span, &mut T) -> Result<(), Failure> + Sync),
        none: &T,
        mut found: Vec<T>,
    ) -> Result<Vec<T>, EstimateError> {
        let tape = self.tape(point);
        let series = tape.as_ref().map(|tape| (tape, order(&self.tolerance)));
        let tolerance = self.tolerance.filled::<D>(self.family.idle());
        let new = |film: usize| TransitionIntegrator::new(series, &laws[film], &tolerance);
        found.resize(self.record.linked.len(), none.clone());
        try_in_parts(&mut found, TOGETHER, &|first, part| {
            // The film whose links were followed last, and what followed them.
            let mut last: Option<(usize, TransitionIntegrator<'_, D>)> = None;
            for (j, found) in part.iter_mut().enumerate() {
                let i = first + j;
                let Some(link) = self.link(point, i) else {
                    *found = none.clone();
                    continue;
                };
                let (_, follower) = match last.take() {
                    Some((film, same)) if film == link.0 => last.insert((film, same)),
                    _ => last.insert((link.0, new(link.0))),
                };
                let t = self.record.t[i];
                one(follower, i, link, found).map_err(|source| EstimateError::Integration { t, source })?;
            }
            Ok(())
        })?;
        Ok(found)
    }
}

/// A state whose numbers are differentiated by these of its components, as many as there are directions.
#[inline(always)]
pub(super) fn variable<const D: usize, const N: usize>(x: &[f64; D], by: Range<usize>) -> [Dual<f64, N>; D] {
    let mut all = vector!(Dual<f64, N>, D; k => Dual::constant(x[k]));
    for k in by.start..by.end.min(by.start + N) {
        all[k].d[k - by.start] = 1.0;
    }
    all
}
