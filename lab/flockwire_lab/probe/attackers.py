"""Attackers on the wire: sessions with any certificate, as peer, client or router, that dial every endpoint.

They have no access control and try every key by every verb of Zenoh.
"""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from typing import Any, NamedTuple

import zenoh
from flockwire_core import clock
from flockwire_core.domain.time import nanoseconds
from flockwire_core.security.files import Credentials
from flockwire_core.wire.inbox import CANARY, attachment
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan

MODES = ("peer", "client", "router")
LINK_TIME = 0.8  # s for the swarm to accept an attacker
POLL = 0.02  # s
_PUBLISHER = b"flockwire probe\0"


class Attacker(NamedTuple):
    """Its certificate (`identity` names it in the results; None without one) and its mode."""

    identity: str
    credentials: Credentials | None
    mode: str


class Attack:
    """One attacker's sessions: one that dials all endpoints, as client one for each. Use it as a context manager.

    It waits for the swarm for `patience` times LINK_TIME.
    """

    def __init__(self, plan: Plan, attacker: Attacker, authority: str, patience: int) -> None:
        self._received: set[str] = set()  # by sample or by answer
        self._plan, self._attacker = plan, attacker
        self._keys = {plan.text(key): key for key in plan.keys}
        self._held: list[object] = []
        self._numbers = count()
        wanted = open_to(plan, attacker.identity).values()
        everywhere = [*plan.endpoints.values(), *plan.reserved.values()]
        # A client waits long for each refusal. The right to link does not depend on the mode: the peer tries all.
        groups = [[endpoint] for endpoint in wanted] if attacker.mode == "client" else [everywhere]
        self._links_wanted, self._link_time = len(wanted), patience * LINK_TIME
        configurations = [
            attacker_configuration(attacker, map(plan.locator, group), authority, self._link_time) for group in groups
        ]
        with ThreadPoolExecutor(min(8, len(groups))) as pool:
            self._sessions = [session for session in pool.map(_opened, configurations) if session is not None]

    def __enter__(self) -> Attack:
        return self

    def __exit__(self, *_: object) -> None:
        for session in self._sessions:
            with contextlib.suppress(zenoh.ZError):  # a slow close proves nothing
                session.close()  # type: ignore[no-untyped-call]

    def link(self) -> int:
        """Wait until all expected endpoints have accepted a link, or for the time limit; returns their number."""
        deadline = clock.monotonic() + nanoseconds(self._link_time)
        while True:
            linked = sum(len(session.info.links()) for session in self._sessions)
            if linked >= self._links_wanted or clock.monotonic() >= deadline:
                return linked
            time.sleep(POLL)

    def subscribe(self) -> None:
        """Subscribe to every key, exactly and by wildcards, by every verb."""
        query_timeout = 0.2  # s
        name = self._plan.swarm.name
        patterns = (*self._keys, "**", f"{name}/**", f"{name}/*/estimate", f"{name}/*/pose", "*/*/*")
        for session in self._sessions:
            liveliness = session.liveliness()
            for pattern in patterns:
                self._held.append(
                    session.declare_subscriber(pattern, _direct(self._receive), allowed_origin=zenoh.Locality.REMOTE)
                )
                session.get(pattern, _direct(self._answer), timeout=query_timeout)
            for pattern in ("**", f"{name}/**"):
                self._held.append(liveliness.declare_subscriber(pattern, _direct(self._receive)))
                liveliness.get(pattern, _direct(self._answer), timeout=query_timeout)

    def forge(self) -> None:
        """Publish a canary on every key, delete every key, and declare a queryable for all of them."""
        tries = 4  # canaries on each key
        for session in self._sessions:
            self._held.append(session.declare_queryable(f"{self._plan.swarm.name}/**", _direct(lambda _: None)))
            self._held.append(session.liveliness().declare_token(f"{self._plan.swarm.name}/alive"))
        for _ in range(tries):
            for session in self._sessions:
                for text in self._keys:
                    session.put(
                        text,
                        CANARY + self._attacker.identity.encode(),
                        attachment=attachment(next(self._numbers), clock.now(), _PUBLISHER, self._keys[text]),
                    )
                    session.delete(text)
            time.sleep(POLL)

    def keys_received(self) -> set[Key]:
        """Return the swarm's keys on which data of others arrived, by sample or by answer."""
        return {self._keys[text] for text in self._received.copy() if text in self._keys}

    def _receive(self, sample: zenoh.Sample) -> None:
        """Record a sample, unless it is this attacker's own."""
        if not sample.payload.to_bytes().startswith(CANARY + self._attacker.identity.encode()):
            self._received.add(str(sample.key_expr))

    def _answer(self, reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            self._received.add(str(reply.ok.key_expr))


def _opened(configuration: zenoh.Config) -> zenoh.Session | None:
    try:
        return zenoh.open(configuration)
    except zenoh.ZError:  # refused at once
        return None


def _direct(callback: Callable[..., None]) -> zenoh.handlers.Callback[Any]:
    return zenoh.handlers.Callback(callback, indirect=False)


def open_to(plan: Plan, identity: str) -> Mapping[str, str]:
    """Return the endpoints that accept links with the certificate of `identity`, by their process."""
    return plan.reserved if plan.reserved and identity in plan.operators else plan.endpoints


def attacker_configuration(
    attacker: Attacker, targets: Iterable[str], authority: str, link_time: float = LINK_TIME
) -> zenoh.Config:
    """Return the Zenoh configuration of an attacker that dials `targets`; `authority` is the certificate it trusts.

    A client gives up after `link_time` s.
    """
    tls: dict[str, object] = {"root_ca_certificate": authority, "verify_name_on_connect": False}
    if attacker.credentials is not None:
        certificate, key = str(attacker.credentials.certificate), str(attacker.credentials.key)
        tls |= {"enable_mtls": True, "connect_certificate": certificate, "connect_private_key": key}
    config = {
        "mode": attacker.mode,
        "listen": {"endpoints": []},
        "connect": {
            "endpoints": list(targets),
            "timeout_ms": round(link_time * 1000) if attacker.mode == "client" else -1,
            "exit_on_failure": attacker.mode == "client",
            "retry": {"period_init_ms": 100, "period_max_ms": 300, "period_increase_factor": 1.5},
        },
        "open": {"return_conditions": {"connect_scouted": False, "declares": False}},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {"link": {"tls": tls}},
    }
    return zenoh.Config.from_json5(json.dumps(config))
