"""The operator's core: one stop policy, orders that end others, swarm time, and a director for each flight."""

from __future__ import annotations

from itertools import count
from typing import Any

import pytest
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Answer, Mission, Order, Stop
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.delivery import ANSWER_TIME, LOOK_TIME, STOP_TIME
from flockwire_core.ground.director import POLL_PERIOD, Stage
from flockwire_core.ground.fleet import GATEWAY_SILENT
from flockwire_core.ground.operator import ELSEWHERE, ENDED, OperatorCore
from flockwire_core.pilot.orders import rank
from flockwire_core.wire.keys import MISSION, PROPOSAL, STOP, Key
from flockwire_core.wire.status import Report, Status

BEGAN = 1_790_000_000 * SECOND
STEP = round(POLL_PERIOD * SECOND)


class Station:
    """A core, its time, what it published, and the answers to its orders."""

    def __init__(self, plan: Any) -> None:
        self.plan, self.now = plan, BEGAN
        self.core = OperatorCore(plan, count(7).__next__)
        self.published: list[Mission | Stop] = []
        self.answers: list[Answer] = []
        self.notes: list[str] = []

    def step(self, seconds: float = POLL_PERIOD) -> list[str]:
        """Step for `seconds`; return the verbs that were published."""
        before = len(self.published)
        for _ in range(round(seconds / POLL_PERIOD)):
            for key, message in self.core.step(self.now):
                assert key == (STOP if isinstance(message, Stop) else MISSION if rank(message) else PROPOSAL)
                self.published.append(message)
            self.now += STEP
        return ["stop" if isinstance(message, Stop) else message.verb for message in self.published[before:]]

    def ask(self, verb: str, **more: Any) -> None:
        self.core.ask(Order(verb), self.now, answered=self.answers.append, **more)

    def order(self, verb: str) -> None:
        self.core.order(verb, self.now, self.notes.append)

    def stopped(self, state: FlightState = FlightState.STOPPED) -> None:
        """Have all drones report that their motors are off."""
        for drone in self.plan.pilots:
            telemetry = Telemetry(self.now, "world", state, 1.0, 0.0, 0.0, True)
            self.core.receive(Key("telemetry", f"uav{drone}"), telemetry, self.now)


@pytest.fixture
def station(make_plan: Any) -> Station:
    return Station(make_plan())


def test_a_stop_is_published_before_orders_that_were_asked_for_before_it(station: Station) -> None:
    station.ask("land")
    station.core.ask(Order("stop", reason="fire"), station.now)
    assert station.step() == ["stop", "land"]
    assert station.published[0] == Stop(BEGAN, "world", "fire")


