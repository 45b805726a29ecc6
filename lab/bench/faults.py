"""Real flights with faults: kill -9 and freezes of each kind of process, and of `flockwire up` itself.

    lab/bench/faults.py [--repeats 5] [--jobs 2] [--laws extended,paper] [--only KIND] [--faults kill] [--out FOLDER]
    lab/bench/faults.py --swarm examples/paper_flight.toml --laws extended --faults kill   (Tellos, each with a driver)

Each flight is started by `flockwire up`; once all fly the formation, the fault happens. Judged is what an independent
reader of the trace finds: the smallest distance between two drones in the air, every drone's height when the last
process ended, how long each pilot took to leave the formation, whether the trace can be read. Takes some 15 s a flight.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from itertools import combinations, cycle
from math import dist
from pathlib import Path
from typing import Any

import psutil
import tomli_w
from flockwire_core.domain.pose import Pose
from flockwire_core.loading import load_swarm
from flockwire_core.wire.codec import decode
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status
from flockwire_recorder.records import WholeRecords
from mcap.records import Channel, Message

SWARM = Path(__file__).parents[2] / "examples/paper_simulation.toml"
FAULTS = ("kill", "freeze 0.3", "freeze 2", "freeze 8")
COLLISION = 0.2  # m between two centres, in the air
IN_THE_AIR = 0.15  # m
JUDGED = {"truth": Pose, "status": Status}
PORTS = cycle(range(20000, 32000, 80))  # below those that the kernel gives to outgoing connections


class OverBeforeError(Exception):
    """A flight ended before its fault: an overloaded machine."""


@dataclass
class Outcome:
    """What became of one flight; heights and distances in m, times in s after the fault."""

    law: str
    kind: str
    fault: str
    exit_status: int | None = None
    verdict: str = ""
    closest: float = float("inf")
    highest_at_end: float = 0.0
    left_running: int = 0
    readable: bool = True
    rungs: dict[str, list[tuple[float, str]]] = field(default_factory=dict)

    @property
    def bad(self) -> str:
        """What must not be; empty when all is well."""
        found = []
        if self.closest < COLLISION:
            found.append(f"collision ({self.closest:.2f} m)")
        if self.highest_at_end > IN_THE_AIR and not (self.kind == "kinematics" and self.fault == "kill"):
            found.append(f"ended at {self.highest_at_end:.2f} m")
        if self.left_running:
            found.append(f"{self.left_running} processes left")
        if not self.readable:
            found.append("unreadable trace")
        return ", ".join(found)


def kinds(swarm_file: Path) -> tuple[str, ...]:
    """Return the kinds of process that a flight of the swarm starts, and `up` itself."""
    plan = Plan(load_swarm(swarm_file))
    return (*dict.fromkeys(plan.rows[identity].kind for identity in plan.started), "up")


def flight(swarm_file: Path, law: str, kind: str, fault: str, seed: int, folder: Path) -> Outcome:
    """Fly once, with the fault in formation."""
    outcome, chance = Outcome(law, kind, fault), random.Random(f"{law} {kind} {fault} {seed}")
    swarm = folder / "swarm.toml"
    table = tomllib.loads(swarm_file.read_text())
    table["control"]["law"], table["network"] = law, {"base_port": next(PORTS)}
    swarm.write_text(tomli_w.dumps(table))
    keys, out = folder / "keys", folder / "out"
    line = [sys.executable, "-m", "flockwire_operator", "up", swarm, "--headless", "--duration", "9", "--out", out]
    up = subprocess.Popen([*map(str, line), "--keys", str(keys)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, start_new_session=True)  # fmt: skip
    assert up.stdout is not None
    heard = []
    for said in up.stdout:
        heard.append(said)
        if "in formation" in said:
            break
    time.sleep(1.0 + 2.0 * chance.random())
    try:
        at = _inject(kind, fault, swarm, up, chance)
    except OverBeforeError:
        up.communicate()
        raise
    heard.append(up.stdout.read())
    outcome.exit_status = up.wait()
    lines = [row for row in "".join(heard).splitlines() if row]
    outcome.verdict = lines[-1] if lines else ""
    deadline = time.monotonic() + 90.0
    while processes(swarm) and time.monotonic() < deadline:
        time.sleep(0.2)
    for process in (left := processes(swarm)):
        process.kill()
    outcome.left_running = len(left)
    judge(outcome, sorted(out.glob("trace*.mcap"), key=lambda path: path.stat().st_mtime), at)
    return outcome


def processes(swarm: Path) -> list[psutil.Process]:
    """Return what still runs for a swarm file."""
    found = []
    for process in psutil.process_iter():
        try:
            if str(swarm) in process.cmdline() and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
        except psutil.Error:
            continue
    return found


def _inject(kind: str, fault: str, swarm: Path, up: subprocess.Popen[str], chance: random.Random) -> int:
    """Do it; returns when, Unix ns."""
    if kind == "up":
        victim = psutil.Process(up.pid)
    else:
        candidates = [process for process in processes(swarm) if kind in process.cmdline()]
        if not candidates:
            raise OverBeforeError
        victim = chance.choice(sorted(candidates, key=lambda process: process.cmdline()))
    at = time.time_ns()
    if fault == "kill":
        victim.send_signal(signal.SIGKILL)
    else:
        victim.send_signal(signal.SIGSTOP)
        time.sleep(float(fault.split()[1]))
        victim.send_signal(signal.SIGCONT)
    return at


def judge(outcome: Outcome, traces: list[Path], at: int) -> None:
    """Read what happened from the trace, without the project's own reader."""
    places: dict[str, tuple[float, float, float]] = {}
    phases: dict[str, str] = {}
    for owner, message in messages(outcome, traces):
        match message:
            case Pose():
                places[owner] = message.position
                airborne = [place for place in places.values() if place[2] > IN_THE_AIR]
                outcome.closest = min([outcome.closest, *(dist(a, b) for a, b in combinations(airborne, 2))])
            case Status():
                phase = message.report.phase
                if phases.get(owner) != phase and message.stamp > at and owner in phases:
                    outcome.rungs.setdefault(owner, []).append(((message.stamp - at) / 1e9, phase))
                phases[owner] = phase
    outcome.highest_at_end = max((place[2] for place in places.values()), default=0.0)
    outcome.readable = outcome.readable and bool(places)


