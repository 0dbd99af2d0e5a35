//! Machine code for the steps of a [`Program`].
//!
//! It does the same operations in the same order, so no bit changes. Elementary functions and comparisons are left to the
//! interpreter: the code between them is a function each.

use super::Unary;
use super::program::{Action, Program, Step};
use crate::machine::{Array, Code, Listing, Operand, Operation, Place, Register};
use crate::scalar::{Isa, Scalar};
use crate::sides::Sides;

/// Evaluations that are interpreted first: they take about as long as making the code does.
pub(super) const INTERPRETED: u32 = 512;

/// The most steps: longer code is not in the cache when it is needed.
const MOST_STEPS: usize = 1 << 13;

/// The code, and after each function but the last the step to interpret.
#[derive(Debug)]
pub(super) struct Compiled {
    code: Code,
    /// The place of the program's first register in the work.
    registers: usize,
    interpreted: Vec<Step>,
}

impl Compiled {
    /// Evaluates the steps. The registers of the state may be empty: it is taken from `x`.
    #[inline(always)]
    pub(super) fn run<S: Scalar>(&self, program: &Program, x: &[S], sides: &Sides<S>, work: &mut [S]) {
        if !self.interpreted.is_empty() {
            work[..program.states].copy_from_slice(&x[..program.states]);
        }
        self.follow(program, x, sides, (work, &mut []));
    }

    /// Runs the functions and interprets what is between them.
    #[inline(always)]
    pub(super) fn follow<S: Scalar>(
        &self,
        program: &Program,
        held: &[S],
        sides: &Sides<S>,
        (work, stages): (&mut [S], &mut [S]),
    ) {
        for i in 0..=self.interpreted.len() {
            self.code.run_step(i, (&mut *work, &mut *stages), held, sides);
            if let Some(&step) = self.interpreted.get(i) {
                program.perform(&[step], sides, &mut work[self.registers..]);
            }
        }
    }

    /// Returns true if the interpreter does some of the steps.
    pub(super) fn is_interrupted(&self) -> bool {
        !self.interpreted.is_empty()
    }
}

/// The code of a program for numbers of so many lanes.
pub(super) fn compile(program: &Program, isa: Isa, lanes: usize) -> Option<Compiled> {
    if program.steps.len() > MOST_STEPS {
        return None;
    }
    let mut writer = Writer::new(Listing::new(isa, lanes), vec![true; program.states], 0);
    writer.steps(&program.steps);
    writer.compiled(usize::MAX)
}

/// Registers for what a step works on, for a mask, and for the sign bit; the listing allocates others.
pub(super) const FIRST: Register = Register(0);
pub(super) const SECOND: Register = Register(1);
const MASK: Register = Register(2);
const SIGN: Register = Register(3);

pub(super) struct Writer {
    pub(super) list: Listing,
    /// The values, by their numbers, that are in the array `Held`; the others are in the array `Work`.
    held: Vec<bool>,
    /// The place of the program's first register in the array `Work`.
    registers: usize,
    interpreted: Vec<Step>,
}

impl Writer {
    pub(super) fn new(list: Listing, held: Vec<bool>, registers: usize) -> Self {
        let mut writer = Self { list, held, registers, interpreted: Vec::new() };
        writer.begin();
        writer
    }

    /// Writes these steps; the interpreter does some of them between two functions.
    pub(super) fn steps(&mut self, steps: &[Step]) {
        for &step in steps {
            if self.step(step).is_none() {
                self.list.end();
                self.begin();
                self.interpreted.push(step);
            }
        }
    }

    /// The code. Elements of the work from `results` on are not needed afterwards, unless the interpreter reads them.
    pub(super) fn compiled(mut self, results: usize) -> Option<Compiled> {
        self.list.end();
        let results = if self.interpreted.is_empty() { results } else { usize::MAX };
        let code = if self.list.allocate(results) { Code::new(self.list)? } else { return None };
        Some(Compiled { code, registers: self.registers, interpreted: self.interpreted })
    }

    /// Begins a function.
    fn begin(&mut self) {
        let sign = self.list.constant(-0.0);
        self.list.load(SIGN, sign);
    }

    /// The place of a register of the program.
    pub(super) fn place(&self, register: u16) -> Place {
        let register = usize::from(register);
        match self.held.get(register) {
            Some(true) => Place(Array::Held, register),
            _ => Place(Array::Work, self.registers + register),
        }
    }

    /// Loads the value of a register of the program.
    fn loaded(&mut self, register: u16, to: Register) -> Register {
        let place = self.place(register);
        self.list.load(to, place);
        to
    }

    /// `to = a . b` for registers of the program.
    fn apply(&mut self, operation: Operation, to: Register, a: u16, b: u16) {
        let a = self.loaded(a, to);
        let b = self.place(b);
        self.list.apply(operation, to, a, b);
    }

