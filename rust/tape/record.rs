//! From a model to its tape.

use std::any::Any;
use std::array::from_fn;
use std::collections::HashMap;
use std::sync::Arc;

use thiserror::Error;

use super::fuse::Program;
use super::specialised::Specialised;
use super::symbol::{self, Function, Knots, Made, Recording, SurfaceSideRef, Symbol};
use super::{Invariant, Node, Step, Tape};
use crate::latest::Latest;
use crate::model::{Family, MAX_SURFACES, Sides, System};
use crate::scalar::Scalar;

/// Why a model has no tape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the model's law has a comparison or an arc tangent, which no power series follows here")]
pub struct Unrecordable;

/// The tapes of the latest laws, each by the law's number and the bits of its fixed parameters.
static LATEST: Latest<(u64, Vec<Option<u64>>), AnyTape> = Latest::new();

/// A [`Tape`] of any number of states.
type AnyTape = Arc<dyn Any + Send + Sync>;

impl<const D: usize> Tape<D> {
    /// Records the rates of the family's systems. Parameters whose value is `fixed` become constants, and terms that
    /// vanish with them are left out, but not from a compiled series unless it has a variant without them.
    ///
    /// Fixed parameters do not change a bit of the series: a run's bits do not depend on other runs.
    ///
    /// # Errors
    /// The model looks at the value of a number, which a recording does not have.
    pub fn record<F: Family<D>>(family: &F, fixed: &[Option<f64>]) -> Result<Self, Unrecordable> {
        let Some(law) = family.law() else { return Self::record_anew(family, fixed) };
        let key = (law, fixed.iter().map(|value| value.map(f64::to_bits)).collect());
        let make = || Self::record_anew(family, fixed).map(|tape| Arc::new(tape) as AnyTape);
        let tape = LATEST.get(key, make)?;
        Ok(tape.downcast_ref::<Self>().expect("a law has one number of states").clone())
    }

    fn record_anew<F: Family<D>>(family: &F, fixed: &[Option<f64>]) -> Result<Self, Unrecordable> {
        let open = Self::recorded(family, &[])?;
        if fixed.iter().all(Option::is_none) {
            return Ok(open);
        }
        let mut tape = Self::recorded(family, fixed)?;
        match (open.known, tape.known) {
            (Specialised::Not, _) => tape.known = Specialised::Not,
            (_, Specialised::Not) => return Ok(open),
            _ => {}
        }
        Ok(tape)
    }

    fn recorded<F: Family<D>>(family: &F, fixed: &[Option<f64>]) -> Result<Self, Unrecordable> {
        symbol::begin();
        let parameter = |i: usize| match fixed.get(i).copied().flatten() {
            Some(value) => Symbol::constant(value),
            None => symbol::make(Made::Parameter(i)),
        };
        let parameters: Vec<Symbol> = (0..family.parameters().len()).map(parameter).collect();
        let inputs = (0..family.inputs()).map(|k| symbol::make(Made::Input(k))).collect();
        let system = family.build_at(&parameters, inputs);
        let x = from_fn(|n| symbol::make(Made::State(n)));
        let sides: Sides<Symbol> = from_fn(|j| match j < System::<Symbol, D>::surfaces(&system) {
            true => SurfaceSideRef::Positive(j),
            false => SurfaceSideRef::Fixed(true),
        });
        let rates = system.rates(symbol::make(Made::Time), &x, &sides);
        let recording = symbol::end();
        if recording.looked { Err(Unrecordable) } else { Ok(Lowering::new(&recording, D).tape(rates)) }
    }
}

/// Turns symbols into nodes, only those that the rates need.
struct Lowering<'a> {
    recording: &'a Recording,
    held: Vec<Invariant>,
    steps: Vec<Step>,
    slots: usize,
    /// The place of each constant, and the slot of each series.
    held_at: HashMap<Symbol, u16>,
    slot_of: HashMap<Symbol, u16>,
    circle_of: HashMap<Symbol, u16>,
    piece_of: HashMap<(Symbol, usize), u16>,
}

