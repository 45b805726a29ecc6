import tracemalloc

import pytest
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, TimeReply, TimeRequest, nanoseconds
from flockwire_core.wire.codec import encode
from flockwire_core.wire.inbox import ATTACHMENT, CANARY, MISDIRECTED, Inbox, attachment, publisher_of, read_attachment
from flockwire_core.wire.keys import MISSION, ROWS, STOP, TIME_REPLY, TIME_REQUEST, Key
from hypothesis import given
from hypothesis import strategies as st

NOW = 1_790_000_000 * SECOND
US, OTHER = b"a" * 16, b"b" * 16
POSE = Key("pose", "uav1")
AHEAD = nanoseconds(ROWS["pose"].max_future)


def pose(stamp=NOW):
    return encode(Pose(stamp, "world", (1.0, 2.0, 3.0)))


@pytest.fixture
def inbox():
    """Return an inbox that took sequence number 5 at NOW."""
    inbox = Inbox(POSE)
    assert inbox.accept(pose(), attachment(5, NOW, US, POSE), NOW)
    return inbox


def test_a_message_passes_with_its_send_time():
    inbox = Inbox(POSE)
    assert inbox.accept(pose(), attachment(3, NOW + 1, US, POSE), NOW) == Pose(NOW, "world", (1.0, 2.0, 3.0))
    assert (inbox.sent, inbox.missed) == (NOW + 1, 0)


def test_an_attachment_names_number_send_time_and_publisher():
    assert read_attachment(attachment(3, NOW + 1, US, POSE)) == (3, NOW + 1, publisher_of(US, POSE))


@pytest.mark.parametrize(
    ("stamp", "sequence", "publisher", "reason"),
    [
        (NOW + 1, 5, US, "repeated"),
        (NOW + 1, 4, US, "repeated"),
        (NOW - 1, 6, US, "older than the last"),
        (NOW - 1, 0, OTHER, "older than the last"),
        (NOW + AHEAD + 1, 6, US, "ahead of time"),
    ],
)
def test_a_message_that_comes_late_or_early_is_counted_by_its_reason(inbox, stamp, sequence, publisher, reason):
    assert inbox.accept(pose(stamp), attachment(sequence, NOW, publisher, POSE), NOW) is None
    assert inbox.rejected == {reason: 1}


def test_a_message_past_its_maximum_age_is_expired():
    inbox = Inbox(POSE)
    maximum_age = nanoseconds(ROWS["pose"].maximum_age)
    assert inbox.accept(pose(NOW - maximum_age - 1), attachment(0, NOW, US, POSE), NOW) is None
    assert inbox.rejected == {"expired": 1}
    assert inbox.accept(pose(NOW - maximum_age), attachment(1, NOW, US, POSE), NOW)


def test_a_stop_expires_too():
    inbox = Inbox(STOP)
    assert inbox.accept(encode(Stop(NOW, "world", "")), attachment(0, NOW, US, STOP), NOW + 121 * SECOND) is None


@pytest.mark.parametrize("offset", [-119, -4, 4, 119])
def test_clocks_that_are_two_minutes_apart_do_not_block_a_stop(offset):
    inbox = Inbox(STOP)
    assert inbox.accept(encode(Stop(NOW, "world", "")), attachment(0, NOW, US, STOP), NOW + offset * SECOND)


def test_a_mission_never_expires():
    day = 86_400 * SECOND
    assert Inbox(MISSION).accept(encode(Mission(NOW - day, "world", "hold")), attachment(0, NOW, US, MISSION), NOW)


def test_a_stamp_may_be_ahead_by_the_clocks_offset(inbox):
    assert inbox.accept(pose(NOW + AHEAD), attachment(6, NOW, US, POSE), NOW)


def test_equal_stamps_pass(inbox):
    assert inbox.accept(pose(), attachment(6, NOW, US, POSE), NOW)
    assert inbox.accept(pose(), attachment(0, NOW, OTHER, POSE), NOW)


