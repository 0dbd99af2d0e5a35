//! Tapes that the compiler knows: their series are computed by programs of their own, for speed.

use super::{Node, Step, Tape};

/// Whether a tape is one of the known ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    Not,
    Dle,
    Disk,
}

impl Known {
    pub(super) fn of<const D: usize>(tape: &Tape<D>) -> Self {
        let is = |steps: &[Step], rates: &[u16]| tape.steps == steps && tape.rates == *rates;
        if is(Dle::STEPS, Dle::RATES) {
            Known::Dle
        } else if is(DISK, DISK_RATES) {
            Known::Disk
        } else {
            Known::Not
        }
    }
}

/// Known tapes hold no more values than this.
pub(super) const MOST_HELD: usize = 8;

/// A tape as constants; see [`Tape`] for what they mean.
pub(super) trait Program {
    const STEPS: &'static [Step];
    const RATES: &'static [u16];
    const SLOTS: usize;
}

/// The diffusionless Lorenz equations without damping.
pub(super) struct Dle;

impl Program for Dle {
    const STEPS: &'static [Step] = &[
        Step { node: Node::Sub(1, 0), to: 3 },
        Step { node: Node::Mul(0, 2), to: 4 },
        Step { node: Node::Mul(0, 1), to: 5 },
        Step { node: Node::From(0, 5), to: 6 },
    ];
    const RATES: &'static [u16] = &[3, 4, 6];
    const SLOTS: usize = 7;
}

/// The disk without effects, as recorded. Its [series](super::disk) is written out.
const DISK: &[Step] = &[
    // g Y - k Omega, where k = k1 - k2 |Omega| or k0
    Step { node: Node::Scale(1, 0), to: 4 },
    Step { node: Node::Neg(0), to: 5 },
    Step { node: Node::Select(0, 0, 5), to: 6 },
    Step { node: Node::Scale(6, 2), to: 7 },
    Step { node: Node::From(1, 7), to: 8 },
    Step { node: Node::Hold(3), to: 9 },
    Step { node: Node::Select(1, 8, 9), to: 10 },
    Step { node: Node::Mul(0, 10), to: 11 },
    Step { node: Node::Sub(4, 11), to: 12 },
    // - W Z Omega
    Step { node: Node::Mul(0, 2), to: 13 },
    Step { node: Node::Scale(13, 4), to: 14 },
    Step { node: Node::Sub(12, 14), to: 15 },
    // over the moment of inertia
    Step { node: Node::Square(1), to: 16 },
    Step { node: Node::Plus(16, 8), to: 17 },
    Step { node: Node::Square(2), to: 18 },
    Step { node: Node::Add(17, 18), to: 19 },
    Step { node: Node::Div(15, 19), to: 20 },
    // W - Y Omega
    Step { node: Node::Mul(0, 1), to: 22 },
    Step { node: Node::From(4, 22), to: 23 },
];
const DISK_RATES: &[u16] = &[20, 13, 23, 0];
