//! Equal operations of several equations, side by side in one register.
//!
//! A single trajectory fills one lane of a register. If several equations have the same operation, such as the squares of a
//! chain of oscillators, their series are stored side by side as a row, and one instruction serves them all. Each lane
//! has the operations of the equation by itself, so no bit changes.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::fuse::{Chain, First, Program};
use super::node::{Node, Step};

/// The series of a row.
pub(super) const MOST: usize = 4;

/// An operation on slots, or on rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Work {
    Chain(Chain),
    Step(Step),
}

/// Part of the work of each order.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Task {
    Single(Work),
    /// Loads the coefficients of a row's series.
    Gather(usize),
    /// The work on rows of so many lanes, and the rows whose coefficients are stored as single numbers, too.
    Group(Vec<Work>, usize, Vec<(usize, bool)>),
}

/// Slots whose series are side by side.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    pub(super) slots: Vec<u16>,
    /// Operations on rows compute it; otherwise it is gathered for each order.
    pub(super) computed: bool,
}

/// The tasks of each order in their sequence.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Plan {
    pub(super) tasks: Vec<Task>,
    pub(super) rows: Vec<Row>,
    /// Held values side by side, from left to right.
    pub(super) held: Vec<Vec<u16>>,
}

impl Work {
    /// The same with other operands and other held values; its result stays.
    fn map(self, slot: &mut dyn FnMut(u16) -> u16, held: &mut dyn FnMut(u16) -> u16) -> Self {
        match self {
            Work::Chain(chain) => Work::Chain(chain.map(slot, held)),
            Work::Step(Step { node, to }) => Work::Step(Step { node: node.map(slot, held), to }),
        }
    }

    fn to(self) -> u16 {
        match self {
            Work::Chain(chain) => chain.to,
            Work::Step(step) => step.to,
        }
    }

    fn with_result(self, to: u16) -> Self {
        match self {
            Work::Chain(chain) => Work::Chain(Chain { to, ..chain }),
            Work::Step(step) => Work::Step(Step { to, ..step }),
        }
    }

    fn is_rate(self) -> bool {
        matches!(self, Work::Chain(Chain { is_rate: true, .. }))
    }

    /// How many series it fills.
    fn results(self) -> usize {
        match self {
            Work::Chain(_) => 1,
            Work::Step(step) => step.node.slots(),
        }
    }

    /// Returns true if one instruction for several of them pays: they have products of series.
    fn is_long(self) -> bool {
        match self {
            Work::Chain(chain) => chain.first != First::Series,
            Work::Step(step) => step.factors().is_some(),
        }
    }

    /// The same for every operation that differs in its series and held values alone.
    fn kind(self) -> Self {
        self.map(&mut |_| 0, &mut |_| 0).with_result(0)
    }

    fn operands(self) -> Vec<u16> {
        let mut operands = Vec::new();
        self.map(
            &mut |slot| {
                operands.push(slot);
                slot
            },
            &mut |h| h,
        );
        operands
    }
}

/// Operations that belong together, such as a sine and its cosine.
type Bundle = Vec<Work>;

fn operands(bundle: &Bundle) -> Vec<u16> {
    // The later ones use the results of the first.
    bundle[0].operands()
}

/// Rows that operations need.
#[derive(Default)]
struct Wanted {
    rows: Vec<Vec<u16>>,
    known: HashSet<Vec<u16>>,
}

impl Wanted {
    /// The operations of a level in groups of the same kind, at most [`MOST`] in each, as they are wanted.
    fn side_by_side(&mut self, level: Vec<Bundle>) -> Vec<Vec<Bundle>> {
        let mut kinds: Vec<(Vec<Work>, Vec<Bundle>)> = Vec::new();
        for bundle in level {
            let kind: Vec<Work> = bundle.iter().map(|work| work.kind()).collect();
            match kinds.iter_mut().find(|(other, _)| *other == kind) {
                Some((_, bundles)) => bundles.push(bundle),
                None => kinds.push((kind, vec![bundle])),
            }
        }
        let mut groups = Vec::new();
        for (_, bundles) in kinds {
            let mut by_result: BTreeMap<u16, Bundle> =
                bundles.into_iter().map(|bundle| (bundle[0].to(), bundle)).collect();
            for row in &self.rows {
                if row.iter().all(|slot| by_result.contains_key(slot)) {
                    groups.push(row.iter().filter_map(|slot| by_result.remove(slot)).collect());
                }
            }
            let rest: Vec<Bundle> = by_result.into_values().collect();
            groups.extend(rest.chunks(MOST).map(<[Bundle]>::to_vec));
        }
        for group in groups.iter().filter(|group: &&Vec<Bundle>| group.len() > 1) {
            for i in 0..operands(&group[0]).len() {
                let row: Vec<u16> = group.iter().map(|bundle| operands(bundle)[i]).collect();
                let is_row = row.iter().collect::<HashSet<_>>().len() == row.len();
                if is_row && self.known.insert(row.clone()) {
                    self.rows.push(row);
                }
            }
        }
        groups
    }
}

