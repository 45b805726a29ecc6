"""The wire: every message as a named tuple with its codec beside it.

The payloads are ROS 2 messages in CDR, so that a trace or a bridge needs no translation. Stamps are Unix time in
nanoseconds: the time for which the content holds. Positions are metres, velocities m/s, both in the world frame (ENU)
that `frame` names. `decode` raises MessageError for bytes of another form and for numbers that are not finite.
"""

from __future__ import annotations

from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple, Protocol, Self

from flockwire.domain.body import Body, BodyKind
from flockwire.domain.motion import LeaderMotion
from flockwire.domain.time import SECOND
from flockwire.domain.vector import Vector
from flockwire.wire.cdr import LONGEST_SEQUENCE, MessageError, Reader, Writer
from flockwire.wire.stamped import pack, peek_length, unpack

SMALLEST_BODY = 57  # bytes that a nearby body takes at least


class Message(Protocol):
    """What all messages share."""

    @property
    def stamp(self) -> int:
        """Unix time in ns for which the content holds."""

    def encode(self) -> bytes:
        """Return the CDR bytes."""

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""


class Pose(NamedTuple):
    """geometry_msgs/PoseStamped: where a body is; the quaternion is x y z w."""

    stamp: int
    frame: str
    position: Vector
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        return pack(self.stamp, self.frame, "ddddddd", *self.position, *self.orientation)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, v = unpack(data, "ddddddd")
        return cls(stamp, frame, (v[0], v[1], v[2]), (v[3], v[4], v[5], v[6]))


class Leading(IntEnum):
    """What is known of the leader: whether it leads, in the air, or does not."""

    UNKNOWN = 0
    LEADS = 1
    IS_DOWN = 2  # it lands, stands on the ground, has fallen, or its process is silent


_LEADING: dict[object, Leading] = {int(state): state for state in Leading}


class Estimate(NamedTuple):
    """flockwire_msgs/LeaderEstimate: one follower's estimate of the leader's motion.

    `origin` is the time of the leader's pose that it is based on, Unix ns, after as many `hops`.
    """

    stamp: int
    frame: str
    motion: LeaderMotion
    origin: int = 0
    hops: int = 0
    leading: Leading = Leading.UNKNOWN

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        position, velocity, acceleration = self.motion
        sec, nanosec = divmod(self.origin, SECOND)
        return pack(
            self.stamp, self.frame, "dddddddddiIBB", *position, *velocity, *acceleration,
            sec, nanosec, self.hops, self.leading,
        )  # fmt: skip

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, v = unpack(data, "dddddddddiIBB")
        leading = _LEADING.get(v[12])
        if leading is None or v[10] >= SECOND:
            raise MessageError(f"there is no state {v[12]} of a leader, or {v[10]} ns are more than a second")
        origin = int(v[9]) * SECOND + int(v[10])
        motion = LeaderMotion((v[0], v[1], v[2]), (v[3], v[4], v[5]), (v[6], v[7], v[8]))
        return cls(stamp, frame, motion, origin, int(v[11]), leading)


class Command(NamedTuple):
    """geometry_msgs/TwistStamped: a velocity command; the stamp is that of the own pose it answers."""

    stamp: int
    frame: str
    velocity: Vector
    yaw_rate: float = 0.0  # rad/s, counter-clockwise

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        return pack(self.stamp, self.frame, "dddddd", *self.velocity, 0.0, 0.0, self.yaw_rate)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, v = unpack(data, "dddddd")
        return cls(stamp, frame, (v[0], v[1], v[2]), v[5])


_KINDS: dict[object, BodyKind] = {int(kind): kind for kind in BodyKind}


class Nearby(NamedTuple):
    """flockwire_msgs/NearbyBodies: what a relative sensor on board would see, without identities."""

    stamp: int
    frame: str
    bodies: tuple[Body, ...]

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        stamp, frame, bodies = self
        values: list[object] = []
        for kind, (x, y, z), radius, (vx, vy, vz) in bodies:
            values += (kind, x, y, z, radius, vx, vy, vz)
        return pack(stamp, frame, _bodies(len(bodies)), len(bodies), *values)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        count = peek_length(data)
        if count > LONGEST_SEQUENCE or count * SMALLEST_BODY > len(data):
            raise MessageError(f"{count} nearby bodies in {len(data)} bytes; the most is {LONGEST_SEQUENCE}")
        stamp, frame, v = unpack(data, _bodies(count))
        if count and min(v[5::8]) < 0.0:
            raise MessageError(f"a nearby body of radius {min(v[5::8])}, below 0")
        try:
            bodies = tuple(
                [
                    Body(_KINDS[kind], (x, y, z), r, (vx, vy, vz))
                    for kind, x, y, z, r, vx, vy, vz in zip(*([iter(v[1:])] * 8), strict=True)
                ]
            )
        except KeyError as kind:
            raise MessageError(f"there is no body of kind {kind}") from None
        return cls(stamp, frame, bodies)


