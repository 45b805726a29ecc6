"""The core of all simulated airframes, of any row of the airframe table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from flockwire_core.domain.airframe import Command
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.objects import load_object
from flockwire_core.pilot.moving_point import MovingPoint
from flockwire_core.process.cores import Address, Datagram, Start
from flockwire_core.process.driving import RETIREMENT, SETTLED, TELEMETRY_PERIOD
from flockwire_core.process.stepping import next_deadline
from flockwire_core.swarm.drones import Wind as WindTable
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.trajectories import trajectory_of
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import MISSION, STOP, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import MOTORS_OFF, Reason, Report

from flockwire_twins.simulated_airframe import Commanded, Served, SimulatedAirframe, Wear
from flockwire_twins.wind import Wind


class AirframeConditions(NamedTuple):
    """What may change in a flight: the `wind`, lag and dead time (s) of airframes, failed motors, wear; by drone."""

    wind: WindTable
    responses: Mapping[str, tuple[float, float]]
    failed: frozenset[str]
    worn: Mapping[str, Wear] = {}


class KinematicsCore:
    """All simulated drones of `swarm`, started at `now` (Unix ns).

    A person who carries a leader walks its trajectory after a start order. Airframes with their own driver are served
    at their own addresses; `chance` draws their random values.
    """

    def __init__(self, swarm: Swarm, now: int, chance: Callable[[], float] = lambda: 0.5) -> None:
        simulated, driven = set(swarm.simulated), set(swarm.driven)
        self._commanded: dict[str, Commanded] = _stand(swarm, simulated - driven, now, chance)
        served: dict[str, Served] = _stand(swarm, simulated & driven, now, chance)
        self._airframes: dict[str, SimulatedAirframe] = {**self._commanded, **served}
        self._served = {one.address: one for one in served.values()}
        self.triggers: frozenset[Key] = frozenset()
        commands = (Key("command", owner) for owner in self._commanded)
        self.prompt = frozenset({STOP, *((MISSION,) if swarm.walking else ()), *commands})
        self.period = 1.0 / swarm.gateway.rate_hz
        self._frame = swarm.frame
        self._persons = {
            Key("truth", uav(i)): MovingPoint(trajectory_of(swarm.leading[i]), swarm.drone(i).start)
            for i in swarm.walking
        }
        self._truths = tuple((Key("truth", owner), airframe) for owner, airframe in self._airframes.items())
        # as SETTLED, with time for drivers to detect it by a constant state
        self._settled = SETTLED if not served else 4 * SECOND
        self._telemetry_deadline = now
        self._flew = 0  # last time with a drone in the air, Unix ns
        self._chance = chance
        self._conditions = AirframeConditions(swarm.wind, {}, frozenset())
        self._blow(swarm.wind)

    @property
    def flies(self) -> bool:
        """Whether any airframe is in the air; faults of driven ones count from then on (faults/faulty_core.py)."""
        return any(airframe.in_the_air for airframe in self._airframes.values())

    @property
    def conditions(self) -> AirframeConditions:
        """The present conditions of the airframes."""
        return self._conditions

    @conditions.setter
    def conditions(self, new: AirframeConditions) -> None:
        before, self._conditions = self._conditions, new
        for owner, (lag, dead_time) in new.responses.items():
            if before.responses.get(owner) != (lag, dead_time):
                self._airframes[owner].airframe.respond(lag, dead_time)
        for owner in {*new.worn, *before.worn} if new.worn != before.worn else ():
            self._commanded[owner].airframe.wear(new.worn.get(owner, Wear()))
        for owner in new.failed - before.failed:
            self._airframes[owner].airframe.stop()
        if new.wind != before.wind:
            self._blow(new.wind)

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message."""
        match message:
            case Command():
                self._commanded[key.owner].command(message.velocity, now, message.yaw_rate, message.acceleration)
            case Mission():
                for person in self._persons.values():
                    person.order(message, now)
            case Stop():
                for commanded in self._commanded.values():
                    commanded.airframe.stop()
                self._telemetry_deadline = 0  # the operator waits for the report that the motors are off

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Advance all drones to `now` and publish their positions."""
        messages: list[tuple[Key, Message]] = [
            (key, Pose(now, self._frame, person.advance(now))) for key, person in self._persons.items()
        ]
        frame = self._frame
        for key, one in self._truths:
            one.advance(now)
            if one.in_the_air:
                self._flew = now
            messages.append((key, Pose(now, frame, one.airframe.position, one.airframe.orientation)))
        if now >= self._telemetry_deadline:
            self._telemetry_deadline = next_deadline(self._telemetry_deadline, now, TELEMETRY_PERIOD)
            for owner, commanded in self._commanded.items():
                messages.append((Key("telemetry", owner), commanded.telemetry(now, frame)))
        return messages

    def retire(self, now: int) -> None:
        """Land drones that still fly after RETIREMENT s, because the process must end."""
        for commanded in self._commanded.values():
            commanded.land_at = now + RETIREMENT

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
        return not self.flies and now - self._flew >= self._settled

    def report(self, now: int) -> Report:
        """Return the status of the drones."""
        flying = sum(airframe.in_the_air for airframe in self._airframes.values())
        clipped = sum(airframe.clipped for airframe in self._commanded.values())
        details = (
            f"{flying} of {len(self._airframes)} in flight" if flying else "",
            f"{clipped} commands clipped" if clipped else "",
            *(f"{owner}: {remark}" for owner, one in self._commanded.items() if (remark := one.airframe.remark)),
        )
        failed = [
            Reason(MOTORS_OFF, f"{owner} {failure}")
            for owner, one in self._commanded.items()
            if (failure := one.airframe.failure)
        ]
        return Report(Phase.SIMULATING, ", ".join(detail for detail in details if detail), reasons=tuple(failed))

    def _blow(self, wind: WindTable) -> None:
        for one in self._airframes.values():
            one.airframe.blow(Wind(wind.velocity, wind.gust, self._chance))


def _stand(swarm: Swarm, numbers: Iterable[int], now: int, chance: Callable[[], float]) -> dict[str, Any]:
    """Return the airframes of drones at their starts, by owner."""
    return {uav(i): load_object(swarm.row(i).simulated)(swarm, i, now, chance) for i in sorted(numbers)}


def make_core(start: Start) -> KinematicsCore:
    """Return the core of all simulated airframes."""
    return KinematicsCore(start.plan.swarm, start.now, start.chance.random)
