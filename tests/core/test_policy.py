import pytest
from flockwire.swarm.model import uav
from flockwire.wire import access
from flockwire.wire.keys import MISSION, ROWS, STOP, Key, all_keys
from flockwire.wire.wiring import ROUTER, identities
from hypothesis import given, settings
from hypothesis import strategies as st


def own_inputs(swarm, i):
    """Return what agent i may hear by the paper: itself, its in-neighbours, and the orders."""
    keys = {Key("pose", uav(i)), Key("telemetry", uav(i)), MISSION, STOP}
    neighbours = swarm.topology.neighbours(i)
    keys |= {Key("estimate", uav(j)) for j in neighbours if j} | {Key("pose", "uav0") for j in neighbours if not j}
    if swarm.avoidance.sensing == "nearby":
        return keys | {Key("nearby", uav(i))}
    return keys | {Key("pose", uav(j)) for j in neighbours}


@settings(max_examples=50)
@given(data=st.data())
def test_an_agent_hears_exactly_its_own_and_its_neighbours(swarms, data):
    swarm = data.draw(swarms)
    for i in swarm.followers:
        assert set(policy.hears(swarm, uav(i))) == own_inputs(swarm, i)
        spoken = {Key(kind, uav(i)) for kind in ("estimate", "command", "status")}
        assert set(policy.says(swarm, uav(i))) == spoken


@settings(max_examples=50)
@given(data=st.data())
def test_links_are_symmetric_and_each_is_dialled_by_one_side(swarms, data):
    swarm = data.draw(swarms)
    linked = {identity: policy.links(swarm, identity) for identity in identities(swarm)}
    dialled = {identity: policy.dials(swarm, identity) for identity in identities(swarm)}
    for one, others in linked.items():
        assert one not in others
        assert set(dialled[one]) <= set(others)
        for other in others:
            assert one in linked[other]
            assert (other in dialled[one]) + (one in dialled[other]) == 1


@settings(max_examples=50)
@given(data=st.data())
def test_every_key_finds_its_way_over_the_links(swarms, data):
    swarm = data.draw(swarms)
    for key in all_keys(swarm):
        row = ROWS[key.kind]
        for speaker in row.said_by(swarm, key.owner):
            assert key in policy.says(swarm, speaker)
            for listener in set(row.heard_by(swarm, key.owner)) - {speaker}:
                assert key in policy.hears(swarm, listener)
                assert listener in policy.partners(swarm, speaker)
                assert key in policy.passes(swarm, speaker, listener)


@settings(max_examples=50)
@given(data=st.data())
def test_nobody_is_mentioned_who_is_not_there(swarms, data):
    swarm = data.draw(swarms)
    there = set(identities(swarm))
    for key in all_keys(swarm):
        row = ROWS[key.kind]
        assert set(row.said_by(swarm, key.owner)) | set(row.heard_by(swarm, key.owner)) <= there


def test_agents_are_linked_along_the_graph_only(make_swarm):
    swarm = make_swarm()
    others = {"gateway", "kinematics", "recorder", "operator"}
    assert set(policy.partners(swarm, "uav1")) - others == {"uav2"}  # the leader's pose comes from the gateway
    assert set(policy.partners(swarm, "uav3")) - others == {"uav2", "uav4"}
    assert policy.links(swarm, "uav3") == policy.partners(swarm, "uav3")


def test_with_a_router_it_is_everybodys_only_link_and_all_dial_it(make_swarm):
    swarm = make_swarm({"network.mode": "router"})
    others = identities(swarm)[1:]
    assert identities(swarm)[0] == ROUTER
    assert policy.links(swarm, ROUTER) == others
    assert policy.dials(swarm, ROUTER) == ()
    for identity in others:
        assert policy.links(swarm, identity) == policy.dials(swarm, identity) == (ROUTER,)


def test_a_router_changes_nobodys_partners(make_swarm):
    swarm, routed = make_swarm(), make_swarm({"network.mode": "router"})
    for identity in identities(swarm):
        assert [other for other in policy.partners(routed, identity) if other != ROUTER] == list(
            policy.partners(swarm, identity)
        )


@settings(max_examples=50)
@given(data=st.data())
def test_over_a_link_to_the_router_goes_what_its_client_says_and_hears(swarms, data):
    swarm = data.draw(swarms.filter(lambda swarm: swarm.network.mode == "router"))
    for identity in identities(swarm)[1:]:
        assert set(policy.passes(swarm, identity, ROUTER)) == set(policy.says(swarm, identity))
        assert set(policy.passes(swarm, ROUTER, identity)) == set(policy.hears(swarm, identity))


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_nobody_dials_the_operator(make_swarm, mode):
    swarm = make_swarm({"network.mode": mode})
    assert all("operator" not in policy.dials(swarm, identity) for identity in identities(swarm))


@pytest.mark.parametrize("identity", ["uav9", "stranger"])
def test_a_stranger_says_and_hears_nothing(make_swarm, identity):
    swarm = make_swarm()
    assert policy.says(swarm, identity) == policy.hears(swarm, identity) == policy.partners(swarm, identity) == ()
