//! Machine code compared with the interpreter.

use std::array::from_fn;

use super::*;
use crate::model::FormulaFamily;
use crate::scalar::{LANES, Packet, Plain, Real};
use crate::tape::{HIGH, Tape, node};

const ROOM: usize = HIGH + 1;
const ISAS: [Isa; 2] = [Isa::Avx2, Isa::Avx512];

/// Laws of every kind of operation, with kinks and time.
const LAWS: [[&str; 3]; 9] = [
    ["x*(k - z) - y", "abs(x)*y + z^3", "max(x, y)*sign(z) - c*x*y"],
    ["sin(x*y) + cos(x)", "exp(-x^2)*z + tanh(y*c + z)", "ln(3 + x^2) - sqrt(2 + y^2)"],
    ["x/(2 + y^2)", "k/(3 + x*z)", "cos(t)*x - min(t, y)"],
    ["1", "sqrt(4 + t)*z - x", "where(x > y, x*y, z*z) + ln(2 + t)"],
    // Sines of time, and of what is not linear in it.
    ["sin(k*t)*x - y", "cos(2 - c*t)*z + sin(k*t)", "cos(t*t)*x - sin(t + x)"],
    // The same operations side by side.
    ["k*x*y - z", "c*y*z - x", "k*z*x - y"],
    ["sin(x)*k + tanh(y*z)", "sin(y)*c + tanh(x*z)", "cos(z)*sin(x*y)"],
    ["exp(x)/(2 + y^2)", "exp(-y)/(2 + z^2)", "k/(1 + x^2) + ln(2 + y^2)*x - ln(2 + z^2)*y"],
    ["y", "-x^3 + c*(z - x) - k*y", "-z^3 + k*(x - z) - c*y + sqrt(1 + x^2) - sqrt(2 + y^2)"],
];

/// The bits of the state's series, interpreted and by machine code. Here all NaNs have the same bits.
fn both_ways<S: Real>(tape: &Tape<3>, isa: Isa, order: usize, x: [S; 5]) -> Option<[Vec<u64>; 2]> {
    let (program, sides) = (&tape.program, from_fn(|j| S::mask(j % 2 == 1)));
    let code = series(program, isa, S::LANES, ROOM, order)?;
    let mut held = vec![S::zero(); tape.held.len()];
    node::hold(&tape.held, &x[3..], &sides, &mut held);
    let rows = numbers(program, ROOM, S::LANES == 1).div_ceil(ROOM);
    let mut work = vec![[S::zero(); ROOM]; tape.slots + rows];
    (0..3).for_each(|n| work[n][0] = x[n]);
    let t = S::constant(0.7);
    let mut interpreted = work.clone();
    program.interpret_start(&mut interpreted, &held, t, &sides);
    start(program, isa, S::LANES, ROOM)?.run(&mut work, &held, t, &sides);
    (1..order).for_each(|k| program.next::<Plain, S, ROOM>(&mut interpreted, &held, &sides, k));
    code.run(0, work.as_flattened_mut(), &held, &sides);
    let bits = |value: f64| if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() };
    let lanes = |c: &S| (0..S::LANES).map(|l| bits(c.lane(l))).collect::<Vec<_>>();
    Some([interpreted, work].map(|work| work[..3].as_flattened().iter().flat_map(lanes).collect()))
}

/// The second recording of the same equations has the code of the first one, though the parameters have other names.
#[test]
fn equal_equations_share_their_code() {
    let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
    let record = |texts: [&str; 2], parameter: &str| {
        let family =
            FormulaFamily::<2>::parse(&names(&["x", "y"]), &texts, &names(&[parameter]), &[]).unwrap();
        Tape::record(&family, &[]).unwrap()
    };
    let has_code = |tape: &Tape<2>| tape.program.codes.get::<f64>(1, u32::MAX, |_| None).is_some();
    let first = record(["y", "-x - c*y^3"], "c");
    let made =
        first.program.codes.get::<f64>(1, 0, |lanes| series(&first.program, Isa::best(), lanes, ROOM, HIGH));
    let made = made.is_some();
    assert_eq!(has_code(&record(["y", "-x - k*y^3"], "k")), made);
    assert!(!has_code(&record(["y", "-x - k*y^2"], "k")));
}

/// Machine code has the interpreter's bits, for every operation, order and instruction set.
#[test]
fn machine_code_changes_no_bit() {
    let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
    let mut compared = 0;
    for texts in LAWS {
        let (states, parameters) = (names(&["x", "y", "z"]), names(&["k", "c"]));
        let family = FormulaFamily::<3>::parse(&states, &texts, &parameters, &[]).unwrap();
        let tape = Tape::record(&family, &[]).unwrap();
        let places =
            [[0.3, -1.1, 0.8, 2.5, -0.4], [0.0, -0.0, 0.0, 1.0, 0.0], [1e155, 2.0, -1e160, 1.0, 1.0]];
        for (tape, x) in [tape.unfused(), tape].iter().flat_map(|tape| places.map(|x| (tape, x))) {
            for (isa, order) in ISAS.iter().flat_map(|isa| [4, 7, 10, HIGH].map(|k| (*isa, k))) {
                let packets = x.map(|x| Packet::<LANES>::from_lanes(|l| x * (1.0 + 0.1 * l as f64)));
                let wide = x.map(|x| Packet::<{ 2 * LANES }>::from_lanes(|l| x - 0.1 * l as f64));
                for [interpreted, compiled] in [
                    both_ways(tape, isa, order, x),
                    both_ways(tape, isa, order, packets),
                    both_ways(tape, isa, order, wide),
                ]
                .into_iter()
                .flatten()
                {
                    assert_eq!(interpreted, compiled, "{texts:?} by {isa:?}, order {order}, at {x:?}");
                    compared += 1;
                }
            }
        }
    }
    let sets = if cfg!(all(feature = "machine-code", target_arch = "x86_64")) {
        ISAS.into_iter().filter(|&isa| isa <= Isa::best()).count()
    } else {
        0
    };
    assert_eq!(compared, LAWS.len() * 2 * 3 * 4 * 3 * sets);
}
