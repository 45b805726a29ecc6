"""A whole swarm as one frozen model: the tables of a swarm file put together.

One file describes the whole swarm and every process reads it once (loading.py). Lengths are metres, times seconds,
angles radians, the world frame is ENU with Z up. Unknown keys are refused; whatever can have a default has one.
"""

from __future__ import annotations

import re
from functools import cached_property

from pydantic import Field, field_validator

from flockwire.control import formation as shapes
from flockwire.control.graph import LEADER, Graph
from flockwire.control.survey import Survey, survey
from flockwire.swarm.formations import FormationTable
from flockwire.swarm.tables import (
    Airframe,
    Avoidance,
    Checks,
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

SURVEY_HORIZON = 120.0  # s of every formation that are looked at
SURVEY_SAMPLES = 400


def uav(number: int) -> str:
    """Return the name of drone `number`: the owner of its keys, and what people call it."""
    return f"uav{number}"


class Swarm(Model):
    """A whole swarm; one that loading.py returns has passed every rule and may fly."""

    name: str
    frame: str = "world"
    control: Control = Control()
    observer: Observer = Observer()
    formation: FormationTable
    formations: dict[str, FormationTable] = Field(default={})
    avoidance: Avoidance = Avoidance()
    limits: Limits = Limits()
    checks: Checks = Checks()
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

    @cached_property
    def _by_id(self) -> dict[int, Drone]:
        return {drone.id: drone for drone in self.drones}

    def drone(self, number: int) -> Drone:
        """Return drone `number`; KeyError when the swarm has none."""
        return self._by_id[number]

    def airframe(self, number: int) -> Airframe:
        """Return the airframe parameters of drone `number`."""
        return self.airframes[self.drone(number).airframe]

    def build_formation(self, name: str = "") -> shapes.Formation:
        """Return the formation called `name`, the swarm's first one when empty; KeyError when there is none."""
        return (self.formations[name] if name else self.formation).build(len(self.followers))

    def survey(self, name: str = "") -> Survey:
        """Return the extremes of the formation called `name` over its first SURVEY_HORIZON s; raises as building it."""
        if name not in self._surveys:
            self._surveys[name] = survey(self.build_formation(name), SURVEY_HORIZON, SURVEY_SAMPLES)
        return self._surveys[name]

    @cached_property
    def _surveys(self) -> dict[str, Survey]:
        return {}
