//! Crossings of surfaces within a step.

use super::section::Section;
use super::ship::Ship;
use crate::integrate::root::bracketed;
use crate::integrate::{ErrorNorm, Method};
use crate::model::{Family, MAX_SURFACES, Sides, System, choose};
use crate::scalar::{Mask, Real};
use crate::tape::{Binary, Expression, Leaf, Op, Place};
use crate::unroll::{unroll, vector};

/// Looked for to this part of the function's largest value near the crossing, and to this size.
const ZERO: f64 = 1e-14;
const SMALL: f64 = 1e-13;
/// A start this close to a surface is on it: on which side, the flow says.
const ON: f64 = 1e-12;
/// A change of sign where the function stays above this part of its values nearby is a jump or a pole.
const JUMP: f64 = 1e-6;
/// No method looks at more places within a step.
const MOST_PROBES: usize = 8;

/// A crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossed<const D: usize> {
    pub t: f64,
    pub x: [f64; D],
    /// Which surface.
    pub which: u8,
    /// The function's value there.
    pub residual: f64,
}

/// The polynomial of a step, in its own unit of time.
struct Step<R: Real, const D: usize> {
    /// Lowest first, an odd number of them.
    coefficients: Vec<[R; D]>,
    unit: R,
    from: R,
    size: R,
    /// The sides that the law is taken on.
    sides: Sides<R>,
}

impl<R: Real, const D: usize> Step<R, D> {
    fn load<K: Method<R, D>>(&mut self, method: &K, from: R, size: R) {
        self.coefficients.clear();
        self.unit = method.polynomial(&mut self.coefficients);
        if self.coefficients.len().is_multiple_of(2) {
            self.coefficients.push([R::zero(); D]);
        }
        (self.from, self.size) = (from, size / self.unit);
    }

    /// A component of the state at `s`.
    #[inline(always)]
    fn component(&self, n: usize, s: R) -> R {
        // Two sums side by side; the state itself is added last, which rounds once.
        let square = s * s;
        let (first, rest) = (self.coefficients[0][n], self.coefficients[1..].as_chunks::<2>().0);
        let (mut odd, mut even) = (R::zero(), R::zero());
        for pair in rest.iter().rev() {
            odd = odd * square + pair[0][n];
            even = even * square + pair[1][n];
        }
        first + (odd + even * s) * s
    }

    /// A component at several places.
    #[inline(always)]
    fn components(&self, n: usize, s: &[R; MOST_PROBES]) -> [R; MOST_PROBES] {
        let mut values = [R::zero(); MOST_PROBES];
        for coefficients in self.coefficients[1..].iter().rev() {
            unroll!(i in 0..MOST_PROBES => { values[i] = values[i] * s[i] + coefficients[n]; });
        }
        let first = self.coefficients[0][n];
        unroll!(i in 0..MOST_PROBES => { values[i] = values[i] * s[i] + first; });
        values
    }

    #[inline(always)]
    fn state(&self, s: R) -> [R; D] {
        vector!(R, D; n => self.component(n, s))
    }
}

/// How a surface's function is evaluated.
#[derive(Clone, Copy, Debug)]
enum Form {
    /// A component of the state less a constant: its own polynomial is all that is needed.
    Component(usize, f64),
    Any,
}

impl Form {
    fn of(function: &Expression) -> Self {
        match *function.ops() {
            [Op::Push(Leaf::State(n))] => Form::Component(n, 0.0),
            [Op::Push(Leaf::State(n)), Op::Push(Leaf::Number(value)), Op::Binary(Binary::Sub)] => {
                Form::Component(n, value)
            }
            _ => Form::Any,
        }
    }
}

/// What a function may ask for beside the time and the state.
struct Law<'a, M, R: Real> {
    system: &'a M,
    parameters: &'a [R],
}

/// The value of any function. A function of its own: there would be too many copies of all that a formula
/// can contain.
#[inline(never)]
fn general<M: System<R, D>, R: Real, const D: usize>(
    function: &Expression,
    stack: &mut [R],
    law: &Law<'_, M, R>,
    sides: &Sides<R>,
    (t, x): (&R, &[R; D]),
) -> R {
    let rates = match function.has_rates() {
        true => law.system.rates(*t, x, sides),
        false => [R::zero(); D],
    };
    function.value(&Place { t: *t, x, rates: &rates, parameters: law.parameters }, stack)
}

/// One surface, and on which side of it the lanes are.
struct Surface<'a, R: Real> {
    section: &'a Section,
    form: Form,
    stack: Vec<R>,
    /// Lanes that are known to be below, and above; neither while on it.
    below: R::Mask,
    above: R::Mask,
    /// The function's value at the end of the last step.
    value: R,
}

/// The function between two places, and whether the surface is crossed there.
#[derive(Clone, Copy)]
struct Stretch<R: Real> {
    s: R,
    value: R,
    crossing: R::Mask,
}

