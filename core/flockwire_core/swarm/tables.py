"""The tables of a swarm file as frozen models; each field has its unit and its rule. model.py puts them together."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from math import inf
from typing import Annotated, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, JsonValue, WithJsonSchema, model_validator

from flockwire_core.control.fence import Room
from flockwire_core.domain.body import Separation
from flockwire_core.swarm.wording import Takes

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Age = Annotated[float, Field(gt=0, le=60, allow_inf_nan=False)]  # s; the bounds refuse milliseconds and millimetres
Delay = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]  # s
Lag = Annotated[float, Field(ge=0, le=10, allow_inf_nan=False)]  # s
Margin = Annotated[float, Field(ge=0, le=10, allow_inf_nan=False)]  # m
Size = Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)]  # m
Probability = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Point = tuple[Finite, Finite, Finite]
Port = Annotated[int, Field(ge=1024, le=65535)]
Corner = tuple[Finite, Finite]


def _edge(ends: object) -> tuple[int, int, float]:
    match ends:
        case [int(source), int(target)]:
            return source, target, 1.0
        case [int(source), int(target), int(weight) | float(weight)] if 0.0 < weight < inf:
            return source, target, float(weight)
    raise ValueError("must be [from, to] or [from, to, weight]: two ids of drones, and a weight above 0")


Edge = Annotated[
    tuple[int, int, float],
    BeforeValidator(_edge),
    Takes("[from, to] or [from, to, weight]"),
    WithJsonSchema({"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 3}),
]


class Model(BaseModel):
    """Frozen, typed strictly, and closed against unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Parameters(Model):
    """Base of the model of `[control.parameters]`, your own law's attribute `Parameters`."""

    @classmethod
    def of(cls, given: Mapping[str, object]) -> Self:
        """Return the swarm file's parameters; raises ValueError for bad ones, which `flockwire check` finds before."""
        return cls.model_validate_json(json.dumps(given))


class Control(Model):
    """The control law, the gains of the formation tracking protocol (9), and the safety filter round it."""

    rate_hz: Annotated[int, Field(ge=10, le=500)] = 100  # Hz, of control steps
    law: str = "extended"  # "extended", "paper" or your own, "file.py:ClassName" or "package.module:ClassName"
    parameters: dict[str, JsonValue] = Field(default={})  # those of your own law
    formation_gain: Positive = 3.0  # 1/s, K: gain towards the follower's place
    compensation_gain: NotNegative = 0.2  # m/s, phi: compensates the leader's unknown motion (law "paper")
    compensation_smoothing: Size = 0.01  # m, epsilon: width of the soft sign behind it (law "paper")
    disturbance: NotNegative = 0.0  # m/s, most that pilots estimate and compensate: wind, a wrong gain (safety filter)
    safety_filter: bool | None = None  # whether it is used; default: with every law but "paper"

    @property
    def own_law(self) -> bool:
        """Whether the law is none of the built-in ones."""
        return ":" in self.law

    @property
    def filtered(self) -> bool:
        """Whether the law has the safety filter."""
        return self.law != "paper" if self.safety_filter is None else self.safety_filter


class Observer(Model):
    """The fixed-time observer (8)."""

    step: Literal["implicit", "explicit"] = "implicit"  # of the integration (law "paper"; "extended" is implicit)
    gain: Positive = 3.0  # m/s, mu
    exponent: Annotated[float, Field(gt=1, allow_inf_nan=False)] = 1.5  # p
    velocity_time_constant: Age = 0.15  # s, of the filter behind the published velocity estimate (law "paper")
    leader_time_constant: Age | None = None  # s, of the tracker of the leader's velocity; default: by the depth


class Avoidance(Model):
    """The repulsive potentials of (9), the sensing, and the required distances."""

    sensing: Literal["nearby", "neighbours"] = "nearby"  # all nearby bodies, or only the neighbours' poses
    sensing_radius: Positive = 1.5  # m, within which bodies are sensed
    drone_gain: NotNegative = 0.3  # K_uav, of the potentials (law "paper")
    obstacle_gain: NotNegative = 0.5  # K_obs, of the potentials (law "paper")
    drone_influence_radius: Size = 0.5  # m, rho_uav: distance below which a drone repels
    obstacle_influence_radius: Size = 0.5  # m, rho_obs, from the obstacle's surface
    drone_safety_distance: Size = 0.4  # m, r_safe_uav: minimum between centres
    obstacle_safety_distance: Size = 0.3  # m, r_safe_obs: minimum from the obstacle's surface
    margin: Margin = 0.03  # m, added to both by the safety filter, for noise and model errors
    barrier_rate: Positive = 5.0  # 1/s, alpha: rate at which the safety filter lets a gap close
    sidestep_reach: Size = 0.2  # m, gap below which a drone sidesteps

    @property
    def safe(self) -> Separation:
        """The required distances."""
        return Separation(self.drone_safety_distance, self.obstacle_safety_distance)

    @property
    def kept(self) -> Separation:
        """The distances that the safety filter keeps: the margin is added."""
        return Separation(self.drone_safety_distance + self.margin, self.obstacle_safety_distance + self.margin)


