import pytest
from flockwire_core.swarm.model import uav
from flockwire_core.wire.keys import (
    MISSION,
    PROPOSAL,
    ROWS,
    STOP,
    TABLE,
    TIME_REPLY,
    TIME_REQUEST,
    Delivery,
    Key,
    key_text,
)
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import PROCESSES, Roster
from hypothesis import given, settings
from hypothesis import strategies as st

AGENTS = ("uav1", "uav2", "uav3", "uav4")
ORDERING = {"operator", "console"}
PILOTS = ("leader", *AGENTS)
STARTED = ("gateway", "kinematics", *PILOTS, "recorder")
CHAIN = {  # the paper's: {key: (who publishes it, who subscribes to it beside the recorder)}
    **{Key("truth", uav(i)): ({"kinematics"}, {"gateway"}) for i in range(5)},
    **{Key("nearby", uav(i)): ({"gateway"}, {PILOTS[i]}) for i in range(5)},
    Key("pose", "uav0"): ({"gateway"}, {"leader", "uav1"}),
    **{Key("pose", uav(i)): ({"gateway"}, {uav(i)}) for i in range(1, 5)},
    **{Key("estimate", uav(i)): ({uav(i)}, {uav(i + 1)}) for i in range(1, 4)},
    Key("estimate", "uav4"): ({"uav4"}, set()),
    **{Key("command", uav(i)): ({PILOTS[i]}, {"kinematics"}) for i in range(5)},
    **{Key("telemetry", uav(i)): ({"kinematics"}, {PILOTS[i], *ORDERING}) for i in range(5)},
    **{Key("status", identity): ({identity}, ORDERING) for identity in STARTED},
    **{Key("status", pilot): ({pilot}, {"gateway", *ORDERING}) for pilot in AGENTS},  # whose poses are not their own
    Key("status", "leader"): ({"leader"}, {"gateway", "uav1", *ORDERING}),  # and whether it leads
    **{Key("batch", identity): ({identity}, set()) for identity in STARTED if identity != "recorder"},
    PROPOSAL: (ORDERING, {"gateway"}),
    MISSION: ({*ORDERING, "gateway"}, {"gateway", *PILOTS}),
    STOP: (ORDERING, {"kinematics", *PILOTS}),
    **{Key(TIME_REQUEST, name): ({name}, {"gateway"}) for name in sorted(ORDERING)},
    **{Key(TIME_REPLY, name): ({"gateway"}, {name}) for name in sorted(ORDERING)},
}


def both(swarm, key):
    """Return who publishes a key and who subscribes to it, straight from its row."""
    roster, row = Roster(swarm), ROWS[key.kind]
    (owner,) = [owner for owner in row.owners(roster) if owner.identity == key.owner]
    return set(row.publishers(roster, owner)), set(row.subscribers(roster, owner))


def test_the_papers_chain_has_exactly_these_keys(make_swarm):
    keys = Plan(make_swarm()).keys
    assert set(keys) == set(CHAIN)
    assert len(keys) == len(set(keys))


@pytest.mark.parametrize("key", CHAIN, ids="_".join)
def test_the_papers_chain_publishes_and_subscribes_as_the_paper_has_it(make_swarm, key):
    assert both(make_swarm(), key) == CHAIN[key]


def test_with_neighbours_sensing_there_is_no_nearby_and_listeners_subscribe_to_poses(make_swarm):
    swarm = make_swarm({"avoidance.sensing": "neighbours"})
    assert not [key for key in Plan(swarm).keys if key.kind == "nearby"]
    for i in range(1, 4):
        assert both(swarm, Key("pose", uav(i))) == ({"gateway"}, {uav(i), uav(i + 1)})
    assert both(swarm, Key("pose", "uav4")) == ({"gateway"}, {"uav4"})


def test_bids_go_along_the_edges_between_followers_where_a_formation_has_an_auction(make_swarm):
    both_ways = [[0, 1], [0, 2], [1, 2], [2, 1], [2, 3], [3, 2], [3, 4], [4, 3]]
    table = {"graph.edges": both_ways, "formations": {"row": {"kind": "line", "assignment": "auction"}}}
    swarm = make_swarm(table)
    assert [key.owner for key in Plan(swarm).keys if key.kind == "law"] == list(AGENTS)
    assert both(swarm, Key("law", "uav1")) == ({"uav1"}, {"uav2"})
    assert both(swarm, Key("law", "uav2")) == ({"uav2"}, {"uav1", "uav3"})
    assert not [key for key in Plan(make_swarm({"graph.edges": both_ways})).keys if key.kind == "law"]


