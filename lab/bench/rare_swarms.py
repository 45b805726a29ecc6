"""What the family "rare faults" changes in a swarm file: a small swarm, limits reached at once, hardly any room."""

from __future__ import annotations

from random import Random
from typing import Any

SMALL_SHARE = 0.8  # of the flights of airframes without a driver of their own
SMALL, SLOW = 3, 20  # drones, steps a second: a tenth of the time
CRAMPED_SHARE, SIDE = 0.08, 0.45  # of the small swarms; m


def alter(table: dict[str, Any], chance: Random) -> None:
    """Change the swarm file: a small swarm, other formations, and limits that are reached at once."""
    limits = table.setdefault("limits", {})
    simple = table["formation"]["kind"] == "circle" and "airframe" not in table["drones"][0]
    if simple and chance.random() < SMALL_SHARE:
        table["drones"] = table["drones"][:SMALL]
        table["graph"] = {"edges": [[i, i + 1] for i in range(SMALL - 1)]}
        table["control"]["rate_hz"] = SLOW
        table.setdefault("gateway", {})["rate_hz"] = SLOW
        if table["control"]["law"] != "paper" and chance.random() < CRAMPED_SHARE:
            cramp(table)
            return
    table["formations"] = {"wide": {"kind": "circle", "radius": 1.5, "rate": 0.2}}
    match chance.choice(("", "", "", "", "", "fence", "start", "battery", "blind", "free", "apart")):
        case "fence" if "airframe" not in table["drones"][0] and table["control"]["law"] != "paper":
            limits["fence"] = {"min": [-3.05, -3.05, -0.5], "max": [3.05, 3.05, 3.0], "margin": 0.02}
            table["leader"] |= {"trajectory": {"kind": "constant", "velocity": [0.3, 0.2, 0.0]}, "input_bound": 0.4}
            table.pop("obstacles", None)
        case "start":
            limits["start_tolerance"] = chance.choice((0.001, 0.004))
            table.setdefault("gateway", {})["noise"] = 0.002
        case "battery":
            limits["battery_takeoff"] = chance.choice((0.9, 1.0))
            table.setdefault("airframes", {}).setdefault("kinematics", {})["endurance"] = chance.uniform(20.0, 60.0)
        case "blind":
            limits["blind_speed"] = chance.uniform(0.1, 0.2)
        case "free":
            table["formation"]["assignment"] = table["formations"]["wide"]["assignment"] = "free"
        case "apart" if table["control"]["law"] != "paper":
            limits["body_drift"] = 0.2


def cramp(table: dict[str, Any]) -> None:
    """Fly one drone above the other in a room in which there is hardly a place for a third to land."""
    places = ((0.0, 0.0), (SIDE, 0.0), (0.0, SIDE))
    for drone, (x, y) in zip(table["drones"], places, strict=True):
        drone["start"] = [x, y, 0.0]
    table["limits"]["fence"] = {"min": [-0.02, -0.02, -0.5], "max": [SIDE + 0.02, SIDE + 0.02, 3.0]}
    table["leader"]["trajectory"] = {"kind": "constant", "velocity": [0.0, 0.0, 0.0]}
    table["gateway"]["noise"] = 0.01
    rows = [f"{t},{i},0.0,0.0,{0.6 * i}" for i in (1, 2) for t in (0, 1000)]
    table["formation"] = {"kind": "key_frames", "file": "bench.csv", "frames": "\n".join(("t,drone,x,y,z", *rows))}
    table["formations"] = {"wide": table["formation"]}
    table.pop("obstacles", None)
