"""The interface of a control law; your own law needs no other module of flockwire (docs/own_law.md).

A law declares its `information`, the class attribute from which follows all that it can see and send. It is pure: an
observation goes in, a command and a message come out. It reads no clock, does no input or output and draws no random
numbers; it may keep state from step to step. `[control] law = "package.module:ClassName"` flies any class of this form.
Positions are m, velocities m/s, world frame (ENU); times are Unix ns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum, IntFlag
from math import inf
from types import MappingProxyType
from typing import Any, Final, NamedTuple, Protocol

from flockwire_core.compiling import mypyc_attr
from flockwire_core.control.formation import Formation
from flockwire_core.control.guard import GuardParameters
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.law_message import LONGEST_NAME, MOST_SIGNALS
from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.record import Record
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, distance, limit, norm, scale, subtract
from flockwire_core.swarm.tables import Finite, NotNegative, Parameters, Positive, Share

__all__ = [
    "RELAYING", "SECOND", "ZERO", "Body", "BodyKind", "Decision", "Finite", "Heard", "Information", "Law",
    "LawSettings", "LeaderMotion", "Motion", "NotNegative", "Observation", "Output", "Pace", "Parameters", "Place",
    "Positive", "Seen", "Sense", "Share", "Vector", "add", "distance", "limit", "norm", "scale", "subtract",
]  # fmt: skip

END_OF_TIME: Final = SECOND << 31  # Unix ns of the first stamp that a message cannot hold


class LawSettings(NamedTuple):
    """The input of a law's constructor: the constants of one drone, and the law's parameters."""

    number: int  # of the follower
    period: float  # s, between two steps
    lag: float  # s, of its airframe
    dead_time: float  # s, likewise
    speed: float  # m/s, at most
    acceleration: float  # m/s^2, at most
    parameters: Mapping[str, object]  # for `Parameters.of`
    guard: GuardParameters  # of the safety filter: the distances that it keeps, the room, its limits
    neighbours: Mapping[int, float] = MappingProxyType({})  # w_ij of its in-neighbours, by number


class Sense(IntFlag):
    """What is sensed of a drone; of another one it is relative to the own drone, in world axes."""

    NOTHING = 0
    BEARING = 1
    DISTANCE = 2
    POSITION = 4
    VELOCITY = 8


STATE: Final = Sense.POSITION | Sense.VELOCITY


class Output(Enum):
    """What three numbers of a command are: m/s or m/s^2, world axes."""

    VELOCITY = "velocity"
    ACCELERATION = "acceleration"


class Pace(Enum):
    """How the messages of a law travel."""

    STEP = "the newest counts"
    ROUND = "every one arrives, in order, none skipped"
    EVENT = "silence is normal, the last one is kept"


class Information(NamedTuple):
    """What a law may know and says: gateway, access control, recorder, probe and `check` follow from it."""

    neighbours: Sense = Sense.NOTHING  # relative, of each drone with an edge to this one
    around: Sense = Sense.NOTHING  # of whoever is within `radius`, without an edge; anything: `bodies` too
    radius: float = 0.0  # m
    named: bool = False  # those around have their numbers
    own: Sense = Sense.NOTHING  # POSITION | VELOCITY of the own drone; the pilot sees all
    output: Output = Output.VELOCITY
    message: type | None = None  # a NamedTuple of floats, ints, fixed tuples of them
    pace: Pace = Pace.STEP
    silence: float = 0.3  # s, after which a neighbour counts as lost; of a LeaderMotion: limits.staleness
    leaders: tuple[int, int] = (0, 0)  # least, most
    directed: bool = True  # False: the graph must be symmetric
    signed: bool = False  # weights of both signs are taken
    planar: bool = False  # the pilot holds the height
    deadline: float = 0.0  # s, of `plan`, computed aside


@mypyc_attr(acyclic=True)
class Seen(Record):
    """A drone that is seen, relative to the own drone; what the law does not declare is None.

    `number` is -1 unless it is known, `weight` w_ij (0 without an edge); `leads`: it is a leader; `bearing` is a unit
    vector, `distance` m, `position` m, `velocity` m/s; `age` s of the measurement behind it.
    """

    __slots__ = ("number", "weight", "leads", "bearing", "distance", "position", "velocity", "age")

    def __init__(
        self,
        number: int = -1,
        weight: float = 0.0,
        leads: bool = False,
        bearing: Vector | None = None,
        distance: float | None = None,
        position: Vector | None = None,
        velocity: Vector | None = None,
        age: float = 0.0,
    ) -> None:
        self.number: Final = number
        self.weight: Final = weight
        self.leads: Final = leads
        self.bearing: Final = bearing
        self.distance: Final = distance
        self.position: Final = position
        self.velocity: Final = velocity
        self.age: Final = age


@mypyc_attr(acyclic=True)
class Heard(Record):
    """A message of an in-neighbour: its `content`, valid for the time `stamp`, the `sequence`-th that it sent."""

    __slots__ = ("number", "weight", "leads", "stamp", "sequence", "content")

    def __init__(self, number: int, weight: float, leads: bool, stamp: int, sequence: int, content: Any) -> None:  # noqa: ANN401
        self.number: Final = number
        self.weight: Final = weight  # w_ij
        self.leads: Final = leads
        self.stamp: Final = stamp  # Unix ns
        self.sequence: Final = sequence  # from 1 on; of a LeaderMotion 0
        self.content: Final = content  # of the type that the law declares


@mypyc_attr(acyclic=True)
class Place(Record):
    """The place in the formation: h_i and h_i' at `t` s since time 0 of the formation's order."""

    __slots__ = ("formation", "rank", "start", "ranks")

    def __init__(self, formation: Formation, rank: int, start: int = 0, ranks: Mapping[int, int] | None = None) -> None:
        self.formation: Final = formation
        self.rank: Final = rank
        self.start: Final = start  # time 0, Unix ns
        self.ranks: Final = ranks or {}  # of the in-neighbours in the formation; a leader has none, its offset is zero

    def offset(self, t: float) -> Vector:
        """Return h_i, m."""
        return self.formation.offset(self.rank, t)

    def rate(self, t: float) -> Vector:
        """Return h_i', m/s."""
        return self.formation.offset_rate(self.rank, t)

    def to(self, j: int, t: float) -> Vector:
        """Return h_i - h_j of the in-neighbour j, m."""
        rank = self.ranks.get(j)
        own = self.formation.offset(self.rank, t)
        return own if rank is None else subtract(own, self.formation.offset(rank, t))

    def rate_to(self, j: int, t: float) -> Vector:
        """Return h_i' - h_j' of the in-neighbour j, m/s."""
        rank = self.ranks.get(j)
        own = self.rate(t)
        return own if rank is None else subtract(own, self.formation.offset_rate(rank, t))


