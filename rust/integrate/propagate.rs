//! From one time to another, nothing kept on the way.

use super::cancel;
use super::integrator::Integrator;
use crate::failure::Failure;
use crate::model::{AnySystem, System};
use crate::scalar::Scalar;
use crate::tolerance::Tolerance;

/// More steps than this within one propagation mean that something is wrong.
const MOST_STEPS: u64 = 1_000_000;
/// After each so many steps the run asks whether its result is still wanted.
const LOOK_EVERY: u64 = 64;

/// The state at `t1` of the run that starts with `x0` at `t0`; `t1` may lie before `t0`.
///
/// The run lands on switching surfaces and ignores the wall. Over duals it gives the derivatives of
/// the final state exactly as the same sequence of steps does; step sizes follow the error of the state
/// alone (see [`Tolerance`]). The first trial step is the whole interval.
///
/// ```
/// use udd::integrate::{Tolerance, propagate};
/// use udd::model::Dle;
/// use udd::scalar::Dual;
/// // The state after a time of 1, and its derivative with respect to the drive w.
/// let dle = Dle { w: Dual::<f64, 1>::variable(1.0, 0), b: Dual::fixed(0.0) };
/// let x = propagate(&dle, 0.0, 1.0, [1.0, 1.0, 0.01].map(Dual::fixed), &Tolerance::default())?;
/// assert!(x[2].d[0] > 0.0);
/// # Ok::<(), udd::integrate::Failure>(())
/// ```
pub fn propagate<S, const D: usize>(
    system: &impl System<S, D>,
    t0: f64,
    t1: f64,
    x0: [S; D],
    tolerance: &Tolerance,
) -> Result<[S; D], Failure>
where
    S: Scalar<Real = f64, Mask = bool>,
{
    if t0 == t1 {
        return Ok(x0);
    }
    // Its type is forgotten: one function for each kind of number.
    let mut integrator: Integrator<&dyn AnySystem<S, D>, S, D> =
        Integrator::new(system, t0, x0, Some(t1 - t0), tolerance);
    while integrator.t() != t1 {
        integrator.advance(t1)?;
        if integrator.counts().accepted.is_multiple_of(LOOK_EVERY) {
            cancel::look();
        }
        if integrator.counts().accepted > MOST_STEPS {
            return Err(Failure::TooManySteps { t: integrator.t(), limit: MOST_STEPS });
        }
    }
    Ok(*integrator.x())
}
