"""Four hosts on a radio network: each a network namespace with an address of its own; frames are lost and delayed.

    sudo lab/bench/hosts.py [--only probe|partition|lossy|clocks] [--repeats 3] [--seconds 20] [--out FOLDER]

probe: all is attacked from a further host, over TLS and over QUIC. partition: one host is cut off for
5 s, in formation. lossy: 3, 10, 30 % of all frames are lost, the others take 50 ± 20 ms; 20 steps a second. clocks:
5 % loss, 20 ± 20 ms, once with true clocks and once with clocks that are 200 ms off (`faketime`; drift is flown in
virtual time). The swarm is that of lab/bench/common_time.toml; a row for each flight. Needs root, `ip`, /dev/net/tun.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Mapping
from functools import partial
from itertools import combinations
from math import dist
from pathlib import Path
from types import MappingProxyType
from typing import Any

import tomli_w
from air import Air, Conditions, air
from flockwire_core import clock
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.order import Order
from flockwire_core.loading import load_swarm
from flockwire_core.security.pki import make_keys
from flockwire_core.wire.codec import decode
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status
from flockwire_operator.station.giving import give
from flockwire_operator.station.host import Host
from radio import LANDING, ages, ended
from traced import published

SWARM = Path(__file__).with_name("common_time.toml")
NETWORK = "10.78.0"
QUIET = Conditions(0.0, 0.002, 0.001)
LOSSES = (3, 10, 30)  # %
WIRELESS = Conditions(0.05, 0.02, 0.02)
PARTED, VICTIMS = "two", ("uav3", "uav4")
PARTITION, SETTLING, HEALED = 5.0, 12.0, 12.0  # s
START_TIME = 90.0  # s that links may take to come up where frames are lost
IN_PLACE = 0.1  # m of formation error, for STAYS s
STAYS = 1.0
IN_THE_AIR = 0.15  # m
PATIENT = {  # s: two hops of up to 70 ms each, and some frames lost in a row
    "pose_zero": 0.3, "nearby_slow": 0.3, "nearby_hold": 0.6, "command_zero": 0.4, "estimate_drop": 0.5,
    "leader_silent": 2.0,
}  # fmt: skip
VERY_PATIENT = PATIENT | {"pose_zero": 0.6, "nearby_slow": 0.6, "nearby_hold": 1.0, "command_zero": 0.8}
NO_CHANGES: Mapping[str, Any] = MappingProxyType({})
SLOW = {  # QUIC sends a few packets a round trip where many are lost: what is published must fit in
    "control": {"rate_hz": 20},
    "gateway": {"rate_hz": 20},
    "formation": {"rate": 0.2},
    "hosts": {"base": {"processes": ["gateway", "recorder", "kinematics"]}, "field": {"processes": ["leader"]}},
}
FAKETIME = "/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1"
SHIFTS = {"field": 0.2, "one": -0.2, "two": 0.2}  # s, against the gateway's host


def swarm_file(folder: Path, link: str, limits: dict[str, float], changes: Mapping[str, Any] = NO_CHANGES) -> Path:
    """Write the swarm with an address for each host, and `changes` to its tables."""
    table = tomllib.loads(SWARM.read_text())
    del table["sim"]
    for name, change in changes.items():
        table[name] = table.get(name, {}) | change
    for number, host in enumerate(table["hosts"].values()):
        host["address"] = f"{NETWORK}.{number + 1}"
    table |= {"network": {"link": link}, "limits": {"staleness": limits}}
    path = folder / "swarm.toml"
    path.write_text(tomli_w.dumps(table))
    return path


@contextlib.contextmanager
def running(plan: Plan, swarm: Path, folder: Path, conditions: Conditions, shifted: bool) -> Iterator[Air]:
    """Start the processes of all hosts; yields the network, ends them."""
    keys, out = folder / "keys", folder / "out"
    make_keys(plan, keys, clock.utc())
    addresses = {host: str(found.address) for host, found in plan.swarm.hosts.items()}
    with air(addresses, f"{NETWORK}.254") as (network, names), contextlib.ExitStack() as stack:
        network.become(conditions)
        for identity in plan.started:
            host = plan.hosts[identity]
            line = ["ip", "netns", "exec", names[host], *Host(plan, swarm, host, out, keys).command_line(identity)]
            environment = {**os.environ, **(_faketime(host) if shifted else {})}
            with (folder / f"{identity}.log").open("wb") as log:
                stack.enter_context(ended(subprocess.Popen(line, stdout=log, stderr=log, env=environment)))
        yield network


@contextlib.contextmanager
def flying(plan: Plan, swarm: Path, folder: Path, conditions: Conditions, shifted: bool = False) -> Iterator[Air]:
    """Bring the swarm into formation; yields the network, lands in the end."""
    with running(plan, swarm, folder, conditions, shifted) as network:
        order(plan, folder / "keys", "start")
        yield network
        asyncio.run(give(plan, folder / "keys", Order("land")))
        time.sleep(LANDING)


def probed(folder: Path, link: str) -> dict[str, Any]:
    """Attack the processes of all hosts from one more host."""
    swarm = swarm_file(folder, link, {})
    plan = Plan(load_swarm(swarm))
    with running(plan, swarm, folder, QUIET, shifted=False):
        order(plan, folder / "keys", "land")  # means nothing on the ground, but that all links are there
        line = [sys.executable, "-m", "flockwire_operator", "probe", str(swarm), "--keys", str(folder / "keys")]
        done = subprocess.run([*line, "--out", str(folder)], check=False, capture_output=True, text=True)
    said = [line for line in done.stdout.splitlines() if "leak" in line or "blocked" in line]
    return {"exit status": done.returncode, "said": said}


def _faketime(host: str) -> dict[str, str]:
    if host not in SHIFTS:
        return {}
    return {"LD_PRELOAD": FAKETIME, "FAKETIME": f"{SHIFTS[host]:+}", "DONT_FAKE_MONOTONIC": "1"}


def order(plan: Plan, keys: Path, verb: str) -> None:
    """Give an order until all have confirmed it; raises TimeoutError."""
    deadline = time.monotonic() + START_TIME
    while time.monotonic() < deadline:
        answer = asyncio.run(give(plan, keys, Order(verb)))
        if not answer.refusal and not answer.missing:
            return
    raise TimeoutError(f"{verb} is not obeyed: {answer.refusal or answer.missing}")


def partition(folder: Path, _: float) -> dict[str, Any]:
    """Part one host from all others, heal, and give one order to start."""
    swarm = swarm_file(folder, "tls", {})
    plan = Plan(load_swarm(swarm))
    with flying(plan, swarm, folder, QUIET) as network:
        time.sleep(SETTLING)
        parted = clock.now()
        network.become(QUIET, (PARTED,))
        time.sleep(PARTITION)
        network.become(QUIET)
        healed = clock.now()
        order(plan, folder / "keys", "start")
        time.sleep(HEALED)
    phases: dict[str, list[str]] = {}
    settled: dict[str, float | None] = {}
    last: dict[str, int] = {}
    for _, _, record in published(folder / "out" / "trace.mcap", "status"):
        message = decode(Status, record.data)
        who, report = message.identity, message.report
        if who not in VICTIMS or message.stamp < parted:
            continue
        _note(phases.setdefault(who, []), report.phase)
        if message.stamp > healed and not 0.0 <= report.formation_error < IN_PLACE:
            last[who] = message.stamp
        if message.stamp - last.get(who, healed) > STAYS * SECOND:
            settled.setdefault(who, round((last.get(who, healed) - healed) / SECOND, 1))
    return {"phases": phases, "in place again after s": settled, "closest m": closest(folder / "out")}


def _note(phases: list[str], phase: str) -> None:
    if not phases or phases[-1] != phase:
        phases.append(phase)


def flight(
    folder: Path,
    seconds: float,
    conditions: Conditions,
    shifted: bool = False,
    limits: dict[str, float] = PATIENT,
    changes: Mapping[str, Any] = NO_CHANGES,
) -> dict[str, Any]:
    """Fly over QUIC under these conditions; returns the figures."""
    swarm = swarm_file(folder, "quic", limits, changes)
    plan = Plan(load_swarm(swarm))
    with flying(plan, swarm, folder, conditions, shifted):
        time.sleep(seconds)
    out = folder / "out"
    line = [sys.executable, "-m", "flockwire_operator", "report", str(out / "trace.mcap")]
    subprocess.run(line, check=False, capture_output=True)
    summary = json.loads((out / "summary.json").read_text())
    return {
        **ages(out / "trace.mcap"),
        "formation tail rms mm": round(1e3 * summary["formation_error_m"]["rms_tail"], 1),
        "closest m": closest(out),
        "clock error ms": clock_error(plan, out, shifted),
    }


def clock_error(plan: Plan, out: Path, shifted: bool) -> float:
    """Return the worst error of a corrected clock that a status has from ten seconds on, ms."""
    first: dict[str, int] = {}
    worst = 0.0
    for _, _, record in published(out / "trace.mcap", "status"):
        status = decode(Status, record.data)
        began = first.setdefault(status.identity, status.stamp)
        if status.stamp - began > 10 * SECOND:
            offset = SHIFTS.get(plan.hosts[status.identity], 0.0) if shifted else 0.0
            worst = max(worst, abs(status.clock_offset + offset))
    return round(1e3 * worst, 2)


def closest(out: Path) -> float:
    """Return the smallest distance between two drones in the air, m, by the kinematics' truth."""
    places: dict[str, Pose] = {}
    least = float("inf")
    for owner, _, record in published(out / "trace.mcap", "truth"):
        places[owner] = decode(Pose, record.data)
        airborne = [p.position for p in places.values() if p.position[2] > IN_THE_AIR]
        least = min([least, *(dist(a, b) for a, b in combinations(airborne, 2))])
    return round(least, 3)


