"""Opens Zenoh as the key table and the graph prescribe, and carries samples between its threads and asyncio.

Every process is a peer that listens on its own endpoint and dials only linked processes before it in the order of
dialling. Scouting and gossip are off. Messages that trigger a step cross the threads once, at once, and only the newest
waits; all others rest in a ring of one until a step reads them.
"""

from __future__ import annotations

import asyncio
import json
import os
import uuid
from collections.abc import Callable
from typing import TYPE_CHECKING

from flockwire import clock, policy
from flockwire.inbox import ATTACHMENT, Inbox, Received
from flockwire.keys import ROWS, Delivery, Key, key_text
from flockwire.wiring import endpoints

# One runtime thread instead of five: a third less processor time at 100 Hz. Read when zenoh's runtime starts.
os.environ.setdefault(
    "ZENOH_RUNTIME",
    "(rx: (handover: app), acc: (handover: app), net: (handover: app), tx: (handover: app), "
    "app: (worker_threads: 1, max_blocking_threads: 1))",
)

import zenoh

if TYPE_CHECKING:
    from flockwire.config import Swarm
    from flockwire.messages import Message

BURST = 16  # messages of one step that may wait for the network before the next is dropped; 16 is the most
RETRY = {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5}

_QOS = {
    Delivery.STATE: (zenoh.Priority.REAL_TIME, zenoh.CongestionControl.DROP),
    Delivery.EVENT: (zenoh.Priority.INTERACTIVE_HIGH, zenoh.CongestionControl.BLOCK),
    Delivery.BACKGROUND: (zenoh.Priority.BACKGROUND, zenoh.CongestionControl.DROP),
}


Subscription = zenoh.Subscriber[zenoh.Handler[zenoh.Sample]]


class EndpointInUseError(OSError):
    """The process cannot listen where the swarm file says."""


def configuration(swarm: Swarm, identity: str) -> dict[str, object]:
    """Return the Zenoh configuration of `identity`: endpoints, links, nothing found by itself."""
    address = endpoints(swarm)
    scheme = swarm.network.transport
    return {
        "mode": "peer",
        "listen": {"endpoints": [f"{scheme}/{address[identity]}"] if identity in address else []},
        "connect": {
            "endpoints": [f"{scheme}/{address[other]}" for other in policy.dials(swarm, identity)],
            "timeout_ms": -1,
            "exit_on_failure": False,
            "retry": RETRY,
        },
        "open": {"return_conditions": {"connect_scouted": False, "declares": False}},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {
            "link": {"tx": {"lease": 1000, "keep_alive": 4, "queue": {"size": {"real_time": BURST}}}},
            "shared_memory": {"enabled": False},
        },
    }


class Session:
    """One process's connection to the swarm. Use it as a context manager: a session left open hangs the exit."""

    def __init__(self, swarm: Swarm, identity: str) -> None:
        self._swarm = swarm
        self._publisher_id = uuid.uuid4().bytes
        self._sequences: dict[Key, int] = {}
        zenoh.init_log_from_env_or("off")
        config = configuration(swarm, identity)
        try:
            self._zenoh = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
        except zenoh.ZError as error:
            where = endpoints(swarm).get(identity, "nowhere")
            raise EndpointInUseError(
                f"{identity} cannot listen at {where} (network.base_port = {swarm.network.base_port}): {_reason(error)}"
            ) from None
        self._publishers = {key: self._declare(key) for key in policy.says(swarm, identity)}

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self._zenoh.close()  # type: ignore[no-untyped-call]

    def publish(self, key: Key, message: Message) -> None:
        """Send a message; KeyError when the key table does not let this identity say `key`."""
        publisher = self._publishers[key]
        sequence = self._sequences.get(key, 0)
        self._sequences[key] = sequence + 1
        publisher.put(message.encode(), attachment=ATTACHMENT.pack(sequence, clock.now(), 16, self._publisher_id))

    def newest(self, key: Key) -> Newest:
        """Subscribe to `key`, keeping its newest sample until it is asked for."""
        ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(1)
        subscriber = self._zenoh.declare_subscriber(
            key_text(self._swarm, key), ring, allowed_origin=zenoh.Locality.REMOTE
        )
        return Newest(Inbox(key, ROWS[key.kind]), subscriber)

    def prompt(self, key: Key, wake: Callable[[Prompt], None]) -> Prompt:
        """Subscribe to `key`; `wake` is called in the running loop as soon as a sample is there."""
        prompt = Prompt(Inbox(key, ROWS[key.kind]), wake)
        callback = zenoh.handlers.Callback(prompt.arrived, indirect=False)
        self._zenoh.declare_subscriber(key_text(self._swarm, key), callback, allowed_origin=zenoh.Locality.REMOTE)
        return prompt

    def every(self, key: Key, capacity: int) -> Subscription:
        """Subscribe to `key` keeping up to `capacity` samples, own ones too, for one who reads them in batches."""
        ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(capacity)
        return self._zenoh.declare_subscriber(key_text(self._swarm, key), ring)

    def linked(self) -> int:
        """Return the number of processes that this one is linked to."""
        return len(self._zenoh.info.peers_zid())

    def _declare(self, key: Key) -> zenoh.Publisher:
        priority, congestion = _QOS[ROWS[key.kind].delivery]
        return self._zenoh.declare_publisher(
            key_text(self._swarm, key),
            priority=priority,
            congestion_control=congestion,
            express=ROWS[key.kind].delivery is not Delivery.BACKGROUND,
        )


class Newest:
    """The newest sample of a key, read when a step wants it."""

    def __init__(self, inbox: Inbox, subscriber: Subscription) -> None:
        self.inbox = inbox
        self._subscriber = subscriber

    def take(self, now: int) -> Received | None:
        """Return the message that came since the last call, None when there is none or it was turned away."""
        sample = self._subscriber.try_recv()
        return None if sample is None else self.inbox.accept(*_bytes(sample), now)

    def message(self, now: int) -> Message | None:
        """Return only the message of what `take` returns."""
        received = self.take(now)
        return None if received is None else received.message


class Prompt:
    """The newest sample of a key, announced as soon as it arrives."""

    def __init__(self, inbox: Inbox, wake: Callable[[Prompt], None]) -> None:
        self.inbox = inbox
        self._wake = wake
        self._loop = asyncio.get_running_loop()
        self._sample: zenoh.Sample | None = None
        self._announced = False

    def arrived(self, sample: zenoh.Sample) -> None:
        """Keep the sample and wake the loop. Called by Zenoh, in its thread."""
        self._sample = sample
        if not self._announced:
            self._announced = True
            try:
                self._loop.call_soon_threadsafe(self._wake, self)
            except RuntimeError:  # the loop is closed: the process is ending
                return

    def take(self, now: int) -> Received | None:
        """Return the message that came since the last call, None when there is none or it was turned away."""
        self._announced = False
        sample, self._sample = self._sample, None
        return None if sample is None else self.inbox.accept(*_bytes(sample), now)

    def message(self, now: int) -> Message | None:
        """Return only the message of what `take` returns."""
        received = self.take(now)
        return None if received is None else received.message


def _bytes(sample: zenoh.Sample) -> tuple[bytes, bytes]:
    attached = sample.attachment
    return sample.payload.to_bytes(), attached.to_bytes() if attached is not None else b""


def _reason(error: zenoh.ZError) -> str:
    text = str(error)
    return "the address is in use" if "in use" in text else text.split(" at ", maxsplit=1)[0]
