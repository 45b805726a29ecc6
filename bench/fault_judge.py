"""Flies one drawn flight in virtual time and judges it by the margins of flockwire_sim.search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Any

from fault_draws import DURATION, drawn
from flockwire_sim.search.flight import Flight, judge
from flockwire_sim.search.robustness import BOUNDS, Bounds, closest


@dataclass
class Result:
    """What became of one flight; distances in m, times in s after the order to take off."""

    seed: int
    variant: str
    usual: bool
    faults: list[dict[str, Any]]
    failure: str = ""
    seconds: float = 0.0
    closest: float = inf
    struck: float = inf  # between a drone that falls and another
    fastest_contact: float = 0.0  # m/s
    world_ended: bool = False
    bad: list[str] = field(default_factory=list)
    rungs: dict[str, float] = field(default_factory=dict)  # when each was first reached
    margins: dict[str, float] = field(default_factory=dict)  # of each property, as a share of its bound

    @property
    def outcome(self) -> str:
        """Return the column of the table."""
        if self.bad:
            return "bad"
        if self.world_ended:
            return "world ended"
        if self.struck < BOUNDS.collision:
            return "struck by a fall"
        return "landed early" if self.failure else "flew on"


def fly(seed: int, say: Callable[[str], None] | None = None, bounds: Bounds = BOUNDS) -> Result:
    """Fly the flight of `seed`; `say` takes what happens, line by line."""
    draw = drawn(seed)
    flight = Flight(draw.swarm, seed, DURATION, draw.injected(), say=say)
    flown = flight.fly(bounds)
    judged = judge(flown, flight.recorder, list(draw.faults), bounds)
    contact = judged.margins.get("contact")
    return Result(
        seed, draw.variant, draw.usual, list(draw.faults), judged.failure, judged.seconds, closest(flown),
        closest(flown, falls=True),
        0.0 if contact is None else (1.0 - contact.value) * (draw.swarm.limits.vertical_speed + bounds.hard),
        judged.world_ended, judged.violations, judged.rungs,
        {name: round(margin.value, 4) for name, margin in judged.margins.items()},
    )  # fmt: skip
