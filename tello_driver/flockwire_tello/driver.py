"""The core of one Tello's driver: messages and datagrams in, messages and datagrams out.

It makes the final decision for its drone: it flies no faster than the limit, hovers and lands without commands, and
stops the motors as soon as a stop arrives. It relies on the drone's state, not on replies.
"""

from __future__ import annotations

from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.order import Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import ZERO, limit, norm, subtract
from flockwire_core.parameters import guard_parameters
from flockwire_core.process.cores import Address, Datagram, Start
from flockwire_core.process.driving import RETIREMENT, SETTLED, TELEMETRY_PERIOD, TOLERANCE
from flockwire_core.process.stepping import next_deadline
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import STOP, Key
from flockwire_core.wire.status import Reason, Report, counted

from flockwire_tello.client import TelloClient
from flockwire_tello.flight_modes import FlightModes, Mode
from flockwire_tello.flight_monitor import FlightMonitor
from flockwire_tello.sticks import CENTRED, StickControl, Sticks
from flockwire_tello.swarm_file import COMMAND_PORT, reached, tello_addresses, tello_keys
from flockwire_tello.tello_link import TelloLink

JUMP = 0.05  # m/s, rad/s: a command that differs by more is sent at once
ON_GROUND = (FlightState.GROUNDED, FlightState.STOPPED, FlightState.HELD)
LIFTED = Reason(
    "ground", "off the ground with stopped motors, held in a hand, or its sensor detects no floor", "put it down"
)
HEADED = (Mode.GROUNDED, Mode.TAKING_OFF, Mode.FLYING)  # for which its heading is valid
BLIND = Reason("pose", "no pose arrives (it flies only up and down)", "check the gateway and its link to this driver")
STOPPING = Reason("stop", "not known to be down after the stop", "keep away from it")


