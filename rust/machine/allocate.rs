//! Registers for listings: values stay in registers as long as these suffice.
//!
//! A listing loads each operand where it needs it, and stores each result. Most of the loads are those of values that were in a
//! register shortly before. All uses are known in advance, so the value whose next use is the furthest gives way
//! (L. A. Belady, IBM Systems Journal 5 (1966) 78). The operations and their order do not change.

use std::collections::{HashMap, HashSet};

use super::listing::{Array, Line, Operand, Operation, Place, Register};

type Value = usize;

/// The result of an operation, or what a place contains.
#[derive(Debug, Default)]
struct Known {
    /// Its place in memory.
    home: Option<Place>,
    /// True if it is there already.
    saved: bool,
    /// How many numbers it has.
    width: usize,
    /// The operations that need it, the last one first.
    uses: Vec<usize>,
    register: Option<usize>,
}

#[derive(Clone, Copy, Debug)]
enum Action {
    /// The operation, its result, the sum that it adds to, and its two operands.
    Apply(Operation, Value, Option<Value>, Option<Value>, Value),
    Store(usize, Place, Value),
    StoreUpper(Place, Value),
    /// A result from a number and another one in memory.
    LoadUpper(Value, Value, Place),
    /// A result from its two halves.
    Join(Value, Value, Value),
    /// A result that is the upper half of a value.
    Part(Value, Value),
}

impl Action {
    fn needs(self) -> [Option<Value>; 3] {
        match self {
            Action::Apply(_, _, sum, a, b) => [sum, a, Some(b)],
            Action::Join(_, a, b) => [Some(a), Some(b), None],
            Action::Store(.., a)
            | Action::StoreUpper(_, a)
            | Action::LoadUpper(_, a, _)
            | Action::Part(_, a) => [Some(a), None, None],
        }
    }
}

/// The same operations with this many registers. A line has a width, the count of numbers that it takes at once. Elements of
/// the work from `results` on are not needed afterwards. `None` if a value is needed after its place has another one.
pub(super) fn allocate(
    lines: &[(usize, Line)],
    registers: usize,
    results: usize,
) -> Option<Vec<(usize, Line)>> {
    let (known, actions) = values(lines, results)?;
    let mut room = Room { known, held: vec![None; registers], lines: Vec::with_capacity(lines.len()) };
    for action in actions {
        room.perform(action);
    }
    Some(room.lines)
}

