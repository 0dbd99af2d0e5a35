//! Rows of a single trajectory: series of several equations side by side.

use super::{C, HALF, Series};
use crate::machine::{Array, Place};
use crate::tape::group::{MOST, Plan, Task, Work};

impl Series {
    /// Fills the rows with the coefficients that are known before the first order.
    pub(super) fn begin(&mut self, plan: &Plan, components: usize) {
        for (i, values) in plan.held.iter().enumerate() {
            let places: Vec<_> = values.iter().map(|&h| Place(Array::Held, usize::from(h))).collect();
            self.list.gather(C, HALF, &places);
            self.list.store(Place(Array::Work, self.held + MOST * i), C);
        }
        for (i, row) in plan.rows.iter().enumerate() {
            // The state is known to order 1.
            let is_state = row.slots.iter().all(|&slot| usize::from(slot) < components);
            for k in 0..=usize::from(row.computed && is_state) {
                self.k = k;
                self.gather(i, &row.slots);
            }
        }
    }

    pub(super) fn task(&mut self, plan: &Plan, task: &Task) {
        match task {
            Task::Single(work) => {
                self.list.set_width(1);
                self.work(*work);
            }
            Task::Gather(row) => self.gather(*row, &plan.rows[*row].slots),
            Task::Group(works, lanes, scattered) => {
                self.list.set_width(*lanes);
                self.in_rows = true;
                works.iter().for_each(|&work| self.work(work));
                self.in_rows = false;
                for &(row, is_rate) in scattered {
                    let k = self.k + usize::from(is_rate);
                    let places = self.places(&plan.rows[row].slots, k);
                    self.list.load(C, self.in_row(row, k));
                    self.list.scatter(&places, C, HALF);
                }
            }
        }
    }

    fn work(&mut self, work: Work) {
        match work {
            Work::Chain(chain) => self.chain(&chain),
            Work::Step(step) => self.step(step),
        }
    }

    fn gather(&mut self, row: usize, slots: &[u16]) {
        let places = self.places(slots, self.k);
        self.list.gather(C, HALF, &places);
        self.list.store(self.in_row(row, self.k), C);
    }

    fn places(&self, slots: &[u16], k: usize) -> Vec<Place> {
        slots.iter().map(|&slot| Place(Array::Work, usize::from(slot) * self.room + k)).collect()
    }

    pub(super) fn in_row(&self, row: usize, k: usize) -> Place {
        Place(Array::Work, self.rows + MOST * (row * self.room + k))
    }
}
