"""What the probe calls a leak and what it calls blocked."""

import json

import pytest
from flockwire.wire.keys import MISSION, ROWS, STOP, Delivery, Key, all_keys, key_text
from flockwire.wire.wiring import OPERATOR, ROUTER, identities
from flockwire_cli.matrix import OUTSIDERS, Finding, Observation, as_json, draw, findings, may_hear, may_say
from hypothesis import given, settings
from hypothesis import strategies as st

MODES = pytest.mark.parametrize("swarm", ["peers", "router"], indirect=True)
ESTIMATE, ANOTHER, POSE = Key("estimate", "uav2"), Key("estimate", "uav3"), Key("pose", "uav1")


@pytest.fixture
def swarm(make_swarm, request):
    return make_swarm({"network.mode": getattr(request, "param", "peers")})


def everybody(swarm):
    return frozenset(identities(swarm)) - {OPERATOR}


def linked(identity):
    return 0 if identity in OUTSIDERS else 3


def perfect(swarm, identity):
    """Return what is seen of an attacker where all is as it should be."""
    return Observation(identity, "peer", may_hear(swarm, identity), may_say(swarm, identity), linked(identity))


def judged(swarm, identity, heard=(), said=(), unheard=(), unsaid=(), alive=None):
    """Return the findings where an attacker achieved this more, and that less, than it should."""
    right = perfect(swarm, identity)
    seen = Observation(
        identity,
        "client",
        (right.heard | frozenset(heard)) - frozenset(unheard),
        (right.said | frozenset(said)) - frozenset(unsaid),
        linked(identity),
    )
    return list(findings(swarm, seen, everybody(swarm) if alive is None else frozenset(alive)))


@MODES
def test_where_all_is_as_it_should_be_there_is_nothing_to_find(swarm):
    for identity in (*OUTSIDERS, *identities(swarm)):
        assert judged(swarm, identity) == []


@MODES
def test_everything_seen_is_judged_by_the_key_table(swarm):
    for identity in set(identities(swarm)) - {ROUTER}:
        for key in all_keys(swarm):
            row = ROWS[key.kind]
            listeners = set(row.heard_by(swarm, key.owner)) - {OPERATOR}
            listeners -= {identity} if swarm.network.mode == "peers" else set()  # a router passes it on even to that
            allowed = listeners if identity in row.said_by(swarm, key.owner) else set()
            assert (key in may_hear(swarm, identity)) == (identity in row.heard_by(swarm, key.owner))
            assert {receiver for said, receiver in may_say(swarm, identity) if said == key} == allowed


def test_a_neighbour_may_hear_an_estimate_and_a_stranger_to_it_may_not(swarm):
    assert ESTIMATE in may_hear(swarm, "uav3")
    assert ESTIMATE not in may_hear(swarm, "uav4")
    assert ESTIMATE not in may_hear(swarm, "uav1")
    assert may_hear(swarm, "uav3") & may_hear(swarm, "uav4") == {MISSION, STOP}


@MODES
@pytest.mark.parametrize("outsider", [*OUTSIDERS, "somebody else"])
def test_outsiders_may_nothing(swarm, outsider):
    assert may_hear(swarm, outsider) == may_say(swarm, outsider) == frozenset()
    (heard,) = judged(swarm, outsider, heard=[POSE])
    (said,) = judged(swarm, outsider, said=[(STOP, "kinematics")])
    assert heard.leak
    assert said.leak


@pytest.mark.parametrize("swarm", ["router"], indirect=True)
def test_the_routers_certificate_in_other_hands_may_nothing(swarm):
    assert may_hear(swarm, ROUTER) == may_say(swarm, ROUTER) == frozenset()
    assert [found.leak for found in judged(swarm, ROUTER, heard=[POSE])] == [True]


@MODES
def test_what_is_heard_and_must_not_be_is_a_leak(swarm):
    (found,) = judged(swarm, "uav4", heard=[ESTIMATE])
    assert found == Finding("uav4", "client", "heard", "flock/uav2/estimate", "", leak=True)
    assert found.sentence() == "leak: uav4 as client heard flock/uav2/estimate; it must not"


@MODES
def test_what_is_said_and_must_not_be_is_a_leak_of_the_one_who_let_it_in(swarm):
    (found,) = judged(swarm, "uav4", said=[(ESTIMATE, "uav3")])
    assert found == Finding("uav4", "client", "said", "flock/uav2/estimate", "uav3", leak=True)
    assert found.sentence() == "leak: uav4 as client said flock/uav2/estimate and uav3 let it in; it must not"


def test_a_leak_is_one_whoever_is_alive(swarm):
    assert [found.leak for found in judged(swarm, "uav4", heard=[ESTIMATE], alive=())] == [True]
    assert [found.leak for found in judged(swarm, "uav4", said=[(ESTIMATE, "uav3")], alive=())] == [True]


@MODES
def test_what_may_be_heard_and_is_not_is_blocked(swarm):
    (found,) = judged(swarm, "uav3", unheard=[ESTIMATE])
    assert found == Finding("uav3", "client", "heard", "flock/uav2/estimate", "", leak=False)
    assert found.sentence() == ("blocked: uav3 as client may have flock/uav2/estimate heard; it did not get through")


