//! A model of the user's own, given as text.

use std::sync::Arc;

use super::sliding_mode::{self, SlidingSurface};
use super::{
    EnclosedSurfaces, Family, Inputs, MAX_SURFACES, Observation, Parameter, Piece, Sides, Signals, System,
    choose, enclosed, parameter,
};
use crate::formula::{Expression, Kinks, Leaf, Mistake, Names, Place};
use crate::integrate::{Probes, StepStart, TARGETS, suspect_in_turn};
use crate::scalar::{Enclosed, Mask, Real, Scalar};
use crate::unroll::vector;

/// The most intermediate values of an equation; most need few.
const DEEP: usize = 64;
const SHALLOW: usize = 8;
/// A power of two, far from the states that linear functions are asked for.
const FAR: f64 = 1_048_576.0;
/// The most measured inputs.
pub const MAX_INPUTS: usize = 8;

/// Where the values of a model's inputs come from.
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
    equations: Arc<[Expression; D]>,
    kinks: Arc<Kinks>,
    sliding: Vec<SlidingSurface<S>>,
    deep: bool,
    parameters: Vec<S>,
    inputs: InputValues<S>,
}

impl<S: Scalar, const D: usize> Own<S, D> {
    /// Over packets, which have their tape, this is asked seldom: not worth compiling their formulas.
    #[inline(never)]
    fn lane_by_lane(&self, t: S, x: &[S; D]) -> [S; D] {
        let mut rates = [S::Real::zero(); D];
        for lane in 0..S::Real::LANES {
            let leaf = |leaf| match leaf {
                Leaf::Number(value) => value,
                Leaf::Time => t.real().lane(lane),
                Leaf::State(n) | Leaf::Rate(n) => x[n].real().lane(lane),
                Leaf::Parameter(i) => self.parameters[i].real().lane(lane),
                // Models with inputs do not go in packets.
                Leaf::Input(_) => f64::NAN,
            };
            for n in 0..D {
                rates[n].set_lane(lane, self.equations[n].value_of(leaf, &mut [0.0; DEEP]));
            }
        }
        vector!(S, D; n => S::lift(rates[n]))
    }

    #[inline(always)]
    fn evaluate(
        &self,
        formulas: &[Expression],
        t: S,
        x: &[S; D],
        sides: &Sides<S>,
        (values, stack): (&mut [S], &mut [S]),
    ) {
        // Written only where it is needed: it is long beside a short law.
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
        let place = Place { t, x, rates: &[], parameters: &self.parameters, inputs };
        for (formula, value) in formulas.iter().zip(values) {
            *value = formula.value_on(&place, sides, stack);
        }
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
            equations: self.equations.clone(),
            kinks: self.kinks.clone(),
            sliding: self.sliding.iter().map(sliding).collect(),
            deep: self.deep,
            parameters: all(&self.parameters),
            inputs: match &self.inputs {
                InputValues::None => InputValues::None,
                InputValues::Measured(inputs) => InputValues::Measured(inputs.map(of)),
                InputValues::Constant(values) => InputValues::Constant(all(values)),
            },
        }
    }

    /// The number of the clock's surface, where there is one.
    fn knots(&self) -> usize {
        self.kinks.surfaces.len() + self.sliding.len()
    }

    /// The rates on given sides, on none of which the law slides.
    fn law(&self, t: S, x: &[S; D]) -> impl Fn(&Sides<S>, &mut [S]) {
        move |sides, rates| {
            let own: [S; D] = self.values(&self.equations[..], t, x, sides);
            rates.copy_from_slice(&own);
        }
    }

    /// The number, among those that it slides on, of the surface `j` or of that which surface `j` is the mode of.
    fn sliding_on(&self, j: usize) -> Option<usize> {
        self.sliding.iter().position(|own| own.surface == j || own.mode == j)
    }

    /// The values of some of its formulas.
    // One function for each kind of number, too: the room for them is written at every place where it is inlined.
    #[inline(never)]
    fn values<const N: usize>(&self, formulas: &[Expression], t: S, x: &[S; D], sides: &Sides<S>) -> [S; N] {
        let mut values = [S::zero(); N];
        if self.deep {
            self.evaluate(formulas, t, x, sides, (&mut values, &mut [S::zero(); DEEP]));
        } else {
            self.evaluate(formulas, t, x, sides, (&mut values, &mut [S::zero(); SHALLOW]));
        }
        values
    }
}