def test_a_stop_leaves_before_anything_else_is_looked_at(station: Station, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(station.core.conduct(station.now), "step", None)  # it cannot be called
    station.ask("stop")
    assert isinstance(next(station.core.step(station.now))[1], Stop)
    with pytest.raises(TypeError):
        station.step()


@pytest.mark.parametrize("by_key", [False, True])
def test_a_stop_is_repeated_for_a_while_though_all_confirm_it_and_is_answered_once(
    station: Station, by_key: bool
) -> None:
    station.stopped()
    if by_key:
        station.order("stop")
    else:
        station.ask("stop")
    repeated = station.step(STOP_TIME / SECOND)
    assert repeated == ["stop"] * round(STOP_TIME / STEP)
    assert len({message.stamp for message in station.published}) == len(repeated)
    assert station.step(1.0) == []
    assert not station.core.is_ordering
    if not by_key:
        assert [answer.missing for answer in station.answers] == [()]


def test_a_stop_that_no_driver_confirms_is_repeated_for_longer(station: Station) -> None:
    station.ask("stop")
    assert len(station.step(5.0)) == round(ANSWER_TIME / STEP)
    assert station.answers[0].missing == ("uav0", "uav1", "uav2", "uav3", "uav4")


def test_a_stop_that_is_received_is_not_done_before_the_motors_are_off(station: Station) -> None:
    station.ask("stop")
    for _ in range(round(4.0 / POLL_PERIOD)):
        station.stopped(FlightState.FLYING)
        assert station.step() == ["stop"]
    assert station.answers == []
    station.stopped()
    station.step()
    assert [answer.failure for answer in station.answers] == [""]


def test_a_stop_is_this_flights_failure(station: Station) -> None:
    director = station.core.conduct(station.now)
    station.ask("stop")
    assert (director.failure, director.stage) == ("emergency stop", Stage.LANDING)
    station.stopped()
    station.step(2 * POLL_PERIOD)
    assert director.stage is Stage.LANDING  # the telemetry was not newer than the stop
    station.stopped()
    station.step()
    assert director.stage is Stage.OVER


@pytest.mark.parametrize("verb", ["hold", "land", "stop"])
@pytest.mark.parametrize("under_way", ["start", "formation"])
def test_what_goes_down_ends_what_takes_up(station: Station, verb: str, under_way: str) -> None:
    station.ask(under_way)
    assert station.step() == []
    station.ask(verb)
    assert station.answers == [ENDED]
    assert station.step() == [verb]
    assert station.core.to_plan == []
    assert set(station.step(8.0)) == {verb}
    assert len(station.answers) == 2  # what was ended is not answered again


def test_what_takes_up_waits_for_swarm_time_and_what_goes_down_does_not(station: Station) -> None:
    station.core.knows_time = False
    station.ask("formation")
    station.step(LOOK_TIME / SECOND)
    assert station.answers == []  # it has not begun to look round, which takes as long
    station.core.knows_time = True
    station.step(2 * LOOK_TIME / SECOND)
    assert station.answers[0].refusal == GATEWAY_SILENT
    station.core.knows_time = False
    station.ask("land")
    assert station.step() == ["land"]


def test_without_a_gateway_the_own_clock_is_used_after_a_while(station: Station) -> None:
    station.core.knows_time = False
    station.ask("formation")
    station.step(3 * LOOK_TIME / SECOND)
    assert len(station.answers) == 1


def test_a_clock_that_is_set_moves_when_an_order_was_asked_for(station: Station) -> None:
    """A hold of another that came before this start was asked for does not end it, whatever the clock showed."""
    station.core.knows_time = False
    station.ask("start")
    ahead = 3600 * SECOND
    station.core.correct(ahead)
    station.now += ahead
    station.core.knows_time = True
    hold = Mission(BEGAN, "world", "hold", giver=1, number=1)
    for process in ("gateway", *station.plan.pilots.values()):
        report = Report("ready", mission=hold, order_age=1.0)
        status = Status(station.now, "world", process, report, 1, 0, 0, 0, 0, 0.0, 0, (), (), 0.0, 0.0)
        station.core.receive(Key("status", process), status, station.now)
    station.step()
    assert station.answers == []
    assert station.core.is_ordering


@pytest.mark.parametrize("ahead", [3600 * SECOND, -3600 * SECOND])
def test_an_order_that_has_begun_ends_in_its_time_though_the_clock_is_set(station: Station, ahead: int) -> None:
    station.ask("land")
    station.step()
    station.core.correct(ahead)
    station.now += ahead
    station.step(0.5 * ANSWER_TIME / SECOND)
    assert station.answers == []
    station.step(ANSWER_TIME / SECOND)
    assert len(station.answers) == 1


def test_no_process_reports_another(station: Station) -> None:
    status = Status(BEGAN, "world", "uav2", Report("ready"), 1, 0, 0, 0, 0, 0.0, 0, (), ())
    station.core.receive(Key("status", "uav1"), status, BEGAN)
    assert station.core.statuses == {}


def test_each_flight_has_a_director_and_a_number_of_its_own(station: Station) -> None:
    first = station.core.conduct(station.now)
    station.core.abort("uav1 ended unexpectedly", station.now)
    assert (first.failure, first.stage) == ("uav1 ended unexpectedly", Stage.OVER)
    second = station.core.conduct(station.now)
    assert second is not first
    assert (second.failure, second.stage) == ("", Stage.PREPARING)
    assert station.core.director is second


def test_keys_beside_a_flight_that_another_host_conducts(station: Station) -> None:
    station.order("resume")
    assert (station.notes, station.step()) == ([ELSEWHERE], [])
    station.order("land")
    assert station.step() == ["land"]
    station.step(ANSWER_TIME / SECOND)
    missing = "leader, uav1, uav2, uav3, uav4"
    assert station.notes[1:] == [f"land: confirmed by nobody; not confirmed by {missing}"]


def test_a_landing_after_its_own_flight_is_one_for_whoever_flies_then(station: Station) -> None:
    director = station.core.conduct(station.now)
    station.order("land")
    assert (station.step(), director.stage) == ([], Stage.OVER)
    station.stopped(FlightState.FLYING)  # another station has started them since
    station.order("land")
    assert station.step() == ["land"]


def test_a_key_that_orders_nothing_reports_why(station: Station) -> None:
    station.core.conduct(station.now)
    station.order("hold")
    station.order("resume")
    assert station.notes == [f"{verb}: nothing ordered while preparing" for verb in ("hold", "resume")]


def test_a_landing_before_the_first_look_of_a_new_flight_lands_drones_that_fly(station: Station) -> None:
    station.stopped(FlightState.FLYING)
    station.core.conduct(station.now)
    station.order("land")
    assert station.step() == ["land"]
    assert station.core.director is not None
    assert station.core.director.stage is Stage.LANDING
