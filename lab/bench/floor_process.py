"""One bare Zenoh process: reads as JSON from its standard input what it is to do, and writes what that cost.

It subscribes to the keys `subscribe`, and publishes constant bytes on `publish`, a list of [key, bytes, per second]: in
the callback of each message of the key `trigger`, which come `cadence` times a second, or without one at `cadence`.
`begin` and `end` (s, monotonic clock) are when it is measured. This file imports nothing of flockwire, which would be
part of what is measured.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import zenoh


class Publishers:
    """The keys of `given`, a list of [key, bytes, per second], each published `cadence` times a second in all."""

    def __init__(self, session: zenoh.Session, given: list[list[Any]], cadence: float) -> None:
        self._rows = [
            [
                session.declare_publisher(
                    key,
                    priority=zenoh.Priority.DATA_HIGH,
                    congestion_control=zenoh.CongestionControl.DROP,
                ),
                bytes(max(0, size - 8)),
                rate / cadence,
                0.0,
            ]
            for key, size, rate in given
        ]

    def step(self, stamp: int) -> None:
        """Publish what is due, each with the `stamp`, ns."""
        head = stamp.to_bytes(8, "little")
        for row in self._rows:
            publisher, body, share, owed = row
            owed += share
            while owed >= 1.0:
                publisher.put(head + body)
                owed -= 1.0
            row[3] = owed


def main() -> None:
    """Do it."""
    task = json.load(sys.stdin)
    session = zenoh.open(zenoh.Config.from_json5(json.dumps(task["config"])))
    publishers = Publishers(session, task["publish"], task["cadence"])
    delays: list[int] = []
    latencies: list[int] = []

    def triggered(sample: zenoh.Sample) -> None:
        stamp = int.from_bytes(sample.payload.to_bytes()[:8], "little")
        delays.append(time.monotonic_ns() - stamp)
        publishers.step(stamp)
        latencies.append(time.monotonic_ns() - stamp)

    held = [session.declare_subscriber(key, zenoh.handlers.RingChannel(1)) for key in task["subscribe"]]
    if task["trigger"]:
        answered = session.declare_subscriber(task["trigger"], zenoh.handlers.Callback(triggered, indirect=False))
    marks = []
    due = time.monotonic()
    for moment in (task["begin"], task["end"]):
        while due < moment:
            due = moment if task["trigger"] else due + 1.0 / task["cadence"]
            time.sleep(max(0.0, due - time.monotonic()))
            if not task["trigger"]:
                publishers.step(time.monotonic_ns())
            for ring in held:
                ring.try_recv()
        marks.append((time.process_time(), len(latencies)))
    (before, first), (after, last) = marks
    share = (after - before) / (task["end"] - task["begin"])
    (peak,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    found = {"cpu": share, "mb": int(peak.split()[1]) / 1024}
    print(json.dumps(found | {"delays": delays[first:last], "latencies": latencies[first:last]}))
    if task["trigger"]:
        answered.undeclare()
    session.close()  # type: ignore[no-untyped-call]


if __name__ == "__main__":
    main()
