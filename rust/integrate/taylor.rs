//! The Taylor method.

use super::method::{EIGHTHS, Method, Trial};
use crate::model::{MOST_PROBES, StepStart, System};
use crate::scalar::{InstructionSet, Isa, Mask, Plain, Real, Scalar, Work, vector};
use crate::tape::{HIGH, Jets, LOW, Tape};
use crate::tolerance::{ErrorNorm, Tolerance};

const COEFFICIENTS: usize = HIGH + 1;

/// The polynomial's rates may miss those of the law by this times what a step's error may be: well above
/// what the first term left out makes of it.
const MOST_DEFECT: f64 = 30.0;
/// A step that has to be halved more often is none.
const MOST_HALVINGS: usize = 60;

/// The order that is fastest at this tolerance.
pub fn order(tolerance: &Tolerance) -> usize {
    match tolerance.rtol {
        1e-7.. => LOW,
        _ => HIGH,
    }
}

/// The Taylor series of the solution, from the model's [tape](crate::tape).
///
/// A step is as long as the series' last terms allow, so none is rejected for its error; its polynomial
/// is as accurate as its end. Tangents share the state's radius of convergence and so its steps. If the
/// coefficients are no numbers, or no step along their polynomial obeys the law, no step is taken: see
/// [`Failure::NoSeries`](super::Failure::NoSeries).
#[derive(Clone, Debug)]
pub struct Taylor<'a, S: Scalar, const D: usize> {
    tape: &'a Tape<D>,
    parameters: Vec<S>,
    jets: Jets<S, D, COEFFICIENTS>,
    /// The rates of the last trial's polynomial at its end, of a law that steps have to obey.
    slope: [S::Real; D],
    /// True if what does not change along a solution is evaluated.
    held: bool,
}

impl<'a, S: Scalar, const D: usize> Taylor<'a, S, D> {
    /// For the system with this tape and these parameters, of this [`order`]; the series is computed with these
    /// instructions.
    pub fn new(tape: &'a Tape<D>, parameters: Vec<S>, order: usize, isa: Isa) -> Self {
        let jets = Jets::new(tape, isa).with_order(order);
        Self { tape, parameters, jets, slope: [S::Real::zero(); D], held: false }
    }

    /// Halves steps whose polynomial does not obey the law at their end; fails where none does.
    ///
    /// If a law has nearly levelled off, as tanh does, its terms are too small to show the distance of its poles. The
    /// same holds for a series with gaps, such as one in powers of t^4, if the last terms fall into one. If it has
    /// levelled off entirely, the polynomial may be wrong on the way only, and so it may be in a law with splines.
    #[inline(never)]
    fn obey(&mut self, at: &StepStart<S, D>, norm: &impl ErrorNorm<S, D>, trial: &mut Trial<S, D>) {
        let (pieces, levels_off) = (self.tape.is_in_pieces(), self.tape.levels_off());
        let flat = if levels_off { self.jets.flat(self.tape) } else { S::mask(false) };
        for halvings in 0..=MOST_HALVINGS {
            let (mut bad, mut any) = self.strays(at, norm, trial, 1.0);
            // A coordinate may leave a spline's cell and return to it.
            for &part in if pieces { &EIGHTHS[..7] } else { &[] } {
                let there = self.strays(at, norm, trial, part);
                (bad, any) = (bad.or(there.0), any | there.1);
            }
            if levels_off && flat.any() {
                for part in [0.25, 0.5, 0.75] {
                    bad = bad.or(flat.and(self.strays(at, norm, trial, part).0));
                }
                any = bad.any();
            }
            if !any {
                return;
            }
            if halvings == MOST_HALVINGS {
                trial.error = S::Real::select(bad, S::Real::constant(f64::NAN), trial.error);
                return;
            }
            trial.size = S::Real::select(bad, trial.size.scale(0.5), trial.size);
            (trial.x, self.slope) = self.jets.at_with_slope(trial.size);
        }
    }

    /// Lanes where the polynomial does not obey the law at this part of the trial, and whether there are any.
    fn strays(
        &mut self,
        at: &StepStart<S, D>,
        norm: &impl ErrorNorm<S, D>,
        trial: &Trial<S, D>,
        part: f64,
    ) -> (S::Mask, bool) {
        let between = (part < 1.0).then(|| self.jets.real_with_slope(trial.size.scale(part)));
        let isa = self.jets.isa();
        let strays = Strays { method: self, at, trial, part, between: between.as_ref(), norm };
        // Worth a copy for each instruction set where all lanes and states are side by side.
        if const { S::IS_PLAIN || S::Real::LANES > 1 } {
            S::Real::work(isa, strays)
        } else {
            strays.run::<Plain>()
        }
    }
}

/// A state and the polynomial's rates there.
type StateAndSlope<R, const D: usize> = ([R; D], [R; D]);

/// The comparison of the polynomial's rates with those of the law, at a part of a trial. It is true if they differ by too
/// much, and the trial's error is a number; the state and the polynomial's rates there are given unless it is the end.
struct Strays<'a, 'b, S: Scalar, const D: usize, E> {
    method: &'a mut Taylor<'b, S, D>,
    at: &'a StepStart<S, D>,
    trial: &'a Trial<S, D>,
    part: f64,
    between: Option<&'a StateAndSlope<S::Real, D>>,
    norm: &'a E,
}

