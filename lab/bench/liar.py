"""A process that lies with good keys, in virtual time: whom each lie harms, how far, and what notices it.

    .compiled/bin/python lab/bench/liar.py [--laws extended,paper] [--graphs chain,star] [--lies "age 0 s,pose 1 m/s"]
    .compiled/bin/python lab/bench/liar.py --laws extended --graphs "both ways" --lies "all places"
    .compiled/bin/python lab/bench/liar.py --honest 300 [--first 0]

The paper's swarm of five flies twice by one seed: honestly, and with one lie from 8 s to 20 s after the order to take
off. Printed for each flight: how far each drone was from its honest position at most while the lie lasted (truth
against truth, m), the smallest distance between two drones in the air, m, the largest outside the fence, m, who
reported what other than in the honest flight, and after how many s, and the checks that failed.

`--honest` flies the drawn flights of fault_flights.py that have the extended law, on these graphs in turn, and
prints each one in which a pilot took a neighbour for false or its tracked body for another. Ends with 1 if one did.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import combinations
from math import dist, inf
from pathlib import Path
from typing import Any

from fault_draws import Drawn, drawn
from fault_judge import Judge
from flockwire_analysis.checks import ABOUT_THE_RECORD
from flockwire_analysis.summary import summarise
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.loading import parse_swarm
from flockwire_core.pilot.agreement import DISAGREE
from flockwire_core.process.fault_file import parse_faults
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import APART, LEFT_OUT, Status
from flockwire_lab.flight import TraceInMemory
from flockwire_lab.process import Published
from flockwire_lab.world import World

SWARM = Path(__file__).parents[2] / "examples/paper_simulation.toml"
BEGIN, LASTS, DURATION = 8.0, 12.0, 21.0  # s
IN_THE_AIR = 0.15  # m
DRIFT = 0.15  # m/s, limits.body_drift
GRAPHS = {  # [from, to]
    "chain": [[0, 1], [1, 2], [2, 3], [3, 4]],
    "tree": [[0, 1], [1, 2], [1, 3], [2, 4]],
    "star": [[0, 1], [0, 2], [0, 3], [0, 4]],
    "double chain": [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3], [2, 4], [3, 4]],
    "three ways": [[0, 1], [0, 2], [0, 3], [1, 4], [2, 4], [3, 4]],
    "complete": [[i, j] for j in range(1, 5) for i in range(5) if i != j],
}
BOTH_WAYS = "both ways"  # a chain whose followers share the places out by an auction
CHAIN = [[0, 1], [1, 2], [2, 1], [2, 3], [3, 2], [3, 4], [4, 3]]
PLACES = {"all places": 12996.0, "all places, cheaper": 9000.0}  # m^2; the first is the highest in 20 x 20 x 3.5 m


def _estimate(speed: float) -> list[dict[str, Any]]:
    """Return the lie of uav1, which moves away from the leader's way."""
    velocity = [-speed / 2**0.5, speed / 2**0.5, 0.0]
    return [{"at": BEGIN, "kind": "false_estimate", "drone": 1, "velocity": velocity, "duration": LASTS}]


def _pose(drone: int, *velocity: float) -> list[dict[str, Any]]:
    return [{"at": BEGIN, "kind": "false_pose", "drone": drone, "velocity": list(velocity), "duration": LASTS}]


def _age(age: float) -> dict[str, Any]:
    return {"at": BEGIN, "kind": "false_age", "drone": 1, "age": age, "duration": LASTS}


def _bids(price: float) -> list[dict[str, Any]]:
    return [{"at": BEGIN, "kind": "false_bids", "drone": 1, "price": price, "duration": LASTS}]


KILL = {"at": BEGIN, "kind": "kill", "process": "leader"}
LIES = {
    "none": [],
    "estimate 0.1 m/s": _estimate(0.1),
    "estimate 0.5 m/s": _estimate(0.5),
    "estimate 3 m/s": _estimate(3.0),
    "age 0 s": [_age(0.0)],
    "age 10 s": [_age(10.0)],
    "leader killed": [KILL],
    "leader killed + age 0 s": [KILL, _age(0.0)],
    "pose 0.05 m/s": _pose(2, 0.05, 0.0, 0.0),
    "pose 0.2 m/s": _pose(2, 0.2, 0.0, 0.0),
    "pose 1 m/s": _pose(2, 1.0, 0.0, 0.0),
    "pose 0.1 m/s up": _pose(2, 0.0, 0.0, 0.1),
    "leader's pose 0.2 m/s": _pose(0, -0.14, 0.14, 0.0),
    **{name: _bids(price) for name, price in PLACES.items()},
    "height 0.5 m": [{"at": BEGIN, "kind": "false_height", "drone": 2, "offset": 0.5, "duration": LASTS}],
}


@dataclass
class Flown:
    """What a flight showed; times in s after the order to take off."""

    truths: dict[str, list[Vector]] = field(default_factory=dict)  # by drone, from the lie's begin to its end
    reported: dict[tuple[str, str], float] = field(default_factory=dict)  # process, phase and reasons: when first
    nearest: float = inf
    outside: float = 0.0
    failed: tuple[str, ...] = ()


def swarm_of(graph: str, law: str) -> Swarm:
    """Return the paper's swarm on another graph, with the law `law`."""
    table = tomllib.loads(SWARM.read_text())
    table["control"]["law"], table["graph"]["edges"] = law, CHAIN if graph == BOTH_WAYS else GRAPHS[graph]
    if graph == BOTH_WAYS:
        table["formation"]["assignment"] = "auction"
    table.setdefault("limits", {})["body_drift"] = DRIFT
    return parse_swarm(table, SWARM.name)


