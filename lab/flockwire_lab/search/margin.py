"""Margins: how far a property was from being violated, by the arrays of a flight.

Each property is "always" of a signal that must not be negative (signal temporal logic; Donze and Maler, 2010). Its
margin is the smallest value of that signal, as a share of the bound: 1 or more far from the bound, 0 at it, negative
beyond it. "Always, if a then b within T" is "always (T - u)" with the age u of what is owed: the time since a without
b.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
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

    def falling(self, owner: str, times: Floats) -> Booleans:
        """Return at which of `times` a drone falls, which no pilot can change: its motors failed, or were stopped."""
        return (times >= self.stopped) | (times >= self.fails.get(owner, np.inf))

    def moving(self, times: Floats) -> Booleans:
        """Return at which of `times` the simulated airframes do not stand still, which no real one does in the air."""
        moves = np.ones(len(times), np.bool_)
        for begin, end in self.still:
            moves &= (times < begin) | (times > end)
        return moves

    def awake(self, owner: str, times: Floats) -> Booleans:
        """Return at which of `times` a drone's driver runs and its airframe moves: otherwise it owes nothing."""
        moves, states = self.moving(times), self.states.get(owner)
        return moves if states is None else moves & (age(times, states.times) < SILENT)

    def placed(self, owner: str, times: Floats) -> Floats:
        """Return the newest true positions of a drone at `times`, m."""
        place = np.searchsorted(self.times[owner], times, "right") - 1
        return self.places[owner][np.maximum(place, 0)]


@dataclass(frozen=True, slots=True)
class Bounds:
    """What no flight may exceed, whatever is faulty."""

    collision: float = 0.2  # m between two centres, in the air
    obstacle: float = 0.1  # m from a centre to the surface of an obstacle, in the air
    in_the_air: float = 0.15  # m
    down: float = 0.05  # m, height at the end
    hard: float = 0.3  # m/s above `limits.vertical_speed` from which on a touch-down is too fast
    fence: float = 0.5  # m beyond `limits.fence.margin`
    silence: float = 5.0  # s to be on the ground after an input is lost, besides that of the descent
    landing: float = 10.0  # s to be on the ground after a pilot began to land, besides that of the descent
    stop: float = 1.0  # s until the motors are off
    rung: float = 0.3  # s after its age in `limits.staleness` until a rung is reached
    obeyed: float = 3.0  # s in which an order has reached whoever can be reached
    longest: float = 75.0  # s of a flight: the operator waits up to 30 s for a stage


BOUNDS = Bounds()
PAUSE = 0.1  # s without true positions: the world was frozen, or restarted
SILENT = 0.35  # s without a process's reports, ten a second, that show it frozen or dead


@dataclass(frozen=True, slots=True)
class Margin:
    """The smallest value of a property's signal, as a share of its bound; when it was, whose it was, and in words."""

    value: float
    at: float  # s after the order to take off
    who: str
    what: str

    @property
    def violated(self) -> bool:
        """Whether the property does not hold."""
        return self.value < 0.0


def always(times: Floats, signal: Floats) -> tuple[float, float]:
    """Return the smallest value of `signal` and its time; infinite without samples."""
    if not len(signal):
        return np.inf, 0.0
    place = int(np.argmin(signal))
    return float(signal[place]), float(times[place])


def owed(times: Floats, pending: Booleans) -> Floats:
    """Return for how long without a pause `pending` has been true, s; 0 where it is not."""
    goes_on = pending & ~np.diff(pending, prepend=False)
    return np.where(pending, times - np.maximum.accumulate(np.where(goes_on, -np.inf, times)), 0.0)


def age(times: Floats, events: Floats) -> Floats:
    """Return the time since the last of `events` (ascending) at each of `times`, s; infinite before the first."""
    last: Floats = np.concatenate([[-np.inf], events])[np.searchsorted(events, times, "right")]
    return times - last
