//! Formulas as one list of operations on registers: a small tape.
//!
//! Values that formulas share are evaluated once, and values of parameters alone are evaluated when these are known. Every operation is one of the text: the results are those of the text, to the last bit.

use std::collections::HashMap;

use super::compile::{self, Compiled};
use super::{Binary, Expression, Kink, Leaf, Op, Spline, Unary};
use crate::machine::Codes;
use crate::scalar::{Isa, Scalar};
use crate::sides::{MAX_SURFACES, Sides};

/// The point at which formulas are evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a, S> {
    pub t: S,
    pub x: &'a [S],
    /// May be empty if no formula [has rates](Expression::has_rates).
    pub rates: &'a [S],
    pub inputs: &'a [S],
}

/// The effect of an operation on its registers `a`, `b`, `c` and `d`. Each operation of the text is rounded by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    Add,
    Sub,
    Mul,
    Div,
    Neg,
    Square,
    /// `a b c`
    MulMul,
    /// `a b + c`
    MulAdd,
    /// `a b - c`
    MulSub,
    /// `c - a b`
    SubMul,
    /// `d - a b c`
    SubMulMul,
    /// `a b + c d`
    MulAddMul,
    /// `a b - c d`
    MulSubMul,
    /// `a^2 + b`
    SquareAdd,
    Unary(Unary),
    Binary(Binary),
    Where,
    /// `a` on the positive side of this surface, else `b`.
    Select(u8),
    /// `a` on the positive side of this surface, else `-a`.
    Turn(u8),
    /// 1 on the positive side of this surface, else -1.
    Sign(u8),
    /// The kink's own value, which a recording takes on the side of this surface.
    Compared(Kink, u8),
    /// `a`, or `b` if `a` is negative; a recording has `a`.
    Defined,
    /// By its number; its coefficients are in the registers from `b` on.
    Spline(u16),
}

/// An operation and the register of its result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    pub(super) action: Action,
    pub(super) of: [u16; 4],
    pub(super) to: u16,
}

/// Formulas, ready to be evaluated.
///
/// ```
/// use udd::formula::{Expression, Names, Place, Program};
/// let states = ["omega", "y", "z"].map(String::from);
/// let names = Names { states: &states, parameters: &["w".to_owned()], inputs: &[], rates: false };
/// let energy = Expression::parse("(y^2 + z^2)/2 = w", names).unwrap();
/// let place = Place { t: 0.0, x: &[1.0, 2.0, 4.0], rates: &[], inputs: &[] };
/// assert_eq!(Program::of([&energy]).value(&place, &[7.0]), 3.0);
/// assert!(Expression::parse("q - 1", names).is_err());
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// The first registers hold so many components of the state.
    pub(super) states: usize,
    /// The next ones hold these.
    pub(super) leaves: Vec<Leaf>,
    /// How many of them the parameters determine: they are the last ones.
    pub(super) constants: usize,
    splines: Vec<Spline>,
    /// Operations on parameters and numbers alone. Their registers hold nothing else.
    pub(super) first: Vec<Step>,
    pub(super) steps: Vec<Step>,
    pub(super) results: Vec<u16>,
    registers: usize,
    pub(super) codes: Codes<Compiled>,
    /// Those of whole steps of a Runge-Kutta method.
    pub(super) step_codes: Codes<Compiled>,
}

/// The numbers of registers that programs have room for without an allocation: powers of two.
const ROOMS: [usize; 4] = [8, 16, 32, 64];

/// The registers of a program.
pub(super) trait Room<S> {
    fn at(&self, register: u16) -> S;
    fn put(&mut self, register: u16, value: S);
    /// All of them.
    fn all(&mut self) -> &mut [S];
}

/// A program has as many registers, or fewer: the remainder is the number itself, and the compiler need not check it.
impl<S: Scalar, const R: usize> Room<S> for [S; R] {
    #[inline(always)]
    fn at(&self, register: u16) -> S {
        self[usize::from(register) % R]
    }

    #[inline(always)]
    fn put(&mut self, register: u16, value: S) {
        self[usize::from(register) % R] = value;
    }

    #[inline(always)]
    fn all(&mut self) -> &mut [S] {
        self
    }
}

impl<S: Scalar> Room<S> for [S] {
    #[inline(always)]
    fn at(&self, register: u16) -> S {
        self[usize::from(register)]
    }

    #[inline(always)]
    fn put(&mut self, register: u16, value: S) {
        self[usize::from(register)] = value;
    }

