from flockwire_core.wire.plan import Plan
from flockwire_operator.station.check import describe


def test_a_perfect_world_is_said_to_be_one(make_swarm):
    cameras = {"gateway": {"noise": 0.001, "latency": 0.01}}
    late = {"airframes": {"kinematics": {"lag": 0.2}}}
    perfect = {"gateway": {}, "airframes": {"kinematics": {}}}
    assert "a perfect world" in describe(Plan(make_swarm(perfect)))
    assert "a perfect world" not in describe(Plan(make_swarm(perfect | late)))
    told = describe(Plan(make_swarm(perfect | cameras)))
    assert "cameras: simulated, 100 Hz, noise 1 mm, latency 10 ms, 0 % of the samples lost" in told
    assert "a perfect world" not in told
    assert "cameras" not in describe(Plan(make_swarm(perfect | {"gateway": {"source": "vrpn"}})))


def test_the_description_shows_graph_bounds_formations_and_links(make_plan):
    text = describe(make_plan({"formations.wide": {"kind": "line"}}))
    for part in (
        "swarm flock: 4 followers, leader trajectory, law paper",
        "uav1    from leader (1)",
        "uav4    from uav3 (1)",
        "lambda_min",
        "theta",
        "settling time <=",
        "formation (default): circle",
        "formation wide: line",
        "127.0.0.1:7450",
    ):
        assert part in text


def test_a_virtual_leader_is_described_too(make_plan):
    text = describe(make_plan({"leader.kind": "virtual", "drones.0": None}))
    assert "leader virtual" in text


def test_checks_that_do_not_judge_are_listed(make_plan):
    off = {"checks": {"formation_settled": False, "observation_tail": False}}
    assert "not judged after a flight ([checks]): formation settled, observation tail" in describe(make_plan(off))
    assert "not judged" not in describe(make_plan())
