"""A whole swarm as one frozen model: the tables of a swarm file put together.

One file describes the whole swarm and every process reads it once (loading.py). Lengths are metres, times seconds,
angles radians, the world frame is ENU with Z up. Unknown keys are refused; every key that can have a default has one.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Annotated

from pydantic import Field, field_validator
from pydantic.json_schema import SkipJsonSchema

from flockwire_core.control import formation as shapes
from flockwire_core.control.graph import Graph
from flockwire_core.objects import load_object
from flockwire_core.swarm.airframes import AIRFRAMES, ROWS, AirframeRow
from flockwire_core.swarm.drones import BUILT_IN_AIRFRAMES, Airframe, Drone, Wind
from flockwire_core.swarm.formations import FormationTable
from flockwire_core.swarm.gateway import Gateway
from flockwire_core.swarm.leader import AT_REST, Leader, LeaderTable
from flockwire_core.swarm.ros import Ros
from flockwire_core.swarm.tables import (
    Avoidance,
    Checks,
    Control,
    GraphTable,
    Host,
    HostName,
    Items,
    Limits,
    Model,
    Network,
    Observer,
    Obstacle,
    Sensing,
    Sim,
    TrackedObstacle,
    Word,
    key,
)

DEFAULT_FORMATION = "default"  # of [formations]: the first one where the file has no [formation]


def uav(number: int) -> str:
    """Return the name of drone `number`, also the owner of its keys."""
    return f"uav{number}"


class Swarm(Model):
    """A whole swarm. A swarm returned by loading.py has passed every rule and may fly."""

    name: Word = key(..., "the swarm's name: the first part of every key")
    frame: Word = key("world", "name of the world frame, ENU with Z up")
    control: Control = key(Control(), "the control law")
    observer: Observer = key(Observer(), "the fixed-time observer (8)")
    formation: FormationTable | None = key(None, "the first formation")
    formations: dict[str, FormationTable] = key({}, "other formations, by name")
    avoidance: Avoidance = key(Avoidance(), "sensing and required distances")
    sensing: Sensing = key(Sensing(), "noise of what laws see of others")
    limits: Limits = key(Limits(), "speeds, heights, battery, fence")
    checks: Checks = key(Checks(), "bounds that judge a flight")
    leaders: Items[Annotated[int, Field(ge=0)]] = key((0,), "ids of the leaders; `[]`: none, the law needs none")
    leader: LeaderTable = key(LeaderTable(), "the leaders and their paths")
    graph: GraphTable = key(..., "who receives from whom")
    drones: Items[Drone] = key(..., "every drone", max_length=1000)
    airframes: dict[str, Airframe] = key(BUILT_IN_AIRFRAMES, "responses of airframes")
    wind: Wind = key(Wind(), "wind of simulated airframes")
    obstacles: Items[Obstacle] = key((), "fixed obstacles")
    tracked_obstacles: Items[TrackedObstacle] = key((), "moving obstacles that the tracker sees")
    gateway: Gateway = key(Gateway(), "where poses come from")
    network: Network = key(Network(), "the links of processes")
    ros: Ros | None = key(None, "the swarm in ROS 2; this table enables it")
    sim: Sim = key(Sim(), "the network of `flockwire sim`")
    hosts: dict[HostName, Host] = key({"local": Host()}, "the machines")
    folder: SkipJsonSchema[str] = Field("", repr=False, exclude=True)  # of the file, where an own law is searched

    @field_validator("airframes", mode="before")
    @classmethod
    def _with_built_in(cls, value: object) -> object:
        """Add the built-in airframes; a table of the file changes only its own keys."""
        if not isinstance(value, dict):
            return value
        known = {name: airframe.model_dump() for name, airframe in BUILT_IN_AIRFRAMES.items()}
        own = ((name, known.get(name, {}) | one if isinstance(one, dict) else one) for name, one in value.items())
        return known | dict(own)

    @cached_property
    def followers(self) -> tuple[int, ...]:
        """Ids of the followers, ascending; a follower's place in this tuple is its index in the formation."""
        return tuple(sorted(drone.id for drone in self.drones if drone.id not in self.leaders))

    @cached_property
    def tracked(self) -> tuple[int, ...]:
        """Ids of all drones at the tracker, ascending: the followers, and the leaders that are not virtual."""
        return tuple(sorted(drone.id for drone in self.drones))

    @cached_property
    def flying(self) -> tuple[int, ...]:
        """Ids of all drones with an airframe, ascending, without leaders carried by a person."""
        return tuple(i for i in self.tracked if i not in self.carried)

    @cached_property
    def leading(self) -> dict[int, Leader]:
        """The table of each leader, by id."""
        return {number: self.leader.of(number) for number in sorted(self.leaders)}

    @property
    def sole_leader(self) -> int | None:
        """The leader from which the places of a formation count: the only one; None with none, or several."""
        return self.leaders[0] if len(self.leaders) == 1 else None

    @property
    def reference(self) -> Leader:
        """The table of that leader; without one, a point at rest."""
        return AT_REST if self.sole_leader is None else self.leading[self.sole_leader]

    @property
    def carried(self) -> tuple[int, ...]:
        """Ids of the leaders that persons carry, ascending."""
        return tuple(i for i, leader in self.leading.items() if leader.kind == "tracked")

    @property
    def steered(self) -> tuple[int, ...]:
        """Ids of the leaders that fly by commands from outside, ascending."""
        return tuple(i for i, leader in self.leading.items() if leader.steered)

    @property
    def drone_spacing(self) -> float:
        """Least distance between places, m: what the safety filter keeps, or the safety distance without one."""
        return (self.avoidance.kept if self.control.filtered else self.avoidance.safe).drone

    @property
    def person_clearance(self) -> float:
        """Distance of drones from the centre of a person, m."""
        return self.gateway.person_radius + self.avoidance.obstacle_safety_distance

    @cached_property
    def walking(self) -> tuple[int, ...]:
        """Ids of the tracked leaders that simulated persons carry, if the cameras are simulated; else empty."""
        cameras = self.gateway.source == "simulated" or self.gateway.simulates_tracker
        return self.carried if cameras else ()

    def of_kind(self, *rows: AirframeRow) -> tuple[int, ...]:
        """Return the ids of the drones whose airframes are of one of these kinds, simulated or not, ascending."""
        named = {name for name in self.airframes if self.airframe_row(name) in rows}
        return tuple(i for i in self.flying if self.drone(i).airframe in named)

    @cached_property
    def driven(self) -> tuple[int, ...]:
        """Ids of the drones with their own driver, simulated or not, ascending."""
        return self.of_kind(*(row for row in AIRFRAMES if row.driver))

    @cached_property
    def simulated(self) -> tuple[int, ...]:
        """Ids of the drones whose airframes are simulated, ascending."""
        return tuple(i for i in self.flying if i not in self.driven or self.real_address(i) is None)

    @cached_property
    def ground(self) -> float:
        """Height of the ground on which simulated drones land, m: that of the lowest start."""
        return min((self.drone(i).start[2] for i in self.flying), default=0.0)

    @property
    def climb_time(self) -> float:
        """The time of the longest climb or descent, s: from the ground to the fence's top at limits.vertical_speed."""
        return (self.limits.fence.high[2] - self.ground) / self.limits.vertical_speed

    @cached_property
    def topology(self) -> Graph:
        """The communication graph."""
        return Graph(self.followers, self.graph.edges, tuple(self.leading))

    @cached_property
    def depth(self) -> int:
        """Hops from a leader to the deepest follower, 0 without a leader."""
        return max(self.topology.depths().values(), default=0)

    @cached_property
    def _by_id(self) -> dict[int, Drone]:
        return {drone.id: drone for drone in self.drones}

    def drone(self, number: int) -> Drone:
        """Return drone `number`; KeyError when the swarm has none."""
        return self._by_id[number]

    def body(self, number: int) -> str | int:
        """Return the name or number of drone `number` at the tracker."""
        body = self.drone(number).body
        return uav(number) if body is None else body

    def airframe(self, number: int) -> Airframe:
        """Return the airframe parameters of drone `number`."""
        return self.airframes[self.drone(number).airframe]

    def airframe_row(self, name: str) -> AirframeRow:
        """Return the row of the airframe table of the airframe called `name`."""
        return ROWS[self.airframes[name].kind]

    def row(self, number: int) -> AirframeRow:
        """Return the row of the airframe table of drone `number`."""
        return self.airframe_row(self.drone(number).airframe)

    def full_speed(self, number: int) -> float:
        """Return the highest speed of drone `number`, m/s: limits.speed, or that of its airframe if it is less."""
        fastest = self.row(number).fastest
        return min(self.limits.speed, load_object(fastest)(self.airframe(number))) if fastest else self.limits.speed

    def real_address(self, number: int) -> str | None:
        """Return the address of drone `number` from its kind's table in [[drones]]; None for a simulated one."""
        address = getattr(getattr(self.drone(number), self.row(number).kind, None), "address", None)
        return None if address is None else str(address)

    def in_simulation(self) -> Swarm:
        """Return the swarm for virtual time: simulated cameras and airframes replace real ones."""
        if self.gateway.source == "simulated":
            return self
        kinds = dict.fromkeys(row.kind for row in AIRFRAMES if row.drone_keys)
        drones = tuple(drone.model_copy(update=kinds) for drone in self.drones)
        gateway = self.gateway.model_copy(update={"source": "simulated", "twin": None})
        fields = {name: getattr(self, name) for name in type(self).model_fields}
        return Swarm.model_construct(**fields | {"gateway": gateway, "drones": drones})

    def beside(self, file: Path) -> Swarm:
        """Return the swarm that searches an own law in the folder of `file`."""
        return self.model_copy(update={"folder": str(file.absolute().parent)}) if ":" in self.control.law else self

    def tracked_by(self, gateway: Gateway) -> Swarm:
        """Return the swarm with another table [gateway]."""
        return self.model_copy(update={"gateway": gateway})

    def build_formation(self, name: str = "") -> shapes.Formation:
        """Return the formation called `name`, the swarm's first one when empty; KeyError when there is none."""
        return self.formation_table(name).build(len(self.followers))

    def formation_table(self, name: str) -> FormationTable:
        """Return the table of the formation called `name`, the first one's when empty; KeyError when there is none."""
        return self._formations[name]

    @cached_property
    def _formations(self) -> dict[str, FormationTable]:
        """All formations by their names in orders; the first one's is empty."""
        first = self.formation or self.formations.get(DEFAULT_FORMATION)
        return ({} if first is None else {"": first}) | self.formations

    @property
    def formation_names(self) -> tuple[str, ...]:
        """The names of formations in orders; the first one's is empty."""
        return tuple(self._formations)

    @property
    def formation_keys(self) -> dict[str, str]:
        """The keys of the file's formations, by their names in orders."""
        first = {} if self.formation is None else {"": "formation"}
        return first | {name: f"formations.{name}" for name in self.formations}

    @cached_property
    def auctioned(self) -> frozenset[str]:
        """The names of the formations whose places the followers share out by an auction."""
        return frozenset(name for name, table in self._formations.items() if table.assignment == "auction")