fn index(i: usize) -> u16 {
    u16::try_from(i).expect("fewer than 65536 nodes")
}

impl<'a> Lowering<'a> {
    fn new(recording: &'a Recording, states: usize) -> Self {
        Self {
            recording,
            held: Vec::new(),
            steps: Vec::new(),
            slots: states,
            held_at: HashMap::new(),
            slot_of: HashMap::new(),
            circle_of: HashMap::new(),
            piece_of: HashMap::new(),
        }
    }

    fn tape<const D: usize>(mut self, rates: [Symbol; D]) -> Tape<D> {
        let rates = rates.map(|s| self.slot(s));
        assert!(rates.len() <= self.slots && MAX_SURFACES < usize::from(u8::MAX));
        let switches_held = self.held.iter().any(|held| matches!(held, Invariant::Select(..)));
        let driven = self.held.iter().any(|held| matches!(held, Invariant::Input(..)));
        let in_pieces = self.steps.iter().any(|step| matches!(step.node, Node::Piece(..)));
        let levels_off = self.steps.iter().any(|step| step.node.levels_off());
        let program = Program::of(&self.steps, &rates, self.slots, true);
        let mut tape = Tape {
            program,
            held: self.held,
            steps: self.steps,
            rates,
            slots: self.slots,
            known: Specialised::Not,
            levels_off,
            in_pieces,
            switches_held,
            driven,
        };
        tape.known = Specialised::of(&tape);
        tape
    }

    fn varies(&self, s: Symbol) -> bool {
        self.recording.varies[s.0 as usize]
    }

    fn made(&self, s: Symbol) -> Made {
        self.recording.made[s.0 as usize]
    }

    /// The place of a constant symbol's value.
    fn held(&mut self, s: Symbol) -> u16 {
        if let Some(&at) = self.held_at.get(&s) {
            return at;
        }
        let held = self.invariant(s);
        self.held.push(held);
        let at = index(self.held.len() - 1);
        self.held_at.insert(s, at);
        at
    }

    fn invariant(&mut self, s: Symbol) -> Invariant {
        match self.made(s) {
            Made::Constant(bits) => Invariant::Constant(f64::from_bits(bits)),
            Made::Parameter(i) => Invariant::Parameter(index(i)),
            Made::Neg(a) => Invariant::Neg(self.held(a)),
            Made::Add(a, b) => Invariant::Add(self.held(a), self.held(b)),
            Made::Sub(a, b) => Invariant::Sub(self.held(a), self.held(b)),
            Made::Mul(a, b) => Invariant::Mul(self.held(a), self.held(b)),
            Made::Div(a, b) => Invariant::Div(self.held(a), self.held(b)),
            Made::Apply(f, a) => Invariant::Apply(f, self.held(a)),
            Made::Select(j, a, b) => Invariant::Select(index(j), self.held(a), self.held(b)),
            Made::Time | Made::State(_) | Made::Input(_) | Made::Piece(..) => {
                unreachable!("time, state, inputs and pieces vary")
            }
        }
    }

    /// The place of an input's origin; its coefficients follow.
    fn input(&mut self, k: usize) -> u16 {
        let at = index(self.held.len());
        let parts = 0..=index(crate::model::PIECE_COEFFICIENTS);
        self.held.extend(parts.map(|part| Invariant::Input(index(k), part)));
        at
    }

    /// Where the start of a spline's cell around a place is stored, and its polynomial's coefficients after it.
    fn piece(&mut self, place: Symbol, knots: usize) -> u16 {
        if let Some(&slot) = self.piece_of.get(&(place, knots)) {
            return slot;
        }
        let Knots { cells, coefficients } = &self.recording.knots[knots];
        let values: Vec<_> = coefficients.iter().map(|&s| self.invariant(s)).collect();
        let at = index(self.held.len());
        self.held.extend(values);
        let node = Node::Piece(self.slot(place), at, *cells);
        let slot = self.push(node);
        self.piece_of.insert((place, knots), slot);
        slot
    }

    fn push(&mut self, node: Node) -> u16 {
        let to = index(self.slots);
        self.slots += node.slots();
        self.steps.push(Step { node, to });
        to
    }