    #[inline(always)]
    fn all(&mut self) -> &mut [S] {
        self
    }
}

impl Program {
    /// For these formulas.
    pub fn of<'a>(formulas: impl IntoIterator<Item = &'a Expression>) -> Self {
        Self::from_graph(Graph::default(), formulas)
    }

    /// For a formula in which state `size` is `|state|`, with its sign on the side where a step began.
    pub fn with_size(formula: &Expression, size: usize, state: usize) -> Self {
        Self::from_graph(Graph { size: Some((size, state)), ..Graph::default() }, [formula])
    }

    fn from_graph<'a>(mut graph: Graph, formulas: impl IntoIterator<Item = &'a Expression>) -> Self {
        let results: Vec<usize> = formulas.into_iter().map(|formula| graph.add(formula)).collect();
        graph.lower(&results)
    }

    /// How many results there are.
    pub fn len(&self) -> usize {
        self.results.len()
    }

    /// Returns true if there are none.
    pub fn is_empty(&self) -> bool {
        self.results.is_empty()
    }

    /// Returns true if they need the rates of the state.
    pub fn has_rates(&self) -> bool {
        self.leaves.iter().any(|leaf| matches!(leaf, Leaf::Rate(_)))
    }

    /// Returns true if all operations, but those on parameters alone, are sums, products and choices by sides: numbers with
    /// derivatives then have the values of plain numbers, to the last bit.
    pub fn is_ring(&self) -> bool {
        self.steps.iter().all(|step| match step.action {
            Action::Add | Action::Sub | Action::Mul | Action::Neg | Action::Square => true,
            Action::MulMul | Action::MulAdd | Action::MulSub | Action::SubMul | Action::SubMulMul => true,
            Action::MulAddMul | Action::MulSubMul | Action::SquareAdd => true,
            Action::Select(_) | Action::Turn(_) | Action::Sign(_) => true,
            Action::Div | Action::Unary(_) | Action::Binary(_) | Action::Where => false,
            Action::Compared(..) | Action::Defined | Action::Spline(_) => false,
        })
    }

    /// The component of the state that the only result is, if it is one: most surfaces are.
    #[inline(always)]
    pub fn component(&self) -> Option<usize> {
        match self.results[..] {
            [at] => Some(usize::from(at)).filter(|&n| n < self.states),
            _ => None,
        }
    }

    /// Computes the values that depend on parameters alone, for [`run`](Program::run): all registers as a run begins with
    /// them.
    ///
    /// # Panics
    /// If there are fewer parameters than the formulas take.
    pub fn fix<S: Scalar>(&self, parameters: &[S]) -> Vec<S> {
        let mut work = vec![S::zero(); self.room()];
        self.determine(&|i| parameters[i], &mut work);
        work
    }

    /// The results at a place, after [`fix`](Program::fix), with [kinks](super::Kinks) taken on these sides.
    ///
    /// # Panics
    /// If the place lacks what the formulas take, or the results have no room.
    #[inline(always)]
    pub fn run<S: Scalar>(&self, place: &Place<'_, S>, fixed: &[S], sides: &Sides<S>, results: &mut [S]) {
        if let Some(n) = self.component() {
            results[0] = place.x[n];
            return;
        }
        // Plain numbers are dispatched faster than their registers are checked.
        macro_rules! follow_in {
            ($($k:literal)+) => {
                $(if let Ok(fixed) = <&[S; ROOMS[$k]]>::try_from(fixed) {
                    let mut work = *fixed;
                    return match const { size_of::<S>() == size_of::<f64>() } {
                        true => self.follow(place, sides, &mut work, results),
                        false => self.follow(place, sides, &mut work[..], results),
                    };
                })+
            };
        }
        follow_in!(0 1 2 3);
        self.follow(place, sides, &mut fixed.to_vec()[..], results);
    }

    /// The same with these parameters.
    pub fn run_with<S: Scalar>(
        &self,
        place: &Place<'_, S>,
        parameters: &[S],
        sides: &Sides<S>,
        results: &mut [S],
    ) {
        self.run_anew(place, &|i| parameters[i], sides, results);
    }

    /// The first result with these parameters, on the upper side of every kink.
    pub fn value<S: Scalar>(&self, place: &Place<'_, S>, parameters: &[S]) -> S {
        self.value_at(place, &|i| parameters[i])
    }

    /// The same where parameters are asked for by their numbers.
    pub fn value_at<S: Scalar>(&self, place: &Place<'_, S>, parameter: &dyn Fn(usize) -> S) -> S {
        let mut results = [S::zero()];
        self.run_anew(place, parameter, &[S::mask(true); MAX_SURFACES], &mut results);
        results[0]
    }

    /// The same after [`fix`](Program::fix). `lift` makes numbers of the place from the fixed values.
    pub fn value_after<S: Scalar, A: Scalar>(
        &self,
        place: &Place<'_, A>,
        fixed: &[S],
        lift: &impl Fn(S) -> A,
    ) -> A {
        let mut results = [A::zero()];
        let first = self.states + self.leaves.len() - self.constants;
        let end = first + self.constants + self.first.len();
        self.with_registers(|work: &mut [A]| {
            for (register, &value) in work[first..end].iter_mut().zip(&fixed[first..end]) {
                *register = lift(value);
            }
            self.follow(place, &[A::mask(true); MAX_SURFACES], work, &mut results);
        });
        results[0]
    }

    #[inline(never)]
    fn run_anew<S: Scalar>(
        &self,
        place: &Place<'_, S>,
        parameter: &dyn Fn(usize) -> S,
        sides: &Sides<S>,
        results: &mut [S],
    ) {
        self.with_registers(|work: &mut [S]| {
            self.determine(parameter, work);
            self.follow(place, sides, work, results);
        });
    }

    /// Does the work with registers that are zero, without an allocation if they have room.
    #[inline(always)]
    fn with_registers<S: Scalar>(&self, work: impl FnOnce(&mut [S])) {
        match self.room() {
            room if room <= ROOMS[0] => work(&mut [S::zero(); ROOMS[0]]),
            room if room <= ROOMS[1] => work(&mut [S::zero(); ROOMS[1]]),
            room if room <= ROOMS[2] => work(&mut [S::zero(); ROOMS[2]]),
            room if room <= ROOMS[3] => work(&mut [S::zero(); ROOMS[3]]),
            room => work(&mut vec![S::zero(); room]),
        }
    }

    /// The number of registers that it runs with.
    pub(super) fn room(&self) -> usize {
        ROOMS.into_iter().find(|&room| self.registers <= room).unwrap_or(self.registers)
    }

    /// Evaluates what only parameters determine.
    #[inline(never)]
    fn determine<S: Scalar>(&self, parameter: &dyn Fn(usize) -> S, work: &mut [S]) {
        for (work, leaf) in work[self.states..].iter_mut().zip(&self.leaves) {
            match *leaf {
                Leaf::Number(value) => *work = S::constant(value),
                Leaf::Parameter(i) => *work = parameter(i),
                _ => {}
            }
        }
        // None of them has a side.
        self.perform(&self.first, &[S::mask(true); MAX_SURFACES], work);
    }

    /// Evaluates the rest.
    // One function for each kind of number and of room: its loop is large.
    #[inline(never)]
    fn follow<S: Scalar, W: Room<S> + ?Sized>(
        &self,
        place: &Place<'_, S>,
        sides: &Sides<S>,
        work: &mut W,
        results: &mut [S],
    ) {
        let varying = &self.leaves[..self.leaves.len() - self.constants];
        for (at, leaf) in (register(self.states)..).zip(varying) {
            match *leaf {
                Leaf::Time => work.put(at, place.t),
                Leaf::Rate(n) => work.put(at, place.rates[n]),
                Leaf::Input(k) => work.put(at, place.inputs[k]),
                Leaf::State(_) | Leaf::Number(_) | Leaf::Parameter(_) => {}
            }
        }
        let code = |lanes| compile::compile(self, Isa::best(), lanes);
        if let Some(compiled) = self.codes.get::<S>(0, compile::INTERPRETED, code) {
            compiled.run(self, place.x, sides, work.all());
            for (result, &at) in results.iter_mut().zip(&self.results) {
                *result = if usize::from(at) < self.states { place.x[usize::from(at)] } else { work.at(at) };
            }
            return;
        }
        for (at, &component) in (0..).zip(&place.x[..self.states]) {
            work.put(at, component);
        }
        self.perform(&self.steps, sides, work);
        for (result, &at) in results.iter_mut().zip(&self.results) {
            *result = work.at(at);
        }
    }

    /// Does the steps one after the other.
    #[inline(always)]
    pub(super) fn perform<S: Scalar, W: Room<S> + ?Sized>(
        &self,
        steps: &[Step],
        sides: &Sides<S>,
        work: &mut W,
    ) {
        for step in steps {
            let [a, b, c, d] = step.of;
            macro_rules! of {
                ($register:ident) => {
                    work.at($register)
                };
            }
            let value = match step.action {
                Action::Add => of!(a) + of!(b),
                Action::Sub => of!(a) - of!(b),
                Action::Mul => of!(a) * of!(b),
                Action::Div => of!(a) / of!(b),
                Action::Neg => -of!(a),
                Action::Square => of!(a).square(),
                Action::MulMul => of!(a) * of!(b) * of!(c),
                Action::MulAdd => of!(a) * of!(b) + of!(c),
                Action::MulSub => of!(a) * of!(b) - of!(c),
                Action::SubMul => of!(c) - of!(a) * of!(b),
                Action::SubMulMul => of!(d) - of!(a) * of!(b) * of!(c),
                Action::MulAddMul => of!(a) * of!(b) + of!(c) * of!(d),
                Action::MulSubMul => of!(a) * of!(b) - of!(c) * of!(d),
                Action::SquareAdd => of!(a).square() + of!(b),
                Action::Unary(function) => function.of(of!(a)),
                Action::Binary(function) => function.of(of!(a), of!(b)),
                Action::Where => S::jumping(S::zero().less(of!(a)), of!(b), of!(c)),
                Action::Select(side) => S::select(sides[usize::from(side)], of!(a), of!(b)),
                Action::Turn(side) => S::select(sides[usize::from(side)], of!(a), -of!(a)),
                Action::Sign(side) => S::select(sides[usize::from(side)], S::one(), -S::one()),
                Action::Compared(kink, side) => match kink {
                    _ if S::SYMBOLIC => {
                        let (yes, no) = kink.branches(of!(a), of!(b));
                        S::select(sides[usize::from(side)], yes, no)
                    }
                    Kink::Min => Binary::Min.of(of!(a), of!(b)),
                    Kink::Max => Binary::Max.of(of!(a), of!(b)),
                    _ => Unary::Abs.of(of!(a)),
                },
                Action::Defined if S::SYMBOLIC => of!(a),
                Action::Defined => S::select(of!(a).less(S::zero()), of!(b), of!(a)),
                Action::Spline(own) => {
                    let spline = self.splines[usize::from(own)];
                    spline.of(of!(a), &|i| work.at(b + register(i - spline.first)))
                }
            };
            work.put(step.to, value);
        }
    }
}

