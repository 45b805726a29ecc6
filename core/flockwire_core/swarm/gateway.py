"""The table [gateway] of a swarm file: the source of poses. Each source has its own table."""

from __future__ import annotations

import re
from math import hypot
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from flockwire_core.swarm.ros import AbsoluteName, Domain, RouterAddress, is_absolute
from flockwire_core.swarm.tables import (
    Delay,
    Finite,
    Form,
    GroupIp4,
    HostIp4,
    Items,
    Model,
    Point,
    Positive,
    Share,
    Size,
    key,
)

Port = Annotated[int, Field(ge=1, le=65535)]
UpAxis = Literal["y", "z"]
Unit = Literal["m", "mm"]
Noise = Annotated[float, Field(ge=0, le=0.5, allow_inf_nan=False)]  # m; more is millimetres
OLDEST, NEWEST = "3.0", "4.5"  # versions of NatNet


Quaternion = tuple[Finite, Finite, Finite, Finite]


def _is_unit(q: Quaternion) -> bool:
    return abs(hypot(*q) - 1.0) <= 0.01  # of a quaternion's length: rounding by a person


def _normalise(q: Quaternion) -> Quaternion:
    length = hypot(*q)
    x, y, z, w = q
    return (x / length, y / length, z / length, w / length)


def _is_body_topic(text: str) -> bool:
    return "{body}" in text and bool(is_absolute(text.replace("/{body}", "/body")))


def _is_version(text: str) -> bool:
    return re.fullmatch(r"[0-9]\.[0-9]", text) is not None and OLDEST <= text <= NEWEST


Rotation = Annotated[
    Quaternion, Field(strict=False), Form("a unit quaternion [x, y, z, w]", _is_unit), AfterValidator(_normalise)
]
BodyTopic = Annotated[
    str, Form("an absolute ROS name with {body} as a whole part, as /vrpn_mocap/{body}/pose", _is_body_topic)
]
Version = Annotated[str, Form(f'a version of NatNet from {OLDEST} to {NEWEST}, as text like "4.1"', _is_version)]


class Axes(Model):
    """The frame of a source."""

    up_axis: UpAxis = key("z", "the axis that points up")
    unit: Unit = key("m", "of its lengths")


class NatNet(Axes):
    """OptiTrack's Motive, or another server of NatNet 3.0 to 4.5."""

    server: HostIp4 = key("127.0.0.1", "its IPv4 address")
    command_port: Port = key(1510, "for requests")
    multicast: bool = key(False, "whether it streams to a group, not to each client")
    group: GroupIp4 | None = key(None, "of multicast; default: as the server announces")
    data_port: Port = key(1511, "of that group")
    interface: HostIp4 = key("0.0.0.0", "this host's IPv4 address towards the server")  # noqa: S104
    bitstream: Version | None = key(
        None, "NatNet version to request (multicast: the streamed one); default: the server's"
    )
    request_model: bool = key(True, "whether to request the bodies' names")
    up_axis: UpAxis = key("y", "the axis that points up")


class Vrpn(Axes):
    """A VRPN server, over TCP; each sender is a body."""

    server: str = key("127.0.0.1", "its name or address")
    port: Port = key(3883, "of TCP")
    latency: Delay = key(0.0, "from exposure to the server's stamp", "s")


class Qualisys(Axes):
    """Qualisys QTM's real-time server (extra `qualisys`)."""

    server: str = key("127.0.0.1", "its name or address")
    port: Port = key(22223, "of TCP, for little-endian")
    latency: Delay = key(0.0, "from exposure to arrival, if known", "s")
    unit: Unit = key("mm", "of its lengths")


class Vicon(Axes):
    """Vicon's Tracker or Nexus (extra `vicon`)."""

    server: str = key("127.0.0.1", "its name or address")
    latency: Delay = key(0.0, "from exposure to arrival, if known", "s")


class BodyTopics(Axes):
    """Topics of ROS 2 that report bodies: one for each, or one of all (docs/ros.md)."""

    topic: BodyTopic | None = key(None, "PoseStamped or TransformStamped, one for each body")
    array: AbsoluteName | None = key(None, "PoseArray, NamedPoseArray or TFMessage of all bodies, instead of `topic`")
    bodies: Items[str] = key((), "the bodies' names in the order of a PoseArray; default: the drones', by id")


class RosPoses(BodyTopics):
    """Poses from ROS 2 (docs/ros.md)."""

    router: RouterAddress = key("127.0.0.1:7447", "address and port of rmw_zenohd")
    domain: Domain = key(0, "ROS_DOMAIN_ID")
    topic: BodyTopic = key("/vrpn_mocap/{body}/pose", "PoseStamped or TransformStamped, one for each body")
    latency: Delay = key(0.0, "from exposure to arrival, if known", "s")

    @property
    def server(self) -> str:
        """Where the poses come from."""
        return self.router


class Replay(BodyTopics):
    """The poses of an earlier flight, or of a bag of ROS 2 with `topic` or `array`; frame and unit are the latter's."""

    trace: str = key("", "file, trace.mcap of an earlier flight or an MCAP bag")
    pace: Positive = key(1.0, "relative to the recorded pace")

    @property
    def foreign(self) -> bool:
        """Whether the poses are in a tracker's frame, on topics of its own."""
        return self.topic is not None or self.array is not None


class Twin(Model):
    """A simulated tracker, which serves the simulated airframes in the source's protocol, at the source's address."""

    version: Version = key("4.1", "of NatNet")
    loss: Share = key(0.0, "share of frames that are lost")
    repetition: Share = key(0.0, "share of frames that arrive twice")
    reordering: Share = key(0.0, "share of frames that arrive after the next")
    renamed: dict[str, str] = key({}, "its names for bodies, by the name in this file")


class Gateway(Model):
    """The source of poses, and the tracker's frame on the field (docs/tracking.md)."""

    source: Literal["simulated", "natnet", "vrpn", "qualisys", "vicon", "ros", "replay"] = key(
        "simulated", "the tracking system; its table is below"
    )
    rate_hz: int = key(100, "of the cameras", "Hz", ge=10, le=500)
    rotation: Rotation = key(
        (0.0, 0.0, 0.0, 1.0), "quaternion x, y, z, w: from the tracker's axes, z up, to the field's"
    )
    offset: Point = key((0.0, 0.0, 0.0), "of the tracker's origin on the field", "m")
    person_radius: Size = key(0.4, "round a body that this file does not name: a person with markers", "m")
    natnet: NatNet = key(NatNet(), 'the table of source = "natnet"')
    vrpn: Vrpn = key(Vrpn(), 'the table of source = "vrpn"')
    qualisys: Qualisys = key(Qualisys(), 'the table of source = "qualisys"')
    vicon: Vicon = key(Vicon(), 'the table of source = "vicon"')
    ros: RosPoses = key(RosPoses(), 'the table of source = "ros"')
    replay: Replay = key(Replay(), 'the table of source = "replay"')
    twin: Twin | None = key(None, "a simulated tracker; this table enables it")
    noise: Noise = key(0.0, "standard deviation per axis (simulated cameras)", "m")
    latency: Delay = key(0.0, "from exposure to sending (simulated cameras)", "s")
    dropout: Share = key(0.0, "share of lost samples (simulated cameras)")
    seed: int = key(0, "of noise and losses", ge=0)

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
        table = getattr(self, self.source, None)  # simulated cameras have none
        return table if isinstance(table, Axes) else Axes()
