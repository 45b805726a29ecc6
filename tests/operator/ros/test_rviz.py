"""docs/ros.rviz shows topics that exist, with their quality of service, and every kind of topic that RViz can show."""

from __future__ import annotations

import re
from pathlib import Path

from flockwire_core.loading import load_swarm
from flockwire_core.swarm.ros import Ros
from flockwire_core.wire.plan import Plan
from flockwire_operator.ros.topics import all_topics

ROOT = Path(__file__).parents[3]


def test_the_picture_for_rviz_shows_topics_of_the_papers_swarm() -> None:
    swarm = load_swarm(ROOT / "examples" / "paper_simulation.toml").model_copy(update={"ros": Ros()})
    topics = {topic.name: topic.ros_type for topic in all_topics(Plan(swarm))}
    shown = re.findall(r"Value: (/\S+)", (ROOT / "docs" / "ros.rviz").read_text(encoding="utf-8"))
    assert len(shown) == len(set(shown))
    drawn = {"geometry_msgs/msg/PoseStamped", "nav_msgs/msg/Odometry", "visualization_msgs/msg/MarkerArray"}
    assert set(shown) == {name for name, ros_type in topics.items() if ros_type in drawn}


def test_the_page_names_every_topic_service_and_table() -> None:
    page = (ROOT / "docs" / "ros.md").read_text(encoding="utf-8")
    for name in ("/tf", "/tf_static", "/diagnostics", "/swarm/markers", "/swarm/status", "/clock"):
        assert f"`{name}`" in page
    for last in ("pose", "odom", "cmd_vel", "leader_estimate", "battery"):
        assert f"`<drone>/{last}`" in page
    for table in ("[ros]", "[leader.ros]", "[gateway.ros]"):
        assert table in page
