"""What bare Zenoh processes cost with a swarm's links, keys, rates and sizes, and with an empty step."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import Any, NamedTuple

from flockwire_core.domain.time import SECOND
from flockwire_core.runtime.configuration import configuration
from flockwire_core.security.files import files_of
from flockwire_core.wire.batch import PERIOD
from flockwire_core.wire.inbox import ATTACHMENT
from flockwire_core.wire.keys import BATCH, ROWS, Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import AGENT, GATEWAY
from traced import published

STARTING = 4.0  # s until all are linked
MEASURED = 8.0  # s
MIDDLE = (0.4, 0.8)  # shares of a flight between which all fly in formation
CADENCE = 100.0  # Hz, of those that answer nothing
PROCESS = Path(__file__).with_name("floor_process.py")


class Traffic(NamedTuple):
    """What each key of a flight carried: bytes and messages per s, by the key's text without the swarm's name."""

    sizes: dict[str, int]
    rates: dict[str, float]


class Floor(NamedTuple):
    """Medians over the agents: share of a core, MB, pose to command in ms; and the gateway's share of a core.

    `late_1ms` and `late_5ms` are the shares of steps that begin later than that after their pose was sent.
    """

    agent_cpu: float
    agent_mb: float
    p50: float
    p99: float
    gateway_cpu: float
    late_1ms: float
    late_5ms: float


def traffic(trace: Path) -> Traffic:
    """Return what every process's keys carried in the middle of the flight of `trace`."""
    records = [(f"{owner}/{kind}", record) for owner, kind, record in published(trace, *ROWS)]
    first, last = (extreme(record.log_time for _, record in records) for extreme in (min, max))
    begin, end = (first + share * (last - first) for share in MIDDLE)
    sizes: dict[str, list[int]] = defaultdict(list)
    for key, record in records:
        if begin <= record.log_time < end:
            sizes[key].append(len(record.data) + ATTACHMENT.size)
    rates = {key: len(found) / ((end - begin) / SECOND) for key, found in sizes.items()}
    return Traffic({key: round(statistics.median(found)) for key, found in sizes.items()}, rates)


def floor(plan: Plan, keys: Path, carried: Traffic) -> Floor:
    """Run a bare process for each one of `plan`, linked by the certificates in `keys`; returns what they cost."""
    begin = time.monotonic() + STARTING
    running = {}
    for identity in plan.started:
        running[identity] = subprocess.Popen(
            [sys.executable, str(PROCESS)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        stdin = running[identity].stdin
        assert stdin is not None
        json.dump(_task(plan, identity, keys, carried) | {"begin": begin, "end": begin + MEASURED}, stdin)
        stdin.close()
    found = {}
    for identity, process in running.items():
        assert process.stdout is not None
        found[identity] = json.loads(process.stdout.read())
        process.wait()
    agents = [found[identity] for identity in plan.of_kind(AGENT.kind)]
    latencies, delays = (sorted(ns / 1e6 for agent in agents for ns in agent[name]) for name in ("latencies", "delays"))
    cpu, resident = (statistics.median(agent[name] for agent in agents) for name in ("cpu", "mb"))
    p50, p99 = statistics.median(latencies), latencies[int(0.99 * len(latencies))]
    late = (sum(delay > limit for delay in delays) / len(delays) for limit in (1.0, 5.0))
    return Floor(cpu, resident, p50, p99, found[GATEWAY.kind]["cpu"], *late)


def _task(plan: Plan, identity: str, keys: Path, carried: Traffic) -> dict[str, Any]:
    """Return what floor_process.py is to do for `identity`; an agent answers its own pose."""
    config = configuration(plan, identity, files_of(keys, identity))
    del config["access_control"]
    trigger = Key("pose", identity) if plan.rows[identity] is AGENT else None
    return {
        "config": config,
        "subscribe": [plan.text(key) for key in plan.subscribes[identity] if key != trigger],
        "trigger": plan.text(trigger) if trigger is not None else "",
        "cadence": carried.rates[_name(trigger)] if trigger is not None else CADENCE,
        "publish": [
            (plan.text(key), carried.sizes[_name(key)], carried.rates[_name(key)])
            for key in plan.publishes[identity]
            if _name(key) in carried.sizes and plan.subscribers(key)
        ]
        + _batches(plan, identity, carried),
    }


def _batches(plan: Plan, identity: str, carried: Traffic) -> list[tuple[str, int, float]]:
    """Return what `identity` sends to the recorder in batches: the key, bytes and messages per s."""
    names = [_name(key) for key in plan.publishes[identity] if key in plan.batched and _name(key) in carried.sizes]
    rate = SECOND / PERIOD
    size = sum(carried.sizes[name] * carried.rates[name] for name in names) / rate
    return [(plan.text(Key(BATCH, identity)), round(size), rate)] if names else []


def _name(key: Key) -> str:
    return f"{key.owner}/{key.kind}"
