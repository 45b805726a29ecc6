"""The state string that a Tello sends ten times a second: parsed and formatted.

Three generations: SDK 1.3; EDU (SDK 2.0), which puts the mission pad in front; SDK 3.0, whose guide ends at `baro`.
Source: the user guides' section "Tello State". Fields that no guide has are ignored; a string is malformed if a known
field is not a number or a field of all generations is missing.
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple

LONGEST = 2048  # bytes of a datagram, a longer one is malformed
PADS_OFF = -2  # `mid` while mission pads are not looked for
NO_PAD = -1  # `mid` while none is seen


class MissionPad(NamedTuple):
    """The drone's position relative to a mission pad: number, cm, and the pad's attitude in degrees."""

    mid: int
    x: int
    y: int
    z: int
    mpry: tuple[int, int, int]


class TelloState(NamedTuple):
    """One state string, in the drone's own names and units."""

    pitch: int  # degrees, nose up
    roll: int  # degrees, right side down
    yaw: int  # degrees, clockwise, from the heading at power-on
    vgx: int  # dm/s by user reports; no guide has unit or sign: not for control
    vgy: int
    vgz: int
    templ: int  # degrees C, lowest
    temph: int  # degrees C, highest
    tof: int  # cm above the surface below
    h: int  # cm above the take-off point
    bat: int  # %
    baro: float  # m
    time: int | None = None  # s of running motors
    agx: float | None = None  # 0.001 g; at rest agz is about -999
    agy: float | None = None
    agz: float | None = None
    pad: MissionPad | None = None  # EDU and TT only


_INTEGER = re.compile(r"-?[0-9]{1,9}")
_DECIMAL = re.compile(r"-?[0-9]{1,9}(?:\.[0-9]{1,9})?")
_TRIPLE = re.compile(r"-?[0-9]{1,9}(?:,-?[0-9]{1,9}){2}")
_DECIMALS = frozenset({"baro", "agx", "agy", "agz"})
_PAD = frozenset(MissionPad._fields)
_KNOWN = frozenset(TelloState._fields) - {"pad"} | _PAD
_NEEDED = frozenset(TelloState._fields) - TelloState._field_defaults.keys()


def parse_states(datagram: bytes) -> tuple[list[TelloState], int]:
    """Return the states in a datagram, oldest first, and how many strings in it were malformed; never raises."""
    if len(datagram) > LONGEST:
        return [], 1
    found = [_state(fields) for fields in _strings(datagram.decode("ascii", errors="replace"))]
    states = [state for state in found if state is not None]
    return states, len(found) - len(states)


def format_state(state: TelloState) -> bytes:
    """Return the datagram of a state without the fields that are None."""
    front = ""
    if state.pad is not None:
        mid, x, y, z, mpry = state.pad
        front = f"mid:{mid};x:{x};y:{y};z:{z};mpry:{mpry[0]},{mpry[1]},{mpry[2]};"
    parts = [
        f"{name}:{value:.2f};" if name in _DECIMALS else f"{name}:{value};"
        for name, value in zip(state._fields, state, strict=True)
        if value is not None and name != "pad"
    ]
    return f"{front}{''.join(parts)}\r\n".encode("ascii")


def _strings(text: str) -> list[dict[str, str]]:
    """Split `text` at ends of line, and where a field appears again."""
    found: list[dict[str, str]] = []
    for line in re.split(r"[\r\n\0]+", text):
        fields: dict[str, str] = {}
        for part in line.split(";"):
            name, colon, value = part.strip().partition(":")
            if name in fields and colon:
                found.append(fields)
                fields = {}
            if name:
                fields[name] = value
        if fields:
            found.append(fields)
    return found


def _state(fields: dict[str, str]) -> TelloState | None:
    numbers: dict[str, Any] = {}
    for name in _KNOWN & fields.keys():
        number = _number(name, fields[name])
        if number is None:
            return None
        numbers[name] = number
    if _NEEDED - numbers.keys():
        return None
    pad = {name: numbers.pop(name) for name in _PAD if name in numbers}
    return TelloState(**numbers, pad=MissionPad(**pad) if len(pad) == len(_PAD) else None)


def _number(name: str, text: str) -> int | float | tuple[int, ...] | None:
    if name == "mpry":
        return tuple(map(int, text.split(","))) if _TRIPLE.fullmatch(text) else None
    if name in _DECIMALS:
        return float(text) if _DECIMAL.fullmatch(text) else None
    return int(text) if _INTEGER.fullmatch(text) else None
