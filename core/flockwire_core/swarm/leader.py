"""The table [leader] of a swarm file: who leads, and the trajectories."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from flockwire_core.control.key_frames import parse_key_frames
from flockwire_core.control.trajectory import Circling, Constant, Timed, Trajectory, Waypoints
from flockwire_core.swarm.ros import absolute_name
from flockwire_core.swarm.tables import Finite, Model, Point, Positive
from flockwire_core.swarm.wording import Takes


class ConstantVelocity(Model):
    """The leader flies straight on."""

    kind: Literal["constant"]  # straight on
    velocity: Point = (0.1, 0.1, 0.0)  # m/s, in the world frame

    def build(self) -> Trajectory:
        """Return the trajectory."""
        return Constant(self.velocity)


class CirclingTrajectory(Model):
    """The leader flies a circle that touches its start."""

    kind: Literal["circle"]  # round a circle that touches the start
    radius: Positive = 1.0  # m, of the circle
    rate: Finite = 0.1  # rad/s, about Z

    def build(self) -> Trajectory:
        """Return the trajectory."""
        return Circling(self.radius, self.rate)


class WaypointsTrajectory(Model):
    """The leader flies through points relative to its start, and stays at the last one (or repeats them)."""

    kind: Literal["waypoints"]  # from point to point
    points: Annotated[tuple[Point, ...], Field(min_length=1)]  # m, relative to the start
    speed: Positive = 0.2  # m/s, between the points
    loop: bool = False  # whether it restarts after the last one

    def build(self) -> Trajectory:
        """Return the trajectory."""
        return Waypoints(self.points, self.speed, self.loop)


class KeyFramesTrajectory(Model):
    """The leader flies a path with times from a CSV file `t,drone,x,y,z` of one drone, relative to its first point."""

    kind: Literal["key_frames"]  # by a CSV file `t,drone,x,y,z`
    file: str  # its path, from the swarm file's folder
    frames: Annotated[str, Field(repr=False)] = ""

    @model_validator(mode="after")
    def _of_one(self) -> Self:
        """Refuse a file that has not the path of one drone."""
        if self.frames and (count := parse_key_frames(self.frames).count) != 1:
            raise ValueError(f"{self.file} has offsets for {count} drones, must have the path of one")
        return self

    def build(self) -> Trajectory:
        """Return the trajectory."""
        return timed(self.frames)


@lru_cache(maxsize=8)
def timed(frames: str) -> Timed:
    """Return the trajectory of key frames' text; raises ValueError."""
    return Timed(parse_key_frames(frames))


class RosLeader(Model):
    """The ROS 2 topic that the leader follows: a velocity, or a place (docs/ros.md)."""

    topic: Annotated[str, AfterValidator(absolute_name), Takes("an absolute ROS name")] = "/leader/cmd_vel"  # its name
    message: Literal["TwistStamped", "PoseStamped"] = "TwistStamped"  # its type in geometry_msgs, in the world frame


class Leader(Model):
    """The leader: drone 0 on a trajectory or steered, a body that a person carries, or a virtual point."""

    kind: Literal["trajectory", "teleoperated", "tracked", "virtual", "ros"] = (
        "trajectory"  # kind of leader, see docs/leaders.md
    )
    trajectory: Annotated[
        ConstantVelocity | CirclingTrajectory | WaypointsTrajectory | KeyFramesTrajectory, Field(discriminator="kind")
    ] = CirclingTrajectory(kind="circle")  # its path in the formation phase; a simulated person walks it
    input_bound: Positive = 0.1  # m/s, |u_0| per axis: unknown to the followers, used in Lemma 3
    tracking_gain: Positive = 2.0  # 1/s, of the leader's own position loop
    start: Point = (0.0, 0.0, 1.0)  # m, of a virtual leader
    speed: Positive = 0.3  # m/s, maximum, of a leader that is steered or carried
    acceleration: Positive = 1.0  # m/s^2, of a steered leader
    ros: RosLeader = RosLeader()  # the table of kind = "ros"

    @property
    def has_body(self) -> bool:
        """Whether it has a body to avoid."""
        return self.kind != "virtual"

    @property
    def steered(self) -> bool:
        """Whether it flies by commands from outside: a person's, or those of a ROS topic."""
        return self.kind in ("teleoperated", "ros")

    @property
    def follows_ros(self) -> bool:
        """Whether those commands are a ROS topic's."""
        return self.kind == "ros"

    @property
    def unforeseen(self) -> bool:
        """Whether its motion is not in the file: it is steered or carried."""
        return self.steered or self.kind == "tracked"

    def course(self) -> Trajectory:
        """Return its known course; a leader whose motion is unforeseen is assumed to stay."""
        return Constant((0.0, 0.0, 0.0)) if self.unforeseen else self.trajectory.build()

    @property
    def speed_bound(self) -> float:
        """The highest expected speed of the leader, m/s."""
        return self.speed if self.unforeseen else self.trajectory.build().fastest