impl Plan {
    /// How many numbers the rows take, with room for so many coefficients, and the held values behind them.
    pub(super) fn numbers(&self, room: usize) -> usize {
        MOST * (self.rows.len() * room + self.held.len())
    }

    pub(super) fn of(program: &Program) -> Self {
        let mut bundles: Vec<Bundle> = Vec::new();
        for stretch in &program.stretches {
            bundles.extend(stretch.chains.iter().map(|&chain| vec![Work::Chain(chain)]));
            match stretch.last {
                Some(step @ Step { node: Node::Cos(_) | Node::CosOfTime(_) | Node::Slope(_), .. }) => {
                    bundles.last_mut().expect("the sine").push(Work::Step(step));
                }
                Some(step) => bundles.push(vec![Work::Step(step)]),
                None => {}
            }
        }
        bundles.extend(program.copied.iter().map(|&(slot, n)| vec![Work::Chain(Chain::copy(slot, n))]));
        // Operations of one level do not depend on each other, and nothing of the same order on rates. Rates that are
        // series come last.
        let mut levels = HashMap::new();
        let mut by_level: Vec<Vec<Bundle>> = Vec::new();
        let (mut rates, mut copies) = (Vec::new(), Vec::new());
        for bundle in bundles {
            let first = bundle[0];
            if first.is_rate() {
                if first.is_long() { &mut rates } else { &mut copies }.push(bundle);
                continue;
            }
            let level =
                operands(&bundle).iter().filter_map(|slot| levels.get(slot)).max().map_or(0, |l| l + 1);
            for slot in (first.to()..).take(first.results()) {
                levels.insert(slot, level);
            }
            by_level.resize_with(by_level.len().max(level + 1), Vec::new);
            by_level[level].push(bundle);
        }
        let (linear, copies) = copies.into_iter().partition::<Vec<_>, _>(|bundle| operands(bundle).len() > 1);
        rates.extend(linear);
        by_level.push(rates);
        // From the last level on, so that operations are side by side in the order in which others need them.
        let mut wanted = Wanted::default();
        let mut levels: Vec<_> = by_level.into_iter().rev().map(|level| wanted.side_by_side(level)).collect();
        levels.reverse();
        levels.push(wanted.side_by_side(copies));
        let mut plan = Plan::default();
        levels.iter().flatten().for_each(|bundles| plan.add(bundles));
        plan.finish()
    }

    /// The row of these slots.
    fn row(&self, slots: &[u16]) -> Option<usize> {
        self.rows.iter().position(|row| row.slots == slots)
    }

