//! The kinks of formulas: the surfaces that runs land on.

use std::ops::Range;

use super::{Binary, Expression, Leaf, Op, Unary};
use crate::scalar::Scalar;
use crate::sides::MAX_SURFACES;

/// A function that is smooth on each side of the zeros of a surface's function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kink {
    Abs,
    Sign,
    Min,
    Max,
    Where,
}

impl Kink {
    /// That of an operation, if it has one.
    fn of(op: Op) -> Option<Self> {
        match op {
            Op::Unary(Unary::Abs) => Some(Kink::Abs),
            Op::Unary(Unary::Sign) => Some(Kink::Sign),
            Op::Binary(Binary::Min) => Some(Kink::Min),
            Op::Binary(Binary::Max) => Some(Kink::Max),
            Op::Where => Some(Kink::Where),
            _ => None,
        }
    }

    /// How many numbers it is a function of.
    pub fn takes(self) -> usize {
        match self {
            Kink::Abs | Kink::Sign => 1,
            Kink::Min | Kink::Max => 2,
            Kink::Where => 3,
        }
    }

    /// Its values on the positive and on the negative side of its surface, for numbers that it is a continuous function of.
    pub(super) fn branches<S: Scalar>(self, a: S, b: S) -> (S, S) {
        match self {
            Kink::Min => (b, a),
            Kink::Max => (a, b),
            Kink::Abs | Kink::Sign | Kink::Where => (a, -a),
        }
    }

    /// Its name in a formula's text.
    pub fn name(self) -> &'static str {
        match self {
            Kink::Abs => "abs",
            Kink::Sign => "sign",
            Kink::Min => "min",
            Kink::Max => "max",
            Kink::Where => "where",
        }
    }

    /// Returns true if its value jumps at the surface.
    fn jumps(self) -> bool {
        matches!(self, Kink::Sign | Kink::Where)
    }
}

/// The surfaces on which formulas have kinks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kinks {
    /// Their functions. One may depend on the sides of those before it.
    pub surfaces: Vec<Expression>,
    /// True if a formula jumps there.
    pub jumps: Vec<bool>,
    /// True if their functions are no faster than the state.
    pub steady: Vec<bool>,
    /// Those that a law may [slide](crate::model::sliding_mode) on: where it jumps at a linear function of the states
    /// in the rate of one of them.
    pub sliding: Vec<usize>,
    /// One surface fewer, which is kept for the [clock](crate::model::System::clock).
    pub clocked: bool,
}

impl Kinks {
    /// Finds the kinks of a formula and writes it on the sides of their surfaces. Kinks beyond the most surfaces
    /// that a model can have stay comparisons.
    pub fn of(&mut self, formula: &mut Expression) {
        // The start of each number on the stack.
        let mut starts: Vec<usize> = Vec::new();
        let mut next = 0;
        while next < formula.ops.len() {
            let mut i = next;
            let op = formula.ops[i];
            let at = starts.len() - op.takes();
            if op == Op::Unary(Unary::Sign) && !Expression::varies_of(&formula.ops[starts[at]..i]) {
                i = self.constant_sign(formula, starts[at]..i);
            } else if let Some(kink) = Kink::of(op) {
                let own = match kink {
                    Kink::Abs | Kink::Sign => formula.ops[starts[at]..i].to_vec(),
                    Kink::Min | Kink::Max => {
                        [&formula.ops[starts[at]..i], &[Op::Binary(Binary::Sub)]].concat()
                    }
                    Kink::Where => formula.ops[starts[at]..starts[at + 1]].to_vec(),
                };
                if let Some(j) = self.surface(own) {
                    self.jumps[j] |= kink.jumps();
                    formula.ops[i] = Op::On(kink, j as u8);
                }
            }
            let start = starts.get(at).copied().unwrap_or(i);
            starts.truncate(at);
            starts.push(start);
            next = i + 1;
        }
    }

    /// Writes the sign of a constant, which may be zero, on the sides of two surfaces. Returns the place of its last
    /// operation. It stays a comparison if there is no room for both.
    fn constant_sign(&mut self, formula: &mut Expression, of: Range<usize>) -> usize {
        let above = formula.ops[of.clone()].to_vec();
        let below = [&above[..], &[Op::Unary(Unary::Neg)]].concat();
        let known = |ops: &[Op]| self.surfaces.iter().any(|known| known.ops == ops);
        let needed = usize::from(!known(&above)) + usize::from(!known(&below));
        if self.surfaces.len() + needed + usize::from(self.clocked) > MAX_SURFACES {
            return of.end;
        }
        let (Some(above), Some(below)) = (self.surface(above), self.surface(below)) else { return of.end };
        (self.jumps[above], self.jumps[below]) = (true, true);
        let number = |value: f64| Op::Push(Leaf::Number(value));
        let on = |side: usize| Op::On(Kink::Where, side as u8);
        // The side is the condition: any number fills its place on the stack.
        let sign = [number(0.0), number(1.0), number(0.0), number(-1.0), number(0.0), on(below), on(above)];
        formula.ops.splice(of.start..=of.end, sign);
        of.start + sign.len() - 1
    }

    /// Finds the surfaces that the law with these rates may slide on.
    pub fn find_sliding(&mut self, rates: &[Expression]) {
        let moves = |j: usize, n: usize| {
            let jumps = rates[n].ops.iter().any(|op| matches!(op, Op::On(_, own) if usize::from(*own) == j));
            jumps && self.surfaces[j].ops.contains(&Op::Push(Leaf::State(n)))
        };
        self.sliding = (0..self.surfaces.len())
            .filter(|&j| {
                self.jumps[j] && self.surfaces[j].is_affine() && (0..rates.len()).any(|n| moves(j, n))
            })
            .collect();
    }

    /// The number of the surface with this function, if there is room for it.
    fn surface(&mut self, ops: Vec<Op>) -> Option<usize> {
        if let Some(j) = self.surfaces.iter().position(|known| known.ops == ops) {
            return Some(j);
        }
        if self.surfaces.len() + usize::from(self.clocked) == MAX_SURFACES {
            return None;
        }
        let own = Expression::of(ops);
        self.steady.push(own.is_steady());
        self.surfaces.push(own);
        self.jumps.push(false);
        Some(self.surfaces.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formula::Names;

    /// Returns true if the function of a formula's last surface is steady.
    fn steady(text: &str) -> bool {
        let (states, parameters) = (["x", "v"].map(str::to_owned), ["k"].map(str::to_owned));
        let names = Names { states: &states, parameters: &parameters, inputs: &[], rates: false };
        let mut formula = Expression::parse(text, names).unwrap();
        let mut kinks = Kinks::default();
        kinks.of(&mut formula);
        *kinks.steady.last().unwrap()
    }

    /// Without this a run along the disk's friction law as text looked for crossings at many places of every step.
    #[test]
    fn a_kink_within_a_surface_is_linear_on_either_side() {
        for text in [
            "max(k - 2*abs(v), 1)",
            "min(x + max(v, 0), k)",
            "where(x - where(v > 0, v, 2*v) > 0, 1, 2)",
            "abs(x + sign(v))",
        ] {
            assert!(steady(text), "{text}");
        }
        for text in
            ["max(k - v*abs(v), 1)", "max(where(v > 0, x^2, x), 0)", "abs(sin(abs(x)))", "max(abs(v)^2, k)"]
        {
            assert!(!steady(text), "{text}");
        }
    }
}
