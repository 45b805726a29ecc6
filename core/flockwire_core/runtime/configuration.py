"""The Zenoh configuration of every process: endpoints, links, access control, bounds, no discovery.

Every process has the access rules of its own links; both ends of a link enforce them.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from flockwire_core.security.files import Credentials
from flockwire_core.wire.plan import OPERATORS, Plan

BURST = 16  # messages of one step in the queue before the next is dropped; 16 is the maximum
LARGEST_MESSAGE = 65536  # bytes
PATIENCE = 500  # ms for one attempt to reach the router
SPARE_SESSIONS = 512  # besides one for each link: a holder of one drone's certificate must not exhaust them easily
ACCEPT_TIME = {"tls": 1000, "quic": 4000}  # ms for each; a radio link loses some of its packets
OPEN_TIME = 4000  # ms for each, about seven times the way to the other end; a frozen process delays an exit by as much
# ms. For each TLS handshake that fails or takes too long Zenoh stops accepting for 0.1 s, which cannot be configured:
# a thousand silent connections that time out would keep an operator out for minutes. So they stay, for a descriptor.
HANDSHAKE_TIME = 3_600_000
# Threads of Zenoh's runtime.
ONE_THREAD = (
    "(rx: (handover: app), acc: (handover: app), net: (handover: app), tx: (handover: app), "
    "app: (worker_threads: 1, max_blocking_threads: 1))"
)
ROUTING = "(rx: (worker_threads: 1), tx: (worker_threads: 1), app: (worker_threads: 1))"
NO_DETOURS: Mapping[str, str] = MappingProxyType({})


def configuration(
    plan: Plan,
    identity: str,
    credentials: Credentials | None,
    detours: Mapping[str, str] = NO_DETOURS,
    reserved: bool = False,
) -> dict[str, Any]:
    """Return the Zenoh configuration of `identity`, by which it is linked to processes (an operator: to all).

    Without `credentials` nothing is encrypted, authenticated or refused. `detours` has other addresses to dial.
    If it is `reserved`, only operators can use its sessions, because it trusts no other authority: a drone that is
    taken over, with all its keys, can exhaust the others, but cannot block an emergency stop.
    """
    mode = "router" if identity in plan.routers else "client" if plan.routers else "peer"
    listening = (plan.reserved if reserved else plan.endpoints).get(identity)
    dialled = (
        [] if reserved else [detours.get(other) or plan.dialled(identity, other) for other in plan.dials[identity]]
    )
    locators = [] if listening is None else [_bounded(plan.locator(plan.bound(listening)))]
    queue = {"real_time": BURST, "data_high": BURST, "background": BURST}
    config = basic_configuration(mode, locators, list(map(plan.locator, dialled)), queue)
    config["transport"]["unicast"] = {
        "max_sessions": len(plan.links[identity]) + SPARE_SESSIONS,
        "accept_pending": 1000,  # pending connections
        "accept_timeout": ACCEPT_TIME[plan.swarm.network.link],
        "open_timeout": OPEN_TIME,
    }
    if credentials is not None:
        authority = credentials.signed_by(OPERATORS) if reserved else credentials.authority
        config["transport"]["link"]["tls"] = _tls(credentials, authority)
        config["access_control"] = access_control(plan, identity)
    return config


def basic_configuration(
    mode: str, listening: list[str], dialled: list[str], queue: Mapping[str, int], largest: int = LARGEST_MESSAGE
) -> dict[str, Any]:
    """Return what all sessions have in common: endpoints without discovery, and bounds.

    `queue` is the number of messages by priority, `largest` the bytes of one.
    """
    return {
        "mode": mode,
        "listen": {"endpoints": listening},
        "connect": {
            "endpoints": dialled,
            "timeout_ms": PATIENCE if mode == "client" else -1,
            "exit_on_failure": mode == "client",
            "retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5},
        },
        "open": {"return_conditions": {"connect_scouted": False, "declares": False}},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {
            "link": {
                "tx": {"lease": 1000, "keep_alive": 4, "queue": {"size": queue}},
                "rx": {"max_message_size": largest},
            },
            "shared_memory": {"enabled": False},
        },
    }


def _bounded(locator: str) -> str:
    """Return the locator to listen at, where silent connections block nobody."""
    return f"{locator}#tls_handshake_timeout_ms={HANDSHAKE_TIME}" if locator.startswith("tls/") else locator


def _tls(credentials: Credentials, authority: Path) -> dict[str, object]:
    certificate, key = str(credentials.certificate), str(credentials.key)
    return {
        "root_ca_certificate": str(authority),
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": False,  # what is linked flies on, and obeys orders
        "listen_certificate": certificate,
        "listen_private_key": key,
        "connect_certificate": certificate,
        "connect_private_key": key,
    }


Rule = dict[str, object]


def access_control(plan: Plan, identity: str) -> Rule:
    """Return Zenoh's access control for the process of `identity`: unlisted keys are denied, in both directions.

    Each link has rules for samples in both directions, and for their subscriptions in the opposite direction. Queries,
    replies, liveliness and deletions are in no rule. A router subscribes at its clients for others.
    """
    rules, policies, subjects = [], [], []
    for other in plan.links[identity]:
        out, back = plan.passes(identity, other), plan.passes(other, identity)
        granted = (
            ("publishes", "egress", "put", out),
            ("accepts subscriptions", "ingress", "declare_subscriber", out),
            ("receives", "ingress", "put", back),
            ("subscribes", "egress", "declare_subscriber", back),
        )
        named = [
            {
                "id": f"{other} {name}",
                "permission": "allow",
                "flows": [flow],
                "messages": [message],
                "key_exprs": [plan.text(key) for key in keys],
            }
            for name, flow, message, keys in granted
            if keys
        ]
        rules += named
        subjects.append({"id": other, "cert_common_names": [other]})
        policies.append({"rules": [rule["id"] for rule in named], "subjects": [other]})
    return {"enabled": True, "default_permission": "deny", "rules": rules, "subjects": subjects, "policies": policies}
