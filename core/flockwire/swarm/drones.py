"""The tables [[drones]] and [airframes] of a swarm file: every drone, and how airframes answer commands."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from flockwire.swarm.tables import Finite, Model, NotNegative, Point, Port, Positive


class Tello(Model):
    """How the driver of a Tello reaches it."""

    address: str | None = None  # the drone's own IPv4 address, "192.168.10.1"; default: it is simulated
    local_ip: str | None = None  # of the host, for the driver; default: all, beside a drone on loopback one of its own
    command_port: Port = 8889  # of the host
    state_port: Port = 8890  # of the host
    source_filter: bool = True  # takes datagrams of the drone's address alone; off behind an address translation


class Drone(Model):
    """One drone: 0 is the leader, the others follow."""

    id: Annotated[int, Field(ge=0, le=999)]  # 0 is the leader; the others follow, in ascending order of their places
    airframe: str = "kinematics"  # a name from [airframes]: "kinematics", "tello", or one of the file
    start: Point  # m, where it stands before take-off
    heading: Finite = 0.0  # rad, counter-clockwise from x, of a simulated Tello at its start
    tello: Tello | None = None  # how the driver of a Tello reaches it; default: the drone is simulated
    body: str | Annotated[int, Field(ge=0)] | None = None  # its name, or number, at the tracker; default: uavID
    host: str | None = None  # the machine its agent runs on; default: the first of [hosts]
    address: str | None = None  # where its agent listens, "IP:PORT"; default: its host's address and a port of its own


class StickGains(Model):
    """What one unit of each stick of a Tello is worth: m/s, of yaw rad/s. Assumed: `flockwire identify` measures it."""

    right: Positive = 0.01  # m/s, to the right
    forward: Positive = 0.01  # m/s, forward
    up: Positive = 0.01  # m/s, upward
    clockwise: Positive = 0.01745  # rad/s, of yaw


class Airframe(Model):
    """How an airframe answers a velocity command: first-order lag behind a dead time. Laws know both."""

    kind: Literal["kinematics", "tello"] = "kinematics"  # "tello" has a driver of its own, on UDP
    gain: Positive = 1.0  # speed over commanded speed, at rest (simulated airframes)
    lag: NotNegative = 0.0  # s, time constant
    dead_time: NotNegative = 0.0  # s, before it answers
    endurance: Positive = 900.0  # s, of flight on a full battery (simulated airframes)
    stick_gains: StickGains = StickGains()  # what a Tello's sticks are worth
    rc_rate_hz: Annotated[int, Field(ge=5, le=100)] = 50  # Hz, at which a Tello's driver sends the sticks


BUILT_IN_AIRFRAMES = {
    "kinematics": Airframe(),
    "tello": Airframe(kind="tello", lag=0.25, dead_time=0.1),  # assumed, not measured
}
