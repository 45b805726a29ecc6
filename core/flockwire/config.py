"""The swarm file: TOML in, frozen and documented models out.

One file describes the whole swarm and every process reads it once. Lengths are metres, times seconds, angles
radians, the world frame is ENU with Z up. Unknown keys are refused; whatever can have a default has one.
"""

from __future__ import annotations

import json
import re
import tomllib
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Annotated, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from flockwire.control import formation as shapes
from flockwire.control.graph import LEADER, Graph
from flockwire.control.key_frames import parse_key_frames
from flockwire.control.trajectory import Circling, Constant, Trajectory, Waypoints

FLOWN = "flown"  # the context in which to read the swarm of a flight that is over: its law need not be here
Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Probability = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Point = tuple[Finite, Finite, Finite]


def _edge(ends: object) -> tuple[int, int, float]:
    match ends:
        case [int(source), int(target)]:
            return source, target, 1.0
        case [int(source), int(target), int(weight) | float(weight)] if 0.0 < weight < inf:
            return source, target, float(weight)
    raise ValueError("must be [from, to] or [from, to, weight]: two ids of drones, and a weight above 0")


Edge = Annotated[tuple[int, int, float], BeforeValidator(_edge)]


class SwarmFileError(ValueError):
    """A swarm file that cannot be flown; each line of the text names one key, its value and the rule."""