/// The values of a list of operations and what is done with them.
fn values(lines: &[(usize, Line)], results: usize) -> Option<(Vec<Known>, Vec<Action>)> {
    let (mut known, mut actions) = (Vec::<Known>::new(), Vec::with_capacity(lines.len()));
    let mut in_place = HashMap::<(Place, usize), Value>::new();
    // Values whose places have others from an operation on.
    let mut replaced = Vec::new();
    let mut in_register = [None; 1 << u8::BITS];
    let is_result = |place: Place| place.0 == Array::Stages || place.1 < results;
    // `LoadUpper` always reads memory, so these places must be stored.
    let upper = |&(_, line): &(usize, Line)| match line {
        Line::LoadUpper(_, _, place) => Some(place),
        _ => None,
    };
    let read: HashSet<Place> = lines.iter().filter_map(upper).collect();
    for &(width, line) in lines {
        let mut of = |operand, known: &mut Vec<Known>| match operand {
            Operand::Register(register) => in_register[usize::from(register.0)],
            Operand::Place(place) => Some(*in_place.entry((place, width)).or_insert_with(|| {
                known.push(Known { home: Some(place), saved: true, width, ..Known::default() });
                known.len() - 1
            })),
        };
        let new = |width, known: &mut Vec<Known>| {
            known.push(Known { width, ..Known::default() });
            known.len() - 1
        };
        match line {
            Line::Load(to, from) => {
                let value = of(from, &mut known)?;
                in_register[usize::from(to.0)] = Some(value);
            }
            Line::Apply(operation, to, a, b) => {
                let b = of(b, &mut known)?;
                let a = if operation == Operation::Root { None } else { Some(of(a.into(), &mut known)?) };
                let sum = match operation {
                    Operation::Fused => Some(of(to.into(), &mut known)?),
                    _ => None,
                };
                let result = new(width, &mut known);
                actions.push(Action::Apply(operation, result, sum, a, b));
                in_register[usize::from(to.0)] = Some(result);
            }
            Line::Store(place, from) => {
                let value = of(from.into(), &mut known)?;
                let own = &known[value];
                // A copy of a place is another value, as that place may change; the lowest of several numbers, too. They are
                // read from memory.
                let is_copy = own.width != width || own.saved && own.home != Some(place);
                let stored = if is_copy { new(width, &mut known) } else { value };
                let former = in_place.insert((place, width), stored);
                // A result's place does not change any more, unlike those of others.
                let own = &mut known[stored];
                let is_better = !own.saved && is_result(place) && former.is_none();
                if own.home.is_none() || is_better {
                    own.home = Some(place);
                }
                own.saved |= is_copy;
                if let Some(former) = former
                    && former != stored
                {
                    replaced.push((former, place, actions.len()));
                }
                if is_copy || is_result(place) || read.contains(&place) {
                    actions.push(Action::Store(width, place, value));
                }
            }
            Line::StoreUpper(place, from) => {
                actions.push(Action::StoreUpper(place, of(from.into(), &mut known)?));
                known.push(Known { home: Some(place), saved: true, width: 1, ..Known::default() });
                if let Some(former) = in_place.insert((place, 1), known.len() - 1) {
                    replaced.push((former, place, actions.len()));
                }
            }
            Line::LoadUpper(to, a, place) => {
                let a = of(a.into(), &mut known)?;
                let result = new(2, &mut known);
                actions.push(Action::LoadUpper(result, a, place));
                in_register[usize::from(to.0)] = Some(result);
            }
            Line::Join(to, a, b) => {
                let (a, b) = (of(a.into(), &mut known)?, of(b.into(), &mut known)?);
                let result = new(4, &mut known);
                actions.push(Action::Join(result, a, b));
                in_register[usize::from(to.0)] = Some(result);
            }
            Line::Part(to, a) => {
                let a = of(a.into(), &mut known)?;
                let result = new(2, &mut known);
                actions.push(Action::Part(result, a));
                in_register[usize::from(to.0)] = Some(result);
            }
            Line::End => return None,
        }
    }
    for (i, &action) in actions.iter().enumerate().rev() {
        for value in action.needs().into_iter().flatten() {
            known[value].uses.push(i);
        }
    }
    let is_needed = |&(value, place, from): &(Value, Place, usize)| {
        let own = &known[value];
        own.home == Some(place) && own.uses.first().is_some_and(|&last| last >= from)
    };
    if replaced.iter().any(is_needed) { None } else { Some((known, actions)) }
}

/// The registers and what they contain.
struct Room {
    known: Vec<Known>,
    held: Vec<Option<Value>>,
    lines: Vec<(usize, Line)>,
}

impl Room {
    fn perform(&mut self, action: Action) {
        match action {
            Action::Store(width, place, value) => {
                let own = &self.known[value];
                if !(own.saved && own.home == Some(place)) {
                    let from = self.loaded(value, &[value]);
                    self.lines.push((width, Line::Store(place, name(from))));
                    let own = &mut self.known[value];
                    own.saved |= own.home == Some(place);
                }
                self.used(value);
            }
            Action::StoreUpper(place, value) => {
                let from = self.loaded(value, &[value]);
                self.lines.push((2, Line::StoreUpper(place, name(from))));
                self.used(value);
            }
            Action::LoadUpper(result, a, place) => {
                self.join(result, &[a], |to, from| Line::LoadUpper(to, from[0], place));
            }
            Action::Join(result, a, b) => {
                self.join(result, &[a, b], |to, from| Line::Join(to, from[0], from[1]));
            }
            Action::Part(result, a) => self.join(result, &[a], |to, from| Line::Part(to, from[0])),
            Action::Apply(operation, result, sum, a, b) => self.apply(operation, result, sum, (a, b)),
        }
    }

    /// Makes a value of others, which are in registers.
    fn join(&mut self, result: Value, needed: &[Value], line: impl FnOnce(Register, &[Register]) -> Line) {
        let from: Vec<_> = needed.iter().map(|&value| name(self.loaded(value, needed))).collect();
        needed.iter().for_each(|&value| self.used(value));
        let to = self.free(needed);
        self.lines.push((self.known[result].width, line(name(to), &from)));
        self.put(result, to);
    }

