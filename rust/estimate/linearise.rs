//! The record linearised around a point: residuals and their derivatives, from duals.

use std::sync::Arc;

use nalgebra::{DMatrix, SMatrix, SVector};

use super::bordered::zeros;
use super::link_propagation::{Law, variable};
use super::link_response::Transition;
use super::parameter_jacobian::{
    FurtherDirections, ParameterJacobian, WIDTH, Wide, acting, camera, clock, columns_of, model, tagged,
};
use super::row_matrix::RowMatrix;
use super::sensor::{Moment, rates, see_late};
use super::{EstimateError, Estimator, FilmParameters, FreeParameter, Sensor, Unknowns};
use crate::analysis::batch::parallel::in_parts;
use crate::model::{Family, System};
use crate::scalar::{InstructionSet, Isa, Scalar, Work, constants, run_with, vector};

/// Frames are looked at by so many at least: each takes about a microsecond.
const TOGETHER: usize = 16;

/// A frame's residual `misfit = seen - h`, and `dh/dx`.
#[derive(Clone, Copy, Debug)]
pub struct ObservationResidual<const D: usize, const M: usize> {
    pub misfit: SVector<f64, M>,
    pub h: SMatrix<f64, M, D>,
}

/// Residuals and derivatives, frame by frame and link by link; the columns are those of parameters.
#[derive(Clone, Debug, Default)]
pub struct Linearisation<const D: usize, const M: usize> {
    pub sights: Vec<ObservationResidual<D, M>>,
    pub flow: Vec<Transition<D>>,
    pub columns: ParameterJacobian,
}

/// A record linearised around a point, shared by all who ask for more there.
#[derive(Clone, Debug)]
pub struct CachedLinearisation<const D: usize, const M: usize> {
    pub point: Arc<Unknowns<D>>,
    pub linear: Arc<Linearisation<D, M>>,
}

impl<const D: usize, const M: usize> Linearisation<D, M> {
    /// The residuals of what was seen.
    pub fn misfits(&self) -> Vec<SVector<f64, M>> {
        let mut all = Vec::with_capacity(self.sights.len());
        for sight in &self.sights {
            all.push(sight.misfit);
        }
        all
    }

    /// The residuals of the links.
    pub fn defects(&self) -> Vec<SVector<f64, D>> {
        let mut all = Vec::with_capacity(self.flow.len());
        for link in &self.flow {
            all.push(link.defect);
        }
        all
    }
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// Linearises the record around a point with respect to the states and to the free parameters.
    pub fn linearise(&self, point: &Unknowns<D>) -> Result<Linearisation<D, M>, EstimateError> {
        let whole = self.linearise_if(point, Linearisation::default(), |_| true)?;
        Ok(whole.unwrap_or_else(|rejected| rejected))
    }

    /// The same, shared. If it is [known](Estimator::known), it is not computed again.
    pub(super) fn around(&self, point: &Unknowns<D>) -> Result<Arc<Linearisation<D, M>>, EstimateError> {
        match &self.known {
            Some(known) if *known.point == *point => Ok(known.linear.clone()),
            _ => self.linearise(point).map(Arc::new),
        }
    }

    /// The same in the memory of another one, because an allocation takes as much time as the work. If the links are not
    /// `accepted`, only the memory is returned: the remainder takes more than half of the time.
    #[allow(clippy::type_complexity, reason = "memory that is returned is no error")]
    pub(super) fn linearise_if(
        &self,
        point: &Unknowns<D>,
        room: Linearisation<D, M>,
        accepted: impl FnOnce(&[Transition<D>]) -> bool,
    ) -> Result<Result<Linearisation<D, M>, Linearisation<D, M>>, EstimateError> {
        let Linearisation { mut sights, flow, columns: ParameterJacobian { mut seen, mut state } } = room;
        let laws = self.own_laws(point);
        let plain = self.plain_laws(point);
        let mut flow = self.flow(point, &laws, &plain, flow)?;
        if !accepted(&flow) {
            return Ok(Err(Linearisation { sights, flow, columns: ParameterJacobian { seen, state } }));
        }
        let timed = self.timed(point, &plain);
        self.own_state_rows(point, &mut flow, &plain, &timed, &mut state)?;
        self.sights(point, &laws, &timed, &mut sights, &mut seen);
        Ok(Ok(Linearisation { sights, flow, columns: ParameterJacobian { seen, state } }))
    }

