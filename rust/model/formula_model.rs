//! A model of the user's own, given as text.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::sliding_mode::{self, SlidingSurface};
use super::surface_along::{self, Places};
use super::{
    EnclosedSurfaces, Family, Inputs, MAX_SURFACES, MOST_PROBES, Observation, Parameter, Piece, Probes,
    Sides, Signals, StepStart, System, choose, enclosed, parameter, sides_of, surface_in_turn,
};
use crate::formula::{Expression, Kinks, Leaf, Mistake, Names, Op, Place, Program, StageWeights, StepFrom};
use crate::scalar::{Enclosed, Mask, Real, Scalar};

/// A power of two, far from the states that linear functions are asked for.
const FAR: f64 = 1_048_576.0;
/// The most measured inputs.
pub const MAX_INPUTS: usize = 8;

/// The programs of the rates and of the surfaces on which they have kinks.
#[derive(Debug, PartialEq)]
struct Law {
    number: Number,
    rates: Program,
    /// The rates with comparisons in place of surfaces.
    written: Program,
    surfaces: Vec<Program>,
    /// The components of the state that the surfaces depend on.
    watched: Vec<bool>,
    kinks: Kinks,
}

impl Law {
    fn of(equations: &[Expression], written: Program, kinks: Kinks) -> Self {
        let surfaces = kinks.surfaces.iter().map(|own| Program::of([own])).collect();
        // Between sliding and not, the rates decide.
        let slides = !kinks.sliding.is_empty();
        let takes = |n: usize| kinks.surfaces.iter().any(|own| own.ops().contains(&Op::Push(Leaf::State(n))));
        let watched = (0..equations.len()).map(|n| slides || takes(n)).collect();
        let number = Number(LAWS.fetch_add(1, Ordering::Relaxed));
        Self { number, rates: Program::of(equations), written, surfaces, watched, kinks }
    }
}

/// How many laws there were before.
#[derive(Debug)]
struct Number(u64);

static LAWS: AtomicU64 = AtomicU64::new(0);

impl PartialEq for Number {
    /// Laws are equal if their equations are.
    fn eq(&self, _other: &Self) -> bool {
        true
    }
}

/// The source of the values of a model's inputs.
#[derive(Clone, Debug)]
enum InputValues<S> {
    None,
    /// From what was measured.
    Measured(Inputs<S>),
    /// They do not change in time.
    Constant(Vec<S>),
}

/// The equations `x' = f(t, x, u(t))` with their numbers. Their kinks are switching surfaces; after these come those
/// between [sliding](sliding_mode) and not, and the clock of the inputs.
#[derive(Clone, Debug)]
pub struct Own<S, const D: usize> {
    law: Arc<Law>,
    /// The part of the rates, and of each surface, that the parameters determine.
    fixed: Vec<S>,
    fixed_surfaces: Vec<Vec<S>>,
    /// The same for places side by side, if these have the values in turn.
    fixed_places: Vec<Vec<Places>>,
    sliding: Vec<SlidingSurface<S>>,
    inputs: InputValues<S>,
}

impl<S: Scalar, const D: usize> Own<S, D> {
    /// The results of a program at a place, of which the parameters determine what is `fixed`.
    #[inline(always)]
    fn evaluate(
        &self,
        (program, fixed): (&Program, &[S]),
        (t, x): (S, &[S; D]),
        sides: &Sides<S>,
        results: &mut [S],
    ) {
        match self.inputs {
            InputValues::None => program.run(&Place { t, x, rates: &[], inputs: &[] }, fixed, sides, results),
            _ => self.evaluate_driven((program, fixed), (t, x), sides, results),
        }
    }

    /// The same at the values of the inputs.
    // One function for each kind of number: the room for the inputs is long compared with a short law.
    #[inline(never)]
    fn evaluate_driven(
        &self,
        (program, fixed): (&Program, &[S]),
        (t, x): (S, &[S; D]),
        sides: &Sides<S>,
        results: &mut [S],
    ) {
        let mut room;
        let inputs = match &self.inputs {
            InputValues::None => &[],
            InputValues::Constant(values) => &values[..],
            InputValues::Measured(inputs) => {
                room = [S::zero(); MAX_INPUTS];
                for (k, value) in room[..inputs.len()].iter_mut().enumerate() {
                    *value = inputs.piece(k, t.real(), sides[self.knots()]).at(t);
                }
                &room
            }
        };
        program.run(&Place { t, x, rates: &[], inputs }, fixed, sides, results);
    }