/// Looks for crossings in the steps of a ship.
pub struct Scan<'a, R: Real, const D: usize> {
    surfaces: Vec<Surface<'a, R>>,
    step: Step<R, D>,
    /// What was found in the last step, lane by lane.
    crossed: Vec<Vec<Crossed<D>>>,
    /// How many crossings each lane still leaves out.
    skip: Vec<usize>,
    /// Whether these need only be counted: a single surface that has no poles.
    counted: bool,
}

impl<'a, R: Real, const D: usize> Scan<'a, R, D> {
    pub fn new(sections: &'a [Section]) -> Self {
        let (zero, never) = (R::zero(), R::mask(false));
        let surface = |section: &'a Section| Surface {
            section,
            form: Form::of(&section.function),
            stack: section.function.stack(),
            below: never,
            above: never,
            value: zero,
        };
        Self {
            surfaces: sections.iter().map(surface).collect(),
            step: Step {
                coefficients: Vec::with_capacity(64),
                unit: zero,
                from: zero,
                size: zero,
                sides: [R::mask(true); MAX_SURFACES],
            },
            crossed: vec![Vec::with_capacity(MOST_PROBES * sections.len()); R::LANES],
            skip: vec![0; R::LANES],
            counted: matches!(sections, [only] if matches!(Form::of(&only.function), Form::Component(..))),
        }
    }

    /// Starts anew in these lanes, to leave out the first `skip` crossings.
    pub fn begin<F, E, K>(&mut self, ship: &Ship<'_, F, R, D, E, K>, lanes: R::Mask, skip: usize)
    where
        F: Family<D>,
        E: ErrorNorm<R, D> + Copy,
        K: Method<R, D>,
    {
        self.step.sides = *ship.driver.sides();
        for lane in (0..R::LANES).filter(|&lane| lanes.lane(lane)) {
            self.skip[lane] = skip;
        }
        let law = Law { system: ship.driver.system(), parameters: ship.values() };
        for surface in &mut self.surfaces {
            let value = surface.at(&law, &self.step, &ship.driver.t(), ship.driver.x());
            surface.value = R::select(lanes, value, surface.value);
            let on = R::constant(ON);
            surface.below = choose(lanes, value.less(-on), surface.below);
            surface.above = choose(lanes, on.less(value), surface.above);
        }
    }

    /// What the last step of this lane crossed, in the order of time.
    pub fn crossed(&self, lane: usize) -> &[Crossed<D>] {
        &self.crossed[lane]
    }

    /// Looks at the last step, in the lanes that moved. Returns whether there is any crossing.
    #[inline(always)]
    pub fn look<F, E, K>(&mut self, ship: &Ship<'_, F, R, D, E, K>, moved: R::Mask) -> bool
    where
        F: Family<D>,
        E: ErrorNorm<R, D> + Copy,
        K: Method<R, D>,
    {
        const { assert!(K::PROBES.len() <= MOST_PROBES) };
        let driver = &ship.driver;
        let law = Law { system: driver.system(), parameters: ship.values() };
        self.step.load(driver.method(), driver.from(), driver.size());
        let mut any = false;
        for (which, surface) in (0..).zip(&mut self.surfaces) {
            let mut stretches =
                [Stretch { s: R::zero(), value: R::zero(), crossing: R::mask(false) }; MOST_PROBES];
            let end = (driver.t(), driver.x());
            let stretches = &mut stretches[..K::PROBES.len()];
            if surface.signs(&law, &self.step, end, K::PROBES, moved, stretches) {
                if !any {
                    any = true;
                    self.crossed.iter_mut().for_each(Vec::clear);
                }
                if self.counted {
                    leave_out(stretches, &mut self.skip);
                }
                surface.find(&law, &self.step, stretches, which, &mut self.crossed);
            }
            surface.value = R::select(moved, stretches[K::PROBES.len() - 1].value, surface.value);
        }
        self.step.sides = *driver.sides();
        if any && !self.counted {
            for (list, skip) in self.crossed.iter_mut().zip(&mut self.skip) {
                list.sort_by(|a, b| a.t.total_cmp(&b.t));
                let left_out = list.len().min(*skip);
                list.drain(..left_out);
                *skip -= left_out;
            }
        }
        any
    }
}

/// Takes away the first crossings of lanes that still leave some out.
#[inline(always)]
fn leave_out<R: Real>(stretches: &mut [Stretch<R>], skip: &mut [usize]) {
    if skip.iter().all(|&skip| skip == 0) {
        return;
    }
    for stretch in stretches.iter_mut().filter(|stretch| stretch.crossing.any()) {
        let crossing = stretch.crossing;
        stretch.crossing = R::Mask::from_lanes(|lane| {
            let left_out = crossing.lane(lane) && skip[lane] > 0;
            skip[lane] -= usize::from(left_out);
            crossing.lane(lane) && !left_out
        });
    }
}

impl<R: Real> Surface<'_, R> {
    /// The function's value at any time and state.
    #[inline(always)]
    fn at<M, const D: usize>(&mut self, law: &Law<'_, M, R>, step: &Step<R, D>, t: &R, x: &[R; D]) -> R
    where
        M: System<R, D>,
    {
        match self.form {
            Form::Component(n, less) => x[n] - R::constant(less),
            Form::Any => general(&self.section.function, &mut self.stack, law, &step.sides, (t, x)),
        }
    }

    /// Its value within the step.
    #[inline(always)]
    fn inside<M: System<R, D>, const D: usize>(&mut self, law: &Law<'_, M, R>, step: &Step<R, D>, s: R) -> R {
        match self.form {
            Form::Component(n, less) => step.component(n, s) - R::constant(less),
            Form::Any => self.at(law, step, &(step.from + s * step.unit), &step.state(s)),
        }
    }

    /// Looks where the function changes its sign: after which of the method's places before.
    #[inline(always)]
    fn signs<M: System<R, D>, const D: usize>(
        &mut self,
        law: &Law<'_, M, R>,
        step: &Step<R, D>,
        (t, x): (R, &[R; D]),
        probes: &[f64],
        moved: R::Mask,
        stretches: &mut [Stretch<R>],
    ) -> bool {
        let mut values = [R::zero(); MOST_PROBES];
        let mut s = [R::zero(); MOST_PROBES];
        for (s, &theta) in s.iter_mut().zip(probes) {
            *s = step.size.scale(theta);
        }
        match self.form {
            Form::Component(n, less) => {
                values = step.components(n, &s);
                unroll!(i in 0..MOST_PROBES => { values[i] = values[i] - R::constant(less); });
            }
            Form::Any => {
                for (value, &s) in values.iter_mut().zip(&s[..probes.len() - 1]) {
                    *value = self.inside(law, step, s);
                }
            }
        }
        // At the end it is the state itself, from which the next step starts.
        values[probes.len() - 1] = self.at(law, step, &t, x);
        let (rising, falling) = (R::mask(self.section.rising), R::mask(self.section.falling));
        let (mut below, mut above) = (self.below, self.above);
        let mut found = R::mask(false);
        for (i, stretch) in stretches.iter_mut().enumerate() {
            let value = values[i];
            let (low, high) = (value.less(R::zero()), R::zero().less(value));
            let crossing = below.and(high).and(rising).or(above.and(low).and(falling)).and(moved);
            found = found.or(crossing);
            *stretch = Stretch { s: s[i], value, crossing };
            // A zero leaves the side as it was: a surface that is only touched is not crossed. What is
            // not a number has no side.
            let sane = value.finite();
            below = low.or(below.and(high.not())).and(sane);
            above = high.or(above.and(low.not())).and(sane);
        }
        self.below = choose(moved, below, self.below);
        self.above = choose(moved, above, self.above);
        found.any()
    }

    /// Finds the crossings in the stretches that have one.
    #[inline(always)]
    fn find<M: System<R, D>, const D: usize>(
        &mut self,
        law: &Law<'_, M, R>,
        step: &Step<R, D>,
        stretches: &mut [Stretch<R>],
        which: u8,
        crossed: &mut [Vec<Crossed<D>>],
    ) {
        loop {
            // The first crossing in each lane that has not been dealt with.
            let zero = R::zero();
            let mut before = (zero, self.value);
            let (mut low, mut high) = (before, before);
            let mut seen = R::mask(false);
            for stretch in stretches.iter_mut() {
                let here = (stretch.s, stretch.value);
                let new = stretch.crossing.and(seen.not());
                low = (R::select(new, before.0, low.0), R::select(new, before.1, low.1));
                high = (R::select(new, here.0, high.0), R::select(new, here.1, high.1));
                stretch.crossing = stretch.crossing.and(new.not());
                seen = seen.or(new);
                before = here;
            }
            if !seen.any() {
                return;
            }
            let scale = low.1.abs().max(high.1.abs());
            let tiny = scale.scale(ZERO).min(R::constant(SMALL));
            let s = bracketed(|s| self.inside(law, step, s), low, high, tiny, seen);
            let (t, x) = (step.from + s * step.unit, step.state(s));
            let residual = self.at(law, step, &t, &x);
            let real = seen.and(residual.abs().less(scale.scale(JUMP)));
            for lane in (0..R::LANES).filter(|&lane| real.lane(lane)) {
                crossed[lane].push(Crossed {
                    t: t.lane(lane),
                    x: x.map(|x| x.lane(lane)),
                    which,
                    residual: residual.lane(lane),
                });
            }
        }
    }
}
