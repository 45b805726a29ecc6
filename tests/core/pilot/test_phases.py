import pytest
from flockwire_core.domain.order import Change, Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.phases import NEVER, OUTDATED, FlightPhases, age, command_stamp
from flockwire_core.pilot.reactions import HOLD, LAND, REFUSE
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Reason
from hypothesis import given
from hypothesis import strategies as st

BORN = 1_790_000_000 * SECOND
LOW, HIGH = (-1.0, -2.0, 0.0), (1.0, 2.0, 3.0)


class Pilot:
    """A flight and its situation; every update comes a second after the last."""

    def __init__(self):
        self.flight, self.now = FlightPhases(BORN), BORN
        self.unready = self.hold = self.land = ""
        self.airborne = self.high = False

    def update(self, **changes):
        for name, value in changes.items():
            setattr(self, name, value)
        self.now += SECOND
        texts = {REFUSE: self.unready, HOLD: self.hold, LAND: self.land}
        found = {reaction: Reason("", text) for reaction, text in texts.items() if text}
        return self.flight.update(self.now, self.airborne, self.high, found)

    @property
    def reason(self):
        return self.flight.reason.text

    def order(self, verb, start=0):
        self.now += 1
        self.give(Mission(self.now, "world", verb, start))
        return self.update()

    def give(self, order):
        """Give an order, which the gateway has numbered."""
        self.flight.order(order._replace(number=self.flight.orders.number + 1), self.now)


@pytest.fixture
def pilot():
    return Pilot()


@pytest.fixture
def flyer(pilot):
    """Return a pilot in formation."""
    pilot.update()
    pilot.order("takeoff")
    pilot.update(airborne=True, high=True)
    assert pilot.order("start") is Phase.FORMATION
    return pilot


def test_a_flight_goes_from_the_ground_to_formation_and_back(pilot):
    assert pilot.update(unready="waits") is Phase.GROUNDED
    assert pilot.reason == "waits"
    assert pilot.update(unready="") is Phase.READY
    assert pilot.order("takeoff") is Phase.TAKEOFF
    assert pilot.update(airborne=True) is Phase.TAKEOFF
    assert pilot.update(high=True) is Phase.HOLD
    assert pilot.order("start", pilot.now + 3 * SECOND) is Phase.HOLD
    assert [pilot.update() for _ in range(2)] == [Phase.HOLD, Phase.FORMATION]
    assert pilot.order("hold") is Phase.HOLD
    assert pilot.order("land") is Phase.LANDING
    assert pilot.update(airborne=False, high=False) is Phase.GROUNDED
    assert pilot.update() is Phase.READY


def test_it_does_not_take_off_while_something_is_missing(pilot):
    pilot.unready = "waits for its own pose"
    assert pilot.order("takeoff") is Phase.GROUNDED
    assert pilot.update(unready="") is Phase.TAKEOFF


@pytest.mark.parametrize("verb", ["takeoff", "start"])
def test_an_order_to_fly_takes_off(pilot, verb):
    pilot.update()
    assert pilot.order(verb) is Phase.TAKEOFF


def test_an_order_to_hold_is_for_those_who_fly(pilot):
    pilot.update()
    assert pilot.order("hold") is Phase.READY


def test_an_order_to_change_the_formation_does_not_take_off(pilot):
    pilot.update()
    assert pilot.order("formation") is Phase.READY
    assert pilot.order("start") is Phase.TAKEOFF


def test_a_formation_ordered_in_the_air_is_flown_from_its_time_0_on(pilot):
    pilot.update(airborne=True, high=True)
    assert pilot.order("formation", pilot.now + 3 * SECOND) is Phase.HOLD
    assert [pilot.update() for _ in range(2)] == [Phase.HOLD, Phase.FORMATION]


def test_a_hold_keeps_in_mind_which_formation_it_interrupts(flyer):
    change = Change(BORN, 2.0, "", (1, 0), (0, 1))
    flyer.give(Mission(flyer.now + 5, "world", "formation", BORN + 7, "line", change))
    flyer.flight.order(Mission(flyer.now + 6, "world", "hold"), flyer.now)
    flyer.flight.order(Mission(flyer.now + 7, "world", "hold"), flyer.now)
    assert flyer.flight.mission == Mission(flyer.now + 7, "world", "hold", BORN + 7, "line", change)
    assert flyer.update() is Phase.HOLD


def test_an_order_to_land_does_not_take_off(pilot):
    assert pilot.order("land") is Phase.READY


