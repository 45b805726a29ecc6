"""An order of the operator, as it is given."""

from __future__ import annotations

from typing import NamedTuple


class Order(NamedTuple):
    """One order.

    Args:
        verb: "start", "formation", "hold", "land" or "stop".
        formation: what a start or a change flies: a name from [formations], empty: the first formation.
        duration: s that a change takes, None: the shortest that keeps to all limits.
        without: the drones that a start leaves on the ground.

    """

    verb: str
    formation: str = ""
    duration: float | None = None
    without: tuple[int, ...] = ()