/// How a value is made of others.
#[derive(Clone, Copy, Debug)]
struct Made {
    op: Op,
    of: [usize; 3],
    /// Parameters and numbers determine it.
    fixed: bool,
}

/// How deep in a product kinks are sought.
const DEEPEST: usize = 16;

/// The key of equal values: the operation's name, its numbers and its operands.
type Likeness = (&'static str, [u64; 6], [usize; 3]);

/// All values of some formulas, equal ones merged. A value comes after those that it is made of.
#[derive(Debug, Default)]
struct Graph {
    made: Vec<Made>,
    known: HashMap<Likeness, usize>,
    /// A state that is the absolute value of another one, on the side where a step began.
    size: Option<(usize, usize)>,
}

/// The operands, of those on the stack, that the value of an operation depends on.
fn needed(op: Op) -> std::ops::Range<usize> {
    match op {
        Op::On(Kink::Sign, _) => 0..0,
        // The side says what the condition is.
        Op::On(Kink::Where, _) => 1..3,
        op => 0..op.takes(),
    }
}

impl Graph {
    /// The value of a formula.
    fn add(&mut self, formula: &Expression) -> usize {
        let mut stack: Vec<usize> = Vec::new();
        for &op in formula.ops() {
            let operands = stack.split_off(stack.len() - op.takes());
            let mut of = [0; 3];
            of[..operands.len()].copy_from_slice(&operands);
            if let Op::Spline(spline) = op {
                // One after the other; a parameter may be one of several curves.
                for (k, i) in spline.parameters().enumerate() {
                    let at = self.coefficient(i, spline, k);
                    of[1] = if k == 0 { at } else { of[1] };
                }
            }
            if matches!(op, Op::Binary(Binary::Power) | Op::Unary(Unary::Sqrt | Unary::Ln)) {
                of[0] = self.defined(of[0]);
            }
            stack.push(self.value(op, of));
        }
        stack[0]
    }

    /// An argument of a function that negative numbers have no value of.
    ///
    /// A step may end beyond a surface, and is evaluated on the side where it began: there `abs(x)` is negative. A law
    /// without a value would shorten steps for ever, so it has that of the kink itself.
    fn defined(&mut self, i: usize) -> usize {
        match self.compared(i, DEEPEST) {
            other if other == i => i,
            other => self.value(Op::Defined, [i, other, 0]),
        }
    }

    /// A product of kinks by their own values, or the value itself if there are none.
    fn compared(&mut self, i: usize, deepest: usize) -> usize {
        let Made { op, of, .. } = self.made[i];
        match op {
            Op::On(kink @ (Kink::Abs | Kink::Min | Kink::Max), side) => {
                self.value(Op::Compared(kink, side), of)
            }
            Op::Push(Leaf::State(n)) => match self.size {
                Some((size, state)) if size == n => {
                    let signed = self.value(Op::Push(Leaf::State(state)), [0; 3]);
                    self.value(Op::Unary(Unary::Abs), [signed, 0, 0])
                }
                _ => i,
            },
            Op::Unary(Unary::Neg) | Op::Binary(Binary::Mul | Binary::Div) if deepest > 0 => {
                let mut new = of;
                for k in 0..op.takes() {
                    new[k] = self.compared(of[k], deepest - 1);
                }
                if new == of { i } else { self.value(op, new) }
            }
            _ => i,
        }
    }

    /// The coefficient `k` of a curve.
    fn coefficient(&mut self, parameter: usize, spline: Spline, k: usize) -> usize {
        let likeness = ("coefficient", [spline.first as u64, spline.count as u64, k as u64, 0, 0, 0], [0; 3]);
        let op = Op::Push(Leaf::Parameter(parameter));
        self.merged(likeness, Made { op, of: [0; 3], fixed: true })
    }

    fn value(&mut self, op: Op, of: [usize; 3]) -> usize {
        let mut numbers = [op.number().to_bits(), 0, 0, 0, 0, 0];
        match op {
            Op::On(_, side) => numbers[1] = 1 + u64::from(side),
            Op::Compared(kink, side) => numbers[1] = 1 + u64::from(side) + ((kink as u64) << 8),
            Op::Spline(own) => {
                numbers = [own.first as u64, own.count as u64, own.low.to_bits(), own.per.to_bits(), 0, 0];
            }
            _ => {}
        }
        let fixed = match op {
            Op::Push(leaf) => matches!(leaf, Leaf::Number(_) | Leaf::Parameter(_)),
            Op::On(..) | Op::Compared(..) => false,
            op => needed(op).all(|i| self.made[of[i]].fixed),
        };
        let unary = u64::from(op.takes() == 1);
        numbers[5] = unary;
        self.merged((op.name(), numbers, of), Made { op, of, fixed })
    }

    fn merged(&mut self, likeness: Likeness, made: Made) -> usize {
        *self.known.entry(likeness).or_insert_with(|| {
            self.made.push(made);
            self.made.len() - 1
        })
    }

    /// Which values the results need, and how many of those need each.
    fn uses(&self, results: &[usize]) -> Vec<usize> {
        let mut uses = vec![0; self.made.len()];
        results.iter().for_each(|&i| uses[i] += 1);
        for i in (0..self.made.len()).rev() {
            let Made { op, of, .. } = self.made[i];
            if uses[i] == 0 {
                continue;
            }
            needed(op).for_each(|k| uses[of[k]] += 1);
            if let Op::Spline(spline) = op {
                (0..spline.count).for_each(|k| uses[of[1] + k] += 1);
            }
        }
        uses
    }

    /// The factors of a product that only one value needs.
    fn product(&self, uses: &[usize], i: usize) -> Option<[usize; 2]> {
        let Made { op, of: [a, b, _], fixed } = self.made[i];
        (op == Op::Binary(Binary::Mul) && uses[i] == 1 && !fixed).then_some([a, b])
    }

    /// The root of a square that only one value needs.
    fn square(&self, uses: &[usize], i: usize) -> Option<usize> {
        let Made { op, of: [a, ..], fixed } = self.made[i];
        (op == Op::Unary(Unary::Power(2)) && uses[i] == 1 && !fixed).then_some(a)
    }

    /// The action of a sum, difference or product together with the values that nothing else needs, and these.
    fn fused(&self, uses: &[usize], i: usize) -> Option<(Action, [usize; 4], Vec<usize>)> {
        let Made { op, of: [a, b, _], fixed } = self.made[i];
        if fixed {
            return None;
        }
        let product = |i: usize| self.product(uses, i);
        let square = |i: usize| self.square(uses, i);
        let fused = match op {
            Op::Binary(Binary::Add) => match (product(a), product(b)) {
                (Some([f, g]), Some([h, k])) => (Action::MulAddMul, [f, g, h, k], vec![a, b]),
                (Some([f, g]), None) => (Action::MulAdd, [f, g, b, b], vec![a]),
                (None, Some([f, g])) => (Action::MulAdd, [f, g, a, a], vec![b]),
                (None, None) => match (square(a), square(b)) {
                    (_, Some(f)) => (Action::SquareAdd, [f, a, a, a], vec![b]),
                    (Some(f), None) => (Action::SquareAdd, [f, b, b, b], vec![a]),
                    (None, None) => return None,
                },
            },
            Op::Binary(Binary::Sub) => match (product(a), product(b)) {
                (Some([f, g]), Some([h, k])) => (Action::MulSubMul, [f, g, h, k], vec![a, b]),
                (Some([f, g]), None) => (Action::MulSub, [f, g, b, b], vec![a]),
                (None, Some([f, g])) => match product(f) {
                    Some([h, k]) => (Action::SubMulMul, [h, k, g, a], vec![b, f]),
                    None => (Action::SubMul, [f, g, a, a], vec![b]),
                },
                (None, None) => return None,
            },
            Op::Binary(Binary::Mul) => {
                let [f, g] = product(a)?;
                (Action::MulMul, [f, g, b, b], vec![a])
            }
            _ => return None,
        };
        Some(fused)
    }

    fn lower(&self, results: &[usize]) -> Program {
        let uses = self.uses(results);
        let is_leaf = |i: usize| matches!(self.made[i].op, Op::Push(_));
        let live: Vec<usize> = (0..self.made.len()).filter(|&i| uses[i] > 0).collect();
        let mut registers = Registers::new(self, live.iter().copied().filter(|&i| is_leaf(i)));
        let mut parts: [Vec<(usize, Action, [usize; 4])>; 2] = Default::default();
        let mut absorbed = vec![false; self.made.len()];
        for i in live.into_iter().rev().filter(|&i| !is_leaf(i)) {
            if absorbed[i] {
                continue;
            }
            let Made { op, of, fixed } = self.made[i];
            let (action, of) = match self.fused(&uses, i) {
                Some((action, of, parts)) => {
                    parts.into_iter().for_each(|part| absorbed[part] = true);
                    (action, of)
                }
                None => registers.action(op, of),
            };
            parts[usize::from(!fixed)].push((i, action, of));
        }
        parts.iter_mut().for_each(|part| part.reverse());
        registers.program(parts, results)
    }
}

impl Action {
    /// The number of operands whose registers are read.
    fn reads(self) -> usize {
        match self {
            Action::Sign(_) => 0,
            Action::Neg | Action::Square | Action::Unary(_) | Action::Turn(_) | Action::Spline(_) => 1,
            Action::Add | Action::Sub | Action::Mul | Action::Div | Action::Binary(_) => 2,
            Action::SquareAdd | Action::Select(_) | Action::Compared(..) | Action::Defined => 2,
            Action::MulMul | Action::MulAdd | Action::MulSub | Action::SubMul | Action::Where => 3,
            Action::SubMulMul | Action::MulAddMul | Action::MulSubMul => 4,
        }
    }
}

/// Gives values their registers; one that nothing needs any more is used again.
struct Registers<'a> {
    graph: &'a Graph,
    states: usize,
    leaves: Vec<Leaf>,
    constants: usize,
    splines: Vec<Spline>,
    of: Vec<u16>,
    free: Vec<u16>,
    count: usize,
}

