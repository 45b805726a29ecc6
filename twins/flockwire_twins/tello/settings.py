"""The settings of a simulated Tello. Most have only ranges and replies."""

from __future__ import annotations

from typing import Literal

from flockwire_twins.tello.commanded import ERROR, OK, CommandedTello, Handler, Reply, whole

REBOOT = "OK,drone will reboot in 3s\0"  # public logs, NUL included


def speed(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Set the speed of movements, cm/s."""
    (drone.speed,) = whole(texts, (10, 100))
    return OK


def switch(what: Literal["pads", "streaming"], on: bool) -> Handler:
    """Return the handler that starts or stops the search for mission pads, or the video."""

    def handle(drone: CommandedTello, texts: list[str], now: int) -> Reply:
        setattr(drone, what, on)
        return OK

    return handle


def checked(*ranges: tuple[int, int]) -> Handler:
    """Return the handler of a setting with only its ranges simulated."""

    def check(drone: CommandedTello, texts: list[str], now: int) -> Reply:
        whole(texts, *ranges)
        return OK

    return check


def one_of(*values: str) -> Handler:
    """Return the handler of a setting with one of `values`; its effect is not simulated."""
    return lambda drone, texts, now: OK if len(texts) == 1 and texts[0] in values else ERROR


def port(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Set the ports of state and video."""
    state, video = whole(texts, (1025, 65535), (1025, 65535))
    drone.ports = (state, video)
    return OK


def motors(on: bool) -> Handler:
    """Return the handler that runs the motors on the ground, or stops them; `error` in the air."""

    def switch(drone: CommandedTello, texts: list[str], now: int) -> Reply:
        flight = drone.flight
        if flight.flying:
            return ERROR
        (flight.airframe.start if on else flight.airframe.cut)(now)
        return OK

    return switch


def network(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Receive the name and password of a network, and restart."""
    if len(texts) != 2:
        return ERROR
    drone.rebooting = True
    return REBOOT


def reboot(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Restart."""
    drone.rebooting = True
    return OK


def extension(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Reply as the open-source controller does, for lights and distance sensor; nothing else is simulated."""
    match texts:
        case ["led", _, *_]:
            return "led ok"
        case ["mled", _, *_]:
            return "matrix ok"
        case ["tof?"]:
            return "tof 8192"  # nothing in its range
        case ["version?"]:
            return "esp32v1.0.0.0"
    return f"unknown command: {' '.join(['EXT', *texts])[:64]}"
