"""The communication graph as SVG: the leader on the left, every follower as many columns further as it is hops away."""

from __future__ import annotations

from math import hypot

from flockwire.control.graph import LEADER, Graph

COLUMN, ROW, RADIUS, MARGIN = 120.0, 76.0, 21.0, 44.0

Place = tuple[float, float]


def graph_svg(graph: Graph) -> str:
    """Return an SVG element whose colours its surroundings give; edges run from the speaker to the hearer."""
    places = _places(graph)
    bows = [_bow(places[source], places[target]) for source, target, _ in graph.edges]
    edges = "".join(
        _edge(places[source], bow, places[target], weight)
        for (source, target, weight), bow in zip(graph.edges, bows, strict=True)
    )
    nodes = "".join(
        f'<circle class="node{" leader" if number == LEADER else ""}" cx="{x:.1f}" cy="{y:.1f}" r="{RADIUS:g}"/>'
        f'<text x="{x:.1f}" y="{y:.1f}">{number}</text>'
        for number, (x, y) in places.items()
    )
    points = [*places.values(), *bows]
    left, top = (min(point[axis] for point in points) - MARGIN for axis in (0, 1))
    width, height = (max(point[axis] for point in points) + MARGIN - low for axis, low in ((0, left), (1, top)))
    return (
        f'<svg viewBox="{left:.0f} {top:.0f} {width:.0f} {height:.0f}" style="max-width:{width:.0f}px" role="img" '
        'aria-label="communication graph"><defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" '
        'markerWidth="7" markerHeight="7" orient="auto"><path d="M0 1 10 5 0 9z" fill="currentColor"/>'
        f"</marker></defs>{edges}{nodes}</svg>"
    )


def _places(graph: Graph) -> dict[int, Place]:
    columns: dict[int, list[int]] = {}
    for number, depth in sorted(graph.depths().items()):
        columns.setdefault(depth, []).append(number)
    tallest = max(len(column) for column in columns.values())
    return {
        number: (depth * COLUMN, ROW * (row + (tallest - len(column)) / 2))
        for depth, column in columns.items()
        for row, number in enumerate(column)
    }


def _bow(start: Place, end: Place) -> Place:
    """Return the middle of an edge: straight to the next column, else beside, so that it passes other drones."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    bow = 0.0 if 0.0 < dx < 1.5 * COLUMN else min(0.16 * hypot(dx, dy), ROW) / hypot(dx, dy)
    return ((start[0] + end[0]) / 2 + bow * dy, (start[1] + end[1]) / 2 - bow * dx)


def _edge(start: Place, bow: Place, end: Place, weight: float) -> str:
    control = (2 * bow[0] - (start[0] + end[0]) / 2, 2 * bow[1] - (start[1] + end[1]) / 2)
    tail, tip = _towards(start, control), _towards(end, control)
    path = f"M{tail[0]:.1f} {tail[1]:.1f}Q{control[0]:.1f} {control[1]:.1f} {tip[0]:.1f} {tip[1]:.1f}"
    line = f'<path d="{path}" fill="none" stroke="currentColor" stroke-width="1.6" marker-end="url(#tip)"/>'
    if weight == 1.0:
        return line
    return f'{line}<text class="weight" x="{bow[0]:.1f}" y="{bow[1] - 9:.1f}">{weight:g}</text>'


def _towards(node: Place, point: Place) -> Place:
    """Return where the way from `node` to `point` leaves the node's circle."""
    dx, dy = point[0] - node[0], point[1] - node[1]
    share = (RADIUS + 3.0) / max(hypot(dx, dy), 1e-9)
    return (node[0] + dx * share, node[1] + dy * share)
