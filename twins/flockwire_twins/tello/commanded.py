"""The target and the answers of a simulated Tello's commands."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from flockwire_twins.tello.flight import SimulatedFlight
from flockwire_twins.tello.parameters import Quirk, TelloParameters

OK: Final = "ok"
ERROR: Final = "error"
OUT_OF_RANGE: Final = "out of range"


class RefusedError(Exception):
    """A command that is not done; the text is the reply."""


class NoText(Enum):
    """Stands for a reply without text."""

    SILENCE = "silence"
    AT_END = "at the end"  # of the current movement


Reply = str | NoText


@dataclass
class CommandedTello:
    """The state of a Tello besides its flight."""

    parameters: TelloParameters
    flight: SimulatedFlight
    speed: int = 100  # cm/s, of movements
    pads: bool = False  # looks for mission pads
    ports: tuple[int, int] = (8890, 11111)  # of state and video
    moves: int = 0  # movement commands so far
    streaming: bool = False  # sends video
    rebooting: bool = field(default=False, init=False)

    def has(self, quirk: Quirk) -> bool:
        """Return whether a quirk is switched on."""
        return quirk in self.parameters.quirks


NUMBER = re.compile(r"-\d{1,4}|\d{1,5}")
Handler = Callable[[CommandedTello, list[str], int], Reply]  # arguments: drone, words after the name, now (ns)


def whole(texts: list[str], *ranges: tuple[int, int]) -> list[int]:
    """Return the texts as integers within their ranges; raises RefusedError."""
    if len(texts) != len(ranges) or not all(map(NUMBER.fullmatch, texts)):
        raise RefusedError(ERROR)
    numbers = [int(text) for text in texts]
    if not all(low <= number <= high for number, (low, high) in zip(numbers, ranges, strict=True)):
        raise RefusedError(OUT_OF_RANGE)
    return numbers
