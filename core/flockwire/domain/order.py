"""What people order: a mission of all drones, or a stop."""

from __future__ import annotations

from typing import NamedTuple

MISSION_VERBS = ("prepare", "takeoff", "start", "formation", "hold", "land")  # "prepare" says who is left out
IN_FORMATION = ("start", "formation")  # "formation" is "start", but for drones in the air alone
LONGEST_CHANGE = 600.0  # s
MOST_VERSIONS = 64  # orders that one message names


class Change(NamedTuple):
    """How a formation is changed to: the one `before`, and who takes which place in either.

    `places_before[k]` and `places[k]` are the ranks of the k-th follower. `begin` is Unix ns, `duration` s.
    """

    begin: int
    duration: float
    before: str  # a name from [formations], empty for [formation]
    places_before: tuple[int, ...]
    places: tuple[int, ...]


class Version(NamedTuple):
    """Which order one is. Versions are compared for equality: no clock decides."""

    stamp: int  # Unix ns, by the clock of who gave it
    giver: int  # a number of who gave it: 31 bits, one for each flight or order that a station conducts


class Mission(NamedTuple):
    """What the operator wants of all drones; each pilot decides by `knows` whether it holds."""

    stamp: int
    frame: str
    verb: str  # one of MISSION_VERBS
    start: int = 0  # Unix time in ns at which the formation's time is 0 (verbs IN_FORMATION)
    formation: str = ""  # a name from [formations], empty for [formation]
    change: Change | None = None  # None if it is flown from the beginning, everybody in the place of their own rank
    without: tuple[int, ...] = ()  # the drones that stay on the ground, and that nobody waits for
    giver: int = 0  # who gave it (Version)
    knows: tuple[Version, ...] = ()  # the orders that its giver knew of, and made it from

    @property
    def version(self) -> Version:
        """Which order it is."""
        return Version(self.stamp, self.giver)

    @property
    def in_formation(self) -> bool:
        """Whether a formation is to be flown."""
        return self.verb in IN_FORMATION


class Stop(NamedTuple):
    """Emergency stop, motors off."""

    stamp: int
    frame: str
    reason: str
