"""The law of a follower in another process, over a Unix socket or a port of this machine (docs/law_elsewhere.md).

A frame is a ROS 2 `float64[]` in CDR, little-endian: 4 bytes length, 4 bytes zero, 8 bytes for each number.
"""

from __future__ import annotations

import socket
from math import isnan
from pathlib import Path
from struct import Struct, pack, unpack_from
from typing import Any, ClassVar, Final

from pydantic import RootModel

from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.follower_law import LateAnswerError
from flockwire_core.law import Decision, Heard, Information, LawSettings, Observation
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.tables import Finite
from flockwire_core.wire.information import declared, numbers
from flockwire_core.wire.observed_numbers import ObservedNumbers

VERSION: Final = 1.0  # of the frames
HEAD: Final = Struct("<II")
MOST: Final = 4096  # messages that wait for a frame, or for a decision
COMMAND: Final = 5  # numbers in a decision without a message
SETTINGS: Final = ("number", "period", "lag", "dead_time", "speed", "acceleration")  # as the first frame has them


class LawElsewhere:
    """The law of one follower of `swarm`, which the program at `control.law` computes; a connection for each.

    A step waits `patience` s for the answer. Raises ConnectionError if nobody serves it, LateAnswerError for an
    answer that is late (but for its message it is dropped as it comes), ValueError for one of another form.
    """

    information: ClassVar[Information] = Information()
    Parameters = RootModel[dict[str, Finite]]

    def __init__(self, settings: LawSettings, swarm: Swarm, patience: float) -> None:
        self._observed = ObservedNumbers(declared(swarm), settings.neighbours)
        self._message, self._pace = swarm.control.information.message, swarm.control.information.pace
        self._where, self._patience = swarm.control.law, round(patience * SECOND)
        self._socket = _connect(self._where, Path(swarm.folder))
        self._data, self._news, self._said = bytearray(), list[Heard](), list[Any]()
        self._asked = self._answered = 0
        self._deadline = clock.monotonic() + self._patience
        self._send([VERSION, *(float(getattr(settings, name)) for name in SETTINGS), *self._of_graph(swarm, settings)])

    def step(self, observation: Observation) -> Decision:
        """Return the program's decision: command, error and message."""
        self._deadline = clock.monotonic() + self._patience
        self._news += observation.news if self._pace == "round" else ()
        if max(len(self._news), len(self._said)) > MOST:
            raise ConnectionError(f"{self._where}: the program answers late for too long")
        while self._answered < self._asked:  # one that was late
            self._receive()
        self._send([float(self._asked + 1), *self._observed.of(observation), *self._of_news()])
        self._asked, self._news = self._asked + 1, []
        answer = self._receive()
        message, error = self._said.pop(0) if self._said else None, answer[COMMAND - 1]
        return Decision(tuple(answer[1 : COMMAND - 1]), message, None if isnan(error) else error)

    def _of_graph(self, swarm: Swarm, settings: LawSettings) -> list[float]:
        """Return the in-neighbours, their weights, who leads, and the parameters, each list with its length."""
        known = self._observed.neighbours
        leads = [1.0 if j in swarm.leaders else 0.0 for j in known]
        weights = [settings.neighbours[j] for j in known]
        given = [float(str(value)) for value in settings.parameters.values()]
        return [float(len(known)), *map(float, known), *weights, *leads, float(len(given)), *given]

    def _of_news(self) -> list[float]:
        """Return how many messages no frame has had yet, each with its drone and number; nothing but for rounds."""
        if self._pace != "round":
            return []
        news = [value for one in self._news for value in (float(one.number), float(one.sequence), *one.content.numbers)]
        return [float(len(self._news)), *news]

    def _send(self, found: list[float]) -> None:
        """Send a frame as a whole; raises LateAnswerError before it begins, ConnectionError if it cannot end."""
        self._socket.settimeout(self._left())
        try:
            self._socket.sendall(HEAD.pack(len(found), 0) + pack(f"<{len(found)}d", *found))
        except TimeoutError:
            raise ConnectionError(f"{self._where}: the program does not read") from None
        except OSError:
            raise self._closed() from None

    def _receive(self) -> tuple[float, ...]:
        """Return the next answer, and keep its message; raises LateAnswerError, and keeps what has come of it.

        A message to send waits behind those of late answers, unless only the newest counts.
        """
        count = HEAD.unpack(self._filled(HEAD.size))[0]
        if count not in (COMMAND, COMMAND + self._message):
            form = " or ".join(map(str, dict.fromkeys((COMMAND, COMMAND + self._message))))
            raise ValueError(f"{self._where}: a decision of {count} numbers, must be {form}")
        data = self._filled(HEAD.size + 8 * count)
        del self._data[: len(data)]
        found: tuple[float, ...] = unpack_from(f"<{count}d", data, HEAD.size)
        self._answered += 1
        if found[0] != self._answered:
            raise ValueError(f"{self._where}: a decision of step {found[0]:g}, must be {self._answered}")
        said = [numbers(self._message)(found[COMMAND:])] if count > COMMAND else []
        self._said = said if self._pace == "step" else self._said + said
        return found

    def _filled(self, size: int) -> bytes:
        """Return the next `size` bytes once they have come."""
        while len(self._data) < size:
            self._socket.settimeout(self._left())
            try:
                more = self._socket.recv(1 << 16)
            except TimeoutError:
                continue
            except OSError:
                raise self._closed() from None
            if not more:
                raise self._closed()
            self._data += more
        return bytes(self._data[:size])

    def _closed(self) -> ConnectionError:
        return ConnectionError(f"{self._where}: the program has closed the connection")

    def _left(self) -> float:
        """Return the s until the deadline; raises LateAnswerError after it."""
        left = (self._deadline - clock.monotonic()) / SECOND
        if left <= 0.0:
            raise LateAnswerError(f"{self._where}: no answer within {self._patience / SECOND:g} s")
        return left


def _connect(where: str, folder: Path) -> socket.socket:
    """Connect to the program; raises ConnectionError."""
    kind, _, place = where.partition(":")
    address = ("127.0.0.1", int(place)) if kind == "tcp" else str(folder / place)
    found = socket.socket(socket.AF_INET if kind == "tcp" else socket.AF_UNIX)
    try:
        found.connect(address)
    except OSError as error:
        found.close()
        raise ConnectionError(f"nobody serves it ({error.strerror}): start the program of the law first") from None
    if kind == "tcp":
        found.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return found
