from dataclasses import dataclass, field

import pytest
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission, Order
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.director import GRACE, LEAD_TIME, REPEAT, STAGE_TIME, Director, Stage
from flockwire_core.ground.fleet import STALE, Fleet
from flockwire_core.ground.order_log import OrderLog
from flockwire_core.loading import parse_swarm
from flockwire_core.pilot.orders import Orders, rank
from flockwire_core.pilot.phases import OUTDATED
from flockwire_core.swarm.tables import Fence
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Report, Status

BEGAN = 1_790_000_000 * SECOND
OURS, THEIRS = 7, 8  # the numbers of the director that is tested, and of another operator
STARTS = ((3.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.5, 0.0))
PLAN = Plan(
    parse_swarm(
        {
            "name": "three",
            "control": {"law": "paper"},
            "formation": {"kind": "circle", "radius": 2.0, "rate": 0.5},
            "leader": {"trajectory": {"kind": "constant", "velocity": [0.1, 0.1, 0.0]}},
            "formations": {"line": {"kind": "line"}},
            "graph": {"edges": [[0, 1], [1, 2]]},
            "limits": {"start_tolerance": 0.2},
            "drones": [{"id": i, "start": start} for i, start in enumerate(STARTS)],
        },
        "test.toml",
    )
)
PILOTS = PLAN.pilots
PATIENCE = STAGE_TIME / SECOND + PLAN.swarm.climb_time  # s, of a stage in the air
ON_GROUND = (Phase.GROUNDED, Phase.READY)
GROUNDED, FLYING, STOPPED = FlightState.GROUNDED, FlightState.FLYING, FlightState.STOPPED


@dataclass
class Pilot:
    """What one pilot and its drone's driver publish; `deaf`: no order reaches it."""

    drone: int
    phase: Phase | None = None  # None: it has not published yet
    detail: str = ""
    state: FlightState | None = None  # of its drone; None: as the phase has it
    orders: Orders = field(default_factory=Orders)
    deaf: bool = False
    position: tuple[float, float, float] | None = None
    died: int | None = None  # its newest status is of then, Unix ns
    driver_died: int | None = None

    @property
    def mission(self):
        return self.orders.mission

    @mission.setter
    def mission(self, order):
        """Have it obey `order` alone, None: no order, as one that has just begun."""
        self.orders = Orders()
        if order is not None:
            self.orders.take(order._replace(number=max(order.number, 1)), order.stamp)

    def status(self, now):
        orders = self.orders
        report = Report(
            self.phase, self.detail, mission=orders.mission, position=self.position,
            unnumbered=orders.unnumbered, order_age=orders.age(now),
        )  # fmt: skip
        return Status(self.died or now, "world", PILOTS[self.drone], report, 0, 0, 0, 0, 0, 0.0, 0, (), ())

    def telemetry(self, now):
        state = self.state
        if state is None:
            state = GROUNDED if self.phase in ON_GROUND else STOPPED if self.phase is Phase.STOPPED else FLYING
        return Telemetry(self.driver_died or now, "world", state, 1.0, 0.0, 0.0)


def conducting(duration=60.0, formation="", without=(), **options):
    """Return a director that begins now."""
    return Director(
        PLAN, Order("start", formation, without=without), OURS, BEGAN, Fleet({}, {}, {}, BEGAN), duration, **options
    )


class Tower:
    """A director, its pilots, and the gateway's log, a tenth of a second between steps."""

    phase, detail = Phase.TRACKING, ""  # of the gateway
    recorder = None  # age, ns, and report of its newest status

    def __init__(self, duration=60.0, formation=""):
        self.now, self.director = BEGAN, conducting(duration, formation)
        self.pilots = {name: Pilot(drone) for drone, name in PILOTS.items()}
        self.log = OrderLog(frozenset(), BEGAN)

    def step(self, seconds=0.1, **changes):
        """Let time pass; returns the verbs of the orders given. `changes`: pilots' phases, or (phase, detail)."""
        return [order.verb for order in self.orders(seconds, **changes)]

    def orders(self, seconds=0.1, **changes):
        for name, phase in changes.items():
            self.pilots[name].phase, self.pilots[name].detail = phase if isinstance(phase, tuple) else (phase, "")
        given = []
        for _ in range(round(seconds * 10)):
            self.now += SECOND // 10
            order = self.director.step(self.fleet(self.now))
            if order is not None:
                given.append(order)
                self.take(order)
        return given

    def fleet(self, now):
        """Return what the director knows at `now`."""
        statuses, telemetry = self.received()
        return Fleet(PILOTS, statuses, telemetry, now)

    def received(self):
        """Return the newest statuses and telemetry."""
        there = [(name, pilot) for name, pilot in self.pilots.items() if pilot.phase is not None]
        statuses = {name: pilot.status(self.now) for name, pilot in there}
        report = Report(self.phase, self.detail, mission=self.log.order, order_age=self.log.age(self.now))
        statuses["gateway"] = Status(self.now, "world", "gateway", report, 0, 0, 0, 0, 0, 0.0, 0, (), ())
        if self.recorder is not None:
            age, report = self.recorder
            statuses["recorder"] = Status(self.now - age, "world", "recorder", report, 0, 0, 0, 0, 0, 0.0, 0, (), ())
        return statuses, {pilot.drone: pilot.telemetry(self.now) for _, pilot in there}

    def take(self, order):
        """Let an order reach the gateway and the pilots, whose next statuses name it."""
        if not rank(order):
            number = self.log.order.number if self.log.order is not None else 0
            order = order if order.giver == OURS else order._replace(number=number)
        self.log.take(order, self.now)
        for pilot in self.pilots.values():
            for one in (order, self.log.order) if rank(order) else (self.log.order,):
                if not pilot.deaf and one is not None:
                    pilot.orders.take(one, self.now)

    def obey(self, order, *pilots):
        """Have `pilots` (none: all) obey an order that the log has had for long."""
        self.log = OrderLog(frozenset(), BEGAN)
        self.log.take(order, order.stamp)
        for name in pilots or tuple(self.pilots):
            self.pilots[name].mission = self.log.order

    def all(self, phase, seconds=0.1):
        return self.step(seconds, **dict.fromkeys(self.pilots, phase))

    @property
    def stage(self):
        return self.director.stage

    @property
    def failure(self):
        return self.director.failure


