from random import Random

import pytest
from flockwire_core.domain.body import Body, BodyKind, Nearby
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import LEVEL, Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start
from flockwire_core.swarm.model import uav
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import APART, Reason, Report, Status
from flockwire_mocap.core import GatewayCore
from flockwire_mocap.tracking import ReportedBody, SourceState, TrackerFrame, unseen
from flockwire_twins.trackers.cameras import SimulatedSource

BEGAN = 1_790_000_000 * SECOND
FRAME = SECOND // 100
FAR = {i: (10.0 * i, 0.0, 1.0) for i in range(5)}


class Recording:
    """A source of some frames, whatever it receives."""

    triggers = frozenset({Key("truth", "uav1")})

    def __init__(self, *frames):
        self.frames, self.received, self.whole = list(frames), [], False

    def state(self, now):
        return SourceState("waits for the end")

    def receive(self, key, message, now):
        self.received.append(key)

    def complete(self):
        return self.whole

    def take(self, now):
        frames, self.frames = self.frames, []
        return frames


class ShownGateway:
    """A gateway that is shown bodies frame by frame."""

    def __init__(self, swarm):
        self.now, self.places = BEGAN, dict(FAR)
        self.core = GatewayCore(swarm, SimulatedSource(Start(Plan(swarm), "gateway", 0, Random(1))))

    def step(self, frames=1):
        """Show `frames` frames; returns what the last one made the gateway say."""
        published = []
        for _ in range(frames):
            self.now += FRAME
            for i, place in self.places.items():
                self.core.receive(Key("truth", uav(i)), Pose(self.now, "world", place), self.now)
            published = self.core.step(self.now)
        return dict(published)

    def near(self, i):
        return self.step()[Key("nearby", uav(i))].bodies


@pytest.fixture
def shown(make_swarm):
    """Return the builder of a gateway."""
    return lambda changes=None: ShownGateway(make_swarm(changes))


def test_every_drone_gets_its_pose_and_what_is_near(shown):
    published = shown().step()
    assert {key for key in published if key.kind == "pose"} == {Key("pose", uav(i)) for i in range(5)}
    assert {key for key in published if key.kind == "nearby"} == {Key("nearby", uav(i)) for i in range(5)}
    assert published[Key("pose", "uav2")].position == FAR[2]


def test_what_is_near_is_said_before_the_pose_that_makes_the_agent_step(shown):
    keys = list(shown().step())
    for i in range(5):
        assert keys.index(Key("nearby", uav(i))) < keys.index(Key("pose", uav(i)))


def test_a_pose_carries_the_stamp_of_its_exposure(shown):
    gateway = shown({"gateway.latency": 0.03})
    assert gateway.step(3) == {}
    published = gateway.step()
    assert {message.stamp for message in published.values()} == {gateway.now - 3 * FRAME}


def test_a_lost_body_is_silent_and_never_repeated(shown):
    gateway = shown()
    gateway.step()
    del gateway.places[2]
    for _ in range(5):
        published = gateway.step()
        assert not {key for key in published if key.owner == "uav2"}
        assert Key("pose", "uav3") in published


def test_a_body_that_was_dropped_is_silent_for_that_frame(shown):
    gateway = shown({"gateway.dropout": 0.5})
    counts = [len([key for key in gateway.step() if key.kind == "pose"]) for _ in range(400)]
    assert sum(counts) == pytest.approx(0.5 * 5 * 400, rel=0.1)


def test_near_is_only_what_is_within_the_sensing_radius(shown):
    gateway = shown({"avoidance.sensing_radius": 1.5})
    gateway.places = {
        **FAR,
        0: (0.5, 0.0, 1.0),
        1: (0.0, 0.0, 1.0),
        2: (1.4, 0.0, 1.0),
        3: (1.6, 0.0, 1.0),
        4: (1.0, 1.0, 2.0),
    }
    gateway.step()
    assert set(gateway.near(1)) == {
        Body(BodyKind.DRONE, (0.5, 0.0, 0.0), 0.0),
        Body(BodyKind.DRONE, (1.4, 0.0, 0.0), 0.0),
    }


