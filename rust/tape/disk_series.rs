//! The series of the disk without effects, written out.
//!
//! ```text
//! I dOmega/dT = g Y - (a + b Omega) Omega - W Z Omega      dY/dT = Z Omega      dZ/dT = W - Y Omega
//! ```
//!
//! with `a = k1`, `b = -+k2` on the slow branch of the friction law, `a = k0`, `b = 0` on its floor. The motion turns
//! `(Y, Z)` and moves it along Z, so that `dI/dT = 2 W Z`. This leaves four products, all with Omega: of Omega, Y, Z
//! and the integral of Z.

use super::jet::{HIGH, LOW};
use super::node::INVERSE;
use super::series::{Coefficient, inner, orders};
use super::specialised::Held;
use crate::model::Sides;
use crate::scalar::{InstructionSet, Isa, Packet, Real, Scalar};
use crate::unroll::unroll;

/// The surfaces of the model: `Omega = 0`, and the friction law's kink.
const REVERSAL: usize = 0;
const KINK: usize = 1;

/// Slots: the components, then the integral of Z.
const SLOTS: usize = 5;

/// The coefficients of the solution up to this order, for the tape's held values.
#[inline(always)]
pub(super) fn expand<V: InstructionSet, S: Scalar, const D: usize, const N: usize>(
    work: &mut [[S; N]],
    order: usize,
    held: (&[S], &Held),
    x: &[S; D],
    sides: &Sides<S>,
) {
    let work: &mut [[S; N]; SLOTS] = work.first_chunk_mut().expect("slots for more operations than these");
    unroll!(n in 0..D => { work[n][0] = x[n]; });
    let start = Start::of(Law::of(held, sides), [x[0], x[1], x[2]]);
    if const { N == HIGH + 1 && size_of::<S>() == size_of::<f64>() && !matches!(V::ISA, Isa::Baseline) } {
        match order {
            LOW => return unrolled::<V, S, N, LOW>(&start, work),
            HIGH => return unrolled::<V, S, N, HIGH>(&start, work),
            _ => {}
        }
    }
    for k in 0..order.min(N - 1) {
        // One sum after the other: numbers of several lanes or derivatives fill the registers.
        let [omega, y, z, _, integral] = &*work;
        let sums =
            [inner(omega, omega, k), inner(omega, y, k), inner(omega, z, k), inner(omega, integral, k)];
        let last = [omega[k], y[k], z[k]];
        let (next, integral) = start.next(k, last, sums);
        work[4][k] = integral;
        unroll!(n in 0..4 => { work[n][k + 1] = next[n]; });
    }
}

/// The series of a single trajectory, unrolled up to the order `TO`.
#[inline(always)]
fn unrolled<V: InstructionSet, S: Scalar, const N: usize, const TO: usize>(
    start: &Start<S>,
    work: &mut [[S; N]; SLOTS],
) {
    let mut series = Series { last: start.x, omega: [0.0; N], factors: [Lanes::<V>::nothing(); N] };
    orders!(k below TO => { series.step(start, work, k); });
}

/// The series of a single trajectory, whose sums are computed side by side.
struct Series<S, V, const N: usize> {
    last: [S; 3],
    omega: [f64; N],
    /// Omega, Y, Z and the integral of Z.
    factors: [Lanes<V>; N],
}

impl<S: Scalar, V: InstructionSet, const N: usize> Series<S, V, N> {
    #[inline(always)]
    fn step(&mut self, start: &Start<S>, work: &mut [[S; N]; SLOTS], k: usize) {
        let sums = inner(&self.omega, &self.factors, k).0;
        let sum = |i: usize| S::constant(sums.lane(i));
        let (next, integral) = start.next(k, self.last, [sum(0), sum(1), sum(2), sum(3)]);
        let real = |value: S| value.real().lane(0);
        let [omega, y, z] = self.last;
        self.omega[k] = real(omega);
        self.factors[k] = Lanes(Packet::new([real(omega), real(y), real(z), real(integral)]));
        self.last = [next[0], next[1], next[2]];
        unroll!(n in 0..4 => { work[n][k + 1] = next[n]; });
    }
}

/// The lanes of one register.
#[derive(Clone, Copy)]
struct Lanes<V>(Packet<4, V>);

impl<V: InstructionSet> Coefficient<f64> for Lanes<V> {
    #[inline(always)]
    fn nothing() -> Self {
        Self(Packet::constant(-0.0))
    }
    #[inline(always)]
    fn with(self, a: f64, b: Self) -> Self {
        Self(self.0.fused(Packet::constant(a), b.0))
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

/// The law between two switches of the friction.
#[derive(Clone, Copy)]
struct Law<S> {
    g: S,
    w: S,
    /// The friction's coefficient, `a + b Omega`.
    a: S,
    b: S,
    /// `R^2/2`.
    inertia: S,
}

impl<S: Scalar> Law<S> {
    /// From the held values of the [tape](super::specialised).
    #[inline(always)]
    fn of((held, at): (&[S], &Held), sides: &Sides<S>) -> Self {
        let of = |place: usize| held[usize::from(at[place])];
        let (k0, k1, k2) = (of(3), of(1), of(2));
        let fall = S::select(sides[REVERSAL], -k2, k2);
        Self {
            g: of(0),
            w: of(4),
            a: S::select(sides[KINK], k1, k0),
            b: S::select(sides[KINK], fall, S::zero()),
            inertia: of(8),
        }
    }
}

/// The start of a series.
struct Start<S> {
    law: Law<S>,
    /// Omega, Y and Z.
    x: [S; 3],
    /// `1 / I`
    inverse: S,
}

impl<S: Scalar> Start<S> {
    #[inline(always)]
    fn of(law: Law<S>, x: [S; 3]) -> Self {
        let [_, y, z] = x;
        Self { law, x, inverse: S::one() / (law.inertia + y.square() + z.square()) }
    }

    /// The coefficients `k + 1` of Omega, Y, Z and beta, and the coefficient of Z's integral. They follow from the
    /// last coefficients of Omega, Y and Z, and from the sums over their products with Omega and with the integral.
    /// The sums leave out the terms with coefficients of order 0.
    ///
    /// A single trajectory waits for the coefficient of the last step. It enters last, so that the sums are
    /// computed meanwhile.
    #[inline(always)]
    fn next(&self, k: usize, [omega, y, z]: [S; 3], [square, along, across, swept]: [S; 4]) -> ([S; 4], S) {
        let Law { g, w, a, b, .. } = self.law;
        let [omega0, y0, z0] = self.x;
        let (lever, part) = (w * z0, INVERSE[k + 1]);
        let (torque, lateral, vertical);
        if k == 0 {
            torque = g * y - (a + b * omega + lever) * omega;
            (lateral, vertical) = (z * omega, w - y * omega);
        } else {
            // I dOmega/dT also contains the sum of 2 W i Omega_i Z_m/(m + 1) over i + m = k, with
            // i = (k + 1) - (m + 1).
            let reaction = (w + w) * swept.scale((k + 1) as f64);
            let slope = a + (b + b) * omega0 + lever.scale((2 * k + 1) as f64);
            torque =
                (w * across - b * square - reaction).fused(g, y).fused(-(w * omega0), z).fused(-slope, omega);
            lateral = across.fused(omega0, z).fused(z0, omega);
            vertical = -along.fused(omega0, y).fused(y0, omega);
        }
        let rate = torque * self.inverse.scale(part);
        ([rate, lateral.scale(part), vertical.scale(part), omega.scale(part)], z.scale(part))
    }
}
