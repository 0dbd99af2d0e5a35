//! The elementary functions: accuracy, special values, symmetries, and the same bits in every width and
//! instruction set.

#[allow(clippy::approx_constant, reason = "some of the points' values are constants of mathematics")]
#[path = "elementary/points.rs"]
mod points;

use std::f64::consts::{FRAC_PI_2, LN_2};
use std::marker::PhantomData;

use udd::scalar::elementary::{
    exp, exp2_rough, inverse_rough, ln, log2_rough, pow, power_rough, sin_cos, tanh,
};
use udd::scalar::{Dual, InstructionSet, Isa, Packet, Plain, Real, Scalar, Work};

const INF: f64 = f64::INFINITY;
const LEAST: f64 = 5e-324;

fn sin(x: f64) -> f64 {
    sin_cos(x).0
}

fn cos(x: f64) -> f64 {
    sin_cos(x).1
}

/// The distance from `x` to the next larger number in size.
fn ulp(x: f64) -> f64 {
    x.abs().next_up() - x.abs()
}

/// `n` numbers from `a` to `b`, without a pattern, always the same ones.
fn numbers(n: usize, a: f64, b: f64) -> impl Iterator<Item = f64> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    (0..n).map(move |_| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        a + (b - a) * ((state >> 11) as f64 / (1u64 << 53) as f64)
    })
}

/// Within one ulp of the exact value at all the points.
fn meets(points: &[(f64, f64, f64)], f: fn(f64) -> f64) {
    for &(x, high, low) in points {
        let error = ((f(x) - high) - low).abs() / ulp(high);
        assert!(error <= 1.0, "x = {x:e}: {:e} is {error} ulp from {high:e}", f(x));
    }
}

/// Within `most` ulp of the standard library's value, which is itself off by up to half an ulp and a bit.
fn agrees(f: fn(f64) -> f64, std: fn(f64) -> f64, most: f64, range: (f64, f64)) {
    for x in numbers(100_000, range.0, range.1) {
        let error = (f(x) - std(x)).abs() / ulp(std(x));
        assert!(error <= most, "x = {x:e}: {:e} is {error} ulp from {:e}", f(x), std(x));
    }
}

fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

#[test]
fn exact_points() {
    meets(&points::EXP, exp);
    meets(&points::LN, ln);
    meets(&points::SIN, sin);
    meets(&points::COS, cos);
    meets(&points::TANH, tanh);
}

#[test]
fn many_points() {
    for range in [(-1.0, 1.0), (-40.0, 40.0), (-745.0, 709.7)] {
        agrees(exp, f64::exp, 1.0, range);
    }
    for range in [(0.6, 1.5), (0.99, 1.01), (0.0, 1e3), (0.0, 1e300), (0.0, 1e-306)] {
        agrees(ln, f64::ln, 1.0, range);
    }
    for range in [(-1.0, 1.0), (-10.0, 10.0), (-1e3, 1e3), (-2e5, 2e5)] {
        agrees(sin, f64::sin, 1.0, range);
        agrees(cos, f64::cos, 1.0, range);
    }
    // The library's own is off by two ulp.
    for range in [(-0.56, 0.56), (-1.0, 1.0), (-20.0, 20.0)] {
        agrees(tanh, f64::tanh, 3.0, range);
    }
}

#[test]
fn special_values() {
    for f in [exp, ln, sin, cos, tanh, log2_rough, exp2_rough, |x| pow(x, 0.17)] {
        assert!(f(f64::NAN).is_nan());
    }
    for (value, expected) in [
        (exp(0.0), 1.0),
        (exp(-0.0), 1.0),
        (exp(709.8), INF),
        (exp(1e300), INF),
        (exp(INF), INF),
        (exp(-745.2), 0.0),
        (exp(-1e300), 0.0),
        (exp(-INF), 0.0),
        (ln(1.0), 0.0),
        (ln(0.0), -INF),
        (ln(-0.0), -INF),
        (ln(-LEAST), f64::NAN),
        (ln(-1.0), f64::NAN),
        (ln(-INF), f64::NAN),
        (ln(INF), INF),
        (sin(0.0), 0.0),
        (sin(-0.0), -0.0),
        (cos(0.0), 1.0),
        (cos(-0.0), 1.0),
        (sin(LEAST), LEAST),
        (cos(LEAST), 1.0),
        (sin(INF), f64::NAN),
        (cos(INF), f64::NAN),
        (sin(-INF), f64::NAN),
        (cos(-INF), f64::NAN),
        (tanh(0.0), 0.0),
        (tanh(-0.0), -0.0),
        (tanh(LEAST), LEAST),
        (tanh(20.0), 1.0),
        (tanh(1e300), 1.0),
        (tanh(INF), 1.0),
        (tanh(-INF), -1.0),
        (pow(0.0, 0.17), 0.0),
        (pow(0.0, -0.5), INF),
        (pow(INF, 0.17), INF),
        (pow(INF, -0.5), 0.0),
        (pow(1.0, 12.5), 1.0),
        (pow(7.0, 0.0), 1.0),
        (pow(-2.0, 0.5), f64::NAN),
        (log2_rough(0.0), -1023.0),
        (log2_rough(1.0), 0.0),
        (log2_rough(INF), INF),
    ] {
        assert!(same(value, expected), "{value:e} instead of {expected:e}");
    }
}

