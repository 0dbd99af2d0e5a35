//! A formula given as text.
//!
//! It is parsed by a whitelist of names, operators and functions to a list of operations on a stack,
//! which can be evaluated over any [`Scalar`]; nothing else in the text means anything.

use thiserror::Error;

use super::parse;
use crate::scalar::{Mask, Scalar};

/// The most characters of a formula.
pub const LONGEST: usize = 1000;
/// How deep its brackets, powers and signs may be nested.
pub const DEEPEST: usize = 50;
/// The largest whole exponent.
pub const HIGHEST: i32 = 1024;

/// The names that a formula may use, beside the time `t`, the number `pi` and the functions.
#[derive(Clone, Copy, Debug)]
pub struct Names<'a> {
    /// The state's components; `name'` is the component's rate.
    pub states: &'a [String],
    pub parameters: &'a [String],
}

/// What is wrong with a formula.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct Mistake(pub(super) String);

/// What a formula takes from where it is evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Leaf {
    Number(f64),
    Time,
    State(usize),
    /// The time derivative of a component of the state.
    Rate(usize),
    Parameter(usize),
}

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unary {
    Neg,
    Abs,
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tanh,
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
    /// By `exp(b ln a)`.
    Power,
}

/// One operation on the stack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Op {
    Push(Leaf),
    Unary(Unary),
    Binary(Binary),
}

/// Where a formula is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a, S> {
    pub t: S,
    pub x: &'a [S],
    /// May be empty where the formula [has no rates](Expression::has_rates).
    pub rates: &'a [S],
    pub parameters: &'a [S],
}

/// A formula, ready to be evaluated.
///
/// ```
/// use udd::tape::{Expression, Names, Place};
/// let states = ["omega", "y", "z"].map(String::from);
/// let names = Names { states: &states, parameters: &["w".to_owned()] };
/// let energy = Expression::parse("(y^2 + z^2)/2 = w", names).unwrap();
/// let place = Place { t: 0.0, x: &[1.0, 2.0, 4.0], rates: &[], parameters: &[7.0] };
/// assert_eq!(energy.value(&place, &mut energy.stack()), 3.0);
/// assert!(Expression::parse("q - 1", names).is_err());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    ops: Vec<Op>,
    depth: usize,
}

impl Expression {
    /// Parses a formula, or an equation: then it is the left side less the right one.
    ///
    /// # Errors
    /// What is wrong, in words that continue "the formula ...".
    pub fn parse(text: &str, names: Names<'_>) -> Result<Self, Mistake> {
        let ops = parse::parse(text, names)?;
        let (mut depth, mut height) = (0, 0_usize);
        for op in &ops {
            match op {
                Op::Push(_) => height += 1,
                Op::Unary(_) => {}
                Op::Binary(_) => height -= 1,
            }
            depth = depth.max(height);
        }
        Ok(Self { ops, depth })
    }

    /// The operations.
    pub fn ops(&self) -> &[Op] {
        &self.ops
    }

    /// Room for [`value`](Expression::value), which allocates nothing.
    pub fn stack<S: Scalar>(&self) -> Vec<S> {
        vec![S::zero(); self.depth]
    }

    /// Whether it needs the rates.
    pub fn has_rates(&self) -> bool {
        self.ops.iter().any(|op| matches!(op, Op::Push(Leaf::Rate(_))))
    }

    /// Whether it changes in time, by the state or by itself.
    pub fn varies(&self) -> bool {
        self.ops.iter().any(|op| matches!(op, Op::Push(Leaf::Rate(_) | Leaf::State(_) | Leaf::Time)))
    }

    /// Its value.
    ///
    /// # Panics
    /// Where the stack was made for another formula, or the place lacks what the formula takes.
    #[inline(always)]
    pub fn value<S: Scalar>(&self, place: &Place<'_, S>, stack: &mut [S]) -> S {
        let mut top = 0;
        for op in &self.ops {
            match *op {
                Op::Push(leaf) => {
                    stack[top] = match leaf {
                        Leaf::Number(value) => S::constant(value),
                        Leaf::Time => place.t,
                        Leaf::State(n) => place.x[n],
                        Leaf::Rate(n) => place.rates[n],
                        Leaf::Parameter(i) => place.parameters[i],
                    };
                    top += 1;
                }
                Op::Unary(function) => stack[top - 1] = function.of(stack[top - 1]),
                Op::Binary(function) => {
                    top -= 1;
                    stack[top - 1] = function.of(stack[top - 1], stack[top]);
                }
            }
        }
        stack[0]
    }
}

impl Unary {
    /// The function's value.
    #[inline(always)]
    pub fn of<S: Scalar>(self, a: S) -> S {
        match self {
            Unary::Neg => -a,
            Unary::Abs => S::select(a.less(S::zero()).not(), a, -a),
            Unary::Sqrt => a.sqrt(),
            Unary::Exp => a.exp(),
            Unary::Ln => a.ln(),
            Unary::Sin => a.sin(),
            Unary::Cos => a.cos(),
            Unary::Tanh => a.tanh(),
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
            Binary::Power => (b * a.ln()).exp(),
        }
    }
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
