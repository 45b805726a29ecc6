"""Which order holds, where several stations give them: down always, up only with knowledge.

A landing and a hold are obeyed whoever gives them and whenever they arrive; a landing outranks a hold. An order that
takes up (prepare, take-off, start, formation) names the orders that its giver knew of. It is rejected while one holds
that it does not name: compare and set, by versions, so that no clock decides between two stations. What has arrived
decides, not in which order it did.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from flockwire.control.formation import Formation
from flockwire.control.formation_change import FormationChange
from flockwire.domain.order import Mission, Version
from flockwire.domain.time import SECOND
from flockwire.wire.status import Counts, counted

DOWN = {"hold": 1, "land": 2}  # the orders that need no knowledge, and their rank; all others are below
CAME_DOWN = 1 << 31  # marks the version of an order whose drone came down without being ordered to
REMEMBERED = 256  # orders that count as known for good
MOST_CONCURRENT = 30  # orders that one which takes up must name: no station names more than MOST_VERSIONS
AHEAD = SECOND  # ns by which an order that takes up may be stamped ahead of time


def rank(mission: Mission | None) -> int:
    """Return how much an order outranks: 2 for a landing, 1 for a hold, 0 for what takes up, -1 for none."""
    return -1 if mission is None else DOWN.get(mission.verb, 0)


def came_down(mission: Mission) -> Version:
    """Return the version that stands for: a drone that obeyed `mission` came down without an order to land."""
    return Version(mission.stamp, mission.giver | CAME_DOWN)


class Orders:
    """The orders that one process has taken in.

    `mission` is the one that holds. `concurrent` are the further ones that an order which takes up must name;
    `taken` is when the newest of all was taken in, Unix ns, `rejected` the version of the last one that was not.
    """

    def __init__(self) -> None:
        self.mission: Mission | None = None
        self.concurrent: tuple[Version, ...] = ()
        self.taken: int | None = None
        self.rejected: Version | None = None
        self._rejections = 0
        self._past: dict[Version, None] = {}  # of these none holds again

    @property
    def newest(self) -> tuple[Version, ...]:
        """The versions that an order which takes up must name."""
        return self.concurrent if self.mission is None else (self.mission.version, *self.concurrent)

    @property
    def counts(self) -> Counts:
        """How many orders were rejected, for a status."""
        return counted(("orders rejected", self._rejections))

    def age(self, now: int) -> float:
        """Return for how long, s, the orders have been as they are at `now` (Unix ns); -1 before the first."""
        return -1.0 if self.taken is None else max(0, now - self.taken) / SECOND

    def take(self, order: Mission, now: int) -> bool:
        """Receive `order`, which came at `now` (Unix ns); returns whether another one holds than before."""
        version = order.version
        if version in self._past:
            return False
        known = frozenset(order.knows)
        if not rank(order) and not (known.issuperset(self.newest) and order.stamp <= now + AHEAD):
            self._reject(version)
            return False
        self._remember((version,) if rank(order) else (*order.knows, version))  # what goes down takes nothing back
        self.taken = now
        if 0 < rank(order) < rank(self.mission):  # a hold takes no landing back
            self.concurrent = (*_without(self.concurrent, known), version)
            return False
        self.concurrent = _without(self.newest, known)
        self.mission = _interrupting(order, self.mission)
        return True

    def ended(self) -> None:
        """Take it that the drone came down though no landing was ordered: who takes it up again must know."""
        if self.mission is None or self.mission.verb == "land" or came_down(self.mission) in self.concurrent:
            return
        self.concurrent = (*self.concurrent, came_down(self.mission))

    @property
    def spent(self) -> bool:
        """Whether the drone came down since the order that holds."""
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
    """Return those of `versions` that are not `known`, the last of them where they are many."""
    return tuple([version for version in versions if version not in known][-MOST_CONCURRENT:])


def _interrupting(order: Mission, was: Mission | None) -> Mission:
    """Return `order` with what it interrupts: hold and landing are for those who fly, a hold keeps the formation."""
    if was is None or not rank(order):
        return order
    order = order._replace(without=order.without or was.without)
    if order.verb == "hold" and not order.start:
        order = order._replace(start=was.start, formation=was.formation, change=was.change)
    return order


def is_known(formations: Mapping[str, Formation], mission: Mission) -> bool:
    """Return whether all that `mission` names is in `formations`, and has a place for each follower."""
    change = mission.change
    if mission.formation not in formations or change is None:
        return mission.formation in formations
    return change.before in formations and len(change.places) == formations[mission.formation].count


def flown_formation(formations: Mapping[str, Formation], mission: Mission) -> Formation:
    """Return what `mission`, which is known, has flown, in the formation's time."""
    after, change = formations[mission.formation], mission.change
    if change is None:
        return after
    begin = (change.begin - mission.start) / SECOND
    before = formations[change.before]
    return FormationChange(before, change.places_before, after, change.places, begin, change.duration)