/// The last bits of the range: exp and ln undo each other down to the denormal numbers.
#[test]
fn denormal_numbers() {
    for k in -1074..=1023 {
        let power = 2f64.powi(k.max(-1000)) * 2f64.powi(k.min(-1000) + 1000);
        // The logarithm rounds by half an ulp of up to 745, so e to it is off by 6e-14 of itself, or by one
        // of the smallest numbers.
        assert!((exp(ln(power)) - power).abs() <= (1.2e-13 * power).max(LEAST), "2^{k}");
        // The product is itself off by up to 0.8 ulp.
        assert!((ln(power) - f64::from(k) * LN_2).abs() <= 1.5 * ulp(ln(power)), "2^{k}");
    }
}

#[test]
fn symmetries() {
    for x in numbers(20_000, 0.0, 60.0).chain(numbers(20_000, 0.0, 3e5)).chain(numbers(1000, 0.0, 1e12)) {
        assert!(same(sin(-x), -sin(x)), "{x}");
        assert!(same(cos(-x), cos(x)), "{x}");
        assert!(same(tanh(-x), -tanh(x)), "{x}");
        assert!(same(sin_cos(x).0, Scalar::sin(x)) && same(sin_cos(x).1, Scalar::cos(x)), "{x}");
        // Each of the squares is off by two ulp of at most 1, the sum by half an ulp.
        assert!((sin(x).powi(2) + cos(x).powi(2) - 1.0).abs() < 5e-16, "{x}");
    }
    // Ties between two multiples of a right angle go the same way on both sides.
    for k in 0..1000 {
        let x = (f64::from(k) + 0.5) * FRAC_PI_2;
        assert!(same(sin(-x), -sin(x)) && same(cos(-x), cos(x)), "{x}");
    }
}

/// Angles of any size, alone and in a packet beside small ones.
#[test]
fn angles_far_from_zero() {
    for (x, (sine, sine_rest), (cosine, cosine_rest)) in points::FAR {
        for (value, high, low) in [(sin(x), sine, sine_rest), (cos(x), cosine, cosine_rest)] {
            let error = ((value - high) - low).abs() / ulp(high);
            assert!(error <= 1.0, "x = {x:e}: {value:e} is {error} ulp from {high:e}");
        }
        assert!(same(sin(-x), -sin(x)) && same(cos(-x), cos(x)), "{x:e}");
        let (s, c) = sin_cos(Packet::<4>::new([0.3, x, -2e5, -x]));
        for (lane, x) in [0.3, x, -2e5, -x].into_iter().enumerate() {
            assert!(same(s.lane(lane), sin(x)) && same(c.lane(lane), cos(x)), "{x:e}");
        }
    }
    for size in [3e5, 1e6, 1e8, 1e10, 1e13, 2.2e15, 1e18, 1e30, 1e100, 1e300] {
        agrees(sin, f64::sin, 1.0, (-size, size));
        agrees(cos, f64::cos, 1.0, (-size, size));
    }
}

/// Where one formula hands over to another, and elsewhere, no function steps back by more than its error.
#[test]
fn growing() {
    for (f, start) in
        [(exp as fn(f64) -> f64, 0.5 * LN_2), (ln, 0.5f64.sqrt()), (ln, 2f64.sqrt()), (tanh, 0.55)]
    {
        let mut x = start - 2000.0 * ulp(start);
        for _ in 0..4000 {
            let next = x.next_up();
            assert!(f(next) >= f(x) - 2.0 * ulp(f(x)), "{x}");
            x = next;
        }
    }
}

#[test]
fn powers() {
    for exponent in [0.17, 0.04, -0.2, 0.5, 1.0, 2.5, -3.0] {
        for x in numbers(20_000, -60.0, 60.0).map(f64::exp) {
            let exact = x.powf(exponent);
            let most = (1.0 + (exponent * x.ln()).abs()) * 2.5e-16;
            assert!((pow(x, exponent) - exact).abs() <= most * exact, "{x}^{exponent}");
        }
    }
}

#[test]
fn rough_powers() {
    for x in numbers(50_000, -700.0, 700.0).map(f64::exp).chain(numbers(50_000, 0.5, 2.0)) {
        assert!((log2_rough(x) - x.log2()).abs() < 3.1e-7, "{x}");
        // 3.1e-7 in the logarithm, times the exponent and ln 2, and 8e-8.
        let root = exp2_rough(log2_rough(x) * 0.17);
        assert!((root / x.powf(0.17) - 1.0).abs() < 1.2e-7, "{x}");
    }
    for x in numbers(50_000, -1022.0, 1023.0) {
        assert!((exp2_rough(x) / x.exp2() - 1.0).abs() < 8e-8, "{x}");
    }
    for power in [-1.0 / 60.0, -1.0 / 16.0, -0.25] {
        for x in numbers(20_000, -700.0, 700.0).map(f64::exp) {
            // Both lines through the powers of two lead upwards: by up to 6.2 %, and by 2^0.0861 to the power
            // asked for. CENTRE takes 3.9 % back.
            assert!((power_rough(x, power) / x.powf(power) - 1.0).abs() < 0.04, "{x}^{power}");
        }
        assert!(power_rough(0.0, power) > 1e300_f64.powf(-power));
        assert!(power_rough(INF, power) < 1e-300_f64.powf(-power));
    }
    for x in numbers(50_000, -700.0, 700.0).map(f64::exp) {
        // The least over all constants is 0.2553 %.
        assert!((x * inverse_rough(x) - 1.0).abs() < 2.6e-3, "{x}");
    }
    assert!((exp2_rough(-INF) / f64::MIN_POSITIVE - 1.0).abs() < 8e-8);
    assert!(exp2_rough(INF).is_finite());
}

