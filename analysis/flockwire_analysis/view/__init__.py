"""What the console's page and the replay page share: their scripts, their style, the constant data of a flight."""

from __future__ import annotations

from pathlib import Path
from string import Template
from typing import Any

from flockwire_core.wire.plan import Plan

FOLDER = Path(__file__).parent
SCRIPTS = ("pen.js", "camera.js", "scene.js", "chart.js", "panel.js")  # in this order


def outline(plan: Plan) -> dict[str, Any]:
    """Return the constant data of a flight: fence, obstacles, graph, formations (m, world frame)."""
    swarm, fence = plan.swarm, plan.swarm.limits.fence
    (left, lower, bottom), (right, upper, top) = fence.low, fence.high
    corners = fence.polygon or ((left, lower), (right, lower), (right, upper), (left, upper))
    return {
        "name": swarm.name,
        "drones": [{"id": i, "name": name, "leads": i in swarm.leaders} for i, name in plan.pilot.items()],
        "processes": list(plan.started),
        "edges": [[edge[0], edge[1]] for edge in swarm.graph.edges],
        "fence": [list(corner) for corner in corners],
        "heights": [bottom, top],  # of the fence
        "obstacles": [{"center": list(o.center[:2]), "radius": o.radius, "height": o.height} for o in swarm.obstacles],
        "clearance": swarm.avoidance.obstacle_safety_distance,
        "formations": list(swarm.formations),
    }


def joined(*files: str | Path) -> str:
    """Return files of this folder, or of any other by their paths, as one text."""
    return "\n".join((FOLDER / file).read_text(encoding="utf-8") for file in files)


def filled(template: Path, more: str = "", **parts: str) -> str:
    """Return a page: `template` with `$panes`, the parts that both pages have, and its own `parts`, which are HTML.

    `more` is what the page adds to the panes. Raises KeyError for a part that is not given.
    """
    panes = Template(joined("panes.html")).substitute(more=more)
    return Template(joined(template)).substitute(parts, panes=panes)