impl<'a> Registers<'a> {
    fn new(graph: &'a Graph, leaves: impl Iterator<Item = usize>) -> Self {
        let mut of = vec![0; graph.made.len()];
        let (mut others, mut states) = (Vec::new(), 0);
        for i in leaves {
            match graph.made[i].op {
                Op::Push(Leaf::State(n)) => {
                    of[i] = register(n);
                    states = states.max(n + 1);
                }
                Op::Push(leaf) => others.push((i, leaf)),
                _ => unreachable!("only leaves are pushed"),
            }
        }
        others.sort_by_key(|&(i, _)| graph.made[i].fixed);
        for (at, &(i, _)) in others.iter().enumerate() {
            of[i] = register(states + at);
        }
        let constants = others.iter().filter(|&&(i, _)| graph.made[i].fixed).count();
        let leaves: Vec<Leaf> = others.into_iter().map(|(_, leaf)| leaf).collect();
        let count = states + leaves.len();
        Self { graph, states, leaves, constants, splines: Vec::new(), of, free: Vec::new(), count }
    }

    /// The action of an operation by itself, and its operands.
    fn action(&mut self, op: Op, [a, b, c]: [usize; 3]) -> (Action, [usize; 4]) {
        let action = match op {
            Op::Push(_) => unreachable!("leaves have registers"),
            Op::Unary(Unary::Neg) => Action::Neg,
            Op::Unary(Unary::Power(2)) => Action::Square,
            Op::Unary(function) => Action::Unary(function),
            Op::Binary(Binary::Add) => Action::Add,
            Op::Binary(Binary::Sub) => Action::Sub,
            Op::Binary(Binary::Mul) => Action::Mul,
            Op::Binary(Binary::Div) => Action::Div,
            Op::Binary(function) => Action::Binary(function),
            Op::Spline(spline) => {
                self.splines.push(spline);
                Action::Spline(register(self.splines.len() - 1))
            }
            Op::Where => Action::Where,
            Op::On(Kink::Abs, side) => Action::Turn(side),
            Op::On(Kink::Sign, side) => Action::Sign(side),
            Op::Compared(kink, side) => {
                return (Action::Compared(kink, side), [a, if kink.takes() == 1 { a } else { b }, a, a]);
            }
            Op::Defined => Action::Defined,
            Op::On(Kink::Max, side) => Action::Select(side),
            // The surface is where the first number is the second.
            Op::On(Kink::Min, side) => return (Action::Select(side), [b, a, a, a]),
            // The side says what the condition is.
            Op::On(Kink::Where, side) => return (Action::Select(side), [b, c, c, c]),
        };
        (action, [a, b, c, c])
    }