@mypyc_attr(acyclic=True)
class Observation(Record):
    """The input of a law at one step; what it does not declare is None or empty."""

    __slots__ = (
        "t", "dt", "stamp", "position", "velocity", "neighbours", "around", "bodies", "heard", "news", "place", "plan",
        "now", "motion",
    )  # fmt: skip

    def __init__(
        self,
        t: float = 0.0,
        dt: float = 0.0,
        stamp: int = 0,
        position: Vector | None = None,
        velocity: Vector | None = None,
        neighbours: Sequence[Seen] = (),
        around: Sequence[Seen] = (),
        bodies: Sequence[Body] = (),
        heard: Sequence[Heard] = (),
        news: Sequence[Heard] = (),
        place: Place | None = None,
        plan: Any = None,  # noqa: ANN401
        now: int = 0,
        motion: Motion | None = None,
    ) -> None:
        self.t: Final = t  # s since time 0 of the formation's order, 0 outside the formation phase
        self.dt: Final = dt  # s since the last step
        self.stamp: Final = stamp  # of the own pose, Unix ns
        self.position: Final = position  # of the own drone, m; None while its pose is stale
        self.velocity: Final = velocity  # likewise, m/s
        self.neighbours: Final = neighbours  # in-neighbours that are freshly seen
        self.around: Final = around  # whoever is within the radius
        self.bodies: Final = bodies  # anonymous drones, obstacles, people, relative to the own drone
        self.heard: Final = heard  # the newest message of each in-neighbour that is not silent
        self.news: Final = news  # all messages since the last step, in order; no LeaderMotion
        self.place: Final = place  # None outside the formation phase, or without a place: the command is not used
        self.plan: Final = plan  # the newest result of `plan` that counts already
        self.now: Final = now  # Unix ns
        self.motion: Final = motion  # of who sees all of its own drone: also the stopping point


