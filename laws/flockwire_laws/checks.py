"""The laws' checks: whether the graph and the places are what a law's theorem assumes, and the rates that it predicts.

Each is the method `check(graph, places, parameters)` of a law's class, which is its first argument; places are h_i in m
at time 0, by number. It returns problems, notes, and rates in 1/s by name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np
from flockwire_core.control.convergence import laplacian
from flockwire_core.control.graph import Graph
from flockwire_core.law import Output

from flockwire_laws import spectrum
from flockwire_laws.spectrum import Checked, Places

Given = Mapping[str, object]
Law = Any  # a law's class

DAMPING = "control.parameters: kv^2 / kp = {:.4g} must be above {:.4g} on this graph, or it diverges"
SHORT = "control.parameters: the law needs {:.3g} m around, beyond its radius of {:g} m"
NOT_BEARING_RIGID = (
    "graph.edges: not bearing rigid, add edges: the null space of the bearing Laplacian{} must be {}, is {}"
)
FLEXIBLE = "graph.edges: not infinitesimally rigid: needs rank {}, has {}; add edges, or move places off a line"
NOT_POSITIVE = "graph.edges: the followers' block must be positive definite, its least eigenvalue is {:.3g}; add edges"
UNBALANCED = "graph.edges: the stresses at drone {} must balance at the places, their sum is {:.3g} m: compute them"
DIVERGES = "feed-forward: its spectral radius is {:.4g}, must be below 1: commands that are fed on grow"
SETTLES = "feed-forward: its spectral radius is {:.4g}: errors of what is fed on count {:.3g} fold"
NOT_STOCHASTIC = (
    "graph.edges: weights into a drone sum up to {:.3g}, must be below 1: Metropolis, 1 / (1 + larger degree)"
)
TOO_LARGE = "control.parameters.sigma = {:g}: must be below 1"
TOO_FAST = "control.parameters.alpha = {:g}: must be below lambda_2 = {:.3g} 1/s of this graph"
TOO_LONG = "control.parameters.alpha = {:g}: a round has the spectral radius {:.3g}, must be below 1: lower alpha"
COINCIDE = "formation: the places of drones {} and {} coincide, and have no bearing: move one"
AVERAGES = "control.rate_hz above {:.3g} keeps each step an average"
NO_WALLS = "without control.parameters.arena only the safety filter keeps the flock inside limits.fence"
TOO_NEAR = "formation: the places of drones {} and {} are {:.3g} m apart, below r_min = {:g}: neither gets there"
UNHEARD = "{} of {} pairs of drones do not hear of each other's plans: only the safety filter keeps these apart"
NEAR = "all at last within {:.3g} m of the average (norm over all drones)"


def consensus(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check for a spanning tree; the rate is k min Re lambda."""
    gain, problems = law.Parameters.of(parameters).gain, spectrum.tree(graph)
    notes = [AVERAGES.format(gain * float(np.diag(laplacian(graph)).max()))]
    return problems, notes, {} if problems else {"slowest": gain * float(spectrum.modes(graph)[0].real)}


