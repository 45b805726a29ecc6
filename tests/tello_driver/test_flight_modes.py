"""What the driver has its Tello do, state by state."""

from __future__ import annotations

from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND
from flockwire_tello.client import TelloClient
from flockwire_tello.flight_modes import FlightModes
from flockwire_tello.flight_monitor import FlightMonitor
from flockwire_twins.tello.parameters import TelloParameters
from flockwire_twins.tello.tello import SimulatedTello

TENTH = SECOND // 10
STANDING = SimulatedTello(TelloParameters(), 0).state(0)


def begun() -> tuple[FlightModes, FlightMonitor]:
    """Return the flight modes of a driver that starts, and the monitor that takes its Tello's states."""
    monitor = FlightMonitor()
    return FlightModes(TelloClient(), monitor, 0.7), monitor


def test_motors_that_ran_when_the_state_went_silent_are_not_taken_for_stopped() -> None:
    modes, monitor = begun()
    for tenth in range(18):  # low above the ground: the motors' time alone shows that it flies
        monitor.update(STANDING._replace(h=10, tof=15, time=5 + tenth // 10), tenth * TENTH)
        modes.update(0.0, tenth * TENTH)
        if tenth == 12:
            assert modes.state is FlightState.FLYING
            modes.stop(tenth * TENTH)
    for tenth in range(18, 60):
        modes.update(0.0, tenth * TENTH)
        assert modes.state is FlightState.FLYING


def test_a_driver_that_starts_does_not_take_motors_for_stopped_before_it_has_watched_their_time() -> None:
    modes, monitor = begun()
    low = STANDING._replace(h=10, tof=13)
    seen = []
    for tenth in range(30):  # it hovers below the height that a state tells of, and its motors' time has whole seconds
        monitor.update(low._replace(time=5 + tenth // 10), tenth * TENTH)
        modes.update(0.0, tenth * TENTH)
        seen.append(modes.state)
    assert seen == [None] * 10 + [FlightState.FLYING] * 20


def test_a_driver_that_starts_finds_a_drone_on_the_ground_whose_motors_never_ran_at_once_others_later() -> None:
    for time, after in ((0, 1), (5, 17)):
        modes, monitor = begun()
        standing = STANDING._replace(time=time)
        for tenth in range(20):
            monitor.update(standing, tenth * TENTH)
            modes.update(0.0, tenth * TENTH)
            assert modes.state is (FlightState.GROUNDED if tenth >= after - 1 else None)


def test_a_take_off_is_not_taken_for_lost_before_the_motors_are_watched_again_after_a_gap() -> None:
    modes, monitor = begun()
    seen = set()
    for tenth in range(60):
        if tenth < 25 or tenth >= 48:  # then its simulation stood still with it, and goes on
            low = STANDING._replace(h=10, tof=13, time=2 + max(0, tenth - 48) // 10)
            monitor.update(STANDING if tenth < 20 else low, tenth * TENTH)
        modes.update(0.7, tenth * TENTH)
        if tenth >= 20:
            seen.add(modes.state)
    assert seen == {FlightState.FLYING}