@mypyc_attr(acyclic=True)
class Decision(Record):
    """The output of a law: a command for the airframe, a message for the out-neighbours, an error of its own measure.

    `command` is any three numbers; `message` None: nothing to send; `error` m, None: the law has none. `signals` are
    numbers by name that the trace keeps; no other drone receives them. `check_decision` judges what is given.
    """

    __slots__ = ("command", "message", "error", "signals", "stamp")

    def __init__(
        self,
        command: Any = ZERO,  # noqa: ANN401
        message: Any = None,  # noqa: ANN401
        error: Any = None,  # noqa: ANN401
        signals: Mapping[str, float] | None = None,
        stamp: Any = 0,  # noqa: ANN401
    ) -> None:
        self.command: Final = command
        self.message: Final = message
        self.error: Final = error
        self.signals: Final = signals
        self.stamp: Final = stamp  # Unix ns for which the message is valid; 0: now


@mypyc_attr(native_class=False)  # else no user's class could inherit from it
class Law(Protocol):
    """A control law of one follower; all but `step` may be missing.

    Further methods: `plan(observation)`, computed aside, its result counts `information.deadline` after the
    observation; `lead(t, motion) -> message` of a leader; `check(graph, places, parameters) -> (problems, notes,
    predicted rates)`.
    """

    def __init__(self, settings: LawSettings) -> None:
        """Start."""

    def step(self, observation: Observation) -> Decision:
        """Return the decision; called at the control rate, also on the ground."""


RELAYING: Final = Information(  # of the laws that relay estimates of the leader from neighbour to neighbour
    around=Sense.POSITION, own=STATE, message=LeaderMotion, leaders=(1, 1)
)


def leader_of(heard: Heard) -> LeaderMotion:
    """Return the motion of the leader that a neighbour sent."""
    motion: LeaderMotion = heard.content
    return motion


UNORDERED: Final = (str, bytes, set, frozenset, dict)  # three of its parts are no three numbers


def three(numbers: Any) -> Vector:  # noqa: ANN401
    """Return three finite numbers as a vector; raises ValueError for anything else."""
    if type(numbers) is tuple and len(numbers) == 3:
        x, y, z = numbers
        if type(x) is float and type(y) is float and type(z) is float and -inf < x + y + z < inf:
            return (x, y, z)
    try:
        found = () if isinstance(numbers, UNORDERED) else tuple(numbers)
        if len(found) != 3 or any(hasattr(one, "__len__") or isinstance(one, complex) for one in found):
            raise ValueError
        x, y, z = float(found[0]), float(found[1]), float(found[2])
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"must be three numbers, is {' '.join(repr(numbers).split())}") from None
    if not -inf < x + y + z < inf:
        raise ValueError(f"holds a number that is not finite, {numbers!r}")
    return (x, y, z)


def check_decision(decision: object) -> Vector:
    """Return the command of a decision; raise an error for one that cannot be flown or sent."""
    if not isinstance(decision, Decision):
        raise TypeError(f"a step must return a Decision, not {decision!r}")
    message = decision.message
    try:
        command = three(decision.command)
    except ValueError as error:
        raise ValueError(f"command {error}") from None
    if isinstance(message, LeaderMotion):
        x, v, a = message.position, message.velocity, message.acceleration
        if not (isinstance(x, tuple) and isinstance(v, tuple) and isinstance(a, tuple)):
            raise TypeError(f"a vector of a LeaderMotion must be a tuple of three floats: {message}")
        three(x)
        three(v)
        three(a)
    if not isinstance(decision.stamp, int) or not 0 <= decision.stamp < END_OF_TIME:
        raise ValueError(f"the stamp must be an int, in ns: {decision}")
    if decision.error is not None and not is_number(decision.error):
        raise ValueError(f"error = {decision.error!r}: must be a finite number, or None")
    if decision.signals is not None:
        _check_signals(decision.signals)
    return command


def _check_signals(signals: Mapping[Any, Any]) -> None:
    """Raise ValueError or TypeError for signals that a trace cannot keep."""
    if not isinstance(signals, Mapping):
        raise TypeError(f"signals = {signals!r}: must be numbers by name, a dict")
    if len(signals) > MOST_SIGNALS:
        raise ValueError(f"{len(signals)} signals: must be {MOST_SIGNALS} or fewer")
    for name, value in signals.items():
        if not isinstance(name, str) or not 0 < len(name) <= LONGEST_NAME:
            raise ValueError(f"signal {name!r}: its name must be text of 1 to {LONGEST_NAME} characters")
        if not is_number(value):
            raise ValueError(f"signal {name!r} = {value!r}: must be a finite number")


def is_number(value: Any) -> bool:  # noqa: ANN401
    """Return whether a law's `value` is one finite number."""
    try:
        return not isinstance(value, str) and -inf < float(value) < inf
    except (TypeError, ValueError, OverflowError):
        return False
