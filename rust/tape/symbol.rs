//! The number that a model is evaluated over when it is recorded.

use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::scalar::{Cells, InstructionSet, Isa, Mask, Plain, Real, Scalar, SplinePiece, Work, elementary};

/// A number while its model is recorded: its operation is known, its value is not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Symbol(pub(super) u32);

/// The condition of a branch while the model is recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceSideRef {
    /// The condition has this value wherever the law is evaluated.
    Fixed(bool),
    /// The condition holds on the positive side of this switching surface.
    Positive(usize),
    /// The condition holds on the negative side of this switching surface.
    Negative(usize),
}

/// How a symbol was made. Constants are kept as bits, so that equal symbols can be found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Made {
    Constant(u64),
    Parameter(usize),
    Time,
    State(usize),
    /// A measured input.
    Input(usize),
    Neg(Symbol),
    Add(Symbol, Symbol),
    Sub(Symbol, Symbol),
    /// If only one factor varies along a solution, it is the first.
    Mul(Symbol, Symbol),
    Div(Symbol, Symbol),
    Apply(Function, Symbol),
    /// The first on the surface's positive side, else the second.
    Select(usize, Symbol, Symbol),
    /// The start of the cell that a place is in, or, counted from 1, a coefficient of the [spline](Knots)'s polynomial
    /// there.
    Piece(usize, Symbol, usize),
}

/// The cells of a spline and its coefficients.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Knots {
    pub cells: Cells,
    pub coefficients: Vec<Symbol>,
}

/// An elementary function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Function {
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tanh,
}

impl Function {
    /// Its value.
    #[inline(always)]
    pub fn of<S: Scalar>(self, x: S) -> S {
        self.pair(x).0
    }

    /// Its value, and for sine and cosine the value of the other one.
    // Never inlined: it would fill the loops over the orders, which need it once per step.
    #[inline(never)]
    pub(super) fn pair<S: Scalar>(self, x: S) -> (S, S) {
        if const { S::Real::LANES > 1 && size_of::<S>() == size_of::<S::Real>() } {
            // The instructions are those that the packets are made of.
            let (value, other) = S::Real::work(Isa::Baseline, Apply(self, x.real()));
            return (S::lift(value), S::lift(other));
        }
        match self {
            Function::Sqrt => (x.sqrt(), x),
            Function::Exp => (x.exp(), x),
            Function::Ln => (x.ln(), x),
            Function::Sin => x.sin_cos(),
            Function::Cos => turned(x.sin_cos()),
            Function::Tanh => (x.tanh(), x),
        }
    }
}

#[inline(always)]
fn turned<T>((sine, cosine): (T, T)) -> (T, T) {
    (cosine, sine)
}

/// An elementary function of packets, by their own instructions: the same formulas as [`Function::pair`] has.
struct Apply<R>(Function, R);

impl<R: Real> Work for Apply<R> {
    type Output = (R, R);

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> (R, R) {
        let Self(function, x) = self;
        match function {
            Function::Sqrt => (x.sqrt(), x),
            Function::Exp => (elementary::exp(x), x),
            Function::Ln => (elementary::ln(x), x),
            Function::Sin => elementary::sin_cos(x),
            Function::Cos => turned(elementary::sin_cos(x)),
            Function::Tanh => (elementary::tanh(x), x),
        }
    }
}

/// All symbols made so far, equal ones merged. A symbol comes after those it is made of.
#[derive(Debug, Default)]
pub(super) struct Recording {
    pub(super) made: Vec<Made>,
    /// True if it changes along a solution.
    pub(super) varies: Vec<bool>,
    /// Its place in the order of operands, independent of earlier symbols.
    ranks: Vec<Rank>,
    known: HashMap<Made, Symbol>,
    pub(super) knots: Vec<Knots>,
    /// The model looked at a value, which a recording does not have.
    pub(super) looked: bool,
}

thread_local! {
    static RECORDING: RefCell<Recording> = RefCell::default();
}

/// Forgets all symbols of this thread.
pub(super) fn begin() {
    RECORDING.with_borrow_mut(|r| *r = Recording::default());
}

