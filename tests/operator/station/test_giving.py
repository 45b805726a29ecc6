"""Orders go out at once to whoever is there; the answer names who confirmed and who did not."""

import asyncio
import re

import pytest
from flockwire_core import clock
from flockwire_core.domain.order import Answer, Change, Mission, Order, Stop
from flockwire_core.domain.time import SECOND
from flockwire_core.ground import delivery as core
from flockwire_core.ground import formation_planning
from flockwire_core.runtime.session import RouterAbsentError
from flockwire_core.wire.phase import Phase
from flockwire_operator.cli.orders import app
from flockwire_operator.station import giving, operator
from simulated_pilots import SimulatedSwarm, started
from typer.testing import CliRunner

PILOTS = ("leader", "uav1", "uav2", "uav3", "uav4")
CHANGES = {"formations.wide": {"kind": "circle", "radius": 4.0}}


@pytest.fixture
def swarm(make_plan, monkeypatch):
    """Return a swarm to give orders to; who does not answer costs 0.3 s."""
    found = SimulatedSwarm(make_plan(CHANGES))
    found.opened = []

    def session(plan, identity, keys, *, verified):
        found.opened.append((identity, verified))
        return found

    monkeypatch.setattr(giving, "Session", session)
    monkeypatch.setattr(clock, "uptime", lambda: 0.0)  # of the command, not of the tests
    monkeypatch.setattr(core, "ANSWER_TIME", 3 * SECOND // 10)
    monkeypatch.setattr(core, "LOOK_TIME", SECOND // 10)
    return found


def give(swarm, verb, formation=""):
    return asyncio.run(giving.give(swarm.plan, None, Order(verb, formation)))


@pytest.mark.parametrize("verb", ["hold", "land"])
def test_an_order_that_all_confirm_is_over_at_once(swarm, verb):
    swarm.all(Phase.FORMATION, started())
    assert give(swarm, verb) == Answer(PILOTS)
    assert len(swarm.published) == 1
    assert swarm.opened == [("operator", False)]


@pytest.mark.parametrize("verb", ["hold", "land"])
def test_an_order_waits_for_no_process_and_is_repeated_for_who_has_not_confirmed(swarm, verb):
    swarm.all(Phase.FORMATION, started())
    swarm["leader"].silent, swarm["uav3"].deaf = True, True
    assert give(swarm, verb) == Answer(("uav1", "uav2", "uav4"), ("leader", "uav3"))
    assert len(swarm.published) > 5
    assert len(set(swarm.published)) == 1  # with one stamp: to who has it already it is no news
    assert swarm["leader"].mission.verb == verb  # it may well be obeyed by who cannot answer


def test_processes_that_end_during_an_order_were_sent_it(swarm, monkeypatch):
    swarm.all(Phase.FORMATION, started())
    swarm["uav3"].silent = True
    monkeypatch.setattr(swarm, "linked", tuple)  # a flight that lands ends
    answer = give(swarm, "land")
    assert answer.confirmed == ("leader", "uav1", "uav2", "uav4")
    assert answer.failure == "sent, but not confirmed by uav3; no process is linked any more"


def test_an_order_goes_out_before_anything_was_received(swarm):
    swarm.all(Phase.FORMATION, started())
    for pilot in swarm.pilots.values():
        pilot.silent = True
    assert give(swarm, "land") == Answer((), PILOTS)
    assert {pilot.mission.verb for pilot in swarm.pilots.values()} == {"land"}


def test_a_stop_is_confirmed_by_the_drivers_telemetry(swarm):
    swarm.all(Phase.FORMATION, started())
    assert give(swarm, "stop") == Answer(("uav0", "uav1", "uav2", "uav3", "uav4"))
    assert {type(order) for order in swarm.published} == {Stop}
    assert swarm.opened == [("operator", False)]


def test_a_stop_is_repeated_while_one_driver_flies_or_is_silent(swarm):
    swarm.all(Phase.FORMATION, started())
    swarm["leader"].silent, swarm["uav3"].deaf = True, True
    assert give(swarm, "stop") == Answer(("uav1", "uav2", "uav4"), ("uav0", "uav3"))
    assert len(swarm.published) > 5
    assert len({order.stamp for order in swarm.published}) == len(swarm.published)  # or it would soon be too old


def test_a_stop_that_was_received_and_of_which_no_effect_is_known_is_reported_separately(swarm, monkeypatch):
    monkeypatch.setattr(core, "DOWN_TIME", 4 * SECOND // 10)
    swarm.all(Phase.FORMATION, started())
    swarm["uav2"].turns_on = True
    names = ("uav0", "uav1", "uav2", "uav3", "uav4")
    assert give(swarm, "stop") == Answer(names, (), "received by uav2, not known to be down yet")
    swarm["uav3"].deaf, swarm["uav3"].phase = True, Phase.FORMATION
    swarm["uav3"].told = False
    answer = give(swarm, "stop")
    assert answer.missing == ("uav3",)
    assert answer.refusal == "sent, but not confirmed by uav3; received by uav2, not known to be down yet"


def test_a_start_from_the_ground_takes_off_and_starts(swarm):
    assert give(swarm, "start", "wide") == Answer(PILOTS)
    assert swarm.orders == ["takeoff", "start"]
    assert swarm.published[-1].formation == "wide"
    assert swarm.opened == [("operator", True)]


def test_a_start_of_what_flies_already_orders_nothing(swarm):
    swarm.all(Phase.FORMATION, started("wide"))
    assert give(swarm, "start", "wide") == Answer(PILOTS)
    assert swarm.published == []


def test_a_start_of_another_formation_changes_it_and_its_time_continues(swarm):
    running = started()
    swarm.all(Phase.FORMATION, running)
    answer = give(swarm, "start", "wide")
    assert (answer.confirmed, answer.missing, answer.refusal) == (PILOTS, (), "")
    (order,) = set(swarm.published)
    assert (order.verb, order.start, order.formation) == ("formation", running.start, "wide")


def test_a_start_brings_back_who_is_on_the_ground_and_restarts_no_drone(swarm):
    running = started("wide")
    swarm.all(Phase.FORMATION, running)
    swarm["uav4"].phase, swarm["uav4"].mission = Phase.READY, None
    assert give(swarm, "start", "wide") == Answer(PILOTS)
    assert {(order.verb, order.start, order.formation) for order in swarm.published} == {
        ("start", running.start, "wide")
    }


def test_one_start_takes_off_who_was_restarted_on_the_ground_while_the_others_took_off(swarm):
    swarm.all(Phase.HOLD, started()._replace(verb="takeoff"))
    swarm["uav4"].phase, swarm["uav4"].mission = Phase.READY, None
    assert give(swarm, "start") == Answer(PILOTS)
    assert swarm.orders == ["takeoff", "start"]


def test_a_start_is_refused_with_the_list_of_who_is_not_ready_and_why(swarm, monkeypatch):
    monkeypatch.setattr(core, "READY_TIME", SECOND // 5)
    swarm["uav2"].phase, swarm["uav2"].detail = Phase.GROUNDED, "waits for its own pose"
    swarm["uav3"].silent = True
    assert give(swarm, "start").refusal == (
        "not ready: uav2: waits for its own pose; uav3: no status (`--without ID` flies without a drone)"
    )
    assert swarm.published == []


@pytest.mark.parametrize("verb", ["hold", "land"])
@pytest.mark.parametrize("under_way", [False, True])
def test_a_start_ends_when_another_operator_orders_a_hold_or_a_landing(swarm, verb, under_way):
    """Preparing (uav2 is not ready yet), or during take-off: it orders nothing after that."""
    if under_way:
        for pilot in swarm.pilots.values():
            pilot.stays = True
    else:
        swarm["uav2"].phase, swarm["uav2"].stays = Phase.GROUNDED, True

    async def run():
        start = asyncio.create_task(giving.give(swarm.plan, None, Order("start")))
        await asyncio.sleep(0.1)
        before = swarm.orders
        swarm.publish([(None, Mission(clock.now(), "world", verb))])
        for pilot in swarm.pilots.values():
            pilot.phase, pilot.stays = Phase.READY, False
        return before, await start

    before, answer = asyncio.run(run())
    assert answer.refusal == f"{verb} was ordered meanwhile"
    assert (before, swarm.orders) == ((["takeoff"], ["takeoff", verb]) if under_way else ([], [verb]))


def test_a_start_without_a_drone_flies_the_others_and_waits_only_for_them(swarm):
    swarm["uav3"].silent = True
    answer = asyncio.run(giving.give(swarm.plan, None, Order("start", without=(3,))))
    assert answer == Answer(("leader", "uav1", "uav2", "uav4"))
    assert swarm.orders == ["prepare", "takeoff", "start"]
    assert {order.without for order in swarm.published} == {(3,)}
    assert give(swarm, "land") == Answer(("leader", "uav1", "uav2", "uav4"))  # nor does a landing


def test_a_drone_in_the_air_is_not_left_out(swarm):
    swarm.all(Phase.HOLD)
    answer = asyncio.run(giving.give(swarm.plan, None, Order("start", without=(3,))))
    assert answer.refusal == "uav3 cannot be left out in the air; land first"
    assert swarm.published == []


@pytest.mark.long
def test_a_start_names_who_does_not_come_into_the_formation(swarm, monkeypatch):
    monkeypatch.setattr(core, "LEAD_TIME", SECOND)
    swarm.all(Phase.HOLD)
    swarm["uav2"].deaf = True
    assert give(swarm, "start") == Answer(("leader", "uav1", "uav3", "uav4"), ("uav2",))


def test_a_change_of_formation_keeps_its_time(swarm):
    running = started()
    swarm.all(Phase.FORMATION, running)
    answer = give(swarm, "formation", "wide")
    (order,) = set(swarm.published)
    change = order.change
    assert answer == Answer(PILOTS, note=f"the change takes {change.duration:.1f} s")
    assert (order.verb, order.start, order.formation) == ("formation", running.start, "wide")
    assert change.before == ""
    assert formation_planning.LEAD_TIME // 2 <= change.begin - order.stamp <= formation_planning.LEAD_TIME
    assert order.stamp > running.stamp


def test_a_change_after_a_hold_begins_from_the_formation_that_was_interrupted(swarm):
    running = started("wide")
    swarm.all(Phase.HOLD, running._replace(stamp=running.stamp + 1, verb="hold"))
    swarm["uav2"].mission = Mission(running.stamp + 1, "world", "hold")  # restarted since, and knows of none
    for pilot in swarm.pilots.values():
        pilot.stays = True
    answer = give(swarm, "formation", "")
    assert (answer.refusal, answer.confirmed) == ("", PILOTS)
    (order,) = set(swarm.published)
    assert (order.verb, order.start, order.formation, order.change.before) == ("formation", running.start, "", "wide")


def test_a_formation_of_drones_that_hold_since_they_took_off_begins_at_once(swarm):
    now = clock.now()
    swarm.all(Phase.HOLD, Mission(now - SECOND, "world", "takeoff"))
    assert give(swarm, "formation", "wide") == Answer(PILOTS)
    (order,) = set(swarm.published)
    assert (order.verb, order.formation, order.change) == ("formation", "wide", None)
    assert order.start > order.stamp


def test_a_change_that_cannot_be_flown_is_refused_with_drone_time_and_limit(swarm):
    swarm.all(Phase.FORMATION, started())
    answer = asyncio.run(giving.give(swarm.plan, None, Order("formation", "wide", 0.5)))
    assert re.fullmatch(
        r"uav\d would be commanded \d+\.\d\d m/s 0\.\d s into the change, limits.speed = 3 m/s .*", answer.refusal
    )
    assert swarm.published == []


@pytest.mark.parametrize("verb", ["hold", "land"])
def test_an_order_that_comes_while_a_change_is_planned_is_not_undone_by_it(swarm, verb, monkeypatch):
    running = started()
    swarm.all(Phase.FORMATION, running)

    def plan(*_):
        swarm.all(Phase.FORMATION, running._replace(stamp=clock.now(), verb=verb))
        return running._replace(stamp=clock.now(), verb="formation", formation="wide")

    monkeypatch.setattr(operator, "plan_order", plan)
    assert give(swarm, "formation", "wide").refusal == f"{verb} was ordered meanwhile"
    assert swarm.published == []


def test_a_plan_that_fails_is_a_refusal_that_names_the_error(swarm, monkeypatch):
    def fail(*_):
        raise MemoryError("too little")

    monkeypatch.setattr(operator, "plan_order", fail)
    swarm.all(Phase.FORMATION, started())
    assert give(swarm, "formation", "wide").refusal == "the change could not be planned: MemoryError: too little"
    assert swarm.published == []


def test_a_change_that_is_under_way_is_not_changed(swarm):
    running = started()
    change = Change(clock.now() - SECOND, 60.0, "wide", (0, 1, 2, 3), (0, 1, 2, 3))
    swarm.all(Phase.FORMATION, running._replace(change=change))
    assert re.fullmatch(r"the change to formation '' takes another 5\d\.\d s", give(swarm, "formation", "wide").refusal)
    assert swarm.published == []


@pytest.mark.parametrize("phase", [Phase.READY, Phase.HOLD, Phase.LANDING])
def test_a_formation_that_no_drone_flies_is_not_changed(swarm, phase):
    swarm.all(phase, started() if phase is Phase.READY else None)
    for pilot in swarm.pilots.values():
        pilot.stays = True
    answer = give(swarm, "formation", "wide")
    assert answer.refusal.startswith("no drone flies a formation")
    assert (answer.confirmed, answer.missing, swarm.published) == ((), (), [])


def test_a_formation_is_changed_though_one_is_silent(swarm):
    swarm.all(Phase.FORMATION, started())
    swarm["uav3"].silent = True
    answer = give(swarm, "formation", "wide")
    assert (answer.confirmed, answer.missing) == (("leader", "uav1", "uav2", "uav4"), ("uav3",))


def test_a_router_that_is_not_there_is_reported_at_once(make_plan, monkeypatch, tmp_path):
    def absent(*_, **__):
        raise RouterAbsentError

    monkeypatch.setattr(giving, "Session", absent)
    answer = asyncio.run(giving.give(make_plan({"network.mode": "router"}), tmp_path, Order("stop")))
    assert answer.refusal == (
        "the router at 127.0.0.1:7454 does not answer: "
        "no process listens at the address of router (127.0.0.1:7454, network.base_port = 7450)"
    )


# What the command prints.


@pytest.fixture
def command(monkeypatch):
    """Return what runs a command whose answer is given."""

    def run(answer, *arguments):
        async def given(*_):
            return answer

        monkeypatch.setattr(giving, "give", given)
        return CliRunner().invoke(app, arguments)

    return run


PAPER = "examples/paper_simulation.toml"


@pytest.fixture(autouse=True)
def at_the_root(monkeypatch, request):
    monkeypatch.chdir(request.config.rootpath)


@pytest.mark.parametrize("verb", ["hold", "land", "stop", "start"])
def test_who_confirmed_is_named(command, verb):
    done = command(Answer(("uav1", "uav2")), verb, PAPER)
    assert (done.exit_code, done.stdout) == (0, f"flockwire: {verb}: confirmed by uav1, uav2\n")


def test_who_did_not_confirm_is_a_failure_with_its_name(command):
    done = command(Answer(("uav1",), ("uav2", "uav3")), "land", PAPER)
    assert (done.exit_code, done.stdout) == (1, "flockwire: land: confirmed by uav1\n")
    assert done.stderr == "flockwire: land failed: sent, but not confirmed by uav2, uav3\n"


def test_a_refusal_is_a_failure_with_its_reason(command):
    done = command(Answer(refusal="nobody flies"), "start", PAPER)
    assert (done.exit_code, done.stdout) == (1, "")
    assert done.stderr == "flockwire: start failed: nobody flies\n"
