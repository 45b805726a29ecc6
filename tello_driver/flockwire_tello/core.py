"""The drivers and airframes of all simulated drones, without clock, input or output."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from flockwire.flight.cores import Start
from flockwire.flight.faults import AirframeFailure, AirframeLag, Fault
from flockwire.flight.stepping import next_deadline
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm, uav
from flockwire.wire.keys import STOP, Key
from flockwire.wire.messages import Command, FlightState, Message, Pose, Stop, Telemetry
from flockwire.wire.status import Report

from flockwire_tello.airframe import SimulatedAirframe
from flockwire_tello.drone import SimulatedDrone

TELEMETRY_PERIOD = BILLION // 10
SETTLED = BILLION  # ns that all drones are on the ground before the process may end
RETIREMENT = 20 * BILLION  # ns that pilots have to land their drones when the process is to end


class KinematicsCore:
    """All simulated drones of `swarm`, started at `now` (Unix ns), with the `faults` of their airframes.

    Faults count from `took_off` (Unix ns), or without it from the first command to rise.
    """

    def __init__(self, swarm: Swarm, now: int, faults: Iterable[Fault] = (), took_off: int | None = None) -> None:
        self.triggers: frozenset[Key] = frozenset()
        self.prompt = frozenset({STOP, *(Key("command", uav(i)) for i in swarm.flying)})
        self.period = 1.0 / swarm.gateway.rate_hz
        self._frame = swarm.frame
        limits = swarm.limits
        self._drones = {
            uav(i): SimulatedDrone(SimulatedAirframe(swarm.airframe(i), swarm.drone(i).start, now), limits)
            for i in swarm.flying
        }
        self._truths = tuple((Key("truth", owner), drone) for owner, drone in self._drones.items())
        self._telemetry_deadline = now
        self._flew = 0  # when the last drone was in the air, Unix ns
        self._faults = deque(fault for fault in faults if isinstance(fault, AirframeLag | AirframeFailure))
        self._begin = took_off  # of the time that faults count in: the first take-off

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in a message."""
        match message:
            case Command():
                if self._begin is None and message.velocity[2] > 0.0:
                    self._begin = now
                self._drones[key.owner].command(message.velocity, now)
            case Stop():
                for drone in self._drones.values():
                    drone.airframe.stop()
                self._telemetry_deadline = 0  # the operator waits for a report that the motors are off

    def due(self, key: Key) -> bool:
        """Return False: the airframes move at a rate of their own."""
        return False

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Move all drones on to `now` and publish where they are."""
        if self._faults and self._begin is not None:
            self._inject((now - self._begin) / BILLION)
        messages: list[tuple[Key, Message]] = []
        for key, drone in self._truths:
            drone.advance(now)
            if drone.in_the_air:
                self._flew = now
            messages.append((key, Pose(now, self._frame, drone.airframe.position)))
        if now >= self._telemetry_deadline:
            self._telemetry_deadline = next_deadline(self._telemetry_deadline, now, TELEMETRY_PERIOD)
            for owner, drone in self._drones.items():
                frame = drone.airframe
                height, silence = frame.position[2], drone.command_age(now)
                telemetry = Telemetry(now, self._frame, frame.state, frame.battery, height, silence)
                messages.append((Key("telemetry", owner), telemetry))
        return messages

    def retire(self, now: int) -> None:
        """Land what still flies in RETIREMENT s: the process is to end."""
        for drone in self._drones.values():
            drone.land_at = now + RETIREMENT

    def may_end(self, now: int) -> bool:
        """Return whether every drone has stood on the ground for a second."""
        flying = any(drone.in_the_air for drone in self._drones.values())  # this process may have stood still since
        return not flying and now - self._flew >= SETTLED

    def report(self, now: int) -> Report:
        """Return how the drones are."""
        flying = sum(drone.airframe.state is FlightState.FLYING for drone in self._drones.values())
        clipped = sum(drone.clipped for drone in self._drones.values())
        details = (
            f"{flying} of {len(self._drones)} in flight" if flying else "",
            f"{clipped} commands clipped" if clipped else "",
        )
        return Report("simulating", ", ".join(detail for detail in details if detail))

    def _inject(self, t: float) -> None:
        """Inject the faults that are due at `t` s after the first take-off."""
        while self._faults and self._faults[0].at <= t:
            fault = self._faults.popleft()
            airframe = self._drones[uav(fault.drone)].airframe
            if isinstance(fault, AirframeFailure):
                airframe.stop()
            else:
                airframe.respond(fault.lag, fault.dead_time)


def make_core(start: Start) -> KinematicsCore:
    """Return the core of all simulated airframes."""
    return KinematicsCore(start.plan.swarm, start.now, start.faults, start.took_off)