/// The recording since [`begin`].
pub(super) fn end() -> Recording {
    RECORDING.take()
}

pub(super) fn make(made: Made) -> Symbol {
    RECORDING.with_borrow_mut(|r| r.make(made))
}

fn looked() {
    RECORDING.with_borrow_mut(|r| r.looked = true);
}

/// The order of operands in sums and products: the components of the state come first, then the values with the most
/// operations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Rank {
    kind: u64,
    lightness: u64,
    hash: u64,
}

/// Numbers mixed to one, the same on every machine.
fn mixed(numbers: [u64; 4]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for number in numbers {
        hash = (hash ^ number).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        hash ^= hash >> 29;
    }
    hash
}

impl Recording {
    fn make(&mut self, made: Made) -> Symbol {
        if let Some(&symbol) = self.known.get(&made) {
            return symbol;
        }
        let varies = |s: Symbol| self.varies[s.0 as usize];
        let varies = match made {
            Made::Constant(_) | Made::Parameter(_) => false,
            Made::Time | Made::State(_) | Made::Input(_) | Made::Piece(..) => true,
            Made::Neg(a) | Made::Apply(_, a) => varies(a),
            Made::Add(a, b) | Made::Sub(a, b) | Made::Mul(a, b) | Made::Div(a, b) => varies(a) || varies(b),
            Made::Select(_, a, b) => varies(a) || varies(b),
        };
        let symbol = Symbol(u32::try_from(self.made.len()).expect("fewer than 2^32 symbols"));
        self.made.push(made);
        self.varies.push(varies);
        self.ranks.push(self.rank(made));
        self.known.insert(made, symbol);
        symbol
    }

    /// That of a symbol made in this way.
    fn rank(&self, made: Made) -> Rank {
        let leaf = |kind: u64, n: u64| Rank { kind, lightness: n, hash: 0 };
        let inner = |kind: u64, n: u64, of: [Option<Symbol>; 2]| {
            let rank = |s: Option<Symbol>| s.map(|s| self.ranks[s.0 as usize]);
            let weight = |rank: Option<Rank>| match rank {
                Some(Rank { kind: 4, lightness, .. }) => u64::MAX - lightness,
                Some(_) => 1,
                None => 0,
            };
            let hash = |rank: Option<Rank>| rank.map_or(0, |r| mixed([r.kind, r.lightness, r.hash, 1]));
            let [a, b] = of.map(rank);
            let all = weight(a).saturating_add(weight(b)).saturating_add(1);
            Rank { kind: 4, lightness: u64::MAX - all, hash: mixed([kind, n, hash(a), hash(b)]) }
        };
        match made {
            Made::State(n) => leaf(0, n as u64),
            Made::Time => leaf(1, 0),
            Made::Input(k) => leaf(2, k as u64),
            Made::Parameter(i) => leaf(3, i as u64),
            Made::Constant(bits) => Rank { kind: 5, lightness: bits, hash: 0 },
            Made::Neg(a) => inner(1, 0, [Some(a), None]),
            Made::Add(a, b) => inner(2, 0, [Some(a), Some(b)]),
            Made::Sub(a, b) => inner(3, 0, [Some(a), Some(b)]),
            Made::Mul(a, b) => inner(4, 0, [Some(a), Some(b)]),
            Made::Div(a, b) => inner(5, 0, [Some(a), Some(b)]),
            Made::Apply(function, a) => inner(6, function as u64, [Some(a), None]),
            Made::Select(j, a, b) => inner(7, j as u64, [Some(a), Some(b)]),
            Made::Piece(part, place, knots) => inner(8, (knots * 5 + part) as u64, [Some(place), None]),
        }
    }

    /// Sums and products do not depend on the order of their operands.
    fn ordered(&self, a: Symbol, b: Symbol) -> (Symbol, Symbol) {
        let rank = |s: Symbol| (self.ranks[s.0 as usize], s.0);
        if rank(b) < rank(a) { (b, a) } else { (a, b) }
    }

