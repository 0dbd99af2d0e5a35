//! Machine code for the series of a tape.
//!
//! It does what [`Program::start`] and [`Program::next`] do, with the same operations in the same order: no bit changes.
//! Elementary functions, which have to be evaluated for order 0, are left to the interpreter.

mod operations;
mod rows;
mod sums;
#[cfg(test)]
mod tests;

pub(super) use sums::numbers;

use super::fuse::{Chain, Program};
use super::group::MOST;
use super::node::{INVERSE, Step};
use crate::machine::{Array, Code, Listing, Operand, Operation, Place, Register};
use crate::model::Sides;
use crate::scalar::{Isa, Scalar};

/// Steps that are interpreted first: they take about as long as making the code does.
pub(super) const INTERPRETED: u32 = 100;

/// The most operations. Code that does not fit into a core's second cache is hardly faster than its interpretation.
const MOST_OPERATIONS: usize = 1 << 16;

/// The number that is worked on.
const C: Register = Register(0);
/// The second sum of a product.
const ODD: Register = Register(1);
/// A factor.
const FACTOR: Register = Register(2);
/// The mask of a choice.
const MASK: Register = Register(3);
/// Halves of rows.
const HALF: Register = Register(4);
/// The sign bit.
const SIGN: Register = Register(15);

/// Code for the coefficients of the orders 1 to `order`, with room for `room` of them in each series. Behind the slots are the
/// plan's rows and held values, for single trajectories only, and the sums. [`numbers`] counts them all.
pub(super) fn series(program: &Program, isa: Isa, lanes: usize, room: usize, order: usize) -> Option<Code> {
    let rows = program.slots * room;
    let held = rows + MOST * program.plan.rows.len() * room;
    let ahead = rows + if lanes == 1 { program.plan.numbers(room) } else { 0 };
    let end = order.min(room - 1);
    let mut code = Series { rows, held, ahead, end, ..Series::new(Listing::new(isa, lanes), room) };
    let sign = code.list.constant(-0.0);
    if lanes == 1 {
        code.begin(&program.plan, program.components());
        code.list.set_width(4);
    }
    code.list.load(SIGN, sign);
    for k in 1..end {
        (code.k, code.product) = (k, 0);
        match lanes {
            1 => program.plan.tasks.iter().for_each(|task| code.task(&program.plan, task)),
            _ => code.order(program),
        }
        if code.list.len() > MOST_OPERATIONS {
            return None;
        }
    }
    code.list.end();
    // The other series are intermediate results.
    if code.list.allocate(program.components() * room) { Code::new(code.list) } else { None }
}

/// Code for the coefficients of order 0: a function before each step that is interpreted, and one for the end.
#[derive(Debug)]
pub(super) struct Start {
    code: Code,
    interpreted: Vec<Step>,
}

impl Start {
    #[inline(always)]
    pub(super) fn run<S: Scalar, const N: usize>(
        &self,
        work: &mut [[S; N]],
        held: &[S],
        t: S,
        sides: &Sides<S>,
    ) {
        for i in 0..=self.interpreted.len() {
            self.code.run(i, work.as_flattened_mut(), held, sides);
            if let Some(step) = self.interpreted.get(i) {
                step.start(work, held, t, sides);
            }
        }
    }
}

/// Code for the coefficients of order 0, with room for `room` coefficients in each series.
pub(super) fn start(program: &Program, isa: Isa, lanes: usize, room: usize) -> Option<Start> {
    let mut code = Series::new(Listing::new(isa, lanes), room);
    let mut interpreted = Vec::new();
    let sign = code.list.constant(-0.0);
    code.list.load(SIGN, sign);
    for stretch in &program.stretches {
        stretch.chains.iter().for_each(|chain| code.chain(chain));
        if let Some(step) = stretch.last
            && code.first(step).is_none()
        {
            interpreted.push(step);
            code.list.end();
            code.list.load(SIGN, sign);
        }
        if code.list.len() > MOST_OPERATIONS {
            return None;
        }
    }
    for &(slot, n) in &program.copied {
        code.chain(&Chain::copy(slot, n));
    }
    code.list.end();
    if !code.list.allocate(usize::MAX) {
        return None;
    }
    Some(Start { code: Code::new(code.list)?, interpreted })
}

struct Series {
    list: Listing,
    /// The first number of the rows, and of the held values behind them.
    rows: usize,
    held: usize,
    room: usize,
    k: usize,
    /// Slots are the numbers of rows now, and held values those of their rows.
    in_rows: bool,
    /// The first number of the sums ahead, and the number of the next product of an order.
    ahead: usize,
    product: usize,
    /// The first order that is not computed.
    end: usize,
}

impl Series {
    fn new(list: Listing, room: usize) -> Self {
        Self { list, rows: 0, held: 0, room, k: 0, in_rows: false, ahead: 0, product: 0, end: 0 }
    }

    fn order(&mut self, program: &Program) {
        for stretch in &program.stretches {
            stretch.chains.iter().for_each(|chain| self.chain(chain));
            if let Some(step) = stretch.last {
                self.step(step);
            }
        }
        for &(slot, n) in &program.copied {
            self.chain(&Chain::copy(slot, n));
        }
    }

    /// The place of a coefficient.
    fn place(&self, slot: u16, k: usize) -> Place {
        if self.in_rows {
            self.in_row(usize::from(slot), k)
        } else {
            Place(Array::Work, usize::from(slot) * self.room + k)
        }
    }

    fn held(&self, h: u16) -> Place {
        if self.in_rows {
            Place(Array::Work, self.held + MOST * usize::from(h))
        } else {
            Place(Array::Held, usize::from(h))
        }
    }

    fn load(&mut self, to: Register, slot: u16, k: usize) {
        self.list.load(to, self.place(slot, k));
    }

    fn store(&mut self, slot: u16) {
        self.list.store(self.place(slot, self.k), C);
    }

    fn apply(&mut self, operation: Operation, b: impl Into<Operand>) {
        self.list.apply(operation, C, C, b);
    }

    /// `c` times a constant.
    fn scale(&mut self, factor: f64) {
        let factor = self.list.constant(factor);
        if self.list.width() == 1 {
            return self.apply(Operation::Mul, factor);
        }
        self.list.load(FACTOR, factor);
        self.apply(Operation::Mul, FACTOR);
    }

    /// Stores `c` as the rate of a component.
    fn rate(&mut self, n: u16) {
        if self.k > 0 {
            self.scale(INVERSE[self.k + 1]);
        }
        self.list.store(self.place(n, self.k + 1), C);
    }

    /// Adds `a b` to the sum in a register, or begins the sum if there is not `any`. Returns true: now there is one.
    fn with(&mut self, sum: Register, any: bool, a: (u16, usize), b: (u16, usize)) -> bool {
        self.load(FACTOR, a.0, a.1);
        let b = self.place(b.0, b.1);
        self.times(sum, any, FACTOR, b)
    }

    /// The same with the factor `a` in a register.
    fn times(&mut self, sum: Register, any: bool, a: Register, b: impl Into<Operand>) -> bool {
        // An empty sum is -0, and adding that changes nothing.
        match any {
            true => self.list.apply(Operation::Fused, sum, a, b),
            false => self.list.apply(Operation::Mul, sum, a, b),
        }
        true
    }
}
