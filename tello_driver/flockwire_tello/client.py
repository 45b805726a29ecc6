"""A client of one Tello, without input and output: it turns commands into datagrams and matches replies to commands.

One command is in flight at a time. A Tello does not number its replies, so a late reply looks like the reply to the
next command. Each sent datagram therefore owes a reply until its time limit, and a reply belongs to the oldest datagram
that it fits. A command that may not be repeated waits until no reply is owed. `rc` and `emergency` have no reply and do
not wait; `land` and `stop` replace the command in flight.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from flockwire_core.domain.time import SECOND, nanoseconds

from flockwire_tello.commands import CommandRule, fits, refused, rule, split_replies, word
from flockwire_tello.state_string import TelloState, parse_states

LONGEST_COMMAND = 256  # characters
LONGEST_QUEUE = 16  # commands
MOST_OWED = 32  # datagrams
EMERGENCIES = 3  # times that `emergency` is sent, at once: it has no reply


class CommandOutcome(Enum):
    """How a command ended."""

    DONE = "done"
    REFUSED = "refused"  # the reply gives the reason
    TIMED_OUT = "timed out"  # unknown whether the drone obeyed
    SUPERSEDED = "superseded"  # replaced by an urgent command
    QUEUE_FULL = "queue full"  # never sent


class Finished(NamedTuple):
    """A command that ended; `latency` is from the last time it was sent, s."""

    command: str
    outcome: CommandOutcome
    reply: str = ""
    latency: float = 0.0


@dataclass
class _InFlight:
    command: str
    rule: CommandRule
    sent: int  # how often
    sent_at: int

    @property
    def deadline(self) -> int:
        """When its reply is overdue, ns of the client's clock."""
        return self.sent_at + nanoseconds(self.rule.timeout)


class _Owed(NamedTuple):
    flight: _InFlight
    until: int


class TelloClient:
    """One Tello's commands, replies and state. All times are ns of one monotonic clock."""

    def __init__(self) -> None:
        self.state: TelloState | None = None
        self.state_time: int | None = None
        self.malformed_states = 0
        self._queue: deque[str] = deque()
        self._flight: _InFlight | None = None
        self._owed: deque[_Owed] = deque(maxlen=MOST_OWED)
        self._sticks: str | None = None
        self._emergencies = 0  # that the next `poll` sends
        self._finished: list[Finished] = []

    def send(self, command: str, now: int) -> None:
        """Accept a command; the next `poll` sends it, or lets it wait. Only the last of several `rc` is sent.

        Raises ValueError if it is empty, too long, or not one line of printable ASCII.
        """
        if not (0 < len(command) <= LONGEST_COMMAND and command.isascii() and command.isprintable()):
            raise ValueError(f"{command[:40]!r}: a command is one line of 1 to {LONGEST_COMMAND} ASCII characters")
        name = word(command)
        if name == "rc":
            self._sticks = command
        elif name == "emergency":
            self._sticks = None
            self._supersede(now)
            self._emergencies = EMERGENCIES
        elif not rule(command).urgent:
            self._wait(command)
        elif command not in self._queue and (self._flight is None or self._flight.command != command):
            self._supersede(now)
            self._queue.append(command)

    def cease(self, command: str, now: int) -> None:
        """End `command`, which the state shows to be done: it is not repeated. A reply may still arrive."""
        if self._flight is not None and self._flight.command == command:
            self._end(CommandOutcome.DONE, "", now)

    def give_up(self, command: str, now: int) -> None:
        """End `command`, and expect no reply to it: the state shows that its datagram was lost."""
        self._queue = deque(waiting for waiting in self._queue if waiting != command)
        self._owed = deque((owed for owed in self._owed if owed.flight.command != command), MOST_OWED)
        if self._flight is not None and self._flight.command == command:
            self._end(CommandOutcome.TIMED_OUT, "", now)

    def receive(self, datagram: bytes, now: int) -> None:
        """Receive a datagram from the drone's command port; a reply to no command, or to one that ended, is dropped."""
        for reply in split_replies(datagram):
            owed = next((owed for owed in self._owed if fits(owed.flight.command, reply)), None)
            if owed is None:
                continue
            self._owed.remove(owed)
            if owed.flight is self._flight:
                self._end(CommandOutcome.REFUSED if refused(reply) else CommandOutcome.DONE, reply, now)

    def receive_state(self, datagram: bytes, now: int) -> None:
        """Receive a datagram from the state port; `state` is then the newest and `state_time` is `now`."""
        states, malformed = parse_states(datagram)
        self.malformed_states += malformed
        if states:
            self.state, self.state_time = states[-1], now

    def poll(self, now: int) -> tuple[list[bytes], list[Finished]]:
        """Return the datagrams for the drone's command port, and the commands that ended since the last call."""
        datagrams = ["emergency"] * self._emergencies
        self._emergencies = 0
        if self._sticks is not None:
            datagrams.append(self._sticks)
            self._sticks = None
        datagrams.extend(self._advance(now))
        finished, self._finished = self._finished, []
        return [text.encode("ascii") for text in datagrams], finished

    def _advance(self, now: int) -> Iterable[str]:
        self._owed = deque((owed for owed in self._owed if owed.until > now), MOST_OWED)
        flight = self._flight
        if flight is not None and now >= flight.deadline:
            if flight.sent <= flight.rule.resend:
                yield self._transmit(flight, now)
            else:
                self._end(CommandOutcome.TIMED_OUT, "", now)
        # a command waits if its reply could be confused with an owed one
        if self._flight is None and self._queue and (not self._owed or rule(self._queue[0]).resend):
            command = self._queue.popleft()
            self._flight = _InFlight(command, rule(command), 0, now)
            yield self._transmit(self._flight, now)

    def _transmit(self, flight: _InFlight, now: int) -> str:
        flight.sent += 1
        flight.sent_at = now
        self._owed.append(_Owed(flight, flight.deadline + nanoseconds(flight.rule.late)))
        return flight.command

    def _wait(self, command: str) -> None:
        if len(self._queue) < LONGEST_QUEUE:
            self._queue.append(command)
        else:
            self._finished.append(Finished(command, CommandOutcome.QUEUE_FULL))

    def _end(self, outcome: CommandOutcome, reply: str, now: int) -> None:
        """End the command in flight, and expect replies to it no longer than its `late`."""
        flight, self._flight = self._flight, None
        assert flight is not None  # noqa: S101  (for mypy: the callers have seen it)
        self._finished.append(Finished(flight.command, outcome, reply, (now - flight.sent_at) / SECOND))
        until = now + nanoseconds(flight.rule.late)
        self._owed = deque(
            (o._replace(until=min(o.until, until)) if o.flight is flight else o for o in self._owed), MOST_OWED
        )

    def _supersede(self, now: int) -> None:
        """End the command in flight and all that wait; a reply to the former may still arrive."""
        if self._flight is not None:
            self._end(CommandOutcome.SUPERSEDED, "", now)
        self._finished += [Finished(command, CommandOutcome.SUPERSEDED) for command in self._queue]
        self._queue.clear()
