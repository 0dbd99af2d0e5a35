//! Operations on registers, to be encoded.

use std::collections::HashMap;

use super::allocate::allocate;
use crate::scalar::Isa;

/// A register, by its number below 16; AVX-512 has 32. Lists whose registers are [allocated](Listing::allocate) name any
/// number of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register(pub u8);

/// An array that code reads, or writes if it is `Work` or `Stages`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Array {
    Work,
    /// The rates at the stages of a step.
    Stages,
    Held,
    /// All bits of a number are set if the side is the upper one.
    Sides,
    /// Numbers that all lanes share.
    Constants,
}

/// An element of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Place(pub Array, pub usize);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operand {
    Register(Register),
    Place(Place),
}

impl From<Register> for Operand {
    fn from(register: Register) -> Self {
        Self::Register(register)
    }
}

impl From<Place> for Operand {
    fn from(place: Place) -> Self {
        Self::Place(place)
    }
}

/// An operation on two numbers, or on the second of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    Add,
    Sub,
    Mul,
    Div,
    /// The result's former value plus the product, rounded once.
    Fused,
    /// The square root of the second number.
    Root,
    And,
    /// The bits of the second number that the first lacks.
    AndNot,
    Or,
    Xor,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Line {
    Load(Register, Operand),
    Store(Place, Register),
    Apply(Operation, Register, Register, Operand),
    /// The lower number of the second register, and a number from memory as the upper one.
    LoadUpper(Register, Register, Place),
    /// Stores the upper of two numbers.
    StoreUpper(Place, Register),
    /// The two lower numbers of both registers.
    Join(Register, Register, Register),
    /// The two upper ones of four numbers.
    Part(Register, Register),
    End,
}

/// Functions as lists of operations.
#[derive(Debug)]
pub struct Listing {
    /// Operations, each with the numbers that it takes at once.
    pub(super) lines: Vec<(usize, Line)>,
    pub(super) isa: Isa,
    /// How many numbers the next operations take at once.
    width: usize,
    /// How many numbers an element of an array has.
    pub(super) lanes: usize,
    /// How many of them a function takes.
    pub(super) step: usize,
    pub(super) constants: Vec<f64>,
    places: HashMap<u64, usize>,
    /// The length that each array but the constants needs, in elements.
    pub(super) extents: [usize; 4],
}

impl Listing {
    /// An empty list for numbers of so many lanes, a multiple of the numbers in a register.
    pub fn new(isa: Isa, lanes: usize) -> Self {
        let isa = isa.max(Isa::Avx2);
        let width = match isa {
            _ if lanes == 1 => 1,
            Isa::Avx512 => 8,
            _ => 4,
        };
        assert!(lanes.is_multiple_of(width), "{lanes} lanes in registers of {width}");
        let (lines, constants, places) = Default::default();
        Self { lines, isa, width, step: width, lanes, constants, places, extents: [0; 4] }
    }

    /// How many operations there are.
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// The place of a constant.
    pub fn constant(&mut self, value: f64) -> Place {
        let at = *self.places.entry(value.to_bits()).or_insert_with(|| {
            self.constants.push(value);
            self.constants.len() - 1
        });
        Place(Array::Constants, at)
    }

    /// Loads a number, or copies a register.
    pub fn load(&mut self, to: Register, from: impl Into<Operand>) {
        let from = self.checked(from.into());
        if from != Operand::Register(to) {
            self.push(Line::Load(to, from));
        }
    }

    /// Stores a number in the array `Work` or `Stages`.
    pub fn store(&mut self, place: Place, from: Register) {
        assert!(matches!(place.0, Array::Work | Array::Stages), "other arrays are not written");
        self.checked(place.into());
        self.push(Line::Store(place, from));
    }

    /// `to = a . b`; constants for several numbers at once have to be loaded first.
    pub fn apply(&mut self, operation: Operation, to: Register, a: Register, b: impl Into<Operand>) {
        let b = self.checked(b.into());
        let is_constant = matches!(b, Operand::Place(Place(Array::Constants, _)));
        assert!(!is_constant || self.width == 1, "a constant is not loaded");
        self.push(Line::Apply(operation, to, a, b));
    }

    /// Returns true if an element of an array is one number.
    pub fn is_single(&self) -> bool {
        self.lanes == 1
    }

    /// How many elements the next operations take.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Lets the next operations take so many elements at once: 1, 2 or 4.
    pub fn set_width(&mut self, width: usize) {
        assert!(self.lanes == 1 && [1, 2, 4].contains(&width), "packets have one width");
        self.width = width;
    }

    /// Loads two or four elements side by side.
    pub fn gather(&mut self, to: Register, other: Register, places: &[Place]) {
        for (to, pair) in [to, other].into_iter().zip(places.chunks(2)) {
            self.set_width(1);
            self.load(to, pair[0]);
            self.checked(pair[1].into());
            self.push(Line::LoadUpper(to, to, pair[1]));
        }
        if places.len() > 2 {
            self.push(Line::Join(to, to, other));
        }
        self.set_width(places.len());
    }

    /// Stores two or four numbers. Several numbers for one place are equal.
    pub fn scatter(&mut self, places: &[Place], from: Register, other: Register) {
        for (i, &place) in places.iter().enumerate() {
            if i == 2 {
                self.push(Line::Part(other, from));
            }
            if places[..i].contains(&place) {
                continue;
            }
            let half = if i < 2 { from } else { other };
            self.set_width(1);
            if i.is_multiple_of(2) {
                self.store(place, half);
            } else {
                self.checked(place.into());
                self.push(Line::StoreUpper(place, half));
            }
        }
        self.set_width(places.len());
    }

    /// Ends a function.
    pub fn end(&mut self) {
        self.push(Line::End);
    }

    /// Lets operations find their operands in registers. Elements of the work from `results` on are not needed after a
    /// function, unlike all stages. Returns false if a value is needed after its place has another one.
    #[must_use]
    pub fn allocate(&mut self, results: usize) -> bool {
        let registers = if self.isa == Isa::Avx512 && self.lanes > 1 { 32 } else { 16 };
        let mut lines = Vec::with_capacity(self.lines.len());
        for function in self.lines.split_inclusive(|line| line.1 == Line::End) {
            let (body, end) = function.split_at(function.len() - 1);
            let Some(body) = allocate(body, registers, results) else { return false };
            lines.extend(body.iter().chain(end));
        }
        self.lines = lines;
        true
    }

    fn push(&mut self, line: Line) {
        self.lines.push((self.width, line));
    }

    /// The same operand, of which the arrays' lengths are taken.
    fn checked(&mut self, operand: Operand) -> Operand {
        if let Operand::Place(Place(array, at)) = operand
            && let Some(extent) = self.extents.get_mut(array as usize)
        {
            *extent = (*extent).max(at + self.width.div_ceil(self.lanes));
        }
        operand
    }
}
