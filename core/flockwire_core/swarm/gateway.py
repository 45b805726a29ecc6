"""The table [gateway] of a swarm file: the source of poses. Each source has its own table."""

from __future__ import annotations

import re
from math import hypot
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from flockwire_core.swarm.ros import Domain, RouterAddress, absolute_name
from flockwire_core.swarm.tables import Delay, Finite, Model, Point, Positive, Size
from flockwire_core.swarm.wording import Takes

Port = Annotated[int, Field(ge=1, le=65535)]
Share = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]
UpAxis = Literal["y", "z"]
Unit = Literal["m", "mm"]
Noise = Annotated[float, Field(ge=0, le=0.5, allow_inf_nan=False)]  # m; more is millimetres
UNIT_TOLERANCE = 0.01  # of a quaternion's length: rounding by a person


def _unit(q: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    length = hypot(*q)
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise ValueError("must be a unit quaternion x, y, z, w")
    x, y, z, w = q
    return (x / length, y / length, z / length, w / length)


def _version(text: str) -> str:
    if not re.fullmatch(r"[0-9]\.[0-9]", text):
        raise ValueError('must be a version like "4.1"')
    return text


def _body_topic(text: str) -> str:
    if "{body}" not in text or "{body}" in text.replace("/{body}", ""):
        raise ValueError("must have {body} as a whole part, as /vrpn_mocap/{body}/pose")
    absolute_name(text.replace("{body}", "body"))
    return text


Rotation = Annotated[
    tuple[Finite, Finite, Finite, Finite], AfterValidator(_unit), Takes("a unit quaternion [x, y, z, w]")
]
BodyTopic = Annotated[str, AfterValidator(_body_topic), Takes("an absolute ROS name with {body} in it")]
Version = Annotated[str, AfterValidator(_version), Takes('a version like "4.1"')]


class Axes(Model):
    """The frame of a source."""

    up_axis: UpAxis = "z"  # the axis that points up
    unit: Unit = "m"  # of its lengths


class NatNet(Axes):
    """OptiTrack's Motive, or another server of NatNet 3.0 to 4.5."""

    server: str = "127.0.0.1"  # its IPv4 address
    command_port: Port = 1510  # for requests
    multicast: bool = False  # whether it streams to a group, not to each client
    group: str | None = None  # of multicast; default: as the server announces
    data_port: Port = 1511  # of that group
    interface: str = "0.0.0.0"  # noqa: S104  # this host's IPv4 address towards the server
    bitstream: Version | None = None  # NatNet version to request (multicast: the streamed one); default: the server's
    request_model: bool = True  # whether to request the bodies' names
    up_axis: UpAxis = "y"  # the axis that points up


class Vrpn(Axes):
    """A VRPN server, over TCP; each sender is a body."""

    server: str = "127.0.0.1"  # its name or address
    port: Port = 3883  # of TCP
    latency: Delay = 0.0  # s, from exposure to the server's stamp


class Qualisys(Axes):
    """Qualisys QTM's real-time server (extra `qualisys`)."""

    server: str = "127.0.0.1"  # its name or address
    port: Port = 22223  # of TCP, for little-endian
    latency: Delay = 0.0  # s, from exposure to arrival, if known
    unit: Unit = "mm"  # of its lengths


class Vicon(Axes):
    """Vicon's Tracker or Nexus (extra `vicon`)."""

    server: str = "127.0.0.1"  # its name or address
    latency: Delay = 0.0  # s, from exposure to arrival, if known


class BodyTopics(Axes):
    """Topics of ROS 2 that report bodies: one for each, or one of all (docs/ros.md)."""

    topic: BodyTopic | None = None  # PoseStamped or TransformStamped, one for each body
    array: Annotated[str, AfterValidator(absolute_name), Takes("an absolute ROS name")] | None = (
        None  # PoseArray, NamedPoseArray or TFMessage of all bodies, instead of `topic`
    )
    bodies: tuple[str, ...] = ()  # the bodies' names in the order of a PoseArray; default: the drones', by id


class RosPoses(BodyTopics):
    """Poses from ROS 2 (docs/ros.md)."""

    router: RouterAddress = "127.0.0.1:7447"  # address and port of rmw_zenohd
    domain: Domain = 0  # ROS_DOMAIN_ID
    topic: BodyTopic = "/vrpn_mocap/{body}/pose"  # PoseStamped or TransformStamped, one for each body
    latency: Delay = 0.0  # s, from exposure to arrival, if known

    @property
    def server(self) -> str:
        """Where the poses come from."""
        return self.router


class Replay(BodyTopics):
    """The poses of an earlier flight, or of a bag of ROS 2 with `topic` or `array`; frame and unit are the latter's."""

    trace: str = ""  # file, trace.mcap of an earlier flight or an MCAP bag
    pace: Positive = 1.0  # relative to the recorded pace

    @property
    def foreign(self) -> bool:
        """Whether the poses are in a tracker's frame, on topics of its own."""
        return self.topic is not None or self.array is not None


class Twin(Model):
    """A simulated tracker, which serves the simulated airframes in the source's protocol, at the source's address."""

    version: Version = "4.1"  # of NatNet
    loss: Share = 0.0  # share of frames that are lost
    repetition: Share = 0.0  # share of frames that arrive twice
    reordering: Share = 0.0  # share of frames that arrive after the next
    renamed: dict[str, str] = Field(default={})  # its names for bodies, by the name in this file


class Gateway(Model):
    """The source of poses, and the tracker's frame on the field (docs/tracking.md)."""

    source: Literal["simulated", "natnet", "vrpn", "qualisys", "vicon", "ros", "replay"] = (
        "simulated"  # the tracking system; its table is below
    )
    rate_hz: Annotated[int, Field(ge=10, le=500)] = 100  # Hz, of the cameras
    rotation: Rotation = (0.0, 0.0, 0.0, 1.0)  # quaternion x, y, z, w: from the tracker's axes, z up, to the field's
    offset: Point = (0.0, 0.0, 0.0)  # m, of the tracker's origin on the field
    person_radius: Size = 0.4  # m, round a body that this file does not name: a person with markers
    natnet: NatNet = NatNet()  # the table of source = "natnet"
    vrpn: Vrpn = Vrpn()  # the table of source = "vrpn"
    qualisys: Qualisys = Qualisys()  # the table of source = "qualisys"
    vicon: Vicon = Vicon()  # the table of source = "vicon"
    ros: RosPoses = RosPoses()  # the table of source = "ros"
    replay: Replay = Replay()  # the table of source = "replay"
    twin: Twin | None = None  # a simulated tracker; this table enables it
    noise: Noise = 0.0  # m, standard deviation per axis (simulated cameras)
    latency: Delay = 0.0  # s, from exposure to sending (simulated cameras)
    dropout: Share = 0.0  # share of lost samples (simulated cameras)
    seed: Annotated[int, Field(ge=0)] = 0  # of noise and losses

    twins: ClassVar[tuple[str, ...]] = ("natnet", "vrpn", "qualisys", "ros")  # sources that a twin can serve

    @property
    def simulates_tracker(self) -> bool:
        """Whether the swarm has a simulated tracker."""
        return self.twin is not None and self.source in self.twins

    @property
    def from_ros(self) -> bool:
        """Whether poses come from ROS 2."""
        return self.source == "ros"

    @property
    def table(self) -> Axes:
        """The axes and unit of the source in use."""
        table = getattr(self, self.source)
        return table if isinstance(table, Axes) else Axes()

    def simulated(self) -> Gateway:
        """Return the table for virtual time: simulated cameras replace any other source."""
        return self.model_copy(update={"source": "simulated", "twin": None})
