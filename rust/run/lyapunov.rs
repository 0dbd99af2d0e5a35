//! The largest Lyapunov exponent.

use std::array::from_fn;

use crate::integrate::{Driver, Ending, Failure, Tolerance, WithTangents};
use crate::model::System;
use crate::run::Stop;
use crate::scalar::Dual;

/// How an exponent is estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LyapunovOptions {
    /// The time to run at most, the transient included.
    pub time: f64,
    /// The time at the start that is left out in any case.
    pub transient: f64,
    /// The run ends when the standard error is down to this.
    pub goal: f64,
    /// The accuracy of the run.
    pub tolerance: Tolerance,
}

/// A time average with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponent {
    pub value: f64,
    /// The standard error, from the scatter of block means.
    pub standard_error: f64,
    /// The time averaged over.
    pub time: f64,
    /// Whether the standard error met the goal.
    pub converged: bool,
}

/// The largest exponent of the orbit from `x0`, the mean growth rate of a tangent vector.
///
/// The tangent is the derivative part of a dual run, as accurate as the state. It is scaled back to
/// length 1 at the end of every block; the blocks' growth rates give the mean and, from their scatter,
/// its standard error. Where the first half of the blocks disagrees with the second by more than chance
/// allows, the run was still on its way to the attractor and the first half is dropped. Blocks are merged
/// in pairs as the run goes on, so memory stays bounded.
pub fn largest_exponent<M: System<Dual<f64, 1>, D>, const D: usize>(
    system: &M,
    x0: [f64; D],
    options: &LyapunovOptions,
    stop: &Stop,
) -> Result<Exponent, Failure> {
    // A direction that no symmetry singles out.
    let direction: [f64; D] = from_fn(|n| [1.0, -0.7, 0.5, 0.3][n % 4]);
    let start = from_fn(|n| Dual { re: x0[n], d: [direction[n]] });
    let norm = WithTangents(options.tolerance);
    let mut driver: Driver<_, _, D, _> = Driver::new(system, 0.0, start, None, &norm).with_wall();
    let mut blocks = Blocks::new((options.time - options.transient) / (8 * Blocks::MOST) as f64);
    rescale(&mut driver);

    let mut discarding = options.transient > 0.0;
    let mut growth = 0.0;
    let mut since = 0.0;
    loop {
        let end = if discarding { options.transient } else { options.time };
        while driver.t() < end {
            stop.check()?;
            if driver.advance(end)? == Ending::Wall {
                return Err(Failure::LeftDomain { t: driver.t() });
            }
            let span = driver.t() - since;
            let size = length(driver.x());
            // The tangent must neither over- nor underflow within a block.
            let full = span >= blocks.span;
            if full || !(1e-100..1e100).contains(&size) {
                growth += rescale(&mut driver);
            }
            if full && !discarding {
                blocks.push(growth, span);
                (growth, since) = (0.0, driver.t());
                if let Some(exponent) = blocks.estimate()
                    && exponent.standard_error <= options.goal
                {
                    return Ok(Exponent { converged: true, ..exponent });
                }
            }
        }
        if !discarding {
            break;
        }
        discarding = false;
        rescale(&mut driver);
        (growth, since) = (0.0, driver.t());
    }
    Ok(blocks.whole())
}

fn length<const D: usize>(x: &[Dual<f64, 1>; D]) -> f64 {
    x.iter().map(|v| v.d[0] * v.d[0]).sum::<f64>().sqrt()
}

/// Scales the tangent to length 1; returns the logarithm of the length it had.
fn rescale<M: System<Dual<f64, 1>, D>, const D: usize>(
    driver: &mut Driver<M, Dual<f64, 1>, D, WithTangents>,
) -> f64 {
    let size = length(driver.x());
    driver.set_state(true, driver.x().map(|v| Dual { re: v.re, d: [v.d[0] / size] }));
    size.ln()
}

/// Growth of the tangent over consecutive pieces of the run.
struct Blocks {
    /// The least time that a block covers.
    span: f64,
    /// Growth and time of each block.
    list: Vec<(f64, f64)>,
}

impl Blocks {
    /// With more than this many blocks neighbours are merged.
    const MOST: usize = 256;
    /// With fewer there is no telling the scatter.
    const LEAST: usize = 32;

    fn new(span: f64) -> Self {
        Self { span, list: Vec::with_capacity(Self::MOST) }
    }

    fn push(&mut self, growth: f64, time: f64) {
        self.list.push((growth, time));
        if self.list.len() == Self::MOST {
            self.list = merged(&self.list);
            self.span *= 2.0;
        }
    }

    /// Mean and standard error, looked at only where the number of blocks makes it worth while.
    fn estimate(&mut self) -> Option<Exponent> {
        let n = self.list.len();
        if n < Self::LEAST || !n.is_multiple_of(16) {
            return None;
        }
        let (first, second) = self.list.split_at(n / 2);
        let ((a, a_error), (b, b_error)) = (mean(first), mean(second));
        // Four standard errors: chance does that once in ten thousand looks.
        if (a - b).abs() > 4.0 * a_error.hypot(b_error) {
            self.list.drain(..n / 2);
            return None;
        }
        Some(self.whole())
    }

    fn whole(&self) -> Exponent {
        let time = self.list.iter().map(|b| b.1).sum();
        let growth: f64 = self.list.iter().map(|b| b.0).sum();
        let standard_error = mean(&self.list).1;
        Exponent { value: growth / time, standard_error, time, converged: false }
    }
}

fn merged(list: &[(f64, f64)]) -> Vec<(f64, f64)> {
    list.chunks_exact(2).map(|pair| (pair[0].0 + pair[1].0, pair[0].1 + pair[1].1)).collect()
}

/// Mean rate and its standard error, from the scatter of blocks as long as can be: merged while 32
/// remain. Neighbouring short blocks are correlated, long ones hardly.
fn mean(list: &[(f64, f64)]) -> (f64, f64) {
    let mut level = list.to_vec();
    while level.len() >= 2 * Blocks::LEAST {
        level = merged(&level);
    }
    let n = level.len() as f64;
    let rates = level.iter().map(|(growth, time)| growth / time);
    let mean = rates.clone().sum::<f64>() / n;
    let variance = rates.map(|rate| (rate - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let (growth, time) = list.iter().fold((0.0, 0.0), |(g, t), b| (g + b.0, t + b.1));
    (growth / time, (variance / n).sqrt())
}
