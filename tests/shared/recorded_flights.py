"""A flight that is known in closed form, written as a trace: followers decay exponentially into a turning circle."""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from math import cos, exp, hypot, sin
from pathlib import Path
from random import Random

import pytest
from flockwire_analysis.collecting import Collector
from flockwire_analysis.recorded import Trace
from flockwire_core.control.formation import Formation
from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.body import Nearby
from flockwire_core.domain.motion import Estimate, LeaderMotion
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message, encode
from flockwire_core.wire.keys import MISSION, ROWS, STOP, Key, key_text
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.schemas import ROS_TYPES
from flockwire_core.wire.status import Report, Status
from flockwire_recorder.trace import TraceWriter, describe

T0 = 1_790_000_000 * SECOND  # mission time 0
STEP = SECOND // 100
MS = SECOND // 1000
STARTS = ((0.0, 0.0), (-0.9, 1.7), (1.9, 0.6), (0.6, -1.2), (-1.9, -0.7))
Event = tuple[int, Key, str, int, Message]  # published, key, publisher, sequence, message


def swarm_of(obstacle: bool = True, **tables: object) -> Swarm:
    """Return the paper's simulated swarm: four followers on a chain, r = 2 m, w = 1 rad/s."""
    table: dict[str, object] = {
        "name": "paper",
        "formation": {"kind": "circle", "radius": 2.0, "rate": 1.0},
        "graph": {"edges": [[0, 1], [1, 2], [2, 3], [3, 4]]},
        "drones": [{"id": i, "start": [x, y, 0.0]} for i, (x, y) in enumerate(STARTS)],
        "obstacles": [{"center": [4.2, 0.9, 0.0], "radius": 0.2}] if obstacle else [],
    }
    return parse_swarm(table | tables, "test")


