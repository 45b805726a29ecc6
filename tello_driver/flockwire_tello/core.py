"""The airframes of all simulated drones, and the drivers of those that are no Tello, without clock, input or output."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable

from flockwire.flight.cores import Address, Datagram, Start
from flockwire.flight.faults import AirframeFailure, AirframeLag, Fault
from flockwire.flight.moving_point import MovingPoint
from flockwire.flight.stepping import is_due, next_deadline
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm, uav
from flockwire.wire.keys import STOP, Key
from flockwire.wire.messages import Command, FlightState, Message, Mission, Pose, Stop, Telemetry
from flockwire.wire.status import Report

from flockwire_tello.airframe import SimulatedAirframe
from flockwire_tello.drone import SimulatedDrone
from flockwire_tello.served_tello import ServedTello
from flockwire_tello.timing import RETIREMENT, SETTLED, TELEMETRY_PERIOD

SETTLED_TELLO = 4 * BILLION  # as SETTLED, with Tellos: their drivers see it by a state that stays the same


class KinematicsCore:
    """All simulated drones of `swarm`, started at `now` (Unix ns), with the `faults` of their airframes.

    A person who carries the leader walks its trajectory from the order to start on. Tellos are served at addresses of
    their own; `chance` draws their reply times. Faults count from `took_off` (Unix ns), or without it from the first
    command to rise.
    """

    def __init__(
        self,
        swarm: Swarm,
        now: int,
        faults: Iterable[Fault] = (),
        took_off: int | None = None,
        chance: Callable[[], float] = lambda: 0.5,
    ) -> None:
        own = [i for i in swarm.simulated if i not in swarm.tellos]
        self.triggers: frozenset[Key] = frozenset()
        self.prompt = frozenset({STOP, *(Key("command", uav(i)) for i in own)})
        self.period = 1.0 / swarm.gateway.rate_hz
        self._frame = swarm.frame
        limits = swarm.limits
        self._drones = {
            uav(i): SimulatedDrone(SimulatedAirframe(swarm.airframe(i), swarm.drone(i).start, now), limits) for i in own
        }
        served = [i for i in swarm.simulated if i in swarm.tellos]
        self._tellos = {uav(i): ServedTello(swarm, i, now, chance) for i in served}
        self._served = {tello.address: tello for tello in self._tellos.values()}
        walk = swarm.leader.trajectory.build()
        self._persons = {Key("truth", uav(i)): MovingPoint(walk, swarm.drone(i).start, now) for i in swarm.walking}
        self._truths = tuple((Key("truth", owner), drone) for owner, drone in self._drones.items())
        self._settled = SETTLED if not served else SETTLED_TELLO
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
            case Mission():
                for person in self._persons.values():
                    person.order(message, now)
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
        messages: list[tuple[Key, Message]] = [
            (key, Pose(now, self._frame, person.advance(now))) for key, person in self._persons.items()
        ]
        for key, drone in self._truths:
            drone.advance(now)
            if drone.in_the_air:
                self._flew = now
            messages.append((key, Pose(now, self._frame, drone.airframe.position)))
        for owner, tello in self._tellos.items():
            tello.advance(now)
            if tello.in_the_air:
                self._flew = now
                self._begin = now if self._begin is None else self._begin
            messages.append((Key("truth", owner), Pose(now, self._frame, tello.position, tello.orientation)))
        if is_due(self._telemetry_deadline, now, TELEMETRY_PERIOD):
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

    @property
    def sockets(self) -> tuple[Address, ...]:
        """The addresses to bind: those of the Tellos."""
        return tuple(self._served)

    def datagram(self, data: bytes, sender: Address, at: Address, now: int) -> None:
        """Take in a datagram that came to the Tello at the address `at`."""
        self._served[at].datagram(data, sender, now)

    def outgoing(self, now: int) -> list[Datagram]:
        """Return what the Tellos send."""
        return [datagram for tello in self._tellos.values() for datagram in tello.outgoing(now)]

    def may_end(self, now: int) -> bool:
        """Return whether every drone has stood on the ground for a second."""
        # Looked at now: this process may have stood still since its last step.
        flying = any(drone.in_the_air for drone in self._drones.values())
        flying = flying or any(tello.in_the_air for tello in self._tellos.values())
        return not flying and now - self._flew >= self._settled

    def report(self, now: int) -> Report:
        """Return how the drones are."""
        flying = sum(drone.airframe.state is FlightState.FLYING for drone in self._drones.values())
        flying += sum(tello.in_the_air for tello in self._tellos.values())
        clipped = sum(drone.clipped for drone in self._drones.values())
        details = (
            f"{flying} of {len(self._drones) + len(self._tellos)} in flight" if flying else "",
            f"{clipped} commands clipped" if clipped else "",
        )
        return Report("simulating", ", ".join(detail for detail in details if detail))

    def _inject(self, t: float) -> None:
        """Inject the faults that are due at `t` s after the first take-off."""
        while self._faults and self._faults[0].at <= t:
            fault = self._faults.popleft()
            owner = uav(fault.drone)
            airframe = self._tellos[owner] if owner in self._tellos else self._drones[owner].airframe
            if isinstance(fault, AirframeLag):
                airframe.respond(fault.lag, fault.dead_time)
            else:
                airframe.stop()


def make_core(start: Start) -> KinematicsCore:
    """Return the core of all simulated airframes."""
    return KinematicsCore(start.plan.swarm, start.now, start.faults, start.took_off, start.chance.random)
