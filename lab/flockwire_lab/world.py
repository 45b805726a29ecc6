"""A whole swarm in virtual time, from the start of the processes to the landing."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain, count
from random import Random
from typing import NamedTuple

from flockwire_core import clock
from flockwire_core.domain.order import Mission, Order
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.director import Director, Stage
from flockwire_core.ground.operator import OperatorCore
from flockwire_core.process.cores import Core, MakeLaw, Start, Stopwatch, make_core
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import OPERATOR, TELEOP

from flockwire_lab.faults.faulty_core import faulty
from flockwire_lab.faults.injection import FaultInjector
from flockwire_lab.faults.kinds import Fault
from flockwire_lab.network import Conditions, DatagramNetwork, VirtualLink
from flockwire_lab.operator import ScriptedSteering, VirtualOperator
from flockwire_lab.process import Outlet, Tap, VirtualProcess
from flockwire_lab.rare import Rare, RareBranches
from flockwire_lab.virtual_time import LocalClock, Scheduler

EPOCH = 1_790_000_000 * SECOND  # start of every virtual flight, Unix ns
LINGER = SECOND // 10  # ns from the end of the flight to the end of the recording
LONGEST = 3600.0  # s, longest flight
COLLECT_AFTER = 50_000  # new objects after which Python looks for unused cycles: more than 200 drones have on the way


class Outcome(NamedTuple):
    """The outcome of a flight: why it failed (empty if it did not), its s of virtual time, laws too slow for real."""

    failure: str
    seconds: float
    slow: tuple[str, ...] = ()


class World:
    """The processes of `swarm`, flown for `duration` s from take-off to landing; equal seeds give equal flights.

    The drones `without` stay on the ground. `tap` is called with every published message (received ones may differ).
    `stations` are identities of other operators for `station`. With `rare`, links and timers take rare branches.
    `law` makes the laws of followers in place of their own.
    """

    def __init__(
        self,
        swarm: Swarm,
        seed: int,
        duration: float,
        faults: tuple[Fault, ...] = (),
        tap: Tap | None = None,
        without: tuple[int, ...] = (),
        stations: tuple[str, ...] = (),
        rare: Rare | None = None,
        law: MakeLaw | None = None,
    ) -> None:
        started_within = 0.2  # s in which the processes start, each at its own time
        swarm = swarm.in_simulation()
        self.swarm, self.plan = swarm, Plan(swarm)
        self.scheduler = Scheduler(EPOCH)
        self._stations = {
            name: VirtualOperator(OperatorCore(self.plan, givers), self.swarm, self._ordered, self.scheduler.stop)
            for name, givers in zip((OPERATOR.kind, *stations), _givers(), strict=False)
        }
        self.station().core.conduct(EPOCH, duration, Order("start", without=without))
        self.links: dict[tuple[str, str], VirtualLink] = {}
        self._seed, self._faults, self._tap, self._rare, self._law = seed, faults, tap, rare, law
        self._limit = EPOCH + nanoseconds(duration + LONGEST)
        self._network = DatagramNetwork(swarm.sim, seed, self.scheduler)
        nobody = ScriptedSteering(swarm, lambda _: None)
        self._seated: dict[str, Core] = {TELEOP.kind: nobody, **self._stations}  # the cores of operators
        self._stores: dict[str, MemoryStore] = {}
        self._stopwatches: dict[str, Stopwatch] = {}  # of real time, for users' laws
        self.processes = self._processes()
        self._connect()
        self._faulty = FaultInjector(faults, self.plan, self.scheduler, self.processes, self.links)
        for identity, process in self.processes.items():
            recorder = identity in self.plan.recorders
            begin = 0.0 if recorder else self._chance(f"begin {identity}").random() * started_within
            self.scheduler.at(EPOCH + nanoseconds(begin), process.start)

    def run(self) -> Outcome:
        """Fly until the director ends the flight."""
        director, scheduler, usual = self.director, self.scheduler, gc.get_threshold()
        gc.set_threshold(COLLECT_AFTER, *usual[1:])  # a look for cycles visits all messages that are on the way
        try:
            scheduler.run(self._limit)
            scheduler.run(scheduler.now + LINGER)
        finally:
            gc.set_threshold(*usual)
        failure = director.failure
        if director.stage is not Stage.OVER:
            failure = failure or f"the flight was not over after {(scheduler.now - EPOCH) / SECOND:.0f} s"
        measured = ((identity, stopwatch.reason()) for identity, stopwatch in self._stopwatches.items())
        slow = tuple(f"{identity}: {reason.text}" for identity, reason in measured if reason is not None)
        return Outcome(failure, (scheduler.now - EPOCH) / SECOND, slow)

    def advance(self, end: int) -> None:
        """Fly until `end` (Unix ns), beyond the end of a conducted flight too."""
        scheduler = self.scheduler
        while scheduler.now < end:  # the operator's end of a flight stops the scheduler once
            scheduler.at(end, lambda _: None)
            scheduler.run(end)

    @property
    def director(self) -> Director:
        """The director of the operator's newest flight; ValueError without one."""
        director = self.station().core.director
        if director is None:
            raise ValueError("nobody conducts a flight")
        return director

    def conduct(self, director: Director | None) -> None:
        """Replace the director of the flight; None: no director."""
        self.station().core.director = director

    def station(self, identity: str = OPERATOR.kind) -> VirtualOperator:
        """Return the operator, or one of the other stations."""
        return self._stations[identity]

    def seat(self, identity: str, core: Core) -> None:
        """Replace the station, or who steers, `identity` by `core`, before the flight starts."""
        self._seated[identity] = core

    def stop(self, reason: str) -> None:
        """Order an emergency stop as the operator."""
        self.station().ask(Order("stop", reason=reason))

    def _processes(self) -> dict[str, VirtualProcess]:
        return {
            identity: VirtualProcess(
                self.plan, identity, partial(self._make, identity), self._clock(identity), self.scheduler,
                self._network, self._seed, self._tap, self._branches(identity),
            )
            for identity in self.plan.identities
            if identity not in self.plan.routers
            and (identity in self.plan.started or identity in self._seated)
        }  # fmt: skip

    def _make(self, identity: str, now: int, starts: int) -> Core:
        if identity in self._seated:
            return self._seated[identity]
        chance = Random(f"{self.swarm.gateway.seed} {self._seed} {identity} {starts}")  # noqa: S311  (noise)
        stopwatch = self._stopwatches[identity] = Stopwatch(clock.monotonic, 1.0 / self.swarm.control.rate_hz)
        store = self._stores.setdefault(identity, MemoryStore())
        core = make_core(Start(self.plan, identity, now, chance, stopwatch, store, law=self._law))
        return faulty(core, self._faults, self.plan, identity, self._faulty.took_off)

    def _clock(self, identity: str) -> LocalClock:
        # Processes of a host share its clock.
        owner = identity if len(self.swarm.hosts) == 1 else self.plan.hosts[identity]
        table, chance = self.swarm.sim, self._chance(f"clock {owner}")
        if identity in self.plan.operators:
            return LocalClock(EPOCH)
        offset, drift = chance.uniform(-1.0, 1.0) * table.clock_offset, chance.uniform(-1.0, 1.0) * table.clock_drift
        return LocalClock(EPOCH, nanoseconds(offset), nanoseconds(drift))

    def _connect(self) -> None:
        places = {identity: {key: k for k, key in enumerate(p.subscribed)} for identity, p in self.processes.items()}
        for key, publishers, subscribers in self.plan.flows:
            for publisher in publishers:
                if publisher not in self.processes:
                    continue
                outlet = self.processes[publisher].outlets[key] = Outlet(self.plan, key)
                for subscriber in subscribers:
                    if subscriber != publisher and key in places.get(subscriber, ()):
                        ends = (publisher, subscriber)
                        link = self.links.get(ends) or self._link(ends)
                        outlet.readers.append((link, places[subscriber][key]))

    def _link(self, ends: tuple[str, str]) -> VirtualLink:
        table, conditions = self.swarm.sim, Conditions(self.swarm.sim.delay)
        if not any(end in self.plan.operators for end in ends):  # who judges the flight receives everything
            conditions = Conditions(table.delay, table.jitter, table.loss, table.reordering)
        deliver, branches = self.processes[ends[1]].deliver, self._branches(" > ".join(ends))
        self.links[ends] = VirtualLink(ends, conditions, self._seed, self.scheduler, deliver, branches)
        return self.links[ends]

    def _branches(self, where: str) -> RareBranches | None:
        return None if self._rare is None else RareBranches(self._rare, self._chance(f"rare {where}"))

    def _chance(self, what: str) -> Random:
        return Random(f"{self._seed} {what}")  # noqa: S311  (not for secrets)

    def _ordered(self, order: Mission) -> None:
        if order.verb == "takeoff" and self._faulty.took_off is None:
            self._faulty.begin()


class MemoryStore:
    """What a process keeps for its next one."""

    def __init__(self) -> None:
        self._data = b""

    def read(self) -> bytes:
        """Return what was written last, empty if nothing."""
        return self._data

    def write(self, data: bytes) -> None:
        """Keep `data`."""
        self._data = data


def _givers() -> Iterator[Callable[[], int]]:
    """Yield for each station the numbers of its givers of orders; the operator's first flight has 1."""
    yield chain((1,), count((1 << 16) + 1)).__next__
    for station in count(2):
        yield count((station << 16) + 1).__next__
