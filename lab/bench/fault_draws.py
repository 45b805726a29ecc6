"""Short flights of the paper's swarm of five, each with one to three faults, all drawn by a seed."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import Any

from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.kinds import Fault
from flockwire_lab.rare import Rare
from flockwire_lab.search.drawing import FAULT_KINDS, random_fault, second_station
from flockwire_lab.search.events import SECOND_STATION, Event, parse_events
from flockwire_lab.study.file import Starts
from flockwire_lab.study.variation import random_starts
from hostile import make_multirotors
from rare_draws import FALSE, answered, rare_faults
from rare_swarms import alter

SWARMS = Path(__file__).parents[2] / "examples"
VARIANTS = {  # swarm file, law, starts drawn, share of the flights
    "extended": ("paper_simulation", "extended", True, 0.55),
    "extended, Tello": ("paper_flight", "extended", False, 0.2),
    "paper": ("paper_simulation", "paper", False, 0.15),
    "paper, Tello": ("paper_flight", "paper", False, 0.1),
}
DURATION = 8.0  # s from the order to take off to the order to land
LOST_BODY = "lost body"  # the tracker loses one drone while others are above and below it, or anywhere
KINDS = (*FAULT_KINDS, LOST_BODY, SECOND_STATION)
STATION_SHARE = 0.15  # of the flights
LOST_SHARE = 0.2  # of the flights
STACK = 2.5  # m that the fence must be high for drones to fly one above the other


@dataclass(frozen=True)
class Drawn:
    """One flight as its seed has it: `faults` in order, FILE_KINDS and LOST_BODY for the world, others for the tap."""

    seed: int
    variant: str
    swarm: Swarm
    faults: tuple[dict[str, Any], ...]
    usual: bool  # the limits are those of the swarm file
    rare: Rare | None = None
    without: tuple[int, ...] = ()
    after: str = ""  # what its station orders once it is over

    def parsed(self) -> tuple[tuple[Fault, ...], tuple[Event, ...], list[dict[str, Any]]]:
        """Return what the simulated world injects, what happens to stations, and the rest, which is rare."""
        named = [fault | {"kind": "tracker"} if fault["kind"] == LOST_BODY else fault for fault in self.faults]
        usual = (*FAULT_KINDS, SECOND_STATION, *FALSE)
        known = [fault for fault in named if fault["kind"] in usual]
        faults, events = parse_events(known, Plan(self.swarm), f"seed {self.seed}")
        return faults, events, [fault for fault in named if fault["kind"] not in usual]


def drawn(seed: int, edges: list[list[int]] | None = None, rare: bool = False, multirotors: bool = False) -> Drawn:
    """Draw the flight of `seed`, with other `edges` than the chain's, of `multirotors` where drones are no Tellos.

    `rare` adds what few flights meet, and takes faults away for it.
    """
    chance = Random(f"fault flight {seed}")
    variant = chance.choices(tuple(VARIANTS), [share for *_, share in VARIANTS.values()])[0]
    file, law, moved, _ = VARIANTS[variant]
    table = tomllib.loads((SWARMS / f"{file}.toml").read_text())
    table["control"]["law"] = law
    table["graph"]["edges"] = edges or table["graph"]["edges"]
    usual = chance.random() < 0.4
    if not usual:
        table["limits"]["staleness"] = drawn_staleness(chance)
    if chance.random() < 0.08:
        table.setdefault("airframes", {}).setdefault("kinematics", {})["endurance"] = chance.uniform(5.0, 12.0)
    tight = chance.random() < 0.25
    if tight and not (rare and law == "paper"):  # long at the fence, the paper's law keeps no distance
        tighten_fence(table, file, chance)
    if multirotors and file == "paper_simulation":
        models = Random(f"multirotors {seed}")
        make_multirotors(table, models.random(), rotors=models.random() < 0.3)
    if moved:
        places = random_starts(parse_swarm(table, file), Starts(box=(6.0, 6.0), fixed=(0,)), chance)
        for drone, (x, y) in zip(table["drones"], places, strict=True):
            drone["start"] = [x, y, 0.0]
    loses = Random(f"lost body {seed}")  # of its own: the other draws are those of the seeds from before
    lost = loses.random() < LOST_SHARE
    if lost and law != "paper" and table["limits"]["fence"]["max"][2] >= STACK and loses.random() < 0.5:
        table["formation"] = stacked()
    if (extra := Random(f"rare {seed}") if rare else None) is not None:
        alter(table, extra)
    swarm = parse_swarm(table, file)
    plan = Plan(swarm)
    kinds = chance.choices((*FAULT_KINDS, "cut"), k=chance.choice((1, 1, 2, 2, 3)))
    faults = [random_fault(kind, plan, DURATION, chance) for kind in kinds]
    if lost:
        faults = [_lost_body(plan, loses), *faults[: loses.choice((0, 0, 1))]]
    gives = Random(f"second station {seed}")
    if gives.random() < STATION_SHARE:
        faults.append(second_station(DURATION, gives))
    flight = Drawn(seed, variant, swarm, in_order(faults), usual)
    return flight if extra is None else _rarer(flight, plan, extra)


def _rarer(flight: Drawn, plan: Plan, chance: Random) -> Drawn:
    without = plan.swarm.flying[-1:] if chance.random() < 0.15 else ()
    kept = flight.faults[: chance.choice((0, 1, 1, 2))]
    faults = [*kept, *rare_faults(plan, without, chance)]
    after = chance.choice(("", "hold", "resume", "land", "stop"))
    rare = Rare.drawn(chance)
    faults += answered(plan, chance)
    return replace(flight, faults=in_order(faults), rare=rare, without=without, after=after)


def in_order(faults: Iterable[dict[str, Any]]) -> tuple[dict[str, Any], ...]:
    """Return `faults` in the order of their times."""
    return tuple(sorted(faults, key=lambda fault: fault["at"]))


def drawn_staleness(chance: Random) -> dict[str, float]:
    """Draw the limits of the staleness ladder, s."""
    pose, estimate, command = chance.uniform(0.1, 0.4), chance.uniform(0.5, 1.5), chance.uniform(0.1, 0.4)
    telemetry = chance.uniform(0.3, 1.0)
    return {
        "pose_zero": pose,
        "pose_land": pose + chance.uniform(0.2, 1.0),
        "estimate_drop": chance.uniform(0.15, 0.5),
        "estimates_hold": estimate,
        "estimates_land": estimate + chance.uniform(0.5, 4.0),
        "leader_silent": chance.uniform(0.3, 1.0),
        "leader_land": chance.uniform(0.2, 2.0),
        "nearby_slow": 0.1,
        "nearby_hold": chance.uniform(0.15, 0.5),
        "command_zero": command,
        "command_land": command + chance.uniform(0.2, 1.0),
        "telemetry_warn": telemetry,
        "telemetry_land": telemetry + chance.uniform(0.2, 1.0),
    }


def stacked() -> dict[str, Any]:
    """Return a formation of two pairs, one drone above the other: the leader has one above it too."""
    offsets = ((0.0, 0.0, 0.8), (1.4, 0.0, 0.0), (1.4, 0.0, 0.8), (-1.4, 0.3, 0.4))
    rows = [f"{t},{i},{x},{y},{z}" for i, (x, y, z) in enumerate(offsets, 1) for t in (0, 1000)]
    return {"kind": "key_frames", "file": "bench.csv", "frames": "\n".join(("t,drone,x,y,z", *rows))}


def _lost_body(plan: Plan, chance: Random) -> dict[str, Any]:
    """Draw which drone the tracker loses, and for how long."""
    return {
        "at": round(chance.uniform(0.5, DURATION + 1.5), 3),
        "kind": LOST_BODY,
        "drone": chance.choice(plan.swarm.flying),
        "duration": round(chance.uniform(1.5, 10.0), 3),
    }


def tighten_fence(table: dict[str, Any], file: str, chance: Random) -> None:
    """Let the formation reach the fence, or the climb its top."""
    reach, low = (3.05 if file == "paper_simulation" else 1.8), chance.random() < 0.5
    table["limits"]["fence"] = {"min": [-reach, -reach, -0.5], "max": [reach, reach, 0.93 if low else 3.0]}
    table["limits"]["fence"]["margin"] = chance.uniform(0.02, 0.1)
    table["limits"]["takeoff_height"] = 0.9 if low else 1.0
    table["leader"] |= {"trajectory": {"kind": "constant", "velocity": [0.3, 0.2, 0.0]}, "input_bound": 0.4}
    table.pop("obstacles", None)
