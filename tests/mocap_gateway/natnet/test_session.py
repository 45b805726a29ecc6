import pytest
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.gateway import NatNet
from flockwire_mocap.natnet.packets import Kind, MocapFrame, ServerInfo, encode, encode_command, encode_connect
from flockwire_mocap.natnet.session import MODEL_PAUSE, PERIOD, NatNetSession
from flockwire_mocap.natnet.source import trouble
from flockwire_mocap.tracking import ReportedBody
from flockwire_twins.trackers.natnet import encode_frame, encode_model, encode_server_info

SERVER = "10.0.0.1"
INFO = ServerInfo("Motive", (3, 1, 0, 0), (4, 1, 0, 0), 10_000_000, 1511, False, "239.255.42.99")
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
GREETING, KEEP_ALIVE = encode_connect(), encode(Kind.KEEP_ALIVE)
MODEL_REQUEST = encode(Kind.REQUEST_MODEL)


def body(identity=7, *, position=(1.0, 2.0, 3.0), orientation=UPRIGHT, tracked=True):
    return ReportedBody(identity, None, position, orientation, tracked)


def frame(number=1, *bodies, version=(4, 1), parameters=0, ticks=(1000, 3000), timestamp=12.5):
    return encode_frame(MocapFrame(number, bodies or (body(),), timestamp, *ticks, parameters), version)


def session(info=INFO, **options):
    made = NatNetSession(NatNet(server=SERVER, **options))
    if info is not None:
        made.receive(encode_server_info(info), SERVER, 0)
    return made


