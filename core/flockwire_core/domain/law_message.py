"""What a law publishes: its newest messages with a sign of life, and numbers that are recorded (an energy)."""

from __future__ import annotations

from typing import Final, NamedTuple

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.record import Record

MOST_SIGNALS: Final = 64  # in one message
LONGEST_NAME: Final = 64  # characters


@mypyc_attr(acyclic=True)
class LawMessage(Record):
    """The newest messages of a law, oldest first; a receiver takes those that it has missed.

    `stamp` (Unix ns) is when it was sent: without new contents it is a sign of life. `epoch` (Unix ns) is the start of
    the sending process, `sequence` the number of the last content in it, 0 before the first. Each content has the
    time for which it is valid, Unix ns, and the octets of its fields.
    """

    __slots__ = ("stamp", "frame", "epoch", "sequence", "contents")

    def __init__(
        self, stamp: int, frame: str, epoch: int, sequence: int, contents: tuple[tuple[int, bytes], ...]
    ) -> None:
        self.stamp: Final = stamp
        self.frame: Final = frame
        self.epoch: Final = epoch
        self.sequence: Final = sequence
        self.contents: Final = contents


class Signals(NamedTuple):
    """A law's own numbers at one step; nobody but the recorder receives them."""

    stamp: int  # Unix ns, of the step
    frame: str
    values: tuple[tuple[str, float], ...]  # name and number
