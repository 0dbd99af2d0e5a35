//! One run, sampled.

use super::stiffness::{Look, Stiffness};
use crate::integrate::{Counts, Driver, Ending, Failure, Method, Tolerance};
use crate::model::System;
use crate::observe::{Event, Record, Samples};
use crate::run::Stop;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// At the last time asked for.
    Finished,
    /// On the wall: the disk left the wheels.
    Ejected,
    /// Cut where the law switched without end.
    Chattering,
}

impl Outcome {
    /// Its name in Python.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Finished => "finished",
            Outcome::Ejected => "ejected",
            Outcome::Chattering => "chattering",
        }
    }
}

/// At which times the state is wanted.
#[derive(Clone, Copy, Debug)]
pub enum Output<'a> {
    /// At these times; they increase, and the first is the time of the initial state.
    At(&'a [f64]),
    /// From the first time to the second, after every accepted step.
    Steps(f64, f64),
}

/// A run that has ended.
#[derive(Clone, Debug)]
pub struct Run<const D: usize> {
    pub t: Vec<f64>,
    pub x: Vec<[f64; D]>,
    /// All events, in order.
    pub events: Vec<Event<D>>,
    pub outcome: Outcome,
    pub counts: Counts,
    /// The polynomials of all steps, if asked for.
    pub record: Option<Record<D>>,
}

/// Runs the system from `x0` by this method, ending on its wall where it has one. A run that ends there,
/// or where it chatters, is cut: that point is the last one. Where asked for, it is watched for being stiff.
pub fn trajectory<M: System<f64, D>, K: Method<f64, D>, const D: usize>(
    system: M,
    method: K,
    output: Output<'_>,
    x0: [f64; D],
    tolerance: &Tolerance,
    keep: bool,
    (stop, stiffness): (&Stop, Option<&Stiffness>),
) -> Result<Run<D>, Failure> {
    let (times, start, end) = match output {
        Output::At(times) => match times {
            [] => (times, 0.0, 0.0),
            [first, .., last] => (times, *first, *last),
            [only] => (times, *only, *only),
        },
        Output::Steps(start, end) => (&[][..], start, end),
    };
    let mut samples = Samples::new(times, x0);
    let mut steps = (vec![start], vec![x0]);
    let mut events = Vec::new();
    let mut record = keep.then(|| Record::new(start, x0));
    let mut outcome = Outcome::Finished;

    let mut driver = Driver::by(method, system, start, x0, None, tolerance).with_wall();
    let mut look = Look::new();
    while driver.t() < end {
        stop.check()?;
        let ending = match driver.advance(end) {
            Err(Failure::Chattering { .. }) => {
                outcome = Outcome::Chattering;
                Ending::Free
            }
            ending => ending?,
        };
        if let Some(stiffness) = stiffness {
            look.at(&driver, stiffness)?;
        }
        if times.is_empty() {
            // Two events can share a time.
            if driver.t() > steps.0[steps.0.len() - 1] {
                steps.0.push(driver.t());
                steps.1.push(*driver.x());
            }
        } else {
            samples.take(&driver);
        }
        if let Some(record) = &mut record {
            record.push(&driver);
        }
        events.extend(Event::seen(ending, &driver));
        if ending == Ending::Wall {
            outcome = Outcome::Ejected;
        }
        if outcome != Outcome::Finished {
            break;
        }
    }

    let (mut t, mut x) = steps;
    if !times.is_empty() {
        t = times[..samples.x.len()].to_vec();
        x = samples.x;
        if outcome != Outcome::Finished && t.last().is_none_or(|&last| last < driver.t()) {
            t.push(driver.t());
            x.push(*driver.x());
        }
    }
    Ok(Run { t, x, events, outcome, counts: driver.counts(), record })
}
