"""The swarm file: TOML in, one frozen and documented model out.

One file describes the whole swarm and every process reads it once. Lengths are metres, times seconds, angles
radians, the world frame is ENU with Z up. Unknown keys are refused; whatever can have a default has one.
"""

from __future__ import annotations

import json
import re
from functools import cached_property
from pathlib import Path

from pydantic import Field, ValidationError, ValidationInfo, field_validator, model_validator

from flockwire.control import formation as shapes
from flockwire.control.graph import LEADER, Graph
from flockwire.formation_tables import Formation
from flockwire.tables import (
    Airframe,
    Avoidance,
    Control,
    Drone,
    Gateway,
    GraphTable,
    Host,
    Leader,
    Limits,
    Model,
    Network,
    Observer,
    Obstacle,
    Sim,
)
from flockwire.toml_file import read_toml

FLOWN = "flown"  # the context in which to read the swarm of a flight that is over: its law need not be here


class SwarmFileError(ValueError):
    """A swarm file that cannot be flown; each line of the text names one key, its value and the rule."""


class Swarm(Model):
    """A whole swarm, checked: whoever holds one may fly it."""

    name: str
    frame: str = "world"
    control: Control = Control()
    observer: Observer = Observer()
    formation: Formation
    formations: dict[str, Formation] = Field(default={})
    avoidance: Avoidance = Avoidance()
    limits: Limits = Limits()
    leader: Leader = Leader()
    graph: GraphTable
    drones: tuple[Drone, ...]
    airframes: dict[str, Airframe] = Field(default={"kinematics": Airframe()})
    obstacles: tuple[Obstacle, ...] = ()
    gateway: Gateway = Gateway()
    network: Network = Network()
    sim: Sim = Sim()
    hosts: dict[str, Host] = Field(default={"local": Host()})

    @field_validator("name", "frame")
    @classmethod
    def _one_word(cls, value: str) -> str:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,63}", value):
            raise ValueError("must be a letter followed by letters, digits and _ (it becomes part of ROS 2 topics)")
        return value

    @model_validator(mode="after")
    def _flyable(self, info: ValidationInfo) -> Swarm:
        from flockwire import rules  # noqa: PLC0415  (the rules are written against this class)

        problems = list(rules.problems(self, to_fly=info.context != FLOWN))
        if problems:
            raise ValueError("\n".join(problems))
        return self

    @cached_property
    def followers(self) -> tuple[int, ...]:
        """Ids of the followers, ascending; a follower's place in this tuple is its index in the formation."""
        return tuple(sorted(drone.id for drone in self.drones if drone.id != LEADER))

    @cached_property
    def flying(self) -> tuple[int, ...]:
        """Ids of all drones that have an airframe, ascending: the followers and, unless it is virtual, the leader."""
        return tuple(sorted(drone.id for drone in self.drones))

    @cached_property
    def topology(self) -> Graph:
        """The communication graph."""
        return Graph(self.followers, self.graph.edges)

    @cached_property
    def depth(self) -> int:
        """Hops from the leader to the deepest follower."""
        return max(self.topology.depths().values())

    def drone(self, number: int) -> Drone:
        """Return drone `number`; KeyError when the swarm has none."""
        for drone in self.drones:
            if drone.id == number:
                return drone
        raise KeyError(number)

    def airframe(self, number: int) -> Airframe:
        """Return the airframe parameters of drone `number`."""
        return self.airframes[self.drone(number).airframe]

    def build_formation(self, name: str = "") -> shapes.Formation:
        """Return the formation called `name`, the swarm's first one when empty; KeyError when there is none."""
        return (self.formations[name] if name else self.formation).build(len(self.followers))


def load_swarm(path: Path) -> Swarm:
    """Read and check a swarm file.

    Raises SwarmFileError with one line for each problem: file, key, value, rule.
    """
    return parse_swarm(load_table(path), str(path))


def load_table(path: Path) -> dict[str, object]:
    """Read a swarm file, with the key frames it names, as it is; raises SwarmFileError where that cannot be done."""
    table = read_toml(path, "swarm file", SwarmFileError)
    for name, formation in [("formation", table.get("formation")), *_tables(table, "formations")]:
        if isinstance(formation, dict) and formation.get("kind") == "key_frames" and "file" in formation:
            formation["frames"] = _read_key_frames(path, name, str(formation["file"]))
    return table


def parse_swarm(table: dict[str, object], origin: str) -> Swarm:
    """Check the swarm file's content `table`, which came from `origin`; raises SwarmFileError."""
    try:
        return Swarm.model_validate_json(json.dumps(table, default=str))
    except ValidationError as error:
        raise SwarmFileError("\n".join(f"{origin}: {line}" for line in error_lines(error))) from None


def error_lines(error: ValidationError) -> list[str]:
    """Turn what pydantic found into lines of key, value and rule."""
    return [line for detail in error.errors() for line in _lines(dict(detail))]


def _tables(table: dict[str, object], key: str) -> list[tuple[str, object]]:
    inner = table.get(key)
    return [(f"{key}.{name}", value) for name, value in inner.items()] if isinstance(inner, dict) else []


def _read_key_frames(swarm_file: Path, key: str, name: str) -> str:
    try:
        return (swarm_file.parent / name).read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise SwarmFileError(f"{swarm_file}: {key}.file = {name!r}: cannot read it: {error}") from error


def _is_kind(path: tuple[object, ...]) -> bool:
    """Return whether pydantic puts a table's kind behind `path`, which is no key of the file."""
    return path in (("formation",), ("leader", "trajectory")) or (len(path) == 2 and path[0] == "formations")


def _lines(detail: dict[str, object]) -> list[str]:
    """Turn one of pydantic's errors into lines of key, value and rule."""
    location = detail["loc"]
    assert isinstance(location, tuple)  # noqa: S101  (pydantic says so)
    message = str(detail["msg"]).removeprefix("Value error, ")
    if not location:
        return message.split("\n")
    key = ".".join(str(part) for place, part in enumerate(location) if not _is_kind(location[:place]))
    if detail["type"] == "missing":
        return [f"{key}: missing; this key has no default"]
    if detail["type"] == "extra_forbidden":
        return [f"{key} = {detail['input']!r}: unknown key"]
    return [f"{key} = {detail['input']!r}: {message[0].lower()}{message[1:]}"]