    /// The code of a step; `None` if it has to be interpreted.
    fn step(&mut self, step: Step) -> Option<()> {
        let (operation, a, b) = self.until_last(step)?;
        let to = self.place(step.to);
        self.write(to, operation, a, b);
        Some(())
    }

    /// Stores `a . b`.
    pub(super) fn write(&mut self, to: Place, operation: Operation, a: Register, b: Operand) {
        self.list.apply(operation, FIRST, a, b);
        self.list.store(to, FIRST);
    }

    /// Stores a copy.
    pub(super) fn copy(&mut self, from: Place, to: Place) {
        self.list.load(FIRST, from);
        self.list.store(to, FIRST);
    }

    /// Writes all operations of a step but the last, and returns that.
    fn until_last(&mut self, step: Step) -> Option<(Operation, Register, Operand)> {
        use Operation::{Add, And, AndNot, Div, Mul, Or, Root, Sub, Xor};
        let [a, b, c, d] = step.of;
        if matches!(
            step.action,
            Action::MulMul
                | Action::MulAdd
                | Action::MulSub
                | Action::SubMul
                | Action::SubMulMul
                | Action::MulAddMul
                | Action::MulSubMul
        ) {
            self.apply(Mul, FIRST, a, b);
        }
        Some(match step.action {
            Action::Add => (Add, self.loaded(a, FIRST), self.place(b).into()),
            Action::Sub => (Sub, self.loaded(a, FIRST), self.place(b).into()),
            Action::Mul => (Mul, self.loaded(a, FIRST), self.place(b).into()),
            Action::Div => (Div, self.loaded(a, FIRST), self.place(b).into()),
            Action::Square => (Mul, self.loaded(a, FIRST), self.place(a).into()),
            Action::Neg => (Xor, self.loaded(a, FIRST), SIGN.into()),
            Action::MulMul => (Mul, FIRST, self.place(c).into()),
            Action::MulAdd => (Add, FIRST, self.place(c).into()),
            Action::MulSub => (Sub, FIRST, self.place(c).into()),
            Action::SubMul => (Sub, self.loaded(c, SECOND), FIRST.into()),
            Action::SubMulMul => {
                let c = self.place(c);
                self.list.apply(Mul, FIRST, FIRST, c);
                (Sub, self.loaded(d, SECOND), FIRST.into())
            }
            Action::MulAddMul | Action::MulSubMul => {
                self.apply(Mul, SECOND, c, d);
                (if step.action == Action::MulAddMul { Add } else { Sub }, FIRST, SECOND.into())
            }
            Action::SquareAdd => {
                self.apply(Mul, FIRST, a, a);
                (Add, FIRST, self.place(b).into())
            }
            Action::Unary(Unary::Power(n @ 3..=16)) => {
                let a = self.loaded(a, SECOND);
                self.list.load(SECOND, a);
                self.power(n)
            }
            Action::Unary(Unary::Sqrt) => {
                let a = self.loaded(a, FIRST);
                (Root, a, a.into())
            }
            Action::Select(side) => {
                self.side(side);
                let (yes, no) = (self.loaded(a, FIRST), self.loaded(b, SECOND));
                self.list.apply(And, FIRST, MASK, yes);
                self.list.apply(AndNot, SECOND, MASK, no);
                (Or, FIRST, SECOND.into())
            }
            Action::Turn(side) | Action::Sign(side) => {
                self.side(side);
                // The sign bit on the lower side.
                self.list.apply(AndNot, MASK, MASK, SIGN);
                if step.action == Action::Turn(side) {
                    (Xor, self.loaded(a, FIRST), MASK.into())
                } else {
                    let unit = self.list.constant(1.0);
                    self.list.load(FIRST, unit);
                    (Xor, FIRST, MASK.into())
                }
            }
            _ => return None,
        })
    }

    fn side(&mut self, side: u8) {
        self.list.load(MASK, Place(Array::Sides, usize::from(side)));
    }

    /// A power of [`SECOND`], at least the third, by repeated squaring, up to the last product.
    fn power(&mut self, n: i32) -> (Operation, Register, Operand) {
        let mut any = false;
        for bit in 0..n.ilog2() {
            if n >> bit & 1 == 1 {
                match any {
                    true => self.list.apply(Operation::Mul, FIRST, FIRST, SECOND),
                    false => self.list.load(FIRST, SECOND),
                }
                any = true;
            }
            if bit + 1 < n.ilog2() || any {
                self.list.apply(Operation::Mul, SECOND, SECOND, SECOND);
            }
        }
        (Operation::Mul, if any { FIRST } else { SECOND }, SECOND.into())
    }
}

