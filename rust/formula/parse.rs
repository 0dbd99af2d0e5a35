//! From a formula's text to its operations.
//!
//! ```text
//! equation = sum ["=" sum]
//! sum      = product {("+" | "-") product}
//! product  = signed {("*" | "/") signed}
//! signed   = ("-" | "+") signed | power
//! power    = atom [("^" | "**") signed]
//! atom     = number | name ["'"] | function "(" sum {"," sum} ")" | "(" sum ")"
//!          | "where" "(" sum ("<" | ">" | "<=" | ">=") sum "," sum "," sum ")"
//! ```

use super::{Binary, DEEPEST, HIGHEST, LONGEST, Leaf, Mistake, Names, Op, Spline, Unary};

/// The functions by their names.
pub(super) const FUNCTIONS: [(&str, Unary); 14] = [
    ("sqrt", Unary::Sqrt),
    ("exp", Unary::Exp),
    ("ln", Unary::Ln),
    ("log", Unary::Ln),
    ("sin", Unary::Sin),
    ("cos", Unary::Cos),
    ("tan", Unary::Tan),
    ("sinh", Unary::Sinh),
    ("cosh", Unary::Cosh),
    ("tanh", Unary::Tanh),
    ("atan", Unary::Atan),
    ("abs", Unary::Abs),
    ("sign", Unary::Sign),
    ("bspline", Unary::Bspline),
];

type Parsed = Result<Vec<Op>, Mistake>;

fn mistake<T>(what: impl Into<String>) -> Result<T, Mistake> {
    Err(Mistake(what.into()))
}

/// The operations of a formula. If `exact`, states that are compared by `>=` or `<=` may be equal.
pub(super) fn parse(text: &str, names: Names<'_>, exact: bool) -> Parsed {
    let length = text.chars().count();
    if length > LONGEST {
        return mistake(format!("is longer than {LONGEST} characters, {length}"));
    }
    let tokens = tokens(text)?;
    if tokens.is_empty() {
        return mistake("is empty");
    }
    let mut parser = Parser { tokens: &tokens, at: 0, depth: 0, names, exact };
    let mut ops = parser.sum()?;
    if parser.takes("=") {
        let right = parser.sum()?;
        // A right side of zero needs no difference.
        if number(&right) != Some(0.0) {
            ops = binary(Binary::Sub, ops, right);
        }
    }
    match parser.peek() {
        None => Ok(ops),
        Some(Token::Sign("=")) => mistake("has more than one ="),
        Some(token) => mistake(format!("has {} where an operator is needed", token.shown())),
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Token<'a> {
    Number(f64),
    Name(&'a str),
    Sign(&'static str),
}

impl Token<'_> {
    fn shown(&self) -> String {
        match self {
            Token::Number(value) => value.to_string(),
            Token::Name(name) => (*name).to_owned(),
            Token::Sign(sign) => (*sign).to_owned(),
        }
    }
}

const SIGNS: [&str; 15] = ["**", "<=", ">=", "<", ">", "+", "-", "*", "/", "^", "(", ")", "=", "'", ","];

fn tokens(text: &str) -> Result<Vec<Token<'_>>, Mistake> {
    let mut list = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let length = if first.is_ascii_digit() || first == '.' {
            let length = digits(rest);
            match rest[..length].parse::<f64>() {
                Ok(value) if value.is_finite() => list.push(Token::Number(value)),
                _ => return mistake(format!("has {}, which is no number", &rest[..length])),
            }
            length
        } else if first.is_alphabetic() || first == '_' {
            let inside = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
            let length = rest.find(|c| !inside(c)).unwrap_or(rest.len());
            list.push(Token::Name(&rest[..length]));
            length
        } else if let Some(sign) = SIGNS.iter().find(|sign| rest.starts_with(**sign)) {
            list.push(Token::Sign(sign));
            sign.len()
        } else {
            return mistake(format!("has the character {first:?}, which means nothing in a formula"));
        };
        rest = rest[length..].trim_start();
    }
    Ok(list)
}

/// How long the number is that the text begins with.
fn digits(text: &str) -> usize {
    let bytes = text.as_bytes();
    let mut at = 0;
    let skip = |mut at: usize| {
        while bytes.get(at).is_some_and(|c| c.is_ascii_digit() || *c == b'.') {
            at += 1;
        }
        at
    };
    at = skip(at);
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
        if bytes.get(at + 1 + sign).is_some_and(u8::is_ascii_digit) {
            at = skip(at + 1 + sign);
        }
    }
    at
}

struct Parser<'a> {
    tokens: &'a [Token<'a>],
    at: usize,
    depth: usize,
    names: Names<'a>,
    exact: bool,
}

