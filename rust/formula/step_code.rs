//! Machine code for whole Runge-Kutta steps of a law.
//!
//! The rates of a short law take less time than the call that evaluates them. Here the stages of a step and the sums between
//! them are one function. It has the operations of the method's own step in the same order, so no bit changes.

use super::Leaf;
use super::compile::{Compiled, FIRST, INTERPRETED, SECOND, Writer};
use super::program::Program;
use crate::machine::{Array, Listing, Operation, Place};
use crate::scalar::{Isa, Scalar};
use crate::sides::Sides;

/// The weights of a method's stages: stage `i` is the rate at `t + c_i h` and `x + h Σ_j a_ij k_j`.
#[derive(Clone, Copy, Debug)]
pub struct StageWeights {
    /// Distinguishes the methods: 0 or 1.
    pub number: usize,
    /// How many stages make a step: the argument of the last of them is the new state.
    pub stages: usize,
    pub c: &'static [f64],
    /// Row by row, as many columns as rows.
    pub a: &'static [f64],
}

/// The start of a step and its size.
#[derive(Clone, Copy, Debug)]
pub struct StepFrom<'a, S> {
    pub t: S,
    pub x: &'a [S],
    pub h: S,
}

/// The most operations: longer code is not in the cache when it is needed.
const MOST_LINES: usize = 1 << 12;

/// The places of the values of a step: the work begins with the new state, and ends with the program's registers.
struct Layout {
    states: usize,
    t: usize,
    h: usize,
    registers: usize,
}

impl Layout {
    fn of(states: usize) -> Self {
        let t = 2 * states;
        Self { states, t, h: t + 1, registers: t + 2 }
    }

    fn end(n: usize) -> Place {
        work(n)
    }

    fn x(&self, n: usize) -> Place {
        work(self.states + n)
    }

    fn stage(&self, i: usize, n: usize) -> Place {
        Place(Array::Stages, i * self.states + n)
    }
}

fn work(at: usize) -> Place {
    Place(Array::Work, at)
}

impl Program {
    /// Computes the rates at all stages of a step but the first, which is given, and the new state. Returns false if there is
    /// no code for it. A program has as many results as there are states; `fixed` is as for [`run`](Program::run).
    #[inline]
    pub fn run_step<S: Scalar>(
        &self,
        weights: &StageWeights,
        from: StepFrom<'_, S>,
        fixed: &[S],
        sides: &Sides<S>,
        stages: &mut [S],
        new: &mut [S],
    ) -> bool {
        let make = |lanes| if lanes == 1 { self.step_code(weights) } else { None };
        let Some(code) = self.step_codes.get::<S>(weights.number, INTERPRETED, make) else { return false };
        let Layout { states, t, h, registers } = Layout::of(new.len());
        let mut run = |work: &mut [S]| {
            if code.is_interrupted() {
                work[registers..][..fixed.len()].copy_from_slice(fixed);
            }
            // In loops: a call of a few numbers' copy takes longer, and so does reading numbers together that were written
            // one by one.
            for (x, &start) in work[states..t].iter_mut().zip(from.x) {
                *x = start;
            }
            (work[t], work[h]) = (from.t, from.h);
            code.follow(self, fixed, sides, (&mut *work, &mut *stages));
            for (new, &end) in new.iter_mut().zip(&work[..states]) {
                *new = end;
            }
        };
        // Arrays on the stack save an allocation in each step.
        match registers + fixed.len() {
            0..=32 => run(&mut [S::zero(); 32]),
            33..=96 => run(&mut [S::zero(); 96]),
            97..=192 => run(&mut [S::zero(); 192]),
            193..=384 => run(&mut [S::zero(); 384]),
            more => run(&mut vec![S::zero(); more]),
        }
        true
    }

    fn step_code(&self, weights: &StageWeights) -> Option<Compiled> {
        let leaves = &self.leaves[..self.leaves.len() - self.constants];
        if leaves.iter().any(|leaf| *leaf != Leaf::Time) {
            return None;
        }
        let (count, states) = (weights.c.len(), self.len());
        let layout = Layout::of(states);
        let mut held = vec![false; self.room()];
        held[self.states + leaves.len()..self.states + self.leaves.len()].fill(true);
        for step in &self.first {
            held[usize::from(step.to)] = true;
        }
        let mut writer = Writer::new(Listing::new(Isa::best(), 1), held, layout.registers);
        for i in 1..count {
            let weights_of_stage = &weights.a[i * count..i * count + i];
            let is_last = i + 1 == weights.stages;
            for n in 0..states {
                let new = Layout::end(n);
                if n < self.states {
                    let argument = work(layout.registers + n);
                    writer.argument(&layout, weights_of_stage, n, argument);
                    if is_last {
                        writer.copy(argument, new);
                    }
                } else if is_last {
                    writer.argument(&layout, weights_of_stage, n, new);
                }
            }
            for at in (self.states..).take(leaves.len()) {
                writer.time(&layout, weights.c[i], work(layout.registers + at));
            }
            writer.steps(&self.steps);
            for (n, &result) in self.results.iter().enumerate() {
                let rate = writer.place(result);
                writer.copy(rate, layout.stage(i, n));
            }
            if writer.list.len() > MOST_LINES {
                return None;
            }
        }
        writer.compiled(states)
    }
}

impl Writer {
    /// Writes `x + h Σ_j a_j k_j` in component `n`, without the zero weights after the first.
    fn argument(&mut self, layout: &Layout, weights: &[f64], n: usize, to: Place) {
        for (j, &weight) in weights.iter().enumerate() {
            if j > 0 && weight == 0.0 {
                continue;
            }
            let term = if j == 0 { FIRST } else { SECOND };
            let weight = self.list.constant(weight);
            self.list.load(term, weight);
            self.list.apply(Operation::Mul, term, term, layout.stage(j, n));
            if j > 0 {
                self.list.apply(Operation::Add, FIRST, FIRST, SECOND);
            }
        }
        self.list.apply(Operation::Mul, FIRST, FIRST, work(layout.h));
        self.write(to, Operation::Add, FIRST, layout.x(n).into());
    }

    /// Writes the time of a stage.
    fn time(&mut self, layout: &Layout, part: f64, to: Place) {
        let part = self.list.constant(part);
        self.list.load(FIRST, part);
        self.list.apply(Operation::Mul, FIRST, FIRST, work(layout.h));
        self.write(to, Operation::Add, FIRST, work(layout.t).into());
    }
}
