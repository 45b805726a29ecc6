"""The wire: every message as a named tuple with its codec beside it.

The payloads are ROS 2 messages in CDR, so that a trace or a bridge needs no translation. Stamps are Unix time in
nanoseconds: the time for which the content holds. Positions are metres, velocities m/s, both in the world frame (ENU)
that `frame` names. `decode` raises MessageError for bytes of another form and for numbers that are not finite.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple, Protocol, Self

from flockwire.domain.body import Body, BodyKind
from flockwire.domain.fields import from_fields
from flockwire.domain.motion import LeaderMotion
from flockwire.domain.time import SECOND
from flockwire.domain.vector import Vector
from flockwire.wire.cdr import HEADER, LONGEST_SEQUENCE, MessageError, Reader, Writer
from flockwire.wire.stamped import Layout, peek_length, unpack

MOST_LAYOUTS = 256  # of messages of nearby bodies, that are kept
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


_POSE: Final = Layout("ddddddd")


class Pose(NamedTuple):
    """geometry_msgs/PoseStamped: where a body is; the quaternion is x y z w."""

    stamp: int
    frame: str
    position: Vector
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        stamp, frame, position, orientation = self
        pack, length, raw = _POSE.heads[frame]
        return pack(HEADER, stamp // SECOND, stamp % SECOND, length, raw, *position, *orientation)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, v = unpack(data, _POSE)
        return from_fields(cls, (stamp, frame, v[:3], v[3:]))


class Leading(IntEnum):
    """What is known of the leader: whether it leads, in the air, or does not."""

    UNKNOWN = 0
    LEADS = 1
    IS_DOWN = 2  # it lands, stands on the ground, has fallen, or its process is silent


_LEADING: Final[dict[object, Leading]] = {int(state): state for state in Leading}
_ESTIMATE: Final = Layout("dddddddddiIBB")


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
        stamp, frame, motion, origin, hops, leading = self
        position, velocity, acceleration = motion
        pack, length, raw = _ESTIMATE.heads[frame]
        return pack(
            HEADER, stamp // SECOND, stamp % SECOND, length, raw, *position, *velocity, *acceleration,
            origin // SECOND, origin % SECOND, hops, leading,
        )  # fmt: skip

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, v = unpack(data, _ESTIMATE)
        leading = _LEADING.get(v[12])
        if leading is None or v[10] >= SECOND:
            raise MessageError(f"there is no state {v[12]} of a leader, or {v[10]} ns are more than a second")
        motion = from_fields(LeaderMotion, (v[:3], v[3:6], v[6:9]))
        return from_fields(cls, (stamp, frame, motion, v[9] * SECOND + v[10], v[11], leading))


_COMMAND: Final = Layout("dddddd")


class Command(NamedTuple):
    """geometry_msgs/TwistStamped: a velocity command; the stamp is that of the own pose it answers."""

    stamp: int
    frame: str
    velocity: Vector
    yaw_rate: float = 0.0  # rad/s, counter-clockwise

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        stamp, frame, velocity, yaw_rate = self
        pack, length, raw = _COMMAND.heads[frame]
        return pack(HEADER, stamp // SECOND, stamp % SECOND, length, raw, *velocity, 0.0, 0.0, yaw_rate)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, v = unpack(data, _COMMAND)
        return from_fields(cls, (stamp, frame, v[:3], v[5]))


_KINDS: Final[dict[object, BodyKind]] = {int(kind): kind for kind in BodyKind}


class _Layouts(dict[int, Layout]):
    """The layouts of messages of nearby bodies, by the number of bodies."""

    def __missing__(self, count: int) -> Layout:
        """Return the layout for another number."""
        if len(self) >= MOST_LAYOUTS:
            self.clear()
        found = self[count] = Layout("I" + "Bddddddd" * count)
        return found


_NEARBY: Final = _Layouts()


class Nearby(NamedTuple):
    """flockwire_msgs/NearbyBodies: what a relative sensor on board would see, without identities."""

    stamp: int
    frame: str
    bodies: tuple[Body, ...]

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        stamp, frame, bodies = self
        values: list[object] = []
        for kind, relative_position, radius, velocity in bodies:
            values += (kind, *relative_position, radius, *velocity)
        pack, length, raw = _NEARBY[len(bodies)].heads[frame]
        return pack(HEADER, stamp // SECOND, stamp % SECOND, length, raw, len(bodies), *values)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        count = peek_length(data)
        if count > LONGEST_SEQUENCE or count * SMALLEST_BODY > len(data):
            raise MessageError(f"{count} nearby bodies in {len(data)} bytes; the most is {LONGEST_SEQUENCE}")
        stamp, frame, v = unpack(data, _NEARBY[count])
        if not count:
            return from_fields(cls, (stamp, frame, ()))
        if min(v[5::8]) < 0.0:
            raise MessageError(f"a nearby body of radius {min(v[5::8])}, below 0")
        bodies: list[Body] = []
        for k in range(1, 8 * count, 8):
            kind = _KINDS.get(v[k])
            if kind is None:
                raise MessageError(f"there is no body of kind {v[k]}")
            bodies.append(from_fields(Body, (kind, v[k + 1 : k + 4], v[k + 4], v[k + 5 : k + 8])))
        return from_fields(cls, (stamp, frame, tuple(bodies)))


_DOUBT: Final = Layout("iI")


class IdentityDoubt(NamedTuple):
    """flockwire_msgs/IdentityDoubt: the tracker has the drone's name on another's body, since `since` (Unix ns)."""

    stamp: int
    frame: str
    since: int

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        pack, length, raw = _DOUBT.heads[self.frame]
        return pack(HEADER, *divmod(self.stamp, SECOND), length, raw, *divmod(self.since, SECOND))

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, (seconds, rest) = unpack(data, _DOUBT)
        if rest >= SECOND:
            raise MessageError(f"{rest} ns are more than a second")
        return cls(stamp, frame, seconds * SECOND + rest)


class FlightState(IntEnum):
    """What an airframe does."""

    GROUNDED = 0
    FLYING = 1
    LANDING = 2
    STOPPED = 3
    HELD = 4  # off the ground with its motors standing: in somebody's hand


_STATES: Final[dict[object, FlightState]] = {int(state): state for state in FlightState}
_TELEMETRY: Final = Layout("BdddB")


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
        pack, length, raw = _TELEMETRY.heads[self.frame]
        return pack(HEADER, *divmod(self.stamp, SECOND), length, raw, *self[2:])

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, v = unpack(data, _TELEMETRY)
        state = _STATES.get(v[0])
        if state is None:
            raise MessageError(f"there is no flight state {v[0]}")
        if v[4] not in (0, 1):
            raise MessageError(f"stop_received = {v[4]}: must be 0 or 1")
        return cls(stamp, frame, state, v[1], v[2], v[3], bool(v[4]))


_TIME_REQUEST: Final = Layout("")
_TIME_REPLY: Final = Layout("iIiI")


class TimeRequest(NamedTuple):
    """flockwire_msgs/TimeRequest: asks for the swarm's time; the stamp is by the own clock, uncorrected (t1)."""

    stamp: int
    frame: str

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        pack, length, raw = _TIME_REQUEST.heads[self.frame]
        return pack(HEADER, *divmod(self.stamp, SECOND), length, raw)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, _ = unpack(data, _TIME_REQUEST)
        return cls(stamp, frame)


class TimeReply(NamedTuple):
    """flockwire_msgs/TimeReply: the answer; the stamp is the swarm's time when it was sent (t3)."""

    stamp: int
    frame: str
    requested: int  # the request's stamp (t1)
    received: int  # the swarm's time when the request came (t2)

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        pack, length, raw = _TIME_REPLY.heads[self.frame]
        requested, received = divmod(self.requested, SECOND), divmod(self.received, SECOND)
        return pack(HEADER, *divmod(self.stamp, SECOND), length, raw, *requested, *received)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        stamp, frame, v = unpack(data, _TIME_REPLY)
        if max(v[1], v[3]) >= SECOND:
            raise MessageError(f"{max(v[1], v[3])} ns are more than a second")
        return cls(stamp, frame, v[0] * SECOND + v[1], v[2] * SECOND + v[3])


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
