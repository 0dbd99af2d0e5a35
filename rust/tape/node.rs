//! The operations of a tape and the recurrences of their power series.
//!
//! Products: Leibniz. The others follow from the differential equation of the function, as
//! `(exp a)' = exp(a) a'` (À. Jorba and M. Zou, Experimental Mathematics 14 (2005) 99).

use super::series::{inner_at, inner_square_at};
use super::symbol::Function;
use crate::model::{PIECE_COEFFICIENTS, Sides};
use crate::scalar::{Cells, InstructionSet, Scalar};

/// A value that does not change along a solution; operands are earlier ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Invariant {
    Constant(f64),
    Parameter(u16),
    /// The origin of an input's present [piece](crate::model::Piece), or, counted from 1, one of its coefficients.
    Input(u16, u16),
    Neg(u16),
    Add(u16, u16),
    Sub(u16, u16),
    Mul(u16, u16),
    Div(u16, u16),
    /// An elementary function.
    Apply(Function, u16),
    /// The first on the positive side of this surface, else the second.
    Select(u16, u16, u16),
}

/// An operation on series, with the numbers of their slots; `h` is the number of a [`Invariant`] value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Node {
    /// `t`
    Time,
    /// `h`
    Hold(u16),
    /// The polynomial with its origin in `h`, its coefficients behind it.
    Input(u16),
    /// `-a`
    Neg(u16),
    /// `a + b`
    Add(u16, u16),
    /// `a - b`
    Sub(u16, u16),
    /// `a + h`
    Plus(u16, u16),
    /// `a - h`
    Minus(u16, u16),
    /// `h - a`
    From(u16, u16),
    /// `a h`
    Scale(u16, u16),
    /// `a b`
    Mul(u16, u16),
    /// `a^2`
    Square(u16),
    /// `a / b`; its second slot is for `1 / b[0]`.
    Div(u16, u16),
    /// `h / a`; its second slot is for `1 / a[0]`.
    Over(u16, u16),
    /// Its second slot is for half the root's inverse.
    Sqrt(u16),
    /// Its second slot is for the argument's derivative.
    Exp(u16),
    /// Its second slot is for its own derivative, its third for `1 / a[0]`.
    Ln(u16),
    /// The second slot is for the cosine, the third for the argument's derivative.
    Sin(u16),
    /// The cosine that belongs to this sine.
    Cos(u16),
    /// The sine of a linear function of time, with the same slots: a product of series has one term.
    SinOfTime(u16),
    /// The cosine that belongs to this sine.
    CosOfTime(u16),
    /// Its other slots are for its slope `1 - tanh^2` and the argument's derivative.
    Tanh(u16),
    /// The slope that belongs to this hyperbolic tangent.
    Slope(u16),
    /// The first on the positive side of this surface, else the second.
    Select(u16, u16, u16),
    /// Where the spline's cell around a place begins; its other slots are for the coefficients of the polynomial there.
    /// The held values of the spline's coefficients begin at the second number.
    Piece(u16, u16, Cells),
}

impl Node {
    /// Returns true if it comes so near to a constant that the terms of its series vanish.
    pub(super) fn levels_off(self) -> bool {
        matches!(self, Node::Exp(_) | Node::Tanh(_))
    }

    /// How many slots it needs.
    pub(super) fn slots(self) -> usize {
        match self {
            Node::Div(..) | Node::Over(..) | Node::Sqrt(_) | Node::Exp(_) => 2,
            Node::Ln(_) | Node::Sin(_) | Node::SinOfTime(_) | Node::Tanh(_) => 3,
            Node::Piece(..) => 5,
            Node::Cos(_) | Node::CosOfTime(_) | Node::Slope(_) => 0,
            _ => 1,
        }
    }
}

/// An operation and the first slot that it fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    pub node: Node,
    pub to: u16,
}