def test_a_nearby_message_has_no_identities():
    assert set(Nearby.__slots__) == {"stamp", "frame", "bodies"}
    assert set(Body.__slots__) == {"kind", "relative_position", "radius", "velocity"}


def test_obstacles_are_near_by_their_surface_and_seen_along_their_axis(shown):
    far_and_near = [
        {"center": [12.0, 0.0, 0.0], "radius": 1.0, "height": 0.5},
        {"center": [14.0, 0.0, 0.0], "radius": 1.0},
    ]
    gateway = shown({"obstacles": far_and_near})
    assert gateway.near(1) == (Body(BodyKind.OBSTACLE, (2.0, 0.0, -0.5), 1.0),)


@pytest.mark.parametrize(("verb", "bodies"), [("prepare", 0), ("takeoff", 0), ("land", 1), ("hold", 1), ("start", 1)])
def test_a_body_that_is_lost_stays_near_until_an_order_to_take_off_leaves_it_out(shown, verb, bodies):
    gateway = shown()
    gateway.places = {**FAR, 1: (20.5, 0.0, 1.0)}
    assert [body.kind for body in gateway.step(2)[Key("nearby", "uav2")].bodies] == [BodyKind.DRONE]
    del gateway.places[1]
    gateway.step(105)
    assert [body.kind for body in gateway.near(2)] == [BodyKind.OBSTACLE]
    gateway.core.receive(MISSION, Mission(gateway.now, "world", verb, without=(1,)), gateway.now)
    assert len(gateway.near(2)) == bodies


def test_without_sensing_nothing_is_near(shown):
    assert {key.kind for key in shown({"avoidance.sensing": "neighbours"}).step()} == {"pose"}


def test_a_virtual_leader_has_no_body(shown):
    gateway = shown({"leader.kind": "virtual", "drones.0": None})
    del gateway.places[0]
    assert Key("pose", "uav0") not in gateway.step()
    assert gateway.core.triggers == {Key("truth", uav(i)) for i in range(1, 5)}


def test_a_tracked_leader_has_a_pose_and_is_near_the_drones_as_a_person(shown):
    gateway = shown({"leader.kind": "tracked", "drones.0.start": [0.0, 0.0, 1.2]})
    gateway.places[0] = (9.0, 0.3, 1.2)
    published = gateway.step(2)
    assert Key("pose", "uav0") in published
    assert Key("nearby", "uav0") not in published
    x, y, _ = published[Key("pose", "uav1")].position
    (person,) = [body for body in published[Key("nearby", "uav1")].bodies if body.kind is BodyKind.MOVER]
    px, py, _ = published[Key("pose", "uav0")].position
    assert person.radius == 0.4
    assert person.relative_position[:2] == pytest.approx((px - x, py - y))


