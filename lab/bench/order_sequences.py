"""Random sequences of orders from two terminals and a page, in virtual time: the last one to come down holds.

A draw has three to seven orders, 0.02 to 2 s apart, then one to hold or to land. Each order of a terminal is a process
of its own, which takes up to 1.5 s until it is linked and knows nothing before; the page's orders that go down end its
own starts. Half of the draws have a slow network; in half of them processes are frozen for up to 0.7 s. After the last
hold nobody takes off or flies the formation, after the last landing all are down and stay so. Half of the draws
continue with one start, which must bring all into the formation.
"""

from __future__ import annotations

from dataclasses import dataclass
from random import Random
from typing import NamedTuple

from flockwire_core.domain.airframe import Telemetry
from flockwire_core.domain.order import ENDING, Answer, Mission, Order
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.delivery import ChangeDelivery, OrderDelivery
from flockwire_core.ground.director import POLL_PERIOD
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.formation_planning import ChangeRefusedError, plan_in_time
from flockwire_core.ground.operator import DELIVERIES
from flockwire_core.pilot.orders import rank
from flockwire_core.process.cores import Ground
from flockwire_core.swarm.model import uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import MISSION, PROPOSAL, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Report, Status
from flockwire_lab.network import Conditions
from flockwire_lab.process import Published
from flockwire_lab.virtual_time import LocalClock
from flockwire_lab.world import EPOCH, World
from order_pairs import ON_GROUND, swarm

GIVERS = (("terminal A", "operator"), ("terminal B", "console"), ("page", "console"))  # and on whose session they are
PAGE = 2
STATUS_PERIOD = 0.2  # s in which a pilot reports its phase, with a margin
SLOWEST_BACK = 0.7  # s that a status takes at most
LONGEST = 45.0  # s after the last order until all must have come to rest
LONGEST_PAUSE = 0.7  # s that a process is frozen: after 1 s its drone would land
AT_REST = 4.0  # s for which they must stay there


class Given(NamedTuple):
    """One order of a sequence; times in s."""

    at: float  # when it is asked for, from the flight's beginning
    giver: int  # place in GIVERS
    order: Order
    linked: float  # later, when its process is linked
    timed: float  # later, when it knows swarm time
    planning: float  # that a change takes to be planned


class Pause(NamedTuple):
    """A busy host: a process is frozen."""

    identity: str
    at: float  # s from the flight's beginning
    length: float  # s


@dataclass(frozen=True)
class Sequence:
    """One draw."""

    given: tuple[Given, ...]
    restart: Given | None  # the start that must bring all into the formation, from when all have come to rest
    there: tuple[float, float]  # s that messages of each session take to the others
    back: tuple[float, float]
    clocks: tuple[float, float]  # s by which they are off
    pauses: tuple[Pause, ...]

    @classmethod
    def drawn(cls, seed: int) -> Sequence:
        """Return the draw of `seed`."""
        chance = Random(f"sequence {seed}")
        slow = chance.random() < 0.5
        there = tuple(chance.uniform(0.0, 2.0 if slow else 0.02) for _ in range(2))
        back = tuple(min(delay, SLOWEST_BACK) for delay in there)  # slower, and statuses are too old to count
        at, given = 3.0, []
        if chance.random() < 0.5:
            given.append(_given(chance, at, "start"))
            at += 10.0 + there[0] + there[1]
        verbs = [chance.choice(("start", "start", "formation", "hold", "land")) for _ in range(chance.randint(3, 7))]
        widest = chance.choice((0.3, 1.0, 2.0))
        for verb in (*verbs, chance.choice(("hold", "land"))):
            at += chance.uniform(0.02, widest)
            given.append(_given(chance, at, verb))
        restart = _given(chance, 0.0, "start") if chance.random() < 0.5 else None
        offset = chance.choice((-0.1, 0.1))
        begin, busy = given[0].at, ("operator", "console", "leader", "uav1", "uav2", "gateway")
        pauses = tuple(
            Pause(chance.choice(busy), chance.uniform(begin, at + 1.0), chance.uniform(0.1, LONGEST_PAUSE))
            for _ in range(chance.choice((0, 0, 1, 3)))
        )
        return cls(tuple(given), restart, (there[0], there[1]), (back[0], back[1]), (offset, -offset), pauses)

    def __str__(self) -> str:
        orders = (
            f"{one.at:.2f} s {GIVERS[one.giver][0]}: {one.order.verb} {one.order.formation}" for one in self.given
        )
        return "; ".join(order.strip() for order in orders)


