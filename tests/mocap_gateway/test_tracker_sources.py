"""What the gateway reports of a tracker that does not deliver, and what it gets from one that does: no sockets."""

import pytest
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.swarm.model import uav
from flockwire_core.wire.keys import Key
from flockwire_mocap.core import make_core
from flockwire_mocap.natnet.packets import Kind
from flockwire_mocap.tracking import ReportedBody, TrackerFrame
from flockwire_mocap.vrpn.connection import PoseBody, VrpnConnection
from flockwire_mocap.vrpn.source import SET_BACK
from flockwire_twins.trackers.core import TwinCore
from flockwire_twins.trackers.natnet import Connect, NatNetTwin, announced, parse_request

NOW = 1_790_000_000 * SECOND
FRAME = SECOND // 100
PLACES = {i: (1.0 * i, 2.0, 1.0) for i in range(5)}
LEVEL = (0.0, 0.0, 0.0, 1.0)
ALIGNED = {"rotation": [0.0, 0.0, 0.6, 0.8], "offset": [1.0, -2.0, 0.5]}


def truths(core, now, places=PLACES):
    for i, place in places.items():
        core.receive(Key("truth", uav(i)), Pose(now, "world", place, (0.0, 0.0, 0.6, 0.8)), now)
    return core.due(Key("truth", "uav4"))


def converse(start, frames=3, named=True, twin=None, **gateway):
    """Let a twin serve `frames` frames to a NatNet gateway in virtual time; returns the gateway's core."""
    begun = start("tracker-sim", source="natnet", twin=twin or {}, **gateway)
    simulated, core = TwinCore(begun), make_core(start(source="natnet", twin=twin or {}, **gateway))
    session, server = (
        core.source.session,
        NatNetTwin(announced((4, 1) if named else (4, 5)), simulated.names if named else {}),
    )
    sent = []
    simulated.serve(sent.append)
    for k in range(frames):
        now = NOW + k * FRAME
        for request in session.requests(now):
            answer = server.receive(request, ("127.0.0.1", 5000), now)
            if answer is not None:
                session.receive(answer, "127.0.0.1", now)
        assert truths(simulated, now)
        simulated.step(now)
        for frame in sent:
            for datagram, _ in server.datagrams(frame, now):
                arrived = session.receive(datagram, "127.0.0.1", now)
                if arrived is not None:
                    core.source.arrived(arrived, now)
        sent.clear()
    return core, now


def test_a_flight_is_the_same_through_the_trackers_axes_unit_and_clock(start):
    core, now = converse(start, **ALIGNED)
    assert core.source.complete()
    published = dict(core.step(now))
    for i, place in PLACES.items():
        pose = published[Key("pose", uav(i))]
        assert pose.position == pytest.approx(place, abs=1e-6)
        assert pose.orientation == pytest.approx((0.0, 0.0, 0.6, 0.8), abs=1e-6)
        assert pose.stamp == pytest.approx(now, abs=200)  # ticks of 100 ns
    assert core.report(now).phase == "tracking"


def test_a_latency_is_in_the_stamp(start):
    core, now = converse(start, frames=5, latency=0.02)
    for _, message in core.step(now):
        assert message.stamp == pytest.approx(now - 2 * FRAME, abs=200)


def test_renamed_bodies_are_named_with_the_remedy(start):
    core, now = converse(start, twin={"renamed": {"uav2": "Body 7"}})
    core.step(now)
    later = now + 2 * SECOND
    core.source.arrived(TrackerFrame(99, 5, 5, (ReportedBody(2, "Body 7", (0.0, 0.0, 0.0), LEVEL, True),)), later)
    core.step(later)
    assert "no body 'uav2', but 'Body 7'" in core.report(later).detail


def test_bodies_without_names_are_found_by_their_numbers(start):
    numbered = {f"drones.{i}.body": i for i in range(5)}
    core, now = converse(lambda *a, **k: start(*a, changes=numbered, **k), named=False)
    assert {key.owner for key, _ in core.step(now) if key.kind == "pose"} == {uav(i) for i in PLACES}