class Fence(Model):
    """The room that no drone may leave: a box, and optionally a polygon in it."""

    min: Point | None = None  # m, the lowest corner of the box; else [-10, -10, -0.5], or the polygon's
    max: Point | None = None  # m, the highest corner of the box; else [10, 10, 3], or the polygon's
    polygon: tuple[Corner, ...] = ()  # m, corners [x, y] in order, convex or not
    floor: Finite | None = None  # m, in place of min's height
    ceiling: Finite | None = None  # m, in place of max's height
    margin: Size = 0.5  # m, distance outside at which a drone lands

    @property
    def low(self) -> Point:
        """The lowest corner of the box."""
        x, y, z = self.min or self._round(min, -0.5) or (-10.0, -10.0, -0.5)
        return (x, y, z if self.floor is None else self.floor)

    @property
    def high(self) -> Point:
        """The highest corner of the box."""
        x, y, z = self.max or self._round(max, 3.0) or (10.0, 10.0, 3.0)
        return (x, y, z if self.ceiling is None else self.ceiling)

    def _round(self, bound: Callable[[Iterable[float]], float], height: float) -> Point | None:
        """Return a corner of the smallest box round the polygon, None if there is none."""
        if not self.polygon:
            return None
        return (bound(x for x, _ in self.polygon), bound(y for _, y in self.polygon), height)

    def room(self) -> Room:
        """Return the room."""
        return Room(self.low, self.high, self.polygon)


class Staleness(Model):
    """Ages of inputs, in seconds, at which the agent or the driver reacts."""

    pose_zero: Age = 0.1  # s, age of the own pose at which a drone stops
    pose_land: Age = 1.0  # s, age of the own pose at which it lands
    estimate_drop: Age = 0.3  # s, age at which a neighbour's estimate is ignored
    estimates_hold: Age = 1.0  # s, time without any neighbour's estimate: hold
    estimates_land: Age = 5.0  # s, time without any neighbour's estimate: land
    leader_silent: Age = 1.0  # s, without the leader's status (tracked leader: pose), after which it counts as down
    leader_land: Age = 5.0  # s, after the leader is down, its followers land
    steering_stop: Age = 0.3  # s, age of the steering command at which a teleoperated leader stops
    nearby_slow: Age = 0.1  # s, age of the nearby bodies at which a drone slows to limits.blind_speed
    nearby_hold: Age = 0.5  # s, age of the nearby bodies at which it holds
    command_zero: Age = 0.2  # s, age of the command at which the driver stops the drone
    command_land: Age = 1.0  # s, age of the command at which the driver lands the drone
    telemetry_warn: Age = 1.0  # s, age of the drone's telemetry at which its status reports it
    telemetry_land: Age = 3.0  # s, age of the drone's telemetry at which it lands


class Limits(Model):
    """Speeds, heights, battery, fence and the staleness ladder."""

    speed: Positive = 3.0  # m/s, of every drone
    acceleration: Positive = 10.0  # m/s^2, of commands (safety filter)
    floor: Finite = 0.15  # m, lowest height except for landing (safety filter)
    blind_speed: Positive = 0.5  # m/s, while the nearby bodies are stale
    takeoff_height: Positive = 1.0  # m, above the start, of take-off
    vertical_speed: Positive = 0.7  # m/s, of take-off and landing
    start_tolerance: Size = 0.2  # m, of a drone's position before its first flight
    disagreement: Size = 0.3  # m, between the estimates of a follower's neighbours (all laws but "paper")
    body_drift: Positive = 1.5  # m/s, of a tracked body apart from its commands: the strongest wind; above it lands
    clock_offset_bound: Delay = 0.05  # s, largest uncertainty of a process's clock offset
    battery_takeoff: Probability = 0.2  # share of the battery below which no drone takes off
    battery_land: Probability = 0.1  # share of the battery below which a drone lands
    fence: Fence = Fence()  # the room that no drone may leave
    staleness: Staleness = Staleness()  # maximum ages of inputs


