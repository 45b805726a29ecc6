"""One virtual flight as arrays: what its margins are computed from."""

from __future__ import annotations

from dataclasses import dataclass

from flockwire_analysis.series import Booleans, Floats
from flockwire_core.domain.airframe import FlightState
from flockwire_core.swarm.model import Swarm


@dataclass(frozen=True, slots=True)
class Reports:
    """The statuses of one pilot: times (s after the order to take off), phases, ages and batteries, one for each."""

    times: Floats
    phases: tuple[str, ...]
    pose_ages: Floats  # s, -1 without a pose
    nearby_ages: Floats
    telemetry_ages: Floats
    batteries: Floats  # share of full, -1 without telemetry
    begun: Floats  # times of the first status of each of its processes


@dataclass(frozen=True, slots=True)
class States:
    """The telemetry of one drone: times, states, whether a stop was received, ages of the command."""

    times: Floats
    states: tuple[FlightState, ...]
    stopped: Booleans
    command_ages: Floats


@dataclass(frozen=True, slots=True)
class Flown:
    """One flight, by drone (`uav0` ...). Times are s after the order to take off, before it they are negative."""

    swarm: Swarm
    times: dict[str, Floats]  # of the true positions
    places: dict[str, Floats]  # m, one row for each of the times
    poses: dict[str, Floats]  # times at which its pose was published
    commands: dict[str, Floats]  # times at which its pilot published a command
    reports: dict[str, Reports]
    states: dict[str, States]
    took_off: bool
    stopped: float  # time of the first emergency stop, infinite without one
    refused: tuple[tuple[float, str], ...]  # take-offs that a landing forbids: s since it was ordered, whose
    deviations: tuple[str, ...]  # what pilots did against the protocol (flockwire_analysis/conformance.py)
    failure: str  # why the flight failed, empty if it did not
    seconds: float  # of the whole flight
    fails: dict[str, float]  # times at which motors fail
    world_ended: bool  # the simulated airframes ended or stand still, drones and all
    still: tuple[tuple[float, float], ...]  # from when to when the simulated airframes stood still
    jumps: tuple[float, ...]  # when their clock was set ahead: they flew some time in one step
    formed: tuple[tuple[float, float], ...]  # s until the formation stood again where it was owed, and the bound
    visited: bool  # a person or another body was in the field: drones avoid it as they land, too
    tails: dict[str, tuple[float, float]]  # at the end of a formation that had time to settle: time, largest error, m
