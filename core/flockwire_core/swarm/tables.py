"""The tables of a swarm file as frozen models; each field has its unit and its rule. model.py puts them together."""

from __future__ import annotations

import ipaddress
import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    JsonValue,
    WithJsonSchema,
    model_validator,
)
from pydantic.config import JsonDict
from pydantic.json_schema import SkipJsonSchema

from flockwire_core.control.fence import Room
from flockwire_core.domain.body import Separation


def key(default: Any, meaning: str, unit: str = "", **bounds: Any) -> Any:  # noqa: ANN401  (as pydantic's Field)
    """Return the field of a key: its default (... for none), what it is, its unit, and bounds as of pydantic's Field.

    Refusals, pages and editors use all four.
    """
    described: JsonDict = {"unit": unit, "meaning": meaning}
    return Field(default, description=f"{unit}, {meaning}" if unit else meaning, json_schema_extra=described, **bounds)


@dataclass(frozen=True, slots=True)
class Form:
    """Metadata of a type: a value must be `text`, which `has` tests."""

    text: str
    has: Callable[[Any], object]

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:  # noqa: ANN401  (pydantic's)
        return AfterValidator(self._tested).__get_pydantic_core_schema__(source, handler)

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:  # noqa: ANN401  (pydantic's)
        return {**handler(core), "takes": self.text}

    def _tested(self, value: object) -> object:
        if not self.has(value):
            raise ValueError(f"must be {self.text}")
        return value


def _is_ip(text: str, versions: tuple[int, ...] = (4, 6), kinds: tuple[bool, ...] = (False, True)) -> bool:
    """Return whether a text is an address of one of the `versions`; `kinds`: False for one host, True for a group."""
    try:
        address = ipaddress.ip_address(text)
    except ValueError:
        return False
    return address.version in versions and address.is_multicast in kinds


def _is_endpoint(text: str) -> bool:
    found = re.fullmatch(r"(?:\[(?P<v6>[^]]+)\]|(?P<v4>[^:]+)):(?P<port>[0-9]{4,5})", text)
    return (
        found is not None and _is_ip(found["v6"] or found["v4"]) and LOWEST_PORT <= int(found["port"]) <= HIGHEST_PORT
    )


Item = TypeVar("Item")
LOWEST_PORT, HIGHEST_PORT = 1024, 65535

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Age = Annotated[float, Field(gt=0, le=60, allow_inf_nan=False)]  # s; the bounds refuse milliseconds and millimetres
Delay = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]  # s
Lag = Annotated[float, Field(ge=0, le=10, allow_inf_nan=False)]  # s
Margin = Annotated[float, Field(ge=0, le=10, allow_inf_nan=False)]  # m
Size = Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)]  # m
Share = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]
Probability = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Items = Annotated[tuple[Item, ...], Field(strict=False)]  # TOML has lists
Point = Annotated[tuple[Finite, Finite, Finite], Field(strict=False)]
Corner = Annotated[tuple[Finite, Finite], Field(strict=False)]
Port = Annotated[int, Field(ge=LOWEST_PORT, le=HIGHEST_PORT)]
Word = Annotated[
    str,
    Form(
        "a letter followed by letters (A to Z, a to z), digits and _, at most 64 (it becomes part of ROS 2 topics)",
        re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}").fullmatch,
    ),
]
HostName = Annotated[
    str,
    Form(
        "a host name: letters, digits and hyphens, at most 63",
        re.compile(r"[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?").fullmatch,
    ),
]
Ip = Annotated[str, Form("an IP address", _is_ip)]
Ip4 = Annotated[str, Form("an IPv4 address", partial(_is_ip, versions=(4,)))]
HostIp4 = Annotated[str, Form("an IPv4 address of one host", partial(_is_ip, versions=(4,), kinds=(False,)))]
GroupIp4 = Annotated[
    str, Form("a multicast address, 224.0.0.0 to 239.255.255.255", partial(_is_ip, versions=(4,), kinds=(True,)))
]
Endpoint = Annotated[str, Form(f"IP:PORT, PORT from {LOWEST_PORT} to {HIGHEST_PORT} (IPv6: [IP]:PORT)", _is_endpoint)]


def _edge(ends: object) -> tuple[int, int, float]:
    match ends:
        case [int(source), int(target)]:
            return source, target, 1.0
        case [int(source), int(target), int(weight) | float(weight)] if 0.0 < abs(weight) < inf:
            return source, target, float(weight)
    raise ValueError("must be [from, to] or [from, to, weight]: two ids of drones, and a weight that is not 0")