/// Sine and cosine together are the two apart, with their derivatives of first and second order.
#[test]
fn dual_angles() {
    for x in numbers(100, -50.0, 50.0) {
        let x = Dual::<Dual<f64, 1>, 1>::variable(Dual::variable(x, 0), 0);
        let (sin, cos) = x.sin_cos();
        assert_eq!((sin, cos), (x.sin(), x.cos()));
        assert_eq!((sin.d[0].re, cos.d[0].re), (cos.re.re, -sin.re.re));
        assert_eq!((sin.d[0].d[0], cos.d[0].d[0]), (-sin.re.re, -cos.re.re));
    }
}

/// A function that may be one of numbers of any width.
trait Function {
    fn of<R: Real>(x: R) -> R;
}

/// Each of its own: together they would take minutes to compile.
macro_rules! functions {
    ($($name:ident($x:ident) = $value:expr;)+) => {
        $(struct $name;
        impl Function for $name {
            #[inline(always)]
            fn of<R: Real>($x: R) -> R {
                $value
            }
        })+

        #[test]
        fn same_bits_everywhere() {
            $(same_bits::<$name>(stringify!($name));)+
        }
    };
}

functions! {
    Exp(x) = exp(x);
    Ln(x) = ln(x);
    LnAbs(x) = ln(x.abs());
    Sin(x) = sin_cos(x).0;
    Cos(x) = sin_cos(x).1;
    Tanh(x) = tanh(x);
    Root(x) = pow(x.abs(), 0.17);
    Power(x) = pow(x, -1.5);
    RoughRoot(x) = exp2_rough(log2_rough(x.abs()).scale(0.17));
    RoughPower(x) = exp2_rough(x);
    RoughRadius(x) = power_rough(x.abs(), -0.03);
    RoughInverse(x) = inverse_rough(x.abs());
}

fn bits(x: f64) -> u64 {
    if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() }
}

#[inline(always)]
fn in_packets<F: Function, const L: usize, V: InstructionSet>(x: &[f64]) -> Vec<u64> {
    let packets = x.chunks(L).map(|part| Packet::<L, V>::from_lanes(|i| part.get(i).copied().unwrap_or(1.0)));
    let mut all = Vec::new();
    for value in packets.map(F::of) {
        all.extend((0..L).map(|i| bits(value.lane(i))));
    }
    all.truncate(x.len());
    all
}

struct Everywhere<'a, F>(&'a [f64], PhantomData<F>);

impl<F: Function> Work for Everywhere<'_, F> {
    type Output = Vec<(usize, Vec<u64>)>;

    #[inline(always)]
    fn run<V: InstructionSet>(self) -> Self::Output {
        vec![
            (0, self.0.iter().map(|&x| bits(F::of(x))).collect()),
            (1, in_packets::<F, 1, V>(self.0)),
            (2, in_packets::<F, 2, V>(self.0)),
            (3, in_packets::<F, 3, V>(self.0)),
            (4, in_packets::<F, 4, V>(self.0)),
            (8, in_packets::<F, 8, V>(self.0)),
            (16, in_packets::<F, 16, V>(self.0)),
            (8, in_packets::<F, 8, Plain>(self.0)),
        ]
    }
}

fn same_bits<F: Function>(name: &str) {
    let mut x = vec![0.0, -0.0, LEAST, -LEAST, 1e-310, f64::MIN_POSITIVE, 1.0, -1.0, f64::NAN, INF, -INF];
    x.extend([709.78, 709.79, -708.4, -720.0, -745.13, -746.0, 22.0, 0.55, 1e15, 3e15, 1e300, f64::MAX]);
    for (a, b) in [(-1.0, 1.0), (-30.0, 30.0), (-750.0, 750.0), (-1e6, 1e6), (-1e17, 1e17), (0.5, 2.0)] {
        x.extend(numbers(500, a, b));
    }
    let expected: Vec<_> = x.iter().map(|&x| bits(F::of(x))).collect();
    for isa in Isa::available() {
        for (lanes, found) in isa.run(Everywhere(&x, PhantomData::<F>)) {
            for (i, &x) in x.iter().enumerate() {
                assert_eq!(found[i], expected[i], "{name}, {isa:?}, {lanes} lanes, x = {x:e}");
            }
        }
    }
}