@dataclass
class Flight:
    """The flight's numbers: times in s from mission time 0, lengths in m."""

    swarm: Swarm = field(default_factory=swarm_of)
    begin: float = -4.0
    end: float = 40.0
    decay: float = 1.2  # s, of the followers' distance to their places
    observer_decay: float = 0.4  # s
    place_bias: float = 0.0  # of every follower, along X
    leaps_at: float | None = None  # uav2 is 1e253 m away from then on
    estimate_bias: float = 0.0  # of every estimate, along Y
    noise: float = 0.0  # m, standard deviation of places and estimates
    deflection: float = 0.0  # how far from the obstacle's centre followers are pushed
    started: bool = True
    holds_at: float | None = None
    resumes_at: float | None = None  # the formation begun at 0
    command_delay: int = 2 * MS
    lost: int = 0  # of uav2's commands
    forged: tuple[tuple[int, int], ...] = ()  # when uav3's agent says that it sent a command (Unix ns), and which count
    orders_lost: int = 0  # repetitions of the operator's, before the last one
    obeyed: Mission | None = None  # the order that pilots report in the end
    silent: frozenset[Key] = frozenset()
    lands: bool = True  # at `end`
    skipped: int = 0  # of uav2's steps
    pose_every: int = 1  # as many hundredths of a second, and a command for each
    stops_at: float | None = None  # the operator stops all motors
    crash_at: float | None = None  # the motors of uav2 stop by themselves; its pilot says "ready"
    sits_at: float | None = None  # uav3 is put on the ground, its pilot says "formation"
    drifts: float = 0.0  # m that uav1 goes astray while it lands
    pilot_ends_at: float | None = None  # uav4 reports no more
    unrecorded: tuple[float, float] = (0.0, 0.0)  # from, to
    second_start: float | None = None  # the formation "row" is ordered, half a second ahead

    @cached_property
    def formation(self) -> Formation:
        """Return the formation flown first."""
        return self.swarm.build_formation()

    def leader(self, t: float) -> tuple[float, float]:
        """Return x_0."""
        return (0.1 * max(t, 0.0), 0.1 * max(t, 0.0))

    def start_error(self, i: int) -> tuple[float, float]:
        """Return x_i - h_i - x_0 at mission time 0, without the bias."""
        hx, hy, _ = self.formation.offset(i - 1, 0.0)
        return (STARTS[i][0] - hx, STARTS[i][1] - hy)

    def height(self, i: int, t: float) -> float:
        """Return how high drone i is."""
        fallen = [at for at in (self.stops_at, self.crash_at if i == 2 else None) if at is not None]
        if fallen and t > min(fallen):
            return max(0.0, 1.0 - 4.905 * (t - min(fallen)) ** 2)
        if i == 3 and self.sits_at is not None:
            return max(0.0, 1.0 - max(0.0, t - self.sits_at) * 0.7)
        climbed = min(1.0, max(0.0, (t - self.begin - 0.1) * 0.7))
        return max(0.0, climbed - max(0.0, t - self.end) * 0.7)

    def state(self, i: int, t: float) -> FlightState:
        """Return what the telemetry of drone i says."""
        fallen = [at for at in (self.stops_at, self.crash_at if i == 2 else None) if at is not None]
        if fallen and t >= min(fallen):
            return FlightState.STOPPED
        return FlightState.FLYING if self.height(i, t) > 0.0 else FlightState.GROUNDED

    def report(self, i: int, t: float, order: Mission | None, heard: Telemetry) -> Report:
        """Return what the pilot of drone i says, which obeys `order` and has `heard` of its drone."""
        phase = self.phase(i, t, order, heard.state)
        return Report(phase, telemetry_age=(T0 + round(t * 100) * STEP - heard.stamp) / SECOND, mission=order)

    def phase(self, i: int, t: float, order: Mission | None, state: FlightState) -> str:
        """Return what the pilot of drone i does, which obeys `order` and knows the `state` of its airframe."""
        if order is None or (i == 2 and self.crash_at is not None and t > self.crash_at):
            return "ready"
        if self.stops_at is not None and t > self.stops_at:
            return "stopped"
        if order.verb == "land":
            return "landing" if state is FlightState.FLYING else "ready"
        if self.height(i, t) < 0.95 and t < 0.0:
            return "take-off"
        return "formation" if order.in_formation and t >= (order.start - T0) / SECOND else "hold"

    def position(self, i: int, t: float) -> tuple[float, float, float]:
        """Return x_i."""
        height, astray = self.height(i, t), self.drifts * (t - self.end) if i == 1 and t > self.end else 0.0
        x, y, z = self.place(i, min(t, self.end), height)
        if i == 2 and self.leaps_at is not None and t > self.leaps_at:
            x += 1e253
        return (x + astray, y, z)

    def place(self, i: int, t: float, height: float) -> tuple[float, float, float]:
        """Return x_i as it is before the landing, at this height."""
        x, y = self.leader(t)
        if i == 0:
            return (x, y, height)
        if t < 0.0 or not self.started:
            return (STARTS[i][0] + self.place_bias, STARTS[i][1], height)
        hx, hy, _ = self.formation.offset(i - 1, t)
        ex, ey = self.start_error(i)
        left = exp(-t / self.decay)
        return (*self.pushed(x + hx + ex * left + self.place_bias, y + hy + ey * left), height)

    def pushed(self, x: float, y: float) -> tuple[float, float]:
        """Return the point moved away from the obstacle, smoothly."""
        if not self.deflection:
            return (x, y)
        cx, cy, _ = self.swarm.obstacles[0].center
        distance = hypot(x - cx, y - cy)
        stretch = (1.0 + (self.deflection / distance) ** 4) ** 0.25
        return (cx + (x - cx) * stretch, cy + (y - cy) * stretch)

    def estimate(self, i: int, t: float) -> tuple[float, float, float]:
        """Return eta_i."""
        x, y = self.leader(t)
        left = exp(-(t - self.begin) / self.observer_decay / i)
        return (
            x + STARTS[i][0] * left,
            y + STARTS[i][1] * left + self.estimate_bias,
            self.position(0, t)[2],
        )

    def events(self) -> Iterator[Event]:
        """Yield everything that is said, by time."""
        steps = range(round(self.begin * 100), round((self.end + 2.0 * self.lands) * 100) + 1)
        random = Random(1)

        def seen(place: tuple[float, float, float]) -> tuple[float, float, float]:
            x, y, z = (value + random.gauss(0.0, self.noise) for value in place)
            return (x, y, z)

        flying, pilot, sequence = self.swarm.flying, Plan(self.swarm).pilot, -1
        yield from self.missions()
        orders = sorted({order for _, key, _, _, order in self.missions() if key == MISSION}, key=lambda one: one.stamp)
        heard: dict[int, Telemetry] = {}  # by each pilot
        for k in steps:
            stamp, t, sequence = T0 + k * STEP, k / 100, sequence + 1
            delay = self.command_delay + round(0.4 * MS * (1.0 + sin(k * 0.37)))
            for i in flying:
                place, name, who = seen(self.position(i, t)), uav(i), pilot[i]
                yield stamp + MS // 2, Key("truth", name), "kinematics", sequence, Pose(stamp, "world", place)
                seen_now, number = k % self.pose_every == 0, sequence // self.pose_every
                if seen_now:
                    yield stamp + MS, Key("pose", name), "gateway", number, Pose(stamp, "world", place)
                velocity = (-sin(t), cos(t), 0.0)
                late = i == 2 and k >= 500 + self.skipped
                if seen_now and (i != 2 or not 500 <= k < 500 + self.lost + self.skipped):
                    count = number - self.skipped // self.pose_every * late
                    yield stamp + MS + delay, Key("command", name), who, count, Command(stamp, "world", velocity)
                if i:
                    said = Estimate(stamp, "world", LeaderMotion(seen(self.estimate(i, t)), (0.1, 0.1, 0.0)))
                    yield stamp + MS + delay - MS // 10, Key("estimate", name), who, sequence, said
                    yield stamp + MS, Key("nearby", name), "gateway", sequence, Nearby(stamp, "world", ())
                if k % 10 == i:
                    state = Telemetry(stamp, "world", self.state(i, t), 1.0 - t / 900, place[2], 0.002)
                    yield stamp + 2 * MS, Key("telemetry", name), "kinematics", sequence // 10, state
                    if i != 3 or self.sits_at is None or t < self.sits_at:
                        heard[i] = state
                    if i != 4 or self.pilot_ends_at is None or t < self.pilot_ends_at:
                        obeyed = next((order for order in reversed(orders) if order.stamp <= stamp), None)
                        obeyed = self.obeyed or obeyed if t > self.end else obeyed
                        status = self.status(who, stamp, sequence, self.report(i, t, obeyed, heard[i]))
                        yield stamp + 5 * MS, Key("status", who), who, sequence // 10, status

    def missions(self) -> Iterator[Event]:
        """Yield what the operator says."""
        first = T0 + int(self.begin * SECOND)
        orders = [Mission(first + SECOND // 10, "world", "takeoff")]
        if self.started:
            orders.append(Mission(T0 - SECOND // 5, "world", "start", T0))
        if self.second_start is not None:
            said = T0 + int(self.second_start * SECOND)
            orders.append(Mission(said, "world", "start", said + SECOND // 2, "row"))
        if self.lands:
            orders.append(Mission(T0 + int(self.end * SECOND), "world", "land"))
        if self.stops_at is not None:
            said = T0 + int(self.stops_at * SECOND)
            for k in range(3):
                yield said + k * MS, STOP, "operator", k, Stop(said + k * MS, "world", "the operator's order")
        if self.holds_at is not None:
            orders.append(Mission(T0 + int(self.holds_at * SECOND), "world", "hold"))
        if self.resumes_at is not None:
            orders.append(Mission(T0 + int(self.resumes_at * SECOND), "world", "start", T0))
        orders.sort(key=lambda one: one.stamp)
        orders = [order._replace(number=place) for place, order in enumerate(orders, 1)]
        for place, order in enumerate(orders):
            sequence = place + self.orders_lost * (order is orders[-1])
            yield order.stamp, MISSION, "operator", sequence, order
            yield order.stamp + MS, MISSION, "gateway", sequence, order

    def status(self, who: str, stamp: int, steps: int, report: Report) -> Status:
        """Return how agent `who` is after `steps`."""
        rejected = (("paper/uav1/pose older than the last", 3),) if who == "uav1" else ()
        links = ("gateway", "kinematics")
        return Status(
            stamp,
            "world",
            who,
            report,
            steps,
            steps // 50,
            steps // 500,
            1,
            2,
            0.07,
            45 << 20,
            rejected,
            links,
        )


def _recorded(flight: Flight) -> Iterator[tuple[Key, str, int, int, int, Message]]:
    """Yield key, publisher, sequence number, log time, publish time (Unix ns) and message of what is recorded."""
    said = sorted((event for event in flight.events() if event[1] not in flight.silent), key=lambda event: event[0])
    begin, end = (T0 + int(at * SECOND) for at in flight.unrecorded)
    for published, key, publisher, sequence, message in said:
        if begin < published < end:
            continue
        yield key, publisher, sequence, published + MS // 5, published, message
        if key == Key("command", "uav3") and sequence // 100 < len(flight.forged) and sequence % 100 == 50:
            sent, count = flight.forged[sequence // 100]
            yield key, publisher, count, published + MS // 4, sent, message


def described(flight: Flight) -> dict[str, str]:
    """Return the metadata of its trace."""
    return describe(flight.swarm, 'name = "paper"  # <by hand>\n', 7, T0)


def record(path: Path, **numbers: object) -> Flight:
    """Write the trace of the flight with these numbers, flushing ten times a second."""
    flight, flushed = Flight(**numbers), 0
    writer = TraceWriter(path, described(flight))
    for key, publisher, sequence, logged, published, message in _recorded(flight):
        topic, ros_type = f"/{key_text(flight.swarm.name, key)}", ROS_TYPES[ROWS[key.kind].message]
        writer.write(topic, ros_type, publisher.encode().ljust(16), sequence, logged, published, encode(message))
        if logged - flushed > SECOND // 10:
            writer.flush()
            flushed = logged
    writer.close()
    return flight


def collect(**numbers: object) -> Trace:
    """Return what is read of the trace of the flight with these numbers, without a file."""
    flight = Flight(**numbers)
    collector = Collector(flight.swarm, described(flight))
    for key, publisher, sequence, logged, published, message in _recorded(flight):
        collector.add((key, publisher), key, message, sequence, published, logged)
    return collector.trace(Path("trace.mcap"))


@pytest.fixture(scope="session")
def write_flight() -> Callable[..., Flight]:
    """Write a flight with the given numbers to a path."""
    return record


@pytest.fixture
def fly(tmp_path: Path) -> Callable[..., Path]:
    """Write a flight with the given numbers; returns its trace."""

    def write(**numbers: object) -> Path:
        path = tmp_path / "trace.mcap"
        record(path, **numbers)
        return path

    return write


@pytest.fixture(scope="session")
def good_flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the trace of a flight with which nothing is wrong, to be read only."""
    path = tmp_path_factory.mktemp("good") / "trace.mcap"
    record(path, begin=-2.0, end=10.0)
    return path


@pytest.fixture(scope="session", name="swarm_of")
def swarm_of_fixture() -> Callable[..., Swarm]:
    """Make the paper's simulated swarm, tables replaced."""
    return swarm_of


@pytest.fixture
def small_disk() -> Iterator[None]:
    """Let no file grow beyond 64 KiB."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (65536, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
