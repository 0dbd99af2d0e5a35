"""Structured orthogonal factorization: the equations of multiple shooting, condensed to those of one node."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .flow_map import Floats

__all__ = ["CyclicEquations"]


@dataclass(frozen=True, eq=False)
class CyclicEquations:
    """Derivatives of the gaps between the pieces of a closed orbit, and of its phase.

    The unknowns are m nodes of r components each and two numbers. Piece i brings the rows
    ``pieces[i] x[i] - after x[i + 1] + by_pair[i] (p, q)``, where node m is
    node 0, and there is one more row.

    Attributes
    ----------
    pieces : ndarray, shape (m, r, r)
    after : float
    by_pair : ndarray, shape (m, r, 2)
    phase : ndarray, shape (m, r)
        The last row: of the nodes' components,
    last : ndarray, shape (2,)
        and of the two numbers.
    """

    pieces: Floats
    after: float
    by_pair: Floats
    phase: Floats
    last: Floats

    def toarray(self) -> Floats:
        """Return the matrix (m r + 1, m r + 2)."""
        m, r, _ = self.pieces.shape
        dense = np.zeros((m, r, m, r))
        each = np.arange(m)
        dense[each, :, each] += self.pieces
        dense[each, :, (each + 1) % m] -= self.after * np.eye(r)
        matrix = np.zeros((m * r + 1, m * r + 2))
        matrix[:-1, :-2] = dense.reshape(m * r, m * r)
        matrix[:-1, -2:] = self.by_pair.reshape(m * r, 2)
        matrix[-1, :-2], matrix[-1, -2:] = self.phase.ravel(), self.last
        return matrix

    def solve(self, row: Floats, right: Floats) -> Floats:
        """Solve for these right sides (m r + 2,), of which the last belongs to one more `row`.

        Two neighbouring pieces become one by an orthogonal transformation that frees the node between them,
        and so on (S. J. Wright, SIAM J. Sci. Stat. Comput. 13 (1992) 742): stable where orbits are not, in a
        time that is proportional to the number of pieces.
        """
        m, r, _ = self.pieces.shape
        # Each piece says: begin x[i] + end x[i + 1] + rest (p, q, -1) = 0.
        begin, end = self.pieces, np.broadcast_to(-self.after * np.eye(r), (m, r, r))
        rest = np.concatenate([self.by_pair, right[: m * r].reshape(m, r, 1)], axis=2)
        node = np.arange(m + 1)  # where pieces begin, and where the last one ends
        freed = []
        while len(begin) > 1:
            pairs = len(begin) // 2
            first, second = slice(0, 2 * pairs, 2), slice(1, 2 * pairs, 2)
            middle = np.concatenate([end[first], begin[second]], axis=1)
            q, t = np.linalg.qr(middle, mode="complete")
            turn = np.swapaxes(q, 1, 2)
            ends = np.zeros((pairs, 2 * r, 2 * r + 3))
            ends[:, :r, :r], ends[:, r:, r : 2 * r] = begin[first], end[second]
            ends[:, :r, 2 * r :], ends[:, r:, 2 * r :] = rest[first], rest[second]
            ends = turn @ ends
            freed.append((node[: 2 * pairs + 1], t[:, :r], ends[:, :r]))
            left = slice(2 * pairs, None)
            begin = np.concatenate([ends[:, r:, :r], begin[left]])
            end = np.concatenate([ends[:, r:, r : 2 * r], end[left]])
            rest = np.concatenate([ends[:, r:, 2 * r :], rest[left]])
            node = np.append(node[: 2 * pairs : 2], node[2 * pairs :])
        # Every node as a linear function of the first one and of (p, q, -1); the last node is the first.
        x = np.zeros((m + 1, r, r + 3))
        x[0, :, :r] = x[m, :, :r] = np.eye(r)
        for where, t, ends in reversed(freed):
            known = np.concatenate([x[where[:-1:2]], x[where[2::2]]], axis=1)
            right_sides = ends[:, :, : 2 * r] @ known
            right_sides[:, :, r:] += ends[:, :, 2 * r :]
            x[where[1::2]] = -np.linalg.solve(t, right_sides)
        small = np.zeros((r + 2, r + 3))
        small[:r, :r], small[:r, r:] = begin[0] + end[0], rest[0]
        each = x[:m].reshape(m * r, r + 3)
        small[r], small[r + 1] = self.phase.ravel() @ each, row[:-2] @ each
        small[r:, r : r + 2] += self.last, row[-2:]
        small[r:, r + 2] += right[-2:]
        few = np.linalg.solve(small[:, :-1], small[:, -1])
        nodes = x[:m] @ np.append(few, -1.0)
        return np.append(nodes.ravel(), few[r:])
