import pytest
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.giving import ANSWER_TIME, ChangeGiving, DownGiving
from flockwire_core.ground.order import Answer, Order
from flockwire_core.ground.starting import StartGiving
from flockwire_core.wire.status import Report, Status
from repeated_orders import repeated

NOW = 1_790_000_000 * SECOND
OURS, RIVAL, THIRD = 7, 5, 9
START = Mission(NOW - 60 * SECOND, "world", "start", NOW - 60 * SECOND, giver=1)
PILOTS = ("leader", "uav1", "uav2", "uav3", "uav4")


def statuses(now, ordered=START, age=60.0, **others):
    """Return what the pilots report: all fly by `ordered` but the `others`."""
    return {
        name: Status(
            now, "world", name,
            Report("formation", mission=others.get(name, ordered), order_age=0.1 if name in others else age),
            0, 0, 0, 0, 0, 0.0, 0, (), (),
        )
        for name in PILOTS
    }  # fmt: skip


def fleet(known, now, telemetry=None):
    """Return what the five pilots' `known` statuses say at `now`."""
    return Fleet(dict(enumerate(PILOTS)), known, telemetry or {}, now, repeated(known.values()))


@pytest.fixture
def change(make_plan):
    """Return a change of formation that was planned and given."""
    made = ChangeGiving(
        make_plan({"formations.wide": {"kind": "circle", "radius": 4.0}}), Order("formation", "wide"), OURS, NOW
    )
    made.step(fleet(statuses(NOW), NOW))
    made.planned(START._replace(verb="formation", formation="wide", stamp=NOW))
    now = NOW + SECOND
    assert made.step(fleet(statuses(now), now)).verb == "formation"
    return made


@pytest.mark.parametrize("verb", ["hold", "land"])
def test_a_change_that_crossed_another_is_not_given_again_over_what_went_down_meanwhile(change, verb):
    rival = START._replace(verb="formation", stamp=NOW, giver=RIVAL, knows=(START.version,))
    down = START._replace(verb=verb, stamp=NOW, giver=THIRD)
    later = NOW + 6 * SECOND // 5
    assert change.step(fleet(statuses(later, uav1=rival, uav2=down), later)) is None
    assert change.answer == Answer(refusal=f"{verb} was ordered meanwhile")


def test_a_change_from_an_auction_waits_for_no_place_that_is_not_known(make_plan):
    table = {
        "graph.edges": [[0, 1], [1, 2], [2, 3], [3, 4], [4, 1]],
        "formation.assignment": "auction",
        "formations.wide": {"kind": "circle", "radius": 4.0},
    }

    def given(held):
        made, known = ChangeGiving(make_plan(table), Order("formation", "wide"), OURS, NOW), statuses(NOW)
        for name, place in held.items():
            report = known[name].report._replace(place=place)
            known[name] = known[name]._replace(report=report)
        made.step(fleet(known, NOW))
        return made

    held = {"uav1": 2, "uav2": 0, "uav3": 3, "uav4": 1}
    assert given(held).to_plan.running.change.places == (2, 0, 3, 1)
    refused = given({**held, "uav3": None})
    assert refused.to_plan is None
    assert "places that the drones hold by the auction are not known" in refused.answer.refusal


def test_a_change_that_crossed_another_of_a_smaller_number_is_given_again_for_all(change):
    rival = START._replace(verb="formation", stamp=NOW, giver=RIVAL, knows=(START.version,))
    later = NOW + 6 * SECOND // 5
    again = change.step(fleet(statuses(later, uav1=rival), later))
    assert (again.verb, again.giver) == ("formation", OURS)
    assert rival.version in again.knows


def test_a_change_that_who_conducts_gave_once_more_is_confirmed(change):
    later = NOW + 2 * SECOND
    given = change.step(fleet(statuses(later), later))
    again = given._replace(stamp=later, giver=THIRD, knows=(given.version, START.version))
    assert change.step(fleet(statuses(later, again), later)) is None
    assert change.answer.confirmed == PILOTS
    assert change.answer.failure == ""


def test_an_order_is_answered_when_the_gateway_that_repeats_it_has_it_or_is_late(make_plan):
    landing = DownGiving(make_plan(), Order("land"), OURS, NOW)
    land = landing.step(fleet(statuses(NOW), NOW))
    gateway = statuses(NOW)["leader"]._replace(identity="gateway")
    for ago, repeats in ((SECOND, True), (ANSWER_TIME, False)):
        later = NOW + ago
        known = statuses(later, land) | {"gateway": gateway._replace(stamp=later)}
        assert landing.step(fleet(known, later)) == (land if repeats else None)
    unheard = "not received by gateway, which repeats orders for processes that start later"
    assert landing.answer == Answer(PILOTS, note=unheard)


def test_a_start_ends_with_a_landing_that_came_beside_anothers_start(make_plan):
    plan = make_plan()
    telemetry = {drone: Telemetry(NOW, "world", FlightState.FLYING, 1.0, 0.0, 0.0) for drone in plan.pilots}
    start = StartGiving(plan, Order("start"), OURS, NOW)
    hold = START._replace(verb="hold")
    start.step(fleet(statuses(NOW, hold), NOW, telemetry))
    land = START._replace(verb="land", stamp=NOW, giver=THIRD)
    other = START._replace(stamp=NOW, giver=RIVAL, knows=(hold.version, land.version))
    later = NOW + 6 * SECOND // 5
    assert start.step(fleet(statuses(later, hold, uav1=land, uav2=other), later, telemetry)) is None
    assert start.answer == Answer(refusal="land was ordered meanwhile")


LEADERS = {
    "virtual": {"leader.kind": "virtual", "drones.0": None},
    "tracked": {"leader.kind": "tracked", "drones.0.start": [0.0, 0.0, 1.2]},
}


@pytest.mark.parametrize("kind", LEADERS)
def test_a_change_is_checked_against_the_fence_from_where_a_leader_without_a_drone_is(make_plan, kind):
    edges = {"graph.edges": [[0, 1], [1, 2], [2, 3], [3, 4]], "formations.wide": {"kind": "circle", "radius": 4.0}}
    plan = make_plan({**edges, **LEADERS[kind]})
    made = ChangeGiving(plan, Order("formation", "wide"), OURS, NOW)
    known = {name: status for name, status in statuses(NOW).items() if name in plan.pilots.values()}
    where = (3.0, -2.0, 1.0)
    known["leader"] = Status(
        NOW, "world", "leader", Report("formation", position=where), 0, 0, 0, 0, 0, 0.0, 0, (), ()
    )  # fmt: skip
    made.step(Fleet(plan.pilots, known, {}, NOW, repeated(known.values())))
    assert made.to_plan.leader == where
