"""The staleness ladder: a pilot's reactions to old inputs."""

from __future__ import annotations

from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.record import Record
from flockwire_core.pilot.phases import NEVER
from flockwire_core.swarm.model import uav
from flockwire_core.swarm.tables import Limits, Staleness
from flockwire_core.wire.status import Reason

NO_REASON: Final = Reason("", "")


@mypyc_attr(acyclic=True)
class Inputs(Record):
    """Ages in s of a pilot's inputs (NEVER: none yet), and its airframe's reports."""

    __slots__ = ("pose", "silence", "nearby", "telemetry", "battery", "outside", "leader_down")

    def __init__(
        self,
        pose: float,
        silence: float,
        nearby: float,
        telemetry: float,
        battery: float,
        outside: float,
        leader_down: float = 0.0,
    ) -> None:
        self.pose: Final = pose
        self.silence: Final = silence  # of the newest leader estimate; 0 for the leader itself
        self.nearby: Final = nearby  # 0 without sensing
        self.telemetry: Final = telemetry
        self.battery: Final = battery  # share of full
        self.outside: Final = outside  # m outside the fence
        self.leader_down: Final = leader_down  # s since the leader of the ordered formation is down; 0 while it leads


class Bounds:
    """The limits that every step reads: the first rungs of the ladder, s and share of full, and speeds, m/s."""

    def __init__(self, limits: Limits, speed: float) -> None:
        stale = limits.staleness
        self.pose: Final[float] = stale.pose_zero
        self.silence: Final[float] = stale.estimates_hold
        self.nearby: Final[float] = stale.nearby_slow
        self.telemetry: Final[float] = stale.telemetry_warn
        self.battery: Final[float] = limits.battery_takeoff
        self.speed: Final[float] = speed
        self.blind_speed: Final[float] = min(speed, limits.blind_speed)  # while the nearby bodies are stale
        self.unknown: Final[float] = stale.telemetry_land  # age from which telemetry tells nothing


def all_well(inputs: Inputs, bounds: Bounds) -> bool:
    """Return whether no rung of the ladder is reached."""
    return (
        inputs.pose <= bounds.pose
        and inputs.silence <= bounds.silence
        and inputs.nearby <= bounds.nearby
        and inputs.telemetry <= bounds.telemetry
        and inputs.battery >= bounds.battery
        and inputs.outside == 0.0
        and inputs.leader_down == 0.0
    )


def land_reason(inputs: Inputs, limits: Limits) -> Reason:
    """Return why the drone must land, NO_REASON if it need not."""
    stale = limits.staleness
    rungs = (
        ("own pose, land", "own pose", inputs.pose, stale.pose_land),
        ("leader estimate, land", "leader estimate", inputs.silence, stale.estimates_land),
        ("telemetry, land", "telemetry", inputs.telemetry, stale.telemetry_land),
        ("leader down, land", "the leader", inputs.leader_down, stale.leader_land),
    )
    for mark, name, age, rung in rungs:
        if age > rung:
            return Reason(mark, f"{name} lost for {age:.1f} s")
    if inputs.battery < limits.battery_land:
        return Reason("battery, land", f"battery at {inputs.battery:.0%}")
    if inputs.outside > limits.fence.margin:
        return Reason("fence, land", f"{inputs.outside:.1f} m outside the fence")
    return NO_REASON


def hold_reason(inputs: Inputs, stale: Staleness) -> Reason:
    """Return why the drone must leave the formation and hold, NO_REASON if it need not."""
    if inputs.pose > stale.pose_zero:
        return Reason("own pose, hold", "own pose is stale")
    if inputs.silence > stale.estimates_hold:
        return Reason("leader estimate, hold", f"no leader estimate for {stale.estimates_hold:g} s")
    if inputs.leader_down > 0.0:
        return Reason("leader down, hold", "the leader is down")
    if inputs.nearby > stale.nearby_hold:
        return Reason("nearby, hold", "nearby bodies are stale")
    return NO_REASON


def unready_reason(inputs: Inputs, missing: tuple[int, ...], limits: Limits, driver: str) -> Reason:
    """Return why the drone is not ready to take off, NO_REASON if it is.

    `missing`: silent neighbours; `driver`: the process that drives it.
    """
    stale = limits.staleness
    names = ", ".join("the leader's pose" if j == 0 else f"{uav(j)}'s estimate" for j in missing)
    reasons = (
        (inputs.pose > stale.pose_zero, "own pose, refuses", "waits for its own pose"),
        (inputs.telemetry > stale.telemetry_warn, "telemetry, refuses", f"waits for telemetry from {driver}"),
        (bool(missing), "neighbour, refuses", f"waits for {names}"),
        (inputs.nearby > stale.nearby_slow, "nearby, refuses", "waits for its nearby bodies"),
        (
            inputs.battery < limits.battery_takeoff,
            "battery, refuses",
            f"battery at {int(100.0 * inputs.battery)}%, take-off needs {limits.battery_takeoff:.0%}",
        ),
    )
    return next((Reason(mark, text) for applies, mark, text in reasons if applies), NO_REASON)


def speed_limit(inputs: Inputs, bounds: Bounds) -> float:
    """Return the speed limit of the drone, m/s."""
    return bounds.speed if inputs.nearby <= bounds.nearby else bounds.blind_speed


def shown(age: float) -> float:
    """Return an age for a status: -1 for an input that never arrived."""
    return -1.0 if age == NEVER else age
