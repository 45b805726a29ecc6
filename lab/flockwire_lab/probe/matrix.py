"""Compares the probe's results with key table and graph: identity x key, in each link mode."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from flockwire_core.wire.keys import ROWS, TIME_REPLY, Delivery, Key
from flockwire_core.wire.plan import Plan

OUTSIDERS = ("no certificate", "foreign certificate", "expired certificate")


@dataclass(frozen=True, slots=True)
class AttackResult:
    """One attacker's results: keys received, (key, receiver) of accepted messages, links."""

    identity: str
    mode: str
    received: frozenset[Key]
    published: frozenset[tuple[Key, str]]
    links: int

    def __or__(self, other: AttackResult) -> AttackResult:
        received, published = self.received | other.received, self.published | other.published
        return AttackResult(self.identity, self.mode, received, published, max(self.links, other.links))


@dataclass(frozen=True, slots=True)
class Deviation:
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
    if identity not in _insiders(plan):
        return frozenset()
    return frozenset(plan.subscribes[identity])


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
    may_receive = receivable(plan, observation.identity)
    may_publish = publishable(plan, observation.identity)
    if observation.identity in OUTSIDERS and observation.links:
        yield Deviation(observation.identity, observation.mode, "linked", "", "", leak=True)
    who = (observation.identity, observation.mode)
    for key in sorted(observation.received - may_receive):
        yield Deviation(*who, "received", plan.text(key), "", leak=True)
    for key, receiver in sorted(observation.published - may_publish):
        yield Deviation(*who, "published", plan.text(key), receiver, leak=True)
    for key in sorted(may_receive - observation.received):
        asked = key.kind != TIME_REPLY or key.owner in alive  # only processes that request the time receive it
        if asked and _flows(plan, key, alive - {observation.identity}):
            yield Deviation(*who, "received", plan.text(key), "", leak=False)
    for key, receiver in sorted(may_publish - observation.published):
        if receiver in alive:
            yield Deviation(*who, "published", plan.text(key), receiver, leak=False)


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
        "attackers": [
            {
                "identity": o.identity,
                "mode": o.mode,
                "links": o.links,
                "received": sorted(plan.text(key) for key in o.received),
                "received_expected": sorted(plan.text(key) for key in receivable(plan, o.identity)),
                "published": sorted(f"{plan.text(key)} to {receiver}" for key, receiver in o.published),
                "published_expected": sorted(f"{plan.text(k)} to {r}" for k, r in publishable(plan, o.identity)),
                "refused": 2 * len(plan.keys) - len(o.received) - len({key for key, _ in o.published}),
            }
            for o in observations
        ],
    }


def _insiders(plan: Plan) -> tuple[str, ...]:
    return tuple(identity for identity in plan.identities if identity not in plan.routers)


def _flows(plan: Plan, key: Key, alive: frozenset[str]) -> bool:
    """Return whether a live process publishes `key` all the time."""
    row = ROWS[key.kind]
    return (
        row.delivery is not Delivery.EVENT
        and not row.occasional
        and any(key in plan.publishes[identity] for identity in alive)
    )


def _cell(observations: list[AttackResult], key: Key) -> str:
    published = [any(key == k for k, _ in o.published) for o in observations]
    received = [key in o.received for o in observations]
    sign = "B" if any(published) and any(received) else "P" if any(published) else "R" if any(received) else "."
    everywhere = (all(published) or not any(published)) and (all(received) or not any(received))
    return sign if everywhere else sign.lower()
