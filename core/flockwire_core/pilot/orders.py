"""Decides which order a process obeys: one from the gateway's log, or a hold or a landing that is not in it yet.

The gateway numbers all orders (ground/order_log.py) and publishes the one in force. A hold and a landing also come
directly from their station, and are obeyed at once. As long as the log has not numbered such an order, it counts as
later than all of the log: no order of the log takes up before.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from flockwire_core.control.formation import Formation, FormationChange
from flockwire_core.domain.order import MOST_VERSIONS, Mission, Version
from flockwire_core.domain.time import SECOND

DOWN = {"hold": 1, "land": 2}  # the orders that need no knowledge, with their ranks; all others are below
UNNUMBERED: Final = "obeys a hold or a landing that the gateway has not received: give it again"


def rank(mission: Mission | None) -> int:
    """Return the rank of an order: 2 for a landing, 1 for a hold, 0 for an upward order, -1 for none."""
    return -1 if mission is None else DOWN.get(mission.verb, 0)


class Orders:
    """The orders that one process has received.

    `mission` is the one that it obeys; `taken` is the time of the newest received order, Unix ns.
    """

    def __init__(self) -> None:
        self.mission: Mission | None = None
        self.taken: int | None = None
        self._logged: Mission | None = None  # the newest of the log
        self._unnumbered: dict[Version, Mission] = {}  # by arrival

    @property
    def number(self) -> int:
        """The number of the log, as received last; 0 before the first."""
        return 0 if self._logged is None else self._logged.number

    @property
    def unnumbered(self) -> tuple[Version, ...]:
        """The received holds and landings that the log has not numbered, by arrival."""
        return tuple(self._unnumbered)

    def age(self, now: int) -> float:
        """Return the time, s, since the last change of the orders at `now` (Unix ns); -1 before the first."""
        return -1.0 if self.taken is None else (now - self.taken) / SECOND

    def take(self, order: Mission, now: int) -> bool:
        """Receive `order` at `now` (Unix ns); returns whether another one is in force."""
        if not self._receive(order):
            return False
        self.taken = now
        was, found = self.mission, self._logged
        for other in self._unnumbered.values():
            found = other if rank(other) >= rank(found) else found
        self.mission = found
        return found is not None and (was is None or found.version != was.version)

    def _receive(self, order: Mission) -> bool:
        """Note `order`; return whether it is new, of the log or one that the log has not numbered."""
        logged = self._logged
        if order.number > self.number:
            self._logged = order
            self._drop(order.downs)
            return True
        if order.number:
            if logged is not None and order.number == logged.number:
                self._correct(order, logged)
            return False
        if not rank(order) or self._has(order):
            return False
        self._unnumbered[order.version] = interrupting(order, self.mission)
        if len(self._unnumbered) > MOST_VERSIONS:
            del self._unnumbered[next(iter(self._unnumbered))]
        return True

    def _correct(self, repeated: Mission, logged: Mission) -> None:
        """Take over the start of the repeated order: the own clock may have been corrected since it came."""
        if repeated.version == logged.version and repeated.start != logged.start:
            self.mission = repeated if self.mission is logged else self.mission
            self._logged = repeated

    def _drop(self, numbered: tuple[Version, ...]) -> None:
        """Remove the orders that the log has numbered, and those before them that they replaced."""
        highest = -1
        for version in reversed(self.unnumbered):
            own = rank(self._unnumbered[version])
            highest = max(highest, own) if version in numbered else highest
            if own <= highest:
                del self._unnumbered[version]

    def _has(self, order: Mission) -> bool:
        return order.version in self._unnumbered or (self._logged is not None and self._logged.has(order))


def interrupting(order: Mission, was: Mission | None) -> Mission:
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