impl Parser<'_> {
    fn peek(&self) -> Option<&Token<'_>> {
        self.tokens.get(self.at)
    }

    fn takes(&mut self, sign: &'static str) -> bool {
        let taken = self.tokens.get(self.at) == Some(&Token::Sign(sign));
        self.at += usize::from(taken);
        taken
    }

    fn deeper(&mut self) -> Result<(), Mistake> {
        self.depth += 1;
        if self.depth > DEEPEST { mistake(format!("is nested deeper than {DEEPEST}")) } else { Ok(()) }
    }

    fn sum(&mut self) -> Parsed {
        let mut left = self.product()?;
        loop {
            let function = match () {
                () if self.takes("+") => Binary::Add,
                () if self.takes("-") => Binary::Sub,
                () => return Ok(left),
            };
            left = binary(function, left, self.product()?);
        }
    }

    fn product(&mut self) -> Parsed {
        let mut left = self.signed()?;
        loop {
            let function = match () {
                () if self.takes("*") => Binary::Mul,
                () if self.takes("/") => Binary::Div,
                () => return Ok(left),
            };
            left = binary(function, left, self.signed()?);
        }
    }

    fn signed(&mut self) -> Parsed {
        self.deeper()?;
        let parsed = if self.takes("-") {
            unary(Unary::Neg, self.signed()?)
        } else if self.takes("+") {
            self.signed()?
        } else {
            self.power()?
        };
        self.depth -= 1;
        Ok(parsed)
    }

    fn power(&mut self) -> Parsed {
        let base = self.atom()?;
        if !self.takes("^") && !self.takes("**") {
            return Ok(base);
        }
        let exponent = self.signed()?;
        match number(&exponent) {
            Some(whole) if whole == whole.trunc() => {
                if whole.abs() > f64::from(HIGHEST) {
                    return mistake(format!("has a whole exponent beyond {HIGHEST}"));
                }
                Ok(unary(Unary::Power(whole as i32), base))
            }
            Some(0.5) => Ok(unary(Unary::Sqrt, base)),
            _ => Ok(binary(Binary::Power, base, exponent)),
        }
    }

    fn atom(&mut self) -> Parsed {
        let Some(token) = self.tokens.get(self.at) else {
            return mistake("ends where a number or a name is needed");
        };
        self.at += 1;
        match *token {
            Token::Number(value) => Ok(vec![Op::Push(Leaf::Number(value))]),
            Token::Sign("(") => {
                let inner = self.sum()?;
                self.close()?;
                Ok(inner)
            }
            Token::Sign(sign) => mistake(format!("has {sign} where a number or a name is needed")),
            Token::Name(name) => self.name(name),
        }
    }

    fn close(&mut self) -> Result<(), Mistake> {
        if self.takes(")") { Ok(()) } else { mistake("lacks a closing bracket") }
    }

    /// Parses the arguments of a function of two numbers: `(y, x)`.
    fn pair(&mut self, name: &str, function: Binary) -> Parsed {
        let usage = || mistake(format!("needs two numbers after {name}, as in {name}(y, x)"));
        if !self.takes("(") {
            return usage();
        }
        let left = self.sum()?;
        if !self.takes(",") {
            return usage();
        }
        let right = self.sum()?;
        self.close()?;
        Ok(binary(function, left, right))
    }

    /// Parses the arguments of the choice: `(x > 0, a, b)`.
    fn choice(&mut self) -> Parsed {
        let usage = || {
            mistake(format!("needs a comparison and two numbers after {WHERE}, as in {WHERE}(x > 0, a, b)"))
        };
        if !self.takes("(") {
            return usage();
        }
        let left = self.sum()?;
        let (above, equal) = match () {
            () if self.takes(">=") => (true, true),
            () if self.takes(">") => (true, false),
            () if self.takes("<=") => (false, true),
            () if self.takes("<") => (false, false),
            () => return usage(),
        };
        let right = self.sum()?;
        // Parameters and inputs can stay equal; a state is equal to something for a moment only.
        let lasts = |ops: &[Op]| {
            !ops.iter().any(|op| matches!(op, Op::Push(Leaf::State(_) | Leaf::Rate(_) | Leaf::Time)))
        };
        // Then a >= b is the opposite of b > a.
        let opposite = equal && (self.exact || lasts(&left) && lasts(&right));
        let (high, low) = if above != opposite { (left, right) } else { (right, left) };
        // A comparison with zero needs no difference.
        let mut ops = if number(&low) == Some(0.0) { high } else { binary(Binary::Sub, high, low) };
        let mut choices = [Vec::new(), Vec::new()];
        for choice in &mut choices {
            if !self.takes(",") {
                return usage();
            }
            *choice = self.sum()?;
        }
        self.close()?;
        if opposite {
            choices.reverse();
        }
        ops.extend(choices.concat());
        ops.push(Op::Where);
        Ok(ops)
    }

    /// Parses the arguments of a spline: `(x, low, high, c0, c1, ...)`.
    fn spline(&mut self, name: &str) -> Parsed {
        let usage = || {
            mistake(format!(
                "needs {name}(x, low, high, c0, c1, ...) with numbers low below high and at least four parameters that follow each other"
            ))
        };
        if !self.takes("(") {
            return usage();
        }
        let mut ops = self.sum()?;
        let mut rest = Vec::new();
        while self.takes(",") {
            rest.push(self.sum()?);
        }
        self.close()?;
        let [low, high, coefficients @ ..] = rest.as_slice() else { return usage() };
        let (Some(low), Some(high)) = (number(low), number(high)) else { return usage() };
        let places: Vec<usize> = coefficients
            .iter()
            .filter_map(|one| match one.as_slice() {
                [Op::Push(Leaf::Parameter(i))] => Some(*i),
                _ => None,
            })
            .collect();
        let in_order = places.windows(2).all(|pair| pair[1] == pair[0] + 1);
        if places.len() < 4 || places.len() != coefficients.len() || !in_order || low >= high {
            return usage();
        }
        let spline = Spline::new(places[0], places.len(), (low, high), name == "periodic");
        if !spline.per.is_finite() {
            return usage();
        }
        ops.push(Op::Spline(spline));
        Ok(ops)
    }

    fn name(&mut self, name: &str) -> Parsed {
        let find = |list: &[String]| list.iter().position(|own| own == name);
        let leaf = if let Some(n) = find(self.names.states) {
            if self.names.rates && self.takes("'") { Leaf::Rate(n) } else { Leaf::State(n) }
        } else if let Some(i) = find(self.names.parameters) {
            Leaf::Parameter(i)
        } else if let Some(k) = find(self.names.inputs) {
            Leaf::Input(k)
        } else if name == "t" {
            Leaf::Time
        } else if name == "pi" {
            Leaf::Number(std::f64::consts::PI)
        } else if let Some(&(_, function)) = FUNCTIONS.iter().find(|(own, _)| *own == name) {
            if !self.takes("(") {
                return mistake(format!("needs a bracket after {name}, as in {name}(x)"));
            }
            let argument = self.sum()?;
            self.close()?;
            return Ok(unary(function, argument));
        } else if let Some(&(_, function)) = BINARY.iter().find(|(own, _)| *own == name) {
            return self.pair(name, function);
        } else if name == WHERE {
            return self.choice();
        } else if SPLINES.contains(&name) {
            return self.spline(name);
        } else {
            return mistake(format!("has the unknown name {name}; {}", allowed(self.names)));
        };
        if self.peek() == Some(&Token::Sign("'")) {
            let why = if self.names.rates {
                "only the state's components have"
            } else {
                "this formula may not use"
            };
            return mistake(format!("has {name}', but {why} rates"));
        }
        Ok(vec![Op::Push(leaf)])
    }
}