impl<S: Scalar, const D: usize, E: ErrorNorm<S, D>> Work for Strays<'_, '_, S, D, E> {
    type Output = (S::Mask, bool);

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> (S::Mask, bool) {
        let Self { method, at, trial, part, between, norm } = self;
        let &Trial { size, error, .. } = trial;
        let (x, slope) = match between {
            Some(&between) => between,
            None => (vector!(S::Real, D; n => trial.x[n].real()), method.slope),
        };
        let rates = method.jets.rates(method.tape, at.t + size.scale(part), &x, &at.sides);
        let defect = vector!(S::Real, D; n => (slope[n] - rates[n]) * size);
        let from = vector!(S::Real, D; n => at.x[n].real());
        let bad = error.finite().and(norm.state().exceeds(MOST_DEFECT, defect, from, x));
        (bad, bad.any())
    }
}

impl<S: Scalar, const D: usize> Method<S, D> for Taylor<'_, S, D> {
    const ORDER: i32 = HIGH as i32;
    const EVALUATIONS: usize = 1;
    const SERIES: bool = true;
    const PROBES: &'static [f64] = EIGHTHS;

    /// The number at which the exponential series up to this order leaves the unit disk, to 2 %.
    fn stable(&self) -> f64 {
        1.3 + 0.377 * self.jets.order() as f64
    }

    #[inline(always)]
    fn set_parameters(&mut self, values: &[S]) {
        self.parameters.copy_from_slice(values);
        self.held = false;
    }

    #[inline(always)]
    fn begin(&mut self, _system: &impl System<S, D>, _at: &StepStart<S, D>, _lanes: S::Mask) {}

    fn attempt(
        &mut self,
        system: &impl System<S, D>,
        at: &StepStart<S, D>,
        h: S::Real,
        norm: &impl ErrorNorm<S, D>,
    ) -> Trial<S, D> {
        if !self.held || self.tape.switches_held() {
            self.jets.hold(self.tape, &self.parameters, &at.sides);
            self.held = true;
        }
        if self.tape.is_driven() {
            self.jets.set_inputs(self.tape, &|k| system.input(k, at.t, &at.sides));
        }
        let mut trial = S::Real::work(self.jets.isa(), Attempt { method: self, at, h, norm });
        // Written-out series have no gaps.
        if !self.tape.is_unrolled() {
            self.obey(at, norm, &mut trial);
        }
        trial
    }

    fn extend(&mut self, _system: &impl System<S, D>, _at: &StepStart<S, D>) {}

    #[inline(always)]
    fn begin_next(&mut self, _lanes: S::Mask) {}

    fn at(&self, dt: S::Real) -> [S; D] {
        self.jets.at(dt)
    }

    fn real_at(&self, dt: S::Real, of: &[bool; D]) -> [S::Real; D] {
        self.along(dt, &[1.0], of)[0]
    }

    fn along(&self, h: S::Real, parts: &[f64], of: &[bool; D]) -> [[S::Real; D]; MOST_PROBES] {
        self.jets.along(h, parts, of)
    }

    #[inline(always)]
    fn component(&self, n: usize) -> Option<&[S]> {
        Some(&self.jets.coefficients()[n][..=self.jets.order()])
    }

    fn polynomial(&self, coefficients: &mut Vec<[S; D]>) -> S::Real {
        let series = self.jets.coefficients();
        for k in 0..=self.jets.order() {
            coefficients.push(vector!(S, D; n => series[n][k]));
        }
        S::Real::one()
    }
}

/// A step, compiled once for each instruction set.
struct Attempt<'a, 'b, S: Scalar, const D: usize, E> {
    method: &'a mut Taylor<'b, S, D>,
    at: &'a StepStart<S, D>,
    h: S::Real,
    norm: &'a E,
}

impl<S: Scalar, const D: usize, E: ErrorNorm<S, D>> Work for Attempt<'_, '_, S, D, E> {
    type Output = Trial<S, D>;
    // Eight derivatives fill a register; the series of the three equations, written out, wants 32 of them.
    const WIDE: bool = size_of::<S>() > 8 * size_of::<f64>() || D == 3 && size_of::<S>() == size_of::<f64>();

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Trial<S, D> {
        let Self { method, at, h, norm } = self;
        // Divisions: compared with the series they cost little.
        let weights = norm.weights(&at.x);
        let jets = &mut method.jets;
        jets.expand_here::<V>(method.tape, S::lift(at.t), &at.x, &at.sides);
        let slope = (!method.tape.is_unrolled()).then_some(&mut method.slope);
        if const { V::ISA.is_rare() || size_of::<S>() > 2 * size_of::<S::Real>() } {
            return followed(jets, jets.order(), h, norm, &weights, slope);
        }
        // The usual orders known to the compiler: not where tangents make every operation long.
        match jets.order() {
            LOW => followed(jets, LOW, h, norm, &weights, slope),
            HIGH => followed(jets, HIGH, h, norm, &weights, slope),
            order => followed(jets, order, h, norm, &weights, slope),
        }
    }
}

/// The solution as far as its series up to this order goes, at most to `h`, and the polynomial's rates there if they are needed.
#[inline(always)]
fn followed<S: Scalar, const D: usize, E: ErrorNorm<S, D>>(
    jets: &Jets<S, D, COEFFICIENTS>,
    order: usize,
    h: S::Real,
    norm: &E,
    weights: &E::Weights,
    slope: Option<&mut [S::Real; D]>,
) -> Trial<S, D> {
    let radius = jets.radius(order, norm, weights);
    let short = radius.less(h.abs());
    let size = S::Real::select(short, radius.zip(h, f64::copysign), h);
    let known = S::Real::zero().less(radius);
    let error = S::Real::select(known, S::Real::zero(), S::Real::constant(f64::NAN));
    let x = match slope {
        Some(slope) => {
            let x;
            (x, *slope) = jets.at_with_slope_here(order, size);
            x
        }
        // Only models of three and four states have series that are written out.
        None if const { D == 3 || D == 4 } => jets.at_here(order, size),
        None => unreachable!("the law of a series that is not written out is compared"),
    };
    Trial { x, size, error }
}
