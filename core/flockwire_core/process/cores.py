"""The interface of a core, what it is given at its start, and its construction by the process table."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Future
from typing import NamedTuple, Protocol, cast, runtime_checkable

from flockwire_core.domain.time import SECOND
from flockwire_core.law import Law
from flockwire_core.objects import load_object
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import LAW_SLOW, Reason, Report

TAKES = "its law takes {step:.0f} ms for a step, the control period is {period:g} ms: steps are missed"


class Randomness(Protocol):
    """A source of random numbers: a seeded random.Random."""

    def gauss(self, mu: float, sigma: float) -> float:
        """Return a normally distributed number."""

    def random(self) -> float:
        """Return a number evenly distributed over [0, 1)."""


class Store(Protocol):
    """What a process keeps for its next one: a few bytes."""

    def read(self) -> bytes:
        """Return what was written last, empty if nothing."""

    def write(self, data: bytes) -> None:
        """Keep `data`; does not wait for it."""


class Stopwatch:
    """Measures in real time how long the steps of a law take, by the clock `read` (ns); no core decides by it.

    They are due every `period` s.
    """

    def __init__(self, read: Callable[[], int], period: float) -> None:
        self._read, self._period = read, period
        self._began = self._spent = self._steps = 0
        self._slowest = 0.0

    def begin(self) -> None:
        """Note that a step begins."""
        self._began = self._read()

    def end(self) -> None:
        """Note that it ends."""
        self._spent += self._read() - self._began
        self._steps += 1

    def reason(self) -> Reason | None:
        """Return the reason that names the longest mean so far, if the steps since the last call took too long."""
        mean = self._spent / (max(self._steps, 1) * SECOND)
        self._spent = self._steps = 0
        if mean <= self._period:
            return None
        self._slowest = max(self._slowest, mean)
        return Reason(LAW_SLOW, TAKES.format(step=1e3 * self._slowest, period=1e3 * self._period))


Aside = Callable[[Callable[[], object]], Future[object]]  # begins a computation beside a core


def at_once(compute: Callable[[], object]) -> Future[object]:
    """Return a computation that is over when it begins, as in virtual time."""
    over: Future[object] = Future()
    try:
        over.set_result(compute())
    except Exception as error:
        over.set_exception(error)
    return over


MakeLaw = Callable[[Swarm, int], Law]  # takes the number of a follower


class Start(NamedTuple):
    """The input of a core at its start."""

    plan: Plan
    identity: str
    now: int  # Unix ns
    chance: Randomness
    stopwatch: Stopwatch | None = None  # for a user's law
    store: Store | None = None
    aside: Aside = at_once  # computes what must not hold up the steps
    law: MakeLaw | None = None  # of a follower, in place of `follower_law`

    @property
    def drone(self) -> int:
        """The drone of the process; raises ValueError if it has none."""
        drone = self.plan.members[self.identity].drone
        if drone is None:
            raise ValueError(f"{self.identity} serves no drone")
        return drone


class Core(Protocol):
    """The behaviour of a process, without clock, input and output."""

    @property
    def triggers(self) -> frozenset[Key]:
        """The keys whose arrival may trigger a step; empty for a core that steps at its own rate."""

    @property
    def prompt(self) -> frozenset[Key]:
        """Other keys that are received at once; the rest are buffered until the next step."""

    @property
    def period(self) -> float:
        """Seconds between steps (with a trigger: when to step without one)."""

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message at `now`, Unix time in ns."""

    def step(self, now: int) -> Iterable[tuple[Key, Message]]:
        """Return the messages to publish at `now`, Unix time in ns."""

    def report(self, now: int) -> Report:
        """Return its status at `now`."""

    def retire(self, now: int) -> None:
        """Land its drones, because the process must end."""

    def may_end(self, now: int) -> bool:
        """Return whether the process may end, because it has no drone in the air."""


Address = tuple[str, int]  # IP, port


class Datagram(NamedTuple):
    """One UDP datagram to send."""

    data: bytes
    source: Address  # one of its own sockets
    target: Address


@runtime_checkable
class Networked(Protocol):
    """A core that exchanges UDP datagrams too."""

    @property
    def sockets(self) -> tuple[Address, ...]:
        """The addresses to bind."""

    def datagram(self, data: bytes, sender: Address, at: Address, now: int) -> None:
        """Receive a datagram from `sender` to its socket `at`, at `now` (Unix ns)."""

    def outgoing(self, now: int) -> list[Datagram]:
        """Return the datagrams to send at `now`; called after each input and each step."""


@runtime_checkable
class Framed(Protocol):
    """A core whose triggers are parts of a frame: it steps when the frame is complete, not for each of them."""

    def due(self, key: Key) -> bool:
        """Return whether the last message of the trigger `key` causes a step."""


class Ground:
    """Common part of cores without a drone: they may end at any time, and step at their own rate."""

    triggers: frozenset[Key] = frozenset()
    prompt: frozenset[Key] = frozenset()

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Ignore all messages."""

    def step(self, now: int) -> Iterable[tuple[Key, Message]]:
        """Publish nothing."""
        return ()

    def retire(self, now: int) -> None:
        """Do nothing."""

    def may_end(self, now: int) -> bool:
        """Return True."""
        return True


class Bystander(Ground):
    """A core that only reports its `phase`: Zenoh passes the router's messages on, the recorder's runner records."""

    def __init__(self, phase: Phase, period: float) -> None:
        self.period, self._phase = period, phase  # s

    def report(self, now: int) -> Report:
        """Return its phase."""
        return Report(self._phase)


def make_router(_: Start) -> Bystander:
    """Return the router's core."""
    return Bystander(Phase.ROUTING, 0.05)


def make_recorder(_: Start | None = None) -> Bystander:
    """Return the recorder's core; in virtual time the world writes the trace."""
    return Bystander(Phase.RECORDING, 0.02)


def make_core(start: Start) -> Core:
    """Return the core of the process table for `start`."""
    return cast("Core", load_object(start.plan.rows[start.identity].core)(start))
