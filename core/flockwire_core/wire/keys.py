"""The key table: the keys of a swarm, their messages, publishers and subscribers.

A key is `<swarm>/<owner>/<kind>` (`<swarm>/<kind>` where all drones share it), which is also a ROS 2 topic name. No
other file spells a key. Links (plan.py) follow from this table, the process table and the graph. A recorder subscribes
to every key without being named here, but receives the state of most processes in batches (batch.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from flockwire_core.domain.airframe import Command, Steer, Telemetry
from flockwire_core.domain.body import Nearby
from flockwire_core.domain.law_message import LawMessage, Signals
from flockwire_core.domain.motion import Estimate
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, TimeReply, TimeRequest
from flockwire_core.swarm.leader import Leader
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.batch import LARGEST, PERIOD, Batch
from flockwire_core.wire.codec import Message
from flockwire_core.wire.information import relays, sees, signs, speakers
from flockwire_core.wire.processes import (
    AGENT,
    DRIVER,
    GATEWAY,
    KINEMATICS,
    LEADING,
    ORDERING,
    ROS,
    TELEOP,
    TRACKER,
    Member,
    Process,
    Roster,
)
from flockwire_core.wire.sighting import Sighting
from flockwire_core.wire.status import Status

TIME_REQUEST = "time_request"
TIME_REPLY = "time_reply"
ANY_TIME = 4e9  # s


BATCH = "batch"  # the kind of key of messages for the recorder alone
LEADS = "leads"  # the kind of key by which a leader tells every follower that it leads
STEERING = "steering"  # the kind of key that steers the leader


class Key(NamedTuple):
    """One key of a swarm: its `kind` and its `owner` (empty for the whole swarm)."""

    kind: str
    owner: str = ""


class Delivery(Enum):
    """The delivery of a key's messages."""

    STATE = "newest counts: sent at once, dropped rather than queued"
    EVENT = "sent before all else; a publisher that must know that it arrived repeats it until it is confirmed"
    BACKGROUND = "sent when there is time"


