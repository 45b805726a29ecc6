"""A trace in ROS 2, as if it flew now, with the clock of the flight: `flockwire ros SWARM --trace TRACE`."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Iterator
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ros.messages import clock_reading
from flockwire_core.runtime.ros_node import join
from flockwire_core.trace_files import parts
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_recorder.records import WholeRecords, messages

from flockwire_operator.ros.core import PERIOD
from flockwire_operator.ros.mirror import Mirror, Outgoing, Publication
from flockwire_operator.ros.process import place_of, remedy
from flockwire_operator.ros.topics import SIM_CLOCK, all_topics

NAME = "ros_replay"

Recorded = tuple[int, Key, Message]  # when it was recorded (Unix ns), its key, the message


class Replay:
    """The publications of `recorded`, messages of the swarm of `plan` in the order of their recording."""

    def __init__(self, plan: Plan, recorded: Iterable[Recorded]) -> None:
        self._mirror = Mirror(plan)
        self._recorded = iter(recorded)
        self._next = next(self._recorded, None)
        self.begin = self._next[0] if self._next is not None else 0  # Unix ns

    @property
    def over(self) -> bool:
        """Whether all has been published."""
        return self._next is None

    def until(self, now: int) -> list[Publication]:
        """Return what is to be published up to the time `now` of the flight (Unix ns), and its clock first."""
        while self._next is not None and self._next[0] <= now:
            _, key, message = self._next
            self._mirror.receive(key, message)
            self._next = next(self._recorded, None)
        return [(SIM_CLOCK, clock_reading(now)), *self._mirror.publications(now)]


def read_messages(plan: Plan, path: Path) -> Iterator[Recorded]:
    """Yield the messages of the trace `path` with its other parts; other topics and malformed messages are left out.

    Raises ValueError for a file that is not MCAP, OSError for one that cannot be read.
    """
    for part in parts(path):
        for key, message, _, record in messages(plan, WholeRecords(part)):
            if key is not None and message is not None:
                yield record.log_time, key, message


def play(plan: Plan, trace: Path, pace: float) -> None:
    """Publish a trace, `pace` times as fast as it was recorded; returns at its end.

    Raises ValueError if it is no trace, or has nothing of this swarm, OSError if it cannot be read.
    """
    replay = Replay(plan, read_messages(plan, trace))
    if replay.over:
        raise ValueError(f"{trace}: has no message of swarm {plan.swarm.name!r}")
    asyncio.run(_play(plan, replay, pace))


async def _play(plan: Plan, replay: Replay, pace: float) -> None:
    waits = remedy(plan.swarm)
    ended = asyncio.Event()
    node = await join(place_of(plan.swarm, NAME), ended, lambda why: print(f"flockwire: {waits} ({why})", flush=True))
    if node is None:
        return
    with node:
        outputs = {topic: node.publisher(*topic) for topic in (*all_topics(plan), SIM_CLOCK)}
        begun = due = clock.monotonic()
        outgoing = Outgoing()
        while not replay.over or len(outgoing):
            outgoing.add(replay.until(replay.begin + round((clock.monotonic() - begun) * pace)))
            for topic, payload in outgoing.take():
                outputs[topic].publish(payload)
            due = max(due + nanoseconds(PERIOD), clock.monotonic())
            await asyncio.sleep((due - clock.monotonic()) / SECOND)