    /// The rates on given sides, on none of which the law slides.
    fn plain_rates(&self, t: S, x: &[S; D], sides: &Sides<S>) -> [S; D] {
        let mut rates = [S::zero(); D];
        self.evaluate((&self.law.rates, &self.fixed), (t, x), sides, &mut rates);
        rates
    }

    /// The same law over intervals.
    fn enclosed(&self, lane: usize) -> Own<Enclosed, D> {
        let of = |&number: &S| enclosed(number, lane);
        let all = |numbers: &[S]| numbers.iter().map(of).collect();
        let sliding = |own: &SlidingSurface<S>| SlidingSurface {
            surface: own.surface,
            mode: own.mode,
            offset: of(&own.offset),
            gradient: all(&own.gradient),
        };
        Own {
            law: self.law.clone(),
            fixed: all(&self.fixed),
            fixed_surfaces: self.fixed_surfaces.iter().map(|own| all(own)).collect(),
            fixed_places: Vec::new(),
            sliding: self.sliding.iter().map(sliding).collect(),
            inputs: match &self.inputs {
                InputValues::None => InputValues::None,
                InputValues::Measured(inputs) => InputValues::Measured(inputs.map(of)),
                InputValues::Constant(values) => InputValues::Constant(all(values)),
            },
        }
    }

    /// The number of the clock's surface, where there is one.
    fn knots(&self) -> usize {
        self.law.surfaces.len() + self.sliding.len()
    }

    /// The rates on given sides, on none of which the law slides.
    fn rates_on(&self, t: S, x: &[S; D]) -> impl Fn(&Sides<S>, &mut [S]) {
        move |sides, rates| self.evaluate((&self.law.rates, &self.fixed), (t, x), sides, rates)
    }

    /// The number, among those that it slides on, of the surface `j` or of that which surface `j` is the mode of.
    fn sliding_on(&self, j: usize) -> Option<usize> {
        self.sliding.iter().position(|own| own.surface == j || own.mode == j)
    }
}

impl<S: Scalar, const D: usize> System<S, D> for Own<S, D> {
    #[inline]
    fn rates(&self, t: S, x: &[S; D], sides: &Sides<S>) -> [S; D] {
        if self.sliding.is_empty() {
            self.plain_rates(t, x, sides)
        } else {
            let mut rates = [S::zero(); D];
            sliding_mode::rates(&self.sliding, sides, &self.rates_on(t, x), &mut rates);
            rates
        }
    }

    fn staged(
        &self,
        weights: &StageWeights,
        (t, x, h): (S::Real, &[S; D], S::Real),
        sides: &Sides<S>,
        stages: &mut [[S; D]],
    ) -> Option<[S; D]> {
        let slides = |own: &SlidingSurface<S>| sides[own.mode].any();
        if !matches!(self.inputs, InputValues::None) || self.sliding.iter().any(slides) {
            return None;
        }
        let from = StepFrom { t: S::lift(t), x, h: S::lift(h) };
        let (mut new, stages) = ([S::zero(); D], stages.as_flattened_mut());
        self.law.rates.run_step(weights, from, &self.fixed, sides, stages, &mut new).then_some(new)
    }

    #[inline]
    fn surfaces(&self) -> usize {
        self.knots()
    }

    fn surface(&self, j: usize, t: S, x: &[S; D], sides: &Sides<S>) -> S {
        if let (InputValues::Measured(inputs), true) = (&self.inputs, j == self.knots()) {
            return inputs.surface(t, sides[j]);
        }
        if let Some(i) = self.sliding_on(j) {
            let own = &self.sliding[i];
            if own.mode == j {
                return sliding_mode::margin(&self.sliding, i, sides, &self.rates_on(t, x));
            } else if own.slides(sides).any() {
                return -S::one();
            }
        }
        let mut value = [S::zero()];
        self.evaluate((&self.law.surfaces[j], &self.fixed_surfaces[j]), (t, x), sides, &mut value);
        value[0]
    }

