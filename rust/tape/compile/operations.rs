//! The operations of a tape as those of a listing.

use super::{C, FACTOR, MASK, SIGN, Series};
use crate::machine::{Array, Operation, Place};
use crate::model::PIECE_COEFFICIENTS;
use crate::tape::fuse::{Chain, First, Then};
use crate::tape::node::{INVERSE, Node, Step};

impl Series {
    pub(super) fn chain(&mut self, chain: &Chain) {
        let (k, a, b) = (self.k, chain.a, chain.b);
        match chain.first {
            First::Series => self.load(C, a, k),
            _ if k == 0 => {
                self.with(C, false, (a, 0), (b, 0));
            }
            First::Product => {
                let any = self.inner(a, b);
                let any = self.with(C, any, (a, 0), (b, k));
                self.with(C, any, (a, k), (b, 0));
            }
            First::Square => {
                let any = self.inner_square(a);
                self.load(FACTOR, a, 0);
                self.list.apply(Operation::Add, FACTOR, FACTOR, FACTOR);
                let last = self.place(a, k);
                self.times(C, any, FACTOR, last);
            }
        }
        for &then in &chain.then[..usize::from(chain.count)] {
            self.then(then);
        }
        if chain.is_rate {
            self.rate(chain.to);
        } else {
            self.store(chain.to);
        }
    }

    fn then(&mut self, then: Then) {
        use Operation::{Add, Mul, Sub, Xor};
        let k = self.k;
        match then {
            // A constant has only a coefficient of order 0.
            Then::Plus(h) if k == 0 => self.apply(Add, self.held(h)),
            Then::Minus(h) if k == 0 => self.apply(Sub, self.held(h)),
            Then::FromHeld(h) if k == 0 => {
                self.list.load(FACTOR, self.held(h));
                self.list.apply(Sub, C, FACTOR, C);
            }
            Then::Plus(_) | Then::Minus(_) => {}
            Then::Neg | Then::FromHeld(_) => self.apply(Xor, SIGN),
            Then::Add(a) | Then::Sub(a) => {
                let a = self.place(a, k);
                self.apply(if matches!(then, Then::Add(_)) { Add } else { Sub }, a);
            }
            Then::Scale(h) => self.apply(Mul, self.held(h)),
            Then::From(a) => {
                self.load(FACTOR, a, k);
                self.list.apply(Sub, C, FACTOR, C);
            }
            Then::AddScaled(a, h) | Then::SubScaled(a, h) | Then::FromScaled(a, h) => {
                self.load(FACTOR, a, k);
                self.list.apply(Mul, FACTOR, FACTOR, self.held(h));
                match then {
                    Then::AddScaled(..) => self.apply(Add, FACTOR),
                    Then::SubScaled(..) => self.apply(Sub, FACTOR),
                    _ => self.list.apply(Sub, C, FACTOR, C),
                }
            }
        }
    }

    /// As [`Step::start`]; `None` if the step has to be interpreted.
    pub(super) fn first(&mut self, step: Step) -> Option<()> {
        let to = step.to;
        match step.node {
            // Computed together with the sine or the hyperbolic tangent.
            Node::Cos(_) | Node::CosOfTime(_) | Node::Slope(_) => return Some(()),
            Node::Hold(h) => self.list.load(C, self.held(h)),
            Node::Select(side, a, b) => self.select(side, a, b),
            Node::Div(a, b) => {
                self.inverse(1.0, (b, 0), to + 1);
                let a = self.place(a, 0);
                self.list.apply(Operation::Mul, C, FACTOR, a);
            }
            Node::Over(h, b) => {
                self.inverse(1.0, (b, 0), to + 1);
                self.list.apply(Operation::Mul, C, FACTOR, self.held(h));
            }
            Node::Sqrt(a) => {
                self.load(C, a, 0);
                self.list.apply(Operation::Root, C, C, C);
                self.store(to);
                self.inverse(0.5, (to, 0), to + 1);
                return Some(());
            }
            _ => return None,
        }
        self.store(to);
        Some(())
    }

    /// Puts a number divided by a coefficient into the factor, and stores it.
    fn inverse(&mut self, number: f64, of: (u16, usize), to: u16) {
        let number = self.list.constant(number);
        self.list.load(FACTOR, number);
        let of = self.place(of.0, of.1);
        self.list.apply(Operation::Div, FACTOR, FACTOR, of);
        self.list.store(self.place(to, 0), FACTOR);
    }