/// Evaluates the held values one after the other: not worth a copy for each instruction set.
#[inline(never)]
pub(super) fn hold<S: Scalar>(list: &[Invariant], parameters: &[S], sides: &Sides<S>, values: &mut [S]) {
    macro_rules! of {
        ($i:expr) => {
            values[usize::from($i)]
        };
    }
    for (i, &held) in list.iter().enumerate() {
        values[i] = match held {
            Invariant::Constant(value) => S::constant(value),
            Invariant::Parameter(i) => parameters[usize::from(i)],
            // Set apart, from one step to the next.
            Invariant::Input(..) => continue,
            Invariant::Neg(a) => -of!(a),
            Invariant::Add(a, b) => of!(a) + of!(b),
            Invariant::Sub(a, b) => of!(a) - of!(b),
            Invariant::Mul(a, b) => of!(a) * of!(b),
            Invariant::Div(a, b) => of!(a) / of!(b),
            Invariant::Apply(function, a) => function.of(of!(a)),
            Invariant::Select(j, a, b) => S::select(sides[usize::from(j)], of!(a), of!(b)),
        };
    }
}

/// `1/k`
pub(super) const INVERSE: [f64; 25] = {
    let mut table = [1.0; 25];
    let mut k = 2;
    while k < 25 {
        table[k] = 1.0 / k as f64;
        k += 1;
    }
    table
};

impl Step {
    /// Coefficient 0.
    #[inline(always)]
    pub(super) fn start<S: Scalar, const N: usize>(
        self,
        work: &mut [[S; N]],
        held: &[S],
        t: S,
        sides: &Sides<S>,
    ) {
        let (done, to) = work.split_at_mut(usize::from(self.to));
        macro_rules! of {
            ($i:expr) => {
                done[usize::from($i)][0]
            };
        }
        macro_rules! h {
            ($i:expr) => {
                held[usize::from($i)]
            };
        }
        // Short operations stay in registers if the long functions are separate.
        to[0][0] = match self.node {
            Node::Time => t,
            Node::Hold(c) => h!(c),
            Node::Input(origin) => {
                let (at, since) = (usize::from(origin), t - h!(origin));
                let [c0, c1, c2, c3] = [held[at + 1], held[at + 2], held[at + 3], held[at + 4]];
                let slope = c1 + since * (c2.scale(2.0) + since * c3.scale(3.0));
                let series = [slope, c2 + since * c3.scale(3.0), c3];
                for (to, from) in to[0][1..].iter_mut().zip(series) {
                    *to = from;
                }
                c0 + since * (c1 + since * (c2 + since * c3))
            }
            Node::Neg(a) => -of!(a),
            Node::Add(a, b) => of!(a) + of!(b),
            Node::Sub(a, b) => of!(a) - of!(b),
            Node::Plus(a, c) => of!(a) + h!(c),
            Node::Minus(a, c) => of!(a) - h!(c),
            Node::From(c, a) => h!(c) - of!(a),
            Node::Scale(a, c) => of!(a) * h!(c),
            Node::Mul(a, b) => of!(a) * of!(b),
            Node::Square(a) => of!(a).square(),
            Node::Div(a, b) => {
                to[1][0] = S::one() / of!(b);
                of!(a) * to[1][0]
            }
            Node::Over(c, b) => {
                to[1][0] = S::one() / of!(b);
                h!(c) * to[1][0]
            }
            Node::Select(j, a, b) => S::select(sides[usize::from(j)], of!(a), of!(b)),
            Node::Piece(place, at, cells) => {
                let coefficient = |i: usize| held[usize::from(at) + i];
                let (floor, powers) = cells.piece(of!(place).real(), &coefficient);
                for (to, power) in to[1..].iter_mut().zip(powers) {
                    to[0] = power;
                }
                S::lift(floor)
            }
            Node::Sqrt(a) => {
                to[0][0] = Function::Sqrt.of(of!(a));
                to[1][0] = S::constant(0.5) / to[0][0];
                return;
            }
            Node::Exp(a) => {
                to[0][0] = Function::Exp.of(of!(a));
                return;
            }
            Node::Ln(a) => {
                to[2][0] = S::one() / of!(a);
                to[0][0] = Function::Ln.of(of!(a));
                return;
            }
            Node::Sin(a) | Node::SinOfTime(a) => {
                (to[0][0], to[1][0]) = Function::Sin.pair(of!(a));
                return;
            }
            Node::Tanh(a) => {
                to[0][0] = Function::Tanh.of(of!(a));
                to[1][0] = S::one() - to[0][0].square();
                return;
            }
            // Done with the sine and the tangent.
            Node::Cos(_) | Node::CosOfTime(_) | Node::Slope(_) => return,
        };
    }

