//! The Taylor coefficients of a solution.

use super::compile;
use super::fuse::Program;
use super::node::{INVERSE, hold};
use super::specialised::Specialised;
use super::{Invariant, Node, Tape, disk_series, dle_series};
use crate::model::{MAX_SURFACES, Piece, Sides, StepStart};
use crate::scalar::{InstructionSet, Isa, Mask, Plain, Real, Scalar, Work, vector};
use crate::unroll::unroll;

/// The orders whose programs are unrolled, which takes long to compile.
pub const LOW: usize = 10;
pub const HIGH: usize = 18;

/// Room for the Taylor coefficients of a solution of `D` equations, of orders 0 to `N - 1`.
#[derive(Clone, Debug)]
pub struct Jets<S: Scalar, const D: usize, const N: usize> {
    isa: Isa,
    order: usize,
    work: Vec<[S; N]>,
    held: Vec<S>,
    /// The same without derivatives, for the rates alone.
    values: Vec<[S::Real; 2]>,
    held_values: Vec<S::Real>,
    /// The place of the values of a single plain trajectory: a step begins where the last one was compared with the law.
    values_at: Option<StepStart<S::Real, D>>,
}

impl<S: Scalar, const D: usize, const N: usize> Jets<S, D, N> {
    const IS_SINGLE: bool = S::IS_PLAIN && S::Real::LANES == 1;

    /// Room for this tape, whose series are computed with these instructions.
    /// [`expand`](Jets::expand) allocates nothing.
    pub fn new(tape: &Tape<D>, isa: Isa) -> Self {
        const { assert!(N >= 5 && N <= INVERSE.len(), "between 4 and 24 orders") };
        let zero = S::Real::zero();
        // Machine code has rows and sums behind the slots.
        let rows =
            if S::IS_PLAIN { compile::numbers(&tape.program, N, Self::IS_SINGLE).div_ceil(N) } else { 0 };
        Self {
            isa,
            order: N - 1,
            work: vec![[S::zero(); N]; tape.slots + rows],
            held: vec![S::zero(); tape.held.len()],
            values: vec![[zero; 2]; tape.slots],
            held_values: vec![zero; tape.held.len()],
            values_at: None,
        }
    }

    /// The coefficients of the solution through the state `x` at time `t`, all laws taken on these
    /// sides of their surfaces.
    ///
    /// # Panics
    /// Where the room was made for another tape, or parameters are missing.
    pub fn expand(&mut self, tape: &Tape<D>, parameters: &[S], t: S, x: &[S; D], sides: &Sides<S>) {
        self.hold(tape, parameters, sides);
        S::Real::work(self.isa, Expansion { jets: self, tape, t, x, sides });
    }

    /// Evaluates what does not change along a solution.
    pub fn hold(&mut self, tape: &Tape<D>, parameters: &[S], sides: &Sides<S>) {
        self.values_at = None;
        hold(&tape.held, parameters, sides, &mut self.held);
        for i in 0..self.held.len() {
            self.held_values[i] = self.held[i].real();
        }
    }

    /// Uses these pieces of the inputs until the next call.
    #[inline(never)]
    pub fn set_inputs(&mut self, tape: &Tape<D>, piece: &dyn Fn(usize) -> Piece<S>) {
        self.values_at = None;
        for (i, held) in tape.held.iter().enumerate() {
            // Its coefficients are behind it.
            if let Invariant::Input(k, 0) = *held {
                let Piece { origin, coefficients } = piece(usize::from(k));
                self.held[i] = origin;
                for (held, c) in self.held[i + 1..].iter_mut().zip(coefficients) {
                    *held = S::constant(c);
                }
                for j in i..=i + coefficients.len() {
                    self.held_values[j] = self.held[j].real();
                }
            }
        }
    }

    /// The rates at a time and a state after [`hold`](Jets::hold), without derivatives.
    pub fn rates(
        &mut self,
        tape: &Tape<D>,
        t: S::Real,
        x: &[S::Real; D],
        sides: &Sides<S::Real>,
    ) -> [S::Real; D] {
        let Self { isa, values, held_values, .. } = self;
        let rates = Rates { program: &tape.program, values, held: held_values, t, x, sides };
        if const { S::Real::LANES > 1 } {
            return S::Real::work(*isa, rates);
        }
        let rates = rates.run::<Plain>();
        if const { Self::IS_SINGLE } {
            self.values_at = Some(StepStart { t, x: *x, sides: *sides });
        }
        rates
    }

    /// Takes order 0 from the values, if they are of this place.
    #[inline(always)]
    fn is_begun(&mut self, filled: &[u16], t: S::Real, x: &[S; D], sides: &Sides<S>) -> bool {
        let Some(at) = &self.values_at else { return false };
        let same = |a: S::Real, b: S::Real| a.lane(0).to_bits() == b.lane(0).to_bits();
        let mut all = same(at.t, t);
        unroll!(n in 0..D => { all &= same(at.x[n], x[n].real()); });
        for j in 0..MAX_SURFACES {
            all &= at.sides[j].lane(0) == sides[j].lane(0);
        }
        if all {
            for &slot in filled {
                self.work[usize::from(slot)][0] = S::lift(self.values[usize::from(slot)][0]);
            }
            unroll!(n in 0..D => { self.work[n][..2].copy_from_slice(&self.values[n].map(S::lift)); });
        }
        all
    }

