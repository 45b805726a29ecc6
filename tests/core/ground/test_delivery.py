import pytest
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Answer, Mission, Order
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.delivery import ANSWER_TIME, ChangeDelivery, DownDelivery, StartDelivery
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.order_log import UNKNOWN
from flockwire_core.pilot.orders import UNNUMBERED
from flockwire_core.wire.status import Report, Status

NOW = 1_790_000_000 * SECOND
OURS, RIVAL, THIRD = 7, 5, 9
START = Mission(NOW - 60 * SECOND, "world", "start", NOW - 60 * SECOND, giver=1, number=1)
PILOTS = ("leader", "uav1", "uav2", "uav3", "uav4")


def statuses(now, ordered=START, age=60.0, **others):
    """Return what the gateway and the pilots report: all fly by `ordered` but the `others`."""
    report = Report("tracking", mission=others.pop("gateway", ordered), order_age=age)
    return {"gateway": Status(now, "world", "gateway", report, 0, 0, 0, 0, 0, 0.0, 0, (), ())} | {
        name: Status(
            now, "world", name,
            Report("formation", mission=others.get(name, ordered), order_age=0.1 if name in others else age),
            0, 0, 0, 0, 0, 0.0, 0, (), (),
        )
        for name in PILOTS
    }  # fmt: skip


def fleet(known, now, telemetry=None):
    """Return what the five pilots' `known` statuses say at `now`."""
    return Fleet(dict(enumerate(PILOTS)), known, telemetry or {}, now)


@pytest.fixture
def change(make_plan):
    """Return a change of formation that was planned and given."""
    made = ChangeDelivery(
        make_plan({"formations.wide": {"kind": "circle", "radius": 4.0}}), Order("formation", "wide"), OURS, NOW
    )
    made.step(fleet(statuses(NOW), NOW))
    made.planned(START._replace(verb="formation", formation="wide", stamp=NOW))
    now = NOW + SECOND
    assert made.step(fleet(statuses(now), now)).verb == "formation"
    return made


@pytest.mark.parametrize("verb", ["hold", "land"])
def test_a_change_ends_with_what_went_down_meanwhile(change, verb):
    down = Mission(NOW, "world", verb, giver=THIRD, number=2)
    later = NOW + 6 * SECOND // 5
    assert change.step(fleet(statuses(later, gateway=down._replace(downs=(down.version,))), later)) is None
    assert change.answer == Answer(refusal=f"{verb} was ordered meanwhile")


def test_a_change_from_an_auction_waits_for_no_place_that_is_not_known(make_plan):
    table = {
        "graph.edges": [[0, 1], [1, 2], [2, 3], [3, 4], [4, 1]],
        "formation.assignment": "auction",
        "formations.wide": {"kind": "circle", "radius": 4.0},
    }

    def given(held):
        made, known = ChangeDelivery(make_plan(table), Order("formation", "wide"), OURS, NOW), statuses(NOW)
        for name, place in held.items():
            report = known[name].report._replace(place=place)
            known[name] = known[name]._replace(report=report)
        made.step(fleet(known, NOW))
        return made

    held = {"uav1": 2, "uav2": 0, "uav3": 3, "uav4": 1}
    assert given(held).to_plan.change.places == (2, 0, 3, 1)
    refused = given({**held, "uav3": None})
    assert refused.to_plan is None
    assert "places that the drones hold by the auction are not known" in refused.answer.refusal


def test_a_change_that_crossed_another_gives_way_to_the_one_in_the_log(change):
    rival = START._replace(verb="formation", stamp=NOW, giver=RIVAL, number=2)
    later = NOW + 6 * SECOND // 5
    assert change.step(fleet(statuses(later, gateway=rival), later)) is None
    assert change.answer == Answer(refusal="formation was ordered meanwhile")


def test_a_change_is_made_again_where_only_the_number_of_the_log_changed(change):
    later = NOW + 6 * SECOND // 5
    again = change.step(fleet(statuses(later, gateway=START._replace(number=9)), later))
    assert (again.verb, again.giver, again.number) == ("formation", OURS, 9)


def test_a_change_that_a_pilot_refuses_names_why(change):
    later = NOW + 5 * SECOND
    own = change.step(fleet(statuses(NOW + 2 * SECOND), NOW + 2 * SECOND))
    known = statuses(later, own._replace(number=2), gateway=own._replace(number=2), uav2=START)
    report = known["uav2"].report._replace(unnumbered=(START.version,))
    known["uav2"] = known["uav2"]._replace(report=report)
    assert change.step(fleet(known, later)) is None
    assert change.answer.refusal == f"uav2: {UNNUMBERED}"


def test_an_order_is_answered_when_the_gateway_that_repeats_it_has_it_or_is_late(make_plan):
    landing = DownDelivery(make_plan(), Order("land"), OURS, NOW)
    land = landing.step(fleet(statuses(NOW), NOW))
    for ago, repeats in ((SECOND, True), (ANSWER_TIME, False)):
        later = NOW + ago
        assert landing.step(fleet(statuses(later, land, gateway=START), later)) == (land if repeats else None)
    unheard = "not received by gateway, which repeats orders for processes that start later"
    assert landing.answer == Answer(PILOTS, note=unheard)


def test_a_start_ends_with_a_landing_that_came_beside_anothers_start(make_plan):
    plan = make_plan()
    telemetry = {drone: Telemetry(NOW, "world", FlightState.FLYING, 1.0, 0.0, 0.0) for drone in plan.pilots}
    start = StartDelivery(plan, Order("start"), OURS, NOW)
    hold = START._replace(verb="hold")
    start.step(fleet(statuses(NOW, hold), NOW, telemetry))
    land = START._replace(verb="land", stamp=NOW, giver=THIRD)
    other = START._replace(stamp=NOW, giver=RIVAL, number=3, downs=(hold.version, land.version))
    later = NOW + 6 * SECOND // 5
    assert start.step(fleet(statuses(later, hold, gateway=other), later, telemetry)) is None
    assert start.answer == Answer(refusal=f"{UNKNOWN} was ordered meanwhile")


LEADERS = {
    "virtual": {"leader.kind": "virtual", "drones.0": None},
    "tracked": {"leader.kind": "tracked", "drones.0.start": [0.0, 0.0, 1.2]},
}


@pytest.mark.parametrize("kind", LEADERS)
def test_a_change_is_checked_against_the_fence_from_where_a_leader_without_a_drone_is(make_plan, kind):
    edges = {"graph.edges": [[0, 1], [1, 2], [2, 3], [3, 4]], "formations.wide": {"kind": "circle", "radius": 4.0}}
    plan = make_plan({**edges, **LEADERS[kind]})
    made = ChangeDelivery(plan, Order("formation", "wide"), OURS, NOW)
    known = {name: one for name, one in statuses(NOW).items() if name in ("gateway", *plan.pilots.values())}
    where = (3.0, -2.0, 1.0)
    known["leader"] = Status(
        NOW, "world", "leader", Report("formation", position=where), 0, 0, 0, 0, 0, 0.0, 0, (), ()
    )  # fmt: skip
    made.step(Fleet(plan.pilots, known, {}, NOW))
    assert made.leader == where
