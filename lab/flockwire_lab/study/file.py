"""The study file: TOML in, frozen models out.

seed = 0
runs = 200                                   # of each grid point
duration = 20.0                              # s from take-off to landing
[starts]
box = [6.0, 6.0]                             # m, round `centre`
[graph]
depth = 4                                    # hops from the leader, at most
extra_edges = 2
[grid]                                       # every combination is flown, on the same seeds
"control.law" = ["paper", "extended"]
[random]                                     # drawn again for each run
"gateway.noise" = { log_uniform = [1e-4, 1e-2] }
"sim.delay" = { uniform = [0.0, 0.05] }
[[faults]]                                   # as in a file of faults; values may be drawn too
kind = "restart"
process = { choice = ["uav1", "uav2"] }
at = { uniform = [5.0, 12.0] }
probability = 0.5
"""

from __future__ import annotations

from hashlib import blake2b
from itertools import product
from pathlib import Path
from random import Random
from typing import Annotated, Any, TypeVar

from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.reading import read_toml
from flockwire_core.swarm.tables import Corner, Items, Model, Positive, Probability
from flockwire_core.swarm.validation import validate
from flockwire_core.swarm.wording import InputError
from pydantic import Field, JsonValue, model_validator

GridPoint = tuple[tuple[str, JsonValue], ...]  # one combination of the grid: key, value
PositivePair = Annotated[tuple[Positive, Positive], Field(strict=False)]
Choice = Annotated[Items[JsonValue], Field(min_length=1)]
KINDS = ("uniform", "log_uniform", "integer", "choice")


class Starts(Model):
    """Each drone starts anywhere in a box, at its own height; m, between centres (obstacles: from the surface)."""

    box: PositivePair
    centre: Corner = (0.0, 0.0)
    spacing: Positive = 0.6
    obstacle_spacing: Positive = 0.6
    fixed: Items[int] = ()  # drones that start as in the swarm file, such as the leader, 0


class RandomGraph(Model):
    """A random tree from the leader, and edges beyond it."""

    depth: Annotated[int, Field(ge=1)] | None = None
    extra_edges: Annotated[int, Field(ge=0)] = 0


class Draw(Model):
    """A random value: from a range with both ends, or from a list."""

    uniform: Corner | None = None
    log_uniform: PositivePair | None = None
    integer: Annotated[tuple[int, int], Field(strict=False)] | None = None
    choice: Choice | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Draw:
        if len(self.model_fields_set) != 1:
            raise ValueError(f"must have exactly one of {', '.join(KINDS)}")
        ends = self.uniform or self.log_uniform or self.integer
        if ends is not None and ends[0] > ends[1]:
            raise ValueError(f"the range must be ascending, {ends[0]:g} is above {ends[1]:g}")
        return self

    def value(self, chance: Random) -> JsonValue:
        """Return a value drawn by `chance`."""
        if self.uniform is not None:
            return chance.uniform(*self.uniform)
        if self.log_uniform is not None:
            low, high = self.log_uniform
            return min(max(low * float((high / low) ** chance.random()), low), high)
        if self.integer is not None:
            return chance.randint(*self.integer)
        return chance.choice(self.choice or ())

    def extremes(self) -> tuple[JsonValue, ...]:
        """Return the values to try before the study starts."""
        return self.choice or self.uniform or self.log_uniform or self.integer or ()


class RandomFault(Model):
    """A fault that is injected into a share of the runs; each value of `table` may be a Draw."""

    probability: Probability = 1.0
    table: dict[str, Annotated[Draw | JsonValue, Field(union_mode="left_to_right")]]


class Study(Model):
    """A whole study: runs, duration and variations."""

    seed: Annotated[int, Field(ge=0)] = 0
    runs: Annotated[int, Field(ge=1)] = 100
    duration: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = 20.0
    starts: Starts | None = None
    graph: RandomGraph | None = None
    grid: dict[str, Choice] = Field(default={})
    random: dict[str, Draw] = Field(default={})
    faults: Items[RandomFault] = ()

    @model_validator(mode="after")
    def _once(self) -> Study:
        twice = self.grid.keys() & self.random.keys()
        if twice:
            raise ValueError(f"random.{min(twice)}: is in the grid already")
        return self

    @property
    def points(self) -> tuple[GridPoint, ...]:
        """Every combination of the grid; one empty combination when there is no grid."""
        return tuple(tuple(zip(self.grid, values, strict=True)) for values in product(*self.grid.values()))

    def equal_runs(self, swarm: Swarm) -> bool:
        """Return whether all runs of a grid point are equal, because nothing is random."""
        gateway, world = swarm.gateway, swarm.sim
        chances = (world.jitter, world.loss, world.reordering, world.clock_offset, world.clock_drift)
        grid = any(key.startswith(("gateway.", "sim.")) for key in self.grid)
        drawn = self.starts or self.graph or self.random or self.faults
        return not (drawn or grid or gateway.noise or gateway.dropout or any(chances))

    def seed_of(self, run: int) -> int:
        """Return the seed of run `run`, the same at all grid points."""
        return int.from_bytes(blake2b(f"{self.seed} {run}".encode(), digest_size=6).digest(), "big")


Plan = TypeVar("Plan", bound=Study)


def load_study(path: Path | None, options: dict[str, object], kind: type[Plan]) -> Plan:
    """Read a file of a study, of `kind` (none: all defaults); `options` override its keys. Raises InputError."""
    origin = str(path) if path is not None else "options"
    table = read_toml(path, "study", InputError) if path is not None else {}
    return validate(kind, _spelled_out(table | options), origin, InputError)


def _spelled_out(table: dict[str, Any]) -> dict[str, Any]:
    """Take `control.law = [...]` for `"control.law" = [...]`, and separate faults from their probability."""
    for key in ("grid", "random"):
        if isinstance(table.get(key), dict):
            table[key] = dict(_leaves(table[key], ""))
    if isinstance(table.get("faults"), list):
        table["faults"] = [_fault(one) if isinstance(one, dict) else one for one in table["faults"]]
    return table


def _fault(table: dict[str, Any]) -> dict[str, Any]:
    share = {"probability": table["probability"]} if "probability" in table else {}
    return {"table": {key: value for key, value in table.items() if key != "probability"}, **share}


def _leaves(table: dict[str, Any], prefix: str) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, value in table.items():
        name = f"{prefix}{key}"
        inner = isinstance(value, dict) and not value.keys() & set(KINDS)
        found += _leaves(value, f"{name}.") if inner else [(name, value)]
    return found