    fn is_steady(&self, j: usize, sides: &Sides<S>) -> bool {
        match self.law.kinks.steady.get(j) {
            Some(&steady) => steady,
            None => !self.sliding_on(j).is_some_and(|i| self.sliding[i].slides(sides).any()),
        }
    }

    fn watched(&self) -> [bool; D] {
        std::array::from_fn(|n| self.law.watched[n])
    }

    fn enclosing(&self, lane: usize) -> Option<Box<dyn EnclosedSurfaces<D> + '_>> {
        Some(Box::new(self.enclosed(lane)))
    }

    fn surface_name(&self, j: usize, side: bool) -> &'static str {
        match (self.law.kinks.jumps.get(j), side) {
            (Some(true), _) => "jump",
            (Some(false), _) => "kink",
            (None, true) => "stick",
            (None, false) => "slip",
        }
    }

    fn settle(&self, t: S, x: &[S; D], sides: &mut Sides<S>) {
        sliding_mode::settle(&self.sliding, x, sides, &self.rates_on(t, x));
    }

    fn switch(&self, j: usize, t: S, x: &mut [S; D], sides: &mut Sides<S>, here: S::Mask) {
        if let Some(i) = self.sliding_on(j) {
            let start = *x;
            sliding_mode::switch(&self.sliding, i, x, sides, here, &self.rates_on(t, &start));
        } else {
            sides[j] = choose(here, sides[j].not(), sides[j]);
        }
    }

    fn jumps(&self, j: usize) -> bool {
        match (self.law.kinks.jumps.get(j), &self.inputs) {
            (Some(&jumps), _) => jumps,
            // A contact that starts to slip begins with its rates at rest: that switch is continuous.
            (None, InputValues::Measured(inputs)) => j == self.knots() && inputs.jumps(),
            (None, _) => false,
        }
    }

    #[inline]
    fn clock(&self) -> Option<usize> {
        matches!(self.inputs, InputValues::Measured(_)).then_some(self.knots())
    }

    fn next_knot(&self, t: S::Real, sides: &Sides<S>, end: S::Real) -> Option<f64> {
        let InputValues::Measured(inputs) = &self.inputs else { return None };
        inputs.next_knot(t.lane(0), sides[self.knots()].lane(0), end.lane(0))
    }

    fn clock_side(&self, t: S::Real, forwards: bool) -> bool {
        let InputValues::Measured(inputs) = &self.inputs else { return true };
        inputs.side(t.lane(0), forwards)
    }

    fn surface_along(
        &self,
        j: usize,
        at: &StepStart<S, D>,
        probes: &Probes<'_, S::Real, D>,
    ) -> [S::Real; MOST_PROBES] {
        let slides = |own: &SlidingSurface<S>| own.slides(&at.sides).any();
        if let Some(program) = self.law.surfaces.get(j)
            && !self.sliding.iter().any(slides)
        {
            if let Some(n) = program.component() {
                return probes.each(at.t, |_, x| x[n]);
            }
            if let Some(fixed) = self.fixed_places.get(j).filter(|fixed| !fixed.is_empty()) {
                return surface_along::values((program, fixed), at, probes, &self.law.watched);
            }
        }
        surface_in_turn(self, j, at, probes)
    }

    fn input(&self, k: usize, t: S::Real, sides: &Sides<S>) -> Piece<S> {
        let InputValues::Measured(inputs) = &self.inputs else { unreachable!("only asked of these") };
        inputs.piece(k, t, sides[self.knots()])
    }
}

/// Builds [`Own`].
///
/// ```
/// use udd::model::{Family, FormulaFamily, MAX_SURFACES, System};
/// let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
/// let family = FormulaFamily::<2>::parse(&names(&["x", "v"]), &["v", "-k*x"], &names(&["k"]), &[]).unwrap();
/// let system = family.build(&[4.0]);
/// assert_eq!(system.rates(0.0, &[3.0, 1.0], &[true; MAX_SURFACES]), [1.0, -12.0]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct FormulaFamily<const D: usize> {
    equations: Arc<[Expression; D]>,
    law: Arc<Law>,
    parameters: Vec<String>,
    states: Vec<(String, bool)>,
    inputs: usize,
    /// The inputs of each record, and the number of that which counts where none is named.
    records: Arc<[Signals]>,
    record: usize,
    observation: Observation,
}