    /// The observation of every frame, and its rows of the free parameters.
    fn sights(
        &self,
        point: &Unknowns<D>,
        laws: &[Law<F::Built<Wide>, Wide>],
        timed: &[bool],
        sights: &mut Vec<ObservationResidual<D, M>>,
        seen: &mut RowMatrix,
    ) {
        let (n, p) = (self.record.t.len(), self.free.len());
        seen.become_zeros(n * M, p);
        // All are filled again.
        sights.resize(n, ObservationResidual { misfit: zeros(), h: zeros() });
        let beyond = self.beyond(point);
        let views = views(&point.sets, &self.free, timed);
        let mut slots: Vec<(&mut ObservationResidual<D, M>, &mut [f64])> = Vec::with_capacity(n);
        let mut blocks = seen.blocks_mut(M);
        for sight in sights.iter_mut() {
            slots.push((sight, blocks.next().unwrap_or_default()));
        }
        in_parts(&mut slots, TOGETHER, &|first, part| {
            for (j, (sight, rows)) in part.iter_mut().enumerate() {
                let i = first + j;
                let film = self.record.film[i];
                let (of, law, view) = (self, &laws[film], &views[film]);
                Isa::best().run(Look { of, point, law, view, beyond: &beyond, i, sight, rows });
            }
        });
    }

    /// Observation minus prediction in frame `i`.
    #[inline(always)]
    fn misfit(&self, i: usize, expected: &[f64; M]) -> SVector<f64, M> {
        let mut misfit: SVector<f64, M> = zeros();
        for m in 0..M {
            let difference = self.record.seen[i][m] - expected[m];
            misfit[m] = if self.sensor.is_angle(m) { wrap(difference) } else { difference };
        }
        misfit
    }
}

/// A film's camera.
struct View {
    plain: Vec<Wide>,
    /// The columns of the model's free parameters.
    model: Vec<usize>,
    /// The camera differentiated by its free parameters, some at a time, with their columns.
    tagged: Vec<(Vec<Wide>, Vec<usize>)>,
    /// The column of a free clock that moves a law that knows the time.
    clock: Vec<usize>,
}

fn views(sets: &[FilmParameters], free: &[FreeParameter], timed: &[bool]) -> Vec<View> {
    let one = |(film, set): (usize, &FilmParameters)| {
        let tagged = |own: &[_]| (tagged(&set.camera, own, 0), columns_of(own));
        View {
            plain: constants(&set.camera),
            model: columns_of(&acting(free, film, model)),
            tagged: acting(free, film, camera).chunks(WIDTH).map(tagged).collect(),
            clock: if timed[film] { columns_of(&acting(free, film, clock)) } else { Vec::new() },
        }
    };
    sets.iter().enumerate().map(one).collect()
}

/// One frame's share of a linearisation.
struct Look<'a, F: Family<D>, C: Sensor<D, M>, const D: usize, const M: usize> {
    of: &'a Estimator<F, C, D, M>,
    point: &'a Unknowns<D>,
    law: &'a Law<F::Built<Wide>, Wide>,
    view: &'a View,
    beyond: &'a [FurtherDirections<F::Built<Wide>>],
    i: usize,
    sight: &'a mut ObservationResidual<D, M>,
    rows: &'a mut [f64],
}

