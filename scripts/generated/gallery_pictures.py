"""Draws the picture of each law: the paths of its example in virtual time, from above."""

from __future__ import annotations

import sys
from pathlib import Path

from flockwire_analysis.figures.drawing import INK, OKABE_ITO, STYLE
from flockwire_analysis.recorded import Trace
from flockwire_analysis.tracking import in_formation
from flockwire_core.loading import load_swarm
from flockwire_lab.flight import Flight, fly_in_memory
from matplotlib import rc_context
from matplotlib.figure import Figure
from PIL import Image

from generated.gallery import LAWS, names

IMAGES = LAWS.parent / "docs/images/laws"
DURATION = 25.0  # s, of a flight
COLOURS = 48  # of a picture, which is then a few kB
GREY = "#9a9a9a"


def draw(trace: Trace, path: Path) -> None:
    """Draw the paths in the formation phases, and the graph at their end."""
    ends = {}
    figure = Figure(figsize=(4.6, 3.4), layout="constrained")
    axes = figure.add_subplot(aspect="equal", adjustable="datalim")
    for number in trace.placed():
        series = trace.positions(number)
        points = series.values[in_formation(trace, series.stamps)][::5, :2]
        colour = INK if number in trace.swarm.leaders else OKABE_ITO[number % len(OKABE_ITO)]
        axes.plot(*points.T, color=colour, linewidth=1.1)
        axes.plot(*points[0], "o", color=colour, markersize=4)
        axes.plot(*points[-1], "^", color=colour, markersize=6, zorder=3)
        ends[number] = points[-1]
    for source, target, *_ in trace.swarm.graph.edges:
        axes.plot(*zip(ends[source], ends[target], strict=True), color=GREY, linewidth=0.8, linestyle=":", zorder=0)
    figure.savefig(path, dpi=100)
    with Image.open(path) as picture:
        picture.convert("RGB").quantize(COLOURS).save(path, optimize=True)


def main() -> None:
    """Fly and draw the laws that are named, else all."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[1:] or names():
        swarm = load_swarm(LAWS / f"examples/{name}.toml").in_simulation()
        outcome, trace = fly_in_memory(Flight(swarm, 0, DURATION), lambda _: None)
        with rc_context(STYLE):
            draw(trace, IMAGES / f"{name}.png")
        print(f"{name}: {outcome.failure or 'ok'}", flush=True)


if __name__ == "__main__":
    main()
