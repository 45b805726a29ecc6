"""What the probe found against what key table and graph allow: identity x key, in each link mode."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from flockwire.wire.keys import ROWS, Delivery, Key
from flockwire.wire.plan import Plan

OUTSIDERS = ("no certificate", "foreign certificate", "expired certificate")


@dataclass(frozen=True, slots=True)
class AttackResult:
    """What one attacker achieved: keys heard, (key, receiver) of what it said and was let in, endpoints linked."""

    identity: str
    mode: str
    heard: frozenset[Key]
    said: frozenset[tuple[Key, str]]
    links: int


@dataclass(frozen=True, slots=True)
class Finding:
    """One difference between what is allowed and what was seen."""

    identity: str
    mode: str
    verb: str  # "heard", "said", "linked" (an outsider), "silent" (a process that does not answer)
    key: str
    receiver: str  # who let it in, where it was said
    leak: bool  # else: allowed, and blocked

    def sentence(self) -> str:
        """Tell it in words."""
        whom = f" and {self.receiver} let it in" if self.receiver else ""
        if self.verb == "linked":
            return f"leak: {self.identity} as {self.mode} was accepted by somebody; it must not get a link"
        if self.verb == "silent":
            return f"blocked: {self.identity} does not answer; nothing about it could be shown"
        if self.leak:
            return f"leak: {self.identity} as {self.mode} {self.verb} {self.key}{whom}; it must not"
        whom = f" by {self.receiver}" if self.receiver else ""
        return f"blocked: {self.identity} as {self.mode} may have {self.key} {self.verb}{whom}; it did not get through"


def may_hear(plan: Plan, identity: str) -> frozenset[Key]:
    """Return the keys that an attacker with the certificate of `identity` is served where it dials."""
    if identity not in _insiders(plan):
        return frozenset()
    return frozenset(plan.subscribes[identity])


def may_say(plan: Plan, identity: str) -> frozenset[tuple[Key, str]]:
    """Return (key, receiver) of what is let in from `identity`.

    The operator is left out as a receiver: it dials, nobody dials it. A router passes on to everybody else, which for
    an attacker includes the process whose certificate it shows; a peer knows no link to itself.
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


def findings(plan: Plan, observation: AttackResult, alive: frozenset[str]) -> Iterator[Finding]:
    """Yield every leak, and everything blocked among those who are `alive`."""
    hear, say = may_hear(plan, observation.identity), may_say(plan, observation.identity)
    if observation.identity in OUTSIDERS and observation.links:
        yield Finding(observation.identity, observation.mode, "linked", "", "", leak=True)
    who = (observation.identity, observation.mode)
    for key in sorted(observation.heard - hear):
        yield Finding(*who, "heard", plan.text(key), "", leak=True)
    for key, receiver in sorted(observation.said - say):
        yield Finding(*who, "said", plan.text(key), receiver, leak=True)
    for key in sorted(hear - observation.heard):
        if _flows(plan, key, alive - {observation.identity}):
            yield Finding(*who, "heard", plan.text(key), "", leak=False)
    for key, receiver in sorted(say - observation.said):
        if receiver in alive:
            yield Finding(*who, "said", plan.text(key), receiver, leak=False)


def draw(plan: Plan, observations: list[AttackResult]) -> Iterator[str]:
    """Yield the lines of the matrix: S said, H heard, B both, . refused; lower case where not in every mode."""
    columns = _insiders(plan)
    width = max(len(name) for name in columns)
    yield f"{'':30}" + " ".join(f"{name:>{width}}" for name in columns)
    for key in plan.keys:
        cells = (_cell([o for o in observations if o.identity == name], key) for name in columns)
        yield f"{plan.text(key):30}" + " ".join(f"{cell:>{width}}" for cell in cells)


def as_json(plan: Plan, observations: list[AttackResult], found: list[Finding], seconds: float) -> dict[str, object]:
    """Return the probe's results for probe.json."""
    return {
        "swarm": plan.swarm.name,
        "mode": plan.swarm.network.mode,
        "seconds": round(seconds, 1),
        "leaks": [finding.sentence() for finding in found if finding.leak],
        "blocked": [finding.sentence() for finding in found if not finding.leak],
        "attackers": [
            {
                "identity": o.identity,
                "mode": o.mode,
                "links": o.links,
                "heard": sorted(plan.text(key) for key in o.heard),
                "heard_expected": sorted(plan.text(key) for key in may_hear(plan, o.identity)),
                "said": sorted(f"{plan.text(key)} to {receiver}" for key, receiver in o.said),
                "said_expected": sorted(f"{plan.text(k)} to {r}" for k, r in may_say(plan, o.identity)),
                "refused": 2 * len(plan.keys) - len(o.heard) - len({key for key, _ in o.said}),
            }
            for o in observations
        ],
    }


def _insiders(plan: Plan) -> tuple[str, ...]:
    return tuple(identity for identity in plan.certified if identity not in plan.routers)


def _flows(plan: Plan, key: Key, alive: frozenset[str]) -> bool:
    """Return whether somebody who is alive says `key` all the time."""
    return ROWS[key.kind].delivery is not Delivery.EVENT and any(key in plan.publishes[identity] for identity in alive)


def _cell(observations: list[AttackResult], key: Key) -> str:
    said = [any(key == k for k, _ in o.said) for o in observations]
    heard = [key in o.heard for o in observations]
    sign = "B" if any(said) and any(heard) else "S" if any(said) else "H" if any(heard) else "."
    everywhere = (all(said) or not any(said)) and (all(heard) or not any(heard))
    return sign if everywhere else sign.lower()
