//! The size of the steps.

use std::array::from_fn;

use super::tableau::DORMAND_PRINCE as METHOD;
use super::tolerance::Tolerance;
use crate::model::{Sides, System};
use crate::scalar::Scalar;

/// Safety factor, and the narrowest and widest change of the step size.
const SAFETY: f64 = 0.9;
const SHRINK: f64 = 0.2;
const GROW: f64 = 10.0;
/// The integral part's share (Gustafsson's stabilisation) and the proportional exponent.
const BETA: f64 = 0.04;
const ALPHA: f64 = 1.0 / 5.0 - 0.75 * BETA;

/// PI control (Hairer, Nørsett & Wanner, Solving ODEs I, II.4 and II.5).
#[derive(Clone, Copy, Debug)]
pub struct Controller {
    /// The error norm of the last accepted step.
    previous: f64,
    /// Whether the last trial was rejected; the step does not grow right after.
    rejected: bool,
}

impl Default for Controller {
    fn default() -> Self {
        Self { previous: 1e-4, rejected: false }
    }
}

impl Controller {
    /// Whether a step with this error norm is accepted, and the factor for the next step size.
    #[inline]
    pub fn judge(&mut self, error: f64) -> (bool, f64) {
        if !error.is_finite() {
            self.rejected = true;
            return (false, 0.1);
        }
        let proportional = error.powf(ALPHA);
        if error > 1.0 {
            self.rejected = true;
            return (false, (SAFETY / proportional).max(SHRINK));
        }
        let mut factor = GROW;
        if error > 0.0 {
            factor = (SAFETY * self.previous.powf(BETA) / proportional).clamp(SHRINK, GROW);
        }
        if self.rejected {
            factor = factor.min(1.0);
        }
        self.previous = error.max(1e-4);
        self.rejected = false;
        (true, factor)
    }
}

/// A first step size (Hairer's algorithm, II.4), positive; one evaluation of the rates.
pub fn initial_step<S: Scalar<Real = f64>, const D: usize>(
    system: &impl System<S, D>,
    (t, x, rate): (f64, &[S; D], &[S; D]),
    direction: f64,
    sides: &Sides<S>,
    tolerance: &Tolerance,
) -> f64 {
    let real = |v: &[S; D]| from_fn::<f64, D, _>(|n| v[n].real());
    let (x_real, f_real) = (real(x), real(rate));
    let norm = |v: [f64; D]| tolerance.norm(v, x_real, x_real);
    let (size, speed) = (norm(x_real), norm(f_real));
    let h0 = if size < 1e-5 || speed < 1e-5 { 1e-6 } else { 0.01 * size / speed };

    let moved = from_fn(|n| x[n] + rate[n].scale(direction * h0));
    let later = real(&system.rates(S::lift(t + direction * h0), &moved, sides));
    let bend = norm(from_fn(|n| later[n] - f_real[n])) / h0;
    let steepest = speed.max(bend);
    let h1 = if steepest <= 1e-15 {
        (h0 * 1e-3).max(1e-6)
    } else {
        (0.01 / steepest).powf(1.0 / f64::from(METHOD.order))
    };
    let h = h1.min(100.0 * h0);
    if h.is_finite() { h } else { 1e-6 }
}