def messages(outcome: Outcome, traces: list[Path]) -> Iterator[tuple[str, Pose | Status]]:
    """Yield owner and message of what is judged; keeps a trace that cannot be read."""
    for trace in traces:
        owned: dict[int, tuple[str, str]] = {}
        try:
            for record in WholeRecords(trace):
                match record:
                    case Channel(topic=topic) if topic.count("/") == 3 and topic.rpartition("/")[2] in JUDGED:
                        owned[record.id] = topic.split("/")[2], topic.split("/")[3]
                    case Message() if record.channel_id in owned:
                        owner, kind = owned[record.channel_id]
                        yield owner, decode(JUDGED[kind], record.data)
        except (OSError, ValueError):
            outcome.readable = False
            shutil.copy(trace, Path(tempfile.gettempdir()) / f"unreadable-{trace.stat().st_mtime_ns}.mcap")


def main() -> None:
    """Fly all, print a row for each flight and the table at the end."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--laws", default="extended,paper")
    parser.add_argument("--only", default="")
    parser.add_argument("--faults", default=",".join(FAULTS))
    parser.add_argument("--swarm", type=Path, default=SWARM)
    parser.add_argument("--out", type=Path, default=Path("runs/faults"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    cases = [
        (law, kind, fault, seed)
        for law in options.laws.split(",")
        for kind in kinds(options.swarm)
        if options.only in ("", kind)
        for fault in options.faults.split(",")
        for seed in range(options.repeats)
    ]
    results: list[dict[str, Any]] = []

    def fly(case: tuple[str, str, str, int]) -> Outcome:
        while True:
            with tempfile.TemporaryDirectory() as folder, contextlib.suppress(OverBeforeError):
                return flight(options.swarm, *case, Path(folder))
            print(f"{' '.join(map(str, case))}: the flight was over before the fault; again", flush=True)

    with ThreadPoolExecutor(options.jobs) as pool:
        for case, outcome in zip(cases, pool.map(fly, cases), strict=True):
            results.append(asdict(outcome) | {"seed": case[3], "bad": outcome.bad})
            print(f"{outcome.law:9}{outcome.kind:11}{outcome.fault:11}{outcome.closest:6.2f} m  "
                  f"end {outcome.highest_at_end:5.2f} m  "
                  f"exit {outcome.exit_status}  {outcome.bad or 'ok'}  "
                  f"{outcome.verdict[:90]}", flush=True)  # fmt: skip
            (options.out / "faults.json").write_text(json.dumps(results, indent=1) + "\n")
    bad = [result for result in results if result["bad"]]
    print(f"{len(results)} flights, {len(bad)} with something that must not be")


if __name__ == "__main__":
    main()
