"""What the probe calls a leak and what it calls blocked."""

import json

import pytest
from flockwire_core.wire.keys import MISSION, ROWS, STOP, TIME_REPLY, Delivery, Key, key_text
from flockwire_lab.probe.matrix import (
    OUTSIDERS,
    AttackResult,
    Deviation,
    as_json,
    deviations,
    draw,
    publishable,
    receivable,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from table_rows import table_rows

MODES = pytest.mark.parametrize("plan", ["peers", "router"], indirect=True)
ESTIMATE, POSE = Key("estimate", "uav2"), Key("pose", "uav1")
OPERATOR, CONSOLE, RECORDER, ROUTER = "operator", "console", "recorder", "router"
ORDERING = {OPERATOR, CONSOLE}


@pytest.fixture
def plan(make_plan, request):
    return make_plan({"network.mode": getattr(request, "param", "peers")})


def allowed(plan, identity):
    """Return the keys that `identity` may receive, and (key, receiver) of what is accepted from it."""
    if identity == ROUTER:  # its certificate is good for a link and nothing else
        return frozenset(), frozenset()
    rows = list(table_rows(plan.swarm))
    # Nobody dials the operator; a router passes a message on even to the process whose certificate the attacker shows.
    nobody = ORDERING if plan.routers else {*ORDERING, identity}
    return (
        frozenset(key for key, _, subscribers in rows if identity in subscribers),
        frozenset(
            (key, receiver)
            for key, publishers, subscribers in rows
            if identity in publishers
            for receiver in subscribers - nobody
        ),
    )


def everybody(plan):
    return frozenset(plan.identities) - ORDERING


def linked(identity):
    return 0 if identity in OUTSIDERS else 3


def perfect(plan, identity):
    """Return what is seen of an attacker where all is as it should be."""
    return AttackResult(identity, "peer", *allowed(plan, identity), linked(identity))


def judged(plan, identity, received=(), published=(), unreceived=(), unpublished=(), alive=None):
    """Return the deviations where an attacker achieved this more, and that less, than it should."""
    right = perfect(plan, identity)
    seen = AttackResult(
        identity,
        "client",
        (right.received | frozenset(received)) - frozenset(unreceived),
        (right.published | frozenset(published)) - frozenset(unpublished),
        linked(identity),
    )
    return list(deviations(plan, seen, everybody(plan) if alive is None else frozenset(alive)))


@MODES
def test_a_correct_swarm_has_no_findings(plan):
    for identity in (*OUTSIDERS, *plan.identities):
        assert judged(plan, identity) == []


@MODES
def test_everything_seen_is_judged_by_the_key_table(plan):
    for identity in plan.identities:
        assert (receivable(plan, identity), publishable(plan, identity)) == allowed(plan, identity)


def test_a_neighbour_may_receive_an_estimate_and_others_may_not(plan):
    assert ESTIMATE in receivable(plan, "uav3")
    assert ESTIMATE not in receivable(plan, "uav4")
    assert ESTIMATE not in receivable(plan, "uav1")
    assert receivable(plan, "uav3") & receivable(plan, "uav4") == {MISSION, STOP}


@MODES
@pytest.mark.parametrize("outsider", [*OUTSIDERS, "somebody else"])
def test_outsiders_may_do_nothing(plan, outsider):
    assert receivable(plan, outsider) == publishable(plan, outsider) == frozenset()
    (received,) = judged(plan, outsider, received=[POSE])
    (published,) = judged(plan, outsider, published=[(STOP, "kinematics")])
    assert received.leak
    assert published.leak


@pytest.mark.parametrize("plan", ["router"], indirect=True)
def test_a_stolen_router_certificate_may_do_nothing(plan):
    assert receivable(plan, ROUTER) == publishable(plan, ROUTER) == frozenset()
    assert [found.leak for found in judged(plan, ROUTER, received=[POSE])] == [True]


@MODES
def test_what_is_received_and_must_not_be_is_a_leak(plan):
    (found,) = judged(plan, "uav4", received=[ESTIMATE])
    assert found == Deviation("uav4", "client", "received", "flock/uav2/estimate", "", leak=True)
    assert found.sentence() == "leak: uav4 as client received flock/uav2/estimate; it must not"


@MODES
def test_what_is_published_and_must_not_be_is_a_leak_of_its_receiver(plan):
    (found,) = judged(plan, "uav4", published=[(ESTIMATE, "uav3")])
    assert found == Deviation("uav4", "client", "published", "flock/uav2/estimate", "uav3", leak=True)
    assert found.sentence() == "leak: uav4 as client published flock/uav2/estimate and uav3 accepted it; it must not"


def test_a_leak_is_found_without_live_receivers(plan):
    assert [found.leak for found in judged(plan, "uav4", received=[ESTIMATE], alive=())] == [True]
    assert [found.leak for found in judged(plan, "uav4", published=[(ESTIMATE, "uav3")], alive=())] == [True]


@MODES
def test_what_may_be_received_and_is_not_is_blocked(plan):
    (found,) = judged(plan, "uav3", unreceived=[ESTIMATE])
    assert found == Deviation("uav3", "client", "received", "flock/uav2/estimate", "", leak=False)
    assert found.sentence() == "blocked: uav3 as client may receive flock/uav2/estimate; nothing arrived"


@MODES
def test_what_may_be_published_and_is_not_accepted_is_blocked_by_the_receiver(plan):
    (found,) = judged(plan, "uav2", unpublished=[(ESTIMATE, "uav3")])
    assert found == Deviation("uav2", "client", "published", "flock/uav2/estimate", "uav3", leak=False)
    assert "may publish flock/uav2/estimate; uav3 did not accept it" in found.sentence()


def test_nothing_is_blocked_by_one_who_is_not_there(plan):
    assert judged(plan, "uav2", unpublished=[(ESTIMATE, "uav3")], alive=everybody(plan) - {"uav3"}) == []


def test_nothing_is_to_be_received_of_one_who_is_not_there(plan):
    assert judged(plan, "uav3", unreceived=[ESTIMATE], alive=everybody(plan) - {"uav2"}) == []


def test_time_goes_only_to_those_who_request_it(make_plan):
    plan = make_plan({"hosts": {"base": {}, "far": {"processes": ["leader"]}}})
    asking, absent = Key("time_reply", "leader"), Key("time_reply", CONSOLE)
    assert [found.key for found in judged(plan, "leader", unreceived=[asking])] == [plan.text(asking)]
    assert judged(plan, CONSOLE, unreceived=[absent]) == []


def test_what_one_of_two_attacks_achieved_counts_as_achieved(plan):
    right = perfect(plan, "uav1")
    slow = AttackResult("uav1", "peer", right.received - {ESTIMATE}, right.published, 0)
    busy = AttackResult("uav1", "peer", right.received, frozenset(), right.links)
    assert slow | busy == busy | slow == right


def test_an_attacker_does_not_wait_for_its_own_messages(plan):
    own = Key("status", "recorder")  # the recorder receives its own
    assert own in receivable(plan, "recorder")
    assert judged(plan, "recorder", unreceived=[own]) == []


def test_orders_need_not_flow_all_the_time_but_may_be_given(plan):
    assert {row.kind for row in ROWS.values() if row.delivery is Delivery.EVENT} == {"proposal", "mission", "stop"}
    assert judged(plan, "uav1", unreceived=[MISSION, STOP]) == []
    (found,) = judged(plan, OPERATOR, unpublished=[(STOP, "kinematics")])
    assert (found.key, found.receiver, found.leak) == ("flock/stop", "kinematics", False)


def test_nothing_needs_to_be_accepted_by_the_operator(plan):
    assert {OPERATOR} & {
        receiver for identity in plan.identities for _, receiver in publishable(plan, identity)
    } == set()


@settings(max_examples=60)
@given(data=st.data())
def test_every_single_difference_is_exactly_one_deviation(make_plan, data):
    plan = make_plan()
    identity = data.draw(st.sampled_from([*OUTSIDERS, *plan.identities]))
    right = perfect(plan, identity)
    key = data.draw(st.sampled_from(plan.keys))
    seen = AttackResult(identity, "peer", right.received ^ {key}, right.published, right.links)
    alive = everybody(plan)
    found = list(deviations(plan, seen, alive))
    (publishers,) = [publishers for one, publishers, _ in table_rows(plan.swarm) if one == key]
    row = ROWS[key.kind]
    silent = row.delivery is Delivery.EVENT or row.occasional or not publishers & alive - {identity}
    silent = silent or (key.kind == TIME_REPLY and key.owner not in alive)
    if key in right.received and silent:
        assert found == []
    else:
        (only,) = found
        assert (only.key, only.leak, only.verb) == (
            key_text(plan.swarm.name, key),
            key not in right.received,
            "received",
        )


def cells(lines, text):
    (row,) = [line for line in lines if line.startswith(f"{text} ")]
    return row.removeprefix(text).split()


@MODES
def test_the_matrix_shows_who_published_and_received_what(plan):
    lines = list(draw(plan, [perfect(plan, identity) for identity in plan.identities]))
    columns = lines[0].split()
    assert columns == [identity for identity in plan.identities if identity != ROUTER]
    assert len(lines) == 1 + len(plan.keys)
    shown = dict(zip(columns, cells(lines, "flock/uav2/estimate"), strict=True))
    assert {name: sign for name, sign in shown.items() if sign != "."} == {"uav2": "P", "uav3": "R"}
    assert dict(zip(columns, cells(lines, "flock/mission"), strict=True))["gateway"] == "B"


def test_what_differs_between_the_link_modes_is_in_lower_case(plan):
    nothing = AttackResult("uav3", "router", frozenset(), frozenset(), 1)
    lines = list(draw(plan, [perfect(plan, "uav3"), nothing]))
    column = lines[0].split().index("uav3")
    assert cells(lines, "flock/uav2/estimate")[column] == "r"
    assert cells(lines, "flock/uav3/estimate")[column] == "p"
    assert cells(lines, "flock/uav1/estimate")[column] == "."


def test_the_results_name_everything_and_are_plain_json(plan):
    seen = AttackResult("uav4", "client", frozenset({ESTIMATE}), frozenset({(ESTIMATE, "uav3")}), 5)
    alive = everybody(plan)
    found = list(deviations(plan, seen, alive))
    results = json.loads(json.dumps(as_json(plan, [seen], found, 1.26)))
    assert (results["swarm"], results["mode"], results["seconds"]) == ("flock", "peers", 1.3)
    assert len(results["leaks"]) + len(results["blocked"]) == len(found)
    (attacker,) = results["attackers"]
    assert attacker["received"] == ["flock/uav2/estimate"]
    assert attacker["published"] == ["flock/uav2/estimate to uav3"]
    assert "flock/uav3/estimate" in attacker["received_expected"]
    assert "flock/uav4/command to kinematics" in attacker["published_expected"]
    assert attacker["refused"] == 2 * len(plan.keys) - 2
    assert attacker["links"] == 5


def test_an_outsider_who_gets_a_link_is_found(plan):
    for outsider in OUTSIDERS:
        intruder = AttackResult(outsider, "peer", frozenset(), frozenset(), 1)
        assert [found.leak for found in deviations(plan, intruder, everybody(plan))] == [True]
        refused = AttackResult(outsider, "peer", frozenset(), frozenset(), 0)
        assert list(deviations(plan, refused, everybody(plan))) == []