@cache
def fly(graph: str, law: str, lie: str) -> Flown:
    """Fly once."""
    swarm = swarm_of(graph, law)
    flown, room = Flown(), swarm.limits.fence.room()
    faults = parse_faults({"faults": LIES[lie]}, Plan(swarm), "bench")
    trace = TraceInMemory(swarm, 0, faults)
    places: dict[str, Vector] = {}
    took_off = 0

    def take(published: Published) -> None:
        nonlocal took_off
        trace.take(published)
        message: Any = published.message
        if isinstance(message, Mission) and message.verb == "takeoff":
            took_off = took_off or published.at
        t = (published.at - took_off) / SECOND if took_off else -1.0
        if not BEGIN <= t <= BEGIN + LASTS:
            return
        owner, kind = published.key.owner, published.key.kind
        if isinstance(message, Pose) and kind == "truth":
            places[owner] = message.position
            flown.truths.setdefault(owner, []).append(message.position)
            flown.outside = max(flown.outside, room.outside(message.position))
            airborne = [place for place in places.values() if place[2] > IN_THE_AIR]
            flown.nearest = min([flown.nearest, *(dist(a, b) for a, b in combinations(airborne, 2))])
        elif isinstance(message, Status):
            report = message.report
            flown.reported.setdefault((message.identity, f"{report.phase} {report.line}".strip()), t - BEGIN)

    World(swarm, 0, DURATION, faults, take).run()
    checks = summarise(trace.trace()).checks
    flown.failed = tuple(check.name for check in checks if not check.ok and check.name not in ABOUT_THE_RECORD)
    return flown


def displaced(flown: Flown, honest: Flown) -> dict[str, float]:
    """Return the largest distance, m, of each drone from its honest position."""
    pairs = {owner: zip(flown.truths[owner], honest.truths[owner], strict=False) for owner in sorted(honest.truths)}
    return {owner: max(dist(a, b) for a, b in pair) for owner, pair in pairs.items()}


def print_row(graph: str, law: str, lie: str) -> None:
    """Fly, and print what the lie did."""
    flown, honest = fly(graph, law, lie), fly(graph, law, "none")
    moved = "  ".join(f"{owner} {far:5.2f}" for owner, far in displaced(flown, honest).items())
    new = {said: t for said, t in flown.reported.items() if said not in honest.reported}
    told = "; ".join(f"{who} {what} ({t:.1f} s)" for (who, what), t in sorted(new.items(), key=lambda e: e[1])[:6])
    failed = [name for name in flown.failed if name not in honest.failed]
    print(
        f"{graph:12} {law:8} {lie:22}  {moved}  nearest {flown.nearest:.2f}  outside {flown.outside:.2f}\n"
        f"{'':12} reported: {told or '-'}\n{'':12} checks: {', '.join(failed) or '-'}",
        flush=True,
    )


class Alarms(Judge):
    """Judges a flight without a lie: who takes what for a lie."""

    def __init__(self, flight: Drawn) -> None:
        super().__init__(flight)
        self.raised: dict[str, None] = {}

    def take(self, published: Published) -> None:
        """Receive what is published, and note alarms."""
        super().take(published)
        if published.key.kind == "status" and isinstance(status := published.message, Status):
            self._alarmed(status)

    def _alarmed(self, status: Status) -> None:
        report = status.report
        lies = [reason.text for reason in report.reasons if reason.code in (LEFT_OUT, APART)]
        if DISAGREE in report.detail:
            lies.append(report.detail)
        self.raised |= dict.fromkeys(f"{status.identity} {lie}" for lie in lies)


def watching(flight: Drawn) -> Drawn:
    """Return the flight with pilots that watch their tracked bodies."""
    limits = flight.swarm.limits.model_copy(update={"body_drift": DRIFT})
    return replace(flight, swarm=flight.swarm.model_copy(update={"limits": limits}))


def fly_honest(seeds: range) -> bool:
    """Fly the drawn flights of `seeds` that are filtered; returns whether none had an alarm."""
    flown = alarmed = 0
    for seed in seeds:
        graph = list(GRAPHS)[seed % len(GRAPHS)]
        flight = watching(drawn(seed, GRAPHS[graph]))
        if not flight.swarm.control.filtered:
            continue
        judge, flown = Alarms(flight), flown + 1
        result = judge.fly()
        if judge.raised or result.bad:
            alarmed += bool(judge.raised)
            kinds = ", ".join(fault["kind"] for fault in flight.faults)
            print(f"--first {seed} ({graph}, {kinds}): {'; '.join((*judge.raised, *result.bad))}", flush=True)
        if flown % 20 == 0:
            print(f"{flown} flights up to {seed}: {alarmed} with an alarm", file=sys.stderr, flush=True)
    print(f"{alarmed} of {flown} flights with an alarm")
    return not alarmed


def main() -> None:
    """Fly all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--laws", default="extended,paper")
    parser.add_argument("--graphs", default=",".join(GRAPHS))
    parser.add_argument("--lies", default=",".join(name for name in LIES if name not in ("none", *PLACES)))
    parser.add_argument("--honest", type=int, default=0, help="flights to draw, without a lie")
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    if options.honest:
        sys.exit(not fly_honest(range(options.first, options.first + options.honest)))
    for law in options.laws.split(","):
        for graph in options.graphs.split(","):
            for lie in options.lies.split(","):
                print_row(graph, law, lie)


if __name__ == "__main__":
    main()