BOUNDED = ("formation_tail", "observation_tail", "fence", "control_rate")  # checks that are named as their bounds


class Checks(Model):
    """What judges a flight, besides the safety distances and the limits (docs/checks.md).

    A check is switched off by its name: `NAME = false`, also in place of a bound.
    """

    formation_tail: Size = 0.1  # m, formation error in the last 30 % of each formation phase
    observation_tail: Size = 0.1  # m, observation error in the same part
    settle_within: Positive = 20.0  # s, from the formation's time 0
    off_place: Age = 5.0  # s, longest time off its place for a follower, after all have settled
    fence: Margin = 0.1  # m, largest distance of a flying drone outside limits.fence
    landing_radius: Size = 0.5  # m, horizontal distance between begin and end of a landing
    control_rate: Probability = 0.95  # share of its steps that the slowest agent must make in the formation phases
    recording_gap: Age = 0.5  # s, longest gap in a recorded topic
    separation: bool = True  # whether this check judges, as those below
    obstacle_clearance: bool = True  # likewise
    speed: bool = True  # likewise
    emergency_stop: bool = True  # likewise
    laws_that_failed: bool = True  # likewise
    contradictions: bool = True  # likewise
    formation_settled: bool = True  # likewise: whether the followers ever reach their places
    formation_kept: bool = True  # likewise: whether they stay there
    places: bool = True  # likewise
    on_the_ground_in_formation: bool = True  # likewise
    lost_drones: bool = True  # likewise
    conformance: bool = True  # likewise
    landed: bool = True  # likewise
    recording: bool = True  # likewise
    lost_messages: bool = True  # likewise
    unbound: Annotated[tuple[str, ...], Field(repr=False)] = ()  # checks whose bound is false

    @model_validator(mode="before")
    @classmethod
    def _unbound(cls, table: object) -> object:
        """Note the bounds that are false in place of a number."""
        if not isinstance(table, dict):
            return table
        false = [key for key, value in table.items() if value is False and key in BOUNDED]
        unbound = (*table.get("unbound", ()), *false)
        return {key: value for key, value in table.items() if key not in false} | {"unbound": unbound}

    @property
    def off(self) -> frozenset[str]:
        """The names of the checks that do not judge."""
        named = (key for key, value in self if value is False)
        return frozenset(key.replace("_", " ") for key in (*named, *self.unbound))


class GraphTable(Model):
    """Who receives from whom: `[from, to]` or `[from, to, weight]`; 0 is the leader."""

    edges: tuple[Edge, ...]  # who receives from whom


class Obstacle(Model):
    """An upright cylinder, endless unless it has a height; radius 0 is the paper's point."""

    center: Point  # m, of the cylinder's foot
    radius: NotNegative = 0.0  # m, 0 is the paper's point
    height: Positive | None = None  # m, above the ground; default: endless


class TrackedObstacle(Model):
    """An obstacle that moves: an upright cylinder round a body of the tracker, endless unless it has a height."""

    body: str  # its name at the tracker
    radius: Size  # m, round the body
    height: Positive | None = None  # m, above the ground; default: endless


class Network(Model):
    """The links; processes listen at ports from `base_port` on, and for the operator at ports below it."""

    mode: Literal["peers", "router"] = "peers"  # processes dial each other, or all dial one router
    security: Literal["mtls", "none"] = "mtls"  # "none" is for measurements on one machine
    link: Literal["tls", "quic"] = "tls"  # "quic" carries state as datagrams, for radio links that lose packets
    base_port: Annotated[int, Field(ge=1024, le=64000)] = 7450  # the first of the ports


class Sim(Model):
    """The network and the clocks of `flockwire sim`; a real flight has its own."""

    delay: Delay = 0.0003  # s, from sending to arrival
    jitter: Delay = 0.0  # s, largest addition to the delay; a link keeps its order
    loss: Probability = 0.0  # share of lost messages; events (orders, stops) are repeated instead
    reordering: Probability = 0.0  # share of messages that arrive after later ones
    clock_offset: Delay = 0.0  # s, largest offset of a process's clock, either sign
    clock_drift: NotNegative = 0.0  # s per s, largest drift, either sign


class Host(Model):
    """One machine: its address, and its processes besides agents (by identity)."""

    address: str = "127.0.0.1"  # the machine's IP address
    processes: tuple[str, ...] = ()  # its processes besides agents, by identity
