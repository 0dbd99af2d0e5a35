//! Tapes whose series are written out, for speed.

use super::{Node, Step, Tape};

/// The predefined tape that a tape equals, if any, and the places of the values that it holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Specialised {
    Not,
    Dle { damped: bool, held: Held },
    Disk(Held),
}

/// For each value that a known tape holds, the number of the same one in another tape.
pub(super) type Held = [u16; 9];

impl Specialised {
    pub(super) fn of<const D: usize>(tape: &Tape<D>) -> Self {
        if let Some(held) = held_as_in(tape, DLE, DLE_RATES) {
            Specialised::Dle { damped: false, held }
        } else if let Some(held) = held_as_in(tape, DAMPED_DLE, DAMPED_DLE_RATES) {
            Specialised::Dle { damped: true, held }
        } else if let Some(held) = held_as_in(tape, DISK, DISK_RATES) {
            Specialised::Disk(held)
        } else {
            Specialised::Not
        }
    }
}

/// The places of a tape's constants if its steps are these, apart from the numbers of the constants.
fn held_as_in<const D: usize>(tape: &Tape<D>, steps: &[Step], rates: &[u16]) -> Option<Held> {
    if tape.rates != *rates || tape.steps.len() != steps.len() {
        return None;
    }
    let mut held = [u16::MAX; 9];
    for (own, wanted) in tape.steps.iter().zip(steps) {
        let ((own_node, own_held), (node, place)) = (own.node.parted(), wanted.node.parted());
        if own.to != wanted.to || own_node != node {
            return None;
        }
        if let (Some(own), Some(place)) = (own_held, place) {
            let known = &mut held[usize::from(place)];
            if *known != u16::MAX && *known != own {
                return None;
            }
            *known = own;
        }
    }
    Some(held)
}

impl Node {
    /// The operation without the number of what it takes from the held values, and that number.
    fn parted(self) -> (Self, Option<u16>) {
        match self {
            Node::Hold(h) => (Node::Hold(0), Some(h)),
            Node::Plus(a, h) => (Node::Plus(a, 0), Some(h)),
            Node::Minus(a, h) => (Node::Minus(a, 0), Some(h)),
            Node::Scale(a, h) => (Node::Scale(a, 0), Some(h)),
            Node::From(h, a) => (Node::From(0, a), Some(h)),
            Node::Over(h, a) => (Node::Over(0, a), Some(h)),
            node => (node, None),
        }
    }
}

/// The diffusionless Lorenz equations. Their [series](super::dle_series) is written out.
const DLE: &[Step] = &[
    Step { node: Node::Sub(1, 0), to: 3 },
    Step { node: Node::Mul(0, 2), to: 4 },
    Step { node: Node::Mul(0, 1), to: 5 },
    Step { node: Node::From(0, 5), to: 6 },
];
const DLE_RATES: &[u16] = &[3, 4, 6];

/// And with damping.
const DAMPED_DLE: &[Step] = &[
    DLE[0],
    DLE[1],
    DLE[2],
    DLE[3],
    Step { node: Node::Scale(2, 2), to: 7 },
    Step { node: Node::Sub(6, 7), to: 8 },
];
const DAMPED_DLE_RATES: &[u16] = &[3, 4, 8];

/// The disk without effects, as recorded. Its [series](super::disk_series) is written out.
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
