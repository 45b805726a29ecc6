"""Stages of a flight, orders until they are confirmed, and drones that are down by their own word."""

from dataclasses import dataclass

import pytest
from flockwire.flight.director import GRACE, LEAD_TIME, PATIENCE, REPEAT, Director, Stage
from flockwire.flight.fleet import STALE
from flockwire.flight.phases import Phase
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import FlightState, Mission, Telemetry
from flockwire.wire.status import Report, Status

BEGAN = 1_790_000_000 * BILLION
PILOTS = {0: "leader", 1: "uav1", 2: "uav2"}
DRONES = {pilot: drone for drone, pilot in PILOTS.items()}
ON_THE_GROUND = (Phase.GROUNDED, Phase.READY)


@dataclass
class Pilot:
    """One pilot with its drone: what its status and the drone's telemetry say."""

    phase: Phase
    detail: str = ""
    mission: Mission | None = None  # the order that it obeys
    state: FlightState | None = None  # of the drone; what goes with the phase unless set
    deaf: bool = False  # no order arrives
    silent_since: int = 0  # no status after this, Unix ns
    unheard_since: int = 0  # no telemetry of its drone after this, Unix ns


class Tower:
    """A director, and its pilots' statuses and telemetry, a tenth of a second between steps."""

    def __init__(self, duration=60.0, formation=""):
        self.now, self.director = BEGAN, Director(PILOTS, "world", duration, BEGAN, formation)
        self.pilots = {}
        self.sent = []  # all orders, repetitions too

    def step(self, seconds=0.1, **changes):
        """Let time pass; returns the verbs of new orders. `changes` are pilots' phases, or (phase, detail)."""
        for name, change in changes.items():
            pilot = self.pilots.setdefault(name, Pilot(Phase.GROUNDED))
            pilot.phase, pilot.detail = change if isinstance(change, tuple) else (change, "")
        orders = []
        for _ in range(round(seconds * 10)):
            self.now += BILLION // 10
            order = self.director.step(self.statuses(), self.telemetry(), self.now)
            if order is not None:
                self.arrive(order)
                orders += [] if order in self.sent else [order.verb]
                self.sent.append(order)
        return orders

    def arrive(self, order):
        """Let an order arrive at whoever is not deaf."""
        for pilot in self.pilots.values():
            if not pilot.deaf and (pilot.mission is None or pilot.mission.stamp <= order.stamp):
                pilot.mission = order

    def land(self):
        """Have the director land; returns its order."""
        order = self.director.land(self.now)
        if order is not None:
            self.arrive(order)
            self.sent.append(order)
        return order

    def statuses(self):
        return {
            name: status(name, pilot.silent_since or self.now, pilot.phase, pilot.detail, pilot.mission)
            for name, pilot in self.pilots.items()
        }

    def telemetry(self):
        return {
            DRONES[name]: Telemetry(pilot.unheard_since or self.now, "world", state_of(pilot), 1.0, 1.0, 0.0)
            for name, pilot in self.pilots.items()
        }

    def all(self, phase, seconds=0.1):
        return self.step(seconds, **dict.fromkeys(DRONES, phase))

    @property
    def stage(self):
        return self.director.stage


def state_of(pilot):
    if pilot.state is not None:
        return pilot.state
    if pilot.phase is Phase.STOPPED:
        return FlightState.STOPPED
    return FlightState.GROUNDED if pilot.phase in ON_THE_GROUND else FlightState.FLYING


def status(identity, stamp, phase, detail="", mission=None):
    report = Report(phase, detail, mission=mission)
    return Status(stamp, "world", identity, report, 0, 0, 0, 0, 0, 0.0, 0, (), ())


@pytest.fixture
def tower():
    return Tower()


@pytest.fixture
def flying():
    """Return a director whose pilots are in formation."""
    tower = Tower()
    tower.all(Phase.READY)
    tower.all(Phase.HOLD)
    assert tower.all(Phase.FORMATION) == []
    assert tower.stage is Stage.FLYING
    return tower


def test_a_flight_goes_through_its_stages(tower):
    assert tower.all(Phase.GROUNDED) == []
    assert tower.all(Phase.READY) == ["takeoff"]
    assert tower.stage is Stage.TAKING_OFF
    assert tower.all(Phase.TAKEOFF) == []
    assert tower.all(Phase.HOLD) == ["start"]
    assert tower.all(Phase.FORMATION, 59.0) == []
    assert tower.all(Phase.FORMATION, 2.0) == ["land"]
    assert tower.stage is Stage.LANDING
    assert tower.all(Phase.LANDING, 2.0) == []
    assert tower.stage is Stage.LANDING
    assert tower.all(Phase.READY) == []
    assert (tower.stage, tower.director.failure) == (Stage.OVER, "")


