"""Orders from the ROS side: those that the file names are given, others are refused and counted."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any

import pytest
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.order_log import OrderLog
from flockwire_core.wire.keys import MISSION, PROPOSAL, STOP, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report, Status
from flockwire_operator.ros.core import MOST_WAITING, RosCore

NOW = 1_790_000_000 * SECOND
ALL = ["start", "formation", "hold", "land", "stop"]


class Flown:
    """A core whose orders all pilots obey but those of `deaf`."""

    def __init__(self, plan: Any, deaf: tuple[str, ...] = ()) -> None:
        self.plan, self.now, self.deaf = plan, NOW, deaf
        self.core = RosCore(plan, count(7).__next__)
        self.core.operator.knows_time = True
        self.published: list[Mission | Stop] = []
        self.answers: list[tuple[bool, str]] = []
        self.obeyed: dict[str, Mission | None] = {}
        self.log = OrderLog(frozenset(), NOW)

    def ask(self, name: str) -> None:
        self.core.services.request(name, self.now, lambda success, text: self.answers.append((success, text)))

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 50)):
            reports = {pilot: Report(Phase.HOLD, mission=self.obeyed.get(pilot)) for pilot in self.plan.pilots.values()}
            reports["gateway"] = Report("tracking", mission=self.log.order, order_age=self.log.age(self.now))
            for process, report in reports.items():
                status = Status(self.now, "world", process, report, 0, 0, 0, 0, 0, 0.0, 0, (), ())
                self.core.receive(Key("status", process), status, self.now)
            for drone in self.plan.pilots:
                told = Telemetry(self.now, "world", FlightState.FLYING, 1.0, 1.0, 0.0)
                self.core.receive(Key("telemetry", f"uav{drone}"), told, self.now)
            for key, message in self.core.step(self.now):
                assert key in (MISSION, PROPOSAL, STOP)
                self.published.append(message)
                if isinstance(message, Mission):
                    self.log.take(message, self.now)
                    self.obeyed |= {p: self.log.order for p in self.plan.pilots.values() if p not in self.deaf}
            self.now += SECOND // 50


@pytest.fixture
def flown(ros_plan: Callable[..., Any]) -> Callable[..., Flown]:
    return lambda *orders, deaf=(): Flown(ros_plan({"ros.orders": list(orders)}), deaf)


def test_each_order_has_a_service_and_each_formation_one(ros_plan: Callable[..., Any]) -> None:
    plan = ros_plan({"formations.wide": {"kind": "circle", "radius": 3.0, "rate": 0.5}})
    services = RosCore(plan, int).services.orders
    verbs = {f"/flock/{verb}" for verb in ("start", "hold", "land", "stop")}
    assert set(services) == verbs | {"/flock/formation/default", "/flock/formation/wide"}
    assert services["/flock/formation/wide"].formation == "wide"
    assert services["/flock/formation/default"].formation == ""


@pytest.mark.parametrize("verb", ["hold", "land"])
def test_an_order_that_the_file_names_is_given_and_its_answer_names_who_confirmed(
    flown: Callable[..., Flown], verb: str
) -> None:
    flight = flown(verb)
    flight.ask(f"/flock/{verb}")
    flight.run(1.0)
    assert {message.verb for message in flight.published} == {verb}
    assert flight.answers == [(True, "confirmed by leader, uav1, uav2, uav3, uav4")]
    assert not flight.core.services.counts


def test_the_answer_names_who_did_not_confirm(flown: Callable[..., Flown]) -> None:
    flight = flown("land", deaf=("uav3",))
    flight.ask("/flock/land")
    flight.run(4.0)
    assert flight.answers == [(False, "sent, but not confirmed by uav3")]


def test_a_stop_is_sent_at_the_next_step_and_repeated(flown: Callable[..., Flown]) -> None:
    flight = flown("stop")
    flight.ask("/flock/stop")
    flight.run(0.02)
    assert [type(message) for message in flight.published] == [Stop]
    assert flight.published[0].reason == "a ROS service"
    flight.run(10.0)
    ((success, text),) = flight.answers
    assert not success  # no drone reports that its motors are off
    assert "uav1" in text or "kinematics" in text


@pytest.mark.parametrize("name", ["start", "hold", "land", "stop", "formation/default"])
def test_an_order_that_the_file_does_not_name_is_refused_and_counted(flown: Callable[..., Flown], name: str) -> None:
    verb = name.partition("/")[0]
    flight = flown(*(other for other in ALL if other != verb))
    for _ in range(3):
        flight.ask(f"/flock/{name}")
    flight.run(5.0)
    assert not flight.published
    assert flight.answers == [(False, f"refused: ros.orders of the swarm file does not have {verb!r}")] * 3
    assert dict(flight.core.report(flight.now).counts) == {"ROS orders refused": 3}


def test_requests_of_one_order_share_its_answer_and_a_flood_is_refused(flown: Callable[..., Flown]) -> None:
    flight = flown("hold", deaf=("uav3",))
    for _ in range(100):
        flight.ask("/flock/hold")
    flight.run(0.02)
    assert len(flight.published) == 1
    assert len(flight.answers) == 100 - MOST_WAITING
    flight.run(4.0)
    assert len(flight.answers) == 100
    assert flight.core.services.counts == {"ROS orders refused": 100 - MOST_WAITING}
    flight.ask("/flock/hold")  # and then it is obeyed again
    flight.deaf = ()
    flight.run(1.0)
    assert flight.answers[-1][0]


def test_rights_to_publish_orders_are_those_of_the_file(ros_plan: Callable[..., Any]) -> None:
    for orders, keys in (
        ([], set()), (["stop"], {STOP}), (["hold"], {MISSION}), (["formation", "stop"], {PROPOSAL, STOP}),
    ):  # fmt: skip
        plan = ros_plan({"ros.orders": orders})
        assert set(plan.publishes["ros"]) == {Key("status", "ros"), *keys}, orders


def test_the_swarm_without_the_table_has_the_plan_that_it_had(
    make_plan: Callable[..., Any], ros_plan: Callable[..., Any]
) -> None:
    without, with_ros = make_plan(), ros_plan()
    assert "ros" not in without.identities
    for one, other in zip(without.flows, [flow for flow in with_ros.flows if flow.key.owner != "ros"], strict=True):
        assert (one.key, one.publishers) == (other.key, other.publishers)
        assert one.subscribers == tuple(identity for identity in other.subscribers if identity != "ros")
    for identity in without.identities:
        extra = {key for key in with_ros.subscribes[identity] if key.owner == "ros"}
        assert set(with_ros.subscribes[identity]) - extra == set(without.subscribes[identity])
        assert with_ros.publishes[identity] == without.publishes[identity]