    fn of(&self, s: Symbol) -> Made {
        self.made[s.0 as usize]
    }

    fn value(&self, s: Symbol) -> Option<f64> {
        match self.of(s) {
            Made::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    fn constant(&mut self, value: f64) -> Symbol {
        // One zero: its sign means nothing in a model.
        self.make(Made::Constant((value + 0.0).to_bits()))
    }

    /// `x` and `f` where the symbol is `x f` and only `x` varies.
    fn scaled(&self, s: Symbol) -> Option<(Symbol, Symbol)> {
        match self.of(s) {
            Made::Mul(x, f) if self.varies[x.0 as usize] && !self.varies[f.0 as usize] => Some((x, f)),
            _ => None,
        }
    }

    /// The negative of a symbol that is scaled by a negative factor: sums of it are written as differences.
    fn flipped(&mut self, s: Symbol) -> Option<Symbol> {
        let (x, f) = self.scaled(s)?;
        let factor = match (self.of(f), self.value(f)) {
            (Made::Neg(factor), _) => factor,
            (_, Some(value)) if value < 0.0 => self.constant(-value),
            _ => return None,
        };
        Some(self.mul(x, factor))
    }

    fn neg(&mut self, a: Symbol) -> Symbol {
        if let Some(value) = self.value(a) {
            return self.constant(-value);
        }
        if let Some((x, f)) = self.scaled(a) {
            let f = self.neg(f);
            return self.mul(x, f);
        }
        match self.of(a) {
            Made::Neg(x) => x,
            Made::Sub(x, y) => self.sub(y, x),
            _ => self.make(Made::Neg(a)),
        }
    }

    fn add(&mut self, a: Symbol, b: Symbol) -> Symbol {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x + y),
            (Some(0.0), _) => return b,
            (_, Some(0.0)) => return a,
            _ => {}
        }
        match (self.of(a), self.of(b)) {
            (_, Made::Neg(y)) => self.sub(a, y),
            (Made::Neg(x), _) => self.sub(b, x),
            _ => {
                if let Some(y) = self.flipped(b) {
                    return self.sub(a, y);
                }
                if let Some(x) = self.flipped(a) {
                    return self.sub(b, x);
                }
                let (a, b) = self.ordered(a, b);
                self.make(Made::Add(a, b))
            }
        }
    }

    fn sub(&mut self, a: Symbol, b: Symbol) -> Symbol {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x - y),
            (Some(0.0), _) => return self.neg(b),
            (_, Some(0.0)) => return a,
            _ => {}
        }
        match (self.of(a), self.of(b)) {
            _ if a == b => self.constant(0.0),
            (_, Made::Neg(y)) => self.add(a, y),
            (Made::Neg(x), _) => {
                let sum = self.add(x, b);
                self.neg(sum)
            }
            _ => match self.flipped(b) {
                Some(y) => self.add(a, y),
                None => self.make(Made::Sub(a, b)),
            },
        }
    }

    /// Constant factors are pulled out of products: equal products are merged more often, and the factor
    /// multiplies once per order.
    fn mul(&mut self, a: Symbol, b: Symbol) -> Symbol {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x * y),
            (Some(0.0), _) | (_, Some(0.0)) => return self.constant(0.0),
            (Some(1.0), _) => return b,
            (_, Some(1.0)) => return a,
            (Some(-1.0), _) => return self.neg(b),
            (_, Some(-1.0)) => return self.neg(a),
            _ => {}
        }
        // The sign of what does not vary stays in the factor.
        if let (Made::Neg(x), true) = (self.of(a), self.varies[a.0 as usize]) {
            let product = self.mul(x, b);
            return self.neg(product);
        }
        if let (Made::Neg(_), true) = (self.of(b), self.varies[b.0 as usize]) {
            return self.mul(b, a);
        }
        if let Some((x, f)) = self.scaled(a) {
            return if self.varies[b.0 as usize] {
                let product = self.mul(x, b);
                self.mul(product, f)
            } else {
                let f = self.mul(f, b);
                self.mul(x, f)
            };
        }
        if self.scaled(b).is_some() {
            return self.mul(b, a);
        }
        match (self.varies[a.0 as usize], self.varies[b.0 as usize]) {
            (false, true) => self.make(Made::Mul(b, a)),
            (true, false) => self.make(Made::Mul(a, b)),
            _ => {
                let (a, b) = self.ordered(a, b);
                self.make(Made::Mul(a, b))
            }
        }
    }

    fn div(&mut self, a: Symbol, b: Symbol) -> Symbol {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x / y),
            (Some(0.0), _) => return a,
            (_, Some(1.0)) => return a,
            _ => {}
        }
        let one = self.constant(1.0);
        if !self.varies[b.0 as usize] && a != one {
            let inverse = self.div(one, b);
            return self.mul(a, inverse);
        }
        match self.of(b) {
            Made::Neg(y) => {
                let quotient = self.div(a, y);
                self.neg(quotient)
            }
            _ => self.make(Made::Div(a, b)),
        }
    }

    /// The parts of a spline's polynomial: where its cell begins, and its coefficients.
    fn piece(&mut self, place: Symbol, knots: Knots) -> [Symbol; 5] {
        self.looked |= knots.coefficients.iter().any(|s| self.varies[s.0 as usize]);
        let known = self.knots.iter().position(|other| *other == knots);
        let number = known.unwrap_or_else(|| {
            self.knots.push(knots);
            self.knots.len() - 1
        });
        std::array::from_fn(|part| self.make(Made::Piece(part, place, number)))
    }

    fn apply(&mut self, function: Function, a: Symbol) -> Symbol {
        match self.value(a) {
            Some(value) => self.constant(function.of(value)),
            None => self.make(Made::Apply(function, a)),
        }
    }
}

