"""The flight modes of a Tello: take-off, flight, landing, from the drone's state and its pilot's commands.

    connecting -> grounded -> taking off -> flying -> landing -> grounded;   stop -> stopped

A driver that starts in flight goes from connecting to flying. A drone off the ground with stopped motors is held in a
hand, and goes back to grounded.
"""

from __future__ import annotations

from enum import StrEnum

from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.status import Reason

from flockwire_tello.client import CommandOutcome, Finished, TelloClient
from flockwire_tello.flight_monitor import FlightMonitor
from flockwire_tello.sticks import CENTRED

RISE = 0.2  # m/s, largest threshold of a climb command for take-off and, near the ground, of a descent for landing
SHARE = 0.5  # of a slow pilot's climb, which is enough too: 1/sqrt(2) remains if it moves as fast sideways
MEANT = 3 * SECOND // 10  # ns for which the command must last
LAND_AGAIN = SECOND // 2  # ns without a descent after which `land` is repeated
SETTLING = 2 * SECOND  # ns until a drone on the ground shows that its motors have stopped
EMERGENCY_FOR = SECOND  # ns for which `emergency` is sent at every update, for any state


class Mode(StrEnum):
    """The mode of the driver."""

    CONNECTING = "connecting"
    GROUNDED = "grounded"
    HELD = "held"
    TAKING_OFF = "taking off"
    FLYING = "flying"
    LANDING = "landing"
    STOPPED = "stopped"


_STATES = {
    Mode.GROUNDED: FlightState.GROUNDED,
    Mode.HELD: FlightState.HELD,
    Mode.TAKING_OFF: FlightState.FLYING,  # from the order on: it may leave the ground at any moment
    Mode.FLYING: FlightState.FLYING,
    Mode.LANDING: FlightState.LANDING,
    Mode.STOPPED: FlightState.STOPPED,
}


