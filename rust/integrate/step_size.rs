//! The size of the steps.

use crate::model::{StepStart, System};
use crate::scalar::elementary::{exp2_rough, log2_rough};
use crate::scalar::{Mask, Real, Scalar, vector};
use crate::tolerance::Tolerance;

/// Safety factor, and the narrowest and widest change of the step size.
const SAFETY: f64 = 0.9;
const SHRINK: f64 = 0.2;
const GROW: f64 = 10.0;
/// The integral part's share (Gustafsson's stabilisation).
const BETA: f64 = 0.04;
/// Errors below this count as this.
const LEAST: f64 = 1e-4;

/// PI control (Hairer, Nørsett & Wanner, Solving ODEs I, II.4 and II.5), lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct PiController<R: Real> {
    /// The proportional exponent.
    alpha: f64,
    /// Binary logarithm, a rough one, of the error norm of the last accepted step.
    previous: R,
    /// True if the last trial was rejected; the step does not grow right after.
    rejected: R::Mask,
}

impl<R: Real> PiController<R> {
    /// For a method of this order.
    pub fn new(order: i32) -> Self {
        let alpha = 1.0 / f64::from(order) - 0.75 * BETA;
        Self { alpha, previous: R::constant(LEAST.log2()), rejected: R::mask(false) }
    }

    /// Forgets what was, in these lanes.
    pub fn reset(&mut self, lanes: R::Mask) {
        self.previous = R::select(lanes, R::constant(LEAST.log2()), self.previous);
        self.rejected = self.rejected.and(lanes.not());
    }

    /// The lanes in which a step with this error norm is accepted, and the factor for the next step size; only
    /// `lanes` are remembered.
    #[inline(always)]
    pub fn judge(&mut self, error: R, lanes: R::Mask) -> (R::Mask, R) {
        let finite = error.finite();
        let accepted = finite.and(R::one().less(error).not());
        let log = log2_rough(error.max(R::constant(1e-200)));
        let integral = R::select(accepted, self.previous.scale(BETA), R::zero());
        let factor = exp2_rough(integral - log.scale(self.alpha)).scale(SAFETY);
        let factor = factor.max(R::constant(SHRINK)).min(R::constant(GROW));
        let capped = R::select(self.rejected, factor.min(R::one()), factor);
        let factor = R::select(finite, R::select(accepted, capped, factor), R::constant(0.1));
        let kept = R::select(accepted, log.max(R::constant(LEAST.log2())), self.previous);
        self.previous = R::select(lanes, kept, self.previous);
        self.rejected = lanes.and(accepted.not()).or(lanes.not().and(self.rejected));
        (accepted, factor)
    }
}

/// A first step size (Hairer's algorithm, II.4), positive; two evaluations of the rates.
#[inline(always)]
pub fn initial_step<S: Scalar, const D: usize>(
    system: &impl System<S, D>,
    at: &StepStart<S, D>,
    order: i32,
    tolerance: &Tolerance,
) -> S::Real {
    let rate = system.rates(S::lift(at.t), &at.x, &at.sides);
    let start = vector!(S::Real, D; n => at.x[n].real());
    let slope = vector!(S::Real, D; n => rate[n].real());
    let (h0, speed) = euler_step(&start, &slope, tolerance);

    let moved = vector!(S, D; n => at.x[n] + rate[n].times(h0));
    let later = system.rates(S::lift(at.t + h0), &moved, &at.sides);
    let turned = vector!(S::Real, D; n => later[n].real() - slope[n]);
    curved_step(&start, &turned, (h0, speed), order, tolerance)
}

/// The size of an explicit Euler step that changes the state little, and the norm of its rate.
#[inline(always)]
fn euler_step<R: Real, const D: usize>(x: &[R; D], rate: &[R; D], tolerance: &Tolerance) -> (R, R) {
    let (size, speed) = (tolerance.norm(*x, *x, *x), tolerance.norm(*rate, *x, *x));
    let small = size.less(R::constant(1e-5)).or(speed.less(R::constant(1e-5)));
    (R::select(small, R::constant(1e-6), size.scale(0.01) / speed), speed)
}

/// The size of a step of this order whose curvature is known from the change of the rate over the first one.
#[inline(always)]
fn curved_step<R: Real, const D: usize>(
    x: &[R; D],
    change: &[R; D],
    (h0, speed): (R, R),
    order: i32,
    tolerance: &Tolerance,
) -> R {
    let constant = R::constant;
    let bend = tolerance.norm(*change, *x, *x) / h0;
    let steepest = speed.max(bend);
    let flat = constant(1e-15).less(steepest).not();
    let curved = ((constant(0.01) / steepest).ln().scale(1.0 / f64::from(order))).exp();
    let h1 = R::select(flat, h0.scale(1e-3).max(constant(1e-6)), curved);
    let h = h1.min(h0.scale(100.0));
    // If the rate is infinite, or nearly so, it is no step.
    R::select(h.finite().and(R::zero().less(h)), h, constant(1e-6))
}
