"""What the driver has its Tello do, state by state."""

from __future__ import annotations

from flockwire.domain.airframe import FlightState
from flockwire.domain.time import SECOND
from flockwire_tello.client import TelloClient
from flockwire_tello.flight_modes import FlightModes
from flockwire_tello.flight_monitor import FlightMonitor
from flockwire_tello.simulated.parameters import TelloParameters
from flockwire_tello.simulated.tello import SimulatedTello

TENTH = SECOND // 10


def test_motors_that_ran_when_the_state_went_silent_are_not_taken_for_stopped() -> None:
    client, monitor = TelloClient(), FlightMonitor()
    modes = FlightModes(client, monitor, 0.7)
    standing = SimulatedTello(TelloParameters(), 0).state(0)
    for tenth in range(18):  # low above the ground: the motors' time alone shows that it flies
        monitor.update(standing._replace(h=10, tof=15, time=5 + tenth // 10), tenth * TENTH)
        modes.update(0.0, tenth * TENTH)
        if tenth == 12:
            assert modes.state is FlightState.FLYING
            modes.stop(tenth * TENTH)
    for tenth in range(18, 60):
        modes.update(0.0, tenth * TENTH)
        assert modes.state is FlightState.FLYING
