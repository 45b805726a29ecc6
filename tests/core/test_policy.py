import pytest
from flockwire import policy
from flockwire.keys import MISSION, ROWS, STOP, Key, all_keys, uav
from flockwire.wiring import identities
from hypothesis import given, settings
from hypothesis import strategies as st


@st.composite
def variants(draw):
    """Draw a graph with a spanning tree, in either sensing and with either leader, as changes of the small swarm."""
    count = draw(st.integers(1, 6))
    order = draw(st.permutations(range(1, count + 1)))
    edges = {(draw(st.sampled_from([0, *order[:k]])), i) for k, i in enumerate(order)}
    pairs = st.tuples(st.integers(0, count), st.integers(1, count)).filter(lambda e: e[0] != e[1])
    edges |= draw(st.sets(pairs, max_size=8))
    virtual = draw(st.booleans())
    return {
        "graph.edges": [list(edge) for edge in sorted(edges)],
        "drones": [{"id": i, "start": [1.0 * i, 0.0, 0.0]} for i in range(virtual, count + 1)],
        "avoidance": {"sensing": draw(st.sampled_from(["nearby", "neighbours"]))},
        "leader.kind": "virtual" if virtual else "trajectory",
    }


def own_inputs(swarm, i):
    """Return what agent i may hear by the paper: itself, its in-neighbours, and the orders."""
    keys = {Key("pose", uav(i)), Key("telemetry", uav(i)), MISSION, STOP}
    neighbours = swarm.topology.neighbours(i)
    keys |= {Key("estimate", uav(j)) for j in neighbours if j} | {Key("pose", "uav0") for j in neighbours if not j}
    if swarm.avoidance.sensing == "nearby":
        return keys | {Key("nearby", uav(i))}
    return keys | {Key("pose", uav(j)) for j in neighbours}


@settings(max_examples=50)
@given(variants())
def test_an_agent_hears_exactly_its_own_and_its_neighbours(make_swarm, changes):
    swarm = make_swarm(changes)
    for i in swarm.followers:
        assert set(policy.hears(swarm, uav(i))) == own_inputs(swarm, i)
        spoken = {Key(kind, uav(i)) for kind in ("estimate", "command", "status")}
        assert set(policy.says(swarm, uav(i))) == spoken


@settings(max_examples=50)
@given(variants())
def test_links_are_symmetric_and_each_is_dialled_by_one_side(make_swarm, changes):
    swarm = make_swarm(changes)
    linked = {identity: policy.links(swarm, identity) for identity in identities(swarm)}
    dialled = {identity: policy.dials(swarm, identity) for identity in identities(swarm)}
    for one, others in linked.items():
        assert one not in others
        assert set(dialled[one]) <= set(others)
        for other in others:
            assert one in linked[other]
            assert (other in dialled[one]) + (one in dialled[other]) == 1


@settings(max_examples=50)
@given(variants())
def test_every_key_finds_its_way_over_the_links(make_swarm, changes):
    swarm = make_swarm(changes)
    for key in all_keys(swarm):
        row = ROWS[key.kind]
        for speaker in row.said_by(swarm, key.owner):
            assert key in policy.says(swarm, speaker)
            for listener in set(row.heard_by(swarm, key.owner)) - {speaker}:
                assert key in policy.hears(swarm, listener)
                assert listener in policy.links(swarm, speaker)


@settings(max_examples=50)
@given(variants())
def test_nobody_is_mentioned_who_is_not_there(make_swarm, changes):
    swarm = make_swarm(changes)
    there = set(identities(swarm))
    for key in all_keys(swarm):
        row = ROWS[key.kind]
        assert set(row.said_by(swarm, key.owner)) | set(row.heard_by(swarm, key.owner)) <= there


def test_agents_are_linked_along_the_graph_only(make_swarm):
    swarm = make_swarm()
    others = {"gateway", "kinematics", "recorder", "operator"}
    assert set(policy.links(swarm, "uav1")) - others == {"uav2"}  # the leader's pose comes from the gateway
    assert set(policy.links(swarm, "uav3")) - others == {"uav2", "uav4"}


def test_nobody_dials_the_operator(make_swarm):
    swarm = make_swarm()
    assert all("operator" not in policy.dials(swarm, identity) for identity in identities(swarm))


@pytest.mark.parametrize("identity", ["uav9", "stranger"])
def test_a_stranger_says_and_hears_nothing(make_swarm, identity):
    swarm = make_swarm()
    assert policy.says(swarm, identity) == policy.hears(swarm, identity) == policy.links(swarm, identity) == ()
