"""A simulated Tello as the airframe of one drone in a swarm: its protocol and its true motion."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin

from flockwire_core.domain.pose import Quaternion
from flockwire_core.process.cores import Address, Datagram
from flockwire_core.process.driving import CONTACT, FROZEN
from flockwire_core.swarm.model import Swarm
from flockwire_tello.swarm_file import COMMAND_PORT, StickGains, reached, tello_addresses, tello_keys

from flockwire_twins.tello.parameters import TelloParameters
from flockwire_twins.tello.tello import SimulatedTello
from flockwire_twins.wind import Wind


class ServedTello:
    """Drone `number` of `swarm`, which stands at its start at `now` (Unix ns); `chance` draws from [0, 1)."""

    def __init__(self, swarm: Swarm, number: int, now: int, chance: Callable[[], float]) -> None:
        self.address: Address = (tello_addresses(swarm, number).drone, COMMAND_PORT)
        self._last = now
        self._tello = SimulatedTello(parameters_of(swarm, number), 0, chance)
        self._now = 0
        self._show()
        self._ground = swarm.drone(number).start[2]

    @property
    def airframe(self) -> ServedTello:
        """What flies: its motion is that of the last `advance`."""
        return self

    @property
    def in_the_air(self) -> bool:
        """Whether it flies, lands or falls."""
        return self._tello.flight.flying or self.position[2] > self._ground + CONTACT

    def _time(self, now: int) -> int:
        """Return the drone's time at `now`; a step over FROZEN is a pause of the process, not flown."""
        elapsed, self._last = now - self._last, now
        return self._now + (elapsed if elapsed <= FROZEN else 0)

    def advance(self, now: int) -> None:
        """Advance to `now`."""
        self._now = self._time(now)
        self._tello.advance(self._now)
        self._show()

    def _show(self) -> None:
        """Show its position, and its heading without tilt."""
        motion = self._tello.flight.airframe.motion(self._now)
        self.position = motion.position
        self.orientation: Quaternion = (0.0, 0.0, sin(motion.yaw / 2.0), cos(motion.yaw / 2.0))

    def datagram(self, data: bytes, sender: Address, now: int) -> None:
        """Receive a datagram from its client."""
        self._now = self._time(now)
        self._tello.receive(data, sender, self._now)

    def outgoing(self, now: int) -> list[Datagram]:
        """Return the datagrams that it sends up to `now`."""
        self._now = self._time(now)
        return [Datagram(data, self.address, target) for data, target in self._tello.outgoing(self._now)]

    def stop(self) -> None:
        """Stop the motors: in flight it falls."""
        self._tello.flight.cut(self._now)

    def respond(self, lag: float, dead_time: float) -> None:
        """Set lag and dead time, s."""
        self._tello.flight.airframe.respond(lag, dead_time)

    def blow(self, wind: Wind) -> None:
        """Set the wind."""
        self._tello.flight.airframe.blow(wind)


def parameters_of(swarm: Swarm, number: int) -> TelloParameters:
    """Return the parameters of the simulated Tello of drone `number`; `gain` is flown over commanded speed."""
    drone, airframe = swarm.drone(number), swarm.airframe(number)
    gains = {stick: worth * airframe.gain for stick, worth in tello_keys(airframe).stick_gains}
    return TelloParameters(
        position=drone.start,
        yaw=drone.heading,
        gains=StickGains(**gains),
        lag=airframe.lag,
        dead_time=airframe.dead_time,
        endurance=airframe.endurance,
        state_port=reached(swarm, number).state_port,
        serial=f"0TQZSIMULATED{number}",
    )
