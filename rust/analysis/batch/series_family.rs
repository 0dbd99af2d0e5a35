//! The family that packets are compiled for.
//!
//! The series of a law comes from its [tape](crate::tape), whatever the model. So all models of as many states share what
//! is compiled for packets of them.

use crate::model::{Family, Parameter, Sides, System, sides_of};
use crate::scalar::{Real, Scalar};

/// The rates of a family's law: of the parameters' values, at a time and a state.
type Rates<'a, const D: usize> = dyn Fn(&[f64], f64, &[f64; D]) -> [f64; D] + Sync + 'a;

/// A smooth family of which packets use the tape alone.
#[derive(Clone, Copy)]
pub struct SeriesFamily<'a, const D: usize> {
    rates: &'a Rates<'a, D>,
    idle: usize,
}

/// The system of a [`SeriesFamily`].
pub struct SeriesSystem<'a, S, const D: usize> {
    rates: &'a Rates<'a, D>,
    parameters: Vec<S>,
}

impl<'a, const D: usize> SeriesFamily<'a, D> {
    /// A family with these rates and so many padding states.
    pub fn new(rates: &'a Rates<'a, D>, idle: usize) -> Self {
        Self { rates, idle }
    }
}

/// The rates of one run of a family, for [`SeriesFamily::new`].
pub fn rates_of<F: Family<D>, const D: usize>(family: &F, values: &[f64], t: f64, x: &[f64; D]) -> [f64; D] {
    let system = family.build(values);
    system.rates(t, x, &sides_of(&system, t, x))
}

impl<const D: usize> PartialEq for SeriesFamily<'_, D> {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::addr_eq(self.rates, other.rates) && self.idle == other.idle
    }
}

impl<'a, const D: usize> Family<D> for SeriesFamily<'a, D> {
    type Built<S: Scalar> = SeriesSystem<'a, S, D>;

    const PACKETS: bool = true;

    fn goes_in_packets(&self) -> bool {
        true
    }

    fn idle(&self) -> usize {
        self.idle
    }

    // If there is a tape, ask the family of which it was recorded.
    fn parameters(&self) -> Vec<Parameter> {
        Vec::new()
    }

    fn build<S: Scalar>(&self, values: &[S]) -> SeriesSystem<'a, S, D> {
        SeriesSystem { rates: self.rates, parameters: values.to_vec() }
    }
}

impl<S: Scalar, const D: usize> System<S, D> for SeriesSystem<'_, S, D> {
    const SMOOTH: bool = true;

    /// Sections that depend on the rates ask for them, and who says why a run failed. Neither looks at derivatives, which
    /// come from the tape; here they are zero.
    #[inline(never)]
    fn rates(&self, t: S, x: &[S; D], _sides: &Sides<S>) -> [S; D] {
        let mut rates = [S::Real::zero(); D];
        let mut values = vec![0.0; self.parameters.len()];
        for lane in 0..S::Real::LANES {
            let of = |value: S| value.real().lane(lane);
            for (value, &parameter) in values.iter_mut().zip(&self.parameters) {
                *value = of(parameter);
            }
            let mut state = [0.0; D];
            for n in 0..D {
                state[n] = of(x[n]);
            }
            let own = (self.rates)(&values, of(t), &state);
            for n in 0..D {
                rates[n].set_lane(lane, own[n]);
            }
        }
        let mut all = [S::zero(); D];
        for n in 0..D {
            all[n] = S::lift(rates[n]);
        }
        all
    }
}
