"""What the probe found against what key table and graph allow: identity x key, in each link mode."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from flockwire.config import Swarm
from flockwire.keys import ROWS, Delivery, Key, all_keys, key_text
from flockwire.wiring import OPERATOR, ROUTER, identities

OUTSIDERS = ("no certificate", "foreign certificate", "expired certificate")


@dataclass(frozen=True, slots=True)
class Observation:
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


def may_hear(swarm: Swarm, identity: str) -> frozenset[Key]:
    """Return the keys that an attacker with the certificate of `identity` is served where it dials."""
    if identity not in _insiders(swarm):
        return frozenset()
    return frozenset(key for key in all_keys(swarm) if identity in ROWS[key.kind].heard_by(swarm, key.owner))


def may_say(swarm: Swarm, identity: str) -> frozenset[tuple[Key, str]]:
    """Return (key, receiver) of what is let in from `identity`.

    The operator is left out as a receiver: it dials, nobody dials it. A router passes on to everybody else, which for
    an attacker includes the process whose certificate it shows; a peer knows no link to itself.
    """
    if identity not in _insiders(swarm):
        return frozenset()
    deaf = {OPERATOR} if swarm.network.mode == "router" else {OPERATOR, identity}
    return frozenset(
        (key, receiver)
        for key in all_keys(swarm)
        if identity in ROWS[key.kind].said_by(swarm, key.owner)
        for receiver in ROWS[key.kind].heard_by(swarm, key.owner)
        if receiver not in deaf
    )


def findings(swarm: Swarm, observation: Observation, alive: frozenset[str]) -> Iterator[Finding]:
    """Yield every leak, and everything blocked among those who are `alive`."""
    hear, say = may_hear(swarm, observation.identity), may_say(swarm, observation.identity)
    if observation.identity in OUTSIDERS and observation.links:
        yield Finding(observation.identity, observation.mode, "linked", "", "", leak=True)
    who = (observation.identity, observation.mode)
    for key in sorted(observation.heard - hear):
        yield Finding(*who, "heard", key_text(swarm, key), "", leak=True)
    for key, receiver in sorted(observation.said - say):
        yield Finding(*who, "said", key_text(swarm, key), receiver, leak=True)
    for key in sorted(hear - observation.heard):
        if _flows(swarm, key, alive - {observation.identity}):
            yield Finding(*who, "heard", key_text(swarm, key), "", leak=False)
    for key, receiver in sorted(say - observation.said):
        if receiver in alive:
            yield Finding(*who, "said", key_text(swarm, key), receiver, leak=False)


def draw(swarm: Swarm, observations: list[Observation]) -> Iterator[str]:
    """Yield the lines of the matrix: S said, H heard, B both, . refused; lower case where not in every mode."""
    columns = _insiders(swarm)
    width = max(len(name) for name in columns)
    yield f"{'':30}" + " ".join(f"{name:>{width}}" for name in columns)
    for key in all_keys(swarm):
        cells = (_cell([o for o in observations if o.identity == name], key) for name in columns)
        yield f"{key_text(swarm, key):30}" + " ".join(f"{cell:>{width}}" for cell in cells)


def as_json(swarm: Swarm, observations: list[Observation], found: list[Finding], seconds: float) -> dict[str, object]:
    """Return the probe's results for probe.json."""
    return {
        "swarm": swarm.name,
        "mode": swarm.network.mode,
        "seconds": round(seconds, 1),
        "leaks": [finding.sentence() for finding in found if finding.leak],
        "blocked": [finding.sentence() for finding in found if not finding.leak],
        "attackers": [
            {
                "identity": o.identity,
                "mode": o.mode,
                "links": o.links,
                "heard": sorted(key_text(swarm, key) for key in o.heard),
                "heard_expected": sorted(key_text(swarm, key) for key in may_hear(swarm, o.identity)),
                "said": sorted(f"{key_text(swarm, key)} to {receiver}" for key, receiver in o.said),
                "said_expected": sorted(f"{key_text(swarm, k)} to {r}" for k, r in may_say(swarm, o.identity)),
                "refused": 2 * len(all_keys(swarm)) - len(o.heard) - len({key for key, _ in o.said}),
            }
            for o in observations
        ],
    }


def _insiders(swarm: Swarm) -> tuple[str, ...]:
    return tuple(identity for identity in identities(swarm) if identity != ROUTER)


def _flows(swarm: Swarm, key: Key, alive: frozenset[str]) -> bool:
    """Return whether somebody who is alive says `key` all the time."""
    row = ROWS[key.kind]
    return row.delivery is not Delivery.EVENT and bool(alive & set(row.said_by(swarm, key.owner)))


def _cell(observations: list[Observation], key: Key) -> str:
    said = [any(key == k for k, _ in o.said) for o in observations]
    heard = [key in o.heard for o in observations]
    sign = "B" if any(said) and any(heard) else "S" if any(said) else "H" if any(heard) else "."
    everywhere = (all(said) or not any(said)) and (all(heard) or not any(heard))
    return sign if everywhere else sign.lower()