    fn program(mut self, [first, rest]: [Vec<(usize, Action, [usize; 4])>; 2], results: &[usize]) -> Program {
        // The last use of each value. Values of parameters alone stay, so that the steps can be repeated.
        let mut last = vec![None; self.graph.made.len()];
        for (at, (_, action, of)) in rest.iter().enumerate() {
            of[..action.reads()].iter().for_each(|&i| last[i] = Some(at));
        }
        let made = &self.graph.made;
        let first: Vec<Step> = first.iter().map(|&(i, action, of)| self.step(i, action, of)).collect();
        let mut steps = Vec::with_capacity(rest.len());
        for (at, &(i, action, of)) in rest.iter().enumerate() {
            let operands = of.map(|k| self.of[k]);
            for &i in &of[..action.reads()] {
                let done = last[i] == Some(at) && !made[i].fixed && !results.contains(&i);
                let own = self.of[i];
                if done && usize::from(own) >= self.states + self.leaves.len() && !self.free.contains(&own) {
                    self.free.push(own);
                }
            }
            let mut step = self.step(i, action, of);
            step.of = operands;
            steps.push(step);
        }
        let at = |list: &[usize]| list.iter().map(|&i| self.of[i]).collect();
        Program {
            results: at(results),
            states: self.states,
            leaves: self.leaves,
            constants: self.constants,
            splines: self.splines,
            first,
            steps,
            registers: self.count,
            codes: Codes::default(),
            step_codes: Codes::default(),
        }
    }

