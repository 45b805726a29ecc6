"""`up` while it flies: stages, keys, interrupts, and processes that die."""

import asyncio
from types import SimpleNamespace

import pytest
from flockwire_core import clock
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground import delivery, director
from flockwire_core.ground.director import Stage
from flockwire_core.wire.keys import MISSION
from flockwire_core.wire.phase import Phase
from flockwire_operator.station import operator
from flockwire_operator.station.conduct import LEFT_TO_THEMSELVES, serve
from flockwire_operator.station.host import Host
from flockwire_operator.station.operator import Operator
from flockwire_operator.station.restarts import MOST_AT_ONCE
from flockwire_operator.station.terminal.display import ELSEWHERE, Display
from flockwire_operator.station.terminal.interrupts import Interrupts
from simulated_children import Processes
from simulated_pilots import SimulatedSwarm, started

TICK = 0.005  # s between two looks of these tests' stations


class StationFlight:
    """A station with its swarm; `at` says what happens when a stage has begun."""

    def __init__(self, plan, host="localhost", duration=0.2):
        self.swarm, self.children, self.interrupted = SimulatedSwarm(plan), Processes(), Interrupts()
        self.injected = []
        self.host, self.operator = Host(plan, None, host, None, None), Operator(self.swarm)
        if self.host.conducts:
            self.operator.conduct(duration)
        self.at = {}

    async def serve(self):
        injector = SimpleNamespace(step=self.injected.append)
        return await serve(self.host, self.children, self.operator, injector, self.interrupted, headless=True)

    @property
    def director(self):
        return self.operator.core.director

    @property
    def stage(self):
        return Stage.PREPARING if self.director is None else self.director.stage  # None: another host conducts

    def conduct(self):
        """Fly; returns why the flight failed."""

        async def run():
            task = asyncio.create_task(self.serve())
            happens = asyncio.create_task(self._happens())
            async with asyncio.timeout(10):
                failure = await task
            happens.cancel()
            return failure

        return asyncio.run(run())

    async def _happens(self):
        for stage, act in self.at.items():
            while self.stage is not stage:  # noqa: ASYNC110
                await asyncio.sleep(TICK)
            await asyncio.sleep(4 * TICK)
            act()


