"""Decides which of several stations' orders is in force: down always, up only with knowledge.

A landing and a hold are obeyed whoever gives them and whenever they arrive; a landing outranks a hold. An upward order
(prepare, take-off, start, formation) names the orders that its giver knew. It is rejected if an order in force is not
among them: compare and set, by versions, so that no clock decides between two stations. The set of received orders
decides, not their sequence.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from flockwire_core.control.formation import Formation
from flockwire_core.control.formation_change import FormationChange
from flockwire_core.domain.order import Mission, Version
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.status import Counts, Report, counted

DOWN = {"hold": 1, "land": 2}  # the orders that need no knowledge, with their ranks; all others are below
CAME_DOWN = 1 << 31  # marks the version of an order whose drone landed without an order
REMEMBERED: Final = 256  # orders that stay known
MOST_CONCURRENT = 30  # orders that an upward order must name: no station names more than MOST_VERSIONS
AHEAD: Final = SECOND  # ns by which an upward order's stamp may be ahead


def rank(mission: Mission | None) -> int:
    """Return the rank of an order: 2 for a landing, 1 for a hold, 0 for an upward order, -1 for none."""
    return -1 if mission is None else DOWN.get(mission.verb, 0)


def came_down(mission: Mission) -> Version:
    """Return the version that means: a drone that obeyed `mission` landed without an order."""
    return Version(mission.stamp, mission.giver | CAME_DOWN)


class Orders:
    """The orders that one process has received.

    `mission` is the one in force. `concurrent` are others that an upward order must name; `taken` is the time of the
    newest received order, Unix ns, `rejected` the version of the last rejected one.
    """

    def __init__(self) -> None:
        self.mission: Mission | None = None
        self.concurrent: tuple[Version, ...] = ()
        self.taken: int | None = None
        self.rejected: Version | None = None
        self._rejections = 0
        self._past: dict[Version, None] = {}  # these do not come into force again

    @property
    def newest(self) -> tuple[Version, ...]:
        """The versions that an upward order must name."""
        return self.concurrent if self.mission is None else (self.mission.version, *self.concurrent)

    @property
    def counts(self) -> Counts:
        """The number of rejected orders, for a status."""
        return counted(("orders rejected", self._rejections))

    def age(self, now: int) -> float:
        """Return the time, s, since the last change of the orders at `now` (Unix ns); -1 before the first."""
        return -1.0 if self.taken is None else (now - self.taken) / SECOND

    def take(self, order: Mission, now: int) -> bool:
        """Receive `order` at `now` (Unix ns); returns whether the order in force changed."""
        version = order.version
        if version in self._past:
            return False
        known = frozenset(order.knows)
        if not rank(order) and not (known.issuperset(self.newest) and order.given <= now + AHEAD):
            self._reject(version)
            return False
        self._remember((version,) if rank(order) else (*order.knows, version))  # a downward order cancels no other
        self.taken = now
        if 0 < rank(order) < rank(self.mission):  # a hold does not cancel a landing
            self.concurrent = (*_without(self.concurrent, known), version)
            return False
        self.concurrent = _without(self.newest, known)
        self.mission = _interrupting(order, self.mission)
        return True

    def ended(self) -> None:
        """Record that the drone landed without an order: the next upward order must name this."""
        if self.mission is None or self.mission.verb == "land" or came_down(self.mission) in self.concurrent:
            return
        self.concurrent = (*self.concurrent, came_down(self.mission))

    @property
    def spent(self) -> bool:
        """Whether the drone has landed since the order in force."""
        return self.mission is not None and came_down(self.mission) in self.concurrent

    def _reject(self, version: Version) -> None:
        if version != self.rejected:
            self.rejected = version
            self._rejections += 1

    def _remember(self, versions: Iterable[Version]) -> None:
        for version in versions:
            self._past[version] = None
        while len(self._past) > REMEMBERED:
            del self._past[next(iter(self._past))]


def _without(versions: tuple[Version, ...], known: frozenset[Version]) -> tuple[Version, ...]:
    """Return those of `versions` that are not `known`, at most the last ones."""
    return tuple([version for version in versions if version not in known][-MOST_CONCURRENT:])


def _interrupting(order: Mission, was: Mission | None) -> Mission:
    """Return `order` with the formation that it interrupts; hold and landing are for flying drones."""
    if was is None or not rank(order):
        return order
    order = order._replace(without=order.without or was.without)
    if order.verb == "hold" and not order.start:
        order = order._replace(start=was.start, formation=was.formation, change=was.change)
    return order


def is_known(formations: Mapping[str, Formation], mission: Mission) -> bool:
    """Return whether all formations of `mission` are in `formations`, with a place for each follower."""
    change = mission.change
    if mission.formation not in formations or change is None:
        return mission.formation in formations
    return change.before in formations and len(change.places) == formations[mission.formation].count


def flown_formation(formations: Mapping[str, Formation], mission: Mission) -> Formation:
    """Return the formation of a known `mission`, in the formation's time."""
    after, change = formations[mission.formation], mission.change
    if change is None:
        return after
    begin = (change.begin - mission.start) / SECOND
    before = formations[change.before]
    return FormationChange(before, change.places_before, after, change.places, begin, change.duration)


def flown_place(
    formations: Mapping[str, Formation], mission: Mission, rank: int, held: int | None
) -> tuple[Formation, int]:
    """Return the formation of a known `mission`, and the index in it of the follower of `rank`.

    `held` is the place that it holds by the auction, None: its place is that in the order.
    """
    change = mission.change
    if held is None:
        return flown_formation(formations, mission), rank
    if change is None:
        return formations[mission.formation], held
    places = tuple([held if other == rank else place for other, place in enumerate(change.places)])
    return flown_formation(formations, mission._replace(change=change._replace(places=places))), rank


def reported_place(
    swarm: Swarm, formations: Mapping[str, Formation], report: Report, number: int
) -> tuple[Formation, int] | None:
    """Return the formation of follower `number` and the index of its place, by its report; None if it has none."""
    mission = report.mission
    if mission is None or not mission.in_formation or not is_known(formations, mission):
        return None
    held = report.place if mission.formation in swarm.auctioned else None
    if mission.formation in swarm.auctioned and (held is None or held >= formations[mission.formation].count):
        return None
    return flown_place(formations, mission, swarm.followers.index(number), held)