def test_it_waits_for_the_last_pilot(tower):
    assert tower.step(leader=Phase.READY, uav1=Phase.READY) == []
    assert tower.step(uav2=Phase.READY) == ["takeoff"]
    assert tower.step(leader=Phase.HOLD, uav1=Phase.HOLD) == []
    assert tower.step(uav2=Phase.HOLD) == ["start"]


def test_a_pilot_whose_status_is_old_is_not_there(tower):
    tower.pilots["uav2"] = Pilot(Phase.READY, silent_since=BEGAN - STALE)
    assert tower.all(Phase.READY, 1.0) == []


def test_the_formation_begins_at_a_time_that_all_hear_before_it(tower):
    tower.all(Phase.READY)
    assert tower.all(Phase.HOLD) == ["start"]
    start = tower.sent[-1]
    assert (start.stamp, start.start) == (tower.now, tower.now + LEAD_TIME)


def test_without_a_duration_it_flies_until_told():
    tower = Tower(duration=0.0)
    tower.all(Phase.READY)
    tower.all(Phase.HOLD)
    assert tower.all(Phase.FORMATION, 600.0) == []
    assert tower.land().verb == "land"


@pytest.mark.parametrize(
    ("phase", "seconds"), [(Phase.LANDING, 0.1), (Phase.STOPPED, 0.1), (Phase.GROUNDED, GRACE / BILLION + 0.1)]
)
def test_a_pilot_that_leaves_the_formation_ends_the_flight(flying, phase, seconds):
    assert flying.step(seconds, uav2=(phase, "battery at 9%")) == ["land"]
    why = "its motors stopped" if phase is Phase.STOPPED else "battery at 9%"
    assert flying.director.failure == f"uav2 left the formation: {why}"
    flying.all(Phase.GROUNDED)
    assert flying.stage is Stage.OVER


def test_a_restarted_pilot_has_a_second_to_find_itself_in_flight(flying):
    for _ in range(2):
        flying.pilots["uav2"].state = FlightState.FLYING
        assert flying.step(0.9, uav2=(Phase.GROUNDED, "waits for its own pose")) == []
        assert flying.step(0.1, uav2=Phase.HOLD) == []
    assert flying.stage is Stage.FLYING


def test_a_pilot_that_holds_for_a_while_ends_nothing(flying):
    assert flying.step(3.0, uav1=(Phase.HOLD, "own pose is stale")) == []
    assert flying.stage is Stage.FLYING


def test_a_pilot_that_falls_silent_in_formation_ends_the_flight(flying):
    flying.pilots["uav1"].silent_since = flying.now
    assert flying.step(STALE / BILLION - 0.1) == []
    assert flying.step(0.1) == ["land"]
    assert flying.director.failure == "uav1 left the formation: silent"


def test_a_drone_that_says_it_is_down_ends_the_flight_whatever_its_pilot_says(flying):
    flying.pilots["uav1"].state = FlightState.GROUNDED
    assert flying.step(GRACE / BILLION) == []
    assert flying.step(0.1) == ["land"]
    assert flying.director.failure == "uav1 left the formation: formation"


def test_a_dead_process_lands_the_others(flying):
    assert flying.director.abort("uav1 ended by itself (exit status 1)", flying.now).verb == "land"
    flying.all(Phase.GROUNDED)
    assert (flying.stage, flying.director.failure) == (Stage.OVER, "uav1 ended by itself (exit status 1)")


def test_a_dead_process_on_the_ground_ends_the_flight_at_once(tower):
    assert tower.director.abort("gateway ended by itself", tower.now) is None
    assert (tower.stage, tower.director.failure) == (Stage.OVER, "gateway ended by itself")


def test_the_first_failure_is_the_one_reported(flying):
    flying.director.abort("first", flying.now)
    flying.director.abort("second", flying.now)
    assert flying.director.failure == "first"


def test_on_the_ground_patience_ends_with_what_is_waited_for(tower):
    tower.step(leader=Phase.READY, uav1=(Phase.GROUNDED, "waits for its own pose"))
    assert tower.step(PATIENCE / BILLION + 1) == []
    assert tower.stage is Stage.OVER
    assert tower.director.failure == "still preparing after 30 s (uav1: waits for its own pose; uav2: no status)"


def test_in_the_air_patience_ends_with_a_landing(tower):
    tower.all(Phase.READY)
    tower.step(leader=Phase.HOLD, uav1=Phase.HOLD, uav2=(Phase.TAKEOFF, "slow"))
    assert tower.step(PATIENCE / BILLION + 1) == ["land"]
    assert tower.stage is Stage.LANDING
    assert "uav2: slow" in tower.director.failure


