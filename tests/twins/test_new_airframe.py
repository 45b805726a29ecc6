"""A new kind of airframe is a row in the airframe table and a folder: here a blimp, which cannot move sideways.

The row and the folder are added to a copy of the sources; nothing else is touched.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import cos, sin
from pathlib import Path

import pytest
from extended_sources import ExtendedSources
from flockwire_core.domain.airframe import Telemetry
from flockwire_core.domain.pose import Pose, yaw_of
from flockwire_core.process.driving import CONTACT
from flockwire_core.wire.codec import decode
from flockwire_core.wire.status import Reason, Status
from mcap.reader import make_reader

ROW = """
BLIMP = AirframeRow(
    "blimp",
    simulated="flockwire_blimp.simulated:SimulatedBlimp",
    without_setpoints=ByItself("drifts", after=2.0),
    without_poses=ByItself("drifts", after=6.0),
    without_link=ByItself("sinks", after=9.0),
    driver="flockwire_blimp.driver:BlimpDriver",
    drone_keys="flockwire_blimp.tables:BlimpInDrones",
    airframe_keys="flockwire_blimp.tables:BlimpInAirframes",
    built_in={"lag": 0.2},
    live_checks=("gas",),
    turns=True,
)

AIRFRAMES = (BLIMP, """
TABLES = '''
"""What a swarm file has for blimps."""

from flockwire_core.swarm.tables import Model, Positive, key


class Blimp(Model):
    """How the driver of a blimp reaches it."""

    address: str | None = key(None, "the blimp's own; default: it is simulated")


class BlimpInDrones(Model):
    """What [[drones]] has for a blimp."""

    blimp: Blimp | None = key(None, "how it is reached")


class BlimpInAirframes(Model):
    """What [airframes.NAME] has for a blimp."""

    turn_rate: Positive = key(2.0, "the fastest that it turns", "rad/s")


def places(number):
    """Return where a simulated blimp is, and what its driver binds."""
    return (f"127.77.0.{number}", 9700), (f"127.77.1.{number}", 9701)
'''
SIMULATED = '''
"""A simulated blimp: forward, up and turn are all that it can."""

from math import cos, exp, sin
from struct import pack, unpack

from flockwire_core.process.cores import Datagram
from flockwire_core.process.driving import CONTACT

from flockwire_blimp.tables import places


class SimulatedBlimp:
    def __init__(self, swarm, number, now, chance):
        self.address, self._client = places(number)
        self.position, self._yaw = swarm.drone(number).start, swarm.drone(number).heading
        self._ground, self._lag, self._now, self._due = self.position[2], swarm.airframe(number).lag, now, now
        self._wanted, self._forward, self._up, self._stopped = (0.0, 0.0, 0.0), 0.0, 0.0, False
        self._wind = None

    @property
    def airframe(self):
        return self  # its body, which has position and orientation

    @property
    def orientation(self):
        return (0.0, 0.0, sin(self._yaw / 2.0), cos(self._yaw / 2.0))

    @property
    def in_the_air(self):
        return self.position[2] > self._ground + CONTACT

    def advance(self, now):
        dt, self._now = (now - self._now) / 1e9, now
        forward, up, turn = (0.0, -0.5, 0.0) if self._stopped else self._wanted
        share = 1.0 - exp(-dt / self._lag)
        self._forward += share * (forward - self._forward)
        self._up += share * (up - self._up)
        x, y, z = self.position
        if self.in_the_air or up > 0.0:
            self._yaw += turn * dt
            x, y = x + self._forward * cos(self._yaw) * dt, y + self._forward * sin(self._yaw) * dt
            drift = self._wind.at(now)
            x, y = x + drift[0] * dt, y + drift[1] * dt
            z = max(self._ground, z + (self._up + drift[2]) * dt)
        self.position = (x, y, z)

    def datagram(self, data, sender, now):
        self._wanted = unpack("<ddd", data)

    def outgoing(self, now):
        if now < self._due:
            return []
        self._due = now + 50_000_000
        return [Datagram(pack("<d", self.position[2] - self._ground), self.address, self._client)]

    def stop(self):
        self._stopped = True

    def respond(self, lag, dead_time):
        self._lag = lag

    def blow(self, wind):
        self._wind = wind
'''
DRIVER = '''
"""The driver of one blimp: it turns towards where it is to go."""

from math import atan2, cos, hypot, sin
from struct import pack, unpack

from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.order import Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.pose import wrapped, yaw_of
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Datagram
from flockwire_core.process.driving import CONTACT, RETIREMENT, TELEMETRY_PERIOD
from flockwire_core.swarm.model import uav
from flockwire_core.wire.keys import STOP, Key
from flockwire_core.wire.status import Reason, Report

from flockwire_blimp.tables import places


class BlimpDriver:
    period = 0.02
    triggers = frozenset()
    prompt = frozenset({STOP})

    def __init__(self, start):
        swarm, number = start.plan.swarm, start.drone
        self._swarm, self._number, self._fastest = swarm, number, swarm.airframe(number).turn_rate
        self._blimp, self._own = places(number)
        self._velocity, self._yaw, self._height, self._telemetry_due = (0.0, 0.0, 0.0), 0.0, None, 0
        self._commanded = self._land_at = None
        self._stopped = False

    @property
    def sockets(self):
        return (self._own,)

    def correct(self, by):
        pass

    def receive(self, key, message, now):
        if isinstance(message, Command):
            self._velocity, self._commanded = message.velocity, now
        elif isinstance(message, Pose):
            self._yaw = yaw_of(message.orientation)
        elif isinstance(message, Stop):
            self._stopped = True

    def datagram(self, data, sender, at, now):
        (self._height,) = unpack("<d", data)

    def outgoing(self, now):
        stale, limits = self._swarm.limits.staleness, self._swarm.limits
        silence = (now - self._commanded) / SECOND if self._commanded is not None else 0.0
        x, y, z = self._velocity if silence <= stale.command_zero else (0.0, 0.0, 0.0)
        if silence > stale.command_land or self._stopped or (self._land_at is not None and now >= self._land_at):
            x, y, z = 0.0, 0.0, -limits.vertical_speed
        turn = 4.0 * wrapped(atan2(y, x) - self._yaw) if hypot(x, y) > 0.02 else 0.0
        forward, most = x * cos(self._yaw) + y * sin(self._yaw), self._fastest
        return [Datagram(pack("<ddd", max(0.0, forward), z, max(-most, min(most, turn))), self._own, self._blimp)]

    def step(self, now):
        if self._height is None or now < self._telemetry_due:
            return []
        self._telemetry_due = now + TELEMETRY_PERIOD
        state = FlightState.FLYING if self._height > CONTACT else FlightState.GROUNDED
        state = FlightState.STOPPED if self._stopped else state
        telemetry = Telemetry(now, self._swarm.frame, state, 1.0, self._height, 0.0, self._stopped)
        return [(Key("telemetry", uav(self._number)), telemetry)]

    def report(self, now):
        return Report("driving", reasons=(Reason("gas", "97 % helium"),))

    def retire(self, now):
        self._land_at = now + RETIREMENT

    def may_end(self, now):
        return self._height is None or self._height <= CONTACT
'''
SWARM = """
name = "airship"
[control]
law = "extended"
[formation]
kind = "circle"
radius = 1.5
rate = 0.2
[leader]
kind = "trajectory"
[leader.trajectory]
kind = "constant"
velocity = [0.15, 0.0, 0.0]
[limits]
speed = 1.5
[graph]
edges = [[0, 1], [0, 2], [1, 2]]
[airframes.zeppelin]
kind = "blimp"
turn_rate = 1.5
lag = 0.2
[[drones]]
id = 0
start = [0.0, 0.0, 0.0]
[[drones]]
id = 1
start = [1.5, 0.0, 0.0]
[[drones]]
id = 2
start = [-1.5, 0.2, 0.0]
airframe = "zeppelin"
heading = 1.5
"""


@pytest.fixture
def flockwire(tmp_path: Path) -> Callable[..., str]:
    """Return what runs `flockwire` of the copy with the blimp."""
    edits = (("core/flockwire_core/swarm/airframes.py", "\nAIRFRAMES = (", ROW),)
    parts = {"__init__": "", "tables": TABLES, "simulated": SIMULATED, "driver": DRIVER}
    files = {f"blimp_driver/flockwire_blimp/{name}.py": text for name, text in parts.items()}
    return ExtendedSources(tmp_path / "tree", edits, files).flockwire


def messages(trace: Path, topic: str, kind: type) -> list:
    """Return the messages of a topic."""
    with trace.open("rb") as stream:
        return [decode(kind, m.data) for _, _, m in make_reader(stream).iter_messages(topics=[topic])]


@pytest.mark.long
def test_a_row_and_a_folder_make_a_new_kind_of_airframe(tmp_path: Path, flockwire: Callable[..., str]) -> None:
    swarm, keys = tmp_path / "airship.toml", tmp_path / ".flockwire/airship/keys"
    swarm.write_text(SWARM)
    checked = flockwire("check", swarm)
    assert "airframe zeppelin (uav2): blimp, lag 0.2 s, dead time 0 s, with a driver each" in checked
    assert "by itself: without setpoints it drifts after 2 s" in checked
    (linked,) = [line for line in checked.splitlines() if line.startswith("  driver2 ")]
    assert linked.split(maxsplit=2)[2] == "gateway, uav2, recorder, operator, console"
    flockwire("keys", swarm)
    assert (keys / "driver2.crt").exists()

    flockwire("sim", swarm, "--duration", 25, "--out", tmp_path / "out")
    trace = tmp_path / "out/trace.mcap"
    truth = messages(trace, "/airship/uav2/truth", Pose)
    assert max(pose.position[2] for pose in truth) > 0.9
    assert truth[-1].position[2] < CONTACT
    assert max(dist_sideways(*pair) for pair in pairwise(truth)) < 0.002
    assert messages(trace, "/airship/uav2/telemetry", Telemetry)[-1].height < CONTACT
    agent = [status.report for status in messages(trace, "/airship/uav2/status", Status)]
    assert min(report.formation_error for report in agent if report.phase == "formation") < 0.1
    driver = messages(trace, "/airship/driver2/status", Status)[-1].report
    assert (driver.phase, driver.reasons) == ("driving", (Reason("gas", "97 % helium"),))


def dist_sideways(before: Pose, after: Pose) -> float:
    """Return how far a body moved across its heading between two poses, m."""
    dx, dy = (b - a for a, b in zip(before.position[:2], after.position[:2], strict=True))
    yaw = yaw_of(after.orientation)
    return abs(dy * cos(yaw) - dx * sin(yaw))


def test_what_the_airframe_does_by_itself_its_drivers_limits_must_forestall(
    tmp_path: Path, flockwire: Callable[..., str]
) -> None:
    swarm = tmp_path / "airship.toml"
    swarm.write_text(SWARM + "[limits.staleness]\ncommand_land = 2.5\n")
    assert (
        "limits.staleness.command_land = 2.5: must be below 2 s, after which airframe 'zeppelin' drifts by itself "
        "without setpoints" in flockwire("check", swarm, status=(2,))
    )
