"""Do drones get round what is in their way? Families of drawn flights (way_draws.py), judged by their bars.

    python lab/bench/ways.py [--first 0] [--flights 40] [--family NAME ...] [--jobs 2] [--ideal] [--record FILE]

A row has a family's good flights, the median, 90 % and worst of its time, s, the smallest distances, m, the most that
one drone turned back in a flight (it flew more than BACKWARDS against its own planned way), and the shares of the
formation's steps in which the safety filter changed the commands of followers by more than CHANGED: by its limits of
speed and acceleration alone; for a fixed body, a wall, or a drone that stands; for others on their way: a conflict of
two demands. The time is that of the last arrival (grids, drawn, exchanges), that off a place (crossing) or off a free
place (person, obstacles). Drawn flights are recorded, and the verdict on them must agree with what was measured here.
With --record each flight is added to FILE, and the rows are of all flights in it: pieces of a campaign.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from math import inf
from pathlib import Path
from typing import Any

from flockwire_analysis.phases import TAIL
from flockwire_analysis.summary import summarise
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.laws import BUILT_IN
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.flight import TraceInMemory
from flockwire_lab.process import Published
from flockwire_lab.world import World
from law_noted import NOTED, SENT
from settling import IDEAL, TELLO, merged
from way_draws import FAMILIES, Flight
from way_watch import SOON, Result, Watch

BACK = 5.0  # s off a free place, behind a person
SLACK, GRACE = 1.5, 3.0  # times the shortest detour and the forbidden time, and s more: bars of crossings
DETOUR_TOLERANCE = 0.05  # m
SETTLED = 20.0  # s: bar of the grids
SLOWER = 2.5  # times the free way's time: bar of exchanges
GRIDS = ("circling", "straight", "early", "free", "drawn")


def fly(family: str, number: int, airframe: dict[str, Any]) -> Result:
    """Fly one flight and judge it by the bars of its family."""
    flight, result = FAMILIES[family](number, airframe), Result()
    NOTED.clear()
    SENT.clear()
    swarm = parse_swarm(merged(flight.table, {"control": {"law": "extended"}}), family)
    watch = Watch(swarm, flight, result)
    faults = parse_faults({"faults": flight.faults}, Plan(swarm), "bench") if flight.faults else ()
    recorded = TraceInMemory(swarm, number) if family == "drawn" else None

    def take(published: Published) -> None:
        """Receive one message."""
        watch.take(published)
        if recorded is not None:
            recorded.take(published)

    outcome = World(swarm, number, flight.duration, faults, take).run()
    watch.done()
    result.why = [outcome.failure] if outcome.failure else []
    safe = swarm.avoidance.safe
    bars = [
        ("drones", result.drones, safe.drone, False),
        ("obstacles", result.obstacles, safe.obstacle, False),
        *_bars(family, flight, result, swarm.limits.speed),
    ]
    result.why += [
        f"{name} {value:.3f} (bar {bar:.3f})"
        for name, value, bar, most in bars
        if (value > bar if most else value < bar)
    ]
    if recorded is not None:
        summary = summarise(recorded.trace())
        kept = result.drones >= safe.drone and result.obstacles >= safe.obstacle
        if summary.ok != (kept and result.settled < (1.0 - TAIL) * watch.lasted and not outcome.failure):
            result.why.append(f"verdict: {'; '.join(summary.failures()) or 'all well'}")
    return result


def _bars(family: str, flight: Flight, result: Result, speed: float) -> Iterator[tuple[str, float, float, bool]]:
    """Yield name, value and bar of what a family must meet besides its distances, and whether the bar is the most."""
    if family in GRIDS:
        yield "settled", result.settled, SETTLED, True
        yield "turned back", result.turned, 1, True
    elif family in ("swap", "corridor"):
        yield "settled", result.settled, SLOWER * (flight.way / (0.8 * speed) + 1.5), True
    elif family == "crossing":
        yield "deviation", result.deviation, SLACK * flight.detour + DETOUR_TOLERANCE, True
        yield "off", result.off, SLACK * flight.forbidden + GRACE, True
    elif family == "person":
        yield "person", result.person, 0.3, False
        yield "away", result.away, BACK, True
    else:
        yield "late", result.late, SOON, True
        yield "stuck", float(result.stuck), 0.0, True


def time_of(family: str, result: Result) -> float:
    """Return the time, s, that is shown for a flight of `family`."""
    if family in ("swap", "corridor", *GRIDS):
        return result.settled
    return {"crossing": result.off, "person": result.away}.get(family, result.late)


def flown(airframe: dict[str, Any], case: tuple[str, int]) -> Result:
    """Fly flight (family, number) with the law of law_noted.py."""
    BUILT_IN["extended"] = "law_noted:Noted"
    return fly(*case, airframe)


def row(family: str, found: list[Result]) -> str:
    """Return the row of a family's flights."""
    times = sorted(time_of(family, result) for result in found)
    shown = ", ".join(f"{times[min(int(share * len(times)), len(times) - 1)]:.1f}" for share in (0.5, 0.9, 1.0))
    worst = [min(getattr(r, name) for r in found) for name in ("drones", "obstacles", "person")]
    distances = " | ".join(f"{value:.3f}" if value < inf else "" for value in worst)
    steps = max(sum(r.steps for r in found), 1)
    shares = ", ".join(
        f"{100.0 * sum(getattr(r, name) for r in found) / steps:.1f}" for name in ("limited", "leaning", "conflicts")
    )
    good = sum(not r.why for r in found)
    turned = max(r.turned for r in found)
    return f"| {family} | {good} of {len(found)} | {shown} | {distances} | {turned} | {shares} |"


def main() -> int:
    """Print the table; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--flights", type=int, default=40)
    parser.add_argument("--family", choices=FAMILIES, nargs="*", default=list(FAMILIES))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--ideal", action="store_true")
    parser.add_argument("--record", type=Path)
    args = parser.parse_args()
    cases = [(family, args.first + number) for family in args.family for number in range(args.flights)]
    found: list[tuple[str, Result]] = []
    if args.record is not None and args.record.exists():
        rows = [json.loads(line) for line in args.record.read_text().splitlines()]
        found += [(family, Result(**fields)) for family, number, fields in rows if (family, number) not in cases]
    with ProcessPoolExecutor(args.jobs) as pool:
        flights = pool.map(partial(flown, IDEAL if args.ideal else TELLO), cases)
        for (family, number), result in zip(cases, flights, strict=True):
            found.append((family, result))
            if result.why:
                print(f"{family} {number}: {'; '.join(result.why)}", file=sys.stderr, flush=True)
            if args.record is not None:
                with args.record.open("a") as record:
                    record.write(json.dumps((family, number, asdict(result))) + "\n")
    print("| family | good | median, 90 %, worst, s | drones, m | obstacles, m | persons, m | back | filter, % |")
    print("|" + 8 * "---|")
    for family in dict.fromkeys(family for family, _ in found):
        print(row(family, [result for other, result in found if other == family]))
    return int(any(result.why for _, result in found))


if __name__ == "__main__":
    sys.exit(main())
