"""The matrices of a graph, for a law's `check`: what its theorem assumes and what it predicts.

Places are m, by number. A check returns problems, notes, and predicted rates in 1/s by name.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from flockwire_core.control.convergence import laplacian
from flockwire_core.control.graph import Graph
from flockwire_core.law import Vector
from numpy.typing import NDArray

Array = NDArray[np.float64]
Checked = tuple[list[str], list[str], dict[str, float]]
Places = Mapping[int, Vector]
NONE = 1e-9  # an eigenvalue that counts as 0, against the largest

NO_TREE = "graph.edges: a directed spanning tree is missing: not every follower hears, over others, the same root"
ALONE = "drones: one without a leader has nobody to agree with: add a drone"
NOT_SYMMETRIC = "graph.edges: must be symmetric, w_ij = w_ji"
FEW_LEADERS = "leaders: at least {} are needed, there are {}"


def block(graph: Graph) -> Array:
    """Return L_ff, the followers' block."""
    return laplacian(graph)[len(graph.leaders) :, len(graph.leaders) :]


def feed_forward(graph: Graph) -> float:
    """Return the spectral radius of M, m_ij = w_ij / sum_j w_ij among followers: what is fed on settles below 1."""
    matrix = block(graph)
    degree = np.diag(matrix).copy()
    if not np.all(degree):
        return float("inf")
    return float(np.abs(np.linalg.eigvals(np.eye(len(matrix)) - matrix / degree[:, None])).max())


def modes(graph: Graph) -> NDArray[np.complex128]:
    """Return the eigenvalues of L_ff, or without a leader those of L but one 0, by their real parts."""
    values = np.linalg.eigvals(block(graph)).astype(complex)
    values = values[np.argsort(values.real)]
    return values if graph.leaders else values[1:]


def asymmetric(graph: Graph) -> list[str]:
    """Return the problem of a graph without w_ij = w_ji among followers."""
    matrix = block(graph)
    return [] if np.allclose(matrix, matrix.T) else [NOT_SYMMETRIC]


def tree(graph: Graph) -> list[str]:
    """Return the problem of a graph without a spanning tree."""
    values = modes(graph)
    if not len(values):
        return [ALONE]
    return [NO_TREE] if values[0].real <= NONE * np.abs(values).max() else []


def led(graph: Graph, least: int) -> list[str]:
    """Return the problem of too few leaders."""
    found = len(graph.leaders)
    return [FEW_LEADERS.format(least, found)] if found < least else []


def pairs(graph: Graph) -> list[tuple[int, int]]:
    """Return each pair of neighbours once."""
    return sorted({(min(i, j), max(i, j)) for i, j, _ in graph.edges})


def bearing_laplacian(graph: Graph, places: Places, weighted: bool) -> Array:
    """Return the bearing Laplacian, blocks −P(g_ij) (by 1/|p_j − p_i| if `weighted`); followers first, then leaders."""
    numbers = [*graph.followers, *graph.leaders]
    matrix = np.zeros((3 * len(numbers), 3 * len(numbers)))
    for i, j in pairs(graph):
        line = np.subtract(places[j], places[i])
        length = np.linalg.norm(line)
        part = (np.eye(3) - np.outer(line, line) / length**2) / (length if weighted else 1.0)
        a, b = 3 * numbers.index(i), 3 * numbers.index(j)
        for row, column, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
            matrix[row : row + 3, column : column + 3] += sign * part
    return matrix


def rigidity_matrix(graph: Graph, places: Places, dimension: int) -> Array:
    """Return R, a row for each pair: (p_i − p_j)' at i and its negative at j."""
    known, numbers = pairs(graph), list(graph.followers)
    matrix = np.zeros((len(known), dimension * len(numbers)))
    for row, (i, j) in enumerate(known):
        line = np.subtract(places[i], places[j])[:dimension]
        a, b = dimension * numbers.index(i), dimension * numbers.index(j)
        matrix[row, a : a + dimension], matrix[row, b : b + dimension] = line, -line
    return matrix
