"""The ends of a node in the ROS graph: what it publishes, what it receives, and the requests that it answers.

Inputs are bounded: what is too large, too much or of another form is dropped and counted.
"""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import Callable, Iterable
from typing import NamedTuple

import zenoh
import zenoh.ext

from flockwire_core import clock
from flockwire_core.ros.graph import topic_of
from flockwire_core.ros.messages import check_empty, trigger_response
from flockwire_core.runtime.samples import call_soon
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.inbox import ATTACHMENT, Origin, read_attachment

LARGEST = 16384  # bytes of a message from the ROS side, and of its attachment
CAPACITY = 256  # messages of one topic that wait at most
MOST_REQUESTS = 16  # requests of one service that wait at most


class Arrived(NamedTuple):
    """A message from the ROS side: its topic, its payload (CDR), and its attachment's content."""

    topic: str
    payload: bytes
    origin: Origin


class RosInput:
    """The messages of one topic, or of all that a `*` in its name means; `wake` is called when some have come."""

    def __init__(self, counts: Counter[str], wake: Callable[[], None] | None) -> None:
        self._counts, self._wake = counts, wake
        self._loop = asyncio.get_running_loop()
        self._waiting: deque[zenoh.Sample] = deque(maxlen=CAPACITY)
        self._announced = False

    def arrived(self, sample: zenoh.Sample) -> None:
        """Buffer a sample. Called by Zenoh, in its thread."""
        if _is_large(sample.payload, sample.attachment):
            self._counts["ROS messages too large"] += 1
            return
        if len(self._waiting) == CAPACITY:
            self._counts["ROS messages too many"] += 1
        self._waiting.append(sample)
        if self._wake is not None and not self._announced:
            self._announced = True
            call_soon(self._loop, self._wake)

    def take(self) -> list[Arrived]:
        """Return the messages since the last call, the oldest first."""
        self._announced = False
        found = []
        for _ in range(len(self._waiting)):
            sample = self._waiting.popleft()
            attached = sample.attachment
            try:
                origin = read_attachment(attached.to_bytes() if attached is not None else b"")
            except MessageError:
                self._counts["ROS messages malformed"] += 1
                continue
            found.append(Arrived(topic_of(str(sample.key_expr)), sample.payload.to_bytes(), origin))
        return found


class RosOutput:
    """A topic to publish on."""

    def __init__(self, publisher: zenoh.Publisher | zenoh.ext.AdvancedPublisher, identity: bytes) -> None:
        self._put, self._identity, self._sequence = publisher.put, identity, 0

    def publish(self, payload: bytes) -> None:
        """Publish a message (CDR)."""
        self._sequence += 1
        self._put(payload, attachment=ATTACHMENT.pack(self._sequence, clock.now(), 16, self._identity))


class Request:
    """A request of a std_srvs/Trigger, to be answered once."""

    def __init__(self, name: str, query: zenoh.Query, origin: Origin) -> None:
        self.name, self._query, self._origin = name, query, origin

    def answer(self, success: bool, message: str) -> None:
        """Respond to whoever asked; harmless if it is gone."""
        attached = ATTACHMENT.pack(self._origin.sequence, clock.now(), 16, self._origin.publisher)
        with self._query as query:
            query.reply(query.key_expr, trigger_response(success, message), attachment=attached)


class RosServices:
    """The requests of the services `names` that the node serves."""

    def __init__(self, names: Iterable[str], counts: Counter[str]) -> None:
        self._counts = counts  # of dropped requests
        self._waiting = {name: deque[zenoh.Query]() for name in names}  # a flood of one service blocks no other

    def arrived(self, name: str, key: str, query: zenoh.Query) -> None:
        """Buffer a request of the service `name`, whose key is `key`. Called by Zenoh, in its thread."""
        waiting = self._waiting[name]
        if str(query.key_expr) != key:  # one query of many keys would be the request of all services
            self._drop(query, "of several services", "a request is of one service")
        elif _is_large(query.payload, query.attachment):
            self._drop(query, "too large", "too large")
        elif len(waiting) >= MOST_REQUESTS:
            self._drop(query, "too many", "too many requests")
        else:
            waiting.append(query)

    def take(self) -> list[Request]:
        """Return the requests since the last call; one of another form gets an error as its reply."""
        taken = [(name, waiting.popleft()) for name, waiting in self._waiting.items() for _ in range(len(waiting))]
        found = []
        for name, query in taken:
            payload, attached = query.payload, query.attachment
            try:
                if payload is None or attached is None:
                    raise MessageError("a request has a payload and an attachment")
                check_empty(payload.to_bytes())
                origin = read_attachment(attached.to_bytes())
            except MessageError as error:
                self._drop(query, "malformed", str(error))
            else:
                found.append(Request(name, query, origin))
        return found

    def _drop(self, query: zenoh.Query, what: str, why: str) -> None:
        self._counts[f"ROS requests {what}"] += 1
        with query:
            query.reply_err(why.encode())


def _is_large(*parts: zenoh.ZBytes | None) -> bool:
    return any(part is not None and len(part) > LARGEST for part in parts)