    fn add(&mut self, bundles: &[Bundle]) {
        let lanes = if bundles.len() == 3 { 4 } else { bundles.len() };
        // A lane that is not needed repeats the first.
        let lane = |l: usize| &bundles[if l < bundles.len() { l } else { 0 }];
        let side_by_side = |of: &dyn Fn(&Bundle) -> u16| (0..lanes).map(|l| of(lane(l))).collect::<Vec<_>>();
        let tuples: Vec<Vec<u16>> =
            (0..operands(lane(0)).len()).map(|i| side_by_side(&|bundle| operands(bundle)[i])).collect();
        let first = bundles[0][0];
        let new = tuples.iter().enumerate();
        let new = new.filter(|(i, slots)| self.row(slots).is_none() && !tuples[..*i].contains(slots)).count();
        // Instructions: each operation has some. Each lane of a row needs two to be loaded and one to be stored.
        let pays = match first {
            _ if first.is_long() => true,
            Work::Chain(chain) => {
                let each = 4 + 3 * usize::from(chain.count) / 2;
                bundles.len() * each > each + lanes * (2 * new + 1)
            }
            Work::Step(_) => false,
        };
        if lanes == 1 || !pays {
            let all = bundles.iter().flatten();
            return self.tasks.extend(all.map(|&work| Task::Single(work)));
        }
        let mut rows = Vec::new();
        for slots in tuples {
            let row = self.row(&slots).unwrap_or_else(|| {
                self.rows.push(Row { slots, computed: false });
                self.tasks.push(Task::Gather(self.rows.len() - 1));
                self.rows.len() - 1
            });
            rows.push(number(row));
        }
        let result = side_by_side(&|bundle| bundle[0].to());
        let to = match self.row(&result) {
            Some(row) if first.is_rate() => {
                self.rows[row].computed = true;
                row
            }
            _ => {
                let to = self.rows.len();
                for i in 0..first.results() {
                    let slots = result.iter().map(|slot| slot + number(i)).collect();
                    self.rows.push(Row { slots, computed: true });
                }
                to
            }
        };
        let mut works = Vec::new();
        for (i, work) in bundles[0].iter().enumerate() {
            // The later ones have its first row as operand.
            let (mut next, mut h) = (rows.iter(), 0);
            let to_row = number(to) + (work.to() - first.to());
            let mut held = |_| {
                let values = side_by_side(&|bundle| held_values(bundle[i])[h]);
                h += 1;
                let known = self.held.iter().position(|other| *other == values);
                number(known.unwrap_or_else(|| {
                    self.held.push(values);
                    self.held.len() - 1
                }))
            };
            let mut slot =
                |_| if i == 0 { *next.next().expect("a row for each operand") } else { number(to) };
            works.push(work.map(&mut slot, &mut held).with_result(to_row));
        }
        let scattered = (to..to + first.results()).map(|row| (row, first.is_rate())).collect();
        self.tasks.push(Task::Group(works, lanes, scattered));
    }

    /// Drops what nothing needs.
    fn finish(mut self) -> Self {
        let Self { tasks, rows, .. } = &mut self;
        tasks.retain(|task| !matches!(task, Task::Gather(row) if rows[*row].computed));
        let mut needed: Vec<u16> =
            rows.iter().filter(|row| !row.computed).flat_map(|row| row.slots.clone()).collect();
        for task in tasks.iter() {
            if let Task::Single(work) = task {
                needed.extend(work.operands());
            }
        }
        for task in tasks.iter_mut() {
            if let Task::Group(_, _, scattered) = task {
                // The state's series are the result.
                scattered.retain(|&(row, is_rate)| {
                    is_rate || rows[row].slots.iter().any(|slot| needed.contains(slot))
                });
            }
        }
        self
    }
}

fn number(i: usize) -> u16 {
    u16::try_from(i).expect("fewer rows than slots")
}

fn held_values(work: Work) -> Vec<u16> {
    let mut values = Vec::new();
    work.map(&mut |slot| slot, &mut |h| {
        values.push(h);
        h
    });
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::FormulaFamily;
    use crate::tape::Tape;

    /// In a chain of oscillators the series of four speeds are side by side, and so are the places, which others need.
    #[test]
    fn operations_are_side_by_side_as_they_are_needed() {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let states = ["x1", "v1", "x2", "v2", "x3", "v3", "x4", "v4", "x5", "v5", "x6", "v6"];
        let force = |i: usize, pull: &str| format!("-x{i}^3 - d*v{i} + k*({pull} - 2*x{i})");
        let pulls = ["x2", "x1 + x3", "x2 + x4", "x3 + x5", "x4 + x6", "x5"];
        let mut texts: Vec<String> = Vec::new();
        for (i, pull) in (1..).zip(pulls) {
            texts.extend([format!("v{i}"), force(i, pull)]);
        }
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        let family = FormulaFamily::<12>::parse(&names(&states), &texts, &names(&["d", "k"]), &[]).unwrap();
        let tape = Tape::record(&family, &[]).unwrap();
        let plan = &tape.program.plan;
        let rate = |task: &Task| match task {
            Task::Group(_, 4, scattered) => {
                scattered.iter().find(|(_, is_rate)| *is_rate).map(|&(row, _)| row)
            }
            _ => None,
        };
        let rates: Vec<_> = plan.tasks.iter().filter_map(rate).collect();
        let slots: Vec<&[u16]> = rates.iter().map(|&row| &plan.rows[row].slots[..]).collect();
        assert_eq!(slots, [[1, 3, 5, 7], [0, 2, 4, 6]]);
        // These rows are computed, and never gathered.
        assert!(!plan.tasks.iter().any(|task| matches!(task, Task::Gather(row) if rates.contains(row))));
    }
}