impl<S: Scalar, const D: usize> System<S, D> for Own<S, D> {
    // Laws with kinks are not run in packets, which then need not be compiled to land.
    const SMOOTH: bool = S::Real::LANES > 1;

    #[inline]
    fn rates(&self, t: S, x: &[S; D], sides: &Sides<S>) -> [S; D] {
        if const { S::Real::LANES > 1 && size_of::<S>() == size_of::<S::Real>() } {
            self.lane_by_lane(t, x)
        } else if self.sliding.is_empty() {
            self.values(&self.equations[..], t, x, sides)
        } else {
            let mut rates = [S::zero(); D];
            sliding_mode::rates(&self.sliding, sides, &self.law(t, x), &mut rates);
            rates
        }
    }

    #[inline]
    fn surfaces(&self) -> usize {
        self.knots()
    }

    fn surface(&self, j: usize, t: S, x: &[S; D], sides: &Sides<S>) -> S {
        // As said above, not called.
        if const { S::Real::LANES > 1 } {
            return S::one();
        }
        if let (InputValues::Measured(inputs), true) = (&self.inputs, j == self.knots()) {
            return inputs.surface(t, sides[j]);
        }
        if let Some(i) = self.sliding_on(j) {
            let own = &self.sliding[i];
            if own.mode == j {
                return sliding_mode::margin(&self.sliding, i, sides, &self.law(t, x));
            } else if own.slides(sides).any() {
                return -S::one();
            }
        }
        let [value] = self.values(&self.kinks.surfaces[j..=j], t, x, sides);
        value
    }

    fn is_steady(&self, j: usize, sides: &Sides<S>) -> bool {
        match self.kinks.steady.get(j) {
            Some(&steady) => steady,
            None => !self.sliding_on(j).is_some_and(|i| self.sliding[i].slides(sides).any()),
        }
    }