class IdentityDoubt(NamedTuple):
    """flockwire_msgs/IdentityDoubt: the tracker has the drone's name on another's body, since `since` (Unix ns)."""

    stamp: int
    frame: str
    since: int

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        return pack(self.stamp, self.frame, "iI", *divmod(self.since, SECOND))

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, (seconds, rest) = unpack(data, "iI")
        if rest >= SECOND:
            raise MessageError(f"{rest} ns are more than a second")
        return cls(stamp, frame, int(seconds) * SECOND + int(rest))


class FlightState(IntEnum):
    """What an airframe does."""

    GROUNDED = 0
    FLYING = 1
    LANDING = 2
    STOPPED = 3
    HELD = 4  # off the ground with its motors standing: in somebody's hand


_STATES: dict[object, FlightState] = {int(state): state for state in FlightState}


class Telemetry(NamedTuple):
    """flockwire_msgs/Telemetry: the state of an airframe.

    From an emergency stop on `stop_received` is true; the state is STOPPED when the drone is known to be down.
    """

    stamp: int
    frame: str
    state: FlightState
    battery: float  # share of full, 0 to 1
    height: float  # m above the ground
    command_age: float  # s since the last command; -1 before the first
    stop_received: bool = False

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        return pack(
            self.stamp, self.frame, "BdddB", self.state, self.battery, self.height, self.command_age, self.stop_received
        )

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, v = unpack(data, "BdddB")
        state = _STATES.get(v[0])
        if state is None:
            raise MessageError(f"there is no flight state {v[0]}")
        if v[4] not in (0, 1):
            raise MessageError(f"stop_received = {v[4]}: must be 0 or 1")
        return cls(stamp, frame, state, v[1], v[2], v[3], bool(v[4]))


class TimeRequest(NamedTuple):
    """flockwire_msgs/TimeRequest: asks for the swarm's time; the stamp is by the own clock, uncorrected (t1)."""

    stamp: int
    frame: str

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        return pack(self.stamp, self.frame, "")

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, _ = unpack(data, "")
        return cls(stamp, frame)


class TimeReply(NamedTuple):
    """flockwire_msgs/TimeReply: the answer; the stamp is the swarm's time when it was sent (t3)."""

    stamp: int
    frame: str
    requested: int  # the request's stamp (t1)
    received: int  # the swarm's time when the request came (t2)

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        return pack(self.stamp, self.frame, "iIiI", *divmod(self.requested, SECOND), *divmod(self.received, SECOND))

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, v = unpack(data, "iIiI")
        if max(v[1], v[3]) >= SECOND:
            raise MessageError(f"{max(v[1], v[3])} ns are more than a second")
        return cls(stamp, frame, int(v[0]) * SECOND + int(v[1]), int(v[2]) * SECOND + int(v[3]))


MISSION_VERBS = ("prepare", "takeoff", "start", "formation", "hold", "land")  # "prepare" says who is left out
IN_FORMATION = ("start", "formation")  # "formation" is "start", but for drones in the air alone
LONGEST_CHANGE = 600.0  # s


class Change(NamedTuple):
    """How a formation is changed to: the one `before`, and who takes which place in either.

    `places_before[k]` and `places[k]` are the ranks of the k-th follower. `begin` is Unix ns, `duration` s.
    """

    begin: int
    duration: float
    before: str  # a name from [formations], empty for [formation]
    places_before: tuple[int, ...]
    places: tuple[int, ...]


UNSIGNED = 0xFFFFFFFF  # the int32 of a time is packed with the numbers beside it, which are unsigned
MOST_VERSIONS = 64  # orders that one message names


class Version(NamedTuple):
    """flockwire_msgs/OrderVersion: which order one is. Versions are compared for equality: no clock decides."""

    stamp: int  # Unix ns, by the clock of who gave it
    giver: int  # a number of who gave it: 31 bits, one for each flight or order that a station conducts


