//! Machine code for the steps of a [`Program`].
//!
//! It does the same operations in the same order, so no bit changes. Each result is stored, and stays in a register, too,
//! until another result needs the register. Elementary functions and comparisons are left to the interpreter: the code
//! between them is a function each.

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
    interpreted: Vec<Step>,
}

impl Compiled {
    /// Evaluates the steps. The registers of the state may be empty: it is taken from `x`.
    #[inline(always)]
    pub(super) fn run<S: Scalar>(&self, program: &Program, x: &[S], sides: &Sides<S>, work: &mut [S]) {
        if !self.interpreted.is_empty() {
            work[..program.states].copy_from_slice(&x[..program.states]);
        }
        self.follow(program, x, sides, work);
    }

    /// Runs the functions and interprets what is between them.
    #[inline(always)]
    pub(super) fn follow<S: Scalar>(&self, program: &Program, held: &[S], sides: &Sides<S>, work: &mut [S]) {
        for i in 0..=self.interpreted.len() {
            self.code.run(i, work, held, sides);
            if let Some(&step) = self.interpreted.get(i) {
                program.perform(&[step], sides, work);
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
    let mut writer = Writer::new(Listing::new(isa, lanes), vec![true; program.states]);
    writer.steps(&program.steps);
    writer.compiled()
}

/// Registers for values; the others are for masks, for what is worked on, and for the sign bit.
const REGISTERS: usize = 12;
pub(super) const FIRST: Register = Register(12);
pub(super) const SECOND: Register = Register(13);
const MASK: Register = Register(14);
const SIGN: Register = Register(15);

pub(super) struct Writer {
    pub(super) list: Listing,
    /// The values, by their numbers, that are in the array `Held`; the others are in the array `Work`.
    held: Vec<bool>,
    /// The values in registers, and when each was used last.
    kept: [Option<(u16, usize)>; REGISTERS],
    time: usize,
    interpreted: Vec<Step>,
}

fn register(i: usize) -> Register {
    Register(u8::try_from(i).expect("sixteen registers"))
}

impl Writer {
    pub(super) fn new(list: Listing, held: Vec<bool>) -> Self {
        let mut writer = Self { list, held, kept: [None; REGISTERS], time: 0, interpreted: Vec::new() };
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

    pub(super) fn compiled(mut self) -> Option<Compiled> {
        self.list.end();
        Some(Compiled { code: Code::new(self.list)?, interpreted: self.interpreted })
    }

    /// Begins a function.
    fn begin(&mut self) {
        self.kept = [None; REGISTERS];
        let sign = self.list.constant(-0.0);
        self.list.load(SIGN, sign);
    }

    /// A value in its register, or in its place in memory.
    pub(super) fn operand(&mut self, value: u16) -> Operand {
        self.time += 1;
        for (i, kept) in self.kept.iter_mut().enumerate() {
            if let Some((other, used)) = kept
                && *other == value
            {
                *used = self.time;
                return register(i).into();
            }
        }
        let value = usize::from(value);
        let held = self.held.get(value).is_some_and(|&held| held);
        Place(if held { Array::Held } else { Array::Work }, value).into()
    }

    /// A value in its register, or loaded into this one.
    fn loaded(&mut self, value: u16, to: Register) -> Register {
        match self.operand(value) {
            Operand::Register(register) => register,
            place @ Operand::Place(_) => {
                self.list.load(to, place);
                to
            }
        }
    }

    /// The register for a new value: its former one, or the one whose value was used longest ago.
    fn room(&mut self, value: u16) -> Register {
        self.time += 1;
        let age = |kept: Option<(u16, usize)>| {
            kept.map_or(1, |(other, used)| if other == value { 0 } else { used + 1 })
        };
        let i = (0..REGISTERS).min_by_key(|&i| age(self.kept[i])).expect("a register");
        self.kept[i] = Some((value, self.time));
        register(i)
    }

    /// `to = a . b` for values.
    fn apply(&mut self, operation: Operation, to: Register, a: u16, b: u16) {
        let a = self.loaded(a, to);
        let b = self.operand(b);
        self.list.apply(operation, to, a, b);
    }

    /// The code of a step; `None` if it has to be interpreted.
    fn step(&mut self, step: Step) -> Option<()> {
        let (operation, a, b) = self.until_last(step)?;
        self.write(step.to, operation, a, b);
        Some(())
    }

    /// Stores `a . b` as a value, which stays in a register, too.
    pub(super) fn write(&mut self, value: u16, operation: Operation, a: Register, b: Operand) {
        // The operands may be in this register: it is written last.
        let to = self.room(value);
        self.list.apply(operation, to, a, b);
        self.list.store(Place(Array::Work, usize::from(value)), to);
    }

    /// Stores a copy of a value as another one.
    pub(super) fn copy(&mut self, from: u16, value: u16) {
        let from = self.operand(from);
        let to = self.room(value);
        self.list.load(to, from);
        self.list.store(Place(Array::Work, usize::from(value)), to);
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
            Action::Add => (Add, self.loaded(a, FIRST), self.operand(b)),
            Action::Sub => (Sub, self.loaded(a, FIRST), self.operand(b)),
            Action::Mul => (Mul, self.loaded(a, FIRST), self.operand(b)),
            Action::Div => (Div, self.loaded(a, FIRST), self.operand(b)),
            Action::Square => (Mul, self.loaded(a, FIRST), self.operand(a)),
            Action::Neg => (Xor, self.loaded(a, FIRST), SIGN.into()),
            Action::MulMul => (Mul, FIRST, self.operand(c)),
            Action::MulAdd => (Add, FIRST, self.operand(c)),
            Action::MulSub => (Sub, FIRST, self.operand(c)),
            Action::SubMul => (Sub, self.loaded(c, SECOND), FIRST.into()),
            Action::SubMulMul => {
                let c = self.operand(c);
                self.list.apply(Mul, FIRST, FIRST, c);
                (Sub, self.loaded(d, SECOND), FIRST.into())
            }
            Action::MulAddMul | Action::MulSubMul => {
                self.apply(Mul, SECOND, c, d);
                (if step.action == Action::MulAddMul { Add } else { Sub }, FIRST, SECOND.into())
            }
            Action::SquareAdd => {
                self.apply(Mul, FIRST, a, a);
                (Add, FIRST, self.operand(b))
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
