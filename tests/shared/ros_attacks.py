"""What an attacker on the ROS side does, with a bare session: none of it may have an effect."""

from __future__ import annotations

import zenoh
from flockwire_core import clock
from flockwire_core.domain.airframe import Steer
from flockwire_core.ros.graph import data_key
from flockwire_core.wire.codec import encode
from flockwire_core.wire.keys import key_text
from flockwire_core.wire.plan import Plan
from flockwire_operator.ros.topics import SIM_CLOCK
from ros_graph import ATTACHMENT

GOOD = ATTACHMENT.pack(1, 1, 16, bytes(16))


def attack(session: zenoh.Session, plan: Plan) -> None:
    """Do from the ROS side what must have no effect."""
    empty = b"\0\1\0\0\0"
    for key in plan.keys:  # the swarm's own keys, in the ROS graph
        for name in (key_text("paper", key), f"0/{key_text('paper', key)}"):
            session.put(name, b"\0\1\0\0" + bytes(80), attachment=GOOD)
    stop = data_key(0, "/paper/stop", "std_srvs/srv/Trigger")
    requests: list[tuple[bytes | None, bytes | None]] = [
        (empty, GOOD), (None, None), (b"x" * 100, GOOD), (empty, GOOD[:-1]), (bytes(20000), GOOD),
        (empty, GOOD + b"x"), (empty, bytes(77)), (empty, bytes(60000)), (empty, b"\xff" * 33), (empty[:3], GOOD),
    ]  # fmt: skip
    for payload, attached in requests:
        list(session.get(stop, payload=payload, attachment=attached, timeout=2.0))
    list(session.get("0/paper/**", payload=empty, attachment=GOOD, timeout=2.0))
    list(session.get("**", payload=empty, attachment=GOOD, timeout=2.0))
    for other in (data_key(1, "/paper/stop", "std_srvs/srv/Trigger"), stop[:-1], stop.replace("Trigger", "SetBool")):
        assert not list(session.get(other, payload=empty, attachment=GOOD, timeout=2.0))
    for name in ("x" * 2000, "\N{SNOWMAN}", "\x1b[2J", "n/%t/T/H/Q/more"):
        session.liveliness().declare_token(f"@ros2_lv/0/s/0/1/MP/%/%/{name}").undeclare()
    for _ in range(200):
        session.get(stop, payload=empty, attachment=GOOD, timeout=2.0)
    session.put(data_key(0, SIM_CLOCK.name, SIM_CLOCK.ros_type), bytes(60000), attachment=bytes(60000))
    session.put("0/tf/tf2_msgs::msg::dds_::TFMessage_/x", bytes(60000))


def steer_wrongly(session: zenoh.Session, key: str) -> dict[str, int]:
    """Publish on the leader's topic `key`, and on others, what must not move it; return what is counted."""
    good = encode(Steer(clock.now(), "world", (0.3, 0.0, 0.0)))
    for other in (
        f"1{key[1:]}",
        key[:-1],
        key.replace("Twist", "Pose"),
        "paper/uav0/steering",
        "0/paper/uav0/steering",
    ):
        session.put(other, good, attachment=GOOD)
    for attached in (None, b"", GOOD[:-1], GOOD + b"x", bytes(77), b"\xff" * 33):
        session.put(key, good, attachment=attached)
    for payload, attached in ((bytes(20000), GOOD), (good, bytes(20000))):
        session.put(key, payload, attachment=attached)
    for payload in (b"", b"x" * 80, good[:-1], good.replace(b"world", b"wor\xff\xff")):
        session.put(key, payload, attachment=GOOD)
    session.put(key, encode(Steer(clock.now(), "base_link", (0.3, 0.0, 0.0))), attachment=GOOD)
    session.put(key, encode(Steer(clock.now(), "world", (1e308, 0.0, 0.0))), attachment=GOOD)
    return {
        "ROS messages malformed": 6, "ROS messages too large": 2, "ROS steering malformed": 4,
        "ROS steering of another frame": 1, "ROS steering out of range": 1,
    }  # fmt: skip