@pytest.fixture
def fly(make_plan, monkeypatch):
    """Return the builder of a flight."""
    monkeypatch.setattr(operator, "POLL_PERIOD", TICK)
    monkeypatch.setattr(director, "LEAD_TIME", SECOND // 50)
    plan = make_plan()
    return lambda **more: StationFlight(plan, plan.hosts["recorder"], **more)


def interrupt(flight):
    def act():
        flight.interrupted.count += 1

    return act


def test_a_flight_from_take_off_to_landing(fly, capsys):
    flight = fly()
    assert flight.conduct() == ""
    assert flight.swarm.orders == ["takeoff", "start", "land"]
    assert flight.children.took_off == flight.swarm.published[0].stamp
    assert flight.injected[0] >= 0
    lines = [line.removeprefix("flockwire: ") for line in capsys.readouterr().out.splitlines()]
    stages = [line.partition(" s: ")[2] for line in lines if line.startswith("t = ")]  # since the formation's start
    assert "taking off" in lines
    assert stages == ["in formation", "landing", "over"]


def test_an_order_of_another_station_is_said(fly, capsys):
    flight = fly(duration=0.0)
    flight.at = {
        Stage.FLYING: lambda: flight.swarm.publish([(MISSION, Mission(clock.now(), "world", "land", giver=7))])
    }
    assert flight.conduct() == ""
    assert capsys.readouterr().out.count(ELSEWHERE.format(order="land")) == 1


def test_the_first_interrupt_lands(fly):
    flight = fly(duration=0.0)
    flight.at = {Stage.FLYING: interrupt(flight)}
    assert flight.conduct() == ""
    assert flight.swarm.orders[-1] == "land"


def test_at_the_second_it_leaves_and_is_not_well(fly):
    flight = fly(duration=0.0)

    def interrupt_with_one_that_stays_up():
        flight.swarm["uav3"].stays = True
        interrupt(flight)()

    flight.at = {Stage.FLYING: interrupt_with_one_that_stays_up, Stage.LANDING: interrupt(flight)}
    assert flight.conduct() == LEFT_TO_THEMSELVES


def test_it_also_leaves_early_after_a_failure(fly):
    flight = fly(duration=0.0)

    def lose_one():
        flight.swarm["uav3"].stays = True
        flight.children.dead.append("uav2")

    def leave():
        flight.interrupted.count = 2

    flight.at = {Stage.FLYING: lose_one, Stage.LANDING: leave}
    assert flight.conduct() == f"uav2 ended unexpectedly (signal SIGKILL); {LEFT_TO_THEMSELVES}"


def test_a_dead_process_lands_the_others_and_is_the_failure(fly):
    flight = fly(duration=0.0)

    flight.at = {Stage.FLYING: lambda: flight.children.dead.append("uav2")}
    assert flight.conduct() == "uav2 ended unexpectedly (signal SIGKILL)"
    assert flight.swarm.orders[-1] == "land"


def test_a_dead_recorder_is_restarted_which_is_said_and_ends_no_flight(fly, capsys):
    flight = fly(duration=0.5)
    flight.at = {Stage.FLYING: lambda: flight.children.dead.append("recorder")}
    assert flight.conduct() == ""
    assert flight.children.started == ["recorder"]
    assert "recorder ended unexpectedly (signal SIGKILL); restarted\n" in capsys.readouterr().out


def test_a_recorder_that_dies_again_and_again_lands_the_drones_at_last(fly):
    flight = fly(duration=0.0)

    def start(identity):
        flight.children.started.append(identity)
        flight.children.dead.append(identity)

    flight.children.start = start
    flight.at = {Stage.FLYING: lambda: flight.children.dead.append("recorder")}
    assert flight.conduct() == "recorder ended unexpectedly (signal SIGKILL)"
    assert flight.children.started == ["recorder"] * MOST_AT_ONCE


def test_what_refuses_to_run_is_not_restarted(fly):
    flight = fly(duration=0.0)
    flight.children.refusing = True
    flight.at = {Stage.FLYING: lambda: flight.children.dead.append("recorder")}
    assert flight.conduct() == "recorder ended unexpectedly (signal SIGKILL)"
    assert flight.children.started == []


def test_it_is_over_only_when_telemetry_reports_it(fly, monkeypatch):
    monkeypatch.setattr(director, "STAGE_TIME", SECOND)
    flight = fly(duration=0.2)

    def cut_off():
        flight.swarm["uav3"].stays = True

    flight.at = {Stage.FLYING: cut_off}
    assert flight.conduct().endswith("(not known to be down: uav3)")


def press(flight, *verbs):
    def act():
        for verb in verbs:
            flight.operator.order(verb, Display(flight.host.plan, (), headless=True).note)

    return act


def test_keys_give_orders_in_flight(fly):
    flight = fly(duration=0.0)
    flight.at = {Stage.FLYING: press(flight, "hold", "resume", "land")}
    assert flight.conduct() == ""
    assert flight.swarm.orders == ["takeoff", "start", "hold", "start", "land"]
    starts = {order.start for order in flight.swarm.published if isinstance(order, Mission) and order.verb == "start"}
    assert len(starts) == 1  # the formation's time continues


def test_a_stop_by_key_is_repeated_until_the_motors_are_off(fly):
    flight = fly(duration=0.0)

    def stop():
        flight.swarm["uav3"].deaf = True
        press(flight, "stop")()
        asyncio.get_running_loop().call_later(0.2, setattr, flight.swarm["uav3"], "deaf", False)

    flight.at = {Stage.FLYING: stop}
    assert flight.conduct() == "emergency stop"
    stamps = {order.stamp for order in flight.swarm.published if isinstance(order, Stop)}
    assert len(stamps) > 2
    assert max(stamps) - min(stamps) > nanoseconds(0.19)  # until the one that was deaf has it
    assert {pilot.phase for pilot in flight.swarm.pilots.values()} == {Phase.STOPPED}


def test_another_operators_landing_is_not_a_failure(fly):
    flight = fly(duration=0.0)

    def land():
        order = Mission(flight.director.order.stamp + 1, "world", "land")
        flight.swarm.publish([(None, order)])

    flight.at = {Stage.FLYING: land}
    assert flight.conduct() == ""


@pytest.fixture
def serving(make_plan, monkeypatch):
    """Return a flight on a host that does not conduct, whose swarm flies; nobody there has the time."""
    monkeypatch.setattr(delivery, "LOOK_TIME", TICK)
    monkeypatch.setattr(operator, "POLL_PERIOD", TICK)
    hosts = {"ground": {"address": "127.0.0.1"}, "air": {"address": "127.0.0.1", "processes": ["leader"]}}
    flight = StationFlight(make_plan({"hosts": hosts}), "air")
    flight.swarm.all(Phase.FORMATION, started())
    return flight


def press_then_interrupt(flight, *verbs):
    """Return what presses keys, and some time later interrupts."""

    def act():
        press(flight, *verbs)()
        asyncio.get_running_loop().call_later(0.2, interrupt(flight))

    return act


def test_a_host_that_does_not_conduct_gives_no_orders(serving, capsys):
    serving.at = {Stage.PREPARING: interrupt(serving)}
    assert serving.conduct() == ""
    assert serving.swarm.published == []
    assert capsys.readouterr().out.endswith("flockwire: serving\n")


@pytest.mark.parametrize(("verb", "phase"), [("land", Phase.READY), ("hold", Phase.HOLD)])
def test_a_key_of_a_host_that_does_not_conduct_is_an_order_to_all_and_the_host_keeps_running(
    serving, capsys, verb, phase
):
    serving.at = {Stage.PREPARING: press_then_interrupt(serving, verb)}
    assert serving.conduct() == ""
    assert serving.swarm.orders == [verb]
    assert {pilot.phase for pilot in serving.swarm.pilots.values()} == {phase}
    assert f"{verb}: confirmed by leader, uav1, uav2, uav3, uav4\n" in capsys.readouterr().out


def test_who_does_not_confirm_the_order_of_a_key_is_named(serving, capsys, monkeypatch):
    monkeypatch.setattr(delivery, "ANSWER_TIME", SECOND // 10)
    serving.swarm["uav3"].deaf = True
    serving.at = {Stage.PREPARING: press_then_interrupt(serving, "land")}
    serving.conduct()
    assert "land: confirmed by leader, uav1, uav2, uav4; not confirmed by uav3\n" in capsys.readouterr().out


def test_a_host_that_does_not_conduct_starts_no_formation_and_says_who_does(serving, capsys):
    serving.at = {Stage.PREPARING: press_then_interrupt(serving, "resume")}
    serving.conduct()
    assert serving.swarm.published == []
    assert "resume: this host does not conduct the flight; " in capsys.readouterr().out


def test_a_stop_by_a_key_counts_on_every_host(serving):
    serving.at = {Stage.PREPARING: press_then_interrupt(serving, "stop")}
    serving.conduct()
    assert len([order for order in serving.swarm.published if isinstance(order, Stop)]) > 10


def test_a_key_that_orders_nothing_reports_why(fly, capsys):
    flight = fly()
    flight.swarm["uav3"].phase, flight.swarm["uav3"].stays = Phase.GROUNDED, True

    def press_and_go_on():
        press(flight, "hold", "resume")()
        flight.swarm["uav3"].phase, flight.swarm["uav3"].stays = Phase.READY, False

    flight.at = {Stage.PREPARING: press_and_go_on}
    assert flight.conduct() == ""
    printed = capsys.readouterr().out
    assert "hold: nothing ordered while preparing\n" in printed
    assert "resume: nothing ordered while preparing\n" in printed