    fn enclosing(&self, lane: usize) -> Option<Box<dyn EnclosedSurfaces<D> + '_>> {
        // Packets have no kinks.
        if const { S::Real::LANES > 1 } {
            return None;
        }
        Some(Box::new(self.enclosed(lane)))
    }

    fn surface_name(&self, j: usize, side: bool) -> &'static str {
        match (self.kinks.jumps.get(j), side) {
            (Some(true), _) => "jump",
            (Some(false), _) => "kink",
            (None, true) => "stick",
            (None, false) => "slip",
        }
    }

    fn settle(&self, t: S, x: &[S; D], sides: &mut Sides<S>) {
        if const { S::Real::LANES == 1 } {
            sliding_mode::settle(&self.sliding, x, sides, &self.law(t, x));
        }
    }

    fn switch(&self, j: usize, t: S, x: &mut [S; D], sides: &mut Sides<S>, here: S::Mask) {
        // Packets have no kinks.
        if const { S::Real::LANES > 1 } {
            return;
        }
        if let Some(i) = self.sliding_on(j) {
            let start = *x;
            sliding_mode::switch(&self.sliding, i, x, sides, here, &self.law(t, &start));
        } else {
            sides[j] = choose(here, sides[j].not(), sides[j]);
        }
    }

    fn jumps(&self, j: usize) -> bool {
        match (self.kinks.jumps.get(j), &self.inputs) {
            (Some(&jumps), _) => jumps,
            // What is let go starts with the rates that it had: that switch is continuous.
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

    fn suspect(
        &self,
        at: &StepStart<S, D>,
        wall: bool,
        probes: &Probes<'_, S::Real, D>,
        found: &mut [S::Mask; TARGETS],
    ) {
        suspect_in_turn(self, at, wall, probes, found);
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
    kinks: Arc<Kinks>,
    deep: bool,
    parameters: Vec<String>,
    states: Vec<(String, bool)>,
    inputs: usize,
    /// The inputs of each record, and the number of that which counts where none is named.
    records: Arc<[Signals]>,
    record: usize,
    observation: Observation,
}

impl<const D: usize> FormulaFamily<D> {
    /// Parses the right-hand sides, in the order of the states; with fewer than `D` the last states are idle.
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
        let mut parsed = Vec::with_capacity(D);
        for (n, text) in equations.iter().enumerate() {
            let wrong = |what: String| Err((n, Mistake(what)));
            if text.replace("<=", "").replace(">=", "").contains('=') {
                return wrong("has =, but only the right-hand side is wanted".to_owned());
            }
            let one = Expression::parse(text, Names { states, parameters, inputs, rates: false });
            let one = one.map_err(|mistake| (n, mistake))?;
            if one.depth() > DEEP {
                return wrong(format!("has brackets that leave more than {DEEP} numbers open at once"));
            }
            parsed.push(one);
        }
        let mut kinks = Kinks { clocked: !inputs.is_empty(), ..Kinks::default() };
        parsed.iter_mut().for_each(|one| kinks.of(one));
        kinks.find_sliding(&parsed);
        let deep = parsed.iter().chain(&kinks.surfaces).any(|one| one.depth() > SHALLOW);
        let equations = with_idle(parsed);
        let states = states.iter().map(|name| (name.clone(), false)).collect();
        let (equations, kinks) = (Arc::new(equations), Arc::new(kinks));
        let (parameters, inputs, records) = (parameters.to_vec(), inputs.len(), Arc::default());
        let observation = Observation::default();
        Ok(Self { equations, kinks, deep, parameters, states, inputs, records, record: 0, observation })
    }

    /// With what sensors see of it.
    pub fn with_observation(mut self, observation: Observation) -> Self {
        self.observation = observation;
        self
    }

    /// What sensors see of it.
    pub fn observation(&self) -> &Observation {
        &self.observation
    }

    /// With what was measured of its inputs, record by record, and the number of that which counts by itself.
    ///
    /// # Panics
    /// Where a record has another number of inputs than the model, or the model has more than [`MAX_INPUTS`].
    pub fn with_records(mut self, records: Vec<Signals>, record: usize) -> Self {
        assert!(self.inputs <= MAX_INPUTS && records.iter().all(|record| record.len() == self.inputs));
        (self.records, self.record) = (records.into(), record);
        self
    }

    /// These of its states are angles.
    pub fn with_angles(mut self, names: &[String]) -> Self {
        self.states.iter_mut().for_each(|(own, angle)| *angle = names.contains(own));
        self
    }

    /// The same with idle states up to the number `E`.
    ///
    /// # Panics
    /// Where there are more than `E` states already.
    pub fn filled<const E: usize>(&self) -> FormulaFamily<E> {
        FormulaFamily {
            equations: Arc::new(with_idle(self.equations[..self.states.len()].to_vec())),
            kinks: self.kinks.clone(),
            deep: self.deep,
            parameters: self.parameters.clone(),
            states: self.states.clone(),
            inputs: self.inputs,
            records: self.records.clone(),
            record: self.record,
            observation: self.observation.clone(),
        }
    }

    /// The names of the states that are not idle, and which of them are angles.
    pub fn states(&self) -> Vec<(String, bool)> {
        self.states.clone()
    }

    fn built<S: Scalar>(&self, values: &[S], inputs: InputValues<S>) -> Own<S, D> {
        let (equations, kinks) = (self.equations.clone(), self.kinks.clone());
        let sliding = sliding_surfaces(&kinks, D, values);
        Own { equations, kinks, sliding, deep: self.deep, parameters: values.to_vec(), inputs }
    }

    /// The right-hand sides.
    pub fn equations(&self) -> &[Expression; D] {
        &self.equations
    }
}

/// The surfaces that the law of so many states may slide on, as many as there is room for. For any number of states, so
/// that it is compiled once for each kind of number.
fn sliding_surfaces<S: Scalar>(kinks: &Kinks, states: usize, values: &[S]) -> Vec<SlidingSurface<S>> {
    let mut surfaces = Vec::new();
    // Packets have no kinks.
    if const { S::Real::LANES > 1 } {
        return surfaces;
    }
    let room = MAX_SURFACES - kinks.surfaces.len() - usize::from(kinks.clocked);
    for &surface in kinks.sliding.iter().take(room.min(sliding_mode::MAX_SLIDING)) {
        let at = |x: &[S]| {
            let place = Place { t: S::zero(), x, rates: &[], parameters: values, inputs: &[] };
            kinks.surfaces[surface].value(&place, &mut [S::zero(); DEEP])
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

    // The usual numbers of states: every one takes its time to compile.
    const STARTS_IN_PACKETS: bool = matches!(D, 2..=4);

    fn goes_in_packets(&self) -> bool {
        self.kinks.surfaces.is_empty() && self.inputs == 0
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