def test_it_greets_once_a_second_until_it_is_answered():
    asking = session(info=None)
    greeted = [now for now in range(0, 5 * SECOND, SECOND // 10) if asking.requests(now) == [GREETING]]
    assert greeted == [0, SECOND, 2 * SECOND, 3 * SECOND, 4 * SECOND]
    asking.receive(encode_server_info(INFO), SERVER, 5 * SECOND)
    assert GREETING not in asking.requests(5 * SECOND)


def test_in_unicast_it_keeps_the_connection_alive():
    living = session(request_model=False)
    sent = []
    for now in range(0, 10 * SECOND, SECOND // 10):
        living.receive(frame(now // (SECOND // 10)), SERVER, now)
        sent += living.requests(now)
    assert sent == [KEEP_ALIVE] * 10


def test_in_multicast_it_need_not():
    info = INFO._replace(multicast=True)
    assert session(info, multicast=True, request_model=False).requests(0) == []


def test_it_greets_a_silent_server_again():
    lost = session(request_model=False)
    assert GREETING not in lost.requests(3 * SECOND)
    assert GREETING in lost.requests(3 * SECOND + 1)


def test_it_asks_for_names_a_few_times_only():
    asking = session()
    sent = [request for now in range(0, 20 * SECOND, SECOND // 10) for request in asking.requests(now)]
    masked = encode(Kind.REQUEST_MODEL, b"\x02\0\0\0")
    assert [request for request in sent if request[0] == Kind.REQUEST_MODEL] == [MODEL_REQUEST, masked, MODEL_REQUEST]


def test_it_asks_for_names_again_when_the_models_have_changed():
    told = session()
    told.requests(0)
    told.receive(encode_model({7: "one"}, (4, 1)), SERVER, 1)
    assert MODEL_REQUEST not in told.requests(10 * SECOND)
    told.receive(frame(1, parameters=2), SERVER, 10 * SECOND)
    assert MODEL_REQUEST in told.requests(10 * SECOND)


def test_poses_come_by_number_without_a_model_and_by_name_with_one():
    told = session()
    assert told.receive(frame(1), SERVER, 0).bodies[0].fields()[:2] == (7, None)
    told.receive(encode_model({7: "one"}, (4, 1)), SERVER, 0)
    assert told.receive(frame(2), SERVER, 0).bodies[0].fields()[:2] == (7, "one")


def test_stamps_are_in_ns_of_the_ticks_clock():
    seen = session().receive(frame(ticks=(10_000_000, 10_070_000)), SERVER, 0)
    assert (seen.captured, seen.transmitted) == (SECOND, SECOND + 7_000_000)


@pytest.mark.parametrize("mid_exposure", [0, 4000])
def test_a_capture_time_that_is_not_known_is_the_time_of_sending(mid_exposure):
    seen = session().receive(frame(ticks=(mid_exposure, 3000)), SERVER, 0)
    assert seen.captured == seen.transmitted == 300_000


@pytest.mark.parametrize("seconds", [float("nan"), float("inf"), 1e300])
def test_without_ticks_the_time_stamp_serves(seconds):
    assert session().receive(frame(ticks=(0, 0)), SERVER, 0).captured == 12_500_000_000
    assert session().receive(frame(ticks=(0, 0), timestamp=seconds), SERVER, 0).captured == 0


def test_frames_of_others_are_dropped_and_counted():
    guarded = session()
    assert guarded.receive(frame(), "10.0.0.66", 0) is None
    assert (guarded.counts["packets of others"], guarded.foreign) == (1, "10.0.0.66")


def test_missing_repeated_and_late_frames_are_counted():
    counting = session()
    passed = [n for n in (1, 2, 2, 5, 4, 4, 6) if counting.receive(frame(n), SERVER, 0) is not None]
    assert passed == [1, 2, 5, 6]
    assert counting.counts == {"frames missing": 1, "frames repeated": 2, "frames late": 1}


def test_malformed_packets_are_counted_and_change_nothing():
    counting = session()
    assert counting.receive(frame()[:50], SERVER, 0) is None
    assert counting.counts["packets malformed"] == 1
    assert counting.receive(frame(), SERVER, 0) is not None


@pytest.mark.parametrize(
    "pose",
    [
        {"orientation": (0.0, 0.0, 0.0, 0.0)},
        {"orientation": (1.0, 0.0, 0.0, 1.0)},
        {"orientation": (0.0, 0.0, float("nan"), 1.0)},
        {"position": (0.0, float("nan"), 0.0)},
        {"position": (0.0, float("inf"), 0.0)},
    ],
)
def test_what_cannot_be_a_pose_is_not_tracked(pose):
    guarded = session()
    assert not guarded.receive(frame(1, body(**pose)), SERVER, 0).bodies[0].tracked
    assert guarded.counts["poses rejected"] == 1


def test_a_lost_body_is_not_tracked():
    guarded = session()
    lost = body(position=(0.0, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 0.0), tracked=False)
    assert not guarded.receive(frame(1, lost), SERVER, 0).bodies[0].tracked
    assert guarded.counts["poses rejected"] == 0


def test_an_older_bitstream_is_asked_for_and_read_once_granted():
    choosy = session(bitstream="3.0", request_model=False)
    assert encode_command("Bitstream,3.0") in choosy.requests(0)
    assert choosy.version == (4, 1)
    choosy.receive(encode(Kind.RESPONSE, bytes(4)), SERVER, 0)
    assert choosy.version == (3, 0)
    assert choosy.receive(frame(1, version=(3, 0)), SERVER, 0) is not None
    assert encode_command("Bitstream,3.0") not in choosy.requests(5 * SECOND)


def test_a_refused_bitstream_is_not_read():
    choosy = session(bitstream="3.0")
    choosy.receive(encode(Kind.RESPONSE, b"\x01\0\0\0"), SERVER, 0)
    choosy.receive(encode(Kind.RESPONSE, b"Bitstream,4.1\0"), SERVER, 0)
    assert choosy.version == (4, 1)


def test_in_multicast_the_bitstream_that_is_set_is_read_without_any_answer():
    deaf = session(info=None, multicast=True, bitstream="4.1")
    assert deaf.receive(frame(), SERVER, 0) is not None


NAMES = {1: "uav1", 2: "uav2"}
AT = 100 * SECOND


class Motive:
    """A server of bodies with these `names`, whose client is examined; time passes by frames of 10 ms."""

    def __init__(self, names=NAMES, **options):
        self.names, self.number, self.now, self.asked = dict(names), 0, AT, 0
        self.client = NatNetSession(NatNet(server=SERVER, **options), NAMES.values())
        self.client.receive(encode_server_info(INFO), SERVER, self.now)

    def passes(self, seconds, *, parameters=0, answers=True, streams=True, lost=False):
        """Stream frames, and return the names in the newest; only the first frame has the `parameters`."""
        seen = None
        for k in range(round(100 * seconds)):
            self.now += SECOND // 100
            self.number += 1
            for request in self.client.requests(self.now):
                is_asked = request[0] == Kind.REQUEST_MODEL
                self.asked += is_asked
                if is_asked and answers:
                    model = encode_model(self.names, (4, 1))
                    self.client.receive(model, SERVER, self.now)
            if streams and not (lost and k == 0):
                sent = frame(self.number, *map(body, self.names), parameters=parameters if k == 0 else 0)
                got = self.client.receive(sent, SERVER, self.now)
                seen = {one.identity: one.name for one in got.bodies} if got is not None else seen
        return seen


NEXT_ASKED = (PERIOD + MODEL_PAUSE) / SECOND + 0.1


@pytest.mark.parametrize("silent", [0.0, 8.0])
def test_after_a_restart_no_body_has_a_name_until_the_names_have_come_again(silent):
    motive = Motive()
    assert motive.passes(10.0) == NAMES
    motive.passes(silent, streams=False, answers=False)
    motive.names, motive.number = {1: "uav2", 2: "uav1"}, 0
    assert motive.passes(0.03, answers=False) == {1: None, 2: None}
    assert motive.passes(1.1) == motive.names


def test_a_server_with_other_properties_is_another_server():
    motive = Motive()
    motive.passes(10.0)
    motive.client.receive(encode_server_info(INFO._replace(name="another")), SERVER, motive.now)
    assert motive.client.names == {}
    motive.passes(0.1)
    motive.client.receive(encode_server_info(INFO._replace(name="another")), SERVER, motive.now)
    assert motive.client.names == NAMES  # the answer to another greeting


@pytest.mark.parametrize("before", [{1: "uav1", 2: "Rigid Body 2"}, {1: "uav1"}, {}])
def test_names_are_requested_again_while_a_drones_body_is_missing(before):
    motive = Motive(before)
    motive.passes(60.0)
    assert 10 <= motive.asked <= 13  # every few seconds
    motive.names = dict(NAMES)
    assert motive.passes(NEXT_ASKED) == NAMES
    asked = motive.asked
    motive.passes(60.0)
    assert motive.asked == asked


def test_a_number_without_a_name_and_a_frame_that_was_lost_request_names_again():
    motive = Motive()
    motive.passes(10.0)
    motive.names[7] = "person"
    assert motive.passes(1.0)[7] == "person"
    motive.names = {1: "uav2", 2: "uav1"}  # the frame with the mark is lost
    assert motive.passes(NEXT_ASKED, lost=True) == motive.names


def test_a_server_that_does_not_answer_is_asked_a_few_times_only():
    motive = Motive()
    assert motive.passes(60.0, answers=False) == {1: None, 2: None}
    assert motive.asked == 3
    never = Motive(request_model=False)
    never.passes(60.0, parameters=2)
    assert never.asked == 0


def spoken(found):
    assert found is not None
    assert "\n" not in found
    return found


def test_troubles_name_cause_and_remedy():
    assert "firewall" in spoken(trouble(session(info=None), 0))
    assert "multicast = true" in spoken(trouble(session(INFO._replace(multicast=True)), 0))
    assert "multicast = false" in spoken(trouble(session(multicast=True), 0))
    assert "2.9" in spoken(trouble(session(INFO._replace(natnet_version=(2, 9, 0, 0))), 0))
    assert "live mode" in spoken(trouble(session(), 0))
    assert "interface" in spoken(trouble(session(INFO._replace(multicast=True), multicast=True), 0))


def test_troubles_with_what_comes():
    odd = session()
    odd.receive(frame()[:60], SERVER, 0)
    assert "bitstream" in spoken(trouble(odd, 0))
    other = session(info=None)
    other.receive(frame(), "10.0.0.9", 0)
    assert "10.0.0.9" in spoken(trouble(other, 0))
    bare = session()
    bare.receive(encode_frame(MocapFrame(1, (), 0.0, 1, 3, 0), (4, 1)), SERVER, 0)
    assert "Rigid Bodies" in spoken(trouble(bare, 0))
    bare.receive(frame(2), SERVER, 0)
    assert trouble(bare, 0) is None


def test_a_stream_that_has_ended_has_its_trouble_too():
    motive = Motive()
    motive.passes(2.0)
    assert trouble(motive.client, motive.now + 2 * SECOND) is None  # nothing is known yet
    assert "no answer from" in spoken(trouble(motive.client, motive.now + 9 * SECOND))
    motive.client.receive(encode_server_info(INFO), SERVER, motive.now + 8 * SECOND)
    assert "live mode" in spoken(trouble(motive.client, motive.now + 9 * SECOND))
    motive.now += 10 * SECOND
    motive.number = 2000
    motive.passes(0.1)
    assert trouble(motive.client, motive.now) is None
