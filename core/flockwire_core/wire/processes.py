"""The process table: one row for each kind of process. No file outside a kind's folder uses its name.

Links, certificates and access rules are derived from it, the key table (keys.py) and the graph (plan.py). A new kind of
process is a row here, its keys there, and a folder with its core.

The order of the rows is that of tables and reports, and decides who dials: of two linked processes the one further down
dials the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

from flockwire_core.swarm.model import Swarm, uav

SINGLE_PORTS = 16  # base_port and those after it belong to kinds with one member
DRONE_PORTS = 4  # the number of ports of each drone after them


class Link(Enum):
    """The links of a kind of process."""

    PEER = "listens at its own endpoint and dials those before it"
    ROUTER = "listens; all others dial it, and it passes on what they publish"
    DIALS = "dials and is not dialled; any number may exist"


class Member(NamedTuple):
    """One process, or an owner of keys: its identity (certificate, log, status) and its drone, None if it has none."""

    identity: str
    drone: int | None = None


@dataclass(frozen=True, slots=True)
class Process:
    """One kind of process."""

    kind: str  # its verb on the command line
    help: str
    members: Callable[[Swarm], tuple[Member, ...]]
    core: str  # "module:function" that makes the core from a Start; empty: an operator's command
    port: int  # its place among the kinds with one member, or among a drone's processes
    runner: str = "flockwire_core.runtime.shell:run_core"  # runs it in real time
    numbered: bool = False  # one member for each of several drones, named on the command line by the drone's id
    link: Link = Link.PEER
    pilot: bool = False  # it is a pilot: a flight waits for it, and ends if it is lost
    records: bool = False  # subscribes to every key and writes the trace; its host conducts the flight
    batches: bool = False  # its state reaches the recorder in batches (batch.py)
    after: tuple[str, ...] = ("router", "recorder")  # kinds that must report before it is started
    driver: bool = False  # drives airframes: it may end only when they are down
    restarts: bool = False  # it is restarted if it dies in a flight
    optional: bool = False  # a flight goes on without it, and is not judged by what is missing of its messages
    starts_before_time: bool = False  # it starts before swarm time is known
    rank: int = 0  # of processes whose parent is gone, those of a lower rank end first
    standalone: str = ""  # "module:function" that runs it without the swarm, with its own --protocol; empty: none
    replay: str = ""  # "module:function" that shows a trace instead of the swarm, with --trace and --pace; empty: none
    only_if: str = ""  # the condition for members of this kind, in words

    @property
    def flies(self) -> bool:
        """Whether its members have drones in the air."""
        return self.pilot or self.driver

    @property
    def started(self) -> bool:
        """Whether `up` starts its members; else they are operators."""
        return bool(self.core)


def _one(identity: str) -> Callable[[Swarm], tuple[Member, ...]]:
    return lambda _: (Member(identity),)


ROUTER = Process(
    "router",
    'Run the router of `[network] mode = "router"`.',
    lambda swarm: (Member("router"),) if swarm.network.mode == "router" else (),
    "flockwire_core.process.cores:make_router",
    port=4,
    rank=3,
    link=Link.ROUTER,
    after=(),
    only_if="network.mode = 'router'",
)
GATEWAY = Process(
    "gateway",
    "Run the gateway, which publishes poses and nearby bodies.",
    _one("gateway"),
    "flockwire_mocap.core:make_core",
    port=0,
    runner="flockwire_mocap.process:run",
    rank=4,
    batches=True,
)
TRACKER = Process(
    "tracker-sim",
    "Run the simulated tracker, which serves the simulated airframes in a real tracker's protocol.",
    lambda swarm: (Member("tracker-sim"),) if swarm.gateway.simulates_tracker else (),
    "flockwire_twins.trackers.core:TwinCore",
    port=5,
    runner="flockwire_twins.trackers.process:run",
    rank=3,
    standalone="flockwire_twins.trackers.process:serve_alone",
    only_if="a table [gateway.twin], and a gateway.source that it serves,",
)
KINEMATICS = Process(
    "kinematics",
    "Run the simulated airframes, and drive those that have no driver of their own.",
    lambda swarm: (Member("kinematics"),) if swarm.simulated or swarm.walking else (),
    "flockwire_twins.kinematics.core:make_core",
    port=1,
    runner="flockwire_core.runtime.datagrams:run",
    driver=True,
    rank=2,
    batches=True,
    only_if="a simulated drone, or a simulated person who leads",
)
LEADING = Process(
    "leader",
    "Run a leader.",
    lambda swarm: tuple(Member(f"leader{i or ''}", i) for i in swarm.leading),
    "flockwire_leader.core:make_core",
    port=0,
    pilot=True,
    batches=True,
    only_if="leaders",
)
AGENT = Process(
    "agent",
    "Run the agent of one follower.",
    lambda swarm: tuple(Member(uav(i), i) for i in swarm.followers),
    "flockwire_agent.core:AgentCore",
    port=0,
    numbered=True,
    pilot=True,
    batches=True,
)
DRIVER = Process(
    "driver",
    "Run the driver of one drone.",
    lambda swarm: tuple(Member(f"driver{i}", i) for i in swarm.driven),
    "flockwire_core.process.driving:make_driver",
    port=1,
    runner="flockwire_core.runtime.datagrams:run",
    numbered=True,
    driver=True,
    rank=1,
    batches=True,
    restarts=True,
    starts_before_time=True,
    only_if="a drone whose airframe has a driver of its own",
)
RECORDER = Process(
    "recorder",
    "Record every message into OUT/trace.mcap.",
    _one("recorder"),
    "flockwire_core.process.cores:make_recorder",
    port=3,
    rank=5,
    runner="flockwire_recorder.process:run",
    records=True,
    restarts=True,
    after=("router",),
)
ROS = Process(
    "ros",
    "Publish the swarm in ROS 2, and obey the orders from there that the file names.",
    lambda swarm: (Member("ros"),) if swarm.ros is not None else (),
    "flockwire_operator.ros.core:make_core",
    port=6,
    rank=4,
    runner="flockwire_operator.ros.process:run",
    restarts=True,
    optional=True,
    replay="flockwire_operator.ros.replay:play",
    only_if="a table [ros]",
)
OPERATOR = Process("operator", "Give orders.", _one("operator"), "", port=0, link=Link.DIALS, rank=6)
TELEOP = replace(
    OPERATOR,
    kind="teleop",
    help="Steer the leader.",
    members=lambda swarm: (
        (Member("teleop"),) if any(one.kind == "teleoperated" for one in swarm.leading.values()) else ()
    ),
    only_if="leader.kind = 'teleoperated'",
)
CONSOLE = replace(OPERATOR, kind="console", help="Serve a live page with orders.", members=_one("console"))

PROCESSES = (ROUTER, GATEWAY, TRACKER, KINEMATICS, LEADING, AGENT, DRIVER, RECORDER, ROS, OPERATOR, TELEOP, CONSOLE)
ORDERING = (OPERATOR, CONSOLE)  # operators, by the same rules


class Roster:
    """The processes of `swarm`, in the order of the table."""

    def __init__(self, swarm: Swarm) -> None:
        self.swarm = swarm
        self.rows: dict[str, Process] = {}  # by identity
        self.members: dict[str, Member] = {}  # by identity
        self.pilot: dict[int, str] = {}  # the pilot's identity of a drone, a virtual or tracked leader's included
        self._identities: dict[str, tuple[str, ...]] = {}  # by kind
        for row in PROCESSES:
            members = row.members(swarm)
            self._identities[row.kind] = tuple(member.identity for member in members)
            for member in members:
                self.rows[member.identity], self.members[member.identity] = row, member
                if row.pilot and member.drone is not None:
                    self.pilot[member.drone] = member.identity

    def host(self, identity: str) -> str:
        """Return the name of its host: the one that names it, its drone's, else the first."""
        swarm, drone = self.swarm, self.members[identity].drone
        for name, host in swarm.hosts.items():
            if identity in host.processes:
                return name
        named = swarm.drone(drone).host if drone in swarm.tracked and drone is not None else None
        return named if named is not None else next(iter(swarm.hosts))

    def is_named_by_id(self, identity: str) -> bool:
        """Return whether a command line needs the drone's id to name the process."""
        row = self.rows[identity]
        return row.numbered or len(self._identities[row.kind]) > 1

    def of(self, *rows: Process) -> tuple[str, ...]:
        """Return the identities of all members of `rows`."""
        return tuple(identity for row in rows for identity in self._identities[row.kind])

    def drivers(self, drone: int) -> tuple[str, ...]:
        """Return the identity of the driver of `drone`: its own, or the process of all simulated airframes."""
        own = tuple(identity for identity in self.of(DRIVER) if self.members[identity].drone == drone)
        return own or self.of(KINEMATICS)