    /// A step whose result has a register of its own.
    fn step(&mut self, i: usize, action: Action, of: [usize; 4]) -> Step {
        let of = of.map(|k| self.of[k]);
        let to = self.free.pop().unwrap_or_else(|| {
            self.count += 1;
            register(self.count - 1)
        });
        self.of[i] = to;
        Step { action, of, to }
    }
}

fn register(i: usize) -> u16 {
    u16::try_from(i).expect("fewer than 65536 values")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formula::Names;

    fn program(texts: &[&str]) -> Program {
        let names = |list: [&str; 2]| list.map(str::to_owned);
        let (states, parameters) = (names(["x", "y"]), ["a", "b", "c", "d"].map(str::to_owned));
        let names = Names { states: &states, parameters: &parameters, inputs: &[], rates: true };
        let parsed: Vec<_> = texts.iter().map(|text| Expression::parse(text, names).unwrap()).collect();
        Program::of(&parsed)
    }

    fn values(program: &Program, [a, b]: [f64; 2]) -> Vec<f64> {
        let parameters = [a, b, 1.5, -2.5];
        let place = Place { t: 0.5, x: &[2.0, -3.0], rates: &[7.0, 11.0], inputs: &[] };
        let (mut results, mut again) = (vec![0.0; program.len()], vec![0.0; program.len()]);
        let sides = [true; MAX_SURFACES];
        program.run_with(&place, &parameters, &sides, &mut results);
        program.run(&place, &program.fix(&parameters), &sides, &mut again);
        assert_eq!(results, again);
        results
    }

    #[test]
    fn what_formulas_have_in_common_is_evaluated_once() {
        // The sine, the product with it, and one that goes into a sum; of the parameters the square and the quotient.
        let both = program(&["sin(x)*a^2", "b/a + y*sin(x)", "sin(x)"]);
        assert_eq!((both.steps.len(), both.first.len()), (3, 2));
        let sine = 2.0_f64.sin();
        assert_eq!(values(&both, [5.0, 3.0]), [sine * 25.0, 3.0 / 5.0 + -3.0 * sine, sine]);
        // Formulas of parameters alone, a leaf, rates and time.
        assert_eq!(values(&program(&["a*b - 1", "y", "x' + t*y'"]), [5.0, 3.0]), [14.0, -3.0, 12.5]);
    }

    #[test]
    fn registers_are_used_again() {
        let long = (0..60).map(|i| format!("(x + {i})*(y - {i})")).collect::<Vec<_>>().join(" - ");
        let sum = program(&[&long]);
        assert!(sum.registers < 2 + 60 + 5, "{}", sum.registers);
        let wanted = (1..60).fold(-6.0, |all, i| all - (2.0 + f64::from(i)) * (-3.0 - f64::from(i)));
        assert_eq!(values(&sum, [0.0, 0.0]), [wanted]);
        // More than there is room for without an allocation.
        let open = format!("{}x{}", "1 + (y*".repeat(90), ")".repeat(90));
        let many = (0..90).map(|i| format!("sin(x + {i}.5)")).collect::<Vec<_>>().join("*(1 + ");
        let many = program(&[&format!("{many}{}", ")".repeat(89)), &open]);
        assert!(many.registers > ROOMS[3] && values(&many, [0.0, 0.0]).iter().all(|value| value.is_finite()));
    }

    #[test]
    fn curves_and_comparisons() {
        let texts = ["spline(x, 0, 4, a, b, c, d)", "min(x, y) + max(x, a)*sign(y)", "where(x > y, a, b)"];
        assert_eq!(values(&program(&texts[1..]), [5.0, 3.0]), [-8.0, 5.0]);
        let own = program(&texts[..1]);
        let wanted = Spline::new(0, 4, (0.0, 4.0), false).of(2.0, &|i| [5.0, 3.0, 1.5, -2.5][i]);
        assert_eq!(values(&own, [5.0, 3.0]), [wanted]);
    }

    /// A step that ends beyond a surface evaluates the law on the side where it began.
    #[test]
    fn roots_of_kinks_have_values_on_either_side() {
        let (states, parameters) = (["x", "y"].map(str::to_owned), ["a", "b"].map(str::to_owned));
        let names = Names { states: &states, parameters: &parameters, inputs: &[], rates: false };
        for (text, at_4, beyond) in [
            ("abs(x)^1.5", 8.0, 8.0),
            ("abs(x)^b", 2.0, 2.0),
            ("sqrt(9*abs(x)/a)", 3.0, 3.0),
            ("sqrt(-min(-x, 0))", 2.0, 0.0),
            ("max(x, y)^0.5*y", 2.0, 1.0),
            ("ln(abs(x))", 4.0_f64.ln(), 4.0_f64.ln()),
            // Without a root the law continues as it is on its side.
            ("abs(x)*1.5", 6.0, -6.0),
        ] {
            let mut formula = Expression::parse(text, names).unwrap();
            let mut kinks = crate::formula::Kinks::default();
            kinks.of(&mut formula);
            let program = Program::of([&formula]);
            let value = |x: f64, side: bool| {
                let (place, mut results) = (Place { t: 0.0, x: &[x, 1.0], rates: &[], inputs: &[] }, [0.0]);
                program.run(&place, &program.fix(&[4.0, 0.5]), &[side; MAX_SURFACES], &mut results);
                results[0]
            };
            let side = !text.contains("min");
            let close = |a: f64, b: f64| (a - b).abs() < 1e-14;
            assert!(close(value(4.0, side), at_4), "{text}: {}", value(4.0, side));
            assert!(close(value(-4.0, side), beyond), "{text}: {}", value(-4.0, side));
        }
    }
}