    /// The slot of the series of a symbol.
    fn slot(&mut self, s: Symbol) -> u16 {
        if let Some(&slot) = self.slot_of.get(&s) {
            return slot;
        }
        let slot = self.lower(s);
        self.slot_of.insert(s, slot);
        slot
    }

    fn lower(&mut self, s: Symbol) -> u16 {
        if !self.varies(s) {
            let node = Node::Hold(self.held(s));
            return self.push(node);
        }
        let node = match self.made(s) {
            Made::State(n) => return index(n),
            Made::Time => Node::Time,
            Made::Input(k) => Node::Input(self.input(k)),
            Made::Neg(a) => Node::Neg(self.slot(a)),
            Made::Add(a, b) if !self.varies(a) => Node::Plus(self.slot(b), self.held(a)),
            Made::Add(a, b) if !self.varies(b) => Node::Plus(self.slot(a), self.held(b)),
            Made::Add(a, b) => Node::Add(self.slot(a), self.slot(b)),
            Made::Sub(a, b) if !self.varies(a) => Node::From(self.held(a), self.slot(b)),
            Made::Sub(a, b) if !self.varies(b) => Node::Minus(self.slot(a), self.held(b)),
            Made::Sub(a, b) => Node::Sub(self.slot(a), self.slot(b)),
            Made::Mul(a, b) if !self.varies(b) => Node::Scale(self.slot(a), self.held(b)),
            Made::Mul(a, b) if a == b => Node::Square(self.slot(a)),
            Made::Mul(a, b) => Node::Mul(self.slot(a), self.slot(b)),
            Made::Div(a, b) if !self.varies(a) => Node::Over(self.held(a), self.slot(b)),
            Made::Div(a, b) => Node::Div(self.slot(a), self.slot(b)),
            Made::Apply(Function::Sqrt, a) => Node::Sqrt(self.slot(a)),
            Made::Apply(Function::Exp, a) => Node::Exp(self.slot(a)),
            Made::Apply(Function::Ln, a) => Node::Ln(self.slot(a)),
            Made::Apply(Function::Tanh, a) => {
                let node = Node::Tanh(self.slot(a));
                let slot = self.push(node);
                self.steps.push(Step { node: Node::Slope(slot), to: slot + 1 });
                return slot;
            }
            Made::Apply(Function::Sin, a) => return self.circle(a),
            Made::Apply(Function::Cos, a) => return self.circle(a) + 1,
            Made::Select(j, a, b) => Node::Select(index(j), self.slot(a), self.slot(b)),
            Made::Piece(part, place, knots) => return self.piece(place, knots) + index(part),
            Made::Constant(_) | Made::Parameter(_) => unreachable!("constants and parameters do not vary"),
        };
        self.push(node)
    }

    /// Returns true for a linear function of time, whose series ends with order 1.
    fn is_linear(&self, s: Symbol) -> bool {
        match self.made(s) {
            _ if !self.varies(s) => true,
            Made::Time => true,
            Made::Neg(a) => self.is_linear(a),
            Made::Add(a, b) | Made::Sub(a, b) => self.is_linear(a) && self.is_linear(b),
            Made::Mul(a, b) => (!self.varies(a) || !self.varies(b)) && self.is_linear(a) && self.is_linear(b),
            Made::Div(a, b) => !self.varies(b) && self.is_linear(a),
            _ => false,
        }
    }

    /// The slot of the sine's series; that of the cosine is behind it.
    fn circle(&mut self, angle: Symbol) -> u16 {
        if let Some(&slot) = self.circle_of.get(&angle) {
            return slot;
        }
        let a = self.slot(angle);
        let is_linear = self.is_linear(angle);
        let slot = self.push(if is_linear { Node::SinOfTime(a) } else { Node::Sin(a) });
        let cosine = if is_linear { Node::CosOfTime(slot) } else { Node::Cos(slot) };
        self.steps.push(Step { node: cosine, to: slot + 1 });
        self.circle_of.insert(angle, slot);
        slot
    }
}