class Mission(NamedTuple):
    """flockwire_msgs/Mission: what the operator wants of all drones; each pilot decides by `knows` whether it holds."""

    stamp: int
    frame: str
    verb: str  # one of MISSION_VERBS
    start: int = 0  # Unix time in ns at which the formation's time is 0 (verbs IN_FORMATION)
    formation: str = ""  # a name from [formations], empty for [formation]
    change: Change | None = None  # None where it is flown from the beginning, everybody in the place of their own rank
    without: tuple[int, ...] = ()  # the drones that stay on the ground, and that nobody waits for
    giver: int = 0  # who gave it (Version)
    knows: tuple[Version, ...] = ()  # the orders that its giver knew of, and made it from

    @property
    def version(self) -> Version:
        """Which order it is."""
        return Version(self.stamp, self.giver)

    @property
    def in_formation(self) -> bool:
        """Whether a formation is to be flown."""
        return self.verb in IN_FORMATION

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        writer = Writer()
        writer.time(self.stamp)
        writer.text(self.frame)
        writer.text(self.verb)
        write_formation(writer, self)
        return writer.finish()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        reader = Reader(data)
        stamp, frame, verb = reader.time(), reader.text(), reader.text()
        mission = cls(stamp, frame, verb, *read_formation(reader))
        reader.end()
        if verb not in MISSION_VERBS:
            raise MessageError(f"there is no mission {verb!r}")
        return mission


def write_formation(writer: Writer, mission: Mission) -> None:
    """Append which formation a mission flies, since when, how it is changed to, without whom, and who gave it."""
    writer.time(mission.start)
    writer.text(mission.formation)
    begin, duration, before, places_before, places = mission.change or NO_CHANGE
    writer.time(begin)
    writer.put("d", duration)
    writer.text(before)
    writer.numbers("H", places_before)
    writer.numbers("H", places)
    writer.numbers("H", mission.without)
    writer.put("I", mission.giver)
    write_versions(writer, mission.knows)


def read_formation(
    reader: Reader,
) -> tuple[int, str, Change | None, tuple[int, ...], int, tuple[Version, ...]]:
    """Take what `write_formation` appends; raises MessageError."""
    start, formation = reader.time(), reader.text()
    change = Change(reader.time(), reader.take_all("d", 1)[0], reader.text(), reader.numbers("H"), reader.numbers("H"))
    without, giver, knows = reader.numbers("H"), reader.take("I"), read_versions(reader)
    if change == NO_CHANGE:
        return start, formation, None, without, giver, knows
    ranks = list(range(len(change.places)))
    if sorted(change.places) != ranks or sorted(change.places_before) != ranks:
        raise MessageError("a change of formation in which two have one place")
    if not 0.0 < change.duration <= LONGEST_CHANGE:
        raise MessageError(f"a change of formation that takes {change.duration} s")
    return start, formation, change, without, giver, knows


def write_versions(writer: Writer, versions: tuple[Version, ...]) -> None:
    """Append which orders are named; of more than MOST_VERSIONS the last."""
    flat: list[int] = []
    for stamp, giver in versions[-MOST_VERSIONS:]:
        flat += (stamp // SECOND & UNSIGNED, stamp % SECOND, giver)
    writer.put_all("I", len(flat) // 3, *flat)


def read_versions(reader: Reader) -> tuple[Version, ...]:
    """Take what `write_versions` appends; raises MessageError."""
    count = reader.length()
    if count > MOST_VERSIONS:
        raise MessageError(f"names {count} orders, the most is {MOST_VERSIONS}")
    if not count:
        return ()
    parts = [int(part) for part in reader.take_all("I", 3 * count)]
    if max(parts[1::3]) >= SECOND:
        raise MessageError(f"{max(parts[1::3])} ns are more than a second")
    triples = zip(parts[::3], parts[1::3], parts[2::3], strict=True)
    return tuple([Version(_signed(seconds) * SECOND + rest, giver) for seconds, rest, giver in triples])


def _signed(seconds: int) -> int:
    return seconds if seconds <= UNSIGNED >> 1 else seconds - UNSIGNED - 1


NO_CHANGE = Change(0, 0.0, "", (), ())


class Stop(NamedTuple):
    """flockwire_msgs/Stop: emergency stop, motors off."""

    stamp: int
    frame: str
    reason: str

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        writer = Writer()
        writer.time(self.stamp)
        writer.text(self.frame)
        writer.text(self.reason)
        return writer.finish()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        reader = Reader(data)
        stop = cls(reader.time(), reader.text(), reader.text())
        reader.end()
        return stop


@lru_cache(maxsize=256)
def _bodies(count: int) -> str:
    return "I" + "Bddddddd" * count
