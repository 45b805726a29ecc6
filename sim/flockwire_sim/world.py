"""A whole swarm in virtual time, from the first process's start to the landing."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

from flockwire import policy
from flockwire.config import Swarm
from flockwire.director import Director, Stage, pilots
from flockwire.faults import Fault
from flockwire.keys import Key
from flockwire.messages import Mission
from flockwire.nanoseconds import BILLION
from flockwire.stepping import Core
from flockwire.wiring import OPERATOR, ROUTER, identities

from flockwire_sim.cast import OperatorCore, make_core
from flockwire_sim.local_clock import LocalClock
from flockwire_sim.misfortune import Misfortune
from flockwire_sim.network import Conditions, Link
from flockwire_sim.process import MakeCore, Outlet, Process, Tap
from flockwire_sim.scheduler import Scheduler

EPOCH = 1_790_000_000 * BILLION  # when every virtual flight begins, Unix ns
BEGUN_WITHIN = 0.2  # s in which the processes start, each at a moment of its own
LINGER = BILLION // 10  # ns after the flight is over until the recording ends
LONGEST = 3600.0  # s that a flight without an end of its own may take


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a flight went: why it failed (empty when it did not), and its s of virtual time."""

    failure: str
    seconds: float


class World:
    """The processes of `swarm`, flown for `duration` s from take-off to landing; equal seeds give equal flights.

    `tap` is told of every message as it is said (what is heard may be another matter).
    """

    def __init__(
        self, swarm: Swarm, seed: int, duration: float, faults: tuple[Fault, ...] = (), tap: Tap | None = None
    ) -> None:
        self.scheduler = Scheduler(EPOCH)
        self.director = Director(pilots(swarm), swarm.frame, duration, EPOCH)
        self.links: dict[tuple[str, str], Link] = {}
        self._swarm, self._seed, self._faults, self._tap = swarm, seed, faults, tap
        self._limit = EPOCH + round((duration + LONGEST) * BILLION)
        self.processes = self._processes()
        self._connect()
        self._misfortune = Misfortune(faults, self.scheduler, self.processes, self.links)
        for identity, process in self.processes.items():
            begin = 0.0 if identity == "recorder" else self._chance(f"begin {identity}").random() * BEGUN_WITHIN
            self.scheduler.at(EPOCH + round(begin * BILLION), process.start)

    def run(self) -> Outcome:
        """Fly until the director calls it over."""
        director, scheduler = self.director, self.scheduler
        scheduler.run(self._limit)
        scheduler.run(scheduler.now + LINGER)
        failure = director.failure
        if director.stage is not Stage.OVER:
            failure = failure or f"the flight was not over after {(scheduler.now - EPOCH) / BILLION:.0f} s"
        return Outcome(failure, (scheduler.now - EPOCH) / BILLION)

    def _processes(self) -> dict[str, Process]:
        heard: dict[str, list[Key]] = {one: [] for one in identities(self._swarm) if one != ROUTER}
        for key, _, hearers in policy.flows(self._swarm):
            for hearer in hearers:
                if hearer != "recorder":  # the tap is the recorder's ear
                    heard[hearer].append(key)
        heard[OPERATOR] = [key for key in heard[OPERATOR] if key.kind == "status"]
        return {
            identity: Process(
                self._swarm, identity, self._maker(identity), tuple(keys), self._clock(identity), self.scheduler,
                self._seed, self._tap,
            )
            for identity, keys in heard.items()
        }  # fmt: skip

    def _maker(self, identity: str) -> MakeCore:
        if identity == OPERATOR:
            return lambda _, __: OperatorCore(self.director, self._ordered, self.scheduler.stop)

        def make(now: int, begun: int) -> Core:
            seed = f"{self._swarm.gateway.seed} {self._seed} {identity} {begun}"
            return make_core(self._swarm, identity, now, seed, self._faults)

        return make

    def _clock(self, identity: str) -> LocalClock:
        table, chance = self._swarm.sim, self._chance(f"clock {identity}")
        if identity == OPERATOR:
            return LocalClock(EPOCH)
        offset, drift = chance.uniform(-1.0, 1.0) * table.clock_offset, chance.uniform(-1.0, 1.0) * table.clock_drift
        return LocalClock(EPOCH, round(offset * BILLION), round(drift * BILLION))

    def _connect(self) -> None:
        usual = Conditions.usual(self._swarm.sim)
        places = {identity: {key: k for k, key in enumerate(p.heard)} for identity, p in self.processes.items()}
        for key, speakers, hearers in policy.flows(self._swarm):
            for speaker in speakers:
                if speaker == ROUTER:
                    continue
                outlet = self.processes[speaker].outlets[key] = Outlet(self._swarm, key)
                for hearer in hearers:
                    if hearer != speaker and key in places[hearer]:
                        ends = (speaker, hearer)
                        link = self.links.get(ends) or self._link(ends, usual)
                        outlet.readers.append((link, places[hearer][key]))

    def _link(self, ends: tuple[str, str], usual: Conditions) -> Link:
        ideal = usual if OPERATOR not in ends else Conditions(usual.delay)  # whoever judges the flight sees it all
        link = Link(ends, ideal, self._seed, self.scheduler, self.processes[ends[1]].deliver)
        self.links[ends] = link
        return link

    def _chance(self, what: str) -> Random:
        return Random(f"{self._seed} {what}")  # noqa: S311  (not for secrets)

    def _ordered(self, order: Mission) -> None:
        if order.verb == "takeoff":
            self._misfortune.begin()
