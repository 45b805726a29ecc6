from math import dist, hypot

import pytest
from flockwire.control.vector import add, scale
from flockwire.flight.phases import Phase
from flockwire.nanoseconds import BILLION
from flockwire.wire.keys import MISSION, STOP, Key
from flockwire.wire.messages import FlightState, Mission, Pose, Stop, Telemetry
from flockwire_leader.core import FlyingLeader, VirtualLeader

BEGAN = 1_790_000_000 * BILLION
TICK = BILLION // 100
STILL = (0.0, 0.0, 0.0)
VIRTUAL = {"leader": {"kind": "virtual", "start": [1.0, 2.0, 1.5], "trajectory": {"kind": "circle"}}, "drones.0": None}


class Seat:
    """A flying leader on an ideal airframe."""

    def __init__(self, swarm):
        self.now, self.core = BEGAN, FlyingLeader(swarm, BEGAN)
        self.position, self.velocity = STILL, STILL
        self.state, self.battery, self.silent = FlightState.GROUNDED, 1.0, set()

    @property
    def phase(self):
        return self.core.report(self.now).phase

    @property
    def detail(self):
        return self.core.report(self.now).detail

    def run(self, seconds):
        for _ in range(round(seconds * 100)):
            self.now += TICK
            telemetry = Telemetry(self.now, "world", self.state, self.battery, self.position[2], 0.0)
            for kind, message in (("telemetry", telemetry), ("pose", Pose(self.now, "world", self.position))):
                if kind not in self.silent:
                    self.core.receive(Key(kind, "uav0"), message, self.now)
            ((key, command),) = self.core.step(self.now)
            assert key == Key("command", "uav0")
            self.velocity = command.velocity
            if self.velocity[2] > 0.0 and self.state is FlightState.GROUNDED:
                self.state = FlightState.FLYING
            if self.state is FlightState.FLYING:
                self.position = add(self.position, scale(self.velocity, 0.01))
                if self.position[2] <= 0.0:
                    self.state = FlightState.GROUNDED

    def order(self, verb, delay=0.0):
        mission = Mission(self.now + 1, "world", verb, self.now + round(delay * BILLION))
        self.core.receive(MISSION, mission, self.now)


@pytest.fixture
def seat(make_swarm):
    """Return the builder of a leader."""
    return lambda changes=None: Seat(make_swarm(changes))


@pytest.fixture
def flyer(seat):
    """Return a leader three seconds on its way."""
    leader = seat()
    leader.run(0.1)
    leader.order("takeoff")
    leader.run(2.0)
    leader.order("start")
    leader.run(3.0)
    assert leader.phase is Phase.FORMATION
    return leader


@pytest.mark.parametrize(
    ("silent", "battery", "detail"),
    [
        ({"pose"}, 1.0, "waits for its own pose"),
        ({"telemetry"}, 1.0, "waits for its driver's telemetry"),
        (set(), 0.19, "battery at 19%"),
    ],
)
def test_on_the_ground_it_says_what_it_waits_for(seat, silent, battery, detail):
    leader = seat()
    leader.silent, leader.battery = silent, battery
    leader.run(0.1)
    leader.order("takeoff")
    leader.run(0.1)
    assert (leader.phase, leader.detail, leader.velocity) == (Phase.GROUNDED, detail, STILL)


def test_it_takes_off_straight_up_and_holds(seat):
    leader = seat()
    leader.run(0.1)
    leader.order("takeoff")
    leader.run(4.0)
    assert leader.phase is Phase.HOLD
    assert leader.position == pytest.approx((0.0, 0.0, 0.95), abs=0.02)


def test_it_flies_its_trajectory_from_where_it_is(flyer):
    begin = add(flyer.position, (-0.3, -0.3, 0.0))
    flyer.run(5.0)
    assert flyer.position == pytest.approx(add(begin, (0.8, 0.8, 0.0)), abs=0.02)
    assert flyer.velocity == pytest.approx((0.1, 0.1, 0.0), abs=0.01)


def test_it_rests_until_the_formations_time_comes(seat):
    leader = seat()
    leader.run(0.1)
    leader.order("takeoff")
    leader.run(3.0)
    leader.order("start", delay=1.0)
    before = leader.position
    leader.run(0.9)
    assert dist(leader.position, before) < 0.02
    assert leader.phase is Phase.HOLD
    leader.run(0.2)
    assert leader.phase is Phase.FORMATION


def test_it_goes_on_without_a_leap_after_a_hold(flyer):
    flyer.order("hold")
    flyer.run(1.0)
    assert hypot(*flyer.velocity) < 0.05
    flyer.order("start")
    before = flyer.position
    flyer.run(0.1)
    assert dist(flyer.position, before) < 0.05