class Model(BaseModel):
    """Frozen, typed strictly, and closed against unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Control(Model):
    """The control law, the gains of the formation tracking protocol (9), and the safety filter round it."""

    rate_hz: Annotated[int, Field(ge=10, le=500)] = 100
    law: str = "extended"  # "extended", "paper" or your own, "package.module:ClassName"
    formation_gain: Positive = 3.0  # K, 1/s
    compensation_gain: NotNegative = 0.2  # phi, m/s (law "paper")
    compensation_smoothing: Positive = 0.01  # epsilon, m (law "paper")
    safety_filter: bool | None = None  # default: round every law but "paper"

    @property
    def filtered(self) -> bool:
        """Whether the safety filter is round the law."""
        return self.law != "paper" if self.safety_filter is None else self.safety_filter


class Observer(Model):
    """The fixed-time observer (8)."""

    step: Literal["implicit", "explicit"] = "implicit"  # (law "paper"; "extended" is implicit)
    gain: Positive = 3.0  # mu, m/s
    exponent: Annotated[float, Field(gt=1, allow_inf_nan=False)] = 1.5  # p
    velocity_time_constant: Positive = 0.15  # s, of the filter behind the published velocity estimate (law "paper")
    leader_time_constant: Positive | None = None  # s, of the tracker of the leader's velocity; default: by the depth


class CircleFormation(Model):
    """Followers evenly spread on a circle round the leader."""

    kind: Literal["circle"]
    radius: Positive = 2.0
    rate: Finite = 0.0  # rad/s about Z

    def build(self, count: int) -> shapes.Formation:
        """Return the formation of `count` followers."""
        return shapes.Circle(count, self.radius, self.rate)


class LineFormation(Model):
    """Followers on a line through the leader, alternately before and behind it."""

    kind: Literal["line"]
    spacing: Positive = 1.0
    heading: Finite = 0.0
    rate: Finite = 0.0

    def build(self, count: int) -> shapes.Formation:
        """Return the formation of `count` followers."""
        return shapes.Line(count, self.spacing, self.heading, self.rate)


class GridFormation(Model):
    """Followers on a rectangular grid with the leader in one of its cells."""

    kind: Literal["grid"]
    spacing: Positive = 1.0
    columns: Annotated[int, Field(ge=1)] = 3
    rate: Finite = 0.0

    def build(self, count: int) -> shapes.Formation:
        """Return the formation of `count` followers."""
        return shapes.Grid(count, self.spacing, self.columns, self.rate)


class PolygonFormation(Model):
    """Followers evenly spread along the perimeter of a regular polygon round the leader."""

    kind: Literal["polygon"]
    sides: Annotated[int, Field(ge=3)] = 4
    radius: Positive = 2.0
    rate: Finite = 0.0

    def build(self, count: int) -> shapes.Formation:
        """Return the formation of `count` followers."""
        return shapes.Polygon(count, self.sides, self.radius, self.rate)


class KeyFramesFormation(Model):
    """Offsets from a CSV file `t,drone,x,y,z`, joined by a smooth curve; `frames` holds its text once it is read."""

    kind: Literal["key_frames"]
    file: str
    frames: str = ""

    def build(self, count: int) -> shapes.Formation:
        """Return the formation; the file must have a curve for each of the `count` followers."""
        formation = parse_key_frames(self.frames)
        if formation.count != count:
            raise ValueError(f"{self.file} has offsets for {formation.count} drones, the swarm has {count} followers")
        return formation


Formation = Annotated[
    CircleFormation | LineFormation | GridFormation | PolygonFormation | KeyFramesFormation,
    Field(discriminator="kind"),
]


class Avoidance(Model):
    """The repulsive potentials of (9), what is sensed, and the distances that must be kept."""

    sensing: Literal["nearby", "neighbours"] = "nearby"
    sensing_radius: Positive = 1.5
    drone_gain: NotNegative = 0.3  # K_uav
    obstacle_gain: NotNegative = 0.5  # K_obs
    drone_influence_radius: Positive = 0.5  # rho_uav
    obstacle_influence_radius: Positive = 0.5  # rho_obs
    drone_safety_distance: Positive = 0.4  # r_safe_uav
    obstacle_safety_distance: Positive = 0.3  # r_safe_obs, from the obstacle's surface
    margin: NotNegative = 0.03  # added to both by the safety filter, for noise and what the model does not know
    barrier_rate: Positive = 5.0  # alpha, 1/s: how fast the safety filter lets a gap close
    sidestep_reach: Positive = 0.6  # m of gap within which a body is in the way


class Fence(Model):
    """The box that no drone may leave."""

    min: Point = (-10.0, -10.0, -0.5)
    max: Point = (10.0, 10.0, 3.0)
    margin: Positive = 0.5  # this far outside, a drone lands


class Staleness(Model):
    """How old each input may get before the agent or the driver reacts, in seconds."""

    pose_zero: Positive = 0.1
    pose_land: Positive = 1.0
    estimate_drop: Positive = 0.3
    estimates_hold: Positive = 1.0
    estimates_land: Positive = 5.0
    nearby_slow: Positive = 0.1
    nearby_hold: Positive = 0.5
    command_zero: Positive = 0.2
    command_land: Positive = 1.0
    telemetry_warn: Positive = 1.0
    telemetry_land: Positive = 3.0


class Limits(Model):
    """Speeds, heights, battery, fence and the staleness ladder."""

    speed: Positive = 3.0
    acceleration: Positive = 10.0  # m/s^2, of commands (safety filter)
    floor: Finite = 0.15  # no drone goes lower, except to land (safety filter)
    blind_speed: Positive = 0.5  # while the nearby bodies are stale
    takeoff_height: Positive = 1.0
    vertical_speed: Positive = 0.7  # of take-off and landing
    battery_takeoff: Probability = 0.2
    battery_land: Probability = 0.1
    fence: Fence = Fence()
    staleness: Staleness = Staleness()


class ConstantVelocity(Model):
    """The leader flies straight on."""

    kind: Literal["constant"]
    velocity: Point = (0.1, 0.1, 0.0)

    def build(self) -> Trajectory:
        """Return the trajectory."""
        return Constant(self.velocity)


class CirclingTrajectory(Model):
    """The leader flies a circle that touches its start."""

    kind: Literal["circle"]
    radius: Positive = 1.0
    rate: Finite = 0.1

    def build(self) -> Trajectory:
        """Return the trajectory."""
        return Circling(self.radius, self.rate)


class WaypointsTrajectory(Model):
    """The leader flies from point to point, relative to its start, and stays at the last one (or flies round)."""

    kind: Literal["waypoints"]
    points: Annotated[tuple[Point, ...], Field(min_length=1)]
    speed: Positive = 0.2
    loop: bool = False

    def build(self) -> Trajectory:
        """Return the trajectory."""
        return Waypoints(self.points, self.speed, self.loop)


class Leader(Model):
    """Who leads: drone 0 on a scripted trajectory, or a virtual point on the same."""

    kind: Literal["trajectory", "virtual"] = "trajectory"
    trajectory: Annotated[ConstantVelocity | CirclingTrajectory | WaypointsTrajectory, Field(discriminator="kind")] = (
        ConstantVelocity(kind="constant")
    )
    input_bound: Positive = 0.1  # |u_0| per axis, m/s: unknown to the followers, used in Lemma 3
    tracking_gain: Positive = 2.0  # 1/s, of the leader's own position loop
    start: Point = (0.0, 0.0, 1.0)  # of a virtual leader


class GraphTable(Model):
    """Who hears whom: `[from, to]` or `[from, to, weight]`, 0 being the leader."""

    edges: tuple[Edge, ...]


class Drone(Model):
    """One drone: 0 is the leader, the others follow."""

    id: Annotated[int, Field(ge=0, le=999)]
    airframe: str = "kinematics"
    start: Point
    host: str | None = None  # the machine its agent runs on; default: the first of [hosts]
    address: str | None = None  # where its agent listens, "IP:PORT"; default: its host's address and a port of its own


class Airframe(Model):
    """How a simulated airframe answers a velocity command: first-order lag behind a dead time."""

    gain: Positive = 1.0
    lag: NotNegative = 0.0
    dead_time: NotNegative = 0.0
    endurance: Positive = 900.0  # s of flight on a full battery


class Obstacle(Model):
    """An upright cylinder, endless unless it has a height; radius 0 is the paper's point."""

    center: Point
    radius: NotNegative = 0.0
    height: Positive | None = None


