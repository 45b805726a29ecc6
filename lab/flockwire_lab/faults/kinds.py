"""Faults as data: one class for each kind, with what it does to a core that it wraps. file.py reads them from a file.

A kind whose `cores` are not empty changes what these cores do (faulty_core.py): it edits its drones' messages of the
kinds `edits`, or the conditions of simulated cameras and airframes. All others act on processes
and links (injection.py).
`flockwire sim` supports every kind, `flockwire up` all that are not `sim_only`, and no loss or reordering of a link.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import inf
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from flockwire_core.control.auction import bids_of
from flockwire_core.domain.airframe import Telemetry
from flockwire_core.domain.law_message import LawMessage
from flockwire_core.domain.motion import Estimate, LeaderMotion, Leading
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import nanoseconds
from flockwire_core.domain.vector import add, scale
from flockwire_core.swarm.drones import Wind
from flockwire_core.swarm.model import uav
from flockwire_core.swarm.tables import Finite, Items, Model, NotNegative, Point, Positive, Probability
from flockwire_core.wire.codec import Message
from flockwire_core.wire.information import relays
from flockwire_core.wire.law_form import LawForm
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import Process
from flockwire_twins.simulated_airframe import Wear
from pydantic import ConfigDict, Field

from flockwire_lab.faults.targets import AIRFRAMES, CAMERAS, FOLLOWERS, targets

if TYPE_CHECKING:
    from flockwire_twins.kinematics.core import AirframeConditions
    from flockwire_twins.trackers.cameras import CameraConditions, SimulatedSource


PROCESS_KEYS = {"process": "process", "source": "from", "target": "to"}  # by field


class FaultKind(Model):
    """The common part of all faults: `at`, s after the take-off order. `since` is in s after `at`."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, populate_by_name=True)
    cores: ClassVar[tuple[Process, ...]] = ()  # whose cores it wraps
    edits: ClassVar[tuple[str, ...]] = ()  # kinds of keys, of whose messages it edits those of its drones
    sim_only: ClassVar[bool] = False

    at: NotNegative

    @property
    def lasts(self) -> float:
        """The duration, s; infinite for a fault that does not end."""
        return getattr(self, "duration", inf)

    def named_processes(self) -> dict[str, str]:
        """Return the processes that it names, by key."""
        listed = {f"processes.{place}": name for place, name in enumerate(getattr(self, "processes", ()))}
        return {key: getattr(self, field) for field, key in PROCESS_KEYS.items() if hasattr(self, field)} | listed

    def named_drones(self) -> dict[str, int]:
        """Return the drones that it names, by key."""
        listed = {f"drones.{place}": drone for place, drone in enumerate(getattr(self, "drones", ()))}
        return {"drone": self.drone} if hasattr(self, "drone") else listed

    def possible(self, plan: Plan) -> tuple[int, ...]:
        """Return the drones that it may name."""
        return plan.swarm.tracked

    def problems(self, plan: Plan) -> Iterator[tuple[str, str]]:
        """Yield the other keys that are wrong for a swarm, each with its value and the rule."""
        yield from ()

    def directions(self, plan: Plan) -> Iterator[tuple[str, str]]:
        """Yield the directed links (from, to) that it changes; recorder and operators always receive everything."""
        yield from ()

    @property
    def subject(self) -> str:
        """What it acts on, in words."""
        return ", ".join((*self.named_processes().values(), *map(uav, self.named_drones().values())))

    def prepare(self, stand_in: Any) -> None:  # noqa: ANN401  (what the core simulates)
        """Announce what it will need; called once, before the core steps."""

    def edit(self, message: Any, since: float, now: int) -> Message | None:  # noqa: ANN401  (by `edits`)
        """Return `message`, of `edits`, as the core publishes or receives it at `now` (Unix ns); None: not at all."""
        raise NotImplementedError

    def change(self, conditions: Any, since: float) -> Any:  # noqa: ANN401  (of its stand-in)
        """Return the `conditions` of the simulated cameras or airframes while it lasts."""
        return conditions


class _ProcessFault(FaultKind):
    process: str


class Kill(_ProcessFault):
    """The process ends at once (SIGKILL)."""

    kind: Literal["kill"]


class Restart(_ProcessFault):
    """The process restarts without state, in virtual time after 0.5 s; if it still runs, it is killed first."""

    kind: Literal["restart"]


class Freeze(_ProcessFault):
    """The process is frozen (SIGSTOP, SIGCONT); the newest messages of this time are buffered."""

    kind: Literal["freeze"]
    duration: Positive

    def outlasted(self, faults: Iterable[FaultKind]) -> bool:
        """Return whether one of `faults` freezes the process when this ends."""
        same = [one for one in faults if isinstance(one, Freeze) and one.process == self.process]
        return any(one.at < self.at + self.duration < one.at + one.duration for one in same)


