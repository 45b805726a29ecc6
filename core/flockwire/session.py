"""Opens Zenoh as the key table and the graph prescribe, and carries samples between its threads and asyncio.

Every process is a peer that listens on its own endpoint and dials only linked processes before it in the order of
dialling (in router mode: a client of the router). Scouting and gossip are off, every link is mutual TLS. Messages that
trigger a step cross the threads at once, the others rest until a step reads them; of several, the newest counts.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
import uuid
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from flockwire import clock, policy
from flockwire.credentials import Credentials, default_folder, load_credentials
from flockwire.inbox import ATTACHMENT, Inbox
from flockwire.keys import ROWS, Delivery, Key, key_text
from flockwire.wiring import ROUTER, endpoints

# One runtime thread instead of five: a third less processor time at 100 Hz. Read when zenoh's runtime starts.
os.environ.setdefault(
    "ZENOH_RUNTIME",
    "(rx: (handover: app), acc: (handover: app), net: (handover: app), tx: (handover: app), "
    "app: (worker_threads: 1, max_blocking_threads: 1))",
)

import zenoh

from flockwire.sources import BACKLOG, Newest, Prompt, Subscription

if TYPE_CHECKING:
    from flockwire.config import Swarm
    from flockwire.messages import Message

BURST = 16  # messages of one step that may wait for the network before the next is dropped; 16 is the most
LARGEST_MESSAGE = 65536  # bytes
SPARE_SESSIONS = 64  # beside one for each link: operators come and go, and nobody alone may keep a stop out
ROUTER_PATIENCE = 500  # ms that one attempt to reach the router may take
NO_DETOURS: Mapping[str, str] = MappingProxyType({})
RETRY = {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5}

_QOS = {
    Delivery.STATE: (zenoh.Priority.REAL_TIME, zenoh.CongestionControl.DROP),
    Delivery.EVENT: (zenoh.Priority.INTERACTIVE_HIGH, zenoh.CongestionControl.BLOCK),
    Delivery.BACKGROUND: (zenoh.Priority.BACKGROUND, zenoh.CongestionControl.DROP),
}


class EndpointInUseError(OSError):
    """The process cannot listen where the swarm file says."""


class RouterAbsentError(OSError):
    """The router does not answer yet."""


async def connect(
    swarm: Swarm, identity: str, keys: Path | None, ended: asyncio.Event, detours: Mapping[str, str] = NO_DETOURS
) -> Session | None:
    """Open the session of `identity`, in router mode as soon as the router is there; None when `ended` comes first.

    Raises CredentialsError, and EndpointInUseError.
    """
    waiting = False
    while not ended.is_set():
        try:
            return await asyncio.to_thread(Session, swarm, identity, keys, detours)
        except RouterAbsentError:
            if not waiting:
                logging.getLogger(identity).info("waits for the router at %s", endpoints(swarm)[ROUTER])
            waiting = True
    return None


def configuration(
    swarm: Swarm, identity: str, credentials: Credentials | None, detours: Mapping[str, str] = NO_DETOURS
) -> dict[str, object]:
    """Return the Zenoh configuration of `identity`: endpoints, links, access control, nothing found by itself.

    Without `credentials` nothing is encrypted, authenticated or refused. `detours`: who is dialled elsewhere.
    """
    address = endpoints(swarm)
    dialled = {**address, **detours}
    kind = "peer" if swarm.network.mode == "peers" else "router" if identity == ROUTER else "client"
    scheme = "tls" if credentials is not None else "tcp"
    link: dict[str, object] = {
        "tx": {"lease": 1000, "keep_alive": 4, "queue": {"size": {"real_time": BURST}}},
        "rx": {"max_message_size": LARGEST_MESSAGE},
    }
    config: dict[str, object] = {
        "mode": kind,
        "listen": {"endpoints": [f"{scheme}/{address[identity]}"] if identity in address else []},
        "connect": {
            "endpoints": [f"{scheme}/{dialled[other]}" for other in policy.dials(swarm, identity)],
            "timeout_ms": ROUTER_PATIENCE if kind == "client" else -1,
            "exit_on_failure": kind == "client",
            "retry": RETRY,
        },
        "open": {"return_conditions": {"connect_scouted": False, "declares": False}},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {
            "link": link,
            "unicast": {"max_sessions": len(policy.links(swarm, identity)) + SPARE_SESSIONS},
            "shared_memory": {"enabled": False},
        },
    }
    if credentials is not None:
        certificate, key = str(credentials.certificate), str(credentials.key)
        link["tls"] = {
            "root_ca_certificate": str(credentials.authority),
            "enable_mtls": True,
            "verify_name_on_connect": True,
            "close_link_on_expiration": True,
            "listen_certificate": certificate,
            "listen_private_key": key,
            "connect_certificate": certificate,
            "connect_private_key": key,
        }
        config["access_control"] = policy.access_control(swarm, identity)
    return config


class Session:
    """One process's connection to the swarm. Use it as a context manager: a session left open hangs the exit."""

    def __init__(
        self, swarm: Swarm, identity: str, keys: Path | None = None, detours: Mapping[str, str] = NO_DETOURS
    ) -> None:
        """Open the session of `identity`; `keys` is the folder of the certificates, the default one without it.

        Raises CredentialsError, EndpointInUseError, and in router mode RouterAbsentError.
        """
        self._swarm = swarm
        self._publisher_id = uuid.uuid4().bytes
        self._sequences: dict[Key, int] = {}
        credentials = None
        if swarm.network.security == "mtls":
            credentials = load_credentials(keys or default_folder(swarm.name), identity, clock.utc())
        config = configuration(swarm, identity, credentials, detours)
        try:
            self._zenoh = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
        except zenoh.ZError as error:
            if config["mode"] == "client":
                raise RouterAbsentError from None
            where = endpoints(swarm).get(identity, "nowhere")
            raise EndpointInUseError(
                f"{identity} cannot listen at {where} (network.base_port = {swarm.network.base_port}): {_reason(error)}"
            ) from None
        self._publishers = {key: self._declare(key) for key in policy.says(swarm, identity)}

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the session; one that is left open hangs the process's exit."""
        self._zenoh.close()  # type: ignore[no-untyped-call]

    def publish(self, messages: Iterable[tuple[Key, Message]]) -> None:
        """Send messages; KeyError when the key table does not let this identity say one of the keys."""
        for key, message in messages:
            publisher = self._publishers[key]
            sequence = self._sequences.get(key, 0)
            self._sequences[key] = sequence + 1
            publisher.put(message.encode(), attachment=ATTACHMENT.pack(sequence, clock.now(), 16, self._publisher_id))

    def newest(self, key: Key) -> Newest:
        """Subscribe to `key`, keeping its newest sample until it is asked for."""
        ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(BACKLOG)
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

    def linked(self) -> tuple[str, ...]:
        """Return who is at the other end of each link, by authenticated identity (without security: nobody known)."""
        return tuple(sorted(link.auth_identifier or "unknown" for link in self._zenoh.info.links()))

    def _declare(self, key: Key) -> zenoh.Publisher:
        priority, congestion = _QOS[ROWS[key.kind].delivery]
        return self._zenoh.declare_publisher(
            key_text(self._swarm, key),
            priority=priority,
            congestion_control=congestion,
            express=ROWS[key.kind].delivery is Delivery.EVENT,
        )


def _reason(error: zenoh.ZError) -> str:
    text = str(error)
    return "the address is in use" if "in use" in text else text.split(" at ", maxsplit=1)[0]