Owners = Callable[[Roster], tuple[Member, ...]]  # each a drone, a process, or (all empty) the swarm
Who = Callable[[Roster, Member], tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class KeyRow:
    """One kind of key. `owners` is a function of a swarm, `publishers` and `subscribers` of one owner in it.

    `rate` (messages per s) and `largest` (bytes) are the quota of one key, shared by its publishers: a multiple of the
    need of the fastest swarm. Receivers drop and count messages beyond it. Plan.rate adds to that of batches.
    """

    kind: str
    message: type[Message]
    owners: Owners
    publishers: Who
    subscribers: Who
    rate: int
    largest: int
    delivery: Delivery = Delivery.STATE
    maximum_age: float | None = 1.0  # s; None: a message is valid until a newer one arrives
    max_future: float = 0.1  # s by which a stamp may be ahead: a bound on the offset between two machines' clocks
    occasional: bool = False  # published only when there is something to report
    keep_all: bool = False  # there are several publishers, so the newest stamp must not win


def _drones(which: Callable[[Swarm], tuple[int, ...]]) -> Owners:
    return lambda roster: tuple(Member(uav(i), i) for i in which(roster.swarm))


def _everybody(_: Roster) -> tuple[Member, ...]:
    return (Member(""),)


def _processes(which: Callable[[Process], bool]) -> Owners:
    return lambda roster: tuple(member for one, member in roster.members.items() if which(roster.rows[one]))


def _steers(roster: Roster, owner: Member) -> tuple[str, ...]:
    """Name who steers the leader that owns the key."""
    follows_ros = owner.drone is not None and roster.swarm.leading[owner.drone].follows_ros
    return (*roster.of(TELEOP), *(roster.of(ROS) if follows_ros else ()))


def _ros_orders(*verbs: str) -> Who:
    """Name the process in ROS 2 if the file lets it give one of these orders."""

    def who(roster: Roster, _: Member) -> tuple[str, ...]:
        allowed = roster.swarm.ros.orders if roster.swarm.ros is not None else ()
        return roster.of(ROS) if set(verbs).intersection(allowed) else ()

    return who


def _all(*rows: Process) -> Who:
    return lambda roster, _: roster.of(*rows)


def _any_of(*parts: Who) -> Who:
    return lambda roster, owner: tuple(identity for part in parts for identity in part(roster, owner))


def _itself(_: Roster, owner: Member) -> tuple[str, ...]:
    return (owner.identity,)


def _pilot(roster: Roster, owner: Member) -> tuple[str, ...]:
    return (roster.pilot[owner.drone],) if owner.drone is not None else ()


def _neighbours(roster: Roster, owner: Member) -> tuple[str, ...]:
    """Name the pilots of those with an edge from the owner."""
    return tuple(roster.pilot[i] for i in roster.swarm.topology.out_neighbours(owner.drone or 0))


def _led(roster: Roster, owner: Member) -> tuple[str, ...]:
    """Name the agents with an edge from a leader, if the owner is its pilot and the law relays its motion.

    A tracked leader leads while its pose arrives, so its status is not needed.
    """
    leader = _leader(roster, owner) if roster.pilot.get(owner.drone or 0) == owner.identity else None
    led = leader is not None and leader.kind != "tracked" and relays(roster.swarm)
    return _neighbours(roster, owner) if led else ()


def _leader(roster: Roster, owner: Member) -> Leader | None:
    """Return the table of the leader that is the owner; None for any other drone."""
    return roster.swarm.leading.get(owner.drone) if owner.drone is not None else None


def _locating(roster: Roster, owner: Member) -> tuple[str, ...]:
    """Name the gateway if the owner is the pilot of a tracked airframe: it reports that a pose is not its own."""
    flying = owner.drone in roster.swarm.flying and roster.pilot.get(owner.drone) == owner.identity
    return roster.of(GATEWAY) if flying else ()


def _driver(roster: Roster, owner: Member) -> tuple[str, ...]:
    """Name the driver of a drone: its own, or the process of simulated airframes."""
    return roster.drivers(owner.drone) if owner.drone is not None else ()


def _turning_driver(roster: Roster, owner: Member) -> tuple[str, ...]:
    """Name the driver of a drone that turns: it needs the heading."""
    swarm = roster.swarm
    turns = owner.drone in swarm.driven and owner.drone is not None and swarm.row(owner.drone).turns
    return _driver(roster, owner) if turns else ()


def _walker(roster: Roster, _: Member) -> tuple[str, ...]:
    """Name the process that simulates the person who leads, who walks in the formation phase."""
    return roster.of(KINEMATICS) if roster.swarm.walking else ()


def _cameras(roster: Roster, _: Member) -> tuple[str, ...]:
    """Name the process that simulates the cameras: a simulated tracker, or the gateway; none if they are real."""
    return roster.of(TRACKER) or (roster.of(GATEWAY) if roster.swarm.gateway.source == "simulated" else ())


def _virtual(roster: Roster, owner: Member) -> bool:
    leader = _leader(roster, owner)
    return leader is not None and not leader.has_body


def _pose_source(roster: Roster, owner: Member) -> tuple[str, ...]:
    return (roster.pilot[owner.drone or 0],) if _virtual(roster, owner) else roster.of(GATEWAY)


def _pose_readers(roster: Roster, owner: Member) -> tuple[str, ...]:
    """Name the drone itself, and its out-neighbours if they need the pose: the leader's to relay, or for avoidance."""
    pilot = () if _virtual(roster, owner) else _pilot(roster, owner)
    led = _leader(roster, owner) is not None and relays(roster.swarm)
    needed = led or roster.swarm.avoidance.sensing == "neighbours"
    return (*pilot, *(_neighbours(roster, owner) if needed else ()))


def _other_hosts(roster: Roster) -> tuple[Member, ...]:
    """Name the processes that may run on another host than the gateway, as an operator's command may."""
    (gateway,), operators = roster.of(GATEWAY), roster.of(*ORDERING, TELEOP)
    here = roster.host(gateway)
    return tuple(
        member
        for one, member in roster.members.items()
        if one in operators or (roster.rows[one].started and roster.host(one) != here)
    )


_FLYING = _drones(lambda swarm: swarm.flying)
_RELAYING = _drones(lambda swarm: swarm.followers if relays(swarm) else ())
_SPEAKING = _drones(lambda swarm: swarm.followers if swarm.auctioned else speakers(swarm))
_SEEING = _drones(lambda swarm: swarm.followers if sees(swarm) else ())
_SIGNS = _drones(signs)
_SIGNALLING = _drones(lambda swarm: swarm.followers if swarm.control.own_law else ())
_POSED = _drones(lambda swarm: tuple(sorted({*swarm.leaders, *swarm.tracked})))
_SENSED = _drones(lambda swarm: swarm.flying if swarm.avoidance.sensing == "nearby" else ())
_STEERED = _drones(lambda swarm: swarm.steered)
_SIMULATED = _drones(lambda swarm: (*swarm.walking, *swarm.simulated))
_STARTED, _BATCHING = _processes(lambda row: row.started), _processes(lambda row: row.batches)

TABLE = (
    KeyRow("truth", Pose, _SIMULATED, _all(KINEMATICS), _cameras, 1000, 512),
    KeyRow("nearby", Nearby, _SENSED, _all(GATEWAY), _pilot, 1000, 16384),
    KeyRow("pose", Pose, _POSED, _pose_source, _any_of(_pose_readers, _turning_driver, _all(ROS)), 1000, 512),
    KeyRow("seen", Sighting, _SEEING, _all(GATEWAY), _pilot, 1000, 65536),
    KeyRow("estimate", Estimate, _RELAYING, _pilot, _any_of(_neighbours, _all(ROS)), 1000, 512),
    KeyRow("law", LawMessage, _SPEAKING, _pilot, _neighbours, 1000, 20480),
    KeyRow(LEADS, Signals, _SIGNS, _pilot, _all(AGENT), 60, 512, occasional=True),
    KeyRow("signals", Signals, _SIGNALLING, _pilot, _all(), 1000, 8192, occasional=True),
    KeyRow("command", Command, _FLYING, _pilot, _any_of(_driver, _all(ROS)), 1000, 512),
    KeyRow("telemetry", Telemetry, _FLYING, _driver, _any_of(_pilot, _all(*ORDERING, ROS)), 40, 512),
    KeyRow(
        "status", Status, _STARTED, _itself,
        _any_of(_led, _locating, _all(*ORDERING, ROS)), 40, 16384, Delivery.BACKGROUND,
    ),
    KeyRow(
        # An order that takes up: the gateway accepts it, and publishes it as the mission, or not.
        "proposal", Mission, _everybody, _any_of(_all(*ORDERING), _ros_orders("start", "formation")), _all(GATEWAY),
        400, 8192, Delivery.EVENT, None, ANY_TIME, keep_all=True,
    ),
    KeyRow(
        # A hold and a landing go to all at once. The gateway repeats the order in force, stamp unchanged.
        "mission", Mission, _everybody, _any_of(_all(*ORDERING, GATEWAY), _ros_orders("hold", "land")),
        _any_of(_all(GATEWAY, LEADING, AGENT), _walker),
        400, 8192, Delivery.EVENT, None, ANY_TIME, keep_all=True,
    ),
    KeyRow(
        # Clocks that are far apart must not block a stop.
        "stop", Stop, _everybody, _any_of(_all(*ORDERING), _ros_orders("stop")),
        _all(KINEMATICS, DRIVER, LEADING, AGENT), 400, 1024, Delivery.EVENT, maximum_age=120.0, max_future=120.0,
    ),
    KeyRow(BATCH, Batch, _BATCHING, _itself, _all(), 2 * SECOND // PERIOD, LARGEST, Delivery.BACKGROUND),
    KeyRow(STEERING, Steer, _STEERED, _steers, _pilot, 200, 512),
    KeyRow(  # between clocks with any offset
        TIME_REQUEST, TimeRequest, _other_hosts, _itself, _all(GATEWAY), 40, 512, maximum_age=None, max_future=ANY_TIME
    ),
    KeyRow(
        TIME_REPLY, TimeReply, _other_hosts, _all(GATEWAY), _itself, 40, 512, maximum_age=None, max_future=ANY_TIME
    ),
)  # fmt: skip

ROWS = {row.kind: row for row in TABLE}
MISSION = Key("mission")
PROPOSAL = Key("proposal")
STOP = Key("stop")


def key_text(swarm_name: str, key: Key) -> str:
    """Return the key on the wire; with a leading `/` it is the ROS 2 topic."""
    return f"{swarm_name}/{key.owner}/{key.kind}" if key.owner else f"{swarm_name}/{key.kind}"
