"""The layout of the communication graph, for templates/graph.svg.

The leader is on the left, every follower in the column of its number of hops.
"""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

from flockwire_core.control.graph import Graph

COLUMN, ROW, RADIUS, MARGIN = 120.0, 76.0, 21, 44.0

Point = tuple[float, float]


class Node(NamedTuple):
    """A drone and the centre of its circle."""

    number: int
    x: float
    y: float
    is_leader: bool


class DrawnEdge(NamedTuple):
    """An arrow from publisher to subscriber, a quadratic Bezier curve, and the place of its weight."""

    tail: Point
    control: Point
    tip: Point
    label: Point
    weight: float


class GraphPicture(NamedTuple):
    """A drawn graph: `box` is left, top, width and height; `radius` is that of every node."""

    box: tuple[int, int, int, int]
    edges: tuple[DrawnEdge, ...]
    nodes: tuple[Node, ...]
    radius: int = RADIUS


def graph_picture(graph: Graph) -> GraphPicture:
    """Return the places of nodes and edges in pixels, rounded to a tenth, Y down."""
    places = _places(graph)
    bows = [_bow(places[source], places[target]) for source, target, _ in graph.edges]
    edges = tuple(
        _edge(places[source], bow, places[target], weight)
        for (source, target, weight), bow in zip(graph.edges, bows, strict=True)
    )
    nodes = tuple(Node(number, *_rounded(place), number in graph.leaders) for number, place in places.items())
    return GraphPicture(_box([*places.values(), *bows]), edges, nodes)


def _box(points: list[Point]) -> tuple[int, int, int, int]:
    left, top = (min(point[axis] for point in points) - MARGIN for axis in (0, 1))
    right, bottom = (max(point[axis] for point in points) + MARGIN for axis in (0, 1))
    return round(left), round(top), round(right - left), round(bottom - top)


def _places(graph: Graph) -> dict[int, Point]:
    columns: dict[int, list[int]] = {}
    for number, depth in sorted({**dict.fromkeys(graph.followers, 0), **graph.depths()}.items()):
        columns.setdefault(depth, []).append(number)
    tallest = max(len(column) for column in columns.values())
    return {
        number: (depth * COLUMN, ROW * (row + (tallest - len(column)) / 2))
        for depth, column in columns.items()
        for row, number in enumerate(column)
    }


def _bow(start: Point, end: Point) -> Point:
    """Return the middle of an edge: straight to the next column, else beside, so that it passes other drones."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    bow = 0.0 if 0.0 < dx < 1.5 * COLUMN else min(0.16 * hypot(dx, dy), ROW) / hypot(dx, dy)
    return ((start[0] + end[0]) / 2 + bow * dy, (start[1] + end[1]) / 2 - bow * dx)


def _edge(start: Point, bow: Point, end: Point, weight: float) -> DrawnEdge:
    above = 9.0  # distance of a weight above its edge
    control = (2 * bow[0] - (start[0] + end[0]) / 2, 2 * bow[1] - (start[1] + end[1]) / 2)
    tail, tip, label = _towards(start, control), _towards(end, control), (bow[0], bow[1] - above)
    return DrawnEdge(_rounded(tail), _rounded(control), _rounded(tip), _rounded(label), weight)


def _towards(node: Point, point: Point) -> Point:
    """Return the intersection of the line from `node` to `point` with the node's circle."""
    dx, dy = point[0] - node[0], point[1] - node[1]
    share = (RADIUS + 3.0) / max(hypot(dx, dy), 1e-9)
    return (node[0] + dx * share, node[1] + dy * share)


def _rounded(place: Point) -> Point:
    return round(place[0], 1), round(place[1], 1)
