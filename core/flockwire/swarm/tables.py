"""The tables of a swarm file as frozen models; each field has its unit and its rule. model.py puts them together."""

from __future__ import annotations

from math import inf
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from flockwire.control.trajectory import Circling, Constant, Trajectory, Waypoints

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
    leader_silent: Positive = 1.0  # of its status, for those that subscribe to it: then it counts as down
    leader_land: Positive = 5.0  # after it is down, who flies its formation lands
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


class Checks(Model):
    """What a flight must keep to, beside the safety distances and the limits (docs/checks.md)."""

    formation_tail: Positive = 0.1  # m, formation error in the last 30 % of each formation phase
    observation_tail: Positive = 0.1  # m, observation error, likewise
    settle_within: Positive = 20.0  # s from the formation's time 0
    landing_radius: Positive = 0.5  # m between where a landing begins and where it ends, on the ground plan
    recording_gap: Positive = 0.5  # s of a topic that the recorder may miss


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

    mode: Literal["peers", "router"] = "peers"  # each dials those it exchanges keys with; or all dial one router
    security: Literal["mtls", "none"] = "mtls"  # "none" is for measurements on one machine
    base_port: Annotated[int, Field(ge=1024, le=64000)] = 7450


class Sim(Model):
    """The network and the clocks of `flockwire sim`; a real flight has its own."""

    delay: NotNegative = 0.0003  # s from sending to arrival
    jitter: NotNegative = 0.0  # s, at most, on top of the delay; a link keeps its order all the same
    loss: Probability = 0.0  # share of the messages that never arrive; events (orders, stops) are sent again instead
    reordering: Probability = 0.0  # share of the messages that are overtaken by those behind them
    clock_offset: NotNegative = 0.0  # s, at most, plus or minus, between a process's clock and the true time
    clock_drift: NotNegative = 0.0  # s per s, at most, plus or minus


class Host(Model):
    """One machine: its address, and the processes beside its agents that it runs (by identity)."""

    address: str = "127.0.0.1"
    processes: tuple[str, ...] = ()
