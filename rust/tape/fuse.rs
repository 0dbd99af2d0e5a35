//! Steps of a tape that follow each other, as one operation.
//!
//! The interpreter's time is the way from one operation to the next, through memory. A result
//! that only one linear step uses is passed on in a register: `x y - b z` is one operation instead of three. Nothing is
//! reordered or rounded otherwise, so no bit changes.

use std::sync::Mutex;

use super::compile::{self, Start};
use super::group::Plan;
use super::node::{INVERSE, Node, Step};
use super::series::{inner_at, inner_square_at};
use crate::machine::{self, Code, Codes};
use crate::model::Sides;
use crate::scalar::{InstructionSet, Isa, Scalar};

/// A linear operation on the coefficient `c` just found; `a` is a series, `h` a held value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Then {
    /// `-c`
    Neg,
    /// `c + a`
    Add(u16),
    /// `c - a`
    Sub(u16),
    /// `a - c`
    From(u16),
    /// `c + h`
    Plus(u16),
    /// `c - h`
    Minus(u16),
    /// `h - c`
    FromHeld(u16),
    /// `c h`
    Scale(u16),
    /// `c + a h`
    AddScaled(u16, u16),
    /// `c - a h`
    SubScaled(u16, u16),
    /// `a h - c`
    FromScaled(u16, u16),
}

/// The most linear operations after a step.
const MOST: usize = 3;

/// The first value of a chain of linear operations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum First {
    /// `a`
    Series,
    /// `a b`
    Product,
    /// `a^2`
    Square,
}

/// A product or a series and the linear operations that follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chain {
    pub(super) first: First,
    pub(super) count: u8,
    pub(super) a: u16,
    pub(super) b: u16,
    pub(super) then: [Then; MOST],
    /// The slot of the result, or the component of the state whose rate it is.
    pub(super) to: u16,
    pub(super) is_rate: bool,
}

/// Chains, then a step that is none.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Stretch {
    pub(super) chains: Vec<Chain>,
    pub(super) last: Option<Step>,
}

static LATEST: Mutex<Vec<Program>> = Mutex::new(Vec::new());

/// The operations of a tape for each order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Program {
    pub(super) stretches: Vec<Stretch>,
    /// Slots of rates that are needed elsewhere, too, and the components they belong to.
    pub(super) copied: Vec<(u16, u16)>,
    pub(super) slots: usize,
    /// The slots that are filled, besides the state's.
    pub(super) filled: Vec<u16>,
    pub(super) plan: Plan,
    pub(super) codes: Codes<Code>,
    starts: Codes<Start>,
}

impl Then {
    /// The same with other series and held values.
    fn map(self, slot: &mut dyn FnMut(u16) -> u16, held: &mut dyn FnMut(u16) -> u16) -> Self {
        match self {
            Then::Neg => Then::Neg,
            Then::Add(a) => Then::Add(slot(a)),
            Then::Sub(a) => Then::Sub(slot(a)),
            Then::From(a) => Then::From(slot(a)),
            Then::Plus(h) => Then::Plus(held(h)),
            Then::Minus(h) => Then::Minus(held(h)),
            Then::FromHeld(h) => Then::FromHeld(held(h)),
            Then::Scale(h) => Then::Scale(held(h)),
            Then::AddScaled(a, h) => Then::AddScaled(slot(a), held(h)),
            Then::SubScaled(a, h) => Then::SubScaled(slot(a), held(h)),
            Then::FromScaled(a, h) => Then::FromScaled(slot(a), held(h)),
        }
    }
}

impl Chain {
    /// The rate of a component that is a series.
    pub(super) fn copy(a: u16, n: u16) -> Self {
        Self { first: First::Series, count: 0, a, b: a, then: [Then::Neg; MOST], to: n, is_rate: true }
    }

    /// The same with other series and held values; its result stays.
    pub(super) fn map(mut self, slot: &mut dyn FnMut(u16) -> u16, held: &mut dyn FnMut(u16) -> u16) -> Self {
        let a = self.a;
        self.a = slot(a);
        self.b = if self.first == First::Product { slot(self.b) } else { self.a };
        for then in &mut self.then[..usize::from(self.count)] {
            *then = then.map(slot, held);
        }
        self
    }
}