class ClockStep(_ProcessFault):
    """The clock of the process is set forward by `step` (s; may be negative)."""

    sim_only: ClassVar[bool] = True
    kind: Literal["clock"]
    step: Finite


class _LinkFault(FaultKind):
    """Messages from `source` to `target` are disturbed for a time."""

    source: str = Field(alias="from")
    target: str = Field(alias="to")
    duration: Positive

    @property
    def subject(self) -> str:
        return f"{self.source} → {self.target}"

    def problems(self, plan: Plan) -> Iterator[tuple[str, str]]:
        known = targets(plan)
        subscribers = [name for name in known if name != self.source and plan.between(self.source, name)]
        if self.target not in subscribers and self.target in known:
            yield "to", f"{self.target!r}: receives nothing from {self.source}; must be one of {', '.join(subscribers)}"

    def directions(self, plan: Plan) -> Iterator[tuple[str, str]]:
        yield self.source, self.target


class Cut(_LinkFault):
    """Nothing that `from` publishes reaches `to`; the other direction is open.

    Zenoh closes a real link after 1 s, in both directions.
    """

    kind: Literal["cut"]


class LinkChange(_LinkFault):
    """`delay` and `jitter` (s), `loss` and `reordering` (shares) replace those of [sim].

    A real flight adds the first two to the link's own; the others must be 0.
    """

    kind: Literal["link"]
    delay: NotNegative = 0.0
    jitter: NotNegative = 0.0
    loss: Probability = 0.0
    reordering: Probability = 0.0


class Partition(FaultKind):
    """Nothing passes between these processes and all others, except the operator."""

    kind: Literal["partition"]
    processes: Annotated[Items[str], Field(min_length=1)]
    duration: Positive

    def directions(self, plan: Plan) -> Iterator[tuple[str, str]]:
        inside, known = set(self.processes), targets(plan)
        for source in known:
            for target in plan.partners[source]:
                if (source in inside) != (target in inside) and target in known:
                    yield source, target


LinkFault = Cut | LinkChange | Partition


class _DroneFault(FaultKind):
    drone: int


class TrackerLoss(_DroneFault):
    """The tracker does not see the drone."""

    cores = CAMERAS
    kind: Literal["tracker"]
    duration: Positive

    def change(self, conditions: CameraConditions, since: float) -> CameraConditions:
        return conditions._replace(unseen=conditions.unseen | {self.drone})


class FalsePose(_DroneFault):
    """The tracker reports the drone at a place that moves away from it at `velocity` (m/s)."""

    cores, edits = CAMERAS, ("truth",)
    kind: Literal["false_pose"]
    velocity: Point
    duration: Positive

    def edit(self, message: Pose, since: float, now: int) -> Pose:
        return message._replace(position=add(message.position, scale(self.velocity, since)))


class NoiseBurst(FaultKind):
    """The tracker's noise grows by `noise` (m, standard deviation per axis; root of the sum of squares)."""

    cores = CAMERAS
    kind: Literal["noise"]
    noise: Positive
    duration: Positive

    def change(self, conditions: CameraConditions, since: float) -> CameraConditions:
        return conditions._replace(noises=(*conditions.noises, self.noise))


class NameSwap(FaultKind):
    """The tracker exchanges the names of two drones' bodies."""

    cores = CAMERAS
    kind: Literal["swap"]
    drones: Annotated[tuple[int, int], Field(strict=False)]
    duration: Positive

    def problems(self, plan: Plan) -> Iterator[tuple[str, str]]:
        if self.drones[0] == self.drones[1]:
            yield "drones", f"{list(self.drones)}: must be two drones"

    def change(self, conditions: CameraConditions, since: float) -> CameraConditions:
        return conditions._replace(swaps=(*conditions.swaps, self.drones))


class Visitor(FaultKind):
    """Another body with this name at the tracker moves straight on from `start` (m) at `velocity` (m/s).

    By its name it is a person or a tracked obstacle.
    """

    cores = CAMERAS
    kind: Literal["visitor"]
    body: str = "visitor"  # its name at the tracker
    start: Point  # m
    velocity: Point  # m/s
    duration: Positive

    @property
    def subject(self) -> str:
        return self.body

    def prepare(self, stand_in: SimulatedSource) -> None:
        stand_in.announce(self.body)

    def change(self, conditions: CameraConditions, since: float) -> CameraConditions:
        place = add(self.start, scale(self.velocity, since))
        return conditions._replace(visitors=(*conditions.visitors, (self.body, place)))


class _AirframeFault(_DroneFault):
    cores = AIRFRAMES

    def possible(self, plan: Plan) -> tuple[int, ...]:
        return plan.swarm.flying