impl<const D: usize> FormulaFamily<D> {
    /// Parses the right-hand sides, in the order of the states; with fewer than `D` the rest is padding.
    ///
    /// # Errors
    /// The number of the equation and what is wrong with it, in words that continue "the formula ...".
    ///
    /// # Panics
    /// Where there are more than `D` states, or another number of equations.
    pub fn parse(
        states: &[String],
        equations: &[&str],
        parameters: &[String],
        inputs: &[String],
    ) -> Result<Self, (usize, Mistake)> {
        let live = states.len();
        assert!(live <= D && equations.len() == live, "an equation for each of at most {D} states is needed");
        let (mut parsed, mut exact) = (Vec::with_capacity(D), Vec::new());
        for (n, text) in equations.iter().enumerate() {
            let wrong = |what: String| Err((n, Mistake(what)));
            if text.replace("<=", "").replace(">=", "").contains('=') {
                return wrong("has =, but only the right-hand side is wanted".to_owned());
            }
            let names = Names { states, parameters, inputs, rates: false };
            parsed.push(Expression::parse(text, names).map_err(|mistake| (n, mistake))?);
            exact.push(Expression::parse_exact(text, names).map_err(|mistake| (n, mistake))?);
        }
        let mut kinks = Kinks { clocked: !inputs.is_empty(), ..Kinks::default() };
        parsed.iter_mut().for_each(|one| kinks.of(one));
        kinks.find_sliding(&parsed);
        let equations = with_idle(parsed);
        let law = Arc::new(Law::of(&equations, Program::of(&exact), kinks));
        let states = states.iter().map(|name| (name.clone(), false)).collect();
        let equations = Arc::new(equations);
        let (parameters, inputs, records) = (parameters.to_vec(), inputs.len(), Arc::default());
        let observation = Observation::default();
        Ok(Self { equations, law, parameters, states, inputs, records, record: 0, observation })
    }

    /// With what sensors see of it.
    pub fn with_observation(mut self, observation: Observation) -> Self {
        self.observation = observation;
        self
    }

    /// Its observation by sensors.
    pub fn observation(&self) -> &Observation {
        &self.observation
    }

    /// Takes over what was measured of its inputs, record by record, and the number of that which counts by itself.
    ///
    /// # Panics
    /// Where a record has another number of inputs than the model, or the model has more than [`MAX_INPUTS`].
    pub fn set_records(&mut self, records: Vec<Signals>, record: usize) {
        assert!(self.inputs <= MAX_INPUTS && records.iter().all(|record| record.len() == self.inputs));
        (self.records, self.record) = (records.into(), record);
    }

    /// These of its states are angles.
    pub fn with_angles(mut self, names: &[String]) -> Self {
        self.states.iter_mut().for_each(|(own, angle)| *angle = names.contains(own));
        self
    }

    /// The same with padding states up to the number `E`.
    ///
    /// # Panics
    /// Where there are more than `E` states already.
    pub fn filled<const E: usize>(&self) -> FormulaFamily<E> {
        let equations = with_idle(self.equations[..self.states.len()].to_vec());
        FormulaFamily {
            law: Arc::new(Law::of(&equations, self.law.written.clone(), self.law.kinks.clone())),
            equations: Arc::new(equations),
            parameters: self.parameters.clone(),
            states: self.states.clone(),
            inputs: self.inputs,
            records: self.records.clone(),
            record: self.record,
            observation: self.observation.clone(),
        }
    }

    /// The names of the live states, and which of them are angles.
    pub fn states(&self) -> Vec<(String, bool)> {
        self.states.clone()
    }

