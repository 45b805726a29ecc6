"""Lemma 3: whether, and by when, the distributed observer (8) finds the leader on a given graph."""

from dataclasses import dataclass
from functools import lru_cache
from math import inf

import numpy as np
from numpy.typing import NDArray

from flockwire_core.control.graph import Graph

Matrix = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Convergence:
    """The result of Lemma 3 for one graph and one set of observer gains.

    `lambda_min` is the smallest eigenvalue of Lhat, `gamma` has one entry per follower in the order of
    `graph.followers`, `margin` is theta in m/s (fixed-time convergence is proven iff positive),
    `settling_time_bound` is the bound on T_observer in s (inf without a proof; loose with one) and `smallest_gain` the
    mu in m/s above which theta > 0: 2 varpi / lambda_min(Lhat). That is inf when lambda_min <= 0: no gain makes Lemma 3
    apply (as with a follower that has many out-neighbours; the observer may still converge, without proof).
    """

    lambda_min: float
    gamma: tuple[float, ...]
    margin: float
    settling_time_bound: float
    smallest_gain: float


def laplacian(graph: Graph) -> Matrix:
    """Return L = D − W with D = diag(sum_j w_ij), shape (N, N): the leaders' rows and columns, then the followers'."""
    index = {node: row for row, node in enumerate((*graph.leaders, *graph.followers))}
    matrix = np.zeros((len(index), len(index)))
    for source, target, weight in graph.edges:
        matrix[index[target], index[source]] -= weight
        matrix[index[target], index[target]] += weight
    return matrix


@lru_cache(maxsize=1)  # a graph of 1000 takes a second, and is used several times
def convergence(graph: Graph, observer_gain: float, observer_exponent: float, leader_input_bound: float) -> Convergence:
    """Evaluate Lemma 3 for the observer (8).

        gamma_i = 1 / (L_FF^−1 1)_i,   Lhat = Gamma L_FF + L_FF^T Gamma,   varpi = ||Gamma diag(Y)|| u0_max,  Y_i = a_i0
        theta = 1/2 mu lambda_min(Lhat) − varpi
        T_observer <= (p+1) / (k1 (p−1)) + 1/k2
        k1 = (N−1) theta (2 (N−1) gamma_max)^(−2p/(p+1)),   k2 = theta / 2

    `observer_gain` is mu (m/s), `observer_exponent` p > 1, `leader_input_bound` u0_max in m/s **per axis**: the
    observer works on each axis separately, so the bound is on |u0_x|, |u0_y|, |u0_z|, not on the leader's speed. Raises
    ValueError when a follower has no path from the leader (Assumption 2).

    The norm is Frobenius', that is |Gamma Y|: as the Cauchy-Schwarz step of the proof needs. The induced norm is equal
    when one follower receives from the leader and smaller, hence less safe, otherwise.
    """
    if not graph.followers:
        raise ValueError("followers = (): Lemma 3 needs at least one follower")
    if unreachable := graph.unreachable():
        raise ValueError(f"followers {unreachable} have no path from the leader: Assumption 2 needs a spanning tree")
    full = laplacian(graph)
    follower_block, leader_weight = full[1:, 1:], -full[1:, 0]
    gamma = 1.0 / np.linalg.solve(follower_block, np.ones(len(follower_block)))
    weighted = gamma[:, None] * follower_block
    lambda_min = float(np.linalg.eigvalsh(weighted + weighted.T)[0])
    leader_gain = float(np.linalg.norm(gamma * leader_weight))
    theta, bound = 0.5 * observer_gain * lambda_min - leader_gain * leader_input_bound, inf
    if theta > 0:
        p, count = observer_exponent, len(gamma)
        k1 = count * theta * (2 * count * float(gamma.max())) ** (-2 * p / (p + 1))
        bound = (p + 1) / (k1 * (p - 1)) + 2 / theta
    smallest = 2.0 * leader_gain * leader_input_bound / lambda_min if lambda_min > 0 else inf
    return Convergence(lambda_min, tuple(gamma.tolist()), theta, bound, smallest)