class AirframeLag(_AirframeFault):
    """The simulated airframe has this `lag` and `dead_time` (s) from now on; its agent does not know."""

    kind: Literal["lag"]
    lag: NotNegative
    dead_time: NotNegative = 0.0

    def change(self, conditions: AirframeConditions, since: float) -> AirframeConditions:
        response = {uav(self.drone): (self.lag, self.dead_time)}
        return conditions._replace(responses={**conditions.responses, **response})


class AirframeFailure(_AirframeFault):
    """The motors of the simulated airframe stop: it falls."""

    kind: Literal["failure"]

    def change(self, conditions: AirframeConditions, since: float) -> AirframeConditions:
        return conditions._replace(failed=conditions.failed | {uav(self.drone)})


class AirframeWear(_AirframeFault):
    """Shares of its own that the airframe's mass, gains, and each rotor's thrust have from now on; 0: a lost rotor."""

    kind: Literal["wear"]
    mass: Annotated[float, Field(gt=0, le=3)] = 1.0
    gains: Annotated[float, Field(gt=0, le=3)] = 1.0
    rotors: Annotated[tuple[Probability, Probability, Probability, Probability], Field(strict=False)] = (1, 1, 1, 1)

    def possible(self, plan: Plan) -> tuple[int, ...]:
        return tuple(i for i in plan.swarm.simulated if plan.swarm.row(i).wears)

    def change(self, conditions: AirframeConditions, since: float) -> AirframeConditions:
        worn = {uav(self.drone): Wear(self.mass, self.gains, self.rotors)}
        return conditions._replace(worn={**conditions.worn, **worn})


class FalseHeight(_AirframeFault):
    """The telemetry of an airframe without a driver of its own reports a height that is `offset` (m) too large."""

    edits = ("telemetry",)
    kind: Literal["false_height"]
    offset: Finite
    duration: Positive

    def possible(self, plan: Plan) -> tuple[int, ...]:
        return tuple(i for i in plan.swarm.flying if i not in plan.swarm.driven)  # those have drivers of their own

    def edit(self, message: Telemetry, since: float, now: int) -> Telemetry:
        return message._replace(height=message.height + self.offset)


class WindChange(FaultKind, Wind):
    """A `velocity` and a `gust` (m/s) replace the [wind] of all simulated airframes."""

    cores = AIRFRAMES
    kind: Literal["wind"]
    duration: Positive

    def change(self, conditions: AirframeConditions, since: float) -> AirframeConditions:
        return conditions._replace(wind=self)


class _AgentFault(_DroneFault):
    """An agent lies within its rights: it flies by its own estimate, and publishes another one."""

    cores = FOLLOWERS
    duration: Positive

    def possible(self, plan: Plan) -> tuple[int, ...]:
        return plan.swarm.followers


class FalseEstimate(_AgentFault):
    """The follower publishes a leader estimate that moves away from its own one at `velocity` (m/s)."""

    edits = ("estimate",)
    kind: Literal["false_estimate"]
    velocity: Point

    def edit(self, message: Estimate, since: float, now: int) -> Estimate:
        x, v, a = message.motion.fields()
        motion = LeaderMotion(add(x, scale(self.velocity, since)), add(v, self.velocity), a)
        return message._replace(motion=motion)


class FalseAge(_AgentFault):
    """The follower claims that the leader leads and that its data of the leader is `age` (s) old."""

    edits = ("estimate",)
    kind: Literal["false_age"]
    age: NotNegative

    def edit(self, message: Estimate, since: float, now: int) -> Estimate:
        return message._replace(origin=now - nanoseconds(self.age), hops=0, leading=Leading.LEADS)


class FalseBids(_AgentFault):
    """The follower claims every place of an auction at `price` (m²)."""

    edits = ("law",)
    kind: Literal["false_bids"]
    price: Positive

    def possible(self, plan: Plan) -> tuple[int, ...]:
        return plan.swarm.followers if relays(plan.swarm) else ()  # else they send what their own law says

    def edit(self, message: LawMessage, since: float, now: int) -> LawMessage:
        return message._replace(contents=tuple([(stamp, self._false(data)) for stamp, data in message.contents]))

    def _false(self, data: bytes) -> bytes:
        """Return the octets of the same bids by this drone, at its price."""
        places = len(data) // 16 - 1
        form = LawForm(bids_of(places))
        bids: Any = form.unpack(data)
        return form.pack(bids._replace(prices=(self.price,) * places, bidders=(self.drone,) * places))


Fault = (
    Kill | Restart | Freeze | Cut | LinkChange | Partition | TrackerLoss | NoiseBurst | NameSwap | Visitor | ClockStep
    | AirframeLag | WindChange | AirframeFailure | FalseEstimate | FalseAge | FalseBids | FalsePose
    | FalseHeight | AirframeWear
)  # fmt: skip