impl Node {
    /// The same with other series and held values.
    pub(super) fn map(self, slot: &mut dyn FnMut(u16) -> u16, held: &mut dyn FnMut(u16) -> u16) -> Self {
        match self {
            Node::Time => Node::Time,
            Node::Hold(h) => Node::Hold(held(h)),
            Node::Input(h) => Node::Input(held(h)),
            Node::Neg(a) => Node::Neg(slot(a)),
            Node::Add(a, b) => Node::Add(slot(a), slot(b)),
            Node::Sub(a, b) => Node::Sub(slot(a), slot(b)),
            Node::Plus(a, h) => Node::Plus(slot(a), held(h)),
            Node::Minus(a, h) => Node::Minus(slot(a), held(h)),
            Node::From(h, a) => Node::From(held(h), slot(a)),
            Node::Scale(a, h) => Node::Scale(slot(a), held(h)),
            Node::Mul(a, b) => Node::Mul(slot(a), slot(b)),
            Node::Square(a) => Node::Square(slot(a)),
            Node::Div(a, b) => Node::Div(slot(a), slot(b)),
            Node::Over(h, a) => Node::Over(held(h), slot(a)),
            Node::Sqrt(a) => Node::Sqrt(slot(a)),
            Node::Exp(a) => Node::Exp(slot(a)),
            Node::Ln(a) => Node::Ln(slot(a)),
            Node::Sin(a) => Node::Sin(slot(a)),
            Node::Cos(a) => Node::Cos(slot(a)),
            Node::SinOfTime(a) => Node::SinOfTime(slot(a)),
            Node::CosOfTime(a) => Node::CosOfTime(slot(a)),
            Node::Tanh(a) => Node::Tanh(slot(a)),
            Node::Slope(a) => Node::Slope(slot(a)),
            Node::Select(side, a, b) => Node::Select(side, slot(a), slot(b)),
            Node::Piece(place, at, cells) => Node::Piece(slot(place), at, cells),
        }
    }

    /// The series that it needs.
    fn operands(self) -> impl Iterator<Item = u16> {
        let (a, b) = match self {
            Node::Time | Node::Hold(_) | Node::Input(_) => (None, None),
            Node::Add(a, b) | Node::Sub(a, b) | Node::Mul(a, b) | Node::Div(a, b) | Node::Select(_, a, b) => {
                (Some(a), Some(b))
            }
            Node::Neg(a) | Node::Plus(a, _) | Node::Minus(a, _) | Node::From(_, a) | Node::Scale(a, _) => {
                (Some(a), None)
            }
            Node::Square(a) | Node::Over(_, a) | Node::Sqrt(a) | Node::Exp(a) | Node::Ln(a) => {
                (Some(a), None)
            }
            Node::Sin(a) | Node::Cos(a) | Node::SinOfTime(a) | Node::CosOfTime(a) => (Some(a), None),
            Node::Tanh(a) | Node::Slope(a) => (Some(a), None),
            Node::Piece(place, ..) => (Some(place), None),
        };
        a.into_iter().chain(b)
    }

    fn is_linear(self) -> bool {
        use Node::{Add, From, Minus, Neg, Plus, Scale, Sub};
        matches!(self, Neg(_) | Add(..) | Sub(..) | Plus(..) | Minus(..) | From(..) | Scale(..))
    }
}

impl Program {
    /// For these steps and rates; each step by itself unless they are to be `fused`.
    pub(super) fn of(steps: &[Step], rates: &[u16], slots: usize, fused: bool) -> Self {
        let mut uses = vec![0; slots];
        let mut user = vec![None; slots];
        for step in steps {
            for slot in step.node.operands() {
                uses[usize::from(slot)] += 1;
                user[usize::from(slot)] = Some(step.node);
            }
        }
        for &slot in rates {
            uses[usize::from(slot)] += 1;
            user[usize::from(slot)] = None;
        }
        let mut fusing = Fusing { waiting: vec![None; slots], stretch: Stretch::default() };
        let (mut stretches, mut delivered) = (Vec::new(), vec![false; rates.len()]);
        for &step in steps {
            let (to, chain) = (usize::from(step.to), fusing.chain(step));
            let Some(mut chain) = chain else {
                fusing.stretch.last = Some(step);
                stretches.push(std::mem::take(&mut fusing.stretch));
                continue;
            };
            if fused && uses[to] == 1 {
                if user[to].is_some_and(Node::is_linear) {
                    fusing.waiting[to] = Some(chain);
                    continue;
                }
                if let Some(n) = rates.iter().position(|&slot| slot == step.to) {
                    delivered[n] = true;
                    (chain.to, chain.is_rate) = (u16::try_from(n).expect("few components"), true);
                }
            }
            fusing.stretch.chains.push(chain);
        }
        stretches.push(fusing.stretch);
        let copied = (0..).zip(rates).filter(|&(n, _)| !delivered[usize::from(n)]);
        let copied = copied.map(|(n, &slot)| (slot, n)).collect();
        let mut filled = Vec::new();
        for Stretch { chains, last } in &stretches {
            filled.extend(chains.iter().filter(|chain| !chain.is_rate).map(|chain| chain.to));
            filled.extend(last.iter().flat_map(|step| (step.to..).take(step.node.slots())));
        }
        let program = Self { stretches, copied, slots, filled, ..Self::default() };
        machine::shared(&LATEST, Self { plan: Plan::of(&program), ..program })
    }