    /// Chooses `c` from two series by the side of a surface.
    fn select(&mut self, side: u16, a: u16, b: u16) {
        use Operation::{And, AndNot, Or};
        self.list.load(MASK, Place(Array::Sides, usize::from(side)));
        self.load(C, a, self.k);
        self.load(FACTOR, b, self.k);
        self.list.apply(AndNot, FACTOR, MASK, FACTOR);
        self.apply(And, MASK);
        self.apply(Or, FACTOR);
    }

    /// As [`Step::next`].
    pub(super) fn step(&mut self, step: Step) {
        use Operation::{Add, Mul, Sub, Xor};
        let (k, to) = (self.k, step.to);
        let any = match step.factors() {
            Some((a, b)) if a == b => self.inner_square(a),
            Some((a, b)) => self.inner(a, b),
            None => false,
        };
        // An empty sum is -0.
        let sum = if any { C } else { SIGN };
        match step.node {
            Node::Input(_) if k < PIECE_COEFFICIENTS => return,
            Node::Time | Node::Hold(_) | Node::Input(_) | Node::Piece(..) => {
                let value = f64::from(step.node == Node::Time && k == 1);
                let value = self.list.constant(value);
                self.list.load(C, value);
            }
            Node::Div(_, b) | Node::Over(_, b) => {
                self.with(C, any, (to, 0), (b, k));
                if let Node::Div(a, _) = step.node {
                    self.load(FACTOR, a, k);
                    self.list.apply(Sub, C, FACTOR, C);
                    let inverse = self.place(to + 1, 0);
                    self.apply(Mul, inverse);
                } else {
                    let inverse = self.place(to + 1, 0);
                    self.apply(Mul, inverse);
                    self.apply(Xor, SIGN);
                }
            }
            Node::Sqrt(a) => {
                self.load(FACTOR, a, k);
                self.list.apply(Sub, C, FACTOR, sum);
                let inverse = self.place(to + 1, 0);
                self.apply(Mul, inverse);
            }
            Node::Exp(a) => {
                self.slope(a, to + 1);
                let own = self.place(to, 0);
                self.times(C, any, FACTOR, own);
                self.scale(INVERSE[k]);
            }
            Node::Ln(a) => {
                self.weighted(a);
                self.list.apply(Sub, C, FACTOR, sum);
                let inverse = self.place(to + 2, 0);
                self.apply(Mul, inverse);
                self.store(to + 1);
                self.scale(INVERSE[k]);
            }
            Node::Sin(a) | Node::Tanh(a) => {
                self.slope(a, to + 2);
                let other = self.place(to + 1, 0);
                self.times(C, any, FACTOR, other);
                self.scale(INVERSE[k]);
            }
            Node::Cos(sine) => {
                self.with(C, any, (sine + 2, k), (sine, 0));
                self.scale(-INVERSE[k]);
            }
            Node::SinOfTime(a) => {
                if k == 1 {
                    self.load(FACTOR, a, 1);
                    self.list.store(self.place(to + 2, 1), FACTOR);
                }
                self.with(C, false, (to + 2, 1), (to + 1, k - 1));
                self.scale(INVERSE[k]);
            }
            Node::CosOfTime(sine) => {
                self.with(C, false, (sine + 2, 1), (sine, k - 1));
                self.scale(-INVERSE[k]);
            }
            Node::Slope(tanh) => {
                self.load(FACTOR, tanh, 0);
                self.list.apply(Add, FACTOR, FACTOR, FACTOR);
                let last = self.place(tanh, k);
                self.times(C, any, FACTOR, last);
                self.apply(Xor, SIGN);
            }
            Node::Select(side, a, b) => self.select(side, a, b),
            Node::Neg(_)
            | Node::Add(..)
            | Node::Sub(..)
            | Node::Plus(..)
            | Node::Minus(..)
            | Node::From(..)
            | Node::Scale(..)
            | Node::Mul(..)
            | Node::Square(_) => unreachable!("products and linear steps are in chains"),
        }
        self.store(to);
    }

    /// Puts a coefficient of a series' derivative into the factor. `c` does not change.
    fn weighted(&mut self, a: u16) {
        let weight = self.list.constant(self.k as f64);
        self.load(FACTOR, a, self.k);
        self.list.load(MASK, weight);
        self.list.apply(Operation::Mul, FACTOR, FACTOR, MASK);
    }

    /// The same, stored too.
    fn slope(&mut self, a: u16, to: u16) {
        self.weighted(a);
        self.list.store(self.place(to, self.k), FACTOR);
    }
}
