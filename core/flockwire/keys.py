"""The key space: one table says which keys a swarm has, their message, who says them and who hears them.

A key is `<swarm>/<owner>/<kind>` (`<swarm>/<kind>` where all drones share it), which is also a ROS 2 topic name. No
other file knows a key's spelling, and who may say and hear what (policy.py) follows from this table and the graph.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

from flockwire.control.graph import LEADER
from flockwire.messages import Command, Estimate, Message, Mission, Nearby, Pose, Stop, Telemetry
from flockwire.status import Status
from flockwire.wiring import OPERATOR, agent_identity, identities

if TYPE_CHECKING:
    from flockwire.config import Swarm


class Key(NamedTuple):
    """One key of a swarm: what it tells (`kind`) and of whom (`owner`, empty when of the whole swarm)."""

    kind: str
    owner: str = ""


class Delivery(Enum):
    """How the network treats a key's messages."""

    STATE = "newest counts: sent at once, dropped rather than queued"
    EVENT = "every one counts: sent before all else, waited for"
    BACKGROUND = "sent when there is time"


@dataclass(frozen=True, slots=True)
class Row:
    """One kind of key. `owners`, `said_by` and `heard_by` answer for a given swarm, the latter two for one owner."""

    kind: str
    message: type[Message]
    owners: Callable[[Swarm], tuple[str, ...]]
    said_by: Callable[[Swarm, str], tuple[str, ...]]
    heard_by: Callable[[Swarm, str], tuple[str, ...]]
    delivery: Delivery = Delivery.STATE
    lifetime: float | None = 1.0  # s after its stamp a message is worth nothing; None: until a newer one comes


def uav(number: int) -> str:
    """Return the owner of the keys of drone `number`."""
    return f"uav{number}"


def _number(owner: str) -> int:
    return int(owner.removeprefix("uav"))


def _everybody(_: Swarm) -> tuple[str, ...]:
    return ("",)


def _flying(swarm: Swarm) -> tuple[str, ...]:
    return tuple(uav(i) for i in swarm.flying)


def _posed(swarm: Swarm) -> tuple[str, ...]:
    return tuple(uav(i) for i in sorted({LEADER, *swarm.flying}))


def _followers(swarm: Swarm) -> tuple[str, ...]:
    return tuple(uav(i) for i in swarm.followers)


def _sensing(swarm: Swarm) -> tuple[str, ...]:
    return _followers(swarm) if swarm.avoidance.sensing == "nearby" else ()


def _pilot(_: Swarm, owner: str) -> tuple[str, ...]:
    return (agent_identity(_number(owner)),)


def _kinematics(_: Swarm, __: str) -> tuple[str, ...]:
    return ("kinematics",)


def _gateway(_: Swarm, __: str) -> tuple[str, ...]:
    return ("gateway",)


def _listeners(swarm: Swarm, owner: str) -> tuple[str, ...]:
    return tuple(agent_identity(i) for i in swarm.topology.listeners(_number(owner)))


def _pose_source(swarm: Swarm, owner: str) -> tuple[str, ...]:
    return ("leader",) if owner == uav(LEADER) and swarm.leader.kind == "virtual" else ("gateway",)


def _pose_readers(swarm: Swarm, owner: str) -> tuple[str, ...]:
    """Name the drone itself, and its listeners where they need it: for the leader's pose, or to avoid neighbours."""
    pilot = () if _pose_source(swarm, owner) == ("leader",) else _pilot(swarm, owner)
    needed = owner == uav(LEADER) or swarm.avoidance.sensing == "neighbours"
    return (*pilot, *(_listeners(swarm, owner) if needed else ()), "recorder")


def _pilots(swarm: Swarm) -> tuple[str, ...]:
    return ("leader", *_followers(swarm))


TABLE = (
    Row("truth", Pose, _flying, _kinematics, lambda _, __: ("gateway", "recorder")),
    Row("nearby", Nearby, _sensing, _gateway, lambda s, o: (*_pilot(s, o), "recorder")),
    Row("pose", Pose, _posed, _pose_source, _pose_readers),
    Row("estimate", Estimate, _followers, _pilot, lambda s, o: (*_listeners(s, o), "recorder")),
    Row("command", Command, _flying, _pilot, lambda _, __: ("kinematics", "recorder")),
    Row("telemetry", Telemetry, _flying, _kinematics, lambda s, o: (*_pilot(s, o), "recorder", OPERATOR)),
    Row(
        "status", Status, lambda s: identities(s)[:-1], lambda _, o: (o,), lambda _, __: ("recorder", OPERATOR),
        Delivery.BACKGROUND,
    ),
    Row(
        # The gateway repeats the newest mission, stamp unchanged, for those who join late.
        "mission", Mission, _everybody, lambda _, __: (OPERATOR, "gateway"),
        lambda s, _: ("gateway", *_pilots(s), "recorder"), Delivery.EVENT, None,
    ),
    Row(
        "stop", Stop, _everybody, lambda _, __: (OPERATOR,),
        lambda s, _: ("kinematics", *_pilots(s), "recorder"), Delivery.EVENT,
    ),
)  # fmt: skip

ROWS = {row.kind: row for row in TABLE}
MISSION = Key("mission")
STOP = Key("stop")


def key_text(swarm: Swarm, key: Key) -> str:
    """Return the key as it stands on the wire; with a `/` before it, the ROS 2 topic."""
    return f"{swarm.name}/{key.owner}/{key.kind}" if key.owner else f"{swarm.name}/{key.kind}"


def all_keys(swarm: Swarm) -> tuple[Key, ...]:
    """Return every key of the swarm, in the table's order."""
    return tuple(Key(row.kind, owner) for row in TABLE for owner in row.owners(swarm))
