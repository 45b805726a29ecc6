"""An operator's order and its answer, for all senders of orders."""

from __future__ import annotations

from typing import NamedTuple

ENDING = ("hold", "land", "stop")  # orders that end a pending start or change


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
