"""The table [leader] of a swarm file: who leads, and the trajectories."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from flockwire.control.trajectory import Circling, Constant, Trajectory, Waypoints
from flockwire.swarm.tables import Finite, Model, Point, Positive


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


class Leader(Model):
    """The leader: drone 0 on a trajectory or steered by a person, a body that a person carries, or a virtual point."""

    kind: Literal["trajectory", "teleoperated", "tracked", "virtual"] = (
        "trajectory"  # kind of leader, see docs/leaders.md
    )
    trajectory: Annotated[ConstantVelocity | CirclingTrajectory | WaypointsTrajectory, Field(discriminator="kind")] = (
        CirclingTrajectory(kind="circle")  # its path in the formation phase; a simulated person walks it
    )
    input_bound: Positive = 0.1  # m/s, |u_0| per axis: unknown to the followers, used in Lemma 3
    tracking_gain: Positive = 2.0  # 1/s, of the leader's own position loop
    start: Point = (0.0, 0.0, 1.0)  # m, of a virtual leader
    speed: Positive = 0.3  # m/s, maximum, of a leader that a person steers or carries
    acceleration: Positive = 1.0  # m/s^2, of a teleoperated leader

    @property
    def has_body(self) -> bool:
        """Whether it has a body to avoid."""
        return self.kind != "virtual"

    @property
    def by_person(self) -> bool:
        """Whether a person steers or carries it."""
        return self.kind in ("teleoperated", "tracked")

    def course(self) -> Trajectory:
        """Return its known course; a leader that a person steers or carries is assumed to stay."""
        return Constant((0.0, 0.0, 0.0)) if self.by_person else self.trajectory.build()

    @property
    def speed_bound(self) -> float:
        """The highest expected speed of the leader, m/s."""
        return self.speed if self.by_person else self.trajectory.build().fastest