    /// How many components the state has: each has a rate.
    pub(super) fn components(&self) -> usize {
        let chains = self.stretches.iter().flat_map(|stretch| &stretch.chains);
        chains.filter(|chain| chain.is_rate).count() + self.copied.len()
    }
}

/// Steps on the way to a program.
struct Fusing {
    /// By slot: what is only needed by a step to come.
    waiting: Vec<Option<Chain>>,
    stretch: Stretch,
}

impl Fusing {
    /// The step as a chain, or as the end of one that waits.
    fn chain(&mut self, step: Step) -> Option<Chain> {
        let to = step.to;
        let begun =
            |first, a, b| Chain { first, count: 0, a, b, then: [Then::Neg; MOST], to, is_rate: false };
        let (slot, then) = match step.node {
            Node::Mul(a, b) => return Some(begun(First::Product, a, b)),
            Node::Square(a) => return Some(begun(First::Square, a, a)),
            Node::Neg(a) => (a, Then::Neg),
            Node::From(h, a) => (a, Then::FromHeld(h)),
            Node::Plus(a, h) => (a, Then::Plus(h)),
            Node::Minus(a, h) => (a, Then::Minus(h)),
            Node::Scale(a, h) => (a, Then::Scale(h)),
            Node::Add(a, b) => match self.pair(a, b) {
                (a, Operand::Series(b)) => (a, Then::Add(b)),
                (a, Operand::Scaled(b, h)) => (a, Then::AddScaled(b, h)),
            },
            Node::Sub(a, b) => match self.pair(a, b) {
                (c, Operand::Series(other)) if c == a => (c, Then::Sub(other)),
                (c, Operand::Scaled(other, h)) if c == a => (c, Then::SubScaled(other, h)),
                (c, Operand::Series(other)) => (c, Then::From(other)),
                (c, Operand::Scaled(other, h)) => (c, Then::FromScaled(other, h)),
            },
            _ => return None,
        };
        let mut chain = match self.waiting[usize::from(slot)].take() {
            Some(full) if usize::from(full.count) == MOST => {
                self.stretch.chains.push(full);
                begun(First::Series, slot, slot)
            }
            Some(waiting) => waiting,
            None => begun(First::Series, slot, slot),
        };
        chain.then[usize::from(chain.count)] = then;
        chain.count += 1;
        Some(Chain { to, ..chain })
    }

    /// The operand to continue the chain with, and the other operand.
    fn pair(&mut self, a: u16, b: u16) -> (u16, Operand) {
        let waits =
            |slot: u16| self.waiting[usize::from(slot)].is_some_and(|chain| usize::from(chain.count) < MOST);
        let (first, other) = match (waits(a), waits(b)) {
            (true, true) if self.scaled(a).is_some() && self.scaled(b).is_none() => (b, a),
            (false, true) => (b, a),
            _ => (a, b),
        };
        if waits(first)
            && let Some((slot, h)) = self.scaled(other)
        {
            self.waiting[usize::from(other)] = None;
            return (first, Operand::Scaled(slot, h));
        }
        self.stretch.chains.extend(self.waiting[usize::from(other)].take());
        (first, Operand::Series(other))
    }

    /// The series and the factor of a waiting value that is their product.
    fn scaled(&self, slot: u16) -> Option<(u16, u16)> {
        match self.waiting[usize::from(slot)] {
            Some(Chain { first: First::Series, a, count: 1, then: [Then::Scale(h), ..], .. }) => Some((a, h)),
            _ => None,
        }
    }
}

enum Operand {
    Series(u16),
    Scaled(u16, u16),
}

impl Program {
    /// The coefficients of order 0, and those of the components of order 1.
    #[inline(always)]
    pub(super) fn start<S: Scalar, const N: usize>(
        &self,
        work: &mut [[S; N]],
        held: &[S],
        t: S,
        sides: &Sides<S>,
    ) {
        let make = |lanes| compile::start(self, Isa::best(), lanes, N);
        match self.starts.get::<S>(usize::from(N == 2), compile::INTERPRETED, make) {
            Some(start) => start.run(work, held, t, sides),
            None => self.interpret_start(work, held, t, sides),
        }
    }

    #[inline(always)]
    pub(super) fn interpret_start<S: Scalar, const N: usize>(
        &self,
        work: &mut [[S; N]],
        held: &[S],
        t: S,
        sides: &Sides<S>,
    ) {
        for stretch in &self.stretches {
            for chain in &stretch.chains {
                chain.start(work, held);
            }
            if let Some(step) = stretch.last {
                step.start(work, held, t, sides);
            }
        }
        for &(slot, n) in &self.copied {
            work[usize::from(n)][1] = work[usize::from(slot)][0];
        }
    }

