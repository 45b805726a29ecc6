"""The communication graph: leaders on the left, every follower in the column of its number of hops."""

from __future__ import annotations

from flockwire_core.control.graph import Graph

from flockwire_analysis.figures.drawing import INK, MUTED, Canvas, Picture

Point = tuple[float, float]


def graph(canvas: Canvas) -> Picture:
    """Draw who receives from whom: straight to the next column, else beside, so that an arrow passes other drones."""
    topology = canvas.trace.swarm.topology
    places = columns(topology)
    tallest = max(abs(y) for _, y in places.values())
    figure, (axes,) = canvas.panels(height=min(0.6 + 0.9 * tallest, 12.0))
    for source, target, weight in topology.edges:
        (x0, y0), (x1, y1) = places[source], places[target]
        bow = 0.0 if x1 - x0 == 1.0 else 0.25
        look = {"arrowstyle": "-|>", "connectionstyle": f"arc3,rad={bow}", "shrinkA": 8, "shrinkB": 8, "color": MUTED}
        axes.annotate("", (x1, y1), (x0, y0), arrowprops=look)
        if weight != 1.0:
            middle = ((x0 + x1 + bow * (y1 - y0)) / 2, (y0 + y1 - bow * (x1 - x0)) / 2)
            axes.text(*middle, f"{weight:g}", color=MUTED, ha="center", va="bottom")
    for number, place in places.items():
        leads = number in topology.leaders
        disc = {"boxstyle": "circle", "facecolor": INK if leads else "white", "edgecolor": canvas.colour(number)}
        axes.text(*place, str(number), color="white" if leads else INK, ha="center", va="center", bbox=disc)
    axes.set_xlim(-0.5, 0.5 + max(x for x, _ in places.values()))
    axes.set_ylim(-tallest - 0.6, tallest + 0.6)
    axes.set_axis_off()
    caption = "An arrow runs from a publisher to its subscriber; a number beside it is a weight that is not 1."
    return Picture(canvas.save(figure, "graph"), "Communication graph", caption)


def columns(topology: Graph) -> dict[int, Point]:
    """Return the place of each drone: its number of hops, and its row, from above, round 0."""
    found: dict[int, list[int]] = {}
    for number, depth in sorted({**dict.fromkeys(topology.followers, 0), **topology.depths()}.items()):
        found.setdefault(depth, []).append(number)
    return {
        number: (float(depth), (len(column) - 1) / 2 - row)
        for depth, column in found.items()
        for row, number in enumerate(column)
    }