    fn apply(
        &mut self,
        operation: Operation,
        result: Value,
        sum: Option<Value>,
        (mut a, mut b): (Option<Value>, Value),
    ) {
        use Operation::{Add, And, AndNot, Fused, Mul, Or, Xor};
        if let Some(first) = a
            && matches!(operation, Add | Mul | Fused | And | Or | Xor)
            && self.known[first].register.is_none()
            && self.known[b].register.is_some()
        {
            (a, b) = (Some(b), first);
        }
        let mut needed = vec![b];
        needed.extend(sum.into_iter().chain(a));
        let sum_in = sum.map(|sum| self.loaded(sum, &needed));
        let a_in = a.map(|a| self.loaded(a, &needed));
        let width = self.known[result].width;
        // These operations read the bits of two numbers.
        let is_bits = matches!(operation, And | AndNot | Or | Xor);
        let b_in = if !(width == 1 && is_bits) && self.is_left_in_memory(b, &needed) {
            Operand::Place(self.known[b].home.expect("a place"))
        } else {
            name(self.loaded(b, &needed)).into()
        };
        // A sum that is needed again is copied, while its factors are where they are.
        let copied = sum.filter(|&sum| self.known[sum].uses.len() > uses_of(sum, &needed)).map(|_| {
            let to = self.free(&needed);
            self.lines.push((width, Line::Load(name(to), name(sum_in.expect("a sum")).into())));
            to
        });
        needed.iter().for_each(|&value| self.used(value));
        let to = copied.or(sum_in).unwrap_or_else(|| self.free(&needed));
        self.lines.push((width, Line::Apply(operation, name(to), name(a_in.unwrap_or(to)), b_in)));
        self.put(result, to);
        if self.known[result].uses.is_empty() {
            self.drop(result);
        }
    }

    /// Returns true if an operand is taken from memory because no register is worth it.
    fn is_left_in_memory(&self, value: Value, needed: &[Value]) -> bool {
        let own = &self.known[value];
        let is_shared = |place: Place| place.0 == Array::Constants && own.width > 1;
        if own.register.is_some() || !own.saved || own.home.is_none_or(is_shared) {
            return false;
        }
        // The first of these uses is the present one; the second follows it.
        match own.uses.iter().rev().nth(1) {
            None => true,
            Some(&next) => {
                !self.held.contains(&None)
                    && self.furthest(needed).is_none_or(|other| self.next_use(other) <= next)
            }
        }
    }

    fn next_use(&self, value: Value) -> usize {
        self.known[value].uses.last().copied().unwrap_or(usize::MAX)
    }

    /// The value in a register that gives way.
    fn furthest(&self, needed: &[Value]) -> Option<Value> {
        let values = self.held.iter().flatten().copied();
        values
            .filter(|value| !needed.contains(value) && self.known[*value].home.is_some())
            .max_by_key(|&value| self.next_use(value))
    }

    /// A register that is free now.
    fn free(&mut self, needed: &[Value]) -> usize {
        if let Some(register) = self.held.iter().position(Option::is_none) {
            return register;
        }
        let value = self.furthest(needed).expect("more registers than values under way");
        let own = &mut self.known[value];
        let register = own.register.expect("a register");
        if !own.saved {
            own.saved = true;
            self.lines.push((own.width, Line::Store(own.home.expect("a place"), name(register))));
        }
        self.drop(value);
        register
    }

    /// The register of a value, which is loaded if it is in none.
    fn loaded(&mut self, value: Value, needed: &[Value]) -> usize {
        if let Some(register) = self.known[value].register {
            return register;
        }
        let register = self.free(needed);
        let home = self.known[value].home.expect("a value that was given up has a place");
        self.lines.push((self.known[value].width, Line::Load(name(register), home.into())));
        self.put(value, register);
        register
    }

    fn put(&mut self, value: Value, register: usize) {
        self.known[value].register = Some(register);
        self.held[register] = Some(value);
    }

    fn drop(&mut self, value: Value) {
        if let Some(register) = self.known[value].register.take() {
            self.held[register] = None;
        }
    }

    /// Counts a use; a value without another one gives up its register.
    fn used(&mut self, value: Value) {
        self.known[value].uses.pop();
        if self.known[value].uses.is_empty() {
            self.drop(value);
        }
    }
}

/// The number of operands with this value.
fn uses_of(value: Value, operands: &[Value]) -> usize {
    operands.iter().filter(|&&other| other == value).count()
}

