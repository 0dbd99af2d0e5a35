//! The switching surfaces of a law given as text, at all places of a step side by side.
//!
//! Most steps cross no surface, and the values at a few places show it. One after the other these evaluations take as long
//! as a short step; here they are the lanes of a packet.

use std::array::from_fn;

use super::{MOST_PROBES, Probes, Sides, StepStart};
use crate::formula::{Place, Program};
use crate::scalar::{Mask, Packet, Real, Scalar};

/// A number at each place.
pub(super) type Places = Packet<MOST_PROBES>;

/// The values that parameters alone determine, as [`values`] takes them. Empty if places have to be evaluated one after the
/// other: they are in packets already, or a division of numbers with derivatives has other bits.
pub(super) fn fix<S: Scalar>(program: &Program, values: &[S]) -> Vec<Places> {
    let alone = const { !S::SYMBOLIC && S::Real::LANES == 1 };
    if !alone || !(S::IS_PLAIN || program.is_ring()) {
        return Vec::new();
    }
    program.fix(values).into_iter().map(|value| Packet::constant(value.real().lane(0))).collect()
}

/// The values of a surface's program at all places of a step.
pub(super) fn values<S: Scalar, const D: usize>(
    (program, fixed): (&Program, &[Places]),
    at: &StepStart<S, D>,
    probes: &Probes<'_, S::Real, D>,
    watched: &[bool],
) -> [S::Real; MOST_PROBES] {
    let count = probes.parts.len();
    let mut x = [Places::zero(); D];
    for n in 0..D {
        if watched[n] {
            x[n] = Packet::from_lanes(|i| probes.states[i][n].lane(0));
        }
    }
    let time = |i: usize| (at.t + probes.h.scale(probes.parts[i])).lane(0);
    let t = Packet::from_lanes(|i| if i < count { time(i) } else { 0.0 });
    let sides: Sides<Places> = at.sides.map(|side| Places::mask(side.lane(0)));
    let mut result = [Places::zero()];
    program.run(&Place { t, x: &x, rates: &[], inputs: &[] }, fixed, &sides, &mut result);
    from_fn(|i| S::Real::constant(result[0].lane(i)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Family, FormulaFamily, System, sides_of, surface_in_turn};
    use crate::scalar::Dual;

    const QUARTERS: &[f64] = &[0.25, 0.5, 0.75, 1.0];
    const EIGHTHS: &[f64] = &[0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0];

    /// Compares the values of all surfaces at the places of many steps with those in turn. Returns how many there are, and how
    /// many are negative.
    fn compare<S: Scalar<Real = f64, Mask = bool>>(texts: &[&str; 2], parts: &'static [f64]) -> [usize; 2] {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let family = FormulaFamily::<2>::parse(&names(&["x", "v"]), texts, &names(&["a", "b"]), &[]).unwrap();
        let system = family.build(&[S::constant(0.3), S::constant(0.7)]);
        let mut counts = [0, 0];
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
            for j in 0..System::<S, 2>::surfaces(&system) {
                let together = &system.surface_along(j, &at, &probes)[..parts.len()];
                let in_turn = &surface_in_turn(&system, j, &at, &probes)[..parts.len()];
                assert_eq!(together, in_turn, "{texts:?} at step {k}");
                counts[0] += parts.len();
                counts[1] += together.iter().filter(|&&value| value < 0.0).count();
            }
        }
        counts
    }

    #[test]
    fn places_side_by_side_have_the_values_in_turn() {
        for texts in [
            ["v", "abs(x - a*abs(v))*b - max(v/b, x)"],
            ["v", "-x - a*sign(v) + b*abs(x - t)"],
            ["v", "min(x, v) - where(sin(x) > b, x, v)"],
            ["v*sign(x - v)", "-x - a*sign(v) - b*sign(x)"],
        ] {
            for parts in [QUARTERS, EIGHTHS] {
                let (plain, dual) = (compare::<f64>(&texts, parts), compare::<Dual<f64, 2>>(&texts, parts));
                assert_eq!(plain, dual, "{texts:?}");
                assert!(0 < plain[1] && plain[1] < plain[0], "{texts:?}: {plain:?}");
            }
        }
    }
}
