"""Opens Zenoh by the plan, and passes samples between its threads and asyncio.

Every process is a peer that listens on its own endpoint and dials only linked processes before it in the order of
dialling (in router mode: a client of the router). Scouting and gossip are off, every link is mutual TLS. Messages that
may trigger a step cross the threads at once; of the others the newest is buffered until a step reads it.

A process that listens has two Zenoh sessions: one for the links to processes, and one that is reserved for operators.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.runtime.configuration import NO_DETOURS, ONE_THREAD, ROUTING, configuration
from flockwire_core.runtime.gate import Gate, raise_limit
from flockwire_core.runtime.linger import ignore_linger
from flockwire_core.security.files import Credentials, CredentialsError, default_folder, files_of, hold
from flockwire_core.wire.inbox import Inbox
from flockwire_core.wire.keys import ROWS, Delivery, Key
from flockwire_core.wire.plan import Plan, port_of
from flockwire_core.wire.processes import Link

# One runtime thread instead of five: a third less processor time at 100 Hz. It is read when Zenoh's runtime starts. A
# value of the caller's shell is not used: a bad one ends this process when an order opens its session.
os.environ["ZENOH_RUNTIME"] = ONE_THREAD

import zenoh

from flockwire_core.runtime.samples import BACKLOG, Buffered, Prompt, Publishing, Rings, Wakeup

_PRIORITIES = {
    Delivery.EVENT: zenoh.Priority.REAL_TIME,  # Zenoh's highest priority
    Delivery.STATE: zenoh.Priority.DATA_HIGH,
    Delivery.BACKGROUND: zenoh.Priority.BACKGROUND,
}

LATEST = (1 << 31) * SECOND  # ns: messages carry seconds in 32 bits
STRANGERS = 16  # connections of one address that are not authenticated
BAD_CLOCK = "this machine's clock says {utc:%Y-%m-%d}, and messages carry times from 1970 to 2038-01-19; set the clock"
NOT_UTF_8 = "{folder}: the name of this keys folder is not UTF-8, which Zenoh reads; name another one with --keys"
UNKNOWN = "unknown"  # the identity at the other end of a link without security


class ClockError(CredentialsError):
    """No message can carry the time of this machine's clock."""


class EndpointInUseError(OSError):
    """The process cannot listen at its endpoint of the swarm file."""


class RouterAbsentError(OSError):
    """The router does not answer yet."""


def use_router_threads() -> None:
    """Prepare this process, before its first session, for passing on messages of others.

    A message that its sender has blocked on waits in the receiving thread for room in a queue, so another thread must
    empty that queue: with one for both, nothing passes for 5 s, and Zenoh closes the link of whoever was to receive it.
    """
    os.environ["ZENOH_RUNTIME"] = ROUTING


async def connect(
    plan: Plan,
    identity: str,
    keys: Path | None,
    ended: asyncio.Event,
    detours: Mapping[str, str] = NO_DETOURS,
    note: Callable[[str], None] | None = None,
) -> Session | None:
    """Open the session of `identity`, in router mode when the router answers; None if `ended` is first.

    What it waits for goes to `note`, the log without one. Raises CredentialsError, and EndpointInUseError.
    """
    waiting = False
    while not ended.is_set():
        try:
            return await asyncio.to_thread(Session, plan, identity, keys, detours)
        except RouterAbsentError:
            if not waiting:
                router = ", ".join(plan.endpoints[router] for router in plan.routers)
                (note or logging.getLogger(identity).info)(f"waits for the router at {router}")
            waiting = True
    return None