def _given(chance: Random, at: float, verb: str) -> Given:
    giver = chance.randrange(len(GIVERS))
    formation = chance.choice(("", "wide")) if verb in ("start", "formation") else ""
    linked = 0.0 if giver == PAGE else chance.uniform(0.1, 1.5)
    timed = 0.0 if giver == PAGE or verb in ENDING else chance.uniform(0.0, 0.5)
    return Given(at, giver, Order(verb, formation), linked, timed, chance.uniform(0.05, 1.5))


class Received:
    """The newest status of each process and telemetry of each drone that one process has received."""

    def __init__(self) -> None:
        self.statuses: dict[str, Status] = {}
        self.telemetry: dict[int, Telemetry] = {}


class Asked:
    """An order that is under way, with what the process that gives it has received."""

    def __init__(self, given: Given, made: OrderDelivery, linked: int, page: Received | None) -> None:
        self.given, self.giving, self.linked = given, made, linked
        self.begins = linked + nanoseconds(given.timed)
        self.received = Received() if page is None else page
        self.planned = 0  # when its plan is made, ns


class Desk(Ground):
    """A host where terminals are opened, or a console with its page."""

    period = POLL_PERIOD

    def __init__(self, plan: Plan) -> None:
        self.under_way: list[Asked] = []
        self.replies: list[tuple[Given, Answer]] = []
        self._plan, self._page = plan, Received()
        self._drones = {uav(drone): drone for drone in plan.pilots}

    def give(self, given: Given, number: int, now: int) -> None:
        """Have `given` asked for now, by a giver with this number; the page's ends its own starts."""
        page = given.giver == PAGE
        if page and given.order.verb in ENDING:
            self.under_way = [a for a in self.under_way if a.given.giver != PAGE or a.given.order.verb in ENDING]
        made = DELIVERIES[given.order.verb](self._plan, given.order, number, now)
        self.under_way.append(Asked(given, made, now + nanoseconds(given.linked), self._page if page else None))

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take a status or telemetry in, for the page and each terminal that is linked."""
        linked = [asked.received for asked in self.under_way if now >= asked.linked]
        for received in (self._page, *linked):
            if isinstance(message, Status):
                received.statuses[message.identity] = message
            elif isinstance(message, Telemetry):
                received.telemetry[self._drones[key.owner]] = message

    def report(self, now: int) -> Report:
        """Return that it serves."""
        return Report("serving")

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Give the orders that are due."""
        messages: list[tuple[Key, Message]] = []
        for asked in self.under_way:
            if now < asked.begins or self._plans(asked, now):
                continue
            received = asked.received
            message = asked.giving.step(Fleet(self._plan.pilots, received.statuses, received.telemetry, now))
            if isinstance(message, Mission):
                messages.append((MISSION if rank(message) else PROPOSAL, message))
            if asked.giving.answer is not None:
                self.replies.append((asked.given, asked.giving.answer))
        self.under_way = [asked for asked in self.under_way if asked.giving.answer is None]
        return messages

    def _plans(self, asked: Asked, now: int) -> bool:
        """Return whether the order waits for its plan."""
        made = asked.giving
        if not isinstance(made, ChangeDelivery) or made.to_plan is None:
            return False
        asked.planned = asked.planned or now + nanoseconds(asked.given.planning)
        if now < asked.planned:
            return True
        asked.planned = 0
        try:
            made.planned(plan_in_time(self._plan.swarm, made, lambda: now))
        except ChangeRefusedError as error:
            made.planned(None, str(error))
        return False


class Watch:
    """The newest report of each pilot, and what each did that the last order forbids, from when that had arrived."""

    def __init__(self) -> None:
        self.reports: dict[str, Report] = {}
        self.pilots: tuple[str, ...] = ()
        self.last = ""  # the verb of the last order that goes down
        self.arrived = 0  # when all pilots have it, Unix ns
        self.moved = 0  # when a phase or an order that holds changed last, Unix ns
        self.wrong = ""

    def take(self, published: Published) -> None:
        """Take one message."""
        if published.key.kind != "status":
            return
        if not isinstance(status := published.message, Status) or status.identity not in self.pilots:
            return
        was = self.reports.get(status.identity)
        now, self.reports[status.identity] = status.report, status.report
        if was is None or (was.phase, was.mission, was.unnumbered) != (now.phase, now.mission, now.unnumbered):
            self.moved = status.stamp
        if was is not None and self.last and status.stamp > self.arrived and not self.wrong:
            self.wrong = self._wrong(status.identity, status.stamp, was, now)

    def _wrong(self, pilot: str, stamp: int, was: Report, now: Report) -> str:
        """Return what is wrong about a pilot's phase `now`."""
        rising = was.phase in ON_GROUND and now.phase not in ON_GROUND
        up = (Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION) if self.last == "land" else (Phase.FORMATION,)
        if rising or now.phase in up:
            order = now.mission
            verb = order.verb if order is not None else "nothing"
            return f"{(stamp - self.arrived) / SECOND:.1f} s after the last {self.last} {pilot}: {now.phase} by {verb}"
        return ""