class Gateway(Model):
    """Where poses come from: simulated cameras that see the simulated airframes."""

    source: Literal["simulated"] = "simulated"
    rate_hz: Annotated[int, Field(ge=10, le=500)] = 100
    noise: NotNegative = 0.0  # m, standard deviation per axis
    latency: NotNegative = 0.0  # s from exposure to sending
    dropout: Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)] = 0.0  # share of lost samples
    seed: Annotated[int, Field(ge=0)] = 0


class Network(Model):
    """Who links to whom and how; every process that listens has a port of its own, `base_port` and upwards."""

    mode: Literal["peers", "router"] = "peers"  # each dials whom it must hear; or all dial one router
    security: Literal["mtls", "none"] = "mtls"  # "none" is for measurements on one machine
    base_port: Annotated[int, Field(ge=1024, le=64000)] = 7450


class Sim(Model):
    """The network and the clocks of `flockwire sim`; a real flight has its own."""

    delay: NotNegative = 0.0003  # s from sending to arrival
    jitter: NotNegative = 0.0  # s, at most, on top of the delay; a link keeps its order all the same
    loss: Probability = 0.0  # share of the messages that never arrive; events (orders, stops) are sent again instead
    reordering: Probability = 0.0  # share of the messages that are overtaken by those behind them
    clock_offset: NotNegative = 0.0  # s, at most, either way, between a process's clock and the true time
    clock_drift: NotNegative = 0.0  # s per s, at most, either way


class Host(Model):
    """One machine: its address, and the processes beside its agents that it runs (by identity)."""

    address: str = "127.0.0.1"
    processes: tuple[str, ...] = ()


