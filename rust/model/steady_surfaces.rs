//! The switching surfaces of a law given as text, at all places of a step side by side.
//!
//! Most steps cross no surface, and the values at a few places show it. One after the other these evaluations take as long
//! as a short step; here they are the lanes of a packet.

use super::targets::crossing;
use super::{MOST_PROBES, Probes, Sides, StepStart, TARGETS};
use crate::formula::{Kinks, Place, Program};
use crate::scalar::{Mask, Packet, Real, Scalar};

/// A number at each place.
pub(super) type Places = Packet<MOST_PROBES>;

/// The surfaces whose functions are no faster than the state.
#[derive(Debug, PartialEq)]
pub(super) struct SteadySurfaces {
    program: Program,
    /// The surface of each result.
    numbers: Vec<usize>,
}

impl SteadySurfaces {
    pub(super) fn of(kinks: &Kinks) -> Self {
        let numbers: Vec<usize> = (0..kinks.surfaces.len()).filter(|&j| kinks.steady[j]).collect();
        Self { program: Program::of(numbers.iter().map(|&j| &kinks.surfaces[j])), numbers }
    }

    /// The values that parameters alone determine, as [`suspect`](Self::suspect) takes them. Empty if places have to be
    /// evaluated one after the other: they are in packets already, or a division of numbers with derivatives has other bits.
    pub(super) fn fix<S: Scalar>(&self, values: &[S]) -> Vec<Places> {
        let alone = const { !S::SYMBOLIC && S::Real::LANES == 1 };
        if !alone || self.numbers.is_empty() || !(S::IS_PLAIN || self.program.is_ring()) {
            return Vec::new();
        }
        self.program.fix(values).into_iter().map(|value| Packet::constant(value.real().lane(0))).collect()
    }

    /// Finds out which of these surfaces a step may cross.
    pub(super) fn suspect<S: Scalar, const D: usize>(
        &self,
        fixed: &[Places],
        at: &StepStart<S, D>,
        probes: &Probes<'_, S::Real, D>,
        watched: &[bool],
        found: &mut [S::Mask; TARGETS],
    ) {
        let places = probes.parts.len();
        let mut x = [Places::zero(); D];
        for n in 0..D {
            if watched[n] {
                x[n] = Packet::from_lanes(|i| probes.states[i][n].lane(0));
            }
        }
        let time = |i: usize| (at.t + probes.h.scale(probes.parts[i])).lane(0);
        let t = Packet::from_lanes(|i| if i < places { time(i) } else { 0.0 });
        let sides: Sides<Places> = at.sides.map(|side| Places::mask(side.lane(0)));
        let mut results = [Places::zero(); TARGETS];
        let results = &mut results[..self.numbers.len()];
        self.program.run(&Place { t, x: &x, rates: &[], inputs: &[] }, fixed, &sides, results);
        for (&j, &result) in self.numbers.iter().zip(&*results) {
            let inward = if at.sides[j].lane(0) { result } else { -result };
            let mut values = [0.0; MOST_PROBES];
            for (i, value) in values.iter_mut().enumerate() {
                *value = inward.lane(i);
            }
            found[j] = S::mask(crossing(&values, places));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Family, FormulaFamily, System, sides_of, suspect_in_turn};
    use crate::scalar::Dual;

    const QUARTERS: &[f64] = &[0.25, 0.5, 0.75, 1.0];
    const EIGHTHS: &[f64] = &[0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0];

    /// How many surfaces of how many steps are suspect; together and in turn these are the same.
    fn suspects<S: Scalar<Real = f64, Mask = bool>>(
        texts: &[&str; 2],
        parts: &'static [f64],
    ) -> (usize, usize) {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let family = FormulaFamily::<2>::parse(&names(&["x", "v"]), texts, &names(&["a", "b"]), &[]).unwrap();
        let system = family.build(&[S::constant(0.3), S::constant(0.7)]);
        let (mut suspect, mut all) = (0, 0);
        for k in 0..400 {
            let number = |i: u32| f64::from((k * 7919 + i * 104_729) % 1009) / 504.5 - 1.0;
            let x = [S::constant(number(1)), S::constant(number(2))];
            let mut at = StepStart { t: number(3), x, sides: sides_of(&system, S::constant(number(3)), &x) };
            // Some steps begin on another side than that of their start.
            at.sides[0] ^= k % 5 == 0;
            let mut states = [[0.0; 2]; MOST_PROBES];
            for (i, state) in states.iter_mut().enumerate() {
                let part = (i + 1) as f64 / parts.len() as f64;
                *state = [number(1) + part * number(4), number(2) + part * part * number(5)];
            }
            let probes = Probes { h: 0.1, parts, states: &states };
            let (mut together, mut in_turn) = ([false; TARGETS], [false; TARGETS]);
            system.suspect(&at, false, &probes, &mut together);
            suspect_in_turn(&system, &at, false, &probes, &mut in_turn);
            assert_eq!(together, in_turn, "{texts:?} at step {k}");
            suspect += together.iter().filter(|&&suspect| suspect).count();
            all += System::<S, 2>::surfaces(&system);
        }
        (suspect, all)
    }

    #[test]
    fn places_side_by_side_show_what_they_show_in_turn() {
        for texts in [
            ["v", "abs(x - a*abs(v))*b - max(v/b, x)"],
            ["v", "-x - a*sign(v) + b*abs(x - t)"],
            ["v", "min(x, v) - where(sin(x) > b, x, v)"],
            ["v*sign(x - v)", "-x - a*sign(v) - b*sign(x)"],
        ] {
            for parts in [QUARTERS, EIGHTHS] {
                let (plain, dual) = (suspects::<f64>(&texts, parts), suspects::<Dual<f64, 2>>(&texts, parts));
                assert_eq!(plain, dual, "{texts:?}");
                assert!(0 < plain.0 && plain.0 < plain.1, "{texts:?}: {plain:?}");
            }
        }
    }
}