def missed(inbox, after, sequence, publisher=US):
    """Return the messages missing before the accepted one of `after` ns after NOW."""
    assert inbox.accept(pose(NOW + after), attachment(sequence, NOW, publisher, POSE), NOW)
    return inbox.missed


def test_gaps_in_the_numbers_are_missed_messages(inbox):
    assert [missed(inbox, 1, 9), missed(inbox, 2, 10)] == [3, 0]


def test_a_publisher_that_restarted_is_accepted_from_its_first_message(inbox):
    assert [missed(inbox, 1, 0, OTHER), missed(inbox, 2, 2, OTHER)] == [0, 1]


def test_a_rejected_message_leaves_no_trace_but_its_count(inbox):
    inbox.accept(b"nonsense", attachment(6, NOW, US, POSE), NOW)
    inbox.accept(pose(NOW - 1), attachment(7, NOW, OTHER, POSE), NOW)
    assert missed(inbox, 1, 6) == 0


@pytest.mark.parametrize(
    ("payload", "attached"),
    [
        (b"", attachment(6, NOW, US, POSE)),
        (pose()[:-1], attachment(6, NOW, US, POSE)),
        (pose(), b""),
        (pose(), attachment(6, NOW, US, POSE)[:-1]),
        (pose(), attachment(6, NOW, US, POSE) + b"\0"),
        (pose(), attachment(-1, NOW, US, POSE)),
        (pose(), ATTACHMENT.pack(6, NOW, 15, US)),
    ],
)
def test_malformed_samples_are_counted(inbox, payload, attached):
    assert inbox.accept(payload, attached, NOW) is None
    assert inbox.rejected == {"malformed": 1}


@given(st.sampled_from(tuple(ROWS)), st.binary(max_size=200), st.binary(max_size=60))
def test_random_bytes_are_never_raised_into_the_loop(kind, payload, attached):
    inbox = Inbox(Key(kind))
    for sample in ((payload, attached), (payload, attachment(1, NOW, US, POSE)), (pose(), attached)):
        received = inbox.accept(*sample, NOW)
        assert (received is None) == (inbox.rejected.total() > 0)
        inbox.rejected.clear()


@given(st.lists(st.tuples(st.integers(-3, 3), st.integers(0, 4), st.sampled_from((US, OTHER))), max_size=30))
def test_what_passes_never_goes_back_in_time(samples):
    inbox = Inbox(POSE)
    passed = [
        received.stamp
        for offset, sequence, publisher in samples
        if (received := inbox.accept(pose(NOW + offset), attachment(sequence, NOW, publisher, POSE), NOW))
    ]
    assert passed == sorted(passed)
    assert len(passed) + inbox.rejected.total() == len(samples)


def test_canaries_are_counted_apart_and_never_passed(inbox):
    for payload in (CANARY, CANARY + b"uav3"):
        assert inbox.accept(payload, attachment(6, NOW, US, POSE), NOW) is None
    assert inbox.rejected == {"canary": 2}
    assert missed(inbox, 1, 6) == 0


@pytest.mark.parametrize("payload", [CANARY[:-1], b" " + CANARY, pose() + CANARY])
def test_what_only_resembles_a_canary_is_malformed(inbox, payload):
    assert inbox.accept(payload, attachment(6, NOW, US, POSE), NOW) is None
    assert inbox.rejected == {"malformed": 1}


def test_a_canary_is_counted_whatever_it_carries(inbox):
    assert inbox.accept(CANARY, b"", NOW) is None
    assert inbox.rejected == {"canary": 1}


