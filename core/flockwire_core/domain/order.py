"""Orders: what an operator asks for and is answered, and what all drones receive, a mission or a stop."""

from __future__ import annotations

from typing import Final, NamedTuple

MISSION_VERBS = ("prepare", "takeoff", "start", "formation", "hold", "land")  # "prepare" names drones that are left out
IN_FORMATION: Final = ("start", "formation")  # "formation" is "start", but only for drones in the air
ENDING: Final = ("hold", "land", "stop")  # orders that end a pending start or change
LONGEST_CHANGE = 600.0  # s
MOST_VERSIONS = 16  # orders that one message names

Version = tuple[int, int]
"""The identity of an order: its stamp and its giver. Versions are compared for equality: no clock decides."""


class Order(NamedTuple):
    """One order of an operator."""

    verb: str  # "start", "formation", "hold", "land" or "stop"
    formation: str = ""  # what a start or a change flies: a name from [formations], empty: the first formation
    duration: float | None = None  # s that a change takes, None: the shortest that keeps to all limits
    without: tuple[int, ...] = ()  # the drones that a start leaves on the ground
    reason: str = "the operator's order"  # why the motors are to stop


class Answer(NamedTuple):
    """Processes that confirmed an order, those that did not, the reason (empty: unknown), and a note."""

    confirmed: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    refusal: str = ""
    note: str = ""

    @property
    def failure(self) -> str:
        """Why not all confirmed it, empty if they did."""
        return self.refusal or (f"sent, but not confirmed by {', '.join(self.missing)}" if self.missing else "")


def overtaken(verb: str) -> Answer:
    """Return the answer to an order that another giver, or another station, replaced by `verb`."""
    return Answer(refusal=f"{verb} was ordered meanwhile")


class Change(NamedTuple):
    """The change to a formation: the one `before`, and the assignments of places in both.

    `places_before[k]` and `places[k]` are the ranks of the k-th follower. `begin` is Unix ns, `duration` s.
    """

    begin: int
    duration: float
    before: str  # a name from [formations], empty for [formation]
    places_before: tuple[int, ...]
    places: tuple[int, ...]


class Mission(NamedTuple):
    """An order to all drones, and its place in the gateway's log of orders.

    `number` is that of the log with this order as the one in force; of a proposal, the number that the log had when it
    was made; of a hold or a landing that the gateway has not received yet, 0. `downs` are the holds and landings that
    the log received last.
    """

    stamp: int  # Unix ns, by the giver's clock
    frame: str
    verb: str  # one of MISSION_VERBS
    start: int = 0  # Unix ns of the formation's time 0 (verbs IN_FORMATION)
    formation: str = ""  # a name from [formations], empty for [formation]
    change: Change | None = None  # None without a change: each follower has the place of its rank
    without: tuple[int, ...] = ()  # drones that stay on the ground; no drone waits for them
    giver: int = 0  # number of the giver: 31 bits, one for each flight or order of a station
    number: int = 0
    downs: tuple[Version, ...] = ()
    ahead: int = 0  # ns by which its receiver's time is ahead of swarm time; not sent

    @property
    def version(self) -> Version:
        """The version of this order."""
        return self.stamp, self.giver

    def shift(self, by: int) -> Mission:
        """Return it with its times moved by `by` ns; its stamp is its name, and stays."""
        change = self.change
        return self._replace(
            ahead=self.ahead + by,
            start=self.start + by if self.start else 0,
            change=change._replace(begin=change.begin + by) if change is not None else None,
        )

    @property
    def given(self) -> int:
        """When it was given, in its receiver's time, ns."""
        return self.stamp + self.ahead

    def has(self, order: Mission) -> bool:
        """Return whether the log that this order is of has `order`: it is this one, or one of `downs`."""
        return order.version == self.version or order.version in self.downs

    @property
    def in_formation(self) -> bool:
        """Whether it orders a formation."""
        return self.verb in IN_FORMATION


class Stop(NamedTuple):
    """Emergency stop, motors off."""

    stamp: int
    frame: str
    reason: str