class Mute(Tower):
    """A tower that receives from pilots, and of drones only those in `heard`."""

    heard: frozenset[int] = frozenset()

    def received(self):
        statuses, telemetry = super().received()
        return statuses, {drone: message for drone, message in telemetry.items() if drone in self.heard}


@pytest.fixture
def tower():
    return Tower()


@pytest.fixture
def flying():
    """Return a tower whose pilots are in formation."""
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
    assert (tower.stage, tower.failure) == (Stage.OVER, "")


def test_it_waits_for_the_last_pilot(tower):
    assert tower.step(leader=Phase.READY, uav1=Phase.READY) == []
    assert tower.step(uav2=Phase.READY) == ["takeoff"]
    assert tower.step(leader=Phase.HOLD, uav1=Phase.HOLD) == []
    assert tower.step(uav2=Phase.HOLD) == ["start"]


def test_a_pilot_whose_status_is_old_is_not_there(tower):
    tower.pilots["uav2"].died = BEGAN - STALE
    assert tower.all(Phase.READY, 1.0) == []


def test_the_formation_begins_at_a_time_that_all_receive_before_it(tower):
    tower.all(Phase.READY)
    (start,) = tower.orders(0.1, **dict.fromkeys(tower.pilots, Phase.HOLD))
    assert (start.verb, start.stamp, start.start) == ("start", tower.now, tower.now + LEAD_TIME)


def test_it_starts_the_formation_that_it_was_given():
    tower = Tower(formation="line")
    tower.all(Phase.READY)
    assert [order.formation for order in tower.orders(0.1, **dict.fromkeys(tower.pilots, Phase.HOLD))] == ["line"]


def test_without_a_duration_it_flies_until_an_order():
    tower = Tower(duration=0.0)
    tower.all(Phase.READY)
    tower.all(Phase.HOLD)
    assert tower.all(Phase.FORMATION, 600.0) == []
    assert tower.director.land(tower.now).verb == "land"


# Orders are repeated until they are confirmed.


def test_an_order_is_repeated_until_every_pilots_status_names_it(tower):
    tower.pilots["uav2"].deaf = True
    (first,) = tower.orders(0.1, **dict.fromkeys(tower.pilots, Phase.READY))
    again = tower.orders(0.5)
    assert again == [first] * 5  # with the same stamp: to who has it already it is no news
    tower.pilots["uav2"].deaf = False
    assert tower.orders(0.1) == [first]
    assert tower.orders(1.0) == []


