"""What becomes of a flying swarm of containers when one of them is killed.

    lab/bench/container_kills.py [--repeats 5] [--only VICTIM] [--out FOLDER]

The paper's swarm is deployed by `flockwire deploy --target compose`; its leader flies a small circle at the paper's
0.1 m/s, so that many flights fit into the fence. In each flight all fly the formation; then the main process of one
container gets SIGKILL by its pid on the host, or its container `docker kill`. What the engine has not restarted
after ENGINE s, `docker start` does. The swarm has rejoined by itself when within REJOIN s of the container's start all
fly the formation within 0.1 m of their places, for STEADY s; else one `start` must bring them back. Then all land.

At the end an independent reader of the trace finds the smallest distance between two drones in the air, and how high
they were when all had landed. With the kinematics the simulated world ends, and restarts with all drones at their
starts: that flight's distances count up to the kill. What is flown without a recorder is not in the trace.
Takes some 40 s a flight.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import statistics
import sys
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from math import dist, inf, isnan, nan
from pathlib import Path

from containers import Changes, Containers, containers, until
from faults import COLLISION, IN_THE_AIR, SWARM, Outcome, messages
from flockwire_core.domain.pose import Pose

CHANGES: dict[str, dict[str, object]] = {
    "control": {"law": "extended"},
    "leader": {"trajectory": {"kind": "circle", "radius": 0.3, "rate": 0.33}},
}
VICTIMS = ("gateway", "leader", "uav2", "uav4", "recorder", "operator")
LAST = "kinematics"  # brings all drones back to their starts
CASES = (*((victim, "SIGKILL") for victim in VICTIMS), ("uav2", "docker kill"), (LAST, "SIGKILL"))
ENGINE, REJOIN, STEADY, PATIENCE = 5.0, 10.0, 1.0, 40.0  # s
ATTEMPTS = 5  # at a formation, before a kill: what fails then is no kill's doing, but the machine's
TOGETHER = 30_000_000  # ns between two places that are compared, at most
COLUMNS = ("engine", "back", "reaction", "rejoined", "brought")


@dataclass
class Kill:
    """What became of one flight; times in s, distances in m."""

    victim: str
    how: str
    engine: float = nan  # from the kill until the engine ran it again
    back: float = nan  # from the container's start to its first status
    reaction: float = nan  # from the kill to the first change of another pilot's phase
    rejoined: float = nan  # from the container's start until all flew the formation again by themselves
    brought: float = nan  # from one order to start until they did
    others: str = ""  # the phases that most of the other pilots went through before that order
    trouble: str = ""
    changes: Changes = field(default_factory=dict)
    closest: float = inf
    highest_at_end: float = nan
    began: int = 0  # Unix ns: in formation
    at: int = 0  # the kill
    over: int = 0  # all down

    @property
    def bad(self) -> str:
        """What must not be; empty when all is well."""
        found = [self.trouble] if self.trouble else []
        if self.closest < COLLISION:
            found.append(f"collision ({self.closest:.2f} m)")
        if self.highest_at_end > IN_THE_AIR:
            found.append(f"ended at {self.highest_at_end:.2f} m")
        return ", ".join(found)


def flight(swarm: Containers, victim: str, how: str) -> Kill:
    """Fly, kill, bring back where need be, land."""
    for attempt in range(1, ATTEMPTS + 1):
        answer = swarm.order("start")
        try:
            began = until(swarm.in_place, PATIENCE, f"all in formation ({answer})", STEADY)
            break
        except TimeoutError as error:
            print(f"{victim}: {error}: {pilots(swarm)}; again", flush=True)
            land(swarm)
            if attempt == ATTEMPTS:
                raise
    kill = Kill(victim, how, began=began)
    try:
        bring_back(swarm, kill, inject(swarm, kill))
    except TimeoutError as error:
        kill.trouble = f"{error}: {pilots(swarm)}"
    land(swarm)
    kill.over = time.time_ns()
    if victim == "operator":
        swarm.docker("rm --force", victim)
    return kill


def pilots(swarm: Containers) -> str:
    """Return what the pilots report."""
    newest = swarm.newest()
    return "; ".join(
        f"{pilot} {' '.join(map(str, newest[pilot][2:] if pilot in newest else ('silent',)))}" for pilot in swarm.pilots
    )


def land(swarm: Containers) -> None:
    """Land; who is in the air after all is found in the trace."""
    swarm.order("land")
    with contextlib.suppress(TimeoutError):
        until(lambda: swarm.all_in("ready", "grounded"), PATIENCE, "all down")


def inject(swarm: Containers, kill: Kill) -> int:
    """Kill; returns when the container was restarted, by the engine or by hand, Unix ns."""
    if kill.victim == "operator":
        swarm.up("operator")
        until(lambda: conducts(swarm, 1), PATIENCE, "a conductor of the flight")
    time.sleep(2.0 * random.random())
    before, kill.at = swarm.state(kill.victim)["Pid"], time.time_ns()
    if kill.how == "SIGKILL":
        os.kill(before, signal.SIGKILL)
    else:
        swarm.docker("kill", kill.victim)

    def runs_again() -> bool:
        return swarm.state(kill.victim)["Pid"] not in (0, before)

    try:
        until(runs_again, ENGINE, "started again")
        kill.engine = (swarm.started(kill.victim) - kill.at) / 1e9
    except TimeoutError:
        swarm.docker("start", kill.victim)
    return swarm.started(kill.victim)


def bring_back(swarm: Containers, kill: Kill, started: int) -> None:
    """Wait until all fly the formation again, by themselves or after one order."""
    victim, ordered = kill.victim, 0
    if victim == "operator":
        back = until(lambda: conducts(swarm, 2), PATIENCE, "a conductor again")
    else:
        until(lambda: victim in swarm.newest(started), PATIENCE, f"{victim} again")
        back = min(status.stamp for status in swarm.seen if status.identity == victim and status.stamp > started)
    kill.back = (back - started) / 1e9
    try:
        within = REJOIN - (time.time_ns() - started) / 1e9
        kill.rejoined = (until(lambda: swarm.in_place(back), within, "rejoined", STEADY) - started) / 1e9
    except TimeoutError:
        until(lambda: swarm.all_in("ready", "grounded", "hold", "formation"), PATIENCE, "all at rest")
        ordered = time.time_ns()
        answer = swarm.order("start")
        kill.brought = (until(swarm.in_place, PATIENCE, f"brought back ({answer})", STEADY) - ordered) / 1e9
    finally:
        kill.changes = swarm.changes(kill.at, ordered or time.time_ns())
        others = [kill.changes.get(pilot, []) for pilot in swarm.pilots if pilot != victim]
        kill.reaction = min((went[0][0] for went in others if went), default=nan)
        phases = Counter(">".join(["formation", *(phase for _, phase, _ in went)]) for went in others)
        kill.others = phases.most_common(1)[0][0]


def conducts(swarm: Containers, times: int) -> bool:
    """Return whether the operator has so often seen all in formation."""
    return swarm.docker("logs", "operator").count("in formation") >= times


def judge(kills: Iterable[Kill], traces: list[Path]) -> None:
    """Find distances and heights in the trace, without the project's own reader."""
    outcome, left = Outcome("extended", "container", "kill"), list(kills)
    poses: dict[str, Pose] = {}
    for owner, pose in messages(outcome, traces):
        if not isinstance(pose, Pose):
            continue
        while left and pose.stamp > left[0].over:
            left.pop(0).highest_at_end = max((pose.position[2] for pose in poses.values()), default=inf)
        poses[owner] = pose
        if not left or pose.stamp < left[0].began or (left[0].victim == LAST and pose.stamp > left[0].at):
            continue
        near = [other.position for other in poses.values() if other is not pose and pose.stamp - other.stamp < TOGETHER]
        airborne = [place for place in near if min(place[2], pose.position[2]) > IN_THE_AIR]
        left[0].closest = min([left[0].closest, *(dist(pose.position, place) for place in airborne)])
    for kill in left:
        kill.highest_at_end = max((pose.position[2] for pose in poses.values()), default=inf)
    if not outcome.readable:
        print("a part of the trace cannot be read")