Edge = Annotated[
    tuple[int, int, float],
    BeforeValidator(_edge),
    WithJsonSchema(
        {
            "type": "array",
            "items": {"type": "number"},
            "minItems": 2,
            "maxItems": 3,
            "takes": "[from, to] or [from, to, weight]",
        }
    ),
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


Senses = Items[Literal["bearing", "distance", "position", "velocity"]]


class Declared(Model):
    """The information of a law in another process (docs/law_elsewhere.md), which a law of Python declares itself."""

    neighbours: Senses = key((), "sensed of each drone with an edge to this one")
    around: Senses = key((), "sensed of whoever is within `radius`")
    radius: float = key(0.0, "0: only bodies, within avoidance.sensing_radius", "m", ge=0, le=1000)
    named: bool = key(False, "whether those around have their numbers")
    own: Items[Literal["position", "velocity"]] = key((), "known of the own drone")
    output: Literal["velocity", "acceleration"] = key("velocity", "what a command is")
    message: int = key(0, "numbers in a message to the out-neighbours, 0: none", ge=0, le=1024)
    pace: Literal["step", "event", "round"] = key("step", '"event": silence of messages is normal; "round": all count')
    silence: Age = key(0.3, "after which a neighbour counts as lost", "s")
    leaders: tuple[int, int] = key((0, 1), "the least and the most", strict=False)
    directed: bool = key(True, "false: the graph must be symmetric")
    signed: bool = key(False, "whether weights may be negative")
    planar: bool = key(False, "true: the pilot holds the height")


class Control(Model):
    """The control law, the gains of the formation tracking protocol (9), and the safety filter round it."""

    rate_hz: int = key(100, "of control steps", "Hz", ge=10, le=500)
    law: str = key(
        "extended",
        '"extended", "paper", a file of laws/, or your own: "file.py:ClassName", "package.module:ClassName", '
        '"socket:PATH" or "tcp:PORT" of a program',
    )
    parameters: dict[str, JsonValue] = key({}, "those of your own law")
    information: Declared = key(Declared(), "of a law in another process")
    formation_gain: Positive = key(3.0, "K: gain towards the follower's place", "1/s")
    compensation_gain: NotNegative = key(0.2, 'phi: compensates the leader\'s unknown motion (law "paper")', "m/s")
    compensation_smoothing: Size = key(0.01, 'epsilon: width of the soft sign behind it (law "paper")', "m")
    disturbance: NotNegative = key(
        0.0, "most that pilots estimate and compensate: wind, a wrong gain (safety filter)", "m/s"
    )
    safety_filter: bool | None = key(None, 'whether it is used; default: with every law but "paper"')

    @property
    def elsewhere(self) -> bool:
        """Whether the law is in another process, which serves a socket."""
        return self.law.startswith(("socket:", "tcp:"))

    @property
    def own_law(self) -> bool:
        """Whether the law is neither the paper's nor the extended one."""
        return self.law not in ("paper", "extended")

    @property
    def filtered(self) -> bool:
        """Whether the law has the safety filter."""
        return self.law != "paper" if self.safety_filter is None else self.safety_filter

    @property
    def compensated(self) -> float:
        """The largest disturbance, m/s, that pilots compensate: beside the safety filter alone."""
        return self.disturbance if self.filtered else 0.0


class Observer(Model):
    """The fixed-time observer (8)."""

    step: Literal["implicit", "explicit"] = key("implicit", 'of the integration (law "paper"; "extended" is implicit)')
    gain: Positive = key(3.0, "mu", "m/s")
    exponent: float = key(1.5, "p", gt=1, allow_inf_nan=False)
    velocity_time_constant: Age = key(0.15, 'of the filter behind the published velocity estimate (law "paper")', "s")
    leader_time_constant: Age | None = key(None, "of the tracker of the leader's velocity; default: by the depth", "s")


class Avoidance(Model):
    """The repulsive potentials of (9), the sensing, and the required distances."""

    sensing: Literal["nearby", "neighbours"] = key("nearby", "all nearby bodies, or only the neighbours' poses")
    sensing_radius: Positive = key(1.5, "within which bodies are sensed", "m")
    drone_gain: NotNegative = key(0.3, 'K_uav, of the potentials (law "paper")')
    obstacle_gain: NotNegative = key(0.5, 'K_obs, of the potentials (law "paper")')
    drone_influence_radius: Size = key(0.5, "rho_uav: distance below which a drone repels", "m")
    obstacle_influence_radius: Size = key(0.5, "rho_obs, from the obstacle's surface", "m")
    drone_safety_distance: Size = key(0.4, "r_safe_uav: minimum between centres, in height too (docs/safety.md)", "m")
    obstacle_safety_distance: Size = key(0.3, "r_safe_obs: minimum from the obstacle's surface", "m")
    margin: Margin = key(0.03, "added to both by the safety filter, for noise and model errors", "m")
    barrier_rate: Positive = key(5.0, "alpha: rate at which the safety filter lets a gap close", "1/s")

    @property
    def safe(self) -> Separation:
        """The required distances."""
        return Separation(self.drone_safety_distance, self.obstacle_safety_distance)

    @property
    def kept(self) -> Separation:
        """The distances that the safety filter keeps: the margin is added."""
        return Separation(self.drone_safety_distance + self.margin, self.obstacle_safety_distance + self.margin)


class Sensing(Model):
    """The relative sensors of laws, for which the gateway stands; each drone's draws are its own."""

    noise: Margin = key(0.0, "of the places that laws see of others, per axis: standard deviation", "m")
    velocity_noise: NotNegative = key(0.0, "likewise, of velocities", "m/s")


class Fence(Model):
    """The room that no drone may leave: a box, and optionally a polygon in it."""

    min: Point | None = key(None, "the lowest corner of the box; else [-10, -10, -0.5], or the polygon's", "m")
    max: Point | None = key(None, "the highest corner of the box; else [10, 10, 3], or the polygon's", "m")
    polygon: Items[Corner] = key((), "corners [x, y] in order, convex or not", "m")
    floor: Finite | None = key(None, "in place of min's height", "m")
    ceiling: Finite | None = key(None, "in place of max's height", "m")
    margin: Size = key(0.5, "distance outside at which a drone lands", "m")

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

    pose_zero: Age = key(0.1, "age of the own pose at which a drone stops", "s")
    pose_land: Age = key(1.0, "age of the own pose at which it lands", "s")
    estimate_drop: Age = key(0.3, "age at which a neighbour's estimate is ignored", "s")
    estimates_hold: Age = key(1.0, "time without any neighbour's estimate: hold", "s")
    estimates_land: Age = key(5.0, "time without any neighbour's estimate: land", "s")
    leader_silent: Age = key(
        1.0, "without the leader's status (tracked leader: pose), after which it counts as down", "s"
    )
    leader_land: Age = key(5.0, "after the leader is down, its followers land", "s")
    steering_stop: Age = key(0.3, "age of the steering command at which a teleoperated leader stops", "s")
    nearby_slow: Age = key(0.1, "age of the nearby bodies at which a drone slows to limits.blind_speed", "s")
    nearby_hold: Age = key(0.5, "age of the nearby bodies at which it holds", "s")
    command_zero: Age = key(0.2, "age of the command at which the driver stops the drone", "s")
    command_land: Age = key(1.0, "age of the command at which the driver lands the drone", "s")
    telemetry_warn: Age = key(1.0, "age of the drone's telemetry at which its status reports it", "s")
    telemetry_land: Age = key(3.0, "age of the drone's telemetry at which it lands", "s")


class Limits(Model):
    """Speeds, heights, battery, fence and the staleness ladder."""

    speed: Positive = key(3.0, "of every drone", "m/s")
    acceleration: Positive = key(10.0, "of commands (safety filter)", "m/s^2")
    floor: Finite = key(0.15, "lowest height except for landing (safety filter)", "m")
    blind_speed: Positive = key(0.5, "while the nearby bodies are stale", "m/s")
    takeoff_height: Positive = key(1.0, "above the start, of take-off", "m")
    vertical_speed: Positive = key(0.7, "of take-off and landing", "m/s")
    start_tolerance: Size = key(0.2, "of a drone's position before its first flight", "m")
    disagreement: Size = key(0.3, 'between the estimates of a follower\'s neighbours (all laws but "paper")', "m")
    body_drift: Positive = key(
        1.5, "of a tracked body apart from its commands: the strongest wind; above it lands", "m/s"
    )
    clock_offset_bound: Delay = key(0.05, "largest uncertainty of a process's clock offset", "s")
    battery_takeoff: Probability = key(0.2, "share of the battery below which no drone takes off")
    battery_land: Probability = key(0.1, "share of the battery below which a drone lands")
    fence: Fence = key(Fence(), "the room that no drone may leave")
    staleness: Staleness = key(Staleness(), "maximum ages of inputs")


BOUNDED = ("formation_tail", "observation_tail", "fence", "control_rate")  # checks that are named as their bounds


class Checks(Model):
    """What judges a flight, besides the safety distances and the limits (docs/checks.md).

    A check is switched off by its name: `NAME = false`, also in place of a bound.
    """

    formation_tail: Size = key(0.1, "formation error in the last 30 % of each formation phase", "m")
    observation_tail: Size = key(0.1, "observation error in the same part", "m")
    settle_within: Positive = key(20.0, "from the formation's time 0", "s")
    off_place: Age = key(5.0, "longest time off its place for a follower, after all have settled", "s")
    fence: Margin = key(0.1, "largest distance of a flying drone outside limits.fence", "m")
    landing_radius: Size = key(0.5, "horizontal distance between begin and end of a landing", "m")
    control_rate: Probability = key(0.95, "share of its steps that the slowest agent must make in the formation phases")
    recording_gap: Age = key(0.5, "longest gap in a recorded topic", "s")
    separation: bool = key(True, "whether this check judges, as those below")
    obstacle_clearance: bool = key(True, "likewise")
    speed: bool = key(True, "likewise")
    emergency_stop: bool = key(True, "likewise")
    laws_that_failed: bool = key(True, "likewise")
    contradictions: bool = key(True, "likewise")
    formation_settled: bool = key(True, "likewise: whether the followers ever reach their places")
    formation_kept: bool = key(True, "likewise: whether they stay there")
    places: bool = key(True, "likewise")
    on_the_ground_in_formation: bool = key(True, "likewise")
    lost_drones: bool = key(True, "likewise")
    conformance: bool = key(True, "likewise")
    landed: bool = key(True, "likewise")
    recording: bool = key(True, "likewise")
    lost_messages: bool = key(True, "likewise")
    unbound: SkipJsonSchema[Items[str]] = Field((), repr=False)  # checks whose bound is false

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
    """Who receives from whom: `[from, to]` or `[from, to, weight]`."""

    edges: Items[Edge] = key(..., "who receives from whom")


class Obstacle(Model):
    """An upright cylinder, endless unless it has a height; radius 0 is the paper's point."""

    center: Point = key(..., "of the cylinder's foot", "m")
    radius: NotNegative = key(0.0, "0 is the paper's point", "m")
    height: Positive | None = key(None, "above the ground; default: endless", "m")


class TrackedObstacle(Model):
    """An obstacle that moves: an upright cylinder round a body of the tracker, endless unless it has a height."""

    body: str = key(..., "its name at the tracker")
    radius: Size = key(..., "round the body", "m")
    height: Positive | None = key(None, "above the ground; default: endless", "m")


class Network(Model):
    """The links; processes listen at ports from `base_port` on, and for the operator at ports below it."""

    mode: Literal["peers", "router"] = key("peers", "processes dial each other, or all dial one router")
    security: Literal["mtls", "none"] = key("mtls", '"none" is for measurements on one machine')
    link: Literal["tls", "quic"] = key("tls", '"quic" carries state as datagrams, for radio links that lose packets')
    base_port: int = key(7450, "the first of the ports", ge=1024, le=64000)


class Sim(Model):
    """The network and the clocks of `flockwire sim`; a real flight has its own."""

    delay: Delay = key(0.0003, "from sending to arrival", "s")
    jitter: Delay = key(0.0, "largest addition to the delay; a link keeps its order", "s")
    loss: Probability = key(0.0, "share of lost messages; events (orders, stops) are repeated instead")
    reordering: Probability = key(0.0, "share of messages that arrive after later ones")
    clock_offset: Delay = key(0.0, "largest offset of a process's clock, either sign", "s")
    clock_drift: NotNegative = key(0.0, "largest drift, either sign", "s per s")


class Host(Model):
    """One machine: its address, and its processes besides agents (by identity)."""

    address: Ip = key("127.0.0.1", "the machine's IP address")
    processes: Items[str] = key((), "its processes besides agents, by identity")
