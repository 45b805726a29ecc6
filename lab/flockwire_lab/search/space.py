"""The space of a search: a point of the unit cube is a flight, by the same draws as a study's."""

from __future__ import annotations

from collections.abc import MutableSequence, Sequence
from dataclasses import dataclass
from math import ceil
from random import Random
from typing import Annotated, Any, Literal, TypeVar

from flockwire_core.swarm.airframes import KINEMATICS
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.tables import Items
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.plan import Plan
from pydantic import Field

from flockwire_lab.search.drawing import ENDING_KINDS, SEARCHED_KINDS, random_fault
from flockwire_lab.search.flight import Case, Mode
from flockwire_lab.study.file import Draw, Study
from flockwire_lab.study.variation import Table, vary

Element = TypeVar("Element")
PATH = "leader.trajectory"  # in the swarm file
BATCH = 16  # flights of a turn


class SearchPlan(Study):
    """A search: a study whose random values are looked for, and faults of any kind besides those that it lists."""

    runs: Annotated[int, Field(ge=1)] = 1000
    duration: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = 8.0
    mode: Mode = "safety"
    method: Literal["search", "draws"] = "search"
    any_faults: Annotated[int, Field(ge=0)] = 3  # at most, in a flight
    kinds: Items[str] = ()  # of those; default: all, in the mode liveness all that end

    @property
    def fault_kinds(self) -> tuple[str, ...]:
        """The kinds of the faults of any kind; raises InputError for an unknown one."""
        known = ENDING_KINDS if self.mode == "liveness" else SEARCHED_KINDS
        for kind in self.kinds:
            if kind not in known:
                raise InputError(f"kinds = {kind!r}: must be one of {', '.join(known)}")
        return self.kinds or known


class Genes(Random):
    """Chance that returns given numbers from 0 to 1 first, then random ones that only depend on them.

    A choice from n takes the n-th part of the interval, so that near numbers choose the same.
    """

    def __init__(self, numbers: Sequence[float]) -> None:
        super().__init__(repr(list(numbers)))
        self._numbers = iter(numbers)

    def random(self) -> float:
        """Return the next number, below 1."""
        given = next(self._numbers, None)
        return super().random() if given is None else min(max(float(given), 0.0), 1.0 - 1e-12)

    def choice(self, population: Any) -> Any:  # noqa: ANN401  (as in Random)
        """Return an element."""
        return population[int(self.random() * len(population))]

    def randint(self, a: int, b: int) -> int:
        """Return an integer from a to b."""
        return a + int(self.random() * (b - a + 1))

    def sample(self, population: Any, k: int, *, counts: Any = None) -> list[Any]:  # noqa: ANN401
        """Return k different elements."""
        rest = list(population)
        return [rest.pop(int(self.random() * len(rest))) for _ in range(k)]

    def shuffle(self, x: MutableSequence[Any]) -> None:
        """Bring a list into another order."""
        x[:] = self.sample(x, len(x))


@dataclass(frozen=True, slots=True)
class Candidate:
    """A point of the unit cube to fly with `seed`."""

    point: tuple[float, ...]
    seed: int


class Space:
    """The flights that a plan varies the swarm file's content `table` to; raises InputError for a bad plan."""

    def __init__(self, plan: SearchPlan, table: Table, swarm: Swarm) -> None:
        slot = 10  # coordinates of one fault of any kind
        if plan.grid:
            raise InputError(f"grid.{min(plan.grid)}: a search has no grid; search each combination by itself")
        self._plan, self._table, self._kinds = plan, table, plan.fault_kinds
        lengths = dict.fromkeys(plan.random, 1)
        if plan.starts is not None:
            lengths["starts"] = 2 * len(swarm.drones)
        if plan.graph is not None:
            lengths["graph"] = 3 * len(swarm.drones)
        for place, fault in enumerate(plan.faults):
            lengths[f"fault {place}"] = 1 + sum(isinstance(value, Draw) for value in fault.table.values())
        lengths |= {f"any {place}": slot for place in range(plan.any_faults)}
        self.size = sum(lengths.values())
        ends = [sum(list(lengths.values())[: k + 1]) for k in range(len(lengths))]
        self._parts = {name: slice(end - lengths[name], end) for name, end in zip(lengths, ends, strict=True)}

    def case(self, point: Sequence[float], seed: int) -> Case:
        """Return the flight of a point; raises InputError if its values are refused."""
        plan = self._plan
        varied = vary(plan, self._table, (), seed, lambda what: Genes(point[self._parts[what]]))
        faults = list(varied.fault_table["faults"])
        wiring = Plan(varied.swarm.in_simulation())
        for place in range(plan.any_faults):
            genes = Genes(point[self._parts[f"any {place}"]])
            kind = genes.choice(("", *self._kinds))
            if kind:
                faults.append(random_fault(kind, wiring, plan.duration, genes))
        faults.sort(key=lambda fault: float(fault["at"]))
        return Case(varied.table, faults, seed, plan.duration, plan.mode)


def usual_space(table: Table, swarm: Swarm, mode: Mode) -> dict[str, Any]:
    """Return the keys of a search without a file: network, clocks, lag, starts, the leader's path and obstacles.

    In the mode liveness network, clocks and airframes are as in the swarm file: their faults must end.
    """
    small = 0.3  # m, and the share of a speed, by which the usual space varies what the swarm file has
    spans = _conditions(swarm) if mode == "safety" else {}
    path: dict[str, Any] = table
    for key in PATH.split("."):
        path = path.get(key, {})
    moved = {f"{PATH}.velocity": (path.get("velocity", ()), small * swarm.reference.input_bound)}
    moved |= {f"{PATH}.points.{place}": (point, small) for place, point in enumerate(path.get("points", ()))}
    obstacles = enumerate(table.get("obstacles", ()))
    moved |= {f"obstacles.{place}.center": (obstacle["center"], small) for place, obstacle in obstacles}
    for key, (values, reach) in moved.items():
        for axis, value in enumerate(values[:2]):
            spans[f"{key}.{axis}"] = {"uniform": [value - reach, value + reach]}
    box, centre = [], []
    for axis, places in enumerate(list(zip(*(drone.start for drone in swarm.drones), strict=True))[:2]):
        width, middle = ceil(max(places) - min(places)) + 1, (min(places) + max(places)) / 2.0
        low = max(middle - width / 2.0, swarm.limits.fence.low[axis])
        high = min(middle + width / 2.0, swarm.limits.fence.high[axis])
        box.append(high - low)
        centre.append((low + high) / 2.0)
    return {"random": spans, "starts": {"box": box, "centre": centre}}


def _conditions(swarm: Swarm) -> dict[str, Any]:
    spans: dict[str, Any] = {
        "sim.delay": {"log_uniform": [1e-4, 0.03]},
        "sim.jitter": {"uniform": [0.0, 0.03]},
        "sim.loss": {"uniform": [0.0, 0.2]},
        "sim.reordering": {"uniform": [0.0, 0.2]},
        "sim.clock_offset": {"uniform": [0.0, 0.5 if len(swarm.hosts) > 1 else 0.02]},  # one host has one clock
    }
    if KINEMATICS.kind in {drone.airframe for drone in swarm.drones}:
        spans[f"airframes.{KINEMATICS.kind}.lag"] = {"uniform": [0.0, 0.25]}
        spans[f"airframes.{KINEMATICS.kind}.dead_time"] = {"uniform": [0.0, 0.1]}
    return spans