/// The functions of two numbers by their names.
pub(super) const BINARY: [(&str, Binary); 3] =
    [("atan2", Binary::Atan2), ("min", Binary::Min), ("max", Binary::Max)];

/// The choice between two numbers.
pub(super) const WHERE: &str = "where";

/// The functions that are given by coefficients.
pub(super) const SPLINES: [&str; 2] = ["spline", "periodic"];

/// Lists the names that a formula may use.
fn allowed(names: Names<'_>) -> String {
    let states = names.states.join(", ");
    let rates = match names.rates {
        true => format!(
            ", its rates {}",
            names.states.iter().map(|name| format!("{name}'")).collect::<Vec<_>>().join(", ")
        ),
        false => String::new(),
    };
    let (unary, binary) = (FUNCTIONS.map(|(name, _)| name), BINARY.map(|(name, _)| name));
    let functions = [&unary[..], &binary, &[WHERE], &SPLINES].concat().join(", ");
    let listed = |what: &str, list: &[String]| match list {
        [] => String::new(),
        list => format!(", the {what} {}", list.join(", ")),
    };
    let (inputs, parameters) = (listed("inputs", names.inputs), listed("parameters", names.parameters));
    format!(
        "allowed are the state {states}{rates}, the time t{inputs}{parameters}, numbers, pi and {functions}"
    )
}

fn number(ops: &[Op]) -> Option<f64> {
    match ops {
        [Op::Push(Leaf::Number(value))] => Some(*value),
        _ => None,
    }
}

/// Computes functions of constants at once.
fn unary(function: Unary, mut ops: Vec<Op>) -> Vec<Op> {
    if let Some(a) = number(&ops) {
        return vec![Op::Push(Leaf::Number(function.of(a)))];
    }
    if function != Unary::Power(1) {
        ops.push(Op::Unary(function));
    }
    ops
}

fn binary(function: Binary, mut left: Vec<Op>, right: Vec<Op>) -> Vec<Op> {
    if let (Some(a), Some(b)) = (number(&left), number(&right)) {
        return vec![Op::Push(Leaf::Number(function.of(a, b)))];
    }
    left.extend(right);
    left.push(Op::Binary(function));
    left
}