def test_a_gust_is_made_up_for_within_the_speed_limit(flyer):
    x, y, z = flyer.position
    flyer.position = (x + 4.0, y, z)
    flyer.run(0.01)
    assert hypot(*flyer.velocity) == pytest.approx(3.0)
    flyer.run(5.0)
    assert flyer.position[0] == pytest.approx(x + 0.5, abs=0.02)


def test_without_its_pose_it_stops_and_at_last_lands(flyer):
    flyer.silent = {"pose"}
    flyer.run(0.1)
    assert flyer.velocity != STILL
    flyer.run(0.01)
    assert (flyer.phase, flyer.velocity) == (Phase.HOLD, STILL)
    flyer.run(0.91)
    assert (flyer.phase, flyer.velocity) == (Phase.LANDING, (0.0, 0.0, -0.7))
    assert flyer.detail.startswith("own pose lost")


def test_without_telemetry_it_lands(flyer):
    flyer.silent = {"telemetry"}
    flyer.run(2.9)
    assert flyer.phase is Phase.FORMATION
    flyer.run(0.2)
    assert flyer.phase is Phase.LANDING


def test_a_battery_that_runs_out_lands(flyer):
    flyer.battery = 0.09
    flyer.run(0.01)
    assert (flyer.phase, flyer.detail) == (Phase.LANDING, "battery at 9%")


def test_at_the_fence_it_flies_inwards_only_and_beyond_it_lands(flyer):
    flyer.position = (10.1, 0.0, 1.0)
    flyer.run(0.01)
    assert flyer.velocity[0] < 0.0
    flyer.position = (-10.1, 0.0, 1.0)
    flyer.run(0.01)
    assert flyer.velocity[0] > 0.0
    flyer.position = (10.6, 0.0, 1.0)
    flyer.run(0.01)
    assert (flyer.phase, flyer.detail) == (Phase.LANDING, "0.6 m outside the fence")


def test_it_lands_on_an_order_and_stays_down(flyer):
    flyer.order("land")
    flyer.run(4.0)
    assert (flyer.phase, flyer.state, flyer.velocity) == (Phase.READY, FlightState.GROUNDED, STILL)


def test_a_stop_is_final(flyer):
    flyer.core.receive(STOP, Stop(flyer.now, "world", "test"), flyer.now)
    flyer.order("start")
    flyer.run(0.1)
    assert (flyer.phase, flyer.velocity) == (Phase.STOPPED, STILL)


@pytest.mark.parametrize("blind", [0.02, 0.5])
def test_a_restart_in_flight_that_sees_itself_late_never_flies_elsewhere(seat, blind):
    leader = seat()
    leader.position, leader.state, leader.silent = (3.0, -2.0, 1.2), FlightState.FLYING, {"pose"}
    leader.run(blind)
    leader.silent = set()
    leader.run(2.0)
    assert leader.position[:2] == pytest.approx((3.0, -2.0), abs=0.1)


def place(leader, now):
    ((key, pose),) = leader.step(now)
    assert key == Key("pose", "uav0")
    assert pose.stamp == now
    return pose.position


def test_a_virtual_leader_rests_at_its_start_until_the_mission_starts(make_swarm):
    leader = VirtualLeader(make_swarm(VIRTUAL), BEGAN)
    assert place(leader, BEGAN) == (1.0, 2.0, 1.5)
    leader.receive(MISSION, Mission(BEGAN, "world", "start", BEGAN + BILLION), BEGAN)
    assert place(leader, BEGAN + BILLION) == (1.0, 2.0, 1.5)
    assert leader.report(BEGAN + BILLION).phase is Phase.READY
    expected = add((1.0, 2.0, 1.5), make_swarm(VIRTUAL).leader.trajectory.build().position(3.0))
    assert place(leader, BEGAN + 4 * BILLION) == pytest.approx(expected)
    assert leader.report(BEGAN + 4 * BILLION).phase is Phase.FORMATION


@pytest.mark.parametrize("order", [("hold", 0), ("land", 0), ("start", 40 * BILLION + BILLION // 2)])
def test_a_virtual_leader_never_leaps(make_swarm, order):
    leader = VirtualLeader(make_swarm(VIRTUAL), BEGAN)
    leader.receive(MISSION, Mission(BEGAN, "world", "start", BEGAN), BEGAN)
    verb, start = order
    now, before = BEGAN + 40 * BILLION, place(leader, BEGAN + 40 * BILLION)
    leader.receive(MISSION, Mission(now, "world", verb, BEGAN + start if start else 0), now)
    for tick in range(1, 101):
        here = place(leader, now + tick * TICK)
        assert dist(here, before) < 0.01
        before = here
