//! Crossings of surfaces within a step.

use crate::analysis::batch::lanes::LaneBatch;
use crate::analysis::poincare::dense_output::{DenseOutput, Room, Scanned};
use crate::analysis::poincare::hidden::SectionCurve;
use crate::analysis::poincare::section::Section;
use crate::analysis::poincare::sign_changes::{Side, Stretch, in_doubt, judge, leave_out};
use crate::formula::{Binary, Expression, Leaf, Op, Place, Program};
use crate::integrate::root::bracketed;
use crate::integrate::zeros::{Bracket, Curve, Polynomials, Search, resolved, sign_changes};
use crate::integrate::{ErrorNorm, MOST_PROBES, Method};
use crate::model::{Family, MAX_SURFACES, Sides, System, choose};
use crate::scalar::{Isa, Mask, Real, vector};

/// Looked for to this part of the function's largest value near the crossing, and to this size.
const ZERO: f64 = 1e-14;
const SMALL: f64 = 1e-13;
/// A start this close to a surface is on it: on which side, the flow says.
const ON: f64 = 1e-12;
/// If all components of a start are smaller than this, that distance shrinks in proportion.
const TINY: f64 = 1e-6;
/// A change of sign where the function stays above this part of its values nearby is a jump or a pole.
const JUMP: f64 = 1e-6;

/// A crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing<const D: usize> {
    pub t: f64,
    pub x: [f64; D],
    /// Which surface.
    pub which: u8,
    /// The function's value there.
    pub residual: f64,
}

/// How a surface's function is evaluated.
#[derive(Clone, Copy, Debug)]
enum Form {
    /// A component of the state less a constant: its own polynomial is all that is needed.
    Component(usize, f64),
    /// As slow as the state, or not.
    Any { steady: bool },
}

impl Form {
    fn of(function: &Expression) -> Self {
        match *function.ops() {
            [Op::Push(Leaf::State(n))] => Form::Component(n, 0.0),
            [Op::Push(Leaf::State(n)), Op::Push(Leaf::Number(value)), Op::Binary(Binary::Sub)] => {
                Form::Component(n, value)
            }
            _ => Form::Any { steady: function.is_steady() || function.is_slow() },
        }
    }

    fn is_steady(self) -> bool {
        !matches!(self, Form::Any { steady: false })
    }
}

/// The inputs of a function apart from the time and the state.
pub(super) struct Law<'a, M, R: Real> {
    system: &'a M,
    pub parameters: &'a [R],
    /// The sides that the law is taken on.
    sides: &'a Sides<R>,
}

/// The value of any function. A function of its own: there would be too many copies of all that a formula
/// can contain.
#[inline(never)]
pub(super) fn general<M: System<R, D>, R: Real, const D: usize>(
    program: &Program,
    law: &Law<'_, M, R>,
    (t, x): (&R, &[R; D]),
) -> R {
    let rates = match program.has_rates() {
        true => law.system.rates(*t, x, law.sides),
        false => [R::zero(); D],
    };
    program.value(&Place { t: *t, x, rates: &rates, inputs: &[] }, law.parameters)
}

/// A step that was taken.
struct Step<'a, R: Real, const D: usize> {
    polynomials: DenseOutput<'a, R, D>,
    from: R,
    /// In the polynomials' unit.
    size: R,
    end: (R, &'a [R; D]),
    probes: &'static [f64],
}

/// One surface, and on which side of it the lanes are.
struct Surface<'a, R: Real> {
    section: &'a Section,
    form: Form,
    program: Program,
    side: Side<R>,
    /// The function's value at the end of the last step.
    value: R,
}