def test_an_order_is_repeated_no_faster_than_needed(tower):
    tower.pilots["uav2"].deaf = True
    tower.all(Phase.READY)
    sent = [tower.director.step(tower.fleet(tower.now + k * REPEAT // 4)) for k in range(1, 13)]
    assert [k for k, order in enumerate(sent, 1) if order is not None] == [4, 8, 12]


def test_a_pilot_that_restarted_without_the_order_gets_it_again(flying):
    order = flying.pilots["uav1"].mission
    flying.pilots["uav1"].mission, flying.pilots["uav1"].deaf = None, True
    assert [one.version for one in flying.orders(0.2)] == [order.version] * 2


def test_nothing_is_repeated_when_the_flight_is_over(flying):
    flying.take(flying.director.land(flying.now))
    flying.all(Phase.READY)
    assert flying.stage is Stage.OVER
    for pilot in flying.pilots.values():
        pilot.mission = None
    assert flying.step(1.0) == []


# Lost drones.


@pytest.mark.parametrize(("phase", "seconds"), [(Phase.LANDING, 0.1), (Phase.STOPPED, 0.1), (Phase.GROUNDED, 1.1)])
def test_a_pilot_that_leaves_the_formation_ends_the_flight(flying, phase, seconds):
    assert flying.step(seconds, uav2=(phase, "battery at 9%")) == ["land"]
    assert flying.failure.startswith("uav2 left the formation: ")
    flying.all(Phase.GROUNDED)
    assert flying.stage is Stage.OVER


def test_the_reason_is_the_pilots_own(flying):
    flying.step(uav2=(Phase.LANDING, "battery at 9%"))
    assert flying.failure == "uav2 left the formation: battery at 9%"


@pytest.mark.parametrize("phase", [Phase.READY, Phase.FORMATION, Phase.HOLD])
@pytest.mark.parametrize("state", [GROUNDED, STOPPED])
def test_a_drone_on_the_ground_is_lost_whatever_its_pilot_reports(flying, phase, state):
    flying.pilots["uav2"].state = state
    assert flying.step(0.9, uav2=phase) == []
    assert flying.step(0.3, uav2=phase) == ["land"]
    assert flying.failure.startswith("uav2 left the formation: ")
    assert flying.failure.endswith("its motors stopped") == (state is STOPPED)


def test_a_pilot_that_restarts_has_a_second_to_find_itself_in_flight(flying):
    flying.pilots["uav2"].state = FLYING
    for _ in range(2):
        assert flying.step(GRACE / SECOND - 0.1, uav2=(Phase.GROUNDED, "waits for its own pose")) == []
        assert flying.step(0.1, uav2=Phase.HOLD) == []
    assert flying.stage is Stage.FLYING


def test_a_pilot_may_be_given_longer_to_come_back():
    director = conducting(0.0, grace=5 * SECOND)
    director.stage = Stage.FLYING
    orders = [director.step(Fleet(PILOTS, {}, {}, BEGAN + tenth * SECOND // 10)) for tenth in range(51)]
    assert [tenth for tenth, order in enumerate(orders) if order is not None] == [50]
    assert director.failure.startswith("leader left the formation")


def test_a_pilot_that_holds_for_a_while_ends_nothing(flying):
    assert flying.step(3.0, uav1=(Phase.HOLD, "own pose is stale")) == []
    assert flying.stage is Stage.FLYING


def test_a_pilot_that_falls_silent_in_formation_ends_the_flight(flying):
    flying.pilots["uav1"].died = flying.now
    assert set(flying.step((STALE + GRACE) / SECOND - 0.2)) == {"start"}  # which it has not confirmed any more
    assert "land" in flying.step(0.2)
    assert flying.failure == "uav1 left the formation: silent"


def test_a_station_that_was_frozen_counts_no_drone_as_lost_before_it_received_from_them_again(flying):
    for pilot in flying.pilots.values():
        pilot.died = pilot.driver_died = flying.now
    flying.now += 8 * SECOND
    assert set(flying.step(0.5)) == {"start"}
    for pilot in flying.pilots.values():
        pilot.died = pilot.driver_died = None
    flying.step(2.0)
    assert (flying.stage, flying.failure) == (Stage.FLYING, "")


def test_a_driver_that_falls_silent_does_not_mean_a_drone_on_the_ground(flying):
    flying.pilots["uav1"].driver_died = flying.now
    assert flying.step(5.0) == []


# Over is what telemetry says is down.


def test_a_flight_is_not_over_while_telemetry_has_a_drone_in_the_air(flying):
    flying.director.land(flying.now)
    flying.pilots["uav2"].state = FlightState.LANDING
    assert "land" in flying.all(Phase.READY, 3.0)
    assert flying.stage is Stage.LANDING
    flying.pilots["uav2"].state = GROUNDED
    flying.step()
    assert flying.stage is Stage.OVER


def test_telemetry_from_before_the_order_to_land_is_not_a_landing(flying):
    for pilot in flying.pilots.values():
        pilot.state, pilot.driver_died = GROUNDED, flying.now
    flying.take(flying.director.land(flying.now + 1))
    flying.all(Phase.READY)
    assert flying.stage is Stage.LANDING
    for pilot in flying.pilots.values():
        pilot.driver_died = None
    flying.step()
    assert flying.stage is Stage.OVER


def test_silence_is_not_a_landing(flying):
    flying.director.land(flying.now)
    flying.pilots["uav2"].driver_died, flying.pilots["uav2"].state = flying.now, FLYING
    flying.all(Phase.READY, 5.0)
    assert flying.stage is Stage.LANDING
    flying.step(PATIENCE)
    assert (flying.stage, flying.failure) == (
        Stage.OVER, "still landing after 34 s (not known to be down: uav2)"
    )  # fmt: skip


def test_drones_that_are_down_are_over_though_their_pilots_are_dead(flying):
    for pilot in flying.pilots.values():
        pilot.state, pilot.died = GROUNDED, flying.now
    flying.director.land(flying.now)
    flying.step(2.5)
    assert flying.stage is Stage.OVER


def test_it_is_not_over_while_a_pilot_may_still_obey_the_take_off(tower):
    tower.pilots["uav2"].deaf = True
    tower.all(Phase.READY)
    tower.take(tower.director.land(tower.now))
    assert tower.step(0.5) == ["land"] * 5
    assert tower.stage is Stage.LANDING  # uav2 stands on the ground, and has not confirmed the landing
    tower.pilots["uav2"].deaf = False
    tower.step(0.2)
    assert (tower.stage, tower.failure) == (Stage.OVER, "")


# The operator, and other operators.


def test_another_operators_landing_is_this_flights_and_not_a_failure(flying):
    flying.take(Mission(flying.now, "world", "land"))
    assert flying.all(Phase.LANDING, 1.0) == []
    assert flying.stage is Stage.LANDING
    flying.all(Phase.READY)
    assert (flying.stage, flying.failure) == (Stage.OVER, "")


def test_another_operators_hold_is_not_overruled(flying):
    flying.take(Mission(flying.now, "world", "hold"))
    assert flying.all(Phase.HOLD, 5.0) == []
    assert (flying.stage, flying.failure) == (Stage.FLYING, "")


def test_another_operators_order_that_reached_one_pilot_is_repeated_for_the_others(flying):
    hold = Mission(flying.now, "world", "hold")
    flying.log.take(hold, flying.now)
    flying.pilots["uav2"].orders.take(flying.log.order, flying.now)
    assert flying.orders(0.1, uav2=Phase.HOLD) == [flying.log.order]
    assert all(pilot.mission.version == hold.version for pilot in flying.pilots.values())


def test_another_operators_formation_is_what_resume_goes_back_to(flying):
    start = flying.pilots["leader"].mission
    wide = start._replace(stamp=flying.now, formation="wide", giver=THEIRS)
    flying.take(wide)
    flying.step()
    assert flying.director.resume(flying.now).formation == "wide"


@pytest.mark.parametrize("verb", ["land", "hold"])
@pytest.mark.parametrize("without", [(), (2,)])
def test_another_operators_landing_or_hold_before_take_off_ends_the_flight(without, verb):
    tower = Tower()
    tower.director = conducting(without=without)
    tower.step(leader=Phase.READY, uav1=Phase.READY, uav2=(Phase.GROUNDED, "waits for its own pose"))
    tower.take(Mission(tower.now + 1, "world", verb))
    assert tower.all(Phase.READY, 0.5) == []
    assert (tower.stage, tower.failure) == (Stage.OVER, "")


@pytest.mark.parametrize("verb", ["land", "hold"])
def test_an_order_from_before_the_flight_does_not_keep_it_on_the_ground(tower, verb):
    tower.take(Mission(BEGAN, "world", verb))
    assert tower.all(Phase.READY) == ["takeoff"]


@pytest.mark.parametrize("verb", ["takeoff", "start"])
def test_another_operators_start_before_take_off_does_not_change_this_one(tower, verb):
    tower.step(leader=Phase.READY)
    tower.take(Mission(tower.now + 1, "world", verb))
    assert tower.all(Phase.HOLD) == ["takeoff"]
    assert tower.all(Phase.HOLD) == ["start"]


def test_another_operators_landing_during_take_off_ends_it(tower):
    tower.all(Phase.READY)
    tower.take(Mission(tower.now + 1, "world", "land"))
    assert tower.all(Phase.LANDING) == []
    assert (tower.stage, tower.failure) == (Stage.LANDING, "")


def test_a_landing_after_which_another_operator_started_again_is_over(flying):
    """A station that was frozen over its landing finds the drones in the air again, by an order that knew of it."""
    land = flying.director.land(flying.now)
    flying.take(land)
    flying.all(Phase.LANDING, 0.2)
    again = Mission(flying.now, "world", "start", giver=THEIRS)
    flying.take(again)
    assert flying.all(Phase.FORMATION, 0.2) == []
    assert (flying.stage, flying.failure) == (Stage.OVER, "")


def test_a_landing_that_one_drone_missed_is_not_over_when_another_operator_prepares(flying):
    """It is given on until that one has it, too: only an upward order of all shows that all were down."""
    flying.pilots["uav2"].deaf = True
    land = flying.director.land(flying.now)
    flying.take(land)
    flying.step(0.2, leader=Phase.LANDING, uav1=Phase.LANDING)
    flying.take(Mission(flying.now, "world", "prepare", giver=THEIRS, without=(2,)))
    assert flying.step(0.3) == ["land"] * 3
    assert flying.stage is Stage.LANDING
    flying.take(Mission(flying.now, "world", "start", giver=THEIRS, without=(2,)))
    flying.step(0.2, leader=Phase.FORMATION, uav1=Phase.FORMATION)
    assert flying.stage is Stage.LANDING


def test_who_starts_without_a_drone_waits_for_those_that_land(tower):
    tower.director = conducting(without=(2,))
    assert tower.step(0.3, leader=Phase.LANDING, uav1=Phase.READY, uav2=Phase.GROUNDED) == []
    assert tower.step(leader=Phase.READY) == ["prepare"]


@pytest.mark.parametrize(("left", "orders"), [((2,), []), ((), ["formation"])])
def test_who_starts_without_a_drone_leaves_a_flying_formation_as_it_is(tower, left, orders):
    """It has that drone left out already, or is told so; nobody holds, its time goes on, even if nobody can join."""
    tower.obey(Mission(BEGAN - SECOND, "world", "start", BEGAN, giver=THEIRS, without=left))
    tower.director = conducting(without=(2,))
    given = tower.orders(0.1, leader=Phase.FORMATION, uav1=(Phase.GROUNDED, "battery"), uav2=Phase.GROUNDED)
    assert [(order.verb, order.start, order.without) for order in given] == [(verb, BEGAN, (2,)) for verb in orders]
    joins = tower.orders(0.1, uav1=Phase.READY)
    assert [(order.verb, order.start, order.without) for order in joins] == [("start", BEGAN, (2,))]


def hold_by_another(tower):
    tower.take(Mission(tower.now + 1, "world", "hold"))


def hold_by_key(tower):
    tower.take(tower.director.hold(tower.now))


@pytest.mark.parametrize("hold", [hold_by_another, hold_by_key])
def test_no_formation_follows_a_take_off_during_which_a_hold_was_ordered(tower, hold):
    tower.all(Phase.READY)
    hold(tower)
    assert tower.all(Phase.TAKEOFF) == []
    assert tower.stage is Stage.TAKING_OFF
    assert tower.all(Phase.HOLD, 5.0) == []
    assert (tower.stage, tower.failure) == (Stage.FLYING, "")
    start = tower.director.resume(tower.now)
    assert (start.verb, start.start) == ("start", tower.now + LEAD_TIME)
    tower.take(start)
    assert tower.all(Phase.FORMATION, 54.0) == []
    assert "land" in tower.all(Phase.FORMATION, 2.0)  # 60 s from take-off


def test_after_a_hold_during_take_off_the_take_off_may_be_ordered_again(tower):
    tower.all(Phase.READY)
    hold_by_another(tower)
    tower.all(Phase.TAKEOFF)
    again = tower.director.resume(tower.now)
    assert (again.verb, again.stamp) == ("takeoff", tower.now)
    tower.take(again)
    assert tower.all(Phase.HOLD) == ["start"]


def test_another_operators_hold_of_drones_in_flight_is_followed_by_no_formation(tower):
    """This one has begun above them, and uav2 does not answer yet."""
    tower.step(leader=Phase.HOLD, uav1=Phase.HOLD, uav2=(Phase.GROUNDED, "waits for its own pose"))
    hold_by_another(tower)
    assert tower.step(leader=Phase.HOLD, uav1=Phase.HOLD) == []
    assert (tower.stage, tower.director.took_off) == (Stage.TAKING_OFF, tower.now)
    assert tower.all(Phase.HOLD, 5.0) == []
    assert (tower.stage, tower.failure) == (Stage.FLYING, "")


def test_a_hold_while_a_straggler_joins_interrupts_the_formation_whose_time_continues(tower):
    running = fly_without("uav2", tower)
    tower.orders()
    hold_by_another(tower)
    assert tower.all(Phase.HOLD, 5.0) == []
    assert tower.stage is Stage.FLYING
    assert same_flight(tower.director.resume(tower.now), running)


def test_after_a_stop_no_order_of_another_operator_is_repeated(flying):
    flying.director.stop(flying.now)
    flying.pilots["uav2"].state = FLYING
    flying.pilots["uav1"].mission = Mission(flying.now + 1, "world", "hold")
    assert flying.all(Phase.STOPPED, 1.0) == []


def test_a_landing_of_another_operator_counts_whatever_its_clock_shows(flying):
    flying.take(Mission(BEGAN - 60 * SECOND, "world", "land"))
    flying.step(0.5)
    assert flying.stage is Stage.LANDING


def test_an_order_that_this_flights_own_was_made_from_changes_nothing(tower):
    for pilot in tower.pilots.values():
        pilot.mission = Mission(BEGAN - SECOND, "world", "land")
    tower.all(Phase.READY)
    tower.pilots["uav1"].mission, tower.pilots["uav1"].deaf = Mission(BEGAN - SECOND, "world", "land"), True
    assert "land" not in tower.all(Phase.HOLD, 0.5)
    assert tower.stage is not Stage.LANDING


def test_after_a_hold_the_formations_time_continues(flying):
    start = flying.pilots["leader"].mission
    hold = flying.director.hold(flying.now)
    flying.take(hold)
    assert (hold.verb, flying.all(Phase.HOLD)) == ("hold", [])
    again = flying.director.resume(flying.now)
    assert again._replace(number=0) == start._replace(stamp=flying.now, number=0)
    assert again.number > start.number
    assert again.stamp > hold.stamp


def test_on_the_ground_there_is_nothing_to_hold_or_to_resume(tower):
    tower.all(Phase.GROUNDED)
    assert tower.director.hold(tower.now) is tower.director.resume(tower.now) is None


def test_a_pilot_restarted_on_the_ground_during_take_off_takes_off_by_the_order_again(tower):
    """It obeys no order from before its own start, so that nothing takes off that nobody looks at."""
    tower.all(Phase.READY)
    tower.step(3.0, leader=Phase.HOLD, uav1=Phase.HOLD, uav2=(Phase.READY, OUTDATED.text))
    again = tower.director.resume(tower.now)
    assert (again.verb, again.stamp, tower.stage) == ("takeoff", tower.now, Stage.TAKING_OFF)
    assert tower.all(Phase.HOLD) == ["start"]


def test_a_drone_that_stays_on_the_ground_is_named_with_the_remedy(tower):
    tower.all(Phase.READY)
    tower.step(PATIENCE + 1, leader=Phase.HOLD, uav1=Phase.HOLD, uav2=(Phase.READY, OUTDATED.text))
    assert tower.failure == f"still taking off after 34 s (uav2: {OUTDATED.text})"


def test_a_stop_is_a_failure_and_over_when_nothing_flies(flying):
    flying.director.stop(flying.now)
    flying.pilots["uav2"].state = FLYING
    assert flying.all(Phase.STOPPED, 0.5) == []
    assert flying.stage is Stage.LANDING
    flying.pilots["uav2"].state = None
    flying.step()
    assert (flying.stage, flying.failure) == (Stage.OVER, "emergency stop")


# Stragglers.


def same_flight(order, running):
    """Return whether `order` has all fly what `running` does, as the director's own order, made from that one."""
    return order == running._replace(stamp=order.stamp, giver=OURS, number=order.number)


def fly_without(straggler, tower):
    """Let all but one be in a formation that somebody started a minute ago; returns its order."""
    running = Mission(BEGAN - 60 * SECOND, "world", "start", BEGAN - 60 * SECOND + LEAD_TIME, "wide")
    tower.obey(running, *(name for name in tower.pilots if name != straggler))
    for name, pilot in tower.pilots.items():
        pilot.phase = Phase.READY if name == straggler else Phase.FORMATION
    return running


def test_a_straggler_joins_the_formation_that_flies_with_its_start(tower):
    running = fly_without("uav2", tower)
    (order,) = tower.orders()
    assert same_flight(order, running)  # same start: the formation's time continues
    assert tower.stage is Stage.TAKING_OFF
    assert tower.orders(1.0, uav2=Phase.TAKEOFF) == []
    assert tower.orders(0.1, uav2=Phase.HOLD) == []
    assert tower.orders(1.0, uav2=Phase.FORMATION) == []
    assert (tower.stage, tower.failure) == (Stage.FLYING, "")


def test_a_straggler_joins_those_that_hold(tower):
    tower.step(leader=Phase.HOLD, uav1=Phase.HOLD)
    assert tower.step(uav2=Phase.READY) == ["takeoff"]
    assert tower.step(uav2=Phase.TAKEOFF) == []
    assert tower.step(uav2=Phase.HOLD) == ["start"]


def test_a_straggler_that_is_not_ready_ends_the_waiting_with_its_reason(tower):
    fly_without("uav2", tower)
    assert tower.step(STAGE_TIME / SECOND + 1, uav2=(Phase.GROUNDED, "battery at 9%, take-off needs 20%")) == []
    assert tower.stage is Stage.OVER  # no order was given: flying drones continue
    assert "uav2: battery at 9%, take-off needs 20%" in tower.failure


# Failures and patience.


def test_a_dead_process_lands_the_others(flying):
    assert flying.director.abort("uav1 ended unexpectedly (exit status 1)", flying.now).verb == "land"
    flying.all(Phase.GROUNDED, 0.2)
    assert (flying.stage, flying.failure) == (Stage.OVER, "uav1 ended unexpectedly (exit status 1)")


def test_a_dead_process_on_the_ground_ends_the_flight_at_once(tower):
    assert tower.director.abort("gateway ended unexpectedly", tower.now) is None
    assert (tower.stage, tower.failure) == (Stage.OVER, "gateway ended unexpectedly")


def test_the_first_failure_is_the_one_told(flying):
    flying.director.abort("first", flying.now)
    flying.director.abort("second", flying.now)
    assert flying.failure == "first"


def test_on_the_ground_patience_ends_with_what_is_waited_for(tower):
    tower.step(leader=Phase.READY, uav1=(Phase.GROUNDED, "waits for its own pose"))
    assert tower.step(STAGE_TIME / SECOND + 1) == []
    assert tower.stage is Stage.OVER
    assert tower.failure == "still preparing after 30 s (uav1: waits for its own pose; uav2: no status)"


class Blind(Tower):
    """A tower whose gateway has no poses."""

    phase, detail = Phase.WAITING, "no answer from 10.0.0.1:1510: check its address"


def test_without_poses_the_reason_of_the_gateway_comes_first():
    tower = Blind()
    tower.all((Phase.GROUNDED, "waits for its own pose"))
    tower.step(STAGE_TIME / SECOND + 1)
    assert "30 s (gateway: no answer from 10.0.0.1:1510: check its address; leader: waits" in tower.failure


@pytest.mark.parametrize(
    ("recorder", "why"),
    [
        ((0, Report(Phase.WAITING, "does not hear gateway")), "recorder: does not hear gateway"),
        ((STALE, Report(Phase.WAITING, "does not hear gateway")), "recorder: does not hear gateway"),  # frozen
        ((STALE, Report(Phase.RECORDING)), ""),  # it was ended, or the gap is in the trace
        ((0, Report(Phase.FULL, "no space")), ""),  # the flight is told at its end
        ((0, Report(Phase.RECORDING)), ""),
    ],
)
def test_no_flight_begins_before_the_recorder_records_it(tower, recorder, why):
    tower.recorder = recorder
    assert tower.all(Phase.READY) == ([] if why else ["takeoff"])
    assert tower.director.unready(tower.fleet(tower.now)) == ((why,) if why else ())
    tower.recorder = (0, Report(Phase.RECORDING))
    assert tower.all(Phase.READY) == (["takeoff"] if why else [])


@pytest.mark.parametrize("phase", [Phase.LANDING, Phase.READY, Phase.GROUNDED, None])
def test_a_drone_that_is_lost_during_take_off_ends_it(tower, phase):
    tower.all(Phase.READY)
    tower.step(0.5)  # the order is on its way: nobody is lost
    assert tower.stage is Stage.TAKING_OFF
    tower.all(Phase.TAKEOFF)
    uav2 = tower.pilots["uav2"]
    if phase is None:
        uav2.died = tower.now
    lost = (phase or Phase.TAKEOFF, "own pose lost for 1 s")
    assert "land" in tower.step(4.0, leader=Phase.HOLD, uav1=Phase.HOLD, uav2=lost)
    assert tower.failure == f"uav2 did not take off: {'own pose lost for 1 s' if phase else 'silent'}"


def test_in_the_air_patience_ends_with_a_landing(tower):
    tower.all(Phase.READY)
    tower.step(leader=Phase.HOLD, uav1=Phase.HOLD, uav2=(Phase.TAKEOFF, "slow"))
    assert tower.step(STAGE_TIME / SECOND + 1) == []  # the climb takes its time
    assert tower.step(PLAN.swarm.climb_time) == ["land"]
    assert tower.stage is Stage.LANDING
    assert "uav2: slow" in tower.failure


def test_a_landing_that_never_ends_is_given_up(flying):
    flying.director.land(flying.now)
    flying.all(Phase.LANDING, PATIENCE + 1)
    assert flying.stage is Stage.OVER
    assert flying.failure.startswith("still landing after 34 s")


def test_before_take_off_an_order_to_land_just_ends(tower):
    tower.all(Phase.GROUNDED)
    assert tower.director.land(tower.now) is None
    assert tower.stage is Stage.OVER


def test_before_take_off_an_order_to_land_lands_what_flies_already(tower):
    fly_without("uav2", tower)
    tower.step(uav2=(Phase.GROUNDED, "waits for its own pose"))
    assert (tower.director.land(tower.now).verb, tower.stage) == ("land", Stage.LANDING)


def test_who_is_left_out_is_reported_first_and_not_waited_for():
    tower = Tower()
    tower.director = conducting(without=(2,))
    (prepare,) = tower.orders(0.1, leader=Phase.READY, uav1=(Phase.GROUNDED, "waits for uav2's estimate"))
    assert (prepare.verb, prepare.without) == ("prepare", (2,))
    assert tower.step() == []
    (off,) = tower.orders(0.1, uav1=Phase.READY)
    (start,) = tower.orders(0.1, leader=Phase.HOLD, uav1=Phase.HOLD)
    (hold,) = [tower.director.hold(tower.now)] if tower.step(leader=Phase.FORMATION, uav1=Phase.FORMATION) == [] else []
    land = tower.director.land(tower.now)
    assert [(order.verb, order.without) for order in (off, start, hold, land)] == [
        (verb, (2,)) for verb in ("takeoff", "start", "hold", "land")
    ]


def test_a_drone_whose_driver_was_not_received_yet_has_not_taken_off():
    tower = Mute()
    tower.all(Phase.READY)
    assert tower.all(Phase.TAKEOFF, 1.0) == []
    tower.heard = frozenset(PILOTS)
    for pilot in tower.pilots.values():
        pilot.state = GROUNDED  # a Tello that has not left the ground
    assert tower.all(Phase.TAKEOFF, 3.0) == []
    assert tower.stage is Stage.TAKING_OFF
    assert tower.failure == ""


AWAY = (
    "uav1: its body is at [1.00, 0.50, 0.00], the start of uav2, 1.12 m from its start, limits.start_tolerance = 0.2 m"
)


@pytest.fixture
def placed():
    """Return a tower whose pilots are ready, with the drone of uav1 at the start of uav2."""
    tower = Tower()
    tower.pilots["uav1"].position, tower.pilots["uav2"].position = STARTS[2], (1.1, 0.5, 0.0)
    return tower


def test_no_drone_takes_off_while_a_drone_stands_away_from_its_start(placed):
    assert placed.all(Phase.READY, 3.0) == []
    assert placed.director.unready(placed.fleet(placed.now)) == (AWAY,)
    placed.pilots["uav1"].position = (0.1, 0.1, 0.02)
    assert placed.all(Phase.READY) == ["takeoff"]


def test_who_stands_away_from_its_start_is_named_when_patience_ends(placed):
    placed.all(Phase.READY, STAGE_TIME / SECOND + 0.2)
    assert AWAY in placed.failure


def test_after_a_flight_drones_stand_where_they_landed(placed):
    placed.obey(Mission(BEGAN - SECOND, "world", "land"), "uav2")
    assert placed.all(Phase.READY) == ["takeoff"]


# Two stations.


def crossed(tower, verb, formation=""):
    """Have the log accept an order of another station, made from what this flight's newest order was made from."""
    other = Mission(tower.now, "world", verb, tower.now, formation, giver=THEIRS)
    tower.take(other)
    return other


def test_of_two_starts_that_crossed_the_one_in_the_log_is_followed(tower):
    tower.all(Phase.READY)
    order = tower.director.order
    for name in tower.pilots:
        tower.pilots[name].phase = Phase.HOLD
    other = crossed(tower, "start", "wide")  # this flight's start is made from the number before
    assert tower.director.step(tower.fleet(tower.now)) is None
    assert order.number < tower.director.order.number
    assert (tower.director.order.giver, tower.director.order.formation) == (THEIRS, other.formation)
    tower.all(Phase.FORMATION, 0.2)
    assert (tower.stage, tower.failure) == (Stage.FLYING, "")


def test_a_start_that_crossed_anothers_take_off_is_given_again(tower):
    tower.all(Phase.READY)
    for name in tower.pilots:
        tower.pilots[name].phase = Phase.HOLD
    start = tower.director.step(tower.fleet(tower.now))
    assert start.verb == "start"
    crossed(tower, "takeoff")
    tower.take(start)  # is too late
    assert tower.log.order.giver == THEIRS
    assert tower.all(Phase.HOLD) == ["start"]
    assert tower.log.order.giver == OURS


def test_a_hold_that_a_pilot_has_first_does_not_end_the_repetition_of_a_landing(flying):
    land = flying.director.land(flying.now)
    flying.pilots["uav2"].deaf = True
    flying.take(land)
    flying.pilots["uav2"].deaf = False
    flying.pilots["uav2"].orders.take(Mission(flying.now, "world", "hold", giver=THEIRS), flying.now)
    assert flying.step(0.1) == ["land"]
    assert flying.pilots["uav2"].mission.verb == "land"


@pytest.mark.parametrize("verb", ["land", "hold"])
def test_while_another_station_takes_off_a_key_counts_before_this_flight_does(tower, verb):
    tower.step(leader=Phase.READY)
    tower.take(Mission(tower.now, "world", "takeoff", giver=THEIRS))
    tower.step(leader=(Phase.TAKEOFF, ""), uav1=Phase.READY)
    order = getattr(tower.director, verb)(tower.now)
    assert order.verb == verb


def test_who_is_left_out_stays_left_out_after_an_order_of_another_station_that_does_not_say_so():
    tower = Tower()
    tower.director = conducting(without=(2,))
    tower.step(leader=Phase.READY, uav1=Phase.READY)
    for phase in (Phase.READY, Phase.HOLD, Phase.FORMATION):
        tower.step(0.2, leader=phase, uav1=phase)
    tower.take(Mission(tower.now, "world", "formation", tower.now, "wide", giver=THEIRS))
    tower.step()
    assert tower.director.resume(tower.now).without == (2,)


def test_the_climb_to_a_great_height_takes_its_time():
    """25 m at 0.7 m/s take 36 s, and so does the descent."""
    high = PLAN.swarm.model_copy(
        update={"limits": PLAN.swarm.limits.model_copy(update={"takeoff_height": 25.0, "fence": Fence(ceiling=30.0)})}
    )
    assert STAGE_TIME / SECOND + high.climb_time > 25.0 / 0.7 + 30.0


def test_a_stop_after_its_end_does_not_open_a_good_flight_again(flying):
    flying.take(flying.director.land(flying.now))
    flying.all(Phase.READY)
    assert (flying.stage, flying.failure) == (Stage.OVER, "")
    flying.director.stop(flying.now)
    assert (flying.stage, flying.failure) == (Stage.OVER, "")
