//! Components that grow in proportion to themselves, as a population does.

use crate::model::Family;

/// A rate that falls by this factor with its component is proportional to it.
const VANISHES: f64 = 1e-9;

/// The live components whose rates at all of these states vanish with them, and are not zero everywhere.
pub fn growing_components<F: Family<D>, const D: usize>(
    family: &F,
    values: &[f64],
    t: f64,
    states: &[[f64; D]],
) -> Vec<usize> {
    let system = family.build(values);
    let rates = |x: &[f64; D]| family.rates_at(values, &system, t, x);
    let usual: Vec<_> = states.iter().map(rates).collect();
    let is_proportional = |n: usize| {
        let vanishes = states.iter().zip(&usual).all(|(x, usual)| {
            let mut without = *x;
            without[n] = 0.0;
            usual[n].is_finite() && rates(&without)[n].abs() <= VANISHES * usual[n].abs()
        });
        vanishes && usual.iter().any(|rates| rates[n] != 0.0)
    };
    (0..D - family.idle()).filter(|&n| is_proportional(n)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::FormulaFamily;

    #[test]
    fn populations_grow_and_what_is_fed_by_others_does_not() {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let texts = ["a*x*(1 - y)", "x - y", "z^2 + 1e-3*y*z", "0"];
        let family =
            FormulaFamily::<6>::parse(&names(&["x", "y", "z", "u"]), &texts, &names(&["a"]), &[]).unwrap();
        let states = [[0.5, 0.7, 0.2, 1.0, 0.0, 0.0], [0.1, 0.3, 0.9, 1.0, 0.0, 0.0]];
        assert_eq!(growing_components(&family, &[2.0], 0.0, &states), [0, 2]);
        // With this value nothing acts on x.
        assert_eq!(growing_components(&family, &[0.0], 0.0, &states), [2]);
        let infinite = [[f64::INFINITY, 0.7, 0.2, 1.0, 0.0, 0.0]];
        assert_eq!(growing_components(&family, &[2.0], 0.0, &infinite), [2]);
    }
}
