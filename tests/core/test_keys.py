import pytest
from flockwire.swarm.model import uav
from flockwire.wire.keys import MISSION, ROWS, STOP, TABLE, Delivery, Key, all_keys, key_text

AGENTS = ("uav1", "uav2", "uav3", "uav4")
PILOTS = ("leader", *AGENTS)
EVERYBODY = ("gateway", "kinematics", *PILOTS, "recorder")
CHAIN = {  # the paper's: {key: (who says it, who hears it beside the recorder)}
    **{Key("truth", uav(i)): ({"kinematics"}, {"gateway"}) for i in range(5)},
    **{Key("nearby", uav(i)): ({"gateway"}, {uav(i)}) for i in range(1, 5)},
    Key("pose", "uav0"): ({"gateway"}, {"leader", "uav1"}),
    **{Key("pose", uav(i)): ({"gateway"}, {uav(i)}) for i in range(1, 5)},
    **{Key("estimate", uav(i)): ({uav(i)}, {uav(i + 1)}) for i in range(1, 4)},
    Key("estimate", "uav4"): ({"uav4"}, set()),
    **{Key("command", uav(i)): ({PILOTS[i]}, {"kinematics"}) for i in range(5)},
    **{Key("telemetry", uav(i)): ({"kinematics"}, {PILOTS[i], "operator"}) for i in range(5)},
    **{Key("status", identity): ({identity}, {"operator"}) for identity in EVERYBODY},
    MISSION: ({"operator", "gateway"}, {"gateway", *PILOTS}),
    STOP: ({"operator"}, {"kinematics", *PILOTS}),
}


def both(swarm, key):
    row = ROWS[key.kind]
    return set(row.said_by(swarm, key.owner)), set(row.heard_by(swarm, key.owner)) - {"recorder"}


def test_the_papers_chain_has_exactly_these_keys(make_swarm):
    keys = all_keys(make_swarm())
    assert set(keys) == set(CHAIN)
    assert len(keys) == len(set(keys))


@pytest.mark.parametrize("key", CHAIN, ids="_".join)
def test_the_papers_chain_says_and_hears_what_the_table_promises(make_swarm, key):
    assert both(make_swarm(), key) == CHAIN[key]


def test_the_recorder_hears_everything(make_swarm):
    swarm = make_swarm()
    assert all("recorder" in ROWS[key.kind].heard_by(swarm, key.owner) for key in all_keys(swarm))


def test_with_neighbours_sensing_there_is_no_nearby_and_listeners_hear_poses(make_swarm):
    swarm = make_swarm({"avoidance.sensing": "neighbours"})
    assert not [key for key in all_keys(swarm) if key.kind == "nearby"]
    for i in range(1, 4):
        assert both(swarm, Key("pose", uav(i))) == ({"gateway"}, {uav(i), uav(i + 1)})
    assert both(swarm, Key("pose", "uav4")) == ({"gateway"}, {"uav4"})


def test_a_virtual_leader_says_its_pose_itself_and_has_no_airframe(make_swarm):
    swarm = make_swarm({"leader.kind": "virtual", "drones.0": None})
    assert both(swarm, Key("pose", "uav0")) == ({"leader"}, {"uav1"})
    assert {key.kind for key in all_keys(swarm) if key.owner == "uav0"} == {"pose"}
    assert "leader" in ROWS["mission"].heard_by(swarm, "")


def test_no_two_rows_have_one_kind():
    assert len(ROWS) == len(TABLE)


def test_orders_are_events_and_only_the_mission_lasts():
    assert {row.kind for row in TABLE if row.delivery is Delivery.EVENT} == {"mission", "stop"}
    assert [row.kind for row in TABLE if row.lifetime is None] == ["mission"]


def test_a_keys_text_is_a_topic_below_the_swarms_name(make_swarm):
    swarm = make_swarm()
    assert key_text(swarm, Key("pose", "uav3")) == "flock/uav3/pose"
    assert key_text(swarm, MISSION) == "flock/mission"
    texts = [key_text(swarm, key) for key in all_keys(swarm)]
    assert len(texts) == len(set(texts))