fn name(register: usize) -> Register {
    Register(u8::try_from(register).expect("few registers"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A machine that does what a listing says; the work begins behind ten elements of each other array.
    fn run(lines: &[(usize, Line)], registers: usize, work: usize) -> Vec<f64> {
        let mut memory: Vec<f64> = (0..work).map(|i| (i as f64 * 0.7).sin() + 0.1).collect();
        let mut held = vec![f64::NAN; registers];
        for &(_, line) in lines {
            let of = |operand, memory: &[f64], held: &[f64]| match operand {
                Operand::Register(Register(i)) => held[usize::from(i)],
                Operand::Place(Place(Array::Work, at)) => memory[at],
                Operand::Place(Place(_, at)) => 0.3 - at as f64,
            };
            match line {
                Line::Load(to, from) => held[usize::from(to.0)] = of(from, &memory, &held),
                Line::Store(place, from) => memory[place.1] = held[usize::from(from.0)],
                Line::Apply(operation, to, a, b) => {
                    let (a, b) = (held[usize::from(a.0)], of(b, &memory, &held));
                    let to = &mut held[usize::from(to.0)];
                    *to = match operation {
                        Operation::Add => a + b,
                        Operation::Sub => a - b,
                        Operation::Mul => a * b,
                        Operation::Fused => a.mul_add(b, *to),
                        Operation::Root => b.abs().sqrt(),
                        _ => unreachable!("not listed here"),
                    };
                }
                _ => unreachable!("not for packets"),
            }
        }
        memory
    }

    /// A list of operations by four registers: each stores its result, and loads earlier results.
    fn listed(seed: u64, length: usize) -> Vec<(usize, Line)> {
        let mut state = seed;
        let mut below = |n: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % n
        };
        let mut lines: Vec<_> = (0..4).map(|i| Line::Load(name(i), Place(Array::Work, i).into())).collect();
        for i in 10..length {
            let place = |at| Place([Array::Work, Array::Work, Array::Held][at % 3], at).into();
            let to = below(4);
            lines.push(Line::Load(name(below(4)), place(below(i))));
            let b = if below(2) == 0 { place(below(i)) } else { name(below(4)).into() };
            use Operation::{Add, Fused, Mul, Root, Sub};
            lines.push(Line::Apply(
                [Add, Sub, Mul, Fused, Fused, Root][below(6)],
                name(to),
                name(below(4)),
                b,
            ));
            // Powers would overflow.
            lines.push(Line::Apply(Operation::Mul, name(to), name(to), Place(Array::Constants, 0).into()));
            lines.push(Line::Store(Place(Array::Work, i), name(to)));
        }
        lines.into_iter().map(|line| (8, line)).collect()
    }

    /// More values than registers: eight registers lose none of them.
    #[test]
    fn values_in_registers_are_those_in_memory() {
        for seed in 0..60 {
            let (length, results) = (120, [0, 40, 120][seed % 3]);
            let lines = listed(seed as u64, length);
            let allocated = allocate(&lines, 8, results).unwrap();
            let [before, after] = [&lines, &allocated].map(|lines| run(lines, 8, length));
            let bits = |all: &[f64]| all[..results].iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&before), bits(&after), "seed {seed}");
            let loads = |lines: &[(usize, Line)]| {
                lines.iter().filter(|(_, line)| matches!(line, Line::Load(..))).count()
            };
            assert!(loads(&allocated) < loads(&lines));
        }
    }

    /// A place may change if its former value is not needed any more; otherwise the list stays as it is.
    #[test]
    fn a_value_is_not_needed_after_its_place_changed() {
        let (from, place, [a, b]) = (Place(Array::Work, 2), Place(Array::Work, 3), [name(0), name(1)]);
        let add = |to, other: Place| Line::Apply(Operation::Add, to, to, other.into());
        let begin =
            [Line::Load(a, from.into()), add(a, from), Line::Store(place, a), Line::Load(b, place.into())];
        let change = [add(a, from), Line::Store(place, a)];
        let use_former = [add(b, from), Line::Store(Place(Array::Work, 5), b)];
        let allocated = |lines: [&[Line]; 3]| {
            let lines: Vec<_> = lines.concat().into_iter().map(|line| (8, line)).collect();
            allocate(&lines, 16, 9).map(|allocated| [lines, allocated].map(|lines| run(&lines, 16, 10)))
        };
        let [before, after] = allocated([&begin, &use_former, &change]).unwrap();
        assert_eq!(before, after);
        assert!(allocated([&begin, &change, &use_former]).is_none());
    }
}
