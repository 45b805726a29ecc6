"""The queries of a simulated Tello, with replies in a real one's units and ends of line."""

from __future__ import annotations

from collections.abc import Callable

from flockwire_tello.simulated.commanded import CommandedTello, Handler
from flockwire_tello.state_string import TelloState

SIGNAL = "90"  # signal to noise of the Wi-Fi


def reading(read: Callable[[CommandedTello, int], str]) -> Handler:
    """Return the handler of a query for a number, which ends in CR LF."""
    return lambda drone, texts, now: f"{read(drone, now)}\r\n"


def fixed_reply(text: str) -> Handler:
    """Return the handler that always replies `text`."""
    return lambda drone, texts, now: text


def of_state(form: Callable[[TelloState], str]) -> Handler:
    """Return the handler of a query for a field of the state."""
    return lambda drone, texts, now: f"{form(drone.flight.state(now))}\r\n"


def speed(drone: CommandedTello, now: int) -> str:
    """Return the speed of movements, cm/s; a Tello adds a decimal."""
    return f"{drone.speed:.1f}" if drone.parameters.generation == "1.3" else str(drone.speed)


def motor_time(drone: CommandedTello, now: int) -> str:
    """Return the time of the motors, s; a Tello adds the unit, an EDU does not: public clients read it so."""
    return f"{int(drone.flight.motor_time)}{'s' if drone.parameters.generation == '1.3' else ''}"
