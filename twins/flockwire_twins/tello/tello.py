"""A simulated Tello: the state of a server of the SDK's UDP protocol.

Ports, as the user guides have them: commands come to 8889 and are answered to their sender; state goes ten times a
second to port 8890 of the last sender of `command`. Before it, and during a restart, the Tello is silent.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count

from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.swarm.airframes import TELLO
from flockwire_tello.commands import word
from flockwire_tello.state_string import NO_PAD, PADS_OFF, MissionPad, TelloState, format_state
from flockwire_tello.swarm_file import COMMAND_PORT

from flockwire_twins.tello.commanded import ERROR, OK, CommandedTello, NoText
from flockwire_twins.tello.commands import answer
from flockwire_twins.tello.flight import SimulatedFlight
from flockwire_twins.tello.parameters import Quirk, TelloParameters
from flockwire_twins.tello.video import test_picture

Address = tuple[str, int]

STATE_PERIOD = SECOND // 10
SILENCE = nanoseconds(TELLO.without_setpoints.after)  # ns, after which it lands
VIDEO_PORT = 11111
NUMBERED = re.compile(r"(Re[0-9]{2})([0-9]{2} )(.+)", re.DOTALL)  # number, repetition, command: DJI's RoboMaster SDK
NOT_TEXT = "{}:{} sends something else than text: the app's binary protocol is not simulated"
JUNK = bytes(range(0xCC, 0xE8)) + b"VQZd"  # not ASCII, 32 bytes as in public logs


@dataclass
class _Asker:
    """A client that waits for the reply to its command.

    DJI's RoboMaster SDK numbers its commands, sends each several times, and waits for as many replies: each with the
    prefix of its repetition.
    """

    address: Address
    text: str
    number: str  # empty of an unnumbered command
    prefixes: list[str]  # of the repetitions that came before the reply
    reply: str | None = None  # the last one

    def repeated_by(self, other: _Asker) -> bool:
        """Return whether `other` asks the same; this one is numbered."""
        return (self.address, self.number, self.text) == (other.address, other.number, other.text)


class SimulatedTello:
    """One Tello at `now` (ns); `chance` draws from [0, 1) where a reply time or a loss is random.

    `note` takes a line for whoever watches it.

    `flight` is what it flies: the truth that a tracker would see, at a time to which `advance` has come.
    """

    def __init__(
        self,
        parameters: TelloParameters,
        now: int,
        chance: Callable[[], float] = lambda: 0.5,
        note: Callable[[str], None] = lambda line: None,
    ) -> None:
        self.parameters, self._chance, self._note = parameters, chance, note
        self._binary: Address | None = None  # last sender of something else than text
        self._outbox: list[tuple[int, int, bytes, Address]] = []
        self._order = count()
        self.flight = SimulatedFlight(parameters, now)
        self._drone = CommandedTello(parameters, self.flight, ports=(parameters.state_port, VIDEO_PORT))
        self._client: Address | None = None  # last sender of `command`
        self._first: Address | None = None  # its first sender since power-on
        self._mover: _Asker | None = None  # waits for the end of a movement
        self._numbered: _Asker | None = None  # of the newest numbered command
        self._replies, self._last_reply = 0, now
        self._commanded_at = self._state_due = now
        self._silent_until = now

    def receive(self, datagram: bytes, sender: Address, now: int) -> None:
        """Receive a datagram of the command port."""
        self.advance(now)
        # bytes of a command, a longer one is ignored
        if now < self._silent_until or len(datagram) > 256 or self._lost():
            return
        asker, earlier = self._asker(datagram, sender), self._numbered
        self._examine(asker.text, sender)
        if earlier is not None and earlier.repeated_by(asker):
            self._repeat(earlier, asker, now)
            return
        if asker.text == "command":
            self._enter(sender, now)
        if self._client is None or not asker.text:
            return
        self._commanded_at = now
        if asker.number:
            self._numbered = asker
        self._command(asker.text, asker, now)

    def _asker(self, datagram: bytes, sender: Address) -> _Asker:
        text, number, prefix = datagram.decode("ascii", errors="replace").strip("\r\n\0 "), "", ""
        if self.parameters.generation != "1.3" and (numbered := NUMBERED.fullmatch(text)) is not None:
            number, repetition, text = numbered.groups()
            prefix = number + repetition
        return _Asker(sender, text, number, [prefix])

    def _examine(self, text: str, sender: Address) -> None:
        """Note a command that is no text; once for each sender in turn."""
        if not (text.isascii() and text.isprintable()) and sender != self._binary:
            self._binary = sender
            self._note(NOT_TEXT.format(*sender))

    def _repeat(self, earlier: _Asker, asker: _Asker, now: int) -> None:
        """Answer a numbered command that came before: with its reply, once there is one."""
        self._commanded_at = now
        if earlier.reply is not None:
            self._reply(earlier.reply, asker, now)
        elif asker.prefixes[0] not in earlier.prefixes:
            earlier.prefixes += asker.prefixes

    def advance(self, now: int) -> None:
        """Advance to `now`."""
        flight = self.flight
        while (moment := flight.next_cycle) <= now:
            before = flight.manoeuvre
            done = flight.cycle()
            if done and self._mover is not None:
                self._reply(OK, self._mover, moment)
                self._mover = None
            elif flight.manoeuvre is not before:
                self._interrupt("", moment)
            self._watch(moment)
        while self._client is not None and self._state_due <= now:
            (host, _), (state, video), due = self._client, self._drone.ports, self._state_due
            self._send(format_state(self.state(due)), (host, state), due)
            if self._drone.streaming:
                for datagram in test_picture(odd=bool(due // STATE_PERIOD % 2)):
                    self._send(datagram, (host, video), due)
            self._state_due += STATE_PERIOD

    def outgoing(self, now: int) -> list[tuple[bytes, Address]]:
        """Return the datagrams up to `now`, in order."""
        self.advance(now)
        found: list[tuple[bytes, Address]] = []
        while self._outbox and self._outbox[0][0] <= now:
            _, _, datagram, address = heappop(self._outbox)
            if not self._lost():
                found.append((datagram, address))
        return found

    def next_deadline(self) -> int:
        """Return when to call `outgoing` next, ns."""
        times = [self._outbox[0][0]] if self._outbox else []
        if self._client is not None:
            times.append(self._state_due)
        if self.flight.airframe.motors or not times:
            times.append(self.flight.next_cycle)
        return min(times)

    def state(self, now: int) -> TelloState:
        """Return the state at `now`; call `advance` first."""
        state, pads = self.flight.state(now), self._drone.pads
        if self.parameters.generation == "1.3":
            return state
        off = (PADS_OFF, -200, -200, -200, (0, 0, 0))
        return state._replace(pad=MissionPad(*((NO_PAD, -100, -100, -100, (-1, -1, -1)) if pads else off)))

    def _enter(self, sender: Address, now: int) -> None:
        if self._client is None:
            self._state_due = now + STATE_PERIOD
        self._first = self._first or sender
        self._client = sender

    def _command(self, text: str, asker: _Asker, now: int) -> None:
        flight = self.flight
        before = flight.manoeuvre
        reply = answer(self._drone, text, now)
        if flight.manoeuvre is not before:
            self._interrupt(word(text), now)
        if isinstance(reply, str):
            self._reply(reply, asker, now)
        elif reply is NoText.AT_END:
            self._mover = asker
        if self._drone.rebooting:
            self._reboot(now)

    def _interrupt(self, by: str, now: int) -> None:
        """Answer the movement that a command has ended; a `stop` first gives `forced stop`, as clients expect."""
        mover, self._mover = self._mover, None
        if mover is None:
            return
        if by == "stop":
            self._reply("forced stop", mover, now)
        if by != "emergency":
            self._reply(OK if by == "stop" else ERROR, mover, now)

    def _watch(self, now: int) -> None:
        flight = self.flight
        idle = flight.flying and flight.manoeuvre is None
        if idle and now - self._commanded_at >= SILENCE and Quirk.AUTO_LAND in self.parameters.quirks:
            flight.land()

    def _reply(self, text: str, asker: _Asker, now: int) -> None:
        """Send a reply to each repetition after its reply time, with the quirks."""
        to = asker.address
        fastest, slowest = self.parameters.reply_time
        if Quirk.SECOND_SESSION_HANGS in self.parameters.quirks and to != self._first and to[1] != COMMAND_PORT:
            return
        due = max(self._last_reply, now + round((fastest + (slowest - fastest) * self._chance()) * SECOND))
        self._last_reply = due  # replies keep their order
        asker.reply = text
        for prefix in asker.prefixes:
            self._datagram(prefix + text, to, due)

    def _datagram(self, text: str, to: Address, due: int) -> None:
        quirks = self.parameters.quirks
        self._replies += 1
        datagram = text.encode("ascii", errors="replace")
        if self._replies == 1 and Quirk.JUNK_BEFORE_FIRST_REPLY in quirks:
            self._send(JUNK, to, due)
        if self._replies == 1 and Quirk.JUNK_IN_FIRST_REPLY in quirks:
            datagram = JUNK[:8] + datagram
        late = Quirk.LATE_REPLIES in quirks and self._replies % 4 == 0
        self._send(datagram, to, due + 3 * SECOND // 2 if late else due)  # of the quirk LATE_REPLIES

    def _send(self, datagram: bytes, to: Address, due: int) -> None:
        if len(self._outbox) < 256:  # unsent datagrams, more are dropped
            heappush(self._outbox, (due, next(self._order), datagram, to))

    def _reboot(self, now: int) -> None:
        """Reset the session; a flying drone falls."""
        self.flight.cut(now)
        self._drone = CommandedTello(self.parameters, self.flight, ports=(self.parameters.state_port, VIDEO_PORT))
        self._client = self._first = self._mover = self._numbered = None
        self._replies, self._silent_until = 0, now + 3 * SECOND

    def _lost(self) -> bool:
        return Quirk.LOST_DATAGRAMS in self.parameters.quirks and self._chance() < self.parameters.loss
