"""Opens Zenoh as the plan prescribes, and carries samples between its threads and asyncio.

Every process is a peer that listens on its own endpoint and dials only linked processes before it in the order of
dialling (in router mode: a client of the router). Scouting and gossip are off, every link is mutual TLS. Messages that
may trigger a step cross the threads at once, the others are buffered until a step reads them; of several, the newest
counts.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
import uuid
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from flockwire import clock
from flockwire.runtime.linger import ignore_linger
from flockwire.security.files import Credentials, default_folder, files_of
from flockwire.wire.access import access_control
from flockwire.wire.inbox import ATTACHMENT, Inbox
from flockwire.wire.keys import ROWS, Delivery, Key
from flockwire.wire.plan import Plan

# One runtime thread instead of five: a third less processor time at 100 Hz. Read when zenoh's runtime starts.
os.environ.setdefault(
    "ZENOH_RUNTIME",
    "(rx: (handover: app), acc: (handover: app), net: (handover: app), tx: (handover: app), "
    "app: (worker_threads: 1, max_blocking_threads: 1))",
)

import zenoh

from flockwire.runtime.subscriptions import BACKLOG, Newest, Prompt, Ring, Wakeup

if TYPE_CHECKING:
    from flockwire.wire.messages import Message

BURST = 16  # messages of one step that may wait for the network before the next is dropped; 16 is the most
LARGEST_MESSAGE = 65536  # bytes
SPARE_SESSIONS = 512  # beside one for each link: a holder of one drone's certificate must not exhaust them easily
ACCEPTING = 1000  # connections that may be under way at a time, and ms that each may take
ROUTER_PATIENCE = 500  # ms that one attempt to reach the router may take
NO_DETOURS: Mapping[str, str] = MappingProxyType({})
RETRY = {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5}

_PRIORITIES = {
    Delivery.EVENT: zenoh.Priority.REAL_TIME,  # before all else: Zenoh's highest
    Delivery.STATE: zenoh.Priority.DATA_HIGH,
    Delivery.BACKGROUND: zenoh.Priority.BACKGROUND,
}


class EndpointInUseError(OSError):
    """The process cannot listen at its endpoint of the swarm file."""


class RouterAbsentError(OSError):
    """The router does not answer yet."""


async def connect(
    plan: Plan, identity: str, keys: Path | None, ended: asyncio.Event, detours: Mapping[str, str] = NO_DETOURS
) -> Session | None:
    """Open the session of `identity`, in router mode as soon as the router is there; None when `ended` comes first.

    Raises CredentialsError, and EndpointInUseError.
    """
    waiting = False
    while not ended.is_set():
        try:
            return await asyncio.to_thread(Session, plan, identity, keys, detours)
        except RouterAbsentError:
            if not waiting:
                router = ", ".join(plan.endpoints[router] for router in plan.routers)
                logging.getLogger(identity).info("waits for the router at %s", router)
            waiting = True
    return None


def configuration(
    plan: Plan, identity: str, credentials: Credentials | None, detours: Mapping[str, str] = NO_DETOURS
) -> dict[str, object]:
    """Return the Zenoh configuration of `identity`: endpoints, links, access control, nothing found by itself.

    Without `credentials` nothing is encrypted, authenticated or refused. `detours`: who is dialled elsewhere.
    """
    dialled = {**plan.endpoints, **detours}
    mode = _mode(plan, identity)
    scheme = "tls" if credentials is not None else "tcp"
    link: dict[str, object] = {
        "tx": {"lease": 1000, "keep_alive": 4, "queue": {"size": {"real_time": BURST, "data_high": BURST}}},
        "rx": {"max_message_size": LARGEST_MESSAGE},
    }
    config: dict[str, object] = {
        "mode": mode,
        "listen": {"endpoints": [f"{scheme}/{plan.endpoints[identity]}"] if identity in plan.endpoints else []},
        "connect": {
            "endpoints": [f"{scheme}/{dialled[other]}" for other in plan.dials[identity]],
            "timeout_ms": ROUTER_PATIENCE if mode == "client" else -1,
            "exit_on_failure": mode == "client",
            "retry": RETRY,
        },
        "open": {"return_conditions": {"connect_scouted": False, "declares": False}},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {
            "link": link,
            "unicast": {
                "max_sessions": len(plan.links[identity]) + SPARE_SESSIONS,
                "accept_pending": ACCEPTING,
                "accept_timeout": ACCEPTING,
            },
            "shared_memory": {"enabled": False},
        },
    }
    if credentials is not None:
        link["tls"] = _tls(credentials)
        config["access_control"] = access_control(plan, identity)
    return config


def _mode(plan: Plan, identity: str) -> str:
    if not plan.routers:
        return "peer"
    return "router" if identity in plan.routers else "client"


def _tls(credentials: Credentials) -> dict[str, object]:
    certificate, key = str(credentials.certificate), str(credentials.key)
    return {
        "root_ca_certificate": str(credentials.authority),
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
        "listen_certificate": certificate,
        "listen_private_key": key,
        "connect_certificate": certificate,
        "connect_private_key": key,
    }


class Session:
    """One process's connection to the swarm. Use it as a context manager: a session left open hangs the exit."""

    def __init__(
        self,
        plan: Plan,
        identity: str,
        keys: Path | None = None,
        detours: Mapping[str, str] = NO_DETOURS,
        verified: bool = True,
    ) -> None:
        """Open the session of `identity`; `keys` is the folder of the certificates, the default one without it.

        A process that is in a hurry does not have them `verified`: a peer then rejects a bad one silently.

        Raises CredentialsError, EndpointInUseError, and in router mode RouterAbsentError.
        """
        self._plan, swarm = plan, plan.swarm
        self._publisher_id = uuid.uuid4().bytes
        self._sequences: dict[Key, int] = {}
        credentials = None
        if swarm.network.security == "mtls":
            credentials = _credentials(keys or default_folder(swarm.name), identity, verified)
        config = configuration(plan, identity, credentials, detours)
        ignore_linger()
        try:
            self._zenoh = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
        except zenoh.ZError as error:
            if config["mode"] == "client":
                raise RouterAbsentError from None
            where = plan.endpoints.get(identity, "nowhere")
            raise EndpointInUseError(
                f"{identity} cannot listen at {where} (network.base_port = {swarm.network.base_port}): {_reason(error)}"
            ) from None
        self._publishers = {key: self._declare(key) for key in plan.publishes[identity]}

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the session; one that is left open hangs the process's exit."""
        self._zenoh.close()  # type: ignore[no-untyped-call]

    def publish(self, messages: Iterable[tuple[Key, Message]]) -> None:
        """Publish messages; KeyError when the key table does not let this identity publish one of the keys."""
        for key, message in messages:
            publisher = self._publishers[key]
            sequence = self._sequences.get(key, 0)
            self._sequences[key] = sequence + 1
            publisher.put(message.encode(), attachment=ATTACHMENT.pack(sequence, clock.now(), 16, self._publisher_id))

    def newest(self, key: Key) -> Newest:
        """Subscribe to `key`, buffering its newest sample until it is read."""
        ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(BACKLOG)
        subscriber = self._zenoh.declare_subscriber(self._plan.text(key), ring, allowed_origin=zenoh.Locality.REMOTE)
        return Newest(Inbox(key, ROWS[key.kind]), subscriber)

    def prompt(self, key: Key, wakeup: Wakeup) -> Prompt:
        """Subscribe to `key`; `wakeup` calls its handler in the running loop as soon as a sample is there."""
        prompt = Prompt(Inbox(key, ROWS[key.kind]), wakeup)
        callback = zenoh.handlers.Callback(prompt.arrived, indirect=False)
        self._zenoh.declare_subscriber(self._plan.text(key), callback, allowed_origin=zenoh.Locality.REMOTE)
        return prompt

    def every(self, key: Key, capacity: int) -> Ring:
        """Subscribe to `key` keeping up to `capacity` samples, own ones too, for one that reads them in batches."""
        ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(capacity)
        return self._zenoh.declare_subscriber(self._plan.text(key), ring)

    def linked(self) -> tuple[str, ...]:
        """Return who is at the other end of each link, by authenticated identity (without security: nobody known)."""
        return tuple(sorted(link.auth_identifier or "unknown" for link in self._zenoh.info.links()))

    def _declare(self, key: Key) -> zenoh.Publisher:
        return self._zenoh.declare_publisher(
            self._plan.text(key),
            priority=_PRIORITIES[ROWS[key.kind].delivery],
            congestion_control=zenoh.CongestionControl.DROP,  # waiting for a silent peer would delay all others
            express=ROWS[key.kind].delivery is Delivery.EVENT,
        )


def _credentials(folder: Path, identity: str, verified: bool) -> Credentials:
    files = files_of(folder, identity)
    if not verified and all(path.exists() for path in (files.authority, files.certificate, files.key)):
        return files
    from flockwire.security.credentials import load_credentials  # noqa: PLC0415  (takes 0.1 s)

    return load_credentials(folder, identity, clock.utc())


def _reason(error: zenoh.ZError) -> str:
    text = str(error)
    return "the address is in use" if "in use" in text else text.split(" at ", maxsplit=1)[0]