    /// The series whose product enters coefficient `k`; a square where they are the same.
    #[inline(always)]
    pub(super) fn factors(self) -> Option<(u16, u16)> {
        let to = self.to;
        match self.node {
            Node::Div(_, b) | Node::Over(_, b) => Some((to, b)),
            Node::Sqrt(_) => Some((to, to)),
            Node::Exp(_) => Some((to + 1, to)),
            Node::Ln(a) => Some((to + 1, a)),
            Node::Sin(_) | Node::Tanh(_) => Some((to + 2, to + 1)),
            Node::Cos(sine) => Some((sine + 2, sine)),
            Node::Slope(tanh) => Some((tanh, tanh)),
            _ => None,
        }
    }

    /// Coefficient `k >= 1` of a step that is in no [chain](super::fuse), from those of lower order and the operands'
    /// coefficients up to `k`.
    #[inline(always)]
    pub(super) fn next<V: InstructionSet, S: Scalar, const N: usize>(
        self,
        work: &mut [[S; N]],
        sides: &Sides<S>,
        k: usize,
    ) {
        // One place for all products keeps the code small.
        let sum = match self.factors() {
            Some((a, b)) if a == b => inner_square_at::<V, S, N>(&work[usize::from(a)], k),
            Some((a, b)) => inner_at::<V, S, N>(&work[usize::from(a)], &work[usize::from(b)], k),
            None => S::zero(),
        };
        macro_rules! of {
            ($slot:expr, $k:expr) => {
                work[usize::from($slot)][$k]
            };
        }
        let to = self.to;
        let (weight, inverse) = (k as f64, INVERSE[k]);
        of!(to, k) = match self.node {
            Node::Time if k == 1 => S::one(),
            Node::Time | Node::Hold(_) | Node::Piece(..) => S::zero(),
            // Known since the start.
            Node::Input(_) if k < PIECE_COEFFICIENTS => of!(to, k),
            Node::Input(_) => S::zero(),
            // The quotient q of a = q b.
            Node::Div(a, b) => (of!(a, k) - sum.fused(of!(to, 0), of!(b, k))) * of!(to + 1, 0),
            Node::Over(_, b) => -(sum.fused(of!(to, 0), of!(b, k)) * of!(to + 1, 0)),
            // The root r of a = r^2.
            Node::Sqrt(a) => (of!(a, k) - sum) * of!(to + 1, 0),
            Node::Exp(a) => {
                let slope = of!(a, k).scale(weight);
                of!(to + 1, k) = slope;
                sum.fused(slope, of!(to, 0)).scale(inverse)
            }
            // a l' = a'
            Node::Ln(a) => {
                let slope = (of!(a, k).scale(weight) - sum) * of!(to + 2, 0);
                of!(to + 1, k) = slope;
                slope.scale(inverse)
            }
            Node::Sin(a) | Node::Tanh(a) => {
                let slope = of!(a, k).scale(weight);
                of!(to + 2, k) = slope;
                sum.fused(slope, of!(to + 1, 0)).scale(inverse)
            }
            Node::Cos(sine) => sum.fused(of!(sine + 2, k), of!(sine, 0)).scale(-inverse),
            Node::SinOfTime(a) => {
                if k == 1 {
                    of!(to + 2, 1) = of!(a, 1);
                }
                (of!(to + 2, 1) * of!(to + 1, k - 1)).scale(inverse)
            }
            Node::CosOfTime(sine) => (of!(sine + 2, 1) * of!(sine, k - 1)).scale(-inverse),
            Node::Slope(tanh) => -sum.fused(of!(tanh, 0) + of!(tanh, 0), of!(tanh, k)),
            Node::Select(j, a, b) => S::select(sides[usize::from(j)], of!(a, k), of!(b, k)),
            _ => unreachable!("products and linear steps are in chains"),
        };
    }
}