    /// Goes up to this order only, at least 4.
    pub fn with_order(mut self, order: usize) -> Self {
        assert!((4..N).contains(&order), "there is no room for the order {order}");
        self.order = order;
        self
    }

    /// The highest order.
    #[inline(always)]
    pub fn order(&self) -> usize {
        self.order
    }

    /// The instructions that series are computed with.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// As [`expand`](Jets::expand) after [`hold`](Jets::hold), with the caller's instructions.
    #[inline(always)]
    pub fn expand_here<V: InstructionSet>(&mut self, tape: &Tape<D>, t: S, x: &[S; D], sides: &Sides<S>) {
        let is_started = const { Self::IS_SINGLE } && self.is_begun(&tape.program.filled, t.real(), x, sides);
        let Self { isa, work, held, order, .. } = self;
        let order = *order;
        // The number of equations is asked so that no other program is compiled.
        if const { D == 3 }
            && let Specialised::Dle { damped, held: at } = tape.known
        {
            let held = (held[usize::from(at[0])], damped.then(|| held[usize::from(at[2])]));
            return dle_series::expand::<V, S, D, N>(work, order, held, x);
        }
        if const { D == 4 }
            && let Specialised::Disk(at) = &tape.known
        {
            return disk_series::expand::<V, S, D, N>(work, order, (held, at), x, sides);
        }
        if !is_started {
            unroll!(n in 0..D => { work[n][0] = x[n]; });
        }
        let program = &tape.program;
        S::Real::work(*isa, Interpretation { program, work, order, held, t, sides, is_started });
    }

    /// True if the law has [levelled off](Tape::levels_off) to the last bit: its series then contains nothing of the
    /// motion beyond.
    #[inline(never)]
    pub fn flat(&self, tape: &Tape<D>) -> S::Mask {
        let mut flat = S::mask(false);
        for step in &tape.steps {
            let at = match step.node {
                Node::Exp(_) => step.to,
                // Its slope.
                Node::Tanh(_) => step.to + 1,
                _ => continue,
            };
            let size = self.work[usize::from(at)][0].real().abs();
            flat = flat.or(size.less(S::Real::constant(f64::MIN_POSITIVE)));
        }
        flat
    }

    /// The coefficients of each component, order 0 first. Coefficients above the [`order`](Jets::order) mean nothing.
    #[inline(always)]
    pub fn coefficients(&self) -> &[[S; N]; D] {
        self.work.first_chunk().expect("a slot for each component")
    }
}

/// The work that is compiled once for each instruction set.
struct Expansion<'a, S: Scalar, const D: usize, const N: usize> {
    jets: &'a mut Jets<S, D, N>,
    tape: &'a Tape<D>,
    t: S,
    x: &'a [S; D],
    sides: &'a Sides<S>,
}

impl<S: Scalar, const D: usize, const N: usize> Work for Expansion<'_, S, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<V: InstructionSet>(self) {
        self.jets.expand_here::<V>(self.tape, self.t, self.x, self.sides);
    }
}

/// The rates alone, compiled once for each instruction set that packets are made of.
struct Rates<'a, R: Real, const D: usize> {
    program: &'a Program,
    /// The coefficients of order 0, and the rates as those of order 1 of the state.
    values: &'a mut [[R; 2]],
    held: &'a [R],
    t: R,
    x: &'a [R; D],
    sides: &'a Sides<R>,
}

impl<R: Real, const D: usize> Work for Rates<'_, R, D> {
    type Output = [R; D];

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> [R; D] {
        let Self { program, values, held, t, x, sides } = self;
        unroll!(n in 0..D => { values[n][0] = x[n]; });
        if const { R::LANES > 1 } {
            program.start(values, held, t, sides);
        } else {
            begin(program, values, held, t, sides);
        }
        vector!(R, D; n => values[n][1])
    }
}

/// The series of any tape: compiled once for each instruction set and kind of number.
struct Interpretation<'a, S: Scalar, const N: usize> {
    program: &'a Program,
    /// The state is in the first ones.
    work: &'a mut [[S; N]],
    order: usize,
    held: &'a [S],
    t: S,
    sides: &'a Sides<S>,
    /// True if order 0 is known.
    is_started: bool,
}

