//! An effect that a user writes as text.

use super::{Body, Contributions, EffectInputs, Slot};
use crate::formula::{Binary, Expression, Leaf, Mistake, Names, Op, Place, Program, Unary, is_reserved};
use crate::scalar::Scalar;

/// The inputs of a formula in addition to the time: the [`EffectInputs`] by name. The last two are a pendulum's names
/// of `beta` and `R`.
const QUANTITIES: [&str; 12] =
    ["Omega", "speed", "Y", "Z", "beta", "k", "inertia", "W", "g", "R", "theta", "length"];
/// The places of `Omega`, `|Omega|` and those that only one of the bodies has.
const OMEGA: usize = 0;
const SPEED: usize = 1;
const OF_DISK: [usize; 2] = [7, 9];
const OF_PENDULUM: [usize; 2] = [10, 11];

/// An effect given as text, with parameters of its own.
///
/// ```
/// use udd::model::effects::{Formula, Slot};
/// let own = ["c".to_owned()];
/// let warp = Formula::parse("warp", Slot::Torque, "c*sin(2*beta)", &own, &own).unwrap();
/// assert_eq!(warp.parameters(), own);
/// assert!(Formula::parse("warp", Slot::Torque, "sin(c*beta)", &own, &own).is_err());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    name: String,
    slot: Slot,
    function: Program,
    parameters: Vec<String>,
    bodies: Vec<Body>,
}

impl Formula {
    /// Parses the text of an effect that enters this slot. It must be proportional to its `amplitudes`,
    /// which are some of its `parameters`.
    ///
    /// # Errors
    /// What is wrong, in words that continue "the formula ...".
    pub fn parse(
        name: &str,
        slot: Slot,
        text: &str,
        parameters: &[String],
        amplitudes: &[String],
    ) -> Result<Self, Mistake> {
        let wrong = |what: String| Err(Mistake(what));
        for own in parameters {
            if is_reserved(own) || QUANTITIES.contains(&own.as_str()) {
                return wrong(format!("cannot have a parameter called {own}, which means something else"));
            }
        }
        if text.replace("<=", "").replace(">=", "").contains('=') {
            return wrong("has =, but what is wanted is only what adds to its slot".to_owned());
        }
        let states = QUANTITIES.map(str::to_owned);
        let mut function =
            Expression::parse(text, Names { states: &states, parameters, inputs: &[], rates: false })?;
        // The side of |Omega| is known, so that its kink is landed on.
        function
            .replace(&[Op::Push(Leaf::State(OMEGA)), Op::Unary(Unary::Abs)], Op::Push(Leaf::State(SPEED)));
        let uses = |leaf| function.ops().contains(&Op::Push(leaf));
        let in_spline = |i| {
            function.ops().iter().any(|op| matches!(op, Op::Spline(own) if own.parameters().contains(&i)))
        };
        for (i, own) in parameters.iter().enumerate() {
            if !uses(Leaf::Parameter(i)) && !in_spline(i) {
                return wrong(format!("does not use its parameter {own}"));
            }
        }
        let is_amplitude: Vec<bool> = parameters.iter().map(|own| amplitudes.contains(own)).collect();
        if !amplitudes.is_empty() && degree(&function, &is_amplitude) != Degree::One {
            return wrong(format!(
                "is not proportional to {}; name those to which it is as the amplitudes",
                amplitudes.join(", ")
            ));
        }
        let any = |list: &[usize]| list.iter().any(|&n| uses(Leaf::State(n)));
        let velocity = matches!(slot, Slot::Lateral | Slot::Vertical);
        let mut bodies = Vec::new();
        if !any(&OF_PENDULUM) {
            bodies.push(Body::Disk);
        }
        if !any(&OF_DISK) && !velocity {
            bodies.push(Body::Pendulum);
        }
        if bodies.is_empty() {
            return wrong(
                "mixes what only a disk has (W, R, a moving contact) with theta or length".to_owned(),
            );
        }
        let function = Program::with_size(&function, SPEED, OMEGA);
        Ok(Self { name: name.to_owned(), slot, function, parameters: parameters.to_vec(), bodies })
    }

    /// Its name among a model's effects.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The slot that it enters.
    pub fn slot(&self) -> Slot {
        self.slot
    }

    /// The names of its own parameters.
    pub fn parameters(&self) -> &[String] {
        &self.parameters
    }

    /// The bodies that it can act on.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Computes what its parameters alone determine, for [`enter`](Formula::enter).
    pub(super) fn fix<S: Scalar>(&self, parameters: &[S]) -> Vec<S> {
        self.function.fix(parameters)
    }

    /// Adds it, after [`fix`](Formula::fix), to its slot.
    // One function for each kind of number, as for the library's.
    #[inline(never)]
    pub(super) fn enter<S: Scalar, A: Scalar>(
        &self,
        fixed: &[S],
        lift: &impl Fn(S) -> A,
        at: &EffectInputs<A>,
        slots: &mut Contributions<A>,
    ) {
        let x: [A; QUANTITIES.len()] = std::array::from_fn(|n| at.quantity(n));
        let place = Place { t: at.t, x: &x, rates: &[], inputs: &[] };
        let value = self.function.value_after(&place, fixed, lift);
        match self.slot {
            Slot::Torque => slots.torque += value,
            Slot::Friction => slots.friction += value,
            Slot::Lateral => slots.lateral += value,
            Slot::Vertical => slots.vertical += value,
        }
    }
}

impl<S: Scalar> EffectInputs<S> {
    /// By its place among the [`QUANTITIES`].
    #[inline(always)]
    fn quantity(&self, n: usize) -> S {
        match n {
            OMEGA => self.omega,
            SPEED => self.speed,
            2 => self.y,
            3 => self.z,
            4 | 10 => self.beta,
            5 => self.k,
            6 => self.inertia,
            7 => self.w,
            8 => self.g,
            _ => self.radius,
        }
    }
}

/// How a value depends on the amplitudes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Degree {
    /// Not at all.
    Zero,
    /// It is proportional to them.
    One,
    Other,
}

fn degree(function: &Expression, is_amplitude: &[bool]) -> Degree {
    use Degree::{One, Other, Zero};
    let mut stack = Vec::new();
    for op in function.ops() {
        let found = match *op {
            Op::Push(Leaf::Parameter(i)) if is_amplitude[i] => One,
            Op::Push(_) => Zero,
            Op::Unary(Unary::Neg) => stack.pop().unwrap_or(Zero),
            Op::Unary(_) => {
                if stack.pop() == Some(Zero) {
                    Zero
                } else {
                    Other
                }
            }
            Op::Spline(spline) => match (stack.pop(), &is_amplitude[spline.parameters()]) {
                (Some(Zero), own) if own.iter().all(|&amplitude| amplitude) => One,
                (Some(Zero), own) if !own.contains(&true) => Zero,
                _ => Other,
            },
            Op::Where | Op::On(..) | Op::Compared(..) | Op::Defined => {
                let mut any = false;
                for _ in 0..op.takes() {
                    any |= stack.pop() != Some(Zero);
                }
                if any { Other } else { Zero }
            }
            Op::Binary(function) => {
                let right = stack.pop().unwrap_or(Zero);
                let left = stack.pop().unwrap_or(Zero);
                match (function, left, right) {
                    (_, Zero, Zero) => Zero,
                    (Binary::Add | Binary::Sub, One, One) => One,
                    (Binary::Mul, Zero, One) | (Binary::Mul | Binary::Div, One, Zero) => One,
                    _ => Other,
                }
            }
        };
        stack.push(found);
    }
    stack.pop().unwrap_or(Zero)
}
