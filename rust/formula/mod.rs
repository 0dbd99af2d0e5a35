//! A formula given as text.
//!
//! It is parsed by a whitelist of names, operators and functions to a list of operations, nothing else in the text means
//! anything. A [`Program`] made of it can be evaluated over any [`Scalar`].

mod compile;
mod kinks;
mod parse;
mod program;
mod spline;
mod step_code;

pub use kinks::{Kink, Kinks};
pub use program::{Place, Program};
pub use spline::Spline;
pub use step_code::{StageWeights, StepFrom};

use thiserror::Error;

use crate::scalar::{Mask, Real, Scalar};

/// The most characters of a formula.
pub const LONGEST: usize = 10_000;
/// How deep its brackets, powers and signs may be nested.
pub const DEEPEST: usize = 100;
/// The largest whole exponent.
pub const HIGHEST: i32 = 1024;

/// Returns true if a name means something in every formula, so that nothing else can be called so.
pub fn is_reserved(name: &str) -> bool {
    let unary = parse::FUNCTIONS.iter().any(|(function, _)| *function == name);
    let binary = parse::BINARY.iter().any(|(function, _)| *function == name);
    unary || binary || name == parse::WHERE || parse::SPLINES.contains(&name) || name == "t" || name == "pi"
}

/// The names that a formula may use, in addition to the time `t`, the number `pi` and the functions.
#[derive(Clone, Copy, Debug)]
pub struct Names<'a> {
    /// The state's components.
    pub states: &'a [String],
    pub parameters: &'a [String],
    /// Measured inputs.
    pub inputs: &'a [String],
    /// True if `name'` is the rate of a component of the state.
    pub rates: bool,
}

/// The fault of a formula.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct Mistake(pub String);

/// A value that a formula takes from its place of evaluation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Leaf {
    Number(f64),
    Time,
    State(usize),
    /// The time derivative of a component of the state.
    Rate(usize),
    Parameter(usize),
    /// A measured input.
    Input(usize),
}

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unary {
    Neg,
    Abs,
    /// 1 above zero, -1 below, 0 at zero.
    Sign,
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tan,
    Sinh,
    Cosh,
    Tanh,
    Atan,
    /// The cardinal cubic B-spline: a bump over -2 to 2 whose second derivative is continuous.
    Bspline,
    /// A whole power.
    Power(i32),
}

/// A function of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    /// By `exp(b ln a)`; a whole power of what is not positive by multiplication.
    Power,
    /// The angle of the point with the ordinate `a` and the abscissa `b`.
    Atan2,
    Min,
    Max,
}

/// One operation on the stack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Op {
    Push(Leaf),
    Unary(Unary),
    Binary(Binary),
    /// A function of one number, given by its coefficients.
    Spline(Spline),
    /// The second of three where the first is above zero, else the third.
    Where,
    /// A function with a kink, taken on this side of a surface.
    On(Kink, u8),
    /// The same by the numbers themselves; while a model is recorded, on this side.
    Compared(Kink, u8),
    /// The first of two numbers, or the second if the first is negative and no model is recorded.
    Defined,
}

impl Op {
    /// The number of values that it takes from the stack; it leaves one.
    pub fn takes(self) -> usize {
        match self {
            Op::Push(_) => 0,
            Op::Unary(_) | Op::Spline(_) => 1,
            Op::Binary(_) | Op::Defined => 2,
            Op::Where => 3,
            Op::On(kink, _) | Op::Compared(kink, _) => kink.takes(),
        }
    }

    /// Its name in a formula's text; for a value that is pushed, the kind of the value.
    pub fn name(self) -> &'static str {
        match self {
            Op::Push(Leaf::Number(_)) => "number",
            Op::Push(Leaf::Time) => "t",
            Op::Push(Leaf::State(_)) => "state",
            Op::Push(Leaf::Rate(_)) => "rate",
            Op::Push(Leaf::Parameter(_)) => "parameter",
            Op::Push(Leaf::Input(_)) => "input",
            Op::Unary(Unary::Neg) | Op::Binary(Binary::Sub) => "-",
            Op::Unary(Unary::Power(_)) | Op::Binary(Binary::Power) => "^",
            Op::Binary(Binary::Add) => "+",
            Op::Binary(Binary::Mul) => "*",
            Op::Binary(Binary::Div) => "/",
            Op::Unary(function) => name_in(&parse::FUNCTIONS, function),
            Op::Binary(function) => name_in(&parse::BINARY, function),
            Op::Spline(spline) => parse::SPLINES[usize::from(spline.periodic)],
            Op::Where => parse::WHERE,
            Op::On(kink, _) => kink.name(),
            Op::Compared(..) => "compared",
            Op::Defined => "defined",
        }
    }

    /// The number that it holds: a number pushed, which of its kind is pushed, or a whole exponent.
    pub fn number(self) -> f64 {
        match self {
            Op::Push(Leaf::Number(value)) => value,
            Op::Push(Leaf::State(n) | Leaf::Rate(n) | Leaf::Parameter(n) | Leaf::Input(n)) => n as f64,
            Op::Unary(Unary::Power(n)) => f64::from(n),
            _ => 0.0,
        }
    }
}