def recording(count, first=0):
    """Return what a publisher sent, 100 times a second: payload, attachment and time of each message."""
    times = [(k, NOW + k * SECOND // 100) for k in range(first, first + count)]
    return [(pose(t), attachment(k, t, US, POSE), t) for k, t in times]


@pytest.mark.parametrize("pause", [0, 100, 6000])
def test_a_minute_replayed_beside_live_messages_moves_no_drone_and_is_counted(pause):
    inbox, minute, living = Inbox(POSE), recording(6000), recording(6000, 6000 + pause)
    for sample in minute:
        assert inbox.accept(*sample)
    for (payload, attached, _), alive in zip(minute, living, strict=True):
        assert inbox.accept(*alive)
        assert inbox.accept(payload, attached, alive[2]) is None
    assert inbox.rejected == {"repeated": 6000}


def test_a_minute_replayed_to_a_process_without_other_publishers_is_counted_too():
    inbox, minute = Inbox(POSE), recording(6000)
    for payload, attached, _ in minute:
        assert inbox.accept(payload, attached, NOW + 66 * SECOND) is None
    assert inbox.rejected == {"expired": 4000 + 1, "over quota": 1999}  # all at one time: four seconds' worth is judged


def test_a_minute_replayed_under_new_numbers_and_names_moves_no_drone():
    inbox, minute = Inbox(POSE), recording(600)
    for payload, attached, now in minute:
        inbox.accept(payload, attached, now)
    for k, (payload, _, _) in enumerate(minute[:-1]):
        assert inbox.accept(payload, attachment(0, NOW, k.to_bytes(12, "big"), POSE), minute[-1][2]) is None
    assert inbox.rejected == {"older than the last": 599}


def test_a_stamp_ahead_blocks_its_key_for_no_longer_than_clocks_may_differ(inbox):
    assert inbox.accept(pose(NOW + AHEAD), attachment(0, NOW, OTHER, POSE), NOW)
    assert inbox.accept(pose(NOW + SECOND), attachment(1, NOW, OTHER, POSE), NOW) is None
    assert inbox.accept(pose(NOW + AHEAD), attachment(6, NOW, US, POSE), NOW + AHEAD)


def test_a_clock_that_was_set_back_blocks_no_key_for_longer_than_clocks_may_differ(inbox):
    hour = 3600 * SECOND
    assert inbox.accept(pose(NOW - hour), attachment(6, NOW - hour, US, POSE), NOW - hour)


def test_a_number_far_ahead_is_no_flood_of_missed_messages():
    inbox, gaps = Inbox(POSE), 0
    for k in range(4):
        for sequence in (0, 2**63 - 1):
            received = inbox.accept(pose(NOW + k), attachment(sequence, NOW, bytes([k]) * 16, POSE), NOW)
            gaps += inbox.missed if received else 0
    assert gaps < 2**63  # it is told as one of 64 bits


def test_any_number_of_publishers_costs_no_memory(inbox):
    tracemalloc.start()
    for k in range(2000):
        inbox.accept(pose(NOW + k), attachment(0, NOW, k.to_bytes(12, "big"), POSE), NOW)
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 20_000
    assert inbox.rejected.total() == 0


def test_a_sample_that_the_network_delivers_under_another_key_is_rejected():
    inbox, leaders = Inbox(POSE), Key("pose", "uav0")
    assert inbox.accept(pose(), attachment(0, NOW, US, leaders), NOW) is None
    assert inbox.accept(pose(), attachment(0, NOW, US, POSE), NOW)
    assert inbox.accept(pose(NOW + 1), attachment(7, NOW, US, leaders), NOW) is None
    assert missed(inbox, 2, 1) == 0
    assert inbox.rejected == {MISDIRECTED: 2}


@pytest.mark.parametrize(("kind", "message"), [
    (TIME_REQUEST, TimeRequest(NOW - 300 * SECOND, "world")),
    (TIME_REPLY, TimeReply(NOW - 300 * SECOND, "world", NOW, NOW)),
])  # fmt: skip
def test_what_asks_for_the_time_passes_though_its_clock_was_set_back(kind, message):
    key = Key(kind, "uav1")
    inbox = Inbox(key)
    assert inbox.accept(encode(message._replace(stamp=NOW)), attachment(0, NOW, US, key), NOW)
    assert inbox.accept(encode(message), attachment(1, NOW, US, key), NOW)
    assert inbox.accept(encode(message), attachment(1, NOW, US, key), NOW) is None
    assert inbox.rejected == {"repeated": 1}