def lossy(loss: int, folder: Path, seconds: float) -> dict[str, Any]:
    """Fly where `loss` % of all frames are lost and the others take long."""
    return flight(folder, seconds, Conditions(loss / 100, 0.05, 0.02), limits=VERY_PATIENT, changes=SLOW)


CASES = {
    "probe": [(link, lambda folder, _, link=link: probed(folder, link)) for link in ("tls", "quic")],
    "partition": [("", partition)],
    "lossy": [(f"{loss} %", partial(lossy, loss)) for loss in LOSSES],
    "clocks": [
        ("true", lambda folder, seconds: flight(folder, seconds, WIRELESS)),
        ("apart", lambda folder, seconds: flight(folder, seconds, WIRELESS, shifted=True)),
    ],
}


def main() -> None:
    """Fly all; print a row for each flight."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=list(CASES))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--out", type=Path, default=Path("runs/hosts"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    results = []
    for _ in range(options.repeats):
        for case in [options.only] if options.only else CASES:
            for variant, fly in CASES[case]:
                with tempfile.TemporaryDirectory() as folder:
                    try:
                        found = fly(Path(folder), options.seconds)
                    except TimeoutError as error:
                        found = {"failed": str(error)}
                results.append({"case": f"{case} {variant}".strip(), **found})
                print(json.dumps(results[-1]), flush=True)
                (options.out / "hosts.json").write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
