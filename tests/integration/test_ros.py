"""The process ros with a flying swarm, seen and attacked from the ROS side."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from signal import SIGKILL

import pytest
from fleet import PATIENCE, Fleet, Tower, flockwire
from flockwire_analysis.reading import read_trace
from flockwire_core import clock
from flockwire_core.domain.airframe import Steer
from flockwire_core.domain.pose import Pose
from flockwire_core.ros.graph import data_key
from flockwire_core.wire.codec import encode
from flockwire_core.wire.status import Status
from flockwire_operator.ros.core import services
from flockwire_operator.ros.topics import all_topics
from ports import free_port
from ros_attacks import GOOD, attack, steer_wrongly
from ros_graph import ATTACHMENT, Gaps, Sdk, bare, router
from waiting import wait_until

BY_ROS = """
[ros]
router = "127.0.0.1:{port}"
[gateway]
source = "ros"
noise = 0.001
[gateway.ros]
router = "127.0.0.1:{port}"
array = "/poses"
[gateway.twin]
[leader.ros]
topic = "/goal"
message = "PoseStamped"
"""
KILLED = '[[faults]]\nat = 7.0\nkind = "kill"\nprocess = "ros"\n'
LOST = 0.1  # of the samples: the router drops (its queue holds 0.1 s of all topics) while its task is late
STEERED = ('kind = "trajectory"', 'kind = "ros"\nspeed = 0.3')


class Graph:
    """The router's port, and the router, which may be ended."""

    def __init__(self) -> None:
        self.port, self._stack = free_port(), ExitStack()

    def begin(self) -> None:
        self._stack.enter_context(router(self.port))

    def end(self) -> None:
        self._stack.close()


@pytest.fixture
def graph() -> Iterator[Graph]:
    """Return a ROS graph whose router runs."""
    found = Graph()
    found.begin()
    yield found
    found.end()


@pytest.fixture
def sdk(graph: Graph) -> Iterator[Sdk]:
    """Return a node of zenoh-ros2-sdk; its threads would outlive a test that fails."""
    found = Sdk(graph.port)
    yield found
    found.close()


@pytest.fixture
def flying(
    make_swarm: Callable[..., Path],
    make_fleet: Callable[[Path], Fleet],
    make_tower: Callable[[Fleet], Tower],
    graph: Graph,
) -> Callable[..., tuple[Fleet, Tower]]:
    """Return a function that flies the paper's swarm with a table [ros], all in formation."""

    def fly(tables: str = "", edit: tuple[str, str] = ("", "")) -> tuple[Fleet, Tower]:
        path = make_swarm()
        text = path.read_text().replace(*edit)
        path.write_text(f'{text}\n[ros]\nrouter = "127.0.0.1:{graph.port}"\n{tables}')
        fleet = make_fleet(path)
        tower = make_tower(fleet)
        fleet.start()
        tower.fly()
        tower.wait(lambda seen: "ros" in seen and seen["ros"].report.phase == "serving")
        return fleet, tower

    return fly


@pytest.mark.long
def test_an_independent_node_sees_and_orders_and_an_attacker_does_not(
    graph: Graph, sdk: Sdk, flying: Callable[..., tuple[Fleet, Tower]]
) -> None:
    fleet, tower = flying('orders = ["hold"]\n')
    topics = all_topics(fleet.plan)
    wanted = {topic.name: topic.ros_type for topic in topics}
    assert sdk.topics() == wanted
    assert set(sdk.services()) == set(services(fleet.plan.swarm))
    for topic in topics:
        sdk.subscribe(topic.name, topic.ros_type, topic.qos.latched)
    with bare(graph.port) as session:
        gaps = Gaps(session, [data_key(0, topic.name, topic.ros_type) for topic in topics])
        wait_until(lambda: all(sdk.counts[name] >= 5 for name in wanted if name not in ("/tf_static",)), PATIENCE)
        assert sdk.counts["/tf_static"] == 1  # kept for late joiners
        assert sdk.last["/paper/uav1/odom"].child_frame_id == "uav1"
        attack(session, fleet.plan)
        assert sdk.call("/paper/land") == (
            False,
            "refused: ros.orders of the swarm file does not have 'land'",
        )
        tower.all_in("formation")
        seen = tower.wait(lambda seen: dict(seen["ros"].report.counts).get("ROS orders refused", 0) >= 2)
        counts = dict(seen["ros"].report.counts)
        assert counts["ROS requests malformed"] == 7
        assert counts["ROS requests too large"] == 2
        assert counts["ROS requests of several services"] >= 1
        assert not [name for name, status in seen.items() for reason, _ in status.rejected if "mission" in reason]
        assert sdk.call("/paper/hold") == (True, "confirmed by leader, uav1, uav2, uav3, uav4")
        tower.all_in("hold")
        assert "not published" not in counts
        assert sum((+gaps.read().lost).values()) <= LOST * sum(gaps.counts.values())
        assert min(gaps.counts[data_key(0, topic.name, topic.ros_type)] for topic in topics[:2]) > 100
    assert "Traceback" not in fleet.log("ros")


