"""The commands of a simulated Tello, of SDK 1.3, 2.0 and 3.0: a later SDK's are unknown to an earlier drone.

Most settings have only ranges and replies.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Literal

from flockwire_tello.commands import word
from flockwire_tello.state_string import TelloState

from flockwire_twins.tello import movements
from flockwire_twins.tello.commanded import ERROR, OK, CommandedTello, Handler, RefusedError, Reply, whole
from flockwire_twins.tello.parameters import Quirk

REBOOT = "OK,drone will reboot in 3s\0"  # public logs, NUL included


def set_speed(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Set the speed of movements, cm/s."""
    (drone.speed,) = whole(texts, (10, 100))
    return OK


def switch(what: Literal["pads", "streaming", "rebooting"], on: bool) -> Handler:
    """Return the handler that starts or stops the search for mission pads, or the video, or restarts the drone."""

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


def set_port(drone: CommandedTello, texts: list[str], now: int) -> Reply:
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
    drone.rebooting = len(texts) == 2
    return REBOOT if drone.rebooting else ERROR


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


def answer(drone: CommandedTello, text: str, now: int) -> Reply:
    """Execute the command `text` at `now` (ns); return the reply, with its end of line if it has one."""
    since, handler = _COMMANDS.get(word(text), ("", None))
    if handler is None or since > drone.parameters.generation:
        return f"unknown command: {text[:64]}"
    try:
        return handler(drone, text.split()[1:], now)
    except RefusedError as refusal:
        return str(refusal)


_COMMANDS: Final[dict[str, tuple[str, Handler]]] = {  # first SDK with it, handler
    "command": ("1.3", fixed_reply(OK)),
    "takeoff": ("1.3", movements.take_off),
    "land": ("1.3", movements.land),
    "emergency": ("1.3", movements.emergency),
    "stop": ("1.3", movements.stop),
    "rc": ("1.3", movements.rc),
    **{name: ("1.3", movements.direction(axis)) for name, axis in movements.DIRECTIONS.items()},
    "cw": ("1.3", movements.turn(1)),
    "ccw": ("1.3", movements.turn(-1)),
    "flip": ("1.3", movements.flip),
    "go": ("1.3", movements.go),
    "curve": ("1.3", movements.curve),
    "jump": ("2.0", fixed_reply("error No valid marker")),
    "speed": ("1.3", set_speed),
    "streamon": ("1.3", switch("streaming", True)),
    "streamoff": ("1.3", switch("streaming", False)),
    "wifi": ("1.3", network),
    "ap": ("2.0", network),
    "mon": ("2.0", switch("pads", True)),
    "moff": ("2.0", switch("pads", False)),
    "mdirection": ("2.0", checked((0, 2))),
    "keepalive": ("2.0", fixed_reply(OK)),
    "motoron": ("3.0", motors(True)),
    "motoroff": ("3.0", motors(False)),
    "throwfly": ("3.0", movements.take_off),  # as from the ground; a throw is not simulated
    "reboot": ("3.0", switch("rebooting", True)),
    "port": ("3.0", set_port),
    "wifisetchannel": ("3.0", checked((1, 14))),
    "multiwifi": ("3.0", network),
    "setfps": ("3.0", one_of("high", "middle", "low")),
    "setbitrate": ("3.0", checked((0, 5))),
    "setresolution": ("3.0", one_of("high", "low")),
    "downvision": ("3.0", checked((0, 1))),
    "EXT": ("3.0", extension),
    "battery?": ("1.3", of_state(lambda state: str(state.bat))),
    "speed?": ("1.3", reading(speed)),
    "time?": ("1.3", reading(motor_time)),
    "height?": ("1.3", of_state(lambda state: f"{state.h // 10}dm")),
    "temp?": ("1.3", of_state(lambda state: f"{state.templ}~{state.temph}C")),
    "attitude?": ("1.3", of_state(lambda state: f"pitch:{state.pitch};roll:{state.roll};yaw:{state.yaw};")),
    "baro?": ("1.3", of_state(lambda state: f"{state.baro:.2f}")),
    "acceleration?": ("1.3", of_state(lambda state: f"agx:{state.agx:.2f};agy:{state.agy:.2f};agz:{state.agz:.2f};")),
    "tof?": ("1.3", of_state(lambda state: f"{10 * state.tof}mm")),
    "wifi?": ("1.3", fixed_reply(f"{SIGNAL}\r\n")),
    "sdk?": ("2.0", lambda drone, texts, now: drone.parameters.generation.replace(".", "")),
    "sn?": ("2.0", lambda drone, texts, now: drone.parameters.serial),
    "active?": (
        "3.0",
        lambda drone, texts, now: "inactive" if drone.has(Quirk.NOT_ACTIVATED) else "active",
    ),  # assumption
    "hardware?": ("3.0", fixed_reply("RMTT")),
    "wifiversion?": ("3.0", fixed_reply("wifiv1.0.0.0")),
    "ap?": ("3.0", fixed_reply("simulated simulated")),
    "ssid?": ("3.0", fixed_reply("RMTT-SIMULATED")),
}
