"""Three drones above each other in a room of 0.5 m, as poses and commands end: who comes down onto whom.

In each flight the simulated airframes, with one or two of the pilots, are cut off from everybody else for some s; in
half of them the tracker also loses a drone. Limits, moments and delays are drawn. drawn_flights.py flies them.
"""

from __future__ import annotations

import tomllib
from random import Random
from typing import Any

from fault_draws import SWARMS, Drawn, drawn_staleness, in_order
from flockwire_core.loading import parse_swarm
from flockwire_lab.rare import Rare
from rare_swarms import SLOW, SMALL, cramp

PILOTS = ("leader", "uav1", "uav2")


def drawn(seed: int) -> Drawn:
    """Draw the flight of `seed`."""
    chance = Random(f"stacked {seed}")
    table = tomllib.loads((SWARMS / "paper_simulation.toml").read_text())
    table["control"] |= {"law": "extended", "rate_hz": SLOW}
    table.setdefault("gateway", {})["rate_hz"] = SLOW
    table["drones"], table["graph"] = table["drones"][:SMALL], {"edges": [[i, i + 1] for i in range(SMALL - 1)]}
    if usual := chance.random() < 0.4:
        table["limits"].pop("staleness", None)
    else:
        table["limits"]["staleness"] = drawn_staleness(chance)
    cramp(table)
    at, kept = chance.uniform(3.0, 6.0), chance.sample(PILOTS, chance.choice((1, 2)))
    cut = {"kind": "partition", "at": round(at, 3), "duration": round(chance.uniform(1.5, 5.0), 3)}
    faults: list[dict[str, Any]] = [cut | {"processes": ["kinematics", *kept]}]
    if chance.random() < 0.5:
        lost = {"kind": "tracker", "drone": chance.randrange(SMALL), "duration": 2.0}
        faults.append(lost | {"at": round(at + chance.uniform(-1.0, 1.0), 3)})
    swarm = parse_swarm(table, "stacked")
    return Drawn(seed, "extended", swarm, in_order(faults), usual, Rare.drawn(chance))