@pytest.mark.long
def test_topics_are_back_after_the_router_or_the_process_was_killed(
    graph: Graph, flying: Callable[..., tuple[Fleet, Tower]]
) -> None:
    fleet, tower = flying()
    pose = data_key(0, "/paper/uav1/pose", "geometry_msgs/msg/PoseStamped")
    graph.end()
    tower.wait(lambda seen: seen["ros"].report.phase == "waiting")
    graph.begin()
    with bare(graph.port) as session:
        gaps = Gaps(session, [pose])
        wait_until(lambda: gaps.read().counts[pose] > 0, PATIENCE)
        fleet.end("ros", SIGKILL)
        before = gaps.read().last[pose]
        fleet.start("ros")
        wait_until(lambda: gaps.read().last[pose] < before, PATIENCE)  # its numbers begin again
    tower.all_in("formation")
    tower.settled(0.1)


@pytest.mark.long
def test_a_leader_follows_a_topic_and_stops_when_it_ends(
    graph: Graph, flying: Callable[..., tuple[Fleet, Tower]]
) -> None:
    _, tower = flying("", STEERED)
    key = data_key(0, "/leader/cmd_vel", "geometry_msgs/msg/TwistStamped")

    def moved(x: float) -> Callable[[dict[str, Status]], bool]:
        def seen(statuses: dict[str, Status]) -> bool:
            stamp = clock.now()
            session.put(
                key, encode(Steer(stamp, "world", (0.3, 0.0, 0.0))), attachment=ATTACHMENT.pack(1, 1, 16, bytes(16))
            )
            return (statuses["leader"].report.position or (0.0,))[0] > x

        return seen

    with bare(graph.port) as session:
        begin = (tower.statuses["leader"].report.position or (0.0,))[0]
        tower.wait(moved(begin + 0.5))
        tower.wait(lambda seen: seen["leader"].report.detail.startswith("no steering command for "))
        tower.wait(lambda seen: seen["ros"].report.detail.startswith("no node publishes /leader/cmd_vel: "))
        assert not tower.statuses["ros"].report.counts
        place = tower.statuses["leader"].report.position
        attacked = steer_wrongly(session, key)
        tower.wait(lambda seen: dict(seen["ros"].report.counts) == attacked)
        assert tower.statuses["leader"].report.detail.startswith("no steering command for ")
        assert tower.statuses["leader"].report.position == pytest.approx(place, abs=0.05)
    tower.all_in("formation")


@pytest.mark.long
def test_a_flight_by_an_array_of_poses_whose_leader_goes_to_a_place_outlives_its_ros_process(
    graph: Graph, make_swarm: Callable[..., Path], tmp_path: Path
) -> None:
    path, out, faults = make_swarm(), tmp_path / "out", tmp_path / "faults.toml"
    faults.write_text(KILLED)
    path.write_text(f"{path.read_text().replace(*STEERED)}\n{BY_ROS.format(port=graph.port)}")
    goal, place = data_key(0, "/goal", "geometry_msgs/msg/PoseStamped"), (0.6, 0.4, 1.1)
    up = flockwire("up", path, "--headless", "--duration", "11", "--out", out, "--faults", faults)
    with bare(graph.port) as session:

        def over() -> bool:
            session.put(goal, encode(Pose(clock.now(), "world", place)), attachment=GOOD)
            return up.poll() is not None

        wait_until(over, 2 * PATIENCE)
    output, errors = up.communicate()
    assert up.returncode == 0, errors + output
    assert "ros ended unexpectedly (signal SIGKILL)" in output
    trace = read_trace(out / "trace.mcap")
    assert len([one for one in trace.vitals if one.last.identity == "ros"]) == 2
    assert trace.positions(0).values[:, :2].max(axis=0) == pytest.approx(place[:2], abs=0.05)