#[cfg(test)]
mod tests {
    use std::array::from_fn;

    use super::*;
    use crate::formula::{Expression, Kinks, Names, Place as At};
    use crate::machine::Codes;
    use crate::scalar::{LANES, Packet, Real};
    use crate::sides::MAX_SURFACES;

    /// A program of these formulas, with kinks where they have some.
    fn program(texts: &[&str]) -> Program {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let (states, parameters) = (names(&["x", "y", "z"]), names(&["a", "b"]));
        let names = Names { states: &states, parameters: &parameters, inputs: &[], rates: false };
        let mut kinks = Kinks::default();
        let parse = |text: &&str| {
            let mut parsed = Expression::parse(text, names).unwrap();
            kinks.of(&mut parsed);
            parsed
        };
        let parsed: Vec<_> = texts.iter().map(parse).collect();
        Program::of(&parsed)
    }

    /// The bits of the results before there is code, and with it.
    fn twice<S: Scalar>(program: &Program, x: [S; 3], bits: impl Fn(S) -> Vec<u64>) -> [Vec<u64>; 2] {
        // Copies share their code.
        let mut program = program.clone();
        program.codes = Codes::default();
        let fixed = program.fix(&[S::constant(0.7), S::constant(-1.3)]);
        let sides = from_fn(|j| S::mask(j % 2 == 0));
        let results = || {
            let mut results = vec![S::zero(); program.len()];
            let place = At { t: S::constant(0.5), x: &x, rates: &[], inputs: &[] };
            program.run(&place, &fixed, &sides, &mut results);
            results.into_iter().flat_map(&bits).collect()
        };
        let before = results();
        (0..INTERPRETED).for_each(|_| drop(results()));
        let compiled = program.codes.get::<S>(0, 0, |_| None).is_some();
        assert_eq!(compiled, cfg!(feature = "machine-code") && Isa::best() > Isa::Baseline);
        [before, results()]
    }

    fn changes_no_bit(texts: &[&str]) {
        let program = program(texts);
        for scale in [1.0, 0.0, -3.5, 1e300] {
            let x = [0.3, -2.1, 1.7].map(|x| scale * x);
            let bits = |value: f64| if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() };
            let [before, after] = twice(&program, x, |value| vec![bits(value)]);
            assert_eq!(before, after, "{texts:?} at {x:?}");
            let x = x.map(|x| Packet::<LANES>::from_lanes(|l| x * (1.0 + 0.1 * l as f64)));
            let [before, after] =
                twice(&program, x, |value| (0..LANES).map(|l| bits(value.lane(l))).collect());
            assert_eq!(before, after, "{texts:?} in packets");
        }
    }

    #[test]
    fn every_operation_keeps_its_bits() {
        changes_no_bit(&[
            "x*y*z",
            "x*y + z",
            "x*y - z",
            "z - x*y",
            "z - x*y*a",
            "x*y + z*a",
            "x*y - z*b",
            "x^2 + y",
        ]);
        changes_no_bit(&[
            "x/y",
            "-x",
            "x - a",
            "a - x",
            "x^2",
            "x^3 + y^7",
            "(x + y)^16",
            "x^17",
            "x^-2",
            "t*x",
            "y",
        ]);
        changes_no_bit(&["sqrt(x)", "sin(x)*y + cos(x*y)", "exp(x) - tanh(y)*(x + z)", "x^a", "atan2(x, y)"]);
        changes_no_bit(&[
            "abs(x)*y",
            "max(x, y) - z",
            "min(x, a)",
            "sign(z)*x",
            "where(x > y, x*y, z)",
            "sign(x)",
        ]);
    }

    #[test]
    fn more_values_than_registers() {
        let sum = (0..40).map(|i| format!("(x + {i})*(y - {i}.5*z)")).collect::<Vec<_>>();
        let (there, back) = (sum.join(" - "), sum.iter().rev().cloned().collect::<Vec<_>>().join(" + "));
        let deep = format!("{}z{}", "(x + y*(".repeat(30), " - a)/2)".repeat(30));
        changes_no_bit(&[&there, &back, &deep, &format!("sin({there})*({back})")]);
    }

    #[test]
    fn sides_are_those_of_the_call() {
        let program = program(&["abs(x)", "sign(x)"]);
        let fixed = program.fix(&[0.0, 0.0]);
        let mut results = [0.0; 2];
        for i in 0..2 * INTERPRETED {
            let side = i % 2 == 0;
            let at = At { t: 0.0, x: &[3.0, 0.0, 0.0], rates: &[], inputs: &[] };
            program.run(&at, &fixed, &[side; MAX_SURFACES], &mut results);
            assert_eq!(results, if side { [3.0, 1.0] } else { [-3.0, -1.0] });
        }
    }
}