class Swarm(Model):
    """A whole swarm, checked: whoever holds one may fly it."""

    name: str
    frame: str = "world"
    control: Control = Control()
    observer: Observer = Observer()
    formation: Formation
    formations: dict[str, Formation] = {}
    avoidance: Avoidance = Avoidance()
    limits: Limits = Limits()
    leader: Leader = Leader()
    graph: GraphTable
    drones: tuple[Drone, ...]
    airframes: dict[str, Airframe] = {"kinematics": Airframe()}
    obstacles: tuple[Obstacle, ...] = ()
    gateway: Gateway = Gateway()
    network: Network = Network()
    sim: Sim = Sim()
    hosts: dict[str, Host] = {"local": Host()}

    @field_validator("name", "frame")
    @classmethod
    def _one_word(cls, value: str) -> str:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,63}", value):
            raise ValueError("must be a letter followed by letters, digits and _ (it becomes part of ROS 2 topics)")
        return value

    @model_validator(mode="after")
    def _flyable(self, info: ValidationInfo) -> Swarm:
        from flockwire import rules  # noqa: PLC0415  (the rules are written against this class)

        problems = list(rules.problems(self, to_fly=info.context != FLOWN))
        if problems:
            raise ValueError("\n".join(problems))
        return self

    @cached_property
    def followers(self) -> tuple[int, ...]:
        """Ids of the followers, ascending; a follower's place in this tuple is its index in the formation."""
        return tuple(sorted(drone.id for drone in self.drones if drone.id != LEADER))

    @cached_property
    def flying(self) -> tuple[int, ...]:
        """Ids of all drones that have an airframe, ascending: the followers and, unless it is virtual, the leader."""
        return tuple(sorted(drone.id for drone in self.drones))

    @cached_property
    def topology(self) -> Graph:
        """The communication graph."""
        return Graph(self.followers, self.graph.edges)

    def drone(self, number: int) -> Drone:
        """Return drone `number`; KeyError when the swarm has none."""
        for drone in self.drones:
            if drone.id == number:
                return drone
        raise KeyError(number)

    def airframe(self, number: int) -> Airframe:
        """Return the airframe parameters of drone `number`."""
        return self.airframes[self.drone(number).airframe]

    def build_formation(self, name: str = "") -> shapes.Formation:
        """Return the formation called `name`, the swarm's first one when empty; KeyError when there is none."""
        return (self.formations[name] if name else self.formation).build(len(self.followers))


def load_swarm(path: Path) -> Swarm:
    """Read and check a swarm file.

    Raises SwarmFileError with one line for each problem: file, key, value, rule.
    """
    return parse_swarm(load_table(path), str(path))


def load_table(path: Path) -> dict[str, object]:
    """Read a swarm file, with the key frames it names, as it is; raises SwarmFileError where that cannot be done."""
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not UTF-8 text"
        raise SwarmFileError(f"{path}: cannot read the swarm file: {reason}") from error
    except tomllib.TOMLDecodeError as error:
        raise SwarmFileError(f"{path}: not TOML: {error}") from error
    for name, formation in [("formation", table.get("formation")), *_tables(table, "formations")]:
        if isinstance(formation, dict) and formation.get("kind") == "key_frames" and "file" in formation:
            formation["frames"] = _read_key_frames(path, name, str(formation["file"]))
    return table


def parse_swarm(table: dict[str, object], origin: str) -> Swarm:
    """Check the swarm file's content `table`, which came from `origin`; raises SwarmFileError."""
    try:
        return Swarm.model_validate_json(json.dumps(table, default=str))
    except ValidationError as error:
        raise SwarmFileError("\n".join(f"{origin}: {line}" for line in error_lines(error))) from None


def error_lines(error: ValidationError) -> list[str]:
    """Turn what pydantic found into lines of key, value and rule."""
    return [line for detail in error.errors() for line in _lines(dict(detail))]


def _tables(table: dict[str, object], key: str) -> list[tuple[str, object]]:
    inner = table.get(key)
    return [(f"{key}.{name}", value) for name, value in inner.items()] if isinstance(inner, dict) else []


def _read_key_frames(swarm_file: Path, key: str, name: str) -> str:
    try:
        return (swarm_file.parent / name).read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise SwarmFileError(f"{swarm_file}: {key}.file = {name!r}: cannot read it: {error}") from error


def _is_kind(path: tuple[object, ...]) -> bool:
    """Return whether pydantic puts a table's kind behind `path`, which is no key of the file."""
    return path in (("formation",), ("leader", "trajectory")) or (len(path) == 2 and path[0] == "formations")


def _lines(detail: dict[str, object]) -> list[str]:
    """Turn one of pydantic's errors into lines of key, value and rule."""
    location = detail["loc"]
    assert isinstance(location, tuple)  # noqa: S101  (pydantic says so)
    message = str(detail["msg"]).removeprefix("Value error, ")
    if not location:
        return message.split("\n")
    key = ".".join(str(part) for place, part in enumerate(location) if not _is_kind(location[:place]))
    if detail["type"] == "missing":
        return [f"{key}: missing; this key has no default"]
    if detail["type"] == "extra_forbidden":
        return [f"{key} = {detail['input']!r}: unknown key"]
    return [f"{key} = {detail['input']!r}: {message[0].lower()}{message[1:]}"]
