//! The series of the diffusionless Lorenz equations, written out.
//!
//! ```text
//! omega' = y - omega      y' = omega z      z' = w - omega y - B w z
//! ```
//!
//! Since `y = omega + omega'`, the last one is `(z + omega^2/2)' = w - omega^2 - B w z`: of the two products one is
//! a square, at half the cost.

use super::jet::{HIGH, LOW};
use super::node::INVERSE;
use super::series::{Number, half_square, inner, orders};
use crate::scalar::{DerivativeLanes, InstructionSet, Isa, LANES, Packet, Real, Scalar, Spread};
use crate::unroll::unroll;

/// The coefficients of the solution up to this order, for the drive `w` and, with damping, `B w`.
#[inline(always)]
pub(super) fn expand<V: InstructionSet, S: Scalar, const D: usize, const N: usize>(
    work: &mut [[S; N]],
    order: usize,
    (w, damping): (S, Option<S>),
    x: &[S; D],
) {
    let work: &mut [[S; N]; 3] = work.first_chunk_mut().expect("a slot for each component");
    let x = [x[0], x[1], x[2]];
    if damping.is_some() {
        return rolled(&mut Series::of(work, x, w, damping), order);
    }
    if const { N == HIGH + 1 && !matches!(V::ISA, Isa::Baseline) } {
        let value = |x: S| x.real().lane(0);
        if const { 1 < S::DERIVATIVES && S::DERIVATIVES <= 3 } {
            let fan = |x: S| {
                DerivativeLanes::<V>::new(value(x), [x.derivative(0), x.derivative(1), x.derivative(2)])
            };
            let back = |c: DerivativeLanes<V>| S::with_derivatives(c.number(), |i| c.derivative(i));
            if aside(work, order, (w, x), fan, back) {
                return;
            }
        }
        if const { S::DERIVATIVES == 4 } {
            let spread = |x: S| Spread::<V> {
                re: Packet::constant(value(x)),
                d: [Packet::from_lanes(|i| x.derivative(i))],
            };
            let back = |c: Spread<V>| S::with_derivatives(c.re.lane(0), |i| c.d[0].lane(i));
            if aside(work, order, (w, x), spread, back) {
                return;
            }
        }
    }
    if const { worthwhile::<S, N>() && !V::ISA.is_rare() } && matches!(order, LOW | HIGH) {
        if const { doubled::<S>() } {
            return by_register(work, order, (w, x));
        }
        let series = &mut Series::of(work, x, w, None);
        return match order {
            LOW => unrolled::<_, N, LOW>(series, |_, _, _| {}),
            _ => unrolled::<_, N, HIGH>(series, |_, _, _| {}),
        };
    }
    rolled(&mut Series::of(work, x, w, None), order);
}

/// A step of two registers for each part, whose end waits less, but a series that fits into the registers.
#[inline(always)]
fn by_register<S: Scalar, const N: usize>(work: &mut [[S; N]; 3], order: usize, (w, x): (S, [S; 3])) {
    for i in 0..S::Real::LANES / LANES {
        let part = |x: S| x.register(i);
        let keep = |n: usize, k: usize, c: S::Register| work[n][k].set_register(i, c);
        let mut room = [[<S::Register as Number>::zero(); N]; 3];
        let series = &mut Series::of(&mut room, x.map(part), part(w), None);
        match order {
            LOW => unrolled::<_, N, LOW>(series, keep),
            _ => unrolled::<_, N, HIGH>(series, keep),
        }
    }
}

/// The series over other numbers, made of these and turned back; false for an order that is not unrolled.
#[inline(always)]
fn aside<S: Scalar, T: Number, const N: usize>(
    work: &mut [[S; N]; 3],
    order: usize,
    (w, x): (S, [S; 3]),
    turn: impl Fn(S) -> T,
    back: impl Fn(T) -> S,
) -> bool {
    let mut room = [[T::zero(); N]; 3];
    let series = &mut Series::of(&mut room, [turn(x[0]), turn(x[1]), turn(x[2])], turn(w), None);
    let keep = |n: usize, k: usize, c: T| work[n][k] = back(c);
    match order {
        LOW => unrolled::<_, N, LOW>(series, keep),
        HIGH => unrolled::<_, N, HIGH>(series, keep),
        _ => return false,
    }
    true
}

/// Returns true if orders are unrolled: not where tangents make every operation long.
const fn worthwhile<S: Scalar, const N: usize>() -> bool {
    N == HIGH + 1 && size_of::<S>() <= 2 * size_of::<S::Real>()
}

/// Returns true if numbers with derivatives fill two registers for each part.
const fn doubled<S: Scalar>() -> bool {
    S::Real::LANES > LANES && size_of::<S>() > size_of::<S::Real>()
}

#[inline(always)]
fn rolled<S: Number, const N: usize>(series: &mut Series<S, N>, order: usize) {
    for k in 0..order.min(N - 1) {
        series.next(k);
    }
}

/// With every order's number known to the compiler, up to the order `TO`; `keep` is given each coefficient.
#[inline(always)]
fn unrolled<S: Number, const N: usize, const TO: usize>(
    series: &mut Series<S, N>,
    mut keep: impl FnMut(usize, usize, S),
) {
    unroll!(n in 0..3 => { keep(n, 0, series.x[n][0]); });
    orders!(k below TO => {
        series.next(k);
        unroll!(n in 0..3 => { keep(n, k + 1, series.x[n][k + 1]); });
    });
}

/// A series as far as it is known.
struct Series<'a, S, const N: usize> {
    /// The coefficients of omega, y and z.
    x: &'a mut [[S; N]; 3],
    w: S,
    /// `B w`, where it is not zero.
    damping: Option<S>,
    /// The last coefficient of `omega^2/2`.
    half: S,
}

impl<'a, S: Number, const N: usize> Series<'a, S, N> {
    #[inline(always)]
    fn of(x: &'a mut [[S; N]; 3], start: [S; 3], w: S, damping: Option<S>) -> Self {
        unroll!(n in 0..3 => { x[n][0] = start[n]; });
        let half = (start[0] * start[0]).scaled(0.5);
        Self { x, w, damping, half }
    }

    /// The coefficients `k + 1`.
    #[inline(always)]
    fn next(&mut self, k: usize) {
        let [omega, y, z] = &mut *self.x;
        let part = INVERSE[k + 1];
        omega[k + 1] = (y[k] - omega[k]).scaled(part);
        y[k + 1] = if k == 0 {
            omega[0] * z[0]
        } else {
            inner(omega, z, k).plus_product(omega[k], z[0]).plus_product(omega[0], z[k]).scaled(part)
        };
        let half = half_square(omega, k + 1).plus_product(omega[0], omega[k + 1]);
        z[k + 1] = match self.damping {
            Some(damping) => (-half).plus_scaled((self.half + self.half).plus_product(damping, z[k]), -part),
            None => (-half).plus_scaled(self.half, -2.0 * part),
        };
        if k == 0 {
            z[1] += self.w;
        }
        self.half = half;
    }
}
