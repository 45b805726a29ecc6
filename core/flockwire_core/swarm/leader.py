"""The table [leader] of a swarm file: how leaders move, and the trajectories."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator
from pydantic.json_schema import SkipJsonSchema

from flockwire_core.control.key_frames import parse_key_frames
from flockwire_core.swarm.ros import AbsoluteName
from flockwire_core.swarm.tables import Finite, Items, Model, Point, Positive, key


class ConstantVelocity(Model):
    """The leader flies straight on."""

    kind: Literal["constant"] = key(..., "straight on")
    velocity: Point = key((0.1, 0.1, 0.0), "in the world frame", "m/s")


class CirclingTrajectory(Model):
    """The leader flies a circle that touches its start."""

    kind: Literal["circle"] = key(..., "round a circle that touches the start")
    radius: Positive = key(1.0, "of the circle", "m")
    rate: Finite = key(0.1, "about Z", "rad/s")


class WaypointsTrajectory(Model):
    """The leader flies through points relative to its start, and stays at the last one (or repeats them)."""

    kind: Literal["waypoints"] = key(..., "from point to point")
    points: Items[Point] = key(..., "relative to the start", "m", min_length=1)
    speed: Positive = key(0.2, "between the points", "m/s")
    loop: bool = key(False, "whether it restarts after the last one")


class KeyFramesTrajectory(Model):
    """The leader flies a path with times from a CSV file `t,drone,x,y,z` of one drone, relative to its first point."""

    kind: Literal["key_frames"] = key(..., "by a CSV file `t,drone,x,y,z`")
    file: str = key(..., "its path, from the swarm file's folder")
    frames: SkipJsonSchema[str] = Field("", repr=False)

    @model_validator(mode="after")
    def _of_one(self) -> Self:
        """Refuse a file that has not the path of one drone."""
        if self.frames and (count := parse_key_frames(self.frames).count) != 1:
            raise ValueError(f"{self.file} has offsets for {count} drones, must have the path of one")
        return self


class RosLeader(Model):
    """The ROS 2 topic that the leader follows: a velocity, or a place (docs/ros.md)."""

    topic: AbsoluteName = key("/leader/cmd_vel", "its name")
    message: Literal["TwistStamped", "PoseStamped"] = key(
        "TwistStamped", "its type in geometry_msgs, in the world frame"
    )


class Leader(Model):
    """A leader: a drone on a trajectory or steered, a body that a person carries, or a virtual point."""

    kind: Literal["trajectory", "teleoperated", "tracked", "virtual", "ros"] = key(
        "trajectory", "kind of leader, see docs/leaders.md"
    )
    trajectory: Annotated[
        ConstantVelocity | CirclingTrajectory | WaypointsTrajectory | KeyFramesTrajectory, Field(discriminator="kind")
    ] = key(CirclingTrajectory(kind="circle"), "its path in the formation phase; a simulated person walks it")
    input_bound: Positive = key(0.1, "|u_0| per axis: unknown to the followers, used in Lemma 3", "m/s")
    tracking_gain: Positive = key(2.0, "of the leader's own position loop", "1/s")
    start: Point = key((0.0, 0.0, 1.0), "of a virtual leader", "m")
    speed: Positive = key(0.3, "maximum, of a leader that is steered or carried", "m/s")
    acceleration: Positive = key(1.0, "of a steered leader", "m/s^2")
    ros: RosLeader = key(RosLeader(), 'the table of kind = "ros"')

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


AT_REST = Leader(kind="virtual", trajectory=ConstantVelocity(kind="constant", velocity=(0.0, 0.0, 0.0)))


class LeaderTable(Leader):
    """The table [leader], of every leader; a table [leader.ID] changes keys of leader ID."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Leader] = Field(init=False)

    @model_validator(mode="before")
    @classmethod
    def _inherited(cls, table: object) -> object:
        """Give each leader's own table the keys of all; refuse unknown keys that are no id."""
        if not isinstance(table, dict):
            return table
        common = {key: value for key, value in table.items() if not key.isdecimal()}
        Leader.model_validate(common)
        return {key: common | value if isinstance(value, dict) and key not in common else value
                for key, value in table.items()}  # fmt: skip

    @property
    def own(self) -> dict[int, Leader]:
        """The tables of single leaders, by id."""
        return {int(number): table for number, table in self.__pydantic_extra__.items()}

    def key(self, number: int) -> str:
        """Return the key of the table of leader `number`."""
        return f"leader.{number}" if number in self.own else "leader"

    def of(self, number: int) -> Leader:
        """Return the table of leader `number`."""
        return self.own.get(number, self)
