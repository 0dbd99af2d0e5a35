//! A section's function along a step, over intervals too.

use super::crossing::{Law, general};
use crate::formula::{Expression, Leaf, Op, Place, Program};
use crate::integrate::zeros::{Curve, Polynomials, Range, time};
use crate::model::System;
use crate::scalar::{Dual, Enclosed, Interval, Real, Scalar};

/// A section's function along a lane's step.
pub(super) struct SectionCurve<'a, M, R: Real, const D: usize> {
    program: &'a Program,
    law: &'a Law<'a, M, R>,
    lane: usize,
    /// When the step begins and how long it is.
    span: (f64, f64),
    polynomials: Polynomials<D>,
    /// The components that it depends on.
    used: [bool; D],
}

impl<'a, M: System<R, D>, R: Real, const D: usize> SectionCurve<'a, M, R, D> {
    pub fn new(
        (function, program): (&Expression, &'a Program),
        law: &'a Law<'a, M, R>,
        lane: usize,
        span: (f64, f64),
        polynomials: Polynomials<D>,
    ) -> Self {
        let uses =
            |n| [Leaf::State(n), Leaf::Rate(n)].iter().any(|&own| function.ops().contains(&Op::Push(own)));
        let used = std::array::from_fn(uses);
        Self { program, law, lane, span, polynomials, used }
    }
}

impl<M: System<R, D>, R: Real, const D: usize> Curve for SectionCurve<'_, M, R, D> {
    fn value(&mut self, s: f64) -> f64 {
        let t = R::constant(self.span.0 + s * self.span.1);
        let x = self.polynomials.at(s).map(R::constant);
        general(self.program, self.law, (&t, &x)).lane(self.lane)
    }

    fn enclose(&mut self, a: f64, b: f64) -> Enclosed {
        let Self { program, law, lane, span, polynomials, used } = self;
        let ranges: [Option<Range>; D] = std::array::from_fn(|n| used[n].then(|| polynomials.range(n, a, b)));
        let unknown = Range { value: Interval::UNKNOWN, slope: Interval::UNKNOWN, bend: Interval::UNKNOWN };
        let range = |n: usize| ranges[n].unwrap_or(unknown);
        let x: [Enclosed; D] = std::array::from_fn(|n| {
            let Range { value, slope, .. } = range(n);
            Dual { re: value, d: [slope] }
        });
        // Those of the polynomial itself.
        let rates: [Enclosed; D] = std::array::from_fn(|n| {
            let Range { slope, bend, .. } = range(n);
            Dual { re: slope.scale(1.0 / span.1), d: [bend.scale(1.0 / span.1)] }
        });
        let place = Place { t: time(span.0, span.1, a, b), x: &x, rates: &rates, inputs: &[] };
        program.value_at(&place, &|i| Enclosed::constant(law.parameters[i].lane(*lane)))
    }
}
