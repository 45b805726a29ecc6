import pytest
from flockwire.flight.director import LEAD_TIME, PATIENCE, Director, Stage
from flockwire.flight.phases import Phase
from flockwire.nanoseconds import BILLION
from flockwire.wire.status import Report, Status

BEGAN = 1_790_000_000 * BILLION
PILOTS = ("leader", "uav1", "uav2")


class Tower:
    """A director, and the pilots' statuses, a tenth of a second between steps."""

    def __init__(self, duration=60.0):
        self.now, self.director = BEGAN, Director(PILOTS, "world", duration, BEGAN)
        self.phases = {}
        self.dead = {}

    def step(self, seconds=0.1, **changes):
        """Let time pass; returns the orders given. `changes` are pilots' phases, or (phase, detail)."""
        self.phases |= changes
        orders = []
        for _ in range(round(seconds * 10)):
            self.now += BILLION // 10
            statuses = {i: status(i, self.dead.get(i, self.now), phase) for i, phase in self.phases.items()}
            orders.append(self.director.step(statuses, self.now))
        return [order.verb for order in orders if order]

    def all(self, phase, seconds=0.1):
        return self.step(seconds, **dict.fromkeys(PILOTS, phase))

    @property
    def stage(self):
        return self.director.stage


def status(identity, stamp, phase):
    report = Report(*phase) if isinstance(phase, tuple) else Report(phase)
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
    assert tower.all(Phase.READY) == []
    assert (tower.stage, tower.director.failure) == (Stage.OVER, "")


def test_it_waits_for_the_last_pilot(tower):
    assert tower.step(leader=Phase.READY, uav1=Phase.READY) == []
    assert tower.step(uav2=Phase.READY) == ["takeoff"]
    assert tower.step(leader=Phase.HOLD, uav1=Phase.HOLD) == []
    assert tower.step(uav2=Phase.HOLD) == ["start"]


def test_a_pilot_whose_status_is_old_is_not_there(tower):
    tower.dead = {"uav2": BEGAN - 3 * BILLION}
    assert tower.all(Phase.READY, 1.0) == []


def test_the_formation_begins_at_a_time_that_all_hear_before_it(tower):
    tower.all(Phase.READY)
    now = tower.now + 1
    start = tower.director.step({i: status(i, now, Phase.HOLD) for i in PILOTS}, now)
    assert (start.verb, start.stamp, start.start) == ("start", now, now + LEAD_TIME)


def test_without_a_duration_it_flies_until_told():
    tower = Tower(duration=0.0)
    tower.all(Phase.READY)
    tower.all(Phase.HOLD)
    assert tower.all(Phase.FORMATION, 600.0) == []
    assert tower.director.land(tower.now).verb == "land"


@pytest.mark.parametrize(("phase", "seconds"), [(Phase.LANDING, 0.1), (Phase.STOPPED, 0.1), (Phase.GROUNDED, 1.1)])
def test_a_pilot_that_leaves_the_formation_ends_the_flight(flying, phase, seconds):
    assert flying.step(seconds, uav2=(phase, "battery at 9%")) == ["land"]
    assert flying.director.failure == "uav2 left the formation: battery at 9%"
    flying.all(Phase.GROUNDED)
    assert flying.stage is Stage.OVER


def test_a_pilot_that_begins_anew_has_a_second_to_find_itself_in_flight(flying):
    for _ in range(2):
        assert flying.step(0.9, uav2=(Phase.GROUNDED, "waits for its own pose")) == []
        assert flying.step(0.1, uav2=Phase.HOLD) == []
    assert flying.stage is Stage.FLYING


def test_a_pilot_that_holds_for_a_while_ends_nothing(flying):
    assert flying.step(3.0, uav1=(Phase.HOLD, "own pose is stale")) == []
    assert flying.stage is Stage.FLYING


def test_a_pilot_that_falls_silent_in_formation_ends_the_flight(flying):
    flying.dead = {"uav1": flying.now}
    assert flying.step(5.0) == ["land"]
    assert "uav1" in flying.director.failure


def test_a_dead_process_lands_the_others(flying):
    assert flying.director.abort("uav1 ended by itself (exit status 1)", flying.now).verb == "land"
    flying.all(Phase.GROUNDED)
    assert (flying.stage, flying.director.failure) == (Stage.OVER, "uav1 ended by itself (exit status 1)")


def test_a_dead_process_on_the_ground_ends_the_flight_at_once(tower):
    assert tower.director.abort("gateway ended by itself", tower.now) is None
    assert (tower.stage, tower.director.failure) == (Stage.OVER, "gateway ended by itself")


def test_the_first_failure_is_the_one_told(flying):
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
    flying.director.land(flying.now)
    assert flying.all(Phase.LANDING, PATIENCE / BILLION + 1) == []
    assert flying.stage is Stage.OVER
    assert flying.director.failure.startswith("still landing after 30 s")


def test_before_take_off_an_order_to_land_just_ends(tower):
    tower.all(Phase.GROUNDED)
    assert tower.director.land(tower.now) is None
    assert tower.stage is Stage.OVER


def test_it_is_not_over_before_the_pilots_had_time_to_hear_of_the_take_off(tower):
    tower.all(Phase.READY)
    told = {i: status(i, tower.now - 1, Phase.READY) for i in PILOTS}  # said before the take-off, heard after it
    assert tower.director.land(tower.now + 1).verb == "land"
    tower.director.step(told, tower.now + 2)
    assert tower.stage is Stage.LANDING