def test_the_mission_is_repeated_unchanged_twice_a_second(shown):
    gateway, order = shown(), Mission(BEGAN, "world", "start", BEGAN + 5)
    gateway.core.receive(MISSION, order, BEGAN)
    repeats = [(gateway.now, published[MISSION]) for _ in range(350) if MISSION in (published := gateway.step())]
    assert [mission for _, mission in repeats] == [order._replace(number=1)] * 7
    assert [(at - BEGAN) // (SECOND // 2) for at, _ in repeats] == [0, 1, 2, 3, 4, 5, 6]


def test_the_newest_mission_is_the_one_repeated(shown):
    gateway, newest = shown(), Mission(BEGAN + 1, "world", "land")
    for order in (newest, Mission(BEGAN, "world", "start")):
        gateway.core.receive(MISSION, order, BEGAN)
    assert gateway.step()[MISSION] == newest._replace(number=1, downs=(newest.version,))


def test_it_reports_what_it_does_not_see(shown):
    gateway = shown()
    assert gateway.core.report(BEGAN).phase == "waiting"
    gateway.step()
    assert gateway.core.report(gateway.now).detail == ""
    del gateway.places[2]
    gateway.step(102)
    assert gateway.core.report(gateway.now).detail == "does not see uav2"
    assert gateway.core.report(gateway.now + 2 * SECOND).phase == "waiting"


def test_the_source_decides_when_a_frame_is_due_and_receives_all_messages(make_swarm):
    source = Recording()
    core = GatewayCore(make_swarm(), source)
    assert core.triggers == source.triggers
    for key, message in (
        (MISSION, Mission(BEGAN, "world", "takeoff")),
        (Key("truth", "uav1"), Pose(BEGAN, "", FAR[1])),
    ):
        core.receive(key, message, BEGAN)
    assert source.received == [MISSION, Key("truth", "uav1")]
    for source.whole in (False, True):
        assert core.due(Key("truth", "uav1")) == source.whole
    assert core.report(BEGAN).detail == "waits for the end"


def test_a_pose_carries_what_was_measured_with_stamps_that_differ(make_swarm):
    turned, level = (0.0, 0.6, 0.0, 0.8), (0.0, 0.0, 0.0, 1.0)
    seen = [(BEGAN - 3, uav(2), FAR[2], turned), (BEGAN, uav(1), FAR[1], level)]
    frames = [
        TrackerFrame(k, stamp, stamp, (ReportedBody(k, name, place, orientation, tracked=True),))
        for k, (stamp, name, place, orientation) in enumerate(seen)
    ]
    published = dict(GatewayCore(make_swarm(), Recording(*frames)).step(BEGAN))
    for stamp, name, place, orientation in seen:
        pose = published[Key("pose", name)]
        assert (pose.stamp, pose.position, pose.orientation) == (stamp, place, orientation)
        assert published[Key("nearby", name)].stamp == stamp


def test_a_body_that_the_tracker_does_not_see_has_no_pose_and_stands_nowhere(make_swarm):
    source = Recording()
    core = GatewayCore(make_swarm({"avoidance.sensing_radius": 2.0}), source)
    for k, tracked in enumerate((True, False)):
        bodies = (
            ReportedBody(1, uav(1), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), tracked=True),
            ReportedBody(2, uav(2), FAR[2], (0.0, 0.0, 0.0, 1.0), tracked),
            unseen(7, "Ada"),  # at the origin, 1 m below uav1
        )
        source.frames = [TrackerFrame(k, BEGAN + k * FRAME, BEGAN + k * FRAME, bodies)]
        published = dict(core.step(BEGAN + k * FRAME))
        assert {key.owner for key in published if key.kind == "pose"} == ({"uav1", "uav2"} if tracked else {"uav1"})
        assert published[Key("nearby", "uav1")].bodies == ()


def test_when_one_drones_truth_ends_the_others_poses_continue_at_the_full_rate(shown):
    gateway, frames = shown(), []
    for k in range(60):
        gateway.now += FRAME
        for i, place in gateway.places.items():
            if i != 4 or k < 10:
                gateway.core.receive(Key("truth", uav(i)), Pose(gateway.now, "world", place), gateway.now)
                if gateway.core.due(Key("truth", uav(i))):
                    frames.append((k, {key.owner for key, _ in gateway.core.step(gateway.now) if key.kind == "pose"}))
    others = {uav(i) for i in range(4)}
    assert frames[:10] == [(k, others | {"uav4"}) for k in range(10)]
    assert frames[-46:] == [(k, others) for k in range(14, 60)]


def test_a_body_that_gets_its_name_late_is_one_body(make_swarm):
    """Its number alone was a body of its own, which then was lost: a space that grew to 1.4 m around what is seen."""
    source = Recording()
    core = GatewayCore(make_swarm({"avoidance.sensing_radius": 2.0}), source)
    for k in range(50):
        bodies = (
            ReportedBody(1, uav(1), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), tracked=True),
            ReportedBody(9, "pole" if k else "", (1.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), tracked=True),
        )
        source.frames = [TrackerFrame(k, BEGAN + k * FRAME, BEGAN + k * FRAME, bodies)]
        published = dict(core.step(BEGAN + k * FRAME))
        assert [body.kind for body in published[Key("nearby", "uav1")].bodies] == [BodyKind.MOVER]