macro_rules! recorded {
    ($($Op:ident :: $op:ident),+) => {$(
        impl $Op for Symbol {
            type Output = Symbol;
            fn $op(self, other: Symbol) -> Symbol {
                RECORDING.with_borrow_mut(|r| r.$op(self, other))
            }
        }
    )+};
}
recorded! { Add::add, Sub::sub, Mul::mul, Div::div }

impl Neg for Symbol {
    type Output = Symbol;
    fn neg(self) -> Symbol {
        RECORDING.with_borrow_mut(|r| r.neg(self))
    }
}

impl AddAssign for Symbol {
    fn add_assign(&mut self, other: Symbol) {
        *self = *self + other;
    }
}

impl SubAssign for Symbol {
    fn sub_assign(&mut self, other: Symbol) {
        *self = *self - other;
    }
}

fn apply(function: Function, a: Symbol) -> Symbol {
    RECORDING.with_borrow_mut(|r| r.apply(function, a))
}

impl Scalar for Symbol {
    type Real = Symbol;
    type Mask = SurfaceSideRef;

    const SYMBOLIC: bool = true;
    type Register = Self;

    fn register(self, _i: usize) -> Self {
        self
    }
    fn set_register(&mut self, _i: usize, lanes: Self) {
        *self = lanes;
    }