    fn built<S: Scalar>(&self, values: &[S], inputs: InputValues<S>) -> Own<S, D> {
        let law = self.law.clone();
        Own {
            fixed: law.rates.fix(values),
            fixed_surfaces: law.surfaces.iter().map(|own| own.fix(values)).collect(),
            fixed_places: match inputs {
                InputValues::None => law.surfaces.iter().map(|own| surface_along::fix(own, values)).collect(),
                _ => Vec::new(),
            },
            sliding: sliding_surfaces(&law, D, values),
            law,
            inputs,
        }
    }

    /// The right-hand sides.
    pub fn equations(&self) -> &[Expression; D] {
        &self.equations
    }
}

/// The surfaces that the law of so many states may slide on, as many as there is room for. For any number of states, so
/// that it is compiled once for each kind of number.
fn sliding_surfaces<S: Scalar>(law: &Law, states: usize, values: &[S]) -> Vec<SlidingSurface<S>> {
    let kinks = &law.kinks;
    let mut surfaces = Vec::new();
    let room = MAX_SURFACES - kinks.surfaces.len() - usize::from(kinks.clocked);
    for &surface in kinks.sliding.iter().take(room.min(sliding_mode::MAX_SLIDING)) {
        let at = |x: &[S]| {
            law.surfaces[surface].value(&Place { t: S::zero(), x, rates: &[], inputs: &[] }, values)
        };
        let mut x = vec![S::zero(); states];
        let offset = at(&x);
        let mut gradient = x.clone();
        for n in 0..states {
            // Far off, where the constant does not take digits from the difference.
            x[n] = S::constant(FAR);
            gradient[n] = (at(&x) - offset).scale(1.0 / FAR);
            x[n] = S::zero();
        }
        let mode = kinks.surfaces.len() + surfaces.len();
        surfaces.push(SlidingSurface { surface, mode, offset, gradient });
    }
    surfaces
}

/// Equations of `D` states, of which those that are not given rest.
///
/// # Panics
/// Where there are more than `D`.
fn with_idle<const D: usize>(mut equations: Vec<Expression>) -> [Expression; D] {
    assert!(equations.len() <= D);
    equations.resize(D, Expression::number(0.0));
    <[Expression; D]>::try_from(equations).unwrap_or_else(|_| unreachable!("as many as states"))
}

impl<const D: usize> Family<D> for FormulaFamily<D> {
    type Built<S: Scalar> = Own<S, D>;

    fn goes_in_packets(&self) -> bool {
        self.law.surfaces.is_empty() && self.inputs == 0
    }

    fn law(&self) -> Option<u64> {
        Some(self.law.number.0)
    }

    fn idle(&self) -> usize {
        D - self.states.len()
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.parameters.iter().map(|name| parameter(name, "")).collect()
    }

    fn build<S: Scalar>(&self, values: &[S]) -> Own<S, D> {
        self.build_for(self.record, values)
    }

    fn rates_at(&self, values: &[f64], system: &Own<f64, D>, t: f64, x: &[f64; D]) -> [f64; D] {
        let (sides, law) = (sides_of(system, t, x), &self.law);
        let mut rates = system.rates(t, x, &sides);
        let on = |j: usize| law.kinks.jumps[j] && system.surface(j, t, x, &sides) == 0.0;
        // There the law is set-valued: what friction does not hold moves as it is let go.
        let attracts = || sliding_mode::attracts(&system.sliding, x, &sides, &system.rates_on(t, x));
        if (0..law.surfaces.len()).any(on) && !attracts() {
            system.evaluate(
                (&law.written, &law.written.fix(values)),
                (t, x),
                &sides,
                &mut rates[..law.written.len()],
            );
        }
        rates
    }

    fn build_for<S: Scalar>(&self, record: usize, values: &[S]) -> Own<S, D> {
        let inputs = match self.records.get(record) {
            _ if self.inputs == 0 => InputValues::None,
            Some(signals) => InputValues::Measured(signals.with(values)),
            None => InputValues::Constant(vec![S::zero(); self.inputs]),
        };
        self.built(values, inputs)
    }

    fn inputs(&self) -> usize {
        self.inputs
    }

    fn is_open(&self) -> bool {
        self.inputs > 0 && self.records.is_empty()
    }

    fn build_at<S: Scalar>(&self, values: &[S], inputs: Vec<S>) -> Own<S, D> {
        self.built(values, InputValues::Constant(inputs))
    }
}