def strayed(gateway, drone, *, apart=True):
    """Let the pilot of `drone` report whether its poses are its own."""
    reasons = (Reason(APART, "the tracker's pose is not its own"),) if apart else ()
    report = Report("hold", pose_age=0.25, position=(10.0 * drone, 0.0, 1.0), reasons=reasons)
    pilot = uav(drone) if drone else "leader"
    status = Status(gateway.now, "world", pilot, report, 0, 0, 0, 0, 0, 0.0, 0, (), ())
    gateway.core.receive(Key("status", pilot), status, gateway.now)


def test_a_drone_whose_poses_are_not_its_own_is_where_it_was_and_its_name_is_a_body_too(shown):
    gateway = shown()
    gateway.step()
    gateway.places |= {1: (10.6, 0.0, 1.0), 2: (11.0, 0.0, 1.0)}  # its name is at 11.0, beside drone 1
    gateway.step()
    assert [body.kind for body in gateway.near(1)] == [BodyKind.DRONE]
    strayed(gateway, 2)
    gateway.places[1] = (19.0, 0.0, 1.0)
    lost = gateway.near(1)
    assert [(body.kind, round(body.relative_position[0], 6)) for body in lost] == [(BodyKind.OBSTACLE, 1.0)]
    gateway.places[1] = (10.6, 0.0, 1.0)
    assert [(body.kind, round(body.relative_position[0], 6)) for body in gateway.near(1)] == [(BodyKind.MOVER, 0.4)]
    assert gateway.core.report(gateway.now).detail == "the poses of uav2 are not their own: land, examine their bodies"
    strayed(gateway, 2, apart=False)
    assert [body.kind for body in gateway.near(1)] == [BodyKind.DRONE]
    assert gateway.core.report(gateway.now).detail == ""


def test_a_whole_frame_that_jumps_is_one_event(shown):
    gateway = shown()
    gateway.step()
    for drone in range(5):
        strayed(gateway, drone)
    gateway.step()
    assert gateway.core.report(gateway.now).detail.startswith("no pose is its drone's: was the tracker's frame defined")


def test_a_name_on_another_drones_body_is_no_second_body(shown):
    gateway = shown()
    gateway.step()
    gateway.places |= {1: (0.0, 0.0, 1.0), 2: (0.0, 0.0, 1.0), 0: (0.5, 0.0, 1.0)}
    for _ in range(2):
        assert [body.relative_position for body in gateway.near(1)] == [(0.5, 0.0, 0.0)]
        strayed(gateway, 2)
    assert [body.kind for body in gateway.near(0)] == [BodyKind.DRONE]


@pytest.mark.parametrize("name", ["number 7", "said to be the leader's", "said to be drone 2's"])
def test_a_body_may_have_any_name(make_swarm, name):
    (one, other) = (ReportedBody(7, called, (x, 0.0, 1.0), LEVEL, True) for called, x in ((None, 0.5), (name, 1.0)))
    source = Recording(TrackerFrame(0, BEGAN, BEGAN, (one, other._replace(identity=8))))
    core = GatewayCore(make_swarm(), source)
    core.step(BEGAN)
    detail = core.report(BEGAN + 2 * SECOND).detail
    core._last_frame = BEGAN + 2 * SECOND
    detail = core.report(BEGAN + 2 * SECOND).detail
    assert f"but {name!r}, number 7: rename there" in detail
    source.frames = [
        TrackerFrame(1, BEGAN + FRAME, BEGAN + FRAME, (ReportedBody(7, "box", (0.5, 0.0, 1.0), LEVEL, True),))
    ]
    core.step(BEGAN + FRAME)
    assert set(core._field.others) == {name, "box"}
