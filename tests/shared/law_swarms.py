"""The example of each law, flown by five drones or more."""

import tomllib
from pathlib import Path

from flockwire_core.loading import parse_swarm

EXAMPLES = Path(__file__).parents[2] / "laws/examples"
NAMES = sorted(path.stem for path in EXAMPLES.glob("*.toml"))
RING = [[i, i % 5 + 1] for i in range(1, 6)]
EDGES = {  # of five drones, each in both directions
    "aggregative": [[*edge, 0.3333] for edge in RING],
    "bearing": [*RING, [1, 3], [1, 4]],
    "dmpc": [*RING, *([i, (i + 1) % 5 + 1] for i in range(1, 6))],
    "event_triggered": RING,
    "rigid": [*RING, [1, 3], [1, 4]],
}


def of_five(name: str) -> dict:
    """Return the table of the example `name`; one of four drones gets a fifth."""
    table = tomllib.loads((EXAMPLES / f"{name}.toml").read_text())
    if len(table["drones"]) > 4:
        return table
    edges = EDGES.get(name, [])
    table["formation"]["sides"] = 5
    table["graph"]["edges"] = [*edges, *([b, a, *weight] for a, b, *weight in edges)]
    table["drones"].append({"id": 5, "start": [1.5, -1.5, 0.0]})
    places = parse_swarm(table, "test").build_formation()
    if name in ("barrier", "dmpc"):  # they change places
        for rank, drone in enumerate(table["drones"]):
            x, y, _ = places.offset((rank + 2) % 5, 0.0)
            drone["start"] = [x, y + 0.1 * (rank == 0), 0.0]
    return table
