"""A simulated Tello and somebody who talks to it, in a time of their own."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_tello.state_string import TelloState, parse_states
from flockwire_twins.tello.parameters import TelloParameters, switched
from flockwire_twins.tello.tello import VIDEO_PORT, SimulatedTello

CLIENT = ("127.0.0.9", 40000)


class Talk:
    """A simulated Tello; what it sent to whom, replies and states apart."""

    def __init__(self, parameters: TelloParameters, chance: Callable[[], float]) -> None:
        self.now = 5 * SECOND
        self.tello = SimulatedTello(parameters, self.now, chance)
        self.replies: list[tuple[float, bytes, tuple[str, int]]] = []  # s since the last command, datagram, to whom
        self.states: list[tuple[TelloState, tuple[str, int]]] = []
        self.video: list[tuple[bytes, tuple[str, int]]] = []
        self._asked = self.now

    def run(self, seconds: float) -> None:
        """Let time pass, and collect what comes."""
        end = self.now + nanoseconds(seconds)
        while self.now < end:
            self.now = min(end, max(self.now, self.tello.next_deadline()))
            for datagram, address in self.tello.outgoing(self.now):
                found, _ = parse_states(datagram)
                if found:
                    self.states.append((found[0], address))
                elif address[1] == VIDEO_PORT:
                    self.video.append((datagram, address))
                else:
                    self.replies.append(((self.now - self._asked) / SECOND, datagram, address))

    def ask(self, command: str, seconds: float = 0.1, sender: tuple[str, int] = CLIENT) -> bytes | None:
        """Send a command; return the last reply within `seconds`."""
        self.replies.clear()
        self._asked = self.now
        self.tello.receive(command.encode(), sender, self.now)
        self.run(seconds)
        return self.replies[-1][1] if self.replies else None

    @property
    def state(self) -> TelloState:
        """The state now."""
        return self.tello.state(self.now)

    @property
    def position(self) -> tuple[float, float, float]:
        """Where it is now."""
        return self.tello.flight.airframe.motion(self.now).position


@pytest.fixture
def talk() -> Callable[..., Talk]:
    """Return the builder of a talk: names of quirks, parameters; it has sent `command` unless told not to."""

    def make(*quirks: str, enter: bool = True, chance: Callable[[], float] = lambda: 0.5, **parameters: object) -> Talk:
        found = Talk(TelloParameters(quirks=switched(quirks), **parameters), chance)  # type: ignore[arg-type]
        if enter:
            assert found.ask("command") == b"ok"
        return found

    return make


@pytest.fixture
def flying(talk: Callable[..., Talk]) -> Callable[..., Talk]:
    """Return the builder of a talk whose drone hovers."""

    def make(*quirks: str, **parameters: object) -> Talk:
        found = talk(*quirks, **parameters)
        assert found.ask("takeoff", 5.0) == b"ok"
        return found

    return make
