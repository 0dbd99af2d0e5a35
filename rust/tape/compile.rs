//! Machine code for the series of a tape.
//!
//! It does what [`Program::start`] and [`Program::next`] do, with the same operations in the same order: no bit changes.
//! Elementary functions, which have to be evaluated for order 0, are left to the interpreter.

use super::fuse::{Chain, First, Program, Then};
use super::group::{MOST, Plan, Task, Work};
use super::kept::Kept;
use super::node::{INVERSE, Node, Step};
use crate::machine::{Array, Code, Listing, Operand, Operation, Place, Register};
use crate::model::{PIECE_COEFFICIENTS, Sides};
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
/// The sign bit.
const SIGN: Register = Register(15);

/// A register for halves of rows.
const HALF: Register = Register(4);

/// Code for the coefficients of the orders 1 to `order`, with room for `room` of them in each series. Single trajectories have
/// the plan's rows and held values behind the slots.
pub(super) fn series(program: &Program, isa: Isa, lanes: usize, room: usize, order: usize) -> Option<Code> {
    let rows = program.slots * room;
    let held = rows + MOST * program.plan.rows.len() * room;
    let mut code = Series { rows, held, ..Series::new(Listing::new(isa, lanes), room) };
    let sign = code.list.constant(-0.0);
    if lanes == 1 {
        code.begin(&program.plan);
        code.list.set_width(4);
    }
    code.list.load(SIGN, sign);
    for k in 1..order.min(room - 1) {
        code.k = k;
        match lanes {
            1 => program.plan.tasks.iter().for_each(|task| code.task(&program.plan, task)),
            _ => code.order(program),
        }
        if code.list.len() > MOST_OPERATIONS {
            return None;
        }
    }
    code.list.end();
    if lanes > 1 {
        // The other series are only steps on the way.
        code.list.allocate(program.components() * room);
    }
    Code::new(code.list)
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
            code.kept = Kept::default();
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
    if lanes > 1 {
        code.list.allocate(usize::MAX);
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
    kept: Kept,
}

impl Series {
    fn new(list: Listing, room: usize) -> Self {
        Self { list, rows: 0, held: 0, room, k: 0, in_rows: false, kept: Kept::default() }
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

    /// Fills rows with what is known before the first order.
    fn begin(&mut self, plan: &Plan) {
        for (i, values) in plan.held.iter().enumerate() {
            let places: Vec<_> = values.iter().map(|&h| Place(Array::Held, usize::from(h))).collect();
            self.list.gather(C, HALF, &places);
            self.list.store(Place(Array::Work, self.held + MOST * i), C);
        }
        for (i, row) in plan.rows.iter().enumerate() {
            // The state is known to order 1.
            for k in 0..=usize::from(row.computed) {
                self.k = k;
                self.gather(i, &row.slots);
            }
        }
    }

    fn task(&mut self, plan: &Plan, task: &Task) {
        match task {
            Task::Single(work) => {
                self.list.set_width(1);
                self.work(*work);
            }
            Task::Gather(row) => self.gather(*row, &plan.rows[*row].slots),
            Task::Group(works, lanes, scattered) => {
                self.list.set_width(*lanes);
                self.in_rows = true;
                works.iter().for_each(|&work| self.work(work));
                self.in_rows = false;
                for &(row, is_rate) in scattered {
                    let k = self.k + usize::from(is_rate);
                    let places = self.places(&plan.rows[row].slots, k);
                    let row = self.operand_at(self.in_row(row, k));
                    let row = self.loaded(row, C);
                    self.list.scatter(&places, row, HALF);
                }
            }
        }
    }

    fn work(&mut self, work: Work) {
        match work {
            Work::Chain(chain) => self.chain(&chain),
            Work::Step(step) => self.step(step),
        }
    }

    fn gather(&mut self, row: usize, slots: &[u16]) {
        let places = self.places(slots, self.k);
        self.list.gather(C, HALF, &places);
        self.put(self.in_row(row, self.k), C);
    }

    fn places(&self, slots: &[u16], k: usize) -> Vec<Place> {
        slots.iter().map(|&slot| Place(Array::Work, usize::from(slot) * self.room + k)).collect()
    }

    fn in_row(&self, row: usize, k: usize) -> Place {
        Place(Array::Work, self.rows + MOST * (row * self.room + k))
    }

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

    /// The number stored at a place, in its register or there.
    fn operand_at(&mut self, place: Place) -> Operand {
        self.kept.of(place, self.list.width()).map_or(place.into(), Operand::from)
    }

    /// A coefficient.
    fn at(&mut self, slot: u16, k: usize) -> Operand {
        self.operand_at(self.place(slot, k))
    }

    /// An operand in its register, or loaded into this one.
    fn loaded(&mut self, operand: Operand, to: Register) -> Register {
        match operand {
            Operand::Register(register) => register,
            place @ Operand::Place(_) => {
                self.list.load(to, place);
                to
            }
        }
    }

    fn load(&mut self, to: Register, slot: u16, k: usize) {
        let operand = self.at(slot, k);
        self.list.load(to, operand);
    }

    /// Stores a result.
    fn put(&mut self, place: Place, from: Register) {
        self.list.store(place, from);
        let kept = self.kept.room(place, self.list.width());
        self.list.load(kept, from);
    }

    fn store(&mut self, slot: u16) {
        self.put(self.place(slot, self.k), C);
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
        self.put(self.place(n, self.k + 1), C);
    }

    /// Adds `a b` to the sum in a register, if there is one yet; returns that there is.
    fn with(&mut self, sum: Register, any: bool, a: (u16, usize), b: (u16, usize)) -> bool {
        let a = self.at(a.0, a.1);
        let a = self.loaded(a, FACTOR);
        let b = self.at(b.0, b.1);
        self.times(sum, any, a, b)
    }

    /// The same where the factor `a` is loaded.
    fn times(&mut self, sum: Register, any: bool, a: Register, b: impl Into<Operand>) -> bool {
        // Adding to -0 changes nothing.
        match any {
            true => self.list.apply(Operation::Fused, sum, a, b),
            false => self.list.apply(Operation::Mul, sum, a, b),
        }
        true
    }

    /// [`inner`](super::series::inner) in `c`; returns whether it is not empty.
    fn inner(&mut self, a: u16, b: u16) -> bool {
        let k = self.k;
        let (mut even, mut odd) = (false, false);
        if k.is_multiple_of(2) {
            even = self.with(C, even, (a, k / 2), (b, k / 2));
        }
        for j in (1..=(k - 1) / 2).rev() {
            even = self.with(C, even, (a, j), (b, k - j));
            odd = self.with(ODD, odd, (a, k - j), (b, j));
        }
        if odd {
            self.apply(Operation::Add, ODD);
        }
        even
    }

    /// [`inner_square`](super::series::inner_square) in `c`; returns whether it is not empty.
    fn inner_square(&mut self, a: u16) -> bool {
        let (k, mut any) = (self.k, false);
        for j in (1..=(k - 1) / 2).rev() {
            any = self.with(C, any, (a, j), (a, k - j));
        }
        if any {
            self.apply(Operation::Add, C);
        }
        if k.is_multiple_of(2) {
            any = self.with(C, any, (a, k / 2), (a, k / 2));
        }
        any
    }

    fn chain(&mut self, chain: &Chain) {
        let (k, a, b) = (self.k, chain.a, chain.b);
        match chain.first {
            First::Series => self.load(C, a, k),
            _ if k == 0 => {
                self.with(C, false, (a, 0), (b, 0));
            }
            First::Product => {
                let any = self.inner(a, b);
                let any = self.with(C, any, (a, 0), (b, k));
                self.with(C, any, (a, k), (b, 0));
            }
            First::Square => {
                let any = self.inner_square(a);
                self.load(FACTOR, a, 0);
                self.list.apply(Operation::Add, FACTOR, FACTOR, FACTOR);
                let last = self.at(a, k);
                self.times(C, any, FACTOR, last);
            }
        }
        for &then in &chain.then[..usize::from(chain.count)] {
            self.then(then);
        }
        if chain.is_rate {
            self.rate(chain.to);
        } else {
            self.store(chain.to);
        }
    }

    fn then(&mut self, then: Then) {
        use Operation::{Add, Mul, Sub, Xor};
        let k = self.k;
        match then {
            // A constant has only a coefficient of order 0.
            Then::Plus(h) if k == 0 => self.apply(Add, self.held(h)),
            Then::Minus(h) if k == 0 => self.apply(Sub, self.held(h)),
            Then::FromHeld(h) if k == 0 => {
                self.list.load(FACTOR, self.held(h));
                self.list.apply(Sub, C, FACTOR, C);
            }
            Then::Plus(_) | Then::Minus(_) => {}
            Then::Neg | Then::FromHeld(_) => self.apply(Xor, SIGN),
            Then::Add(a) | Then::Sub(a) => {
                let a = self.at(a, k);
                self.apply(if matches!(then, Then::Add(_)) { Add } else { Sub }, a);
            }
            Then::Scale(h) => self.apply(Mul, self.held(h)),
            Then::From(a) => {
                let a = self.at(a, k);
                let a = self.loaded(a, FACTOR);
                self.list.apply(Sub, C, a, C);
            }
            Then::AddScaled(a, h) | Then::SubScaled(a, h) | Then::FromScaled(a, h) => {
                let a = self.at(a, k);
                let a = self.loaded(a, FACTOR);
                self.list.apply(Mul, FACTOR, a, self.held(h));
                match then {
                    Then::AddScaled(..) => self.apply(Add, FACTOR),
                    Then::SubScaled(..) => self.apply(Sub, FACTOR),
                    _ => self.list.apply(Sub, C, FACTOR, C),
                }
            }
        }
    }

    /// As [`Step::start`]; `None` if the step has to be interpreted.
    fn first(&mut self, step: Step) -> Option<()> {
        let to = step.to;
        match step.node {
            // Done with the sine and the tangent.
            Node::Cos(_) | Node::CosOfTime(_) | Node::Slope(_) => return Some(()),
            Node::Hold(h) => self.list.load(C, self.held(h)),
            Node::Select(side, a, b) => self.select(side, a, b),
            Node::Div(a, b) => {
                self.inverse(1.0, (b, 0), to + 1);
                let a = self.at(a, 0);
                self.list.apply(Operation::Mul, C, FACTOR, a);
            }
            Node::Over(h, b) => {
                self.inverse(1.0, (b, 0), to + 1);
                self.list.apply(Operation::Mul, C, FACTOR, self.held(h));
            }
            Node::Sqrt(a) => {
                self.load(C, a, 0);
                self.list.apply(Operation::Root, C, C, C);
                self.store(to);
                self.inverse(0.5, (to, 0), to + 1);
                return Some(());
            }
            _ => return None,
        }
        self.store(to);
        Some(())
    }

    /// A number over a coefficient as the factor, stored too.
    fn inverse(&mut self, number: f64, of: (u16, usize), to: u16) {
        let number = self.list.constant(number);
        self.list.load(FACTOR, number);
        let of = self.at(of.0, of.1);
        self.list.apply(Operation::Div, FACTOR, FACTOR, of);
        self.put(self.place(to, 0), FACTOR);
    }

    /// `c` by the side of a surface.
    fn select(&mut self, side: u16, a: u16, b: u16) {
        use Operation::{And, AndNot, Or};
        self.list.load(MASK, Place(Array::Sides, usize::from(side)));
        self.load(C, a, self.k);
        self.load(FACTOR, b, self.k);
        self.list.apply(AndNot, FACTOR, MASK, FACTOR);
        self.apply(And, MASK);
        self.apply(Or, FACTOR);
    }

    /// As [`Step::next`].
    fn step(&mut self, step: Step) {
        use Operation::{Add, Mul, Sub, Xor};
        let (k, to) = (self.k, step.to);
        let any = match step.factors() {
            Some((a, b)) if a == b => self.inner_square(a),
            Some((a, b)) => self.inner(a, b),
            None => false,
        };
        // An empty sum is -0.
        let sum = if any { C } else { SIGN };
        match step.node {
            Node::Input(_) if k < PIECE_COEFFICIENTS => return,
            Node::Time | Node::Hold(_) | Node::Input(_) | Node::Piece(..) => {
                let value = f64::from(step.node == Node::Time && k == 1);
                let value = self.list.constant(value);
                self.list.load(C, value);
            }
            Node::Div(_, b) | Node::Over(_, b) => {
                self.with(C, any, (to, 0), (b, k));
                if let Node::Div(a, _) = step.node {
                    self.load(FACTOR, a, k);
                    self.list.apply(Sub, C, FACTOR, C);
                    let inverse = self.at(to + 1, 0);
                    self.apply(Mul, inverse);
                } else {
                    let inverse = self.at(to + 1, 0);
                    self.apply(Mul, inverse);
                    self.apply(Xor, SIGN);
                }
            }
            Node::Sqrt(a) => {
                self.load(FACTOR, a, k);
                self.list.apply(Sub, C, FACTOR, sum);
                let inverse = self.at(to + 1, 0);
                self.apply(Mul, inverse);
            }
            Node::Exp(a) => {
                self.slope(a, to + 1);
                let own = self.at(to, 0);
                self.times(C, any, FACTOR, own);
                self.scale(INVERSE[k]);
            }
            Node::Ln(a) => {
                self.weighted(a);
                self.list.apply(Sub, C, FACTOR, sum);
                let inverse = self.at(to + 2, 0);
                self.apply(Mul, inverse);
                self.store(to + 1);
                self.scale(INVERSE[k]);
            }
            Node::Sin(a) | Node::Tanh(a) => {
                self.slope(a, to + 2);
                let other = self.at(to + 1, 0);
                self.times(C, any, FACTOR, other);
                self.scale(INVERSE[k]);
            }
            Node::Cos(sine) => {
                self.with(C, any, (sine + 2, k), (sine, 0));
                self.scale(-INVERSE[k]);
            }
            Node::SinOfTime(a) => {
                if k == 1 {
                    self.load(FACTOR, a, 1);
                    self.put(self.place(to + 2, 1), FACTOR);
                }
                self.with(C, false, (to + 2, 1), (to + 1, k - 1));
                self.scale(INVERSE[k]);
            }
            Node::CosOfTime(sine) => {
                self.with(C, false, (sine + 2, 1), (sine, k - 1));
                self.scale(-INVERSE[k]);
            }
            Node::Slope(tanh) => {
                self.load(FACTOR, tanh, 0);
                self.list.apply(Add, FACTOR, FACTOR, FACTOR);
                let last = self.at(tanh, k);
                self.times(C, any, FACTOR, last);
                self.apply(Xor, SIGN);
            }
            Node::Select(side, a, b) => self.select(side, a, b),
            Node::Neg(_)
            | Node::Add(..)
            | Node::Sub(..)
            | Node::Plus(..)
            | Node::Minus(..)
            | Node::From(..)
            | Node::Scale(..)
            | Node::Mul(..)
            | Node::Square(_) => unreachable!("products and linear steps are in chains"),
        }
        self.store(to);
    }

    /// The coefficient of a series' derivative as the factor; `c` stays.
    fn weighted(&mut self, a: u16) {
        let weight = self.list.constant(self.k as f64);
        self.load(FACTOR, a, self.k);
        self.list.load(MASK, weight);
        self.list.apply(Operation::Mul, FACTOR, FACTOR, MASK);
    }

    /// The same, stored too.
    fn slope(&mut self, a: u16, to: u16) {
        self.weighted(a);
        self.put(self.place(to, self.k), FACTOR);
    }
}

#[cfg(test)]
mod tests {
    use std::array::from_fn;

    use super::*;
    use crate::model::FormulaFamily;
    use crate::scalar::{LANES, Packet, Plain, Real};
    use crate::tape::{HIGH, Tape, node};

    const ROOM: usize = HIGH + 1;
    const ISAS: [Isa; 2] = [Isa::Avx2, Isa::Avx512];

    /// Laws of every kind of operation, with kinks and time.
    const LAWS: [[&str; 3]; 9] = [
        ["x*(k - z) - y", "abs(x)*y + z^3", "max(x, y)*sign(z) - c*x*y"],
        ["sin(x*y) + cos(x)", "exp(-x^2)*z + tanh(y*c + z)", "ln(3 + x^2) - sqrt(2 + y^2)"],
        ["x/(2 + y^2)", "k/(3 + x*z)", "cos(t)*x - min(t, y)"],
        ["1", "sqrt(4 + t)*z - x", "where(x > y, x*y, z*z) + ln(2 + t)"],
        // Sines of time, and of what is not linear in it.
        ["sin(k*t)*x - y", "cos(2 - c*t)*z + sin(k*t)", "cos(t*t)*x - sin(t + x)"],
        // The same operations side by side.
        ["k*x*y - z", "c*y*z - x", "k*z*x - y"],
        ["sin(x)*k + tanh(y*z)", "sin(y)*c + tanh(x*z)", "cos(z)*sin(x*y)"],
        ["exp(x)/(2 + y^2)", "exp(-y)/(2 + z^2)", "k/(1 + x^2) + ln(2 + y^2)*x - ln(2 + z^2)*y"],
        ["y", "-x^3 + c*(z - x) - k*y", "-z^3 + k*(x - z) - c*y + sqrt(1 + x^2) - sqrt(2 + y^2)"],
    ];

    /// The bits of the state's series, interpreted and by machine code. All numbers that are no numbers have the same bits.
    fn both_ways<S: Real>(tape: &Tape<3>, isa: Isa, order: usize, x: [S; 5]) -> Option<[Vec<u64>; 2]> {
        let (program, sides) = (&tape.program, from_fn(|j| S::mask(j % 2 == 1)));
        let code = series(program, isa, S::LANES, ROOM, order)?;
        let mut held = vec![S::zero(); tape.held.len()];
        node::hold(&tape.held, &x[3..], &sides, &mut held);
        let rows = if S::LANES == 1 { program.plan.numbers(ROOM).div_ceil(ROOM) } else { 0 };
        let mut work = vec![[S::zero(); ROOM]; tape.slots + rows];
        (0..3).for_each(|n| work[n][0] = x[n]);
        let t = S::constant(0.7);
        let mut interpreted = work.clone();
        program.interpret_start(&mut interpreted, &held, t, &sides);
        start(program, isa, S::LANES, ROOM)?.run(&mut work, &held, t, &sides);
        (1..order).for_each(|k| program.next::<Plain, S, ROOM>(&mut interpreted, &held, &sides, k));
        code.run(0, work.as_flattened_mut(), &held, &sides);
        let bits = |value: f64| if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() };
        let lanes = |c: &S| (0..S::LANES).map(|l| bits(c.lane(l))).collect::<Vec<_>>();
        Some([interpreted, work].map(|work| work[..3].as_flattened().iter().flat_map(lanes).collect()))
    }

    /// The second recording of the same equations has the code of the first one, though the parameters have other names.
    #[test]
    fn equal_equations_share_their_code() {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let record = |texts: [&str; 2], parameter: &str| {
            let family =
                FormulaFamily::<2>::parse(&names(&["x", "y"]), &texts, &names(&[parameter]), &[]).unwrap();
            Tape::record(&family, &[]).unwrap()
        };
        let has_code = |tape: &Tape<2>| tape.program.codes.get::<f64>(1, u32::MAX, |_| None).is_some();
        let first = record(["y", "-x - c*y^3"], "c");
        let made = first
            .program
            .codes
            .get::<f64>(1, 0, |lanes| series(&first.program, Isa::best(), lanes, ROOM, HIGH));
        let made = made.is_some();
        assert_eq!(has_code(&record(["y", "-x - k*y^3"], "k")), made);
        assert!(!has_code(&record(["y", "-x - k*y^2"], "k")));
    }

    /// Machine code has the interpreter's bits, for every operation, order and instruction set.
    #[test]
    fn machine_code_changes_no_bit() {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let mut compared = 0;
        for texts in LAWS {
            let (states, parameters) = (names(&["x", "y", "z"]), names(&["k", "c"]));
            let family = FormulaFamily::<3>::parse(&states, &texts, &parameters, &[]).unwrap();
            let tape = Tape::record(&family, &[]).unwrap();
            let places =
                [[0.3, -1.1, 0.8, 2.5, -0.4], [0.0, -0.0, 0.0, 1.0, 0.0], [1e155, 2.0, -1e160, 1.0, 1.0]];
            for (tape, x) in [tape.unfused(), tape].iter().flat_map(|tape| places.map(|x| (tape, x))) {
                for (isa, order) in ISAS.iter().flat_map(|isa| [4, 7, 10, HIGH].map(|k| (*isa, k))) {
                    let packets = x.map(|x| Packet::<LANES>::from_lanes(|l| x * (1.0 + 0.1 * l as f64)));
                    let wide = x.map(|x| Packet::<{ 2 * LANES }>::from_lanes(|l| x - 0.1 * l as f64));
                    for [interpreted, compiled] in [
                        both_ways(tape, isa, order, x),
                        both_ways(tape, isa, order, packets),
                        both_ways(tape, isa, order, wide),
                    ]
                    .into_iter()
                    .flatten()
                    {
                        assert_eq!(interpreted, compiled, "{texts:?} by {isa:?}, order {order}, at {x:?}");
                        compared += 1;
                    }
                }
            }
        }
        let sets = if cfg!(all(feature = "machine-code", target_arch = "x86_64")) {
            ISAS.into_iter().filter(|&isa| isa <= Isa::best()).count()
        } else {
            0
        };
        assert_eq!(compared, LAWS.len() * 2 * 3 * 4 * 3 * sets);
    }
}
