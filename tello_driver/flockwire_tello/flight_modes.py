"""What the driver has its Tello do: take-off, flight, landing, as the drone's state and its pilot's commands have it.

connecting -> grounded -> taking off -> flying -> landing -> grounded;  stop -> stopped
A driver that was started in flight goes from connecting to flying.
"""

from __future__ import annotations

from enum import StrEnum

from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import FlightState

from flockwire_tello.client import CommandOutcome, Finished, TelloClient
from flockwire_tello.flight_monitor import FlightMonitor

RISE = 0.2  # m/s up, at most, above which a command means to take off; down, near the ground, to land
SHARE = 0.5  # of a slow pilot's climb that means so too: 1/sqrt(2) is left where it has to go as far across
MEANT = 3 * BILLION // 10  # ns that it must have meant so
LANDING_HEIGHT = 0.45  # m under which `land` does what sticks cannot
NO_TAKEOFF = 3 * BILLION  # ns after `takeoff` without motors: its datagram was lost
TAKEN_OFF = 6 * BILLION  # ns after `takeoff` that it flies though the reply was lost
LAND_AGAIN = 12 * BILLION
EMERGENCY_FOR = BILLION  # ns for which `emergency` is sent at every update, whatever the state shows
EMERGENCY_AGAIN = BILLION // 10  # ns from one to the next after that, until the state shows it down


class Mode(StrEnum):
    """What the driver has its drone do."""

    CONNECTING = "connecting"
    GROUNDED = "grounded"
    TAKING_OFF = "taking off"
    FLYING = "flying"
    LANDING = "landing"
    STOPPED = "stopped"


_STATES = {
    Mode.GROUNDED: FlightState.GROUNDED,
    Mode.TAKING_OFF: FlightState.FLYING,  # from the order on: it may leave the ground at any moment
    Mode.FLYING: FlightState.FLYING,
    Mode.LANDING: FlightState.LANDING,
    Mode.STOPPED: FlightState.STOPPED,
}


class FlightModes:
    """Sends `takeoff`, `land` and `emergency` with `client`. Times are ns of one clock that does not go back.

    `climb` is the slowest that its pilot takes off or lands, m/s.
    """

    def __init__(self, client: TelloClient, monitor: FlightMonitor, climb: float) -> None:
        self.mode = Mode.CONNECTING
        self.refusal = ""  # why it did not take off
        self._client, self._monitor, self._rise = client, monitor, min(RISE, SHARE * climb)
        self._since = 0  # of the mode
        self._meant_since: int | None = None
        self._refused = False  # no further `takeoff` before the pilot has stopped wanting it
        self._down = False  # after a stop: whether it is known to be down
        self._emergency_at = 0  # when `emergency` is sent again

    @property
    def steered(self) -> bool:
        """Whether sticks are sent: also while it is not known yet whether it flies. On the ground they do nothing."""
        return self.mode in (Mode.FLYING, Mode.CONNECTING)

    @property
    def state(self) -> FlightState | None:
        """What the telemetry reports, None while nothing is known."""
        return FlightState.FLYING if self.stopping else _STATES.get(self.mode)

    @property
    def stopping(self) -> bool:
        """Whether a stop was ordered, and no state has shown the drone down since."""
        return self.mode is Mode.STOPPED and not self._down

    def update(self, climb: float, now: int) -> None:
        """Go to the mode that follows; the pilot wants to climb at `climb` m/s."""
        if self.mode is Mode.STOPPED:
            self._keep_stopping(now)
        elif self._monitor.heard(now):
            self._follow(self._meaning(climb, now), self._monitor.airborne(now), now)

    def land(self, now: int) -> None:
        """Land, if it flies. A landing is not taken back."""
        if self.mode in (Mode.FLYING, Mode.TAKING_OFF):
            self._go(Mode.LANDING, now)
            self._client.send("land", now)

    def stop(self, now: int) -> None:
        """Turn the motors off, for good."""
        self._client.send("emergency", now)
        self._emergency_at = now + EMERGENCY_AGAIN
        if self.mode is not Mode.STOPPED:
            self._down = self.mode is Mode.GROUNDED
            self._go(Mode.STOPPED, now)

    def ended(self, done: Finished, now: int) -> None:
        """Take note of a command that ended."""
        if done.command != "takeoff" or self.mode is not Mode.TAKING_OFF:
            return
        airborne = self._monitor.airborne(now)
        if airborne and done.outcome is not CommandOutcome.SUPERSEDED:
            self._go(Mode.FLYING, now)
        elif done.outcome is CommandOutcome.REFUSED:
            self._go(Mode.GROUNDED, now)
            self._refused = True
            self.refusal = f"take-off refused ({done.reply}): battery low, propellers, or never activated by the app"

    def _keep_stopping(self, now: int) -> None:
        """Repeat `emergency`, which has no reply, until the state shows it down; silence shows nothing."""
        lasted, seen = now - self._since, now - self._monitor.silence(now)
        if lasted >= EMERGENCY_FOR and self._monitor.heard(now):
            self._down = not self._monitor.airborne(seen)
        if lasted < EMERGENCY_FOR or (not self._down and now >= self._emergency_at):
            self.stop(now)

    def _meaning(self, climb: float, now: int) -> bool:
        """Return whether the pilot has meant to leave the ground, or to reach it, for MEANT."""
        wants = climb > self._rise if self.mode is Mode.GROUNDED else climb < -self._rise
        self._meant_since = (now if self._meant_since is None else self._meant_since) if wants else None
        if climb <= 0.0:
            self._refused = False
        return self._meant_since is not None and now - self._meant_since >= MEANT

    def _follow(self, meant: bool, airborne: bool, now: int) -> None:
        lasted = now - self._since
        match self.mode:
            case Mode.CONNECTING:
                self._go(Mode.FLYING if airborne else Mode.GROUNDED, now)
            case Mode.GROUNDED if airborne:
                self._go(Mode.FLYING, now)
            case Mode.GROUNDED if meant and not self._refused:
                self._go(Mode.TAKING_OFF, now)
                self.refusal = ""
                self._client.send("takeoff", now)
            case Mode.TAKING_OFF if airborne and lasted > TAKEN_OFF:
                self._go(Mode.FLYING, now)
            case Mode.TAKING_OFF if not airborne and lasted > NO_TAKEOFF:
                self._go(Mode.GROUNDED, now)
                self._client.give_up("takeoff", now)
            case Mode.FLYING | Mode.LANDING if not airborne:
                self._go(Mode.GROUNDED, now)
            case Mode.FLYING if meant and self._monitor.height <= LANDING_HEIGHT:
                self.land(now)
            case Mode.LANDING if lasted > LAND_AGAIN:
                self._go(Mode.LANDING, now)
                self._client.send("land", now)

    def _go(self, mode: Mode, now: int) -> None:
        self.mode, self._since, self._meant_since = mode, now, None
