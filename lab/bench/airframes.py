"""Drones whose airframes are not the model, or fly in wind: how well they keep apart and in formation, as a table.

    python lab/bench/airframes.py [CASE ...] [--flights 10] [--jobs 2] [--disturbance 2.4] [--list]

Every case flies the swarm of lab/bench/separation/five_tello.toml (a Tello's lag and dead time, two obstacles) from the
same random starts in virtual time, for 30 s. Its agents believe in the file's lag, dead time and gain.
Exit status 1 if a flight is not good: drones closer than 0.4 m, obstacles closer than 0.3 m, or a formation error above
30 mm in the last 30 % of the flight.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from math import inf
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from flockwire_analysis.summary import summarise
from flockwire_lab.flight import TraceInMemory
from flockwire_lab.study.file import RandomFault, Starts, Study
from flockwire_lab.study.variation import swarm_table, vary
from flockwire_lab.world import World
from settling import merged

SWARM = Path(__file__).parent / "separation" / "five_tello.toml"
DURATION, TAIL = 30.0, 0.03  # s, m
WIND = {"velocity": [0.8, 0.6, 0.0], "gust": 0.5}  # 1 m/s, gusting 0.5


class Case(NamedTuple):
    """What is different: factors of the gain, the lag and the dead time; whether there is wind."""

    gain: float = 1.0
    lag: float = 1.0
    dead_time: float = 1.0
    wind: bool = False


CASES = {
    "as assumed": Case(),
    "lag -30 %": Case(lag=0.7),
    "lag +30 %": Case(lag=1.3),
    "dead time -30 %": Case(dead_time=0.7),
    "dead time +30 %": Case(dead_time=1.3),
    "gain -30 %": Case(gain=0.7),
    "gain +30 %": Case(gain=1.3),
    "weak and slow": Case(0.7, 1.3, 1.3),
    "strong and slow": Case(1.3, 1.3, 1.3),
    "strong and fast": Case(1.3, 0.7, 0.7),
    "wind": Case(wind=True),
    "weak and slow, wind": Case(0.7, 1.3, 1.3, wind=True),
    "strong and slow, wind": Case(1.3, 1.3, 1.3, wind=True),
    "strong and fast, wind": Case(1.3, 0.7, 0.7, wind=True),
    "weak and fast, wind": Case(0.7, 0.7, 0.7, wind=True),
    "strong and late, wind": Case(1.3, 0.7, 1.3, wind=True),
}


class Result(NamedTuple):
    """One flight: distances and error in m, time in s."""

    failure: str
    drones: float
    obstacles: float
    tail: float
    settled: float

    @property
    def good(self) -> bool:
        """Whether it kept all bars."""
        return not self.failure and self.drones >= 0.4 and self.obstacles >= 0.3 and self.tail <= TAIL


def fly(case: Case, disturbance: float, law: str, number: int) -> Result:
    """Fly one flight of a case."""
    changes = {"limits": {"speed": 3.0}, "control": {"law": law}}
    table = merged(swarm_table(SWARM), changes)
    if disturbance:
        table = merged(table, {"control": {"disturbance": disturbance}})
    frame = table["airframes"]["kinematics"]
    frame["gain"] = case.gain
    if case.wind:
        table["wind"] = WIND
    values: dict[str, Any] = {"at": 0.0, "kind": "lag", "lag": case.lag * frame["lag"]}
    values["dead_time"] = case.dead_time * frame["dead_time"]
    wrong = (case.lag, case.dead_time) != (1.0, 1.0)
    faults = tuple(RandomFault(table=values | {"drone": one["id"]}) for one in table["drones"]) if wrong else ()
    plan = Study(duration=DURATION, starts=Starts(box=(6.0, 6.0), fixed=(0,)), faults=faults)
    seed = plan.seed_of(number)
    varied = vary(plan, table, (), seed)
    trace = TraceInMemory(varied.swarm, seed)
    outcome = World(varied.swarm, seed, plan.duration, varied.faults, trace.take).run()
    found = summarise(trace.trace())
    error = found.formation_error_m
    figures = (found.min_distance_uav_m, found.min_distance_obstacle_m, error.max_tail, error.settled_s)
    drones, obstacles, tail, settled = (inf if value is None else value for value in figures)
    return Result(outcome.failure, drones, obstacles, tail, settled)


def main() -> int:
    """Print the table; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE", help="default: all; --list shows them")
    parser.add_argument("--flights", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--disturbance", type=float, default=2.4, help="control.disturbance, m/s; 0: not compensated")
    parser.add_argument("--law", default="extended")
    parser.add_argument("--list", action="store_true")
    args = parser.parse_args()
    if args.list:
        print("\n".join(CASES))
        return 0
    names = args.cases or list(CASES)
    if unknown := [name for name in names if name not in CASES]:
        parser.error(f"{unknown[0]!r}: must be one of {', '.join(map(repr, CASES))}")
    bad = 0
    print(
        "case                    good       drones, m  obstacles, m  tail, mm: median, worst  settled, s: median, worst"
    )
    with ProcessPoolExecutor(args.jobs) as pool:
        for name in names:
            results = list(pool.map(partial(fly, CASES[name], args.disturbance, args.law), range(args.flights)))
            good, tails = sum(one.good for one in results), sorted(1000.0 * one.tail for one in results)
            settled = sorted(one.settled for one in results)
            bad += len(results) - good
            print(
                f"{name:22s} {good:3d} of {len(results):3d} {min(one.drones for one in results):10.3f}"
                f" {min(one.obstacles for one in results):13.3f} {median(tails):16.1f} {tails[-1]:7.1f}"
                f" {median(settled):20.1f} {settled[-1]:6.1f}",
                flush=True,
            )
            for number, one in enumerate(results):
                if one.failure:
                    print(f"  {number}: {one.failure}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