def test_a_natnet_server_that_is_not_there_is_a_line_with_a_remedy_within_three_seconds(start):
    core = make_core(start(source="natnet"))
    (request,) = core.source.session.requests(NOW)
    assert parse_request(request) == Connect()
    assert request[0] == Kind.CONNECT
    report = core.report(NOW + 2 * SECOND)
    assert report.phase == "waiting"
    assert "no answer from 127.0.0.1:1510: check its address and command port" in report.detail


def test_a_stream_that_ends_is_reported(start):
    core, now = converse(start)
    core.step(now)
    assert core.report(now + 2 * SECOND).phase == "waiting"
    assert "still stream?" in core.report(now + 2 * SECOND).detail


def test_vrpn_reports_complete_a_frame_with_the_last_drone(start):
    core, server = make_core(start(source="vrpn", **ALIGNED)), VrpnConnection()
    core.source.failure = ""
    for i, place in PLACES.items():
        server.send_pose(uav(i), NOW, PoseBody(0, place, LEVEL))
        core.source.read(server.outgoing(), NOW + 1)
        assert core.source.complete() == (i == 4)
    published = core.step(NOW + 1)
    assert [key.owner for key, _ in published if key.kind == "pose"] == [uav(i) for i in PLACES]


@pytest.mark.parametrize("back", [0.05, 0.3, 0.9, 5.0])
def test_a_vrpn_servers_clock_that_is_set_back_keeps_all_poses(start, back):
    core, server = make_core(start(source="vrpn")), VrpnConnection()
    ages = []
    for k in range(400):
        now = NOW + k * FRAME
        for i, place in PLACES.items():
            stamp = now - (nanoseconds(back) if k >= 200 else 0)
            server.send_pose(uav(i), stamp, PoseBody(0, (place[0] + k * 1e-3, *place[1:]), LEVEL))
            core.source.read(server.outgoing(), now)
        ages += [now - message.stamp for key, message in core.step(now) if key.kind == "pose"]
    assert len(ages) == len(PLACES) * (400 - SET_BACK + 1)
    assert max(ages) == 0
    assert dict(core.source.state(now).counts) == {
        "reports late": len(PLACES) * (SET_BACK - 1),
    } | {f"steps of the clock of {uav(i)}": 1 for i in PLACES}


@pytest.mark.parametrize(
    ("described", "line"), [([], "describes no tracker"), (["Body 1"], "describes Body 1, but reports no pose")]
)
def test_a_vrpn_server_without_poses_is_a_line(start, described, line):
    core, server = make_core(start(source="vrpn")), VrpnConnection()
    for name in described:
        server.describe(name)
    core.source.failure = ""
    core.source.read(server.outgoing(), NOW)
    assert line in core.report(NOW + 2 * SECOND).detail


@pytest.mark.parametrize(
    ("gateway", "line"),
    [
        ({"natnet": {"server": "motive"}}, "gateway.natnet.server = 'motive': must be an IPv4 address of one host"),
        ({"natnet": {"group": "10.0.0.1"}}, "gateway.natnet.group = '10.0.0.1': must be a multicast address"),
        ({"natnet": {"bitstream": "2.9"}}, "gateway.natnet.bitstream = '2.9': must be a version of NatNet"),
        ({"rotation": [0.0, 0.0, 0.0, 2.0]}, "must be a unit quaternion"),
        ({"rotation": [0.0, 0.0, 0.0, 0.0]}, "must be a unit quaternion"),
    ],
)
def test_bad_tables_are_refused_in_one_line(make_swarm, gateway, line):
    with pytest.raises(ValueError, match=r"gateway\.") as refused:
        make_swarm({"gateway": gateway})
    assert line in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_one_body_is_of_one_drone(make_swarm):
    with pytest.raises(ValueError, match=r"drones\.2\.body = 'uav1': drone 1 has this body"):
        make_swarm({"drones.2.body": "uav1"})


def test_a_body_whose_name_comes_later_is_no_person_beside_itself(start):
    core = make_core(start(source="natnet"))
    place = ReportedBody(1, None, (0.0, 1.0, 0.0), LEVEL, True)
    for k, name in enumerate((None, "uav1")):
        now = NOW + k * FRAME
        core.source.arrived(TrackerFrame(k, k * FRAME, k * FRAME, (place._replace(name=name),)), now)
        published = dict(core.step(now))
    assert published[Key("nearby", "uav1")].bodies == ()
