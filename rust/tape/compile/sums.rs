//! Sums of products of series, begun several orders ahead.
//!
//! A processor loads two numbers in the time of two products, and a term of a sum needs two. So the sums of a few orders are
//! begun together, from the coefficients that are known before the first of them: each is loaded once for all. Each
//! sum has its terms in the order of [`series`](crate::tape::series).

use std::ops::RangeInclusive;

use super::{C, MOST, ODD, Series};
use crate::machine::{Array, Operation, Place, Register};
use crate::tape::fuse::{First, Program};

/// The registers of sums that are begun together, the even and the odd one of each order.
const SUMS: [[Register; 2]; TOGETHER] =
    [[Register(16), Register(17)], [Register(18), Register(19)], [Register(20), Register(21)]];

/// The orders whose sums are begun together. More of them need more registers.
const TOGETHER: usize = 3;

/// How many numbers the series and their sums take in addition to the slots, for single trajectories and for packets.
pub(in crate::tape) fn numbers(program: &Program, room: usize, is_single: bool) -> usize {
    let long = |first| first != First::Series;
    let stretches = &program.stretches;
    let chains = stretches.iter().flat_map(|s| &s.chains).filter(|chain| long(chain.first)).count();
    let steps = stretches.iter().filter(|s| s.last.is_some_and(|step| step.factors().is_some())).count();
    let sums = 2 * TOGETHER * (chains + steps);
    if is_single { program.plan.numbers(room) + MOST * sums } else { sums }
}

impl Series {
    /// [`inner`](crate::tape::series::inner) in `c`; returns false if it is empty.
    pub(super) fn inner(&mut self, a: u16, b: u16) -> bool {
        let (k, begin) = (self.k, self.first_of_sums());
        let (mut even, mut odd) = self.sum_ahead(a, Some(b));
        if k.is_multiple_of(2) && k / 2 >= begin {
            even = self.with(C, even, (a, k / 2), (b, k / 2));
        }
        for j in (1..=((k - 1) / 2).min(k - begin)).rev() {
            even = self.with(C, even, (a, j), (b, k - j));
            odd = self.with(ODD, odd, (a, k - j), (b, j));
        }
        if odd {
            self.apply(Operation::Add, ODD);
        }
        even
    }

    /// [`inner_square`](crate::tape::series::inner_square) in `c`; returns false if it is empty.
    pub(super) fn inner_square(&mut self, a: u16) -> bool {
        let (k, begin) = (self.k, self.first_of_sums());
        let (mut any, _) = self.sum_ahead(a, None);
        for j in (1..=((k - 1) / 2).min(k - begin)).rev() {
            any = self.with(C, any, (a, j), (a, k - j));
        }
        if any {
            self.apply(Operation::Add, C);
        }
        if k.is_multiple_of(2) {
            any = self.with(C, any, (a, k / 2), (a, k / 2));
        }
        any
    }

    /// The first of the orders whose sums are begun together.
    fn first_of_sums(&self) -> usize {
        self.k - (self.k - 1) % TOGETHER
    }

    /// Loads the begun sums of a product into `c` and the odd one; those of a square if there is no second factor. Returns
    /// true for each that exists.
    fn sum_ahead(&mut self, a: u16, b: Option<u16>) -> (bool, bool) {
        let (k, product) = (self.k, self.product);
        self.product += 1;
        if k == self.first_of_sums() {
            self.begin_sums(product, a, b);
        }
        let any = self.begun(k, b.is_some());
        for odd in (0..2).filter(|&odd| any[odd]) {
            let place = self.in_advance(product, odd, k);
            self.list.load([C, ODD][odd], place);
        }
        any.into()
    }

    /// Begins the sums of several orders together: a coefficient is loaded once for all of them.
    fn begin_sums(&mut self, product: usize, a: u16, b: Option<u16>) {
        let (begin, other) = (self.k, b.unwrap_or(a));
        let orders = begin..(begin + TOGETHER).min(self.end);
        for m in orders.clone() {
            if b.is_some() && self.is_middle_begun(m) {
                self.with(SUMS[m - begin][0], false, (a, m / 2), (other, m / 2));
            }
        }
        // From the middle outwards.
        for step in 0..begin {
            for m in orders.clone() {
                let j = ((m - 1) / 2).checked_sub(step).filter(|j| self.pairs_begun(m).contains(j));
                let Some(j) = j else { continue };
                let [even, odd] = SUMS[m - begin];
                let any = step > 0 || b.is_some() && self.is_middle_begun(m);
                self.with(even, any, (a, j), (other, m - j));
                if b.is_some() {
                    self.with(odd, step > 0, (a, m - j), (other, j));
                }
            }
        }
        for m in orders {
            let any = self.begun(m, b.is_some());
            for odd in (0..2).filter(|&odd| any[odd]) {
                let place = self.in_advance(product, odd, m);
                self.list.store(place, SUMS[m - begin][odd]);
            }
        }
    }

    /// Returns true for each of the two sums of order `m` if terms of it are begun. A square has one sum, without its middle.
    fn begun(&self, m: usize, is_product: bool) -> [bool; 2] {
        let any = !self.pairs_begun(m).is_empty();
        [any || is_product && self.is_middle_begun(m), any && is_product]
    }

    /// The lower indices of the pairs of order `m` that are known before the first of the orders.
    fn pairs_begun(&self, m: usize) -> RangeInclusive<usize> {
        m + 1 - self.first_of_sums()..=(m - 1) / 2
    }

    fn is_middle_begun(&self, m: usize) -> bool {
        m.is_multiple_of(2) && m / 2 < self.first_of_sums()
    }

    /// The place of a sum that is begun; the next orders have the same places.
    fn in_advance(&self, product: usize, odd: usize, m: usize) -> Place {
        let each = if self.list.is_single() { MOST } else { 1 };
        Place(Array::Work, self.ahead + each * ((2 * product + odd) * TOGETHER + m % TOGETHER))
    }
}