@dataclass(frozen=True)
class Outcome:
    """How a draw ended: what is wrong with it (empty: nothing)."""

    seed: int
    sequence: Sequence
    wrong: str
    replies: tuple[str, ...]


def fly(seed: int) -> Outcome:
    """Fly one draw."""
    sequence, watch, chance = Sequence.drawn(seed), Watch(), Random(f"givers {seed}")
    world = World(swarm(), seed, 0.0, (), watch.take, stations=("console",))
    watch.pilots = tuple(world.plan.pilots.values())
    desks = {name: Desk(world.plan) for name in ("operator", "console")}
    for name, out, home, clock in zip(desks, sequence.there, sequence.back, sequence.clocks, strict=True):
        world.seat(name, desks[name])
        world.processes[name].clock = LocalClock(EPOCH, nanoseconds(clock))
        for (sender, receiver), link in world.links.items():
            if name in (sender, receiver):  # each drone has links of its own: orders cross on the way to some
                link.disturb(Conditions((out if sender == name else home) * chance.uniform(0.2, 1.0)))

    def give(given: Given, at: int) -> None:
        name = GIVERS[given.giver][1]
        number = chance.getrandbits(31)
        world.scheduler.at(at, lambda _: desks[name].give(given, number, world.processes[name].clock.read(at)))

    for given in sequence.given:
        give(given, EPOCH + nanoseconds(given.at))
    for identity, at, length in sequence.pauses:
        world.scheduler.at(EPOCH + nanoseconds(at), world.processes[identity].freeze)
        world.scheduler.at(EPOCH + nanoseconds(at + length), world.processes[identity].thaw)
    paused = sum(length for _, _, length in sequence.pauses)
    last = sequence.given[-1]
    slowest = sequence.there[0 if last.giver == 0 else 1]
    watch.last = last.order.verb
    watch.arrived = EPOCH + nanoseconds(last.at + last.linked + POLL_PERIOD + slowest + STATUS_PERIOD + paused)
    world.scheduler.run(watch.arrived)
    wrong = _rested(world, desks, watch)
    watch.last = ""
    if not wrong and sequence.restart is not None:
        begin = world.scheduler.now
        give(sequence.restart, begin + 1)
        world.scheduler.run(begin + SECOND)
        wrong = _started(world, desks, watch)
    replies = tuple(
        f"{given.at:.2f} {GIVERS[given.giver][0]} {given.order.verb}: {answer}"
        for desk in desks.values() for given, answer in desk.replies
    )  # fmt: skip
    return Outcome(seed, sequence, wrong, replies)


def _rested(world: World, desks: dict[str, Desk], watch: Watch) -> str:
    """Fly until all have come to rest as the last order has it; return what is wrong, empty when nothing is."""
    rest = ON_GROUND if watch.last == "land" else (*ON_GROUND, Phase.HOLD)
    return _until(world, watch, rest, desks)


def _started(world: World, desks: dict[str, Desk], watch: Watch) -> str:
    """Fly until all are in the formation; return what is wrong, empty when nothing is."""
    wrong = _until(world, watch, (Phase.FORMATION,), desks)
    answers = [answer for desk in desks.values() for _, answer in desk.replies[-1:]]
    return f"a start, well known: {wrong}; {answers}" if wrong else ""


def _until(world: World, watch: Watch, phases: tuple[Phase, ...], desks: dict[str, Desk]) -> str:
    """Fly until all have been in `phases` for long and no order is under way; return what is wrong."""
    end = world.scheduler.now + nanoseconds(LONGEST)
    while world.scheduler.now < end and not watch.wrong:
        world.scheduler.run(world.scheduler.now + SECOND)
        quiet = world.scheduler.now - watch.moved > nanoseconds(AT_REST)
        there = all(watch.reports[pilot].phase in phases for pilot in watch.pilots)
        if quiet and there and not any(desk.under_way for desk in desks.values()):
            return ""
    return (
        watch.wrong
        or f"not at rest: { {p: (r.phase, r.mission.verb if r.mission else '') for p, r in watch.reports.items()} }"
    )
