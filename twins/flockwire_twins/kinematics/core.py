"""The core of all simulated airframes, of any row of the airframe table."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import cast

from flockwire_core.domain.airframe import Command, Telemetry
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.objects import load_object
from flockwire_core.pilot.moving_point import MovingPoint
from flockwire_core.process.cores import Address, Datagram, Start
from flockwire_core.process.driving import RETIREMENT, SETTLED, TELEMETRY_PERIOD, Commanded, Served, SimulatedAirframe
from flockwire_core.process.faults import AirframeFailure, AirframeFault, AirframeLag, FalseHeight, Fault, WindChange
from flockwire_core.process.stepping import next_deadline
from flockwire_core.process.wind import Wind
from flockwire_core.swarm.drones import Wind as WindTable
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import MISSION, STOP, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report

SETTLED_SERVED = 4 * SECOND  # as SETTLED, with time for drivers to detect it by a constant state


class KinematicsCore:
    """All simulated drones of `swarm`, started at `now` (Unix ns), with the `faults` of their airframes.

    A person who carries the leader walks its trajectory after a start order. Airframes with their own driver are served
    at their own addresses; `chance` draws their random values. Faults count from `took_off` (Unix ns), or without it
    from the first climb command.
    """

    def __init__(
        self,
        swarm: Swarm,
        now: int,
        faults: Iterable[Fault] = (),
        took_off: int | None = None,
        chance: Callable[[], float] = lambda: 0.5,
    ) -> None:
        own = [i for i in swarm.simulated if i not in swarm.driven]
        served = [i for i in swarm.simulated if i in swarm.driven]
        self.triggers: frozenset[Key] = frozenset()
        self.prompt = frozenset({STOP, *((MISSION,) if swarm.walking else ()), *(Key("command", uav(i)) for i in own)})
        self.period = 1.0 / swarm.gateway.rate_hz
        self._frame = swarm.frame
        self._airframes: dict[str, SimulatedAirframe] = {
            uav(i): load_object(swarm.row(i).simulated)(swarm, i, now, chance) for i in (*own, *served)
        }
        self._commanded = {uav(i): cast("Commanded", self._airframes[uav(i)]) for i in own}
        self._served = {one.address: one for one in (cast("Served", self._airframes[uav(i)]) for i in served)}
        walk = swarm.leader.trajectory.build()
        self._persons = {Key("truth", uav(i)): MovingPoint(walk, swarm.drone(i).start, now) for i in swarm.walking}
        self._truths = tuple((Key("truth", owner), airframe) for owner, airframe in self._airframes.items())
        self._settled = SETTLED if not served else SETTLED_SERVED
        self._telemetry_deadline = now
        self._flew = 0  # last time with a drone in the air, Unix ns
        self._faults = deque(fault for fault in faults if isinstance(fault, AirframeFault | WindChange))
        self._false_heights: list[FalseHeight] = []  # those that have begun
        self._begin = took_off  # time 0 of faults: the first take-off
        self._usual, self._chance = swarm.wind, chance
        self._winds: list[WindChange] = []  # those that blow: the last one counts
        self._blow(swarm.wind)

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message."""
        match message:
            case Command():
                if self._begin is None and message.velocity[2] > 0.0:
                    self._begin = now
                self._commanded[key.owner].command(message.velocity, now)
            case Mission():
                for person in self._persons.values():
                    person.order(message, now)
            case Stop():
                for airframe in self._commanded.values():
                    airframe.stop()
                self._telemetry_deadline = 0  # the operator waits for the report that the motors are off

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Advance all drones to `now` and publish their positions."""
        if self._begin is not None and (self._faults or self._winds):
            self._inject((now - self._begin) / SECOND)
        messages: list[tuple[Key, Message]] = [
            (key, Pose(now, self._frame, person.advance(now))) for key, person in self._persons.items()
        ]
        frame = self._frame
        for key, airframe in self._truths:
            airframe.advance(now)
            if airframe.in_the_air:
                self._flew = now
                self._begin = now if self._begin is None else self._begin
            messages.append((key, Pose(now, frame, airframe.position, airframe.orientation)))
        if now >= self._telemetry_deadline:
            self._telemetry_deadline = next_deadline(self._telemetry_deadline, now, TELEMETRY_PERIOD)
            for owner, commanded in self._commanded.items():
                messages.append((Key("telemetry", owner), self._reported(commanded.telemetry(now, frame), owner)))
        return messages

    def retire(self, now: int) -> None:
        """Land drones that still fly after RETIREMENT s, because the process must end."""
        for airframe in self._commanded.values():
            airframe.land_at = now + RETIREMENT

    @property
    def sockets(self) -> tuple[Address, ...]:
        """The addresses to bind: those of the served airframes."""
        return tuple(self._served)

    def datagram(self, data: bytes, sender: Address, at: Address, now: int) -> None:
        """Receive a datagram for the airframe at the address `at`."""
        self._served[at].datagram(data, sender, now)

    def outgoing(self, now: int) -> list[Datagram]:
        """Return the datagrams of the served airframes."""
        return [datagram for airframe in self._served.values() for datagram in airframe.outgoing(now)]

    def may_end(self, now: int) -> bool:
        """Return whether every drone has stood on the ground for a second."""
        # Checked now: this process may have been frozen since its last step.
        flying = any(airframe.in_the_air for airframe in self._airframes.values())
        return not flying and now - self._flew >= self._settled

    def report(self, now: int) -> Report:
        """Return the status of the drones."""
        flying = sum(airframe.in_the_air for airframe in self._airframes.values())
        clipped = sum(airframe.clipped for airframe in self._commanded.values())
        details = (
            f"{flying} of {len(self._airframes)} in flight" if flying else "",
            f"{clipped} commands clipped" if clipped else "",
        )
        return Report(Phase.SIMULATING, ", ".join(detail for detail in details if detail))

    def _inject(self, t: float) -> None:
        """Inject the faults that are due at `t` s after the first take-off."""
        before = self._winds
        self._winds = [wind for wind in before if t < wind.at + wind.duration]
        while self._faults and self._faults[0].at <= t:
            fault = self._faults.popleft()
            match fault:
                case WindChange():
                    self._winds.append(fault)
                case AirframeLag():
                    self._airframes[uav(fault.drone)].respond(fault.lag, fault.dead_time)
                case AirframeFailure():
                    self._airframes[uav(fault.drone)].stop()
                case FalseHeight():
                    self._false_heights.append(fault)
        if self._winds[-1:] != before[-1:]:
            self._blow(self._winds[-1] if self._winds else self._usual)

    def _blow(self, usual: WindTable | WindChange) -> None:
        for airframe in self._airframes.values():
            airframe.blow(Wind(usual.velocity, usual.gust, self._chance))

    def _reported(self, telemetry: Telemetry, owner: str) -> Telemetry:
        """Return the telemetry of drone `owner` with the false heights of the present moment."""
        for fault in self._false_heights:
            if uav(fault.drone) == owner and telemetry.stamp <= (self._begin or 0) + nanoseconds(
                fault.at + fault.duration
            ):
                telemetry = telemetry._replace(height=telemetry.height + fault.offset)
        return telemetry


def make_core(start: Start) -> KinematicsCore:
    """Return the core of all simulated airframes."""
    return KinematicsCore(start.plan.swarm, start.now, start.faults, start.took_off, start.chance.random)