def test_a_landing_that_never_ends_is_given_up(flying):
    flying.land()
    assert flying.all(Phase.LANDING, PATIENCE / BILLION + 1) == []
    assert flying.stage is Stage.OVER
    assert flying.director.failure == "still landing after 30 s (not known to be down: uav0, uav1, uav2)"


def test_before_take_off_an_order_to_land_just_ends(tower):
    tower.all(Phase.GROUNDED)
    assert tower.land() is None
    assert tower.stage is Stage.OVER


@pytest.mark.parametrize("said", [Phase.GROUNDED, Phase.READY, Phase.LANDING])
def test_a_flight_is_over_when_every_drone_says_that_it_is_down_whatever_the_pilots_say(flying, said):
    flying.land()
    for pilot in flying.pilots.values():
        pilot.state = FlightState.FLYING
    flying.all(said, 1.0)
    assert flying.stage is Stage.LANDING
    for name in ("leader", "uav1"):
        flying.pilots[name].state = FlightState.GROUNDED
    flying.all(said, 1.0)
    assert flying.stage is Stage.LANDING
    flying.pilots["uav2"].state = FlightState.STOPPED
    flying.all(said)
    assert flying.stage is Stage.OVER


def test_a_drone_whose_telemetry_is_old_is_not_known_to_be_down(flying):
    flying.land()
    flying.pilots["uav2"].unheard_since = flying.now - STALE
    flying.all(Phase.GROUNDED, 3.0)
    assert flying.stage is Stage.LANDING


def test_it_is_not_over_before_the_pilots_had_time_to_receive_the_take_off(tower):
    tower.all(Phase.READY)
    for pilot in tower.pilots.values():
        pilot.unheard_since = tower.now  # sent before the order to land, received after it
    tower.now += 1
    assert tower.land().verb == "land"
    tower.step()
    assert tower.stage is Stage.LANDING
    for pilot in tower.pilots.values():
        pilot.unheard_since = 0
    tower.step()
    assert tower.stage is Stage.OVER


def test_an_order_is_repeated_unchanged_until_every_pilot_obeys_it(tower):
    tower.all(Phase.GROUNDED)
    tower.pilots["uav2"].deaf = True
    assert tower.all(Phase.READY, 1.0) == ["takeoff"]
    assert REPEAT == BILLION // 10  # the tower's step
    assert tower.sent == [tower.sent[0]] * 10
    tower.pilots["uav2"].deaf = False
    tower.all(Phase.TAKEOFF)
    count = len(tower.sent)
    assert tower.all(Phase.TAKEOFF, 1.0) == []
    assert len(tower.sent) == count


def test_the_newest_order_of_another_operator_is_this_flights_too(flying):
    flying.arrive(Mission(flying.now + 1, "world", "hold"))
    assert flying.all(Phase.HOLD, 1.0) == []
    assert flying.stage is Stage.FLYING
    flying.arrive(Mission(flying.now + 2, "world", "land"))
    flying.all(Phase.LANDING)
    assert (flying.stage, flying.director.failure) == (Stage.LANDING, "")


def test_it_holds_and_goes_on_with_the_formation_whose_time_went_on(flying):
    start = flying.sent[-1]
    held = flying.director.hold(flying.now + 1)
    assert held.verb == "hold"
    resumed = flying.director.resume(flying.now + 2)
    assert resumed == start._replace(stamp=flying.now + 2)


def test_before_the_formation_there_is_nothing_to_hold_or_resume(tower):
    assert tower.director.hold(tower.now) is tower.director.resume(tower.now) is None


def test_an_emergency_stop_is_a_failure_and_the_flight_is_over_when_nothing_flies(flying):
    flying.director.stop(flying.now)
    assert flying.step() == []
    assert (flying.stage, flying.director.failure) == (Stage.LANDING, "emergency stop")
    flying.all(Phase.STOPPED)
    assert flying.stage is Stage.OVER


def test_who_is_on_the_ground_joins_a_formation_that_flies():
    tower, running = Tower(), Mission(BEGAN - BILLION, "world", "start", BEGAN, "line")
    for name in ("leader", "uav1"):
        tower.pilots[name] = Pilot(Phase.FORMATION, mission=running)
    assert tower.step(uav2=Phase.READY) == ["start"]
    assert tower.sent[-1] == running._replace(stamp=tower.now)
    tower.all(Phase.FORMATION)
    assert tower.stage is Stage.FLYING


def test_it_starts_the_formation_that_it_is_asked_for():
    tower = Tower(formation="line")
    tower.all(Phase.READY)
    tower.all(Phase.HOLD)
    assert (tower.sent[-1].verb, tower.sent[-1].formation) == ("start", "line")