def test_a_drone_with_a_driver_is_commanded_through_it_alone(make_swarm):
    swarm = make_swarm({"drones.1.airframe": "tello", "drones.2.airframe": "tello"})
    for i, driver in enumerate(("kinematics", "driver1", "driver2", "kinematics", "kinematics")):
        assert both(swarm, Key("command", uav(i))) == ({PILOTS[i]}, {driver})
        assert both(swarm, Key("telemetry", uav(i))) == ({driver}, {PILOTS[i], *ORDERING})


@pytest.mark.parametrize(
    ("gateway", "cameras"),
    [({"source": "natnet"}, set()), ({"source": "vrpn", "twin": {}}, {"tracker-sim"}), ({}, {"gateway"})],
)
def test_the_truth_is_for_who_simulates_the_cameras_alone(make_swarm, gateway, cameras):
    swarm = make_swarm({"gateway": gateway})
    for i in range(5):
        assert both(swarm, Key("truth", uav(i))) == ({"kinematics"}, cameras)
        assert both(swarm, Key("pose", uav(i)))[0] == {"gateway"}
    assert not [key for key in Plan(swarm).keys if "tracker-sim" in both(swarm, key)[1] and key.kind != "truth"]


def test_a_virtual_leader_publishes_its_pose_itself_and_has_no_airframe(make_swarm):
    swarm = make_swarm({"leader.kind": "virtual", "drones.0": None})
    assert both(swarm, Key("pose", "uav0")) == ({"leader"}, {"uav1"})
    assert {key.kind for key in Plan(swarm).keys if key.owner == "uav0"} == {"pose"}
    assert "leader" in both(swarm, MISSION)[1]


def test_a_tracked_leader_is_seen_by_the_gateway_and_never_commanded(make_swarm):
    tracked = {"leader.kind": "tracked", "drones.0.start": [0.0, 0.0, 1.2]}
    swarm = make_swarm(tracked)
    assert both(swarm, Key("truth", "uav0")) == ({"kinematics"}, {"gateway"})
    assert both(swarm, Key("pose", "uav0")) == ({"gateway"}, {"leader", "uav1"})
    assert {key.kind for key in Plan(swarm).keys if key.owner == "uav0"} == {"truth", "pose"}
    assert "uav1" not in both(swarm, Key("status", "leader"))[1]
    assert "kinematics" in both(swarm, MISSION)[1]
    real = make_swarm({**tracked, "gateway.source": "natnet"})
    assert Key("truth", "uav0") not in Plan(real).keys
    assert "kinematics" not in both(real, MISSION)[1]


@settings(max_examples=50)
@given(data=st.data())
def test_no_row_names_a_process_that_the_swarm_does_not_have(plans, data):
    roster = Roster(data.draw(plans).swarm)
    for row in TABLE:
        for owner in row.owners(roster):
            assert set(row.publishers(roster, owner)) | set(row.subscribers(roster, owner)) <= set(roster.rows)


def test_the_leaders_status_goes_to_whoever_has_an_edge_from_it_and_no_other_status_to_any_agent(make_swarm):
    for leader in ({}, {"leader.kind": "virtual", "drones.0": None}):
        swarm = make_swarm({"graph.edges": [[0, 1], [0, 3], [1, 2], [2, 3], [3, 4]], **leader})
        own = set() if leader else {"gateway"}  # whether its poses are its own; a virtual one has none
        assert both(swarm, Key("status", "leader")) == ({"leader"}, {"uav1", "uav3", *ORDERING} | own)
        for identity in set(STARTED) - set(PILOTS):
            assert both(swarm, Key("status", identity)) == ({identity}, ORDERING)


def test_no_row_knows_who_records(make_swarm):
    recorders = {row.kind for row in PROCESSES if row.records}
    assert recorders == {"recorder"}
    assert not [key for key in CHAIN if recorders & both(make_swarm(), key)[1]]


def test_no_two_rows_have_one_kind():
    assert len(ROWS) == len(TABLE)


def test_orders_are_events_and_only_the_mission_lasts():
    assert {row.kind for row in TABLE if row.delivery is Delivery.EVENT} == {"proposal", "mission", "stop"}
    assert [row.kind for row in TABLE if row.maximum_age is None] == ["proposal", "mission", TIME_REQUEST, TIME_REPLY]


def test_a_keys_text_is_a_topic_below_the_swarms_name(make_swarm):
    swarm = make_swarm()
    assert key_text(swarm.name, Key("pose", "uav3")) == "flock/uav3/pose"
    assert key_text(swarm.name, MISSION) == "flock/mission"
    texts = [key_text(swarm.name, key) for key in Plan(swarm).keys]
    assert len(texts) == len(set(texts))
