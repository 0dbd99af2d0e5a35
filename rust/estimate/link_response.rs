//! The model's flow from each frame to the next, and how it responds to what is added on the way.

use std::ops::Range;

use nalgebra::{SMatrix, SVector};

use super::bordered::zeros;
use super::link_propagation::{Law, Span, TransitionIntegrator, TransitionRun, variable};
use super::parameter_jacobian::{WIDTH, Wide, rates_of};
use super::{EstimateError, Estimator, Sensor, Unknowns};
use crate::inverse::invert;
use crate::model::Family;
use crate::scalar::vector;

/// Places within a link, as parts of its time, and their weights (Gauss-Legendre).
const PLACES: [f64; PLACES_PER_LINK] = [0.112_701_665_379_258_31, 0.5, 0.887_298_334_620_741_7];
const WEIGHTS: [f64; PLACES_PER_LINK] = [5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0];
/// How many of them there are.
pub const PLACES_PER_LINK: usize = 3;

/// A place within a link, and what acts there.
#[derive(Clone, Copy, Debug)]
pub struct QuadraturePoint<const D: usize> {
    /// In the model's time, since the frame before and in all.
    pub since: f64,
    pub t: f64,
    pub state: [f64; D],
    /// Column `m` is what a unit forcing of equation `m` here adds to the state at the link's end, the
    /// place's share of the link's time included. A forcing `f(x, t)` adds the sum of `response f` over
    /// the places: an integral by Gauss' rule.
    pub response: SMatrix<f64, D, D>,
}

/// The forcing of a link.
#[derive(Clone, Copy, Debug)]
pub struct QuadraturePoints<const D: usize> {
    /// Whether the law switched on the way: derivatives by its parameters then jump between the places.
    pub switched: bool,
    pub places: [QuadraturePoint<D>; PLACES_PER_LINK],
}

/// The flow of a frame's state to the next frame.
#[derive(Clone, Debug)]
pub struct Transition<const D: usize> {
    /// The next frame's state less what the model makes of this one.
    pub defect: SVector<f64, D>,
    /// The derivatives of what the model makes: by this frame's state, then by those of the model's free
    /// parameters that find room.
    pub slopes: [[f64; WIDTH]; D],
    /// The derivatives by those components of this frame's state that have no room there, one after the other; those
    /// by padding components are zero.
    pub further: Vec<[f64; D]>,
    /// The rate at the end.
    pub end_rate: SVector<f64, D>,
}

impl<const D: usize> Transition<D> {
    /// The derivative of component `m` by component `k` of this frame's state.
    #[inline(always)]
    pub fn slope(&self, m: usize, k: usize) -> f64 {
        if D <= WIDTH || k < WIDTH { self.slopes[m][k] } else { self.further[k - WIDTH][m] }
    }

    /// The derivative by this frame's state.
    #[inline(always)]
    pub fn a(&self) -> SMatrix<f64, D, D> {
        SMatrix::from_fn(|m, k| self.slope(m, k))
    }
}

impl<F, C, const D: usize, const M: usize> Estimator<F, C, D, M>
where
    F: Family<D>,
    C: Sensor<D, M>,
{
    /// Every link, kept where `room` was; those of frames that are not linked are all zero. This leaves out the
    /// [further](Transition::further) derivatives.
    pub(super) fn flow(
        &self,
        point: &Unknowns<D>,
        laws: &[Law<F::Built<Wide>, Wide>],
        plain: &[Law<F::Built<f64>, f64>],
        room: Vec<Transition<D>>,
    ) -> Result<Vec<Transition<D>>, EstimateError> {
        let (zero, live) = (zeros(), self.live());
        let none = Transition {
            defect: zero,
            slopes: [[0.0; WIDTH]; D],
            further: vec![[0.0; D]; D.saturating_sub(WIDTH)],
            end_rate: zero,
        };
        let one = |follower: &mut TransitionIntegrator<'_, D>,
                   i: usize,
                   (film, start, end): Span,
                   link: &mut Transition<D>| {
            let x = variable(&point.states[i], 0..live);
            let (last, _) = follower.follow(TransitionRun { start, end, x, places: &[], met: &mut [] })?;
            let (system, there) = (&plain[film].system, vector!(f64, D; k => last[k].re));
            let end_rate = rates_of(system, end, &there);
            for k in 0..D {
                link.defect[k] = point.states[i + 1][k] - there[k];
                link.slopes[k] = last[k].d;
                link.end_rate[k] = end_rate[k];
            }
            Ok(())
        };
        self.each_link(point, laws, &one, &none, room)
    }

    /// The forcing of every link; zero if frames are not linked.
    pub fn places(&self, point: &Unknowns<D>) -> Result<Vec<QuadraturePoints<D>>, EstimateError> {
        let (laws, live) = (self.own_laws(point), self.live());
        let place = QuadraturePoint { since: 0.0, t: 0.0, state: [0.0; D], response: zeros() };
        let none = QuadraturePoints { switched: false, places: [place; PLACES_PER_LINK] };
        let one = |follower: &mut TransitionIntegrator<'_, D>,
                   i: usize,
                   (_, start, end): Span,
                   found: &mut QuadraturePoints<D>| {
            let mut a = SMatrix::<f64, D, D>::identity();
            let (mut here, mut states) = ([a; PLACES_PER_LINK], [[0.0; D]; PLACES_PER_LINK]);
            for first in (0..live).step_by(WIDTH) {
                let x: [Wide; D] = variable(&point.states[i], first..live);
                let mut met = [x; PLACES_PER_LINK];
                let (last, switched) =
                    follower.follow(TransitionRun { start, end, x, places: &PLACES, met: &mut met })?;
                found.switched = switched;
                by_state(&last, first..live, &mut a);
                for q in 0..PLACES_PER_LINK {
                    by_state(&met[q], first..live, &mut here[q]);
                    states[q] = vector!(f64, D; k => met[q][k].re);
                }
            }
            for q in 0..PLACES_PER_LINK {
                let since = PLACES[q] * (end - start);
                // From here to the end: all the way, less the way up to here.
                if !invert(here[q].as_mut_slice(), D) {
                    here[q].fill(0.0);
                }
                let response = a * here[q] * (WEIGHTS[q] * (end - start));
                found.places[q] = QuadraturePoint { since, t: start + since, state: states[q], response };
            }
            Ok(())
        };
        self.each_link(point, &laws, &one, &none, Vec::new())
    }
}

/// The derivatives of a state by these components of the one it started from, as many as there are directions.
fn by_state<const D: usize>(x: &[Wide; D], by: Range<usize>, matrix: &mut SMatrix<f64, D, D>) {
    for m in 0..D {
        for k in by.start..by.end.min(by.start + WIDTH) {
            matrix[(m, k)] = x[m].d[k - by.start];
        }
    }
}