class DriverCore:
    """The driver of drone `number` of `swarm`, started at `now` (Unix ns)."""

    def __init__(self, swarm: Swarm, number: int, now: int) -> None:
        table, at, keys = reached(swarm, number), tello_addresses(swarm, number), tello_keys(swarm.airframe(number))
        self.triggers: frozenset[Key] = frozenset()
        self.prompt = frozenset({STOP, Key("command", uav(number))})
        self.period = 1.0 / keys.rc_rate_hz
        self._frame, self._limits = swarm.frame, swarm.limits
        self._telemetry_key = Key("telemetry", uav(number))
        self._drone: Address = (at.drone, COMMAND_PORT)
        self._own: Address = (at.local, table.command_port)
        self._states: Address = (at.local, table.state_port)
        self._filtered = table.source_filter
        self._began = now
        self._client, self._monitor = TelloClient(), FlightMonitor()
        self._link = TelloLink(self._client, self._monitor, self._drone, table.state_port)
        self._stick_control = StickControl(keys.stick_gains, nanoseconds(swarm.limits.staleness.pose_land))
        self._flight = FlightModes(self._client, self._monitor, slowest_climb(swarm, number))
        self._velocity, self._yaw_rate = ZERO, 0.0
        self._commanded: int | None = None
        self._spacing, self._rc_deadline = nanoseconds(self.period), 0
        self._telemetry_deadline = 0
        self._land_at: int | None = None
        self._down_since: int | None = None
        self._clipped = self._foreign = 0

    @property
    def sockets(self) -> tuple[Address, ...]:
        """The addresses to bind: for commands and for the state."""
        return (self._own, self._states)

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message; a command or a stop is sent at once."""
        t = now - self._began
        match message:
            case Command():
                self._command(message, t)
            case Stop():
                self._telemetry_deadline = 0 if self._flight.mode is not Mode.STOPPED else self._telemetry_deadline
                self._flight.stop(t)
            case Pose():
                self._stick_control.see(message.orientation, t)

    def datagram(self, data: bytes, sender: Address, at: Address, now: int) -> None:
        """Receive a datagram of one of the sockets."""
        t = now - self._began
        if self._filtered and sender[0] != self._drone[0]:
            self._foreign += 1
        elif at == self._states:
            self._client.receive_state(data, t)
            if self._client.state_time == t and self._client.state is not None:
                self._monitor.update(self._client.state, t)
        else:
            self._client.receive(data, t)

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Update link, ladder and sticks; publish telemetry while the drone's state arrives."""
        t = now - self._began
        retired = self._land_at is not None and t >= self._land_at
        self._flight.update(None if retired or self._stale(t) else self._velocity[2], t)
        self._link.step(t)  # after it: an `emergency` replaces all that waits
        if retired or self._silence(t) > self._limits.staleness.command_land:
            self._flight.land(t)
        if t >= self._rc_deadline + self._spacing // 2:
            self._steer(t)
        self._note_down(t)
        return self._telemetry(t, now)

    def outgoing(self, now: int) -> list[Datagram]:
        """Return the datagrams to send at `now`."""
        t = now - self._began
        datagrams, finished = self._client.poll(t)
        for done in finished:
            self._link.ended(done, t)
            self._flight.ended(done, t)
        return [Datagram(data, self._own, self._drone) for data in datagrams]

    def retire(self, now: int) -> None:
        """Land the drone if the pilot does not within RETIREMENT, because the process must end."""
        self._land_at = now - self._began + RETIREMENT

    def may_end(self, now: int) -> bool:
        """Return whether the drone has been on the ground for a second, never sent a state, or is lost."""
        t, since = now - self._began, self._down_since
        if self._monitor.state is None or (since is not None and t - since >= SETTLED):
            return True
        # ns after RETIREMENT at which a drone that is silent in the air counts as lost
        return self._land_at is not None and not self._monitor.heard(t) and t >= self._land_at + 40 * SECOND

    def report(self, now: int) -> Report:
        """Return the drone's status."""
        t = now - self._began
        grounded = self._flight.mode in (Mode.CONNECTING, Mode.GROUNDED)
        reasons = (
            LIFTED if self._flight.mode is Mode.HELD else None,
            *(self._link.named if grounded else ()),
            self._link.trouble(t),
            self._flight.refusal,
            BLIND if self._flight.mode in HEADED and self._stick_control.blind(t) else None,
            STOPPING if self._flight.stopping else None,
            self._monitor.imu_trouble(t) if grounded else None,
        )
        battery = self._monitor.battery if self._monitor.heard(t) else -1.0
        counts = counted(("commands clipped", self._clipped), ("datagrams of others", self._foreign))
        return Report(self._flight.mode, battery=battery, counts=counts, reasons=tuple(filter(None, reasons)))

    def _command(self, message: Command, t: int) -> None:
        velocity = message.velocity
        if norm(velocity) > TOLERANCE * self._limits.speed:
            self._clipped += 1
            velocity = limit(velocity, self._limits.speed)
        jump = norm(subtract(velocity, self._velocity)) > JUMP or abs(message.yaw_rate - self._yaw_rate) > JUMP
        self._velocity, self._yaw_rate, self._commanded = velocity, message.yaw_rate, t
        if jump or t >= self._rc_deadline - self._spacing // 4:
            self._steer(t)

    def _silence(self, t: int) -> float:
        """Return the time since the pilot's last command, s."""
        # ns to learn swarm time after a start in flight: without it no command is obeyed
        since = 3 * SECOND if self._commanded is None else self._commanded
        return max(0, t - since) / SECOND

    def _stale(self, t: int) -> bool:
        """Return whether the newest command is too old to fly."""
        return self._commanded is None or self._silence(t) > self._limits.staleness.command_zero

    def _steer(self, t: int) -> None:
        """Send the sticks: the last command, or centred if it is stale, and while the drone lands."""
        if not self._flight.steered:
            return
        self._rc_deadline = next_deadline(self._rc_deadline, t, self._spacing)
        stale = self._stale(t)
        if stale and self._flight.mode is Mode.CONNECTING and self._commanded is None:
            return
        centred = stale or self._flight.mode is Mode.LANDING
        sticks: Sticks = CENTRED if centred else self._stick_control.sticks(self._velocity, self._yaw_rate, t)
        self._client.send(sticks.command, t)

    def _note_down(self, t: int) -> None:
        if self._flight.state in ON_GROUND and (not self._monitor.airborne(t) or self._monitor.held(t)):
            self._down_since = t if self._down_since is None else self._down_since
            self._stick_control.release()
        else:
            self._down_since = None

    def _telemetry(self, t: int, now: int) -> list[tuple[Key, Message]]:
        state = self._flight.state
        if t < self._telemetry_deadline or state is None or not self._monitor.heard(t):
            return []
        self._telemetry_deadline = next_deadline(self._telemetry_deadline, t, TELEMETRY_PERIOD)
        age, monitor = self._silence(t) if self._commanded is not None else -1.0, self._monitor
        stamp, stopped = now - monitor.silence(t), self._flight.mode is Mode.STOPPED
        telemetry = Telemetry(stamp, self._frame, state, monitor.battery, monitor.height, age, stopped)
        return [(self._telemetry_key, telemetry)]


def slowest_climb(swarm: Swarm, number: int) -> float:
    """Return the slowest, m/s, that the pilot of drone `number` takes off or lands: every limit on its speed counts."""
    limits = swarm.limits
    speed = guard_parameters(swarm, number).fastest if swarm.control.filtered else swarm.full_speed(number)
    return min(limits.vertical_speed, limits.blind_speed, speed)


def make_core(start: Start) -> DriverCore:
    """Return the core of one Tello's driver."""
    return DriverCore(start.plan.swarm, start.drone, start.now)
