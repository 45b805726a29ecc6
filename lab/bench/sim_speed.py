"""How much faster than real time virtual flights are, and what a drone costs in swarms of 5 to 200.

    .compiled/bin/python lab/bench/sim_speed.py [SECONDS]   (after scripts/compile; .venv-dev/bin/python: not compiled)

One process, one core. Every figure is the best of three; starting up is not counted.
"""

from __future__ import annotations

import sys
import tempfile
from math import ceil, sqrt
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain import vector
from flockwire_core.loading import load_swarm, parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_lab.flight import TraceFile
from flockwire_lab.world import World

PAPER = Path(__file__).parents[2] / "examples" / "paper_simulation.toml"
SIZES = (5, 20, 50, 100, 200)
GROWN = 20.0  # s of flight of each; of a shorter one the take-off is too large a part


def tree(drones: int) -> Swarm:
    """Return a swarm of `drones` on a grid of 2 m cells; the graph is a tree with three edges from each.

    The starts are a mirror image of the places, so that all ways cross: of 100 drones the last one flies 37 m at
    limits.speed and is at its place 15 s after the start order. A shorter flight ends before.
    """
    columns = ceil(sqrt(drones))
    reach = 2.0 * columns + 20.0
    table: dict[str, object] = {
        "name": f"tree{drones}",
        "formation": {"kind": "grid", "spacing": 2.0, "columns": columns},
        "limits": {"fence": {"min": [-reach, -reach, -0.5], "max": [reach, reach, 3.0]}},
        "graph": {"edges": [[(i - 1) // 3, i] for i in range(1, drones)]},
        "drones": [{"id": i, "start": [2.0 * (i % columns), 2.0 * (i // columns), 0.0]} for i in range(drones)],
    }
    return parse_swarm(table, "bench")


def cost(swarm: Swarm, seconds: float, traced: bool) -> float:
    """Return s of processor time for a virtual second, the best of three flights of `seconds`."""
    best = float("inf")
    for _ in range(3):
        with tempfile.TemporaryDirectory() as folder:
            trace = TraceFile(Path(folder) / "trace.mcap", swarm, "", 0) if traced else None
            world = World(swarm, 0, seconds, tap=trace.take if trace is not None else None)
            began = clock.cpu_time()
            outcome = world.run()
            if trace is not None:
                trace.close()
            best = min(best, (clock.cpu_time() - began) / outcome.seconds)
    return best


def main() -> None:
    """Print the tables."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    print("compiled" if vector.__file__.endswith(".so") else "interpreted: scripts/compile makes it faster")
    paper = load_swarm(PAPER)
    for name, traced in (("trace off", False), ("trace on", True)):
        print(f"{paper.name}, 5 drones, {name}: {1.0 / cost(paper, seconds, traced):.0f} x real time", flush=True)
    print(f"{'drones':>8}{'x real time':>14}{'us per drone-second':>22}{'relative':>10}")
    base = 0.0
    for drones in SIZES:
        each = cost(tree(drones), GROWN, False)
        base = base or each / drones
        print(f"{drones:>8}{1.0 / each:>14.2f}{each / drones * 1e6:>22.0f}{each / drones / base:>10.2f}", flush=True)


if __name__ == "__main__":
    main()