impl<S: Scalar, const N: usize> Work for Interpretation<'_, S, N> {
    type Output = ();
    // Eight derivatives fill a register.
    const WIDE: bool = size_of::<S>() > 8 * size_of::<f64>();

    #[inline(always)]
    fn run<V: InstructionSet>(self) {
        let Self { program, work, order, held, t, sides, is_started } = self;
        if const { S::Real::LANES > 1 } {
            // Packets are only fast with their own instructions.
            program.start(work, held, t, sides);
        } else if !is_started {
            begin(program, work, held, t, sides);
        }
        // Machine code is made for the orders that are used, with the best instructions.
        let is_best = S::Real::LANES == 1 || V::ISA == Isa::best();
        if is_best && (order == LOW || order == HIGH) {
            let make = |lanes| compile::series(program, Isa::best(), lanes, N, order);
            let variant = usize::from(order == HIGH);
            if let Some(code) = program.codes.get::<S>(variant, compile::INTERPRETED, make) {
                return code.run(0, work.as_flattened_mut(), held, sides);
            }
        }
        for k in 1..order.min(N - 1) {
            program.next::<V, S, N>(work, held, sides, k);
        }
    }
}

/// Coefficient 0 of every operation. Once per step: over single numbers not worth a copy for each instruction set.
#[inline(never)]
fn begin<S: Scalar, const N: usize>(
    program: &Program,
    work: &mut [[S; N]],
    held: &[S],
    t: S,
    sides: &Sides<S>,
) {
    program.start(work, held, t, sides);
}

#[cfg(test)]
mod tests {
    use std::array::from_fn;

    use super::*;
    use crate::model::FormulaFamily;

    fn tape(texts: [&str; 2]) -> Tape<2> {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let family = FormulaFamily::parse(&names(&["x", "y"]), &texts, &names(&["k", "c"]), &[]).unwrap();
        Tape::record(&family, &[]).unwrap()
    }

    /// The coefficients of `x' = sin(k t + c)` are those of the sine.
    #[test]
    fn sines_of_linear_functions_of_time() {
        let counts = |texts| {
            let tape = tape(texts);
            let linear = tape.steps.iter().filter(|step| matches!(step.node, Node::SinOfTime(_))).count();
            (linear, tape.steps.iter().filter(|step| matches!(step.node, Node::Sin(_))).count())
        };
        assert_eq!(counts(["sin(k*t + c)", "cos(c - t/k)*x"]), (2, 0));
        assert_eq!(counts(["sin(t*t) + sin(k/t)", "sin(x + t) + cos(x*t)"]), (0, 4));

        let tape = tape(["sin(k*t + c)", "cos(c - t/k)"]);
        let mut jets = Jets::<f64, 2, 19>::new(&tape, Isa::best());
        let (k, c, t) = (1.7, 0.4, 0.9);
        jets.expand(&tape, &[k, c], t, &[0.0; 2], &[true; MAX_SURFACES]);
        let mut factor = 1.0;
        for order in 1..=18 {
            let turns = (order - 1) as f64 * std::f64::consts::FRAC_PI_2;
            factor /= order as f64;
            let exact = [
                factor * k.powi(order - 1) * (k * t + c + turns).sin(),
                factor * (-1.0 / k).powi(order - 1) * (c - t / k + turns).cos(),
            ];
            for n in 0..2 {
                let found: f64 = jets.coefficients()[n][order as usize];
                assert!((found - exact[n]).abs() <= 1e-14 * factor * k.powi(order - 1), "{n} {order}");
            }
        }
    }

    /// A series that begins with the rates at its place has the bits of any other, and rates at another place are not used.
    #[test]
    fn rates_are_the_begin_of_a_series() {
        let tape = tape(["y", "-sin(x)*k + abs(y)*c + cos(t)"]);
        let (t, x) = (0.3, [0.8, -0.6]);
        let sides = |upper| from_fn(|_| upper);
        let series = |before: Option<(f64, [f64; 2], bool)>, upper| {
            let mut jets = Jets::<f64, 2, 19>::new(&tape, Isa::best());
            jets.hold(&tape, &[1.3, 0.2], &sides(upper));
            if let Some((t, x, upper)) = before {
                jets.rates(&tape, t, &x, &sides(upper));
                // A mark of series that begin there.
                for values in &mut jets.values {
                    values[0] += 1.0;
                }
            }
            jets.expand_here::<Plain>(&tape, t, &x, &sides(upper));
            jets.coefficients().map(|c| c.map(f64::to_bits))
        };
        for upper in [true, false] {
            let anew = series(None, upper);
            assert_ne!(series(Some((t, x, upper)), upper), anew, "begun by the rates");
            for other in
                [(0.4, x, upper), (t, [0.8, 0.6], upper), (t, [f64::NAN, -0.6], upper), (t, x, !upper)]
            {
                assert_eq!(series(Some(other), upper), anew, "{other:?}");
            }
        }
        let mut jets = Jets::<f64, 2, 19>::new(&tape, Isa::best());
        jets.hold(&tape, &[1.3, 0.2], &sides(true));
        jets.rates(&tape, t, &x, &sides(true));
        jets.expand_here::<Plain>(&tape, t, &x, &sides(true));
        assert_eq!(jets.coefficients().map(|c| c.map(f64::to_bits)), series(None, true));
        jets.rates(&tape, t, &x, &sides(true));
        jets.hold(&tape, &[2.3, 0.2], &sides(true));
        jets.expand_here::<Plain>(&tape, t, &x, &sides(true));
        assert_ne!(jets.coefficients().map(|c| c.map(f64::to_bits)), series(None, true), "other parameters");
    }
}
