//! Tangents through a switch where the law jumps.

use crate::model::{Sides, System};
use crate::scalar::{Mask, Real, Scalar, vector};

/// A surface's rate of change is a central difference over this time; exact where the surface is linear.
const AHEAD: f64 = 1e-6;
/// A flow that arrives slower than this part of its speed a step before grazes the surface: landing to 1e-13
/// then leaves that speed, and with it the derivatives, uncertain by 1e-3.
const GRAZE: f64 = 1e-5;

/// Passes surface `j` in the lanes `here`, on which they landed with a step of size `size`, and corrects the
/// derivatives for the time at which a neighbour passes it. Returns the lanes where the flow grazes
/// the surface: a neighbour may not pass it at all, and the derivatives are left as they are.
///
/// A neighbour at `x + d` meets the surface `g = 0` later by `delay = -(g.d)/(dg/dt)`. Until then it moves
/// with the rate `f-` instead of `f+`, so its distance becomes `R(d + f- delay) - f+ delay`, where `R` is
/// the derivative of the switch's own map of the state. If the switch does not change the state,
/// this is the saltation matrix `1 + (f+ - f-) n^T/(n^T f-)` (Leine & Nijmeijer, Dynamics and Bifurcations
/// of Non-Smooth Mechanical Systems, 2004, ch. 7); `g` may depend on time and on parameters too.
///
/// The state's values are those of [`System::switch`], to the last bit.
#[inline(never)]
pub fn pass<S: Scalar, const D: usize>(
    system: &impl System<S, D>,
    j: usize,
    t: S::Real,
    size: S::Real,
    x: &mut [S; D],
    sides: &mut Sides<S>,
    here: S::Mask,
) -> S::Mask {
    let time = S::lift(t);
    if !system.jumps(j) {
        system.switch(j, time, x, sides, here);
        return S::mask(false);
    }
    let (old, before) = (*x, *sides);
    let slope = |t: S::Real, x: &[S; D], rate: &[S; D]| {
        let at = |by: f64| {
            let moved = vector!(S, D; n => x[n] + rate[n].scale(by));
            system.surface(j, S::lift(t + S::Real::constant(by)), &moved, &before).real()
        };
        (at(AHEAD) - at(-AHEAD)).scale(0.5 / AHEAD)
    };
    let rate = system.rates(time, &old, &before);
    let earlier = vector!(S, D; n => old[n] - rate[n].times(size));
    let rate_earlier = system.rates(S::lift(t - size), &earlier, &before);
    let speed = slope(t, &old, &rate);
    let usual = slope(t - size, &earlier, &rate_earlier);
    let clear = usual.abs().scale(GRAZE).less(speed.abs());

    // A number whose value is zero: only its derivatives count.
    let value = system.surface(j, time, &old, &before);
    let delay = (S::lift(value.real()) - value).times(S::Real::one() / speed);
    let delay = S::select(here.and(clear), delay, S::zero());
    let mut meeting = vector!(S, D; n => old[n] + rate[n] * delay);
    system.switch(j, time, &mut meeting, sides, here);
    let after = system.rates(time, &meeting, sides);
    *x = vector!(S, D; n => S::select(here, meeting[n] - after[n] * delay, old[n]));
    here.and(clear.not())
}