    /// The coefficients of order `k >= 1`, and those of the components of order `k + 1`.
    #[inline(always)]
    pub(super) fn next<V: InstructionSet, S: Scalar, const N: usize>(
        &self,
        work: &mut [[S; N]],
        held: &[S],
        sides: &Sides<S>,
        k: usize,
    ) {
        for stretch in &self.stretches {
            for chain in &stretch.chains {
                chain.next::<V, S, N>(work, held, k);
            }
            if let Some(step) = stretch.last {
                step.next::<V, S, N>(work, sides, k);
            }
        }
        for &(slot, n) in &self.copied {
            work[usize::from(n)][k + 1] = work[usize::from(slot)][k].scale(INVERSE[k + 1]);
        }
    }
}

impl Chain {
    #[inline(always)]
    fn start<S: Scalar, const N: usize>(&self, work: &mut [[S; N]], held: &[S]) {
        let a = work[usize::from(self.a)][0];
        let c = match self.first {
            First::Series => a,
            First::Product => a * work[usize::from(self.b)][0],
            First::Square => a.square(),
        };
        let c = self.rest(c, work, held, 0);
        work[usize::from(self.to)][usize::from(self.is_rate)] = c;
    }

    #[inline(always)]
    fn next<V: InstructionSet, S: Scalar, const N: usize>(&self, work: &mut [[S; N]], held: &[S], k: usize) {
        let a = &work[usize::from(self.a)];
        let c = match self.first {
            First::Series => a[k],
            First::Product => {
                let b = &work[usize::from(self.b)];
                inner_at::<V, S, N>(a, b, k).fused(a[0], b[k]).fused(a[k], b[0])
            }
            First::Square => inner_square_at::<V, S, N>(a, k).fused(a[0] + a[0], a[k]),
        };
        let c = self.rest(c, work, held, k);
        if self.is_rate {
            work[usize::from(self.to)][k + 1] = c.scale(INVERSE[k + 1]);
        } else {
            work[usize::from(self.to)][k] = c;
        }
    }

    /// The linear operations; a constant has only a coefficient of order 0.
    #[inline(always)]
    fn rest<S: Scalar, const N: usize>(&self, mut c: S, work: &[[S; N]], held: &[S], k: usize) -> S {
        macro_rules! of {
            ($slot:expr) => {
                work[usize::from($slot)][k]
            };
        }
        macro_rules! h {
            ($i:expr) => {
                held[usize::from($i)]
            };
        }
        for &then in &self.then[..usize::from(self.count)] {
            c = match then {
                Then::Plus(i) if k == 0 => c + h!(i),
                Then::Minus(i) if k == 0 => c - h!(i),
                Then::FromHeld(i) if k == 0 => h!(i) - c,
                Then::Plus(_) | Then::Minus(_) => c,
                Then::Neg | Then::FromHeld(_) => -c,
                Then::Add(a) => c + of!(a),
                Then::Sub(a) => c - of!(a),
                Then::From(a) => of!(a) - c,
                Then::Scale(i) => c * h!(i),
                Then::AddScaled(a, i) => c + of!(a) * h!(i),
                Then::SubScaled(a, i) => c - of!(a) * h!(i),
                Then::FromScaled(a, i) => of!(a) * h!(i) - c,
            };
        }
        c
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(node: Node, to: u16) -> Step {
        Step { node, to }
    }

    /// Lorenz's equations: `s (y - x)`, `x (r - z) - y`, `x y - b z`.
    #[test]
    fn what_is_used_once_is_handed_over() {
        let steps = [
            step(Node::Sub(1, 0), 3),
            step(Node::Scale(3, 0), 4),
            step(Node::From(1, 2), 5),
            step(Node::Mul(0, 5), 6),
            step(Node::Sub(6, 1), 7),
            step(Node::Mul(0, 1), 8),
            step(Node::Scale(2, 2), 9),
            step(Node::Sub(8, 9), 10),
        ];
        let chains = |rates: [u16; 3], fused| {
            let program = Program::of(&steps, &rates, 11, fused);
            (program.stretches[0].chains.len(), program.copied.len())
        };
        assert_eq!(chains([4, 7, 10], true), (4, 0));
        assert_eq!(chains([4, 7, 10], false), (8, 3));
        // A rate that is needed twice is stored, and a component of the state is the rate of another.
        assert_eq!(chains([4, 7, 7], true), (4, 2));
        assert_eq!(chains([1, 7, 10], true), (4, 1));
    }
}