def second_order(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check for a spanning tree and kv^2/kp > b^2/(a |lambda|^2)."""
    gains, problems = law.Parameters.of(parameters), spectrum.tree(graph)
    if problems:
        return problems, [], {}
    values = np.ones(1, complex) if law.fed else spectrum.modes(graph)
    least = float(max(values.imag**2 / (values.real * np.abs(values) ** 2)))
    problems = [] if gains.kv**2 / gains.kp > least else [DAMPING.format(gains.kv**2 / gains.kp, least)]
    return problems, [], {"slowest": min(_slowest(gains.kp * value, gains.kv * value) for value in values)}


def flocking(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check the radius; the rate is that of the centre."""
    gains = law.Parameters.of(parameters)
    problems = _short(law, 1.2 * gains.distance * gains.scale)
    return problems, [], {"centre": _slowest(gains.c1, gains.c2)}


def vasarhelyi(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Note a radius within which repulsion or friction begin, and that nothing keeps the flock inside."""
    c = law.Parameters.of(parameters)
    notes = _short(law, c.length * max(c.rep[0], c.frict[0]))
    return [], notes + ([] if c.arena else [NO_WALLS]), {}


def dmpc(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check that places are r_min apart in the plane; note who is not avoided."""
    least, pairs = law.Parameters.of(parameters).r_min, list(combinations(sorted(places), 2))
    edges = {(j, i) for j, i, _ in graph.edges}
    heard = {pair: math.dist(*(places[i][:2] for i in pair)) for pair in pairs if {pair, pair[::-1]} <= edges}
    notes = [UNHEARD.format(len(pairs) - len(heard), len(pairs))] if len(heard) < len(pairs) else []
    return [TOO_NEAR.format(i, j, far, least) for (i, j), far in heard.items() if far < least - 1e-9], notes, {}


def bearing(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check for symmetry, leaders and bearing rigidity."""
    gains, count = law.Parameters.of(parameters), 3 * len(graph.followers)
    manoeuvres = law.information.output is Output.ACCELERATION
    anchored = gains.anchored or manoeuvres or bool(graph.leaders)
    problems = spectrum.asymmetric(graph) + (spectrum.led(graph, 2) if anchored else [])
    known = {**places, **gains.leader_places}
    if same := [COINCIDE.format(i, j) for i, j in spectrum.pairs(graph) if np.array_equal(known[i], known[j])]:
        return problems + same, [], {}
    matrix = spectrum.bearing_laplacian(graph, known, weighted=not manoeuvres)
    values, expected = np.linalg.eigvalsh(matrix[:count, :count] if anchored else matrix), 0 if anchored else 4
    zeros = int(np.sum(values <= spectrum.NONE * values[-1]))
    if zeros != expected:
        problems.append(NOT_BEARING_RIGID.format(" of the followers" * anchored, expected, zeros))
    rate = _slowest(gains.kp, gains.kv) if manoeuvres else gains.gain * float(values[min(expected, len(values) - 1)])
    return problems, [], {} if problems else {"slowest": rate}


def rigid(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check for symmetry and rigidity; the rate is 2 k lambda_min+(R R') at the places."""
    n, d = len(graph.followers), law.dimension
    matrix = spectrum.rigidity_matrix(graph, places, d)
    values = np.linalg.eigvalsh(matrix @ matrix.T)
    values, needed = values[values > spectrum.NONE * values.max(initial=0.0)], max(d * n - d * (d + 1) // 2, 1)
    if len(values) < needed:
        return [*spectrum.asymmetric(graph), FLEXIBLE.format(needed, len(values))], [], {}
    return spectrum.asymmetric(graph), [], {"slowest": 2.0 * law.Parameters.of(parameters).gain * float(values[0])}


def affine(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check for leaders, symmetry, balance, a positive definite block and a feed-forward that settles."""
    gains = law.Parameters.of(parameters)
    least = float(np.linalg.eigvalsh(spectrum.block(graph))[0])
    problems = spectrum.led(graph, law.information.leaders[0]) + spectrum.asymmetric(graph)
    problems += [] if least > spectrum.NONE else [NOT_POSITIVE.format(least)]
    known = {**places, **gains.leader_places}
    for i in graph.followers:
        edges = [(j, w) for j, target, w in graph.edges if target == i]
        if all(j in known for j, _ in edges):
            force = float(np.linalg.norm(sum([w * np.subtract(known[i], known[j]) for j, w in edges], np.zeros(3))))
            problems += [UNBALANCED.format(i, force)] if force > 1e-3 else []
    notes, rho = [], spectrum.feed_forward(graph)
    if law.information.message:
        notes = [SETTLES.format(rho, 1.0 / (1.0 - rho)) if rho < 1.0 else DIVERGES.format(rho)]
    rate = gains.gain if law.information.message else gains.gain * least
    accelerates = law.information.output is Output.ACCELERATION
    return problems, notes, {"slowest": _slowest(gains.kp, gains.kv) if accelerates else rate}


def containment(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check whether a leader leads to every follower; the rate is k min Re lambda(L_ff)."""
    problems = spectrum.led(graph, law.information.leaders[0]) + spectrum.tree(graph)
    gain = law.Parameters.of(parameters).gain
    return problems, [], {} if problems else {"slowest": gain * float(spectrum.modes(graph)[0].real)}


def aggregative(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check whether the weights are doubly stochastic and the graph is connected; the rate is that of (x, s, y)."""
    matrix, task = spectrum.block(graph), law.Parameters.of(parameters)
    largest = float(np.diag(matrix).max())
    problems = spectrum.tree(graph) + spectrum.asymmetric(graph)
    problems += [] if largest < 1.0 else [NOT_STOCHASTIC.format(largest)]
    g1, g2, g3 = task.weights
    x, s, y = np.split(np.eye(3 * len(matrix)), 3)
    new_x = x - task.alpha * (g1 * x + g3 * (x - s) + y)
    new_s = s - matrix @ s + new_x - x
    new_y = y - matrix @ y + (g2 + g3) * (new_s - s) - g3 * (new_x - x)
    values = np.linalg.eigvals(np.vstack([new_x, new_s, new_y]))
    radius = float(np.abs(values[np.argsort(np.abs(values - 1.0))[2:]]).max())  # without two of the means, which are 1
    problems += [] if radius < 1.0 or problems else [TOO_LONG.format(task.alpha, radius)]
    return problems, [], {} if problems else {"slowest": -float(np.log(radius)) / task.period}


def event_triggered(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check for a connected graph and, without sight of neighbours, alpha < lambda_2: the bound falls at alpha."""
    c, problems = law.Parameters.of(parameters), spectrum.tree(graph) + spectrum.asymmetric(graph)
    if law.information.neighbours:
        return problems + ([] if c.sigma < 1.0 else [TOO_LARGE.format(c.sigma)]), [], {}
    if problems:
        return problems, [], {}
    slowest, matrix = float(spectrum.modes(graph)[0].real), laplacian(graph)
    bound = float(np.linalg.norm(matrix, 2)) * len(matrix) ** 0.5 * c.c0 / slowest
    return [] if c.alpha < slowest else [TOO_FAST.format(c.alpha, slowest)], [NEAR.format(bound)], {"bound": c.alpha}


def barrier(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check the radius: D + ((2A/gamma)^(1/3) + 2 speed)^2/(2A)."""
    g = law.Parameters.of(parameters)
    return _short(law, g.distance + ((4 * g.alpha / g.gamma) ** (1 / 3) + 2 * g.speed) ** 2 / (4 * g.alpha)), [], {}


def barrier_first_order(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check the radius, the |dp| from which on gamma h^3/4 >= sqrt(2) speed |dp|, h = |dp|^2 − D^2."""
    g = law.Parameters.of(parameters)
    most, apart = 2.0 * (4.0 * g.speed / g.gamma) ** 2, g.distance**2
    roots = np.roots([1.0, 0.0, 0.0, 0.0, 0.0, -most, -most * apart])  # of h^6 = most (h + D^2): one is above 0
    return _short(law, float(np.sqrt(max(roots[np.abs(roots.imag) < 1e-9].real) + apart))), [], {}


def relayed(law: Law, graph: Graph, places: Places, parameters: Given) -> Checked:
    """Check for a path from the leader to each follower; errors from what is known of it fall at the rate k."""
    return spectrum.tree(graph), [], {"slowest": law.Parameters.of(parameters).gain}


def _short(law: Law, needed: float) -> list[str]:
    radius = law.information.radius
    return [SHORT.format(needed, radius)] if needed > radius + 1e-9 else []


def _slowest(stiffness: complex, damping: complex) -> float:
    """Return the slowest rate of s^2 + damping s + stiffness."""
    return -float(np.roots([1.0, damping, stiffness]).real.max())