class Session(contextlib.AbstractContextManager["Session"]):
    """One process's connection to the swarm. Use it as a context manager: an open session blocks the exit."""

    def __init__(
        self,
        plan: Plan,
        identity: str,
        keys: Path | None = None,
        detours: Mapping[str, str] = NO_DETOURS,
        verified: bool = True,
    ) -> None:
        """Open the session of `identity`; `keys` is the folder of the certificates, the default one without it.

        An urgent order does not have them `verified` (0.1 s): a peer then rejects a bad one silently.

        Raises CredentialsError, EndpointInUseError, and in router mode RouterAbsentError.
        """
        if not 0 <= clock.now() < LATEST:
            raise ClockError(BAD_CLOCK.format(utc=clock.utc()))
        self.plan, self.identity, swarm = plan, identity, plan.swarm
        self._publishing: Publishing | None = None
        credentials, folder = None, keys or default_folder(swarm.name)
        if swarm.network.security == "mtls":
            credentials = _credentials(plan, folder, identity, verified)
        ignore_linger()
        raise_limit()
        if plan.rows[identity].link is Link.ROUTER:
            use_router_threads()
        self._sessions: list[zenoh.Session] = []
        self._gates: list[Gate] = []
        self._held = hold(folder) if credentials is not None else None
        with contextlib.ExitStack() as stack:
            stack.callback(self.close)
            self._open(plan.endpoints.get(identity, "nowhere"), configuration(plan, identity, credentials, detours))
            if credentials is not None and identity in plan.reserved:
                self._open(plan.reserved[identity], configuration(plan, identity, credentials, reserved=True))
                self._guard(plan.endpoints[identity], len(plan.links[identity]))
                self._guard(plan.reserved[identity])
            stack.pop_all()
        clock.settle()
        self._publishing = Publishing(plan, identity, uuid.uuid4().bytes, self._declare)
        self.publish = self._publishing.publish

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Send what is collected and close the session; an open one blocks the process's exit."""
        if self._publishing is not None:
            self._publishing.flush()
            self._publishing = None
        for gate in self._gates:
            gate.close()
        for session in self._sessions:
            session.close()  # type: ignore[no-untyped-call]
        if self._held is not None:
            self._held.close()

    def buffered(self, key: Key) -> Buffered:
        """Subscribe to `key`, buffering its newest BACKLOG samples until they are read."""
        return Buffered(Inbox(key), self.every(key, BACKLOG, zenoh.Locality.REMOTE))

    def prompt(self, key: Key, wakeup: Wakeup) -> Prompt:
        """Subscribe to `key`; `wakeup` calls its handler in the running loop as soon as a sample arrives."""
        prompt = Prompt(Inbox(key), wakeup)
        callback = zenoh.handlers.Callback(prompt.arrived, indirect=False)
        for session in self._carrying(key in self.plan.from_operators):
            session.declare_subscriber(self.plan.text(key), callback, allowed_origin=zenoh.Locality.REMOTE)
        return prompt

    def every(self, key: Key, capacity: int, origin: zenoh.Locality = zenoh.Locality.ANY) -> Rings:
        """Subscribe to `key` and buffer up to `capacity` samples, own ones too unless the `origin` is remote."""
        rings = []
        for session in self._carrying(key in self.plan.from_operators):
            ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(capacity)
            rings.append(session.declare_subscriber(self.plan.text(key), ring, allowed_origin=origin))
        return Rings(rings)

    def linked(self) -> tuple[str, ...]:
        """Return the authenticated identity at the other end of each link (unknown without security)."""
        links = [link for session in self._sessions for link in session.info.links()]
        return tuple(sorted(link.auth_identifier or UNKNOWN for link in links))

    def guard(self) -> None:
        """Shut out addresses whose connections make others wait; call it about once a second."""
        for gate in self._gates:
            gate.look(clock.monotonic())

    def _guard(self, endpoint: str, links: int = 0) -> None:
        session = self._sessions[len(self._gates)]
        self._gates.append(Gate(port_of(endpoint), links + STRANGERS, lambda: len(session.info.links())))

    def _open(self, where: str, config: dict[str, object]) -> None:
        try:
            self._sessions.append(zenoh.open(zenoh.Config.from_json5(json.dumps(config))))
        except zenoh.ZError as error:
            if config["mode"] == "client":
                raise RouterAbsentError from None
            base = self.plan.swarm.network.base_port
            raise EndpointInUseError(
                f"{self.identity} cannot listen at {where} (network.base_port = {base}): {_reason(error)}"
            ) from None

    def _carrying(self, operators: bool) -> list[zenoh.Session]:
        """Return the sessions of a key, with or without the one for operators."""
        return self._sessions if operators else self._sessions[:1]

    def _declare(self, key: Key) -> tuple[zenoh.Publisher, ...]:
        return tuple(
            session.declare_publisher(
                self.plan.text(key),
                priority=_PRIORITIES[ROWS[key.kind].delivery],
                congestion_control=zenoh.CongestionControl.DROP,  # waiting for a silent peer would delay all others
                express=ROWS[key.kind].delivery is Delivery.EVENT,
            )
            for session in self._carrying(key in self.plan.to_operators)
        )


def _credentials(plan: Plan, folder: Path, identity: str, verified: bool) -> Credentials:
    files = files_of(folder, identity)
    try:
        str(folder).encode()
    except UnicodeEncodeError:
        raise CredentialsError(NOT_UTF_8.format(folder=ascii(str(folder)))) from None
    if not verified and all(os.access(path, os.R_OK) for path in (files.authority, files.certificate, files.key)):
        return files
    from flockwire_core.security.credentials import load_credentials  # noqa: PLC0415  (takes 0.1 s)

    return load_credentials(folder, identity, clock.utc(), plan.issuer(identity), plan.authorities)


def _reason(error: zenoh.ZError) -> str:
    text = str(error)
    return "the address is in use" if "in use" in text else text.split(" at ", maxsplit=1)[0]
