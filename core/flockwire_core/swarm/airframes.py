"""The airframe table: one row for each kind of airframe. No file outside a row's folder uses its name.

The process table and the key table (wire) are similar. A new kind of airframe is a row here and a folder with the
objects that the row names as "module:name".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple


class ByItself(NamedTuple):
    """An airframe's own reaction to an input that has been missing for `after` s; inf: none."""

    does: str
    after: float = inf


FOLLOWS, CONTINUES = ByItself("follows its last command"), ByItself("continues")  # of simulations without a driver


@dataclass(frozen=True, slots=True)
class AirframeRow:
    """One kind of airframe; `kind` is also the name of its built-in airframe and of its table in [[drones]]."""

    kind: str
    simulated: str  # makes the simulation of (swarm, drone's id, now, draw from [0, 1))
    without_setpoints: ByItself = FOLLOWS  # reaction to missing setpoints
    without_poses: ByItself = CONTINUES  # reaction to lost tracking with setpoints
    without_link: ByItself = FOLLOWS  # reaction to a lost link to its driver
    driver: str = ""  # makes the core of its driver's process from a Start; empty: its simulation obeys commands itself
    drone_keys: str = ""  # model of its keys in [[drones]]: one table, named like its kind
    airframe_keys: str = ""  # model of its keys in [airframes.NAME]
    built_in: Mapping[str, float] = field(default_factory=dict)  # keys of the built-in airframe
    fastest: str = ""  # its highest horizontal speed, m/s, from an Airframe; empty: limits.speed
    rules: str = ""  # rules of the swarm file (swarm/rules.py)
    warnings: str = ""  # yields warnings of `flockwire check` for a Swarm
    live_checks: tuple[str, ...] = ()  # codes of its driver's reasons (wire/status.py) with a line in `check --live`
    identified: str = ""  # yields its keys of [airframes.NAME] from an Airframe and the measured gain of each axis
    wears: bool = False  # faults change its simulation's mass, gains and rotors
    accelerates: bool = False  # it takes accelerations beside velocities, of laws that command them
    turns: bool = False  # it obeys a yaw rate; its driver subscribes to its pose, to know its heading
    command: str = ""  # a further command of the command line, which runs its simulation without a swarm


KINEMATICS = AirframeRow("kinematics", simulated="flockwire_twins.kinematics.drone:standing")
MULTIROTOR = AirframeRow(
    "multirotor",
    simulated="flockwire_twins.multirotor.airframe:standing",
    airframe_keys="flockwire_twins.multirotor.swarm_file:MultirotorInAirframes",
    built_in={"lag": 0.17, "dead_time": 0.09},  # s, as `flockwire identify` finds them
    rules="flockwire_twins.multirotor.rules:RULES",
    warnings="flockwire_twins.multirotor.rules:warnings",
    wears=True,
    accelerates=True,
    turns=True,
)
TELLO = AirframeRow(
    "tello",
    simulated="flockwire_twins.tello.served:ServedTello",
    without_setpoints=ByItself("lands", after=15.0),
    without_poses=ByItself("holds by its own optical flow"),
    without_link=ByItself("lands", after=15.0),
    driver="flockwire_tello.driver:make_core",
    drone_keys="flockwire_tello.swarm_file:TelloInDrones",
    airframe_keys="flockwire_tello.swarm_file:TelloInAirframes",
    built_in={"lag": 0.25, "dead_time": 0.1},  # s, assumed, not measured
    fastest="flockwire_tello.sticks:full_speed",
    rules="flockwire_tello.rules:RULES",
    warnings="flockwire_tello.rules:warnings",
    live_checks=("link", "firmware", "serial", "IMU"),
    identified="flockwire_tello.swarm_file:identified",
    turns=True,
    command="flockwire_twins.tello.command:tello_sim",
)

AIRFRAMES = (KINEMATICS, MULTIROTOR, TELLO)
ROWS = {row.kind: row for row in AIRFRAMES}
