//! Pieces of orbits with their derivatives: what multiple shooting is made of.

use crate::analysis::CancelFlag;
use crate::analysis::batch::parallel::try_map;
use crate::integrate::{
    Dop853, Dopri5, ErrorNorm, Failure, Integrator, MaybeTangents, Method, Taylor, Tolerance, WithTangents,
    order,
};
use crate::model::{AnySystem, Family, System};
use crate::scalar::{Dual, Isa, Scalar, constants, vector};
use crate::tape::Tape;

/// So many parameters can be differentiated by at once.
pub const MOST_PARAMETERS: usize = 2;
/// So many derivatives one run carries, by the components of the state, then by parameters: as many as a fit's, which
/// shares what is compiled. States of more than [`FEW`] components share it with their exponents: one run carries as
/// many derivatives as there are components, and parameters take a run of their own.
const DIRECTIONS: usize = 8;
const FEW: usize = 4;
/// More steps than this within one piece mean that something is wrong.
const MOST_STEPS: u64 = 1_000_000;

/// Where a piece of an orbit starts: its parameters, its time and state, and how long it lasts.
#[derive(Clone, Debug)]
pub struct Segment<const D: usize> {
    pub values: Vec<f64>,
    pub t: f64,
    pub x: [f64; D],
    /// May be negative: backward in time.
    pub span: f64,
}

/// Where a piece ends.
#[derive(Clone, Copy, Debug)]
pub struct SegmentEnd<const D: usize> {
    pub x: [f64; D],
    /// `by_state[n][k]` is the derivative of component `n` by component `k` at the start.
    pub by_state: [[f64; D]; D],
    /// The same by the parameters asked for; zero where fewer are.
    pub by_parameter: [[f64; MOST_PARAMETERS]; D],
    /// The rate, which is the derivative by the span.
    pub rate: [f64; D],
}

/// Follows pieces of orbits of one model, each with its own parameters and start.
///
/// Derivatives by the starts and by the parameters with the indices `wanted` are the dual part of the same
/// run, whose steps obey the tolerance for every tangent too. Runs land on switching surfaces and ignore the wall.
///
/// # Errors
/// That of the first piece that fails.
pub fn pieces<F: Family<D>, const D: usize>(
    family: &F,
    pieces: &[Segment<D>],
    wanted: &[usize],
    tolerance: &Tolerance,
    stop: &CancelFlag,
) -> Result<Vec<SegmentEnd<D>>, Failure> {
    const { assert!(FEW + MOST_PARAMETERS <= DIRECTIONS && MOST_PARAMETERS <= FEW) };
    // A parameter of a derivative stays open even if it is zero.
    let all = |p: usize| pieces.iter().all(|piece| piece.values[p] == 0.0) && !wanted.contains(&p);
    let width = pieces.first().map_or(0, |piece| piece.values.len());
    let known: Vec<_> = (0..width).map(|p| all(p).then_some(0.0)).collect();
    let tape = Tape::record(family, &known).ok();
    let how = (tape.as_ref(), tolerance);
    try_map(pieces.len(), &|i| {
        let piece = &pieces[i];
        if const { D <= FEW } {
            return one::<F, D, DIRECTIONS>(family, piece, (true, wanted), how, stop);
        }
        let with = |by_state, wanted| one::<F, D, D>(family, piece, (by_state, wanted), how, stop);
        if wanted.is_empty() {
            return with(true, &[]);
        }
        let by_parameter = with(false, wanted)?.by_parameter;
        Ok(SegmentEnd { by_parameter, ..with(true, &[])? })
    })
}

/// One piece with derivatives by its start, where asked for, and then by parameters.
fn one<F: Family<D>, const D: usize, const N: usize>(
    family: &F,
    piece: &Segment<D>,
    (by_state, wanted): (bool, &[usize]),
    (tape, tolerance): (Option<&Tape<D>>, &Tolerance),
    stop: &CancelFlag,
) -> Result<SegmentEnd<D>, Failure> {
    let first = if by_state { D } else { 0 };
    let mut values: Vec<Dual<f64, N>> = constants(&piece.values);
    for (i, &p) in wanted.iter().enumerate() {
        values[p] = Dual::variable(piece.values[p], first + i);
    }
    let how = (tape, &values[..], stop);
    if const { D > FEW } {
        // The law, the norm and the methods that are compiled for the exponents of so many states.
        let law = || family.build(&values);
        return flown(law, Dopri5::default(), &WithTangents(*tolerance), piece, first, how);
    }
    // The norm of fits; the law's type is forgotten.
    let system = family.build(&values);
    let law: &dyn AnySystem<Dual<f64, N>, D> = &system;
    let norm = MaybeTangents { tolerance: *tolerance, tangents: true };
    flown(|| law, Dop853::default(), &norm, piece, first, how)
}

/// One piece by the law's power series, or by stages where there is none or it does not serve.
fn flown<M, E, K, const D: usize, const N: usize>(
    law: impl Fn() -> M,
    stages: K,
    norm: &E,
    piece: &Segment<D>,
    first: usize,
    (tape, values, stop): (Option<&Tape<D>>, &[Dual<f64, N>], &CancelFlag),
) -> Result<SegmentEnd<D>, Failure>
where
    M: System<Dual<f64, N>, D>,
    E: ErrorNorm<Dual<f64, N>, D> + Copy,
    K: Method<Dual<f64, N>, D>,
{
    if let Some(tape) = tape {
        let method = Taylor::new(tape, values.to_vec(), order(norm.state()), Isa::best());
        match follow(law(), method, norm, piece, first, stop) {
            Err(failure) if tape.hands_over(&failure) => {}
            flown => return flown,
        }
    }
    follow(law(), stages, norm, piece, first, stop)
}

fn follow<M, E, K, const D: usize, const N: usize>(
    law: M,
    method: K,
    norm: &E,
    piece: &Segment<D>,
    first: usize,
    stop: &CancelFlag,
) -> Result<SegmentEnd<D>, Failure>
where
    M: System<Dual<f64, N>, D>,
    E: ErrorNorm<Dual<f64, N>, D> + Copy,
    K: Method<Dual<f64, N>, D>,
{
    // Where derivatives by the start are asked for, those by parameters come after them.
    let variable =
        |n: usize| if n < first { Dual::variable(piece.x[n], n) } else { Dual::constant(piece.x[n]) };
    let start = vector!(Dual<f64, N>, D; n => variable(n));
    let end = piece.t + piece.span;
    let mut driver = Integrator::by(method, law, piece.t, start, Some(piece.span), norm);
    while driver.t() != end {
        stop.check()?;
        driver.advance(end)?;
        if driver.counts().accepted > MOST_STEPS {
            return Err(Failure::TooManySteps { t: driver.t(), limit: MOST_STEPS });
        }
    }
    let x = driver.x();
    let rate = driver.system().rates(Dual::constant(end), x, driver.sides());
    let mut flown = SegmentEnd {
        x: [0.0; D],
        by_state: [[0.0; D]; D],
        by_parameter: [[0.0; MOST_PARAMETERS]; D],
        rate: [0.0; D],
    };
    for n in 0..D {
        flown.x[n] = x[n].re;
        flown.by_state[n][..first].copy_from_slice(&x[n].d[..first]);
        let left = MOST_PARAMETERS.min(N - first);
        flown.by_parameter[n][..left].copy_from_slice(&x[n].d[first..first + left]);
        flown.rate[n] = rate[n].re;
    }
    Ok(flown)
}