    fn constant(value: f64) -> Symbol {
        RECORDING.with_borrow_mut(|r| r.constant(value))
    }
    fn lift(value: Symbol) -> Symbol {
        value
    }
    fn real(self) -> Symbol {
        self
    }
    fn scale(self, factor: f64) -> Symbol {
        self * Symbol::constant(factor)
    }
    fn times(self, factor: Symbol) -> Symbol {
        self * factor
    }
    fn fused(self, a: Symbol, b: Symbol) -> Symbol {
        self + a * b
    }
    fn fused_times(self, a: Symbol, b: Symbol) -> Symbol {
        self + a * b
    }
    fn less(self, other: Symbol) -> SurfaceSideRef {
        match RECORDING.with_borrow(|r| r.value(self).zip(r.value(other))) {
            Some((a, b)) => SurfaceSideRef::Fixed(a < b),
            None => {
                looked();
                SurfaceSideRef::Fixed(false)
            }
        }
    }
    fn select(mask: SurfaceSideRef, yes: Symbol, no: Symbol) -> Symbol {
        match mask {
            _ if yes == no => yes,
            SurfaceSideRef::Fixed(true) => yes,
            SurfaceSideRef::Fixed(false) => no,
            SurfaceSideRef::Positive(j) => make(Made::Select(j, yes, no)),
            SurfaceSideRef::Negative(j) => make(Made::Select(j, no, yes)),
        }
    }
    fn mask(value: bool) -> SurfaceSideRef {
        SurfaceSideRef::Fixed(value)
    }
    fn sqrt(self) -> Symbol {
        apply(Function::Sqrt, self)
    }
    fn exp(self) -> Symbol {
        apply(Function::Exp, self)
    }
    fn ln(self) -> Symbol {
        apply(Function::Ln, self)
    }
    fn sin(self) -> Symbol {
        apply(Function::Sin, self)
    }
    fn cos(self) -> Symbol {
        apply(Function::Cos, self)
    }
    fn tanh(self) -> Symbol {
        apply(Function::Tanh, self)
    }
    // Its series is not known: models that have it cannot be recorded.
    fn atan2(self, x: Symbol) -> Symbol {
        self.zip(x, f64::atan2)
    }
}

/// A symbol is a number without derivatives and without a value. A model that looks at the value cannot be recorded;
/// [`Tape::record`](super::Tape::record) says so.
impl Real for Symbol {
    const LANES: usize = 1;
    fn work<W: Work>(_isa: Isa, work: W) -> W::Output {
        work.run::<Plain>()
    }

    fn piece(self, cells: Cells, coefficient: &dyn Fn(usize) -> Symbol) -> SplinePiece<Symbol> {
        let coefficients = (0..cells.coefficients).map(coefficient).collect();
        let knots = Knots { cells, coefficients };
        let [floor, powers @ ..] = RECORDING.with_borrow_mut(|r| r.piece(self, knots));
        (floor, powers)
    }
    fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Symbol {
        Symbol::constant(lane(0))
    }
    fn lane(self, _i: usize) -> f64 {
        RECORDING.with_borrow(|r| r.value(self)).unwrap_or_else(|| {
            looked();
            f64::NAN
        })
    }
    fn set_lane(&mut self, _i: usize, value: f64) {
        *self = Symbol::constant(value);
    }
    fn each(self, f: impl Fn(f64) -> f64) -> Symbol {
        Symbol::constant(f(self.lane(0)))
    }
    fn zip(self, other: Symbol, f: impl Fn(f64, f64) -> f64) -> Symbol {
        Symbol::constant(f(self.lane(0), other.lane(0)))
    }
}

impl Mask for SurfaceSideRef {
    fn from_lanes(mut lane: impl FnMut(usize) -> bool) -> SurfaceSideRef {
        SurfaceSideRef::Fixed(lane(0))
    }
    fn lane(self, _i: usize) -> bool {
        match self {
            SurfaceSideRef::Fixed(value) => value,
            _ => {
                looked();
                false
            }
        }
    }
    fn and(self, other: SurfaceSideRef) -> SurfaceSideRef {
        match (self, other) {
            (SurfaceSideRef::Fixed(true), side) | (side, SurfaceSideRef::Fixed(true)) => side,
            _ if self == other => self,
            _ if self == other.not() => SurfaceSideRef::Fixed(false),
            (SurfaceSideRef::Fixed(false), _) | (_, SurfaceSideRef::Fixed(false)) => {
                SurfaceSideRef::Fixed(false)
            }
            _ => {
                looked();
                self
            }
        }
    }
    fn or(self, other: SurfaceSideRef) -> SurfaceSideRef {
        self.not().and(other.not()).not()
    }
    fn not(self) -> SurfaceSideRef {
        match self {
            SurfaceSideRef::Fixed(value) => SurfaceSideRef::Fixed(!value),
            SurfaceSideRef::Positive(j) => SurfaceSideRef::Negative(j),
            SurfaceSideRef::Negative(j) => SurfaceSideRef::Positive(j),
        }
    }
    fn bits(self) -> u64 {
        u64::from(self.lane(0))
    }
}