/// Looks for crossings in the steps of a batch of lanes.
pub struct Scan<'a, R: Real, const D: usize> {
    isa: Isa,
    surfaces: Vec<Surface<'a, R>>,
    /// The sides that the law was taken on in the last step; the driver's are those of the next.
    sides: Sides<R>,
    room: Room<R, D>,
    /// Room for what a lane in doubt crosses, and for what all of them cross that the places do not show.
    brackets: Vec<Bracket>,
    hidden: Vec<(usize, Bracket, bool)>,
    /// Crossings of the last step with their lanes, in the order of time in each lane.
    crossed: Vec<(usize, Crossing<D>)>,
    /// How many crossings each lane still leaves out.
    skip: R,
    /// Whether these need only be counted: a single surface that has no poles.
    counted: bool,
    /// How many each lane wants, and whether it is too late for more.
    count: usize,
    stopped: &'a (dyn Fn() -> bool + 'a),
}

impl<'a, R: Real, const D: usize> Scan<'a, R, D> {
    pub fn new(
        sections: &'a [Section],
        isa: Isa,
        count: usize,
        stopped: &'a (dyn Fn() -> bool + 'a),
    ) -> Self {
        let never = R::mask(false);
        let surface = |section: &'a Section| Surface {
            section,
            form: Form::of(&section.function),
            program: Program::of([&section.function]),
            side: Side {
                below: never,
                above: never,
                rising: section.rising,
                falling: section.falling,
                moved: never,
            },
            value: R::zero(),
        };
        Self {
            isa,
            surfaces: sections.iter().map(surface).collect(),
            sides: [R::mask(true); MAX_SURFACES],
            room: Room::new(),
            brackets: Vec::with_capacity(32),
            hidden: Vec::with_capacity(32),
            crossed: Vec::with_capacity(R::LANES * MOST_PROBES * sections.len()),
            skip: R::zero(),
            counted: matches!(sections, [only] if matches!(Form::of(&only.function), Form::Component(..))),
            count,
            stopped,
        }
    }

    /// Restarts these lanes, which leave out the first `skip` crossings.
    pub fn begin<F, E, K>(&mut self, batch: &LaneBatch<'_, F, R, D, E, K>, lanes: R::Mask, skip: usize)
    where
        F: Family<D>,
        E: ErrorNorm<R, D> + Copy,
        K: Method<R, D>,
    {
        self.sides = *batch.driver.sides();
        self.skip = R::select(lanes, R::constant(skip as f64), self.skip);
        let x = batch.driver.x();
        let size = x.iter().fold(R::zero(), |most, own| most.max(own.abs()));
        let on = size.scale(ON / TINY).min(R::constant(ON));
        let law = Law { system: batch.driver.system(), parameters: batch.values(), sides: &self.sides };
        for surface in &mut self.surfaces {
            let value = surface.at(&law, &batch.driver.t(), batch.driver.x());
            surface.value = R::select(lanes, value, surface.value);
            let (on, side) = (on, &mut surface.side);
            side.below = choose(lanes, value.less(-on), side.below);
            side.above = choose(lanes, on.less(value), side.above);
        }
    }

    /// The crossings of the last step with their lanes, in the order of time in each lane.
    pub fn crossed(&self) -> &[(usize, Crossing<D>)] {
        &self.crossed
    }

    /// Looks at the last step, in the lanes that moved. Returns whether there is any crossing.
    #[inline(always)]
    pub fn look<F, E, K>(&mut self, batch: &LaneBatch<'_, F, R, D, E, K>, moved: R::Mask) -> bool
    where
        F: Family<D>,
        E: ErrorNorm<R, D> + Copy,
        K: Method<R, D>,
    {
        const { assert!(K::PROBES.len() <= MOST_PROBES) };
        let driver = &batch.driver;
        let law = Law { system: driver.system(), parameters: batch.values(), sides: &self.sides };
        let polynomials = DenseOutput::of(driver.method(), self.isa, &mut self.room);
        let size = if K::SERIES { driver.size() } else { driver.size() / polynomials.unit };
        let end = (driver.t(), driver.x());
        let step = Step { polynomials, from: driver.from(), size, end, probes: K::PROBES };
        self.crossed.clear();
        for (which, surface) in (0..).zip(&mut self.surfaces) {
            let mut stretches =
                [Stretch { s: R::zero(), value: R::zero(), crossing: R::mask(false) }; MOST_PROBES];
            let stretches = &mut stretches[..K::PROBES.len()];
            let mut before = surface.side;
            before.moved = moved;
            let doubt = surface.signs(&law, &step, moved, stretches).and(moved);
            if doubt.any() {
                let limits = (self.count, self.skip, self.stopped);
                let room = (&mut self.brackets, &mut self.hidden);
                surface.look_closer(&law, &step, (before, doubt), stretches, limits, room);
                for &(lane, bracket, smooth) in &self.hidden {
                    let left = self.skip.lane(lane);
                    if self.counted && left > 0.0 {
                        self.skip.set_lane(lane, left - 1.0);
                    } else if let Some(crossing) =
                        surface.between(&law, &step, lane, (bracket, smooth), which)
                    {
                        self.crossed.push((lane, crossing));
                    }
                }
            }
            let last = stretches[stretches.len() - 1].value;
            if self.counted && crosses(stretches) {
                leave_out(stretches, &mut self.skip);
            }
            if crosses(stretches) {
                if const { R::LANES > 1 } {
                    surface.find(&law, &step, stretches, which, &mut self.crossed);
                } else {
                    surface.find_apart(&law, &step, stretches, which, &mut self.crossed);
                }
            }
            surface.value = R::select(moved, last, surface.value);
        }
        self.sides = *driver.sides();
        if !self.counted && !self.crossed.is_empty() {
            in_order(&mut self.crossed, &mut self.skip);
        }
        !self.crossed.is_empty()
    }
}

/// Whether there is any crossing.
#[inline(always)]
fn crosses<R: Real>(stretches: &[Stretch<R>]) -> bool {
    let mut any = R::mask(false);
    for stretch in stretches {
        any = any.or(stretch.crossing);
    }
    any.any()
}

/// Puts crossings in the order of time and takes away those that their lane still leaves out.
fn in_order<R: Real, const D: usize>(list: &mut Vec<(usize, Crossing<D>)>, skip: &mut R) {
    // Allocates nothing, unlike a stable sort.
    list.sort_unstable_by(|(_, a), (_, b)| a.t.total_cmp(&b.t).then(a.which.cmp(&b.which)));
    list.retain(|&(lane, _)| {
        let left = skip.lane(lane);
        skip.set_lane(lane, (left - 1.0).max(0.0));
        left < 1.0
    });
}

impl<R: Real> Surface<'_, R> {
    /// The function's value at any time and state.
    #[inline(always)]
    fn at<M: System<R, D>, const D: usize>(&mut self, law: &Law<'_, M, R>, t: &R, x: &[R; D]) -> R {
        match self.form {
            Form::Component(n, less) => x[n] - R::constant(less),
            Form::Any { .. } => general(&self.program, law, (t, x)),
        }
    }

    /// Its value within the step.
    #[inline(always)]
    fn inside<M: System<R, D>, const D: usize>(
        &mut self,
        law: &Law<'_, M, R>,
        step: &Step<'_, R, D>,
        s: R,
    ) -> R {
        self.at(law, &(step.from + s * step.polynomials.unit), &step.polynomials.state(s))
    }

    /// Looks where the function changes its sign: after which of the method's places before. Returns the lanes where it may
    /// do so elsewhere too.
    #[inline(always)]
    fn signs<M: System<R, D>, const D: usize>(
        &mut self,
        law: &Law<'_, M, R>,
        step: &Step<'_, R, D>,
        moved: R::Mask,
        stretches: &mut [Stretch<R>],
    ) -> R::Mask {
        // At the end it is the state itself, from which the next step starts.
        let end = self.at(law, &step.end.0, step.end.1);
        let side = Side { moved, ..self.side };
        let (after, doubt) = match self.form {
            Form::Component(n, less) => {
                let scan = Scanned { less, probes: step.probes, size: step.size, end, side };
                step.polynomials.signs(n, scan, stretches)
            }
            Form::Any { steady } => {
                let (mut s, mut values) = ([R::zero(); MOST_PROBES], [end; MOST_PROBES]);
                for (i, &theta) in step.probes.iter().enumerate() {
                    s[i] = step.size.scale(theta);
                    if i + 1 < step.probes.len() {
                        values[i] = self.inside(law, step, s[i]);
                    }
                }
                let values = &values[..step.probes.len()];
                let doubt = if steady { in_doubt(self.value, values) } else { R::mask(true) };
                (judge(&s, values, side, stretches), doubt)
            }
        };
        self.side.below = choose(moved, after.below, self.side.below);
        self.side.above = choose(moved, after.above, self.side.above);
        doubt
    }

    /// Looks in lanes in doubt for all changes of sign. Where there are others than the stretches show, these are left to
    /// `all`, in the order of time in each lane: with whether the function surely has no jump or pole there.
    #[inline(never)]
    fn look_closer<M: System<R, D>, const D: usize>(
        &mut self,
        law: &Law<'_, M, R>,
        step: &Step<'_, R, D>,
        (before, doubt): (Side<R>, R::Mask),
        stretches: &mut [Stretch<R>],
        (count, skip, stopped): (usize, R, &dyn Fn() -> bool),
        (found, all): (&mut Vec<Bracket>, &mut Vec<(usize, Bracket, bool)>),
    ) {
        all.clear();
        let last = stretches.len() - 1;
        for lane in doubt.lanes() {
            let mut values = [self.value.lane(lane); MOST_PROBES + 1];
            for (value, stretch) in values[1..].iter_mut().zip(stretches.iter()) {
                *value = stretch.value.lane(lane);
            }
            let values = &values[..=last + 1];
            if self.form.is_steady() && resolved(values) {
                continue;
            }
            let size = step.size.lane(lane);
            let terms =
                |n: usize, k: usize| step.polynomials.component(n).get(k).map_or(0.0, |c| c.lane(lane));
            let terms = Polynomials::new(step.polynomials.component(0).len(), size, terms);
            let span = (step.from.lane(lane), size * step.polynomials.unit.lane(lane));
            let mut curve =
                SectionCurve::new((&self.section.function, &self.program), law, lane, span, terms);
            let (below, above) = (before.below.lane(lane), before.above.lane(lane));
            let known = (below || above).then_some((0.0, values[0], below));
            let wanted = count.saturating_add(skip.lane(lane) as usize);
            let patient = |pieces: usize| !pieces.is_multiple_of(4096) || !stopped();
            found.clear();
            sign_changes(&mut curve, known, (values[0], values[last + 1]), &patient, &mut |bracket| {
                let falls = bracket.high.1 < 0.0;
                if falls && before.falling || !falls && before.rising {
                    found.push(bracket);
                }
                if found.len() < wanted { Search::Next } else { Search::Enough }
            });
            // Where the places showed as many, these are the same.
            let shown = || (0..=last).filter(|&i| stretches[i].crossing.lane(lane));
            let same = |(i, own): (usize, &Bracket)| {
                let from = if i == 0 { 0.0 } else { stretches[i - 1].s.lane(lane) / size };
                own.low.0 <= stretches[i].s.lane(lane) / size && from <= own.high.0
            };
            if shown().count() == found.len() && shown().zip(&*found).all(same) {
                continue;
            }
            let others = R::Mask::from_lanes(|i| i != lane);
            stretches.iter_mut().for_each(|own| own.crossing = own.crossing.and(others));
            let scaled = |(s, value): (f64, f64)| (s * size, value);
            for own in &*found {
                let slope = curve.enclose(own.low.0, own.high.0).d[0];
                // A section of rates jumps where the law does: that is no crossing.
                let steady = own.low.0 > 0.0 || (curve.value(0.0) < 0.0) == (own.low.1 < 0.0);
                let smooth = slope.width().is_finite() && steady;
                all.push((lane, Bracket { low: scaled(own.low), high: scaled(own.high) }, smooth));
            }
        }
    }

    /// The crossing of a lane in a bracket, where it is one.
    fn between<M: System<R, D>, const D: usize>(
        &mut self,
        law: &Law<'_, M, R>,
        step: &Step<'_, R, D>,
        lane: usize,
        (Bracket { low, high }, smooth): (Bracket, bool),
        which: u8,
    ) -> Option<Crossing<D>> {
        let scale = low.1.abs().max(high.1.abs());
        let tiny = (scale * ZERO).min(SMALL);
        let s = bracketed(|s: f64| self.inside(law, step, R::constant(s)).lane(lane), low, high, tiny, true);
        let s = R::constant(s);
        let (t, x) = (step.from + s * step.polynomials.unit, step.polynomials.state(s));
        let residual = self.at(law, &t, &x).lane(lane);
        let x = vector!(f64, D; n => x[n].lane(lane));
        (smooth || residual.abs() < scale * JUMP).then_some(Crossing { t: t.lane(lane), x, which, residual })
    }

    /// As [`find`](Surface::find), whatever the method of a single run.
    #[inline(never)]
    fn find_apart<M: System<R, D>, const D: usize>(
        &mut self,
        law: &Law<'_, M, R>,
        step: &Step<'_, R, D>,
        stretches: &mut [Stretch<R>],
        which: u8,
        crossed: &mut Vec<(usize, Crossing<D>)>,
    ) {
        self.find(law, step, stretches, which, crossed);
    }

    /// Finds the crossings in the stretches that have one.
    #[inline(always)]
    fn find<M: System<R, D>, const D: usize>(
        &mut self,
        law: &Law<'_, M, R>,
        step: &Step<'_, R, D>,
        stretches: &mut [Stretch<R>],
        which: u8,
        crossed: &mut Vec<(usize, Crossing<D>)>,
    ) {
        loop {
            // The first crossing in each lane that has not been dealt with.
            let start = (R::zero(), self.value);
            let (mut low, mut high) = (start, start);
            for i in (0..stretches.len()).rev() {
                let Stretch { s, value, crossing } = stretches[i];
                let before = if i == 0 { start } else { (stretches[i - 1].s, stretches[i - 1].value) };
                low = (R::select(crossing, before.0, low.0), R::select(crossing, before.1, low.1));
                high = (R::select(crossing, s, high.0), R::select(crossing, value, high.1));
            }
            let (mut seen, mut more) = (R::mask(false), R::mask(false));
            for stretch in stretches.iter_mut() {
                let crossing = stretch.crossing;
                stretch.crossing = crossing.and(seen);
                more = more.or(stretch.crossing);
                seen = seen.or(crossing);
            }
            let scale = low.1.abs().max(high.1.abs());
            let tiny = scale.scale(ZERO).min(R::constant(SMALL));
            let s = match self.form {
                Form::Component(n, less) => step.polynomials.root(n, less, low, high, tiny, seen),
                Form::Any { .. } => bracketed(|s| self.inside(law, step, s), low, high, tiny, seen),
            };
            let (t, x) = (step.from + s * step.polynomials.unit, step.polynomials.state(s));
            let residual = self.at(law, &t, &x);
            let real = seen.and(residual.abs().less(scale.scale(JUMP)));
            for lane in real.lanes() {
                let x = vector!(f64, D; n => x[n].lane(lane));
                let residual = residual.lane(lane);
                crossed.push((lane, Crossing { t: t.lane(lane), x, which, residual }));
            }
            if !more.any() {
                return;
            }
        }
    }
}