@MODES
def test_what_may_be_said_and_is_not_let_in_is_blocked_by_the_receiver(swarm):
    (found,) = judged(swarm, "uav2", unsaid=[(ESTIMATE, "uav3")])
    assert found == Finding("uav2", "client", "said", "flock/uav2/estimate", "uav3", leak=False)
    assert "by uav3; it did not get through" in found.sentence()


def test_nothing_is_blocked_by_one_who_is_not_there(swarm):
    assert judged(swarm, "uav2", unsaid=[(ESTIMATE, "uav3")], alive=everybody(swarm) - {"uav3"}) == []


def test_nothing_is_to_be_heard_of_one_who_is_not_there(swarm):
    assert judged(swarm, "uav3", unheard=[ESTIMATE], alive=everybody(swarm) - {"uav2"}) == []


def test_an_attacker_does_not_wait_to_hear_itself(swarm):
    own = Key("status", "recorder")  # the recorder hears its own
    assert own in may_hear(swarm, "recorder")
    assert judged(swarm, "recorder", unheard=[own]) == []


def test_orders_need_not_flow_all_the_time_but_may_be_given(swarm):
    assert {row.kind for row in ROWS.values() if row.delivery is Delivery.EVENT} == {"mission", "stop"}
    assert judged(swarm, "uav1", unheard=[MISSION, STOP]) == []
    (found,) = judged(swarm, OPERATOR, unsaid=[(STOP, "kinematics")])
    assert (found.key, found.receiver, found.leak) == ("flock/stop", "kinematics", False)


def test_nobody_is_asked_to_say_anything_to_the_operator(swarm):
    assert {OPERATOR} & {
        receiver for identity in identities(swarm) for _, receiver in may_say(swarm, identity)
    } == set()


@settings(max_examples=60)
@given(data=st.data())
def test_every_single_difference_is_exactly_one_finding(make_swarm, data):
    swarm = make_swarm()
    identity = data.draw(st.sampled_from([*OUTSIDERS, *identities(swarm)]))
    right = perfect(swarm, identity)
    key = data.draw(st.sampled_from(all_keys(swarm)))
    seen = Observation(identity, "peer", right.heard ^ {key}, right.said, right.links)
    found = list(findings(swarm, seen, everybody(swarm)))
    silent = ROWS[key.kind].delivery is Delivery.EVENT or set(ROWS[key.kind].said_by(swarm, key.owner)) <= {identity}
    if key in right.heard and silent:
        assert found == []
    else:
        (only,) = found
        assert (only.key, only.leak, only.verb) == (key_text(swarm, key), key not in right.heard, "heard")


def cells(lines, text):
    (row,) = [line for line in lines if line.startswith(f"{text} ")]
    return row.removeprefix(text).split()


@MODES
def test_the_matrix_shows_who_said_and_heard_what(swarm):
    lines = list(draw(swarm, [perfect(swarm, identity) for identity in identities(swarm)]))
    columns = lines[0].split()
    assert columns == [identity for identity in identities(swarm) if identity != ROUTER]
    assert len(lines) == 1 + len(all_keys(swarm))
    shown = dict(zip(columns, cells(lines, "flock/uav2/estimate"), strict=True))
    assert {name: sign for name, sign in shown.items() if sign != "."} == {"uav2": "S", "uav3": "H", "recorder": "H"}
    assert dict(zip(columns, cells(lines, "flock/mission"), strict=True))["gateway"] == "B"


def test_what_differs_between_the_link_modes_is_in_lower_case(swarm):
    nothing = Observation("uav3", "router", frozenset(), frozenset(), 1)
    lines = list(draw(swarm, [perfect(swarm, "uav3"), nothing]))
    column = lines[0].split().index("uav3")
    assert cells(lines, "flock/uav2/estimate")[column] == "h"
    assert cells(lines, "flock/uav3/estimate")[column] == "s"
    assert cells(lines, "flock/uav1/estimate")[column] == "."


def test_the_results_name_everything_and_are_plain_json(swarm):
    seen = Observation("uav4", "client", frozenset({ESTIMATE}), frozenset({(ESTIMATE, "uav3")}), 5)
    found = list(findings(swarm, seen, everybody(swarm)))
    results = json.loads(json.dumps(as_json(swarm, [seen], found, 1.26)))
    assert (results["swarm"], results["mode"], results["seconds"]) == ("flock", "peers", 1.3)
    assert len(results["leaks"]) + len(results["blocked"]) == len(found)
    (attacker,) = results["attackers"]
    assert attacker["heard"] == ["flock/uav2/estimate"]
    assert attacker["said"] == ["flock/uav2/estimate to uav3"]
    assert "flock/uav3/estimate" in attacker["heard_expected"]
    assert "flock/uav4/command to kinematics" in attacker["said_expected"]
    assert attacker["refused"] == 2 * len(all_keys(swarm)) - 2
    assert attacker["links"] == 5


def test_an_outsider_who_gets_a_link_is_found(swarm):
    for outsider in OUTSIDERS:
        intruder = Observation(outsider, "peer", frozenset(), frozenset(), 1)
        assert [found.leak for found in findings(swarm, intruder, everybody(swarm))] == [True]
        refused = Observation(outsider, "peer", frozenset(), frozenset(), 0)
        assert list(findings(swarm, refused, everybody(swarm))) == []