def figures(kills: list[Kill], column: str) -> str:
    """Return how many have that figure, its median and the largest."""
    there = [value for kill in kills if not isnan(value := getattr(kill, column))]
    return f"{len(there):2} {statistics.median(there):5.2f} {max(there):5.2f}" if there else f"{0:2}     -     -"


def row(name: str, kills: list[Kill]) -> None:
    """Print one row of the table: a flight, or all of a kind."""
    columns = "  ".join(figures(kills, column) for column in COLUMNS)
    others = ", ".join(f"{times} {phases}" for phases, times in Counter(kill.others for kill in kills).items())
    bad = "; ".join(kill.bad[:100] for kill in kills if kill.bad) or "ok"
    print(
        f"{name:20}{len(kills):2}  {columns}  {min(kill.closest for kill in kills):5.2f}  {bad}; {others}", flush=True
    )


def conclude(kills: list[Kill], runs: Path, out: Path) -> None:
    """Judge the traces, keep the results, print a row for each kind."""
    judge(kills, sorted(runs.glob("*/trace*.mcap"), key=lambda path: path.stat().st_mtime))
    if any(kill.bad for kill in kills):
        shutil.copytree(runs, out / "runs", dirs_exist_ok=True)
    results = json.dumps([asdict(kill) | {"bad": kill.bad} for kill in kills], indent=1)
    (out / "container_kills.json").write_text(results.replace(": NaN", ": null") + "\n")
    for case in dict.fromkeys((kill.victim, kill.how) for kill in kills):
        row(" ".join(case), [kill for kill in kills if (kill.victim, kill.how) == case])
    print(f"{len(kills)} kills, {sum(bool(kill.bad) for kill in kills)} with something that must not be")


def main() -> None:
    """Kill everything, print a row for each flight and the table at the end."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--only", default="")
    parser.add_argument("--out", type=Path, default=Path("runs/container_kills"))
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # and nothing is left behind
    options.out.mkdir(parents=True, exist_ok=True)
    kills: list[Kill] = []
    with containers(SWARM, CHANGES) as swarm:
        print(f"{'':24}{'  '.join(f'{column:14}' for column in COLUMNS)}      m   (times; median and largest, s)")
        try:
            for victim, how in [case for case in CASES if options.only in ("", case[0])] * options.repeats:
                kills.append(flight(swarm, victim, how))
                row(f"{victim} {how}", kills[-1:])
        finally:
            swarm.remove()
            conclude(kills, swarm.runs, options.out)


if __name__ == "__main__":
    main()