impl<F: Family<D>, C: Sensor<D, M>, const D: usize, const M: usize> Work for Look<'_, F, C, D, M> {
    type Output = ();

    #[inline(always)]
    fn run<V: InstructionSet>(self) {
        let Self { of: Estimator { sensor, record, .. }, point, law, view, i, sight, rows, .. } = self;
        let (film, p, live) = (record.film[i], rows.len() / M, self.of.live());
        let (state, t) = (&point.states[i], record.t[i] * point.sets[film].pace());
        let (x, t): ([Wide; D], Wide) = (variable(state, 0..live), Wide::constant(t));
        let rate = rates(&law.system, t, &x);
        // The parameters of the model are seen through the rate, by a camera that looks at it, or by formulas.
        let at = Moment { t, x: &x, rate: &rate, parameters: &law.values };
        let expected = see::<V, _, _, D, M>(sensor, Some(&law.system), &view.plain, &at);
        fill(rows, p, &expected, live, &view.model);
        sight.misfit = self.of.misfit(i, &vector!(f64, M; m => expected[m].re));
        for m in 0..M {
            for k in 0..live.min(WIDTH) {
                sight.h[(m, k)] = expected[m].d[k];
            }
        }
        let x = vector!(Wide, D; k => Wide::constant(state[k]));
        let rate = vector!(Wide, D; k => Wide::constant(rate[k].re));
        let at = Moment { t, x: &x, rate: &rate, parameters: &law.values };
        for (camera, columns) in &view.tagged {
            let expected = see::<V, _, F::Built<Wide>, D, M>(sensor, None, camera, &at);
            fill(rows, p, &expected, 0, columns);
        }
        if !view.clock.is_empty() {
            // The model's time is (1 + c) times the record's, c the clock's value.
            let mut clocked = t;
            clocked.d[0] = record.t[i];
            let rate = rates(&law.system, clocked, &x);
            let at = Moment { t: clocked, rate: &rate, ..at };
            let expected = see::<V, _, _, D, M>(sensor, Some(&law.system), &view.plain, &at);
            fill(rows, p, &expected, 0, &view.clock);
        }
        for FurtherDirections { first, columns, laws } in self.beyond {
            let (law, x): (_, [Wide; D]) = (&laws[film], variable(state, *first..live));
            let rate = rates(&law.system, t, &x);
            let at = Moment { t, x: &x, rate: &rate, parameters: &law.values };
            let expected = see::<V, _, _, D, M>(sensor, Some(&law.system), &view.plain, &at);
            for m in 0..M {
                for k in *first..live.min(first + WIDTH) {
                    sight.h[(m, k)] = expected[m].d[k - first];
                }
            }
            fill(rows, p, &expected, live.saturating_sub(*first), &columns[film]);
        }
    }
}

/// The observation by a sensor with these instructions, with delays if the law is given. It is a separate function
/// because it is long.
#[inline(always)]
fn see<V: InstructionSet, C: Sensor<D, M>, B: System<Wide, D>, const D: usize, const M: usize>(
    sensor: &C,
    law: Option<&B>,
    camera: &[Wide],
    at: &Moment<'_, Wide, D>,
) -> [Wide; M] {
    run_with::<V, _>(See::<C, B, D, M> { sensor, law, camera, at })
}

struct See<'a, C, B, const D: usize, const M: usize> {
    sensor: &'a C,
    law: Option<&'a B>,
    camera: &'a [Wide],
    at: &'a Moment<'a, Wide, D>,
}

impl<C: Sensor<D, M>, B: System<Wide, D>, const D: usize, const M: usize> Work for See<'_, C, B, D, M> {
    type Output = [Wide; M];

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> [Wide; M] {
        let Self { sensor, law, camera, at } = self;
        let mut all = sensor.observe(camera, at);
        if let Some(law) = law {
            see_late(sensor, law, camera, at, &mut all);
        }
        all
    }
}

/// Takes the derivatives from direction `first` on over to the columns of `p`.
#[inline(always)]
fn fill<const M: usize>(rows: &mut [f64], p: usize, seen: &[Wide; M], first: usize, columns: &[usize]) {
    for m in 0..M {
        // Parameters without room next to the state have their rows elsewhere.
        for k in 0..columns.len().min(WIDTH.saturating_sub(first)) {
            rows[m * p + columns[k]] = seen[m].d[first + k];
        }
    }
}

/// The angle modulo a turn, nearest to zero.
#[inline(always)]
fn wrap(angle: f64) -> f64 {
    angle - (angle / std::f64::consts::TAU).round() * std::f64::consts::TAU
}

/// The covariance that belongs to a symmetric matrix of information; none where it is singular.
pub(super) fn invert(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    // Scaled to a unit diagonal, so that units do not decide what counts as singular.
    let n = information.nrows();
    if n == 0 {
        return Some(DMatrix::zeros(0, 0));
    }
    let scale: Vec<f64> = (0..n).map(|j| information[(j, j)].max(f64::MIN_POSITIVE).sqrt().recip()).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| information[(i, j)] * scale[i] * scale[j]);
    let inverse = nalgebra::Cholesky::new(scaled)?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