class FlightModes:
    """Sends `takeoff`, `land` and `emergency` with `client`. Times are ns of one clock that does not go back.

    `climb` is its pilot's slowest take-off or landing, m/s.
    """

    def __init__(self, client: TelloClient, monitor: FlightMonitor, climb: float) -> None:
        self.mode = Mode.CONNECTING
        self.refusal: Reason | None = None  # why it did not take off
        self._client, self._monitor, self._rise = client, monitor, min(RISE, SHARE * climb)
        self._since = 0  # of the mode
        self._found = False  # it was in the air without a take-off by this driver
        self._meant_since: int | None = None
        self._held_down = False  # refused, landed or held: no `takeoff` before the pilot stops commanding it
        self._height, self._height_at = 0.0, 0  # in a landing, the last time of its start or of a descent
        self._sinks = self._accepted = False  # a descent, or the reply, shows that it obeys
        self._down = False  # after a stop: whether it is known to be down
        self._emergency_at = 0  # next time of `emergency`

    @property
    def steered(self) -> bool:
        """Whether sticks are sent: also while it is unknown whether it flies, and until it descends to land.

        On the ground they have no effect.
        """
        return self.mode in (Mode.FLYING, Mode.CONNECTING) or (self.mode is Mode.LANDING and not self._sinks)

    @property
    def state(self) -> FlightState | None:
        """The state for telemetry, None while unknown."""
        return FlightState.FLYING if self.stopping else _STATES.get(self.mode)

    @property
    def stopping(self) -> bool:
        """Whether a stop was ordered, and no state has shown the drone down since."""
        return self.mode is Mode.STOPPED and not self._down

    def update(self, climb: float | None, now: int) -> None:
        """Go to the next mode; the pilot commands a climb of `climb` m/s, None: it is silent."""
        if self.mode is Mode.STOPPED:
            self._keep_stopping(now)
        elif self._monitor.heard(now):
            self._follow(self._meaning(climb, now), now)

    def land(self, now: int) -> None:
        """Land, if it flies. A landing is not cancelled; a climb commanded all the time causes no new take-off."""
        if self.mode in (Mode.FLYING, Mode.TAKING_OFF):
            self._go(Mode.LANDING, now)
            self._held_down = True
            self._height, self._height_at = self._monitor.height, now
            self._sinks = self._accepted = False
            self._send_land(now)

    def stop(self, now: int) -> None:
        """Stop the motors permanently."""
        self._client.send("emergency", now)
        self._emergency_at = now + SECOND // 10  # ns between two after that, until the state shows it down
        if self.mode is not Mode.STOPPED:
            self._down = self.mode in (Mode.GROUNDED, Mode.HELD)
            self._go(Mode.STOPPED, now)

    def ended(self, done: Finished, now: int) -> None:
        """Record a command that ended."""
        if done.command == "land" and self.mode is Mode.LANDING:
            self._accepted = done.outcome is CommandOutcome.DONE
            if not self._accepted:
                self._send_land(now)
        if done.command != "takeoff" or self.mode is not Mode.TAKING_OFF:
            return
        airborne = self._monitor.airborne(now)
        if airborne and done.outcome is not CommandOutcome.SUPERSEDED:
            self._go(Mode.FLYING, now)
        elif done.outcome is CommandOutcome.REFUSED:
            self._go(Mode.GROUNDED, now)
            self._held_down = True
            why = "battery low, propellers, or never activated by the app"
            self.refusal = Reason("take-off", f"take-off refused ({done.reply})", why)

    def _keep_stopping(self, now: int) -> None:
        """Repeat `emergency`, which has no reply, until the state shows it down."""
        lasted, seen = now - self._since, now - self._monitor.silence(now)
        if lasted >= EMERGENCY_FOR and self._monitor.heard(now):
            self._down = self._monitor.down(seen) or self._monitor.held(seen)
        if lasted < EMERGENCY_FOR or (not self._down and now >= self._emergency_at):
            self.stop(now)

    def _meaning(self, climb: float | None, now: int) -> bool:
        """Return whether the pilot has commanded to take off, or to land, for MEANT."""
        if climb is None:
            self._meant_since = None
            return False
        grounded = self.mode is Mode.GROUNDED
        wants = climb > self._rise if grounded else climb < -self._rise
        self._meant_since = (now if self._meant_since is None else self._meant_since) if wants else None
        if grounded and climb <= 0.0:
            self._held_down = False
        return self._meant_since is not None and now - self._meant_since >= MEANT

    def _follow(self, meant: bool, now: int) -> None:
        if self.mode in (Mode.FLYING, Mode.LANDING):
            self._follow_in_flight(meant, now)
        else:
            self._follow_on_ground(meant, now)

    def _follow_on_ground(self, meant: bool, now: int) -> None:
        lasted, airborne = now - self._since, self._monitor.airborne(now)
        match self.mode:
            case Mode.CONNECTING | Mode.GROUNDED | Mode.HELD if airborne:
                self._find(now)
            case Mode.CONNECTING | Mode.HELD if self._monitor.down(now):
                self._go(Mode.GROUNDED, now)
            case Mode.GROUNDED if meant and not self._held_down:
                self._go(Mode.TAKING_OFF, now)
                self._found, self.refusal = False, None
                self._client.send("takeoff", now)
            case Mode.TAKING_OFF if airborne and lasted > 6 * SECOND:  # the reply was lost
                self._go(Mode.FLYING, now)
            case Mode.TAKING_OFF if lasted > 3 * SECOND and self._monitor.down(now):  # its datagram was lost
                self._go(Mode.GROUNDED, now)
                self._client.give_up("takeoff", now)

    def _follow_in_flight(self, meant: bool, now: int) -> None:
        match self.mode:
            case Mode.FLYING if self._found and self._monitor.airborne(now) and self._monitor.held(now):
                self._find(now)
            case Mode.FLYING | Mode.LANDING if self._monitor.down(now):
                self._go(Mode.GROUNDED, now)
            case Mode.FLYING if meant and self._monitor.height <= 0.45:  # m below which `land` is needed
                self.land(now)
            case Mode.LANDING:
                self._keep_landing(now)

    def _find(self, now: int) -> None:
        """Record that it is off the ground without a take-off by this driver: it flies, or is held in a hand."""
        self._found = True
        mode = Mode.HELD if self._monitor.held(now) else Mode.FLYING
        self._held_down = self._held_down or mode is Mode.HELD
        if mode is not self.mode:
            self._go(mode, now)

    def _keep_landing(self, now: int) -> None:
        """Repeat `land` until the state shows a descent, and again if the descent ends above the ground."""
        height, low = self._monitor.height, self._accepted and not self._monitor.off_the_ground
        if height < self._height - 0.05:  # m of height loss that is a descent; the height has steps of 0.1
            self._height, self._height_at, self._sinks = height, now, True
            self._client.cease("land", now)
        elif now - self._height_at >= (SETTLING if low else LAND_AGAIN):
            self._height, self._height_at, self._sinks = height, now, False
            self._send_land(now)

    def _send_land(self, now: int) -> None:
        """Land with the sticks centred: a Tello keeps its last values."""
        self._client.send(CENTRED.command, now)
        self._client.send("land", now)

    def _go(self, mode: Mode, now: int) -> None:
        self.mode, self._since, self._meant_since = mode, now, None
