//! One run, sampled.

use crate::analysis::Stop;
use crate::analysis::batch::step_budget::StepBudget;
use crate::analysis::stiffness::{Look, Stiffness};
use crate::integrate::{Counts, Ending, Failure, Integrator, Method, Steps, Tolerance};
use crate::memory;
use crate::model::System;
use crate::observe::{Event, Record, Samples};

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
    /// From the first time to the second, after every accepted step; along a power series at so many places of each.
    Steps(f64, f64, usize),
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
    watched: (&dyn Stop, Option<&Stiffness>),
) -> Result<Run<D>, Failure> {
    let start = match output {
        Output::At(times) => times.first().copied().unwrap_or(0.0),
        Output::Steps(start, ..) => start,
    };
    let mut run = Integrator::by(method, system, start, x0, None, tolerance).with_wall();
    sampled(&mut run, output, keep, watched)
}

/// Samples a run, from where it stands.
fn sampled<const D: usize>(
    run: &mut dyn Steps<D>,
    output: Output<'_>,
    keep: bool,
    (stop, stiffness): (&dyn Stop, Option<&Stiffness>),
) -> Result<Run<D>, Failure> {
    let (start, x0) = (run.t(), *run.x());
    let (times, end, places) = match output {
        Output::At(times) => (times, times.last().copied().unwrap_or(start), 1),
        Output::Steps(_, end, places) => (&[][..], end, if run.is_series() { places } else { 1 }),
    };
    let mut samples = Samples::new(times, x0);
    let mut steps = (vec![start], vec![x0]);
    let mut events = Vec::new();
    let mut record = keep.then(|| Record::new(start, x0));
    let outcome = follow(run, end, (stop, stiffness), &mut |run, ending| {
        let mut wanted = EACH;
        if times.is_empty() {
            // Two events can share a time.
            if run.t() > steps.0[steps.0.len() - 1] {
                if !(memory::grow(&mut steps.0, places) && memory::grow(&mut steps.1, places)) {
                    return Err(no_room(steps.0.len() * size_of::<[f64; D]>(), run.t(), (start, end)));
                }
                for k in 1..places {
                    let dt = run.size() * (k as f64 / places as f64);
                    let t = run.from() + dt;
                    if steps.0[steps.0.len() - 1] < t && t < run.t() {
                        steps.0.push(t);
                        steps.1.push(run.dense(dt));
                    }
                }
                steps.0.push(run.t());
                steps.1.push(*run.x());
            }
        } else {
            wanted = samples.take(run);
        }
        if let Some(record) = &mut record {
            if !record.grow() {
                return Err(no_room(record.bytes(), run.t(), (start, end)));
            }
            record.push(run);
            wanted = EACH;
        }
        events.extend(Event::seen(ending, run));
        Ok(wanted)
    })?;

    let (mut t, mut x) = steps;
    if !times.is_empty() {
        t = times[..samples.x.len()].to_vec();
        x = samples.x;
        if outcome != Outcome::Finished && t.last().is_none_or(|&last| last < run.t()) {
            t.push(run.t());
            x.push(*run.x());
        }
    }
    Ok(Run { t, x, events, outcome, counts: run.counts(), record })
}

/// Estimates the whole run's bytes from `kept` bytes at time `t`.
fn no_room(kept: usize, t: f64, (start, end): (f64, f64)) -> Failure {
    let kept = kept as f64;
    Failure::NoRoom { end, bytes: kept * (end - start) / (t - start), kept }
}

/// The step budget is looked at after so many rounds of a few steps each.
const ROUNDS: u64 = 256;
/// The time wanted of who looks at each step.
const EACH: f64 = f64::NEG_INFINITY;

/// Follows a run to `end`; where asked for, it is watched for being stiff. `see` is shown every step that does not end
/// freely or reaches the time that it wanted when it was last shown one; maybe more.
pub(in crate::analysis) fn follow<const D: usize>(
    run: &mut dyn Steps<D>,
    end: f64,
    (stop, stiffness): (&dyn Stop, Option<&Stiffness>),
    see: &mut dyn FnMut(&dyn Steps<D>, Ending) -> Result<f64, Failure>,
) -> Result<Outcome, Failure> {
    let mut look = Look::new();
    let mut wanted = EACH;
    let mut budget = StepBudget::new(0, run.t(), end);
    let mut round = 0_u64;
    while run.t() < end {
        stop.check()?;
        round += 1;
        if round.is_multiple_of(ROUNDS) && budget.exceeded(run.counts().accepted, run.t()) {
            return Err(Failure::EverShorter { t: run.t() });
        }
        let (ending, outcome) = match run.advance(end, wanted) {
            Err(Failure::Chattering { .. }) => (Ending::Free, Some(Outcome::Chattering)),
            Ok(Ending::Wall) => (Ending::Wall, Some(Outcome::Ejected)),
            ending => (ending?, None),
        };
        if let Some(stiffness) = stiffness {
            look.at(run, stiffness)?;
        }
        wanted = see(run, ending)?;
        if let Some(outcome) = outcome {
            return Ok(outcome);
        }
    }
    Ok(Outcome::Finished)
}