/// The name of a function in the grammar's list.
fn name_in<F: PartialEq>(list: &[(&'static str, F)], function: F) -> &'static str {
    list.iter().find(|(_, own)| *own == function).map_or("", |(name, _)| name)
}

/// A formula as a list of operations; a [`Program`] evaluates it.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    ops: Vec<Op>,
}

impl Expression {
    /// Parses a formula, or an equation: then it is the left side less the right one.
    ///
    /// # Errors
    /// What is wrong, in words that continue "the formula ...".
    pub fn parse(text: &str, names: Names<'_>) -> Result<Self, Mistake> {
        Ok(Self::of(parse::parse(text, names, false)?))
    }

    /// Parses a formula for single places: `a >= b` is true if `a` equals `b`, even for a state.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub(crate) fn parse_exact(text: &str, names: Names<'_>) -> Result<Self, Mistake> {
        Ok(Self::of(parse::parse(text, names, true)?))
    }

    /// A number.
    pub(crate) fn number(value: f64) -> Self {
        Self::of(vec![Op::Push(Leaf::Number(value))])
    }

    fn of(ops: Vec<Op>) -> Self {
        Self { ops }
    }

    /// Replaces these operations everywhere by `new`, which pushes as many numbers.
    pub(crate) fn replace(&mut self, old: &[Op], new: Op) {
        let mut at = 0;
        while at + old.len() <= self.ops.len() {
            if self.ops[at..].starts_with(old) {
                self.ops.splice(at..at + old.len(), [new]);
            }
            at += 1;
        }
    }

    /// The operations.
    pub fn ops(&self) -> &[Op] {
        &self.ops
    }

    /// Returns true if it needs the rates.
    pub fn has_rates(&self) -> bool {
        self.ops.iter().any(|op| matches!(op, Op::Push(Leaf::Rate(_))))
    }

    /// Returns true if it changes in time, through the state or directly.
    pub fn varies(&self) -> bool {
        Self::varies_of(&self.ops)
    }

    /// The same of a part of an expression.
    fn varies_of(ops: &[Op]) -> bool {
        ops.iter()
            .any(|op| matches!(op, Op::Push(Leaf::Rate(_) | Leaf::State(_) | Leaf::Time | Leaf::Input(_))))
    }

    /// Returns true if it changes no faster than the state and its rates: it consists of these, parameters and numbers, in
    /// sums, products and low powers.
    pub fn is_slow(&self) -> bool {
        self.ops.iter().all(|op| match *op {
            Op::Push(leaf) => !matches!(leaf, Leaf::Time | Leaf::Input(_)),
            Op::Unary(Unary::Neg) | Op::Binary(Binary::Add | Binary::Sub | Binary::Mul) => true,
            Op::Unary(Unary::Power(n)) => (0..=3).contains(&n),
            _ => false,
        })
    }

    /// Returns true if it is a linear function of the state and a constant, with factors that neither time nor inputs change.
    pub fn is_affine(&self) -> bool {
        self.degree(2, false) == 1
    }

    /// Returns true if it is a constant or a linear function of the state and of time on given sides of all surfaces: no
    /// faster than the state.
    pub fn is_steady(&self) -> bool {
        self.degree(1, true) <= 1
    }

    /// Its degree in the state, where that of time counts as this; 2 for all that is neither constant nor linear. Kinks
    /// count as on one side of their surfaces if `sided`.
    fn degree(&self, time: u8, sided: bool) -> u8 {
        // One for each number on the stack.
        let mut degrees: Vec<u8> = Vec::new();
        for op in &self.ops {
            let of = degrees.split_off(degrees.len() - op.takes());
            let most = of.iter().copied().max().unwrap_or(0);
            let degree = match *op {
                Op::Push(Leaf::State(_)) => 1,
                Op::Push(Leaf::Number(_) | Leaf::Parameter(_)) => 0,
                Op::Push(Leaf::Time) => time,
                Op::On(Kink::Sign, _) if sided => 0,
                Op::On(Kink::Where, _) if sided => of[1].max(of[2]),
                Op::On(Kink::Abs | Kink::Min | Kink::Max, _) if sided => most,
                Op::Push(_) | Op::On(..) | Op::Where => 2,
                Op::Unary(Unary::Neg) | Op::Binary(Binary::Add | Binary::Sub) => most,
                Op::Binary(Binary::Mul) => of.iter().sum::<u8>().min(2),
                Op::Binary(Binary::Div) if of[1] == 0 => of[0],
                _ if most == 0 => 0,
                _ => 2,
            };
            degrees.push(degree);
        }
        degrees[0]
    }
}

impl Unary {
    /// The function's value.
    // One function for each kind of number: the elementary functions are long.
    #[inline(never)]
    pub fn of<S: Scalar>(self, a: S) -> S {
        match self {
            Unary::Neg => -a,
            Unary::Abs => abs(a),
            Unary::Sign => {
                let below = S::jumping(a.less(S::zero()), -S::one(), S::zero());
                S::jumping(S::zero().less(a), S::one(), below)
            }
            Unary::Sqrt => root(a),
            Unary::Exp => a.exp(),
            Unary::Ln => a.ln(),
            Unary::Sin => a.sin(),
            Unary::Cos => a.cos(),
            Unary::Tan => {
                let (sin, cos) = a.sin_cos();
                sin / cos
            }
            // As a difference of exponentials it would be 0 below 1e-16.
            Unary::Sinh => a.tanh() * Unary::Cosh.of(a),
            Unary::Cosh => (a.exp() + (-a).exp()).scale(0.5),
            Unary::Tanh => a.tanh(),
            Unary::Atan => a.atan2(S::one()),
            Unary::Bspline => bspline(a),
            Unary::Power(n) => power(a, n),
        }
    }
}

impl Binary {
    /// The function's value.
    #[inline(always)]
    pub fn of<S: Scalar>(self, a: S, b: S) -> S {
        match self {
            Binary::Add => a + b,
            Binary::Sub => a - b,
            Binary::Mul => a * b,
            Binary::Div => a / b,
            Binary::Power => power_of(a, b),
            Binary::Atan2 => angle_of(a, b),
            Binary::Min => S::select(a.less(b), a, b),
            Binary::Max => S::select(b.less(a), a, b),
        }
    }
}

#[inline(never)]
fn power_of<S: Scalar>(a: S, b: S) -> S {
    let mut result = (b * a.ln()).exp();
    // A recording has no values to look at.
    if S::SYMBOLIC || !S::zero().less(a).not().any() {
        return result;
    }
    for lane in 0..S::Real::LANES {
        let exponent = b.real().lane(lane);
        let (base, whole) = (a.real().lane(lane), exponent as i32);
        let lane = S::Mask::from_lanes(|own| own == lane);
        if base <= 0.0 && f64::from(whole) == exponent {
            result = S::select(lane, power(a, whole), result);
        } else if base == 0.0 && exponent > 0.0 {
            result = S::select(lane, S::zero(), result); // as for a root
        }
    }
    result
}

/// The square root, without a slope at zero: times zero an infinite one would be no number, as in `v sqrt(|v|)`.
#[inline(always)]
fn root<S: Scalar>(a: S) -> S {
    if S::ORDER == 0 || S::SYMBOLIC {
        return a.sqrt();
    }
    let smallest = S::constant(f64::from_bits(1));
    S::select(a.less(smallest).and(a.less(S::zero()).not()), S::zero(), a.sqrt())
}

#[inline(never)]
fn angle_of<S: Scalar>(y: S, x: S) -> S {
    y.atan2(x)
}

#[inline(always)]
fn abs<S: Scalar>(a: S) -> S {
    S::select(a.less(S::zero()).not(), a, -a)
}

/// `((2 - |a|)^3 - 4 (1 - |a|)^3)/6`, both cubes only where positive.
#[inline(always)]
fn bspline<S: Scalar>(a: S) -> S {
    let size = abs(a);
    // Most of a curve's bumps are elsewhere.
    if !size.less(S::constant(2.0)).any() {
        return S::zero();
    }
    let cube = |width: f64| {
        let left = S::constant(width) - size;
        S::select(S::zero().less(left), left.square() * left, S::zero())
    };
    (cube(2.0) - cube(1.0).scale(4.0)).scale(1.0 / 6.0)
}

/// By repeated squaring.
#[inline(always)]
fn power<S: Scalar>(a: S, n: i32) -> S {
    let mut left = n.unsigned_abs();
    let (mut product, mut square) = (S::one(), a);
    while left > 0 {
        if left & 1 == 1 {
            product = product * square;
        }
        left >>= 1;
        if left > 0 {
            square = square.square();
        }
    }
    if n < 0 { S::one() / product } else { product }
}