def test_a_reason_to_hold_interrupts_the_formation(flyer):
    assert flyer.update(hold="own pose is stale") is Phase.HOLD
    assert flyer.reason == "own pose is stale"
    assert flyer.update(hold="") is Phase.FORMATION


def test_a_reason_to_land_lands_and_is_reported_until_the_ground(flyer):
    assert flyer.update(land="battery at 9%") is Phase.LANDING
    assert flyer.update(land="") is Phase.LANDING
    assert flyer.reason == "battery at 9%"


def test_landing_is_not_taken_back_in_the_air(flyer):
    flyer.order("land")
    assert flyer.order("start") is Phase.LANDING


def test_landed_by_a_failure_it_waits_for_a_new_order(flyer):
    flyer.update(land="telemetry lost for 3.1 s")
    flyer.update(land="", airborne=False, high=False)
    assert [flyer.update() for _ in range(3)] == [Phase.READY] * 3
    assert flyer.reason == OUTDATED.text
    assert flyer.order("takeoff") is Phase.TAKEOFF


def test_a_failure_during_take_off_lands(pilot):
    pilot.update()
    pilot.order("takeoff")
    assert pilot.update(airborne=True, land="own pose lost for 1.1 s") is Phase.LANDING


def test_a_process_that_restarts_in_flight_holds_and_continues(pilot):
    pilot.give(Mission(BORN - 60 * SECOND, "world", "start", BORN - 50 * SECOND))
    assert pilot.update(airborne=True, high=True) is Phase.HOLD
    assert pilot.update() is Phase.FORMATION


def test_a_process_that_restarts_in_flight_holds_even_when_unready(pilot):
    assert pilot.update(airborne=True, high=True, unready="waits for its own pose") is Phase.HOLD


def test_a_process_that_begins_on_the_ground_obeys_no_order_older_than_itself(pilot):
    pilot.give(Mission(BORN - 1, "world", "takeoff"))
    assert [pilot.update() for _ in range(3)] == [Phase.READY] * 3
    assert pilot.reason == OUTDATED.text
    assert pilot.order("takeoff") is Phase.TAKEOFF
    assert pilot.reason == ""


@pytest.mark.parametrize("verb", ["takeoff", "start", "formation"])
def test_an_order_that_takes_up_and_is_not_in_the_log_is_rejected(flyer, verb):
    flyer.order("hold")
    flyer.flight.order(Mission(flyer.now + 1, "world", verb), flyer.now)
    assert flyer.update() is Phase.HOLD


def test_who_landed_without_an_order_is_taken_up_by_no_order_given_before(flyer):
    flyer.update(land="battery at 9%")
    given = Mission(flyer.now, "world", "start", flyer.now)
    assert flyer.update(airborne=False, high=False, land="") is Phase.GROUNDED
    assert (flyer.update(), flyer.flight.reason) == (Phase.READY, OUTDATED)
    flyer.give(given)
    assert (flyer.update(), flyer.flight.reason) == (Phase.READY, OUTDATED)
    assert flyer.order("start") is Phase.TAKEOFF


def test_a_landing_counts_whatever_its_givers_clock_shows(flyer):
    flyer.flight.order(Mission(BORN - 60 * SECOND, "world", "land"), flyer.now)
    assert flyer.update() is Phase.LANDING


@pytest.mark.parametrize("verb", ["takeoff", "start", "hold", "land"])
def test_stop_is_final(flyer, verb):
    flyer.flight.stop()
    assert flyer.update() is Phase.STOPPED
    assert flyer.order(verb) is Phase.STOPPED
    assert flyer.update(airborne=False, high=False) is Phase.STOPPED
    assert flyer.reason == "emergency stop"


def test_what_never_came_is_infinitely_old():
    assert age(0, BORN) == NEVER
    assert age(BORN - SECOND // 2, BORN) == 0.5


@given(st.lists(st.tuples(st.integers(1, 60), st.booleans()), max_size=40), st.integers(0, 90))
def test_stamps_of_commands_never_go_back_whether_poses_come_or_not(steps, latency):
    pose, now, last = None, BORN, 0
    for wait, seen in steps:
        now += wait * SECOND // 1000
        if seen:
            pose = Pose(now - latency * SECOND // 1000, "world", LOW)
        stamp = command_stamp(pose, now, 0.1)
        assert stamp >= last
        assert (pose is not None and stamp == pose.stamp) or stamp == now - SECOND // 10
        last = stamp
