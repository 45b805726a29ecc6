from collections import Counter
from random import Random
from struct import pack

import pytest
from flockwire_mocap.vrpn.connection import (
    COOKIE,
    MOST_NAMES,
    PING,
    SENDER,
    TYPE,
    PoseBody,
    VrpnConnection,
    VrpnMessage,
    encode,
    encode_description,
    encode_pose,
)
from flockwire_mocap.vrpn.source import SET_BACK, Reports

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
POSE = PoseBody(0, (1.0, 2.0, 3.0), UPRIGHT)
STAMP = 1_700_000_000_000_000_000


def reports(count=20):
    """The bytes of a server that reports two bodies by turns."""
    server = VrpnConnection()
    for k in range(count):
        server.send_pose(f"uav{k % 2}", STAMP + k * 1000, PoseBody(0, (float(k), 0.0, 0.0), UPRIGHT))
    return server.outgoing()


def test_poses_with_names():
    poses = VrpnConnection().receive(reports())
    assert [pose.name for pose in poses] == ["uav0", "uav1"] * 10
    assert [pose.pose.position[0] for pose in poses] == [float(k) for k in range(20)]
    assert [pose.stamp for pose in poses] == [STAMP + k * 1000 for k in range(20)]


@pytest.mark.parametrize("seed", range(5))
def test_bytes_may_be_cut_anywhere(seed):
    data, dice, connection, poses = reports(), Random(seed), VrpnConnection(), []
    while data:
        size = dice.choice([1, 7, 24, 100])
        poses += connection.receive(data[:size])
        data = data[size:]
    assert len(poses) == 20


def test_numbers_are_those_of_the_other_side():
    connection = VrpnConnection()
    connection.receive(COOKIE + encode_description(TYPE, 40, "vrpn_Tracker Pos_Quat"))
    connection.receive(encode_description(SENDER, 17, "wand"))
    (pose,) = connection.receive(encode(VrpnMessage(STAMP, 17, 40, encode_pose(POSE))))
    assert (pose.name, pose.pose) == ("wand", POSE)


def test_what_was_never_described_is_counted():
    connection = VrpnConnection()
    connection.receive(COOKIE + encode(VrpnMessage(STAMP, 17, 40, encode_pose(POSE))))
    assert connection.counts == {"messages undescribed": 1}


def test_a_ping_is_answered_with_a_pong_of_the_same_sender():
    asked = VrpnConnection()
    named = encode_description(SENDER, 3, "uav1") + encode_description(TYPE, 5, PING)
    asked.receive(COOKIE + named + encode(VrpnMessage(STAMP, 3, 5, b"")))
    answer = asked.outgoing()
    assert encode_description(SENDER, 0, "uav1") in answer
    assert answer.endswith(encode(VrpnMessage(STAMP, 0, 2, b"")))  # 2: the third type that a side describes, the pong
    assert (asked.counts, asked.failed) == ({}, None)


@pytest.mark.parametrize("greeting", [b"HTTP/1.1 400 Bad Request", b"vrpn: ver. 06.10  0".ljust(24, b"\0")])
def test_another_protocol_or_major_version_fails(greeting):
    connection = VrpnConnection()
    assert connection.receive(greeting) == []
    assert "not VRPN 7" in connection.failed
    assert connection.receive(reports()) == []


def test_another_minor_version_does_not():
    connection = VrpnConnection()
    assert len(connection.receive(b"vrpn: ver. 07.33  0".ljust(24, b"\0") + reports()[24:])) == 20


def test_after_nonsense_all_before_it_counts():
    connection = VrpnConnection()
    assert len(connection.receive(reports() + b"\xff" * 24)) == 20
    assert connection.failed == "a message of 4294967295 bytes"


@pytest.mark.parametrize("orientation", [(0.0, 0.0, 0.0, 0.0), (float("nan"), 0.0, 0.0, 1.0)])
def test_what_cannot_be_a_pose_is_counted(orientation):
    server, client = VrpnConnection(), VrpnConnection()
    server.send_pose("uav1", STAMP, PoseBody(0, (1.0, 2.0, 3.0), orientation))
    assert client.receive(server.outgoing()) == []
    assert client.counts == {"poses rejected": 1}


def test_names_are_limited():
    connection = VrpnConnection()
    connection.receive(COOKIE + b"".join(encode_description(SENDER, k, f"s{k}") for k in range(MOST_NAMES + 5)))
    assert (len(connection.senders), connection.counts["messages malformed"]) == (MOST_NAMES, 5)


def test_short_bodies_are_counted():
    connection = VrpnConnection()
    connection.receive(reports(1))
    connection.receive(encode(VrpnMessage(STAMP, 0, 0, pack(">i", 1))) + encode(VrpnMessage(0, 9, SENDER, b"")))
    assert connection.counts == {"messages malformed": 2}


def test_reports_become_frames_of_one_body():
    gathered = Reports(Counter())
    frames = [gathered.frame(pose) for pose in VrpnConnection().receive(reports(4))]
    assert [(frame.number, frame.captured, frame.bodies[0].identity, frame.bodies[0].name) for frame in frames] == [
        (k + 1, STAMP + k * 1000, k % 2, f"uav{k % 2}") for k in range(4)
    ]


def test_repeated_and_late_reports_are_dropped_and_counted():
    gathered = Reports(counts := Counter())
    first, second, third, fourth = VrpnConnection().receive(reports(4))
    order = [third, third, first, fourth, second, fourth]
    assert [gathered.frame(pose) is not None for pose in order] == [True, False, False, True, False, False]
    assert (gathered.frames, counts) == (2, {"reports repeated": 2, "reports late": 2})


def test_a_clock_set_back_restarts_and_sensors_are_bodies_of_their_own():
    gathered = Reports(Counter())
    pose = VrpnConnection().receive(reports(1))[0]
    assert gathered.frame(pose) is not None
    assert gathered.frame(pose._replace(stamp=STAMP - 11_000_000_000)) is not None
    other = gathered.frame(pose._replace(pose=POSE._replace(sensor=3)))
    assert (other.bodies[0].identity, other.bodies[0].name) == (1, "uav0/3")


@pytest.mark.parametrize("back", [1_000_000, 300_000_000, 9_000_000_000])
def test_several_older_reports_in_a_row_come_from_a_clock_set_back(back):
    gathered = Reports(counts := Counter())
    first, *rest = [pose for pose in VrpnConnection().receive(reports(40)) if pose.name == "uav0"]
    assert not gathered.frame(first).set_back
    frames = [gathered.frame(pose._replace(stamp=pose.stamp - back)) for pose in rest[: SET_BACK + 2]]
    assert [frame is not None and frame.set_back for frame in frames] == [False] * (SET_BACK - 1) + [True, False, False]
    assert [frame is None for frame in frames] == [True] * (SET_BACK - 1) + [False] * 3
    assert counts["reports late"] == SET_BACK - 1


def test_older_reports_between_newer_ones_stay_late():
    gathered = Reports(Counter())
    new = VrpnConnection().receive(reports(40))[::2]
    frames = [gathered.frame(pose._replace(stamp=at)) for pose in new for at in (pose.stamp, pose.stamp - 500)]
    assert [frame is not None for frame in frames] == [True, False] * len(new)
    assert not any(frame.set_back for frame in frames if frame is not None)
