"""Compares the probe's results with key table and graph: identity x key, in each link mode."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from flockwire_core.wire.keys import ROWS, TIME_REPLY, Delivery, Key
from flockwire_core.wire.plan import Plan

OUTSIDERS = ("no certificate", "foreign certificate", "expired certificate")


class AttackResult(NamedTuple):
    """One attacker's results: keys received, (key, receiver) of accepted messages, links."""

    identity: str
    mode: str
    received: frozenset[Key]
    published: frozenset[tuple[Key, str]]
    links: int

    def __or__(self, other: AttackResult) -> AttackResult:
        received, published = self.received | other.received, self.published | other.published
        return AttackResult(self.identity, self.mode, received, published, max(self.links, other.links))


class Deviation(NamedTuple):
    """One difference between allowed and observed."""

    identity: str
    mode: str
    verb: str  # "received", "published", "linked" (an outsider), "silent" (a process that does not answer)
    key: str
    receiver: str  # the process that accepted a published message
    leak: bool  # else: allowed, and blocked

    def sentence(self) -> str:
        """Return it as text."""
        whom = f" and {self.receiver} accepted it" if self.receiver else ""
        if self.verb == "linked":
            return f"leak: {self.identity} as {self.mode} was accepted by a process; it must not get a link"
        if self.verb == "silent":
            return f"blocked: {self.identity} does not answer; nothing could be tested"
        if self.leak:
            return f"leak: {self.identity} as {self.mode} {self.verb} {self.key}{whom}; it must not"
        if self.receiver:
            return f"blocked: {self.identity} as {self.mode} may publish {self.key}; {self.receiver} did not accept it"
        return f"blocked: {self.identity} as {self.mode} may receive {self.key}; nothing arrived"


def receivable(plan: Plan, identity: str) -> frozenset[Key]:
    """Return the keys that an attacker with the certificate of `identity` may receive."""
    return frozenset(plan.subscribes[identity] if identity in _insiders(plan) else ())


def publishable(plan: Plan, identity: str) -> frozenset[tuple[Key, str]]:
    """Return (key, receiver) of messages accepted from `identity`.

    The operator is not a receiver, because no process dials it. A router passes messages on to all others, which for an
    attacker include the process of its certificate; a peer has no link to itself.
    """
    if identity not in _insiders(plan):
        return frozenset()
    unreachable = {one for one in plan.identities if one not in plan.started}
    if not plan.routers:
        unreachable.add(identity)
    return frozenset(
        (key, receiver)
        for key, publishers, subscribers in plan.flows
        if identity in publishers
        for receiver in subscribers
        if receiver not in unreachable
    )


def deviations(plan: Plan, observation: AttackResult, alive: frozenset[str]) -> Iterator[Deviation]:
    """Yield every leak, and everything blocked among the processes that are `alive`."""
    if observation.identity in OUTSIDERS and observation.links:
        yield Deviation(observation.identity, observation.mode, "linked", "", "", leak=True)
    seen = {(key, "") for key in observation.received} | observation.published
    allowed = {(key, "") for key in receivable(plan, observation.identity)} | publishable(plan, observation.identity)
    for key, receiver in sorted(seen ^ allowed, key=lambda one: (one in allowed, one[1] != "", one)):
        verb, leak = "published" if receiver else "received", (key, receiver) in seen
        if leak or (receiver in alive if receiver else _arrives(plan, key, observation.identity, alive)):
            yield Deviation(observation.identity, observation.mode, verb, plan.text(key), receiver, leak)


def draw(plan: Plan, observations: list[AttackResult]) -> Iterator[str]:
    """Yield the lines of the matrix: P published, R received, B both, . refused; lower case where not in every mode."""
    columns = _insiders(plan)
    width = max(len(name) for name in columns)
    yield f"{'':30}" + " ".join(f"{name:>{width}}" for name in columns)
    for key in plan.keys:
        cells = (_cell([o for o in observations if o.identity == name], key) for name in columns)
        yield f"{plan.text(key):30}" + " ".join(f"{cell:>{width}}" for cell in cells)


def as_json(plan: Plan, observations: list[AttackResult], found: list[Deviation], seconds: float) -> dict[str, object]:
    """Return the probe's results for probe.json."""
    return {
        "swarm": plan.swarm.name,
        "mode": plan.swarm.network.mode,
        "seconds": round(seconds, 1),
        "leaks": [deviation.sentence() for deviation in found if deviation.leak],
        "blocked": [deviation.sentence() for deviation in found if not deviation.leak],
        "attackers": [_attacker(plan, one) for one in observations],
    }


def _attacker(plan: Plan, one: AttackResult) -> dict[str, object]:
    return {
        "identity": one.identity,
        "mode": one.mode,
        "links": one.links,
        "received": sorted(map(plan.text, one.received)),
        "received_expected": sorted(map(plan.text, receivable(plan, one.identity))),
        "published": sorted(f"{plan.text(key)} to {receiver}" for key, receiver in one.published),
        "published_expected": sorted(f"{plan.text(k)} to {r}" for k, r in publishable(plan, one.identity)),
        "refused": 2 * len(plan.keys) - len(one.received) - len({key for key, _ in one.published}),
    }


def _insiders(plan: Plan) -> tuple[str, ...]:
    return tuple(identity for identity in plan.identities if identity not in plan.routers)


def _arrives(plan: Plan, key: Key, identity: str, alive: frozenset[str]) -> bool:
    """Return whether a live process, but `identity`, publishes `key` all the time."""
    row = ROWS[key.kind]
    if row.delivery is Delivery.EVENT or row.occasional or (key.kind == TIME_REPLY and key.owner not in alive):
        return False  # only processes that request the time receive it
    return any(key in plan.publishes[other] for other in alive - {identity})


def _cell(observations: list[AttackResult], key: Key) -> str:
    published = {key in {one for one, _ in o.published} for o in observations}
    received = {key in o.received for o in observations}
    sign = {(True, True): "B", (True, False): "P", (False, True): "R"}.get((True in published, True in received), ".")
    return sign.lower() if len(published) > 1 or len(received) > 1 else sign
