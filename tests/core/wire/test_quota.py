"""What one key may bring: so many messages a second, each so large; what exceeds that is dropped and counted."""

from struct import pack

import pytest
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.codec import decode, encode
from flockwire_core.wire.inbox import BURST, OVER_QUOTA, Inbox, Quota, attachment
from flockwire_core.wire.keys import ROWS, TABLE, Key
from flockwire_core.wire.status import LONGEST_TEXT, MOST_REASONS, Reason, Report, Status
from hypothesis import given
from hypothesis import strategies as st

NOW = 1_790_000_000 * SECOND
US, POSE = b"a" * 16, Key("pose", "uav1")


def status(detail="", rejected=(), links=()):
    return Status(NOW, "world", "recorder", Report("recording", detail), 1, 0, 0, 0, 0, 0.1, 1, rejected, links)


@given(st.integers(1, 1000), st.integers(0, 20))
def test_a_quota_lets_a_burst_through_and_then_its_rate(rate, seconds):
    quota, often = Quota(rate), 3 * rate
    period = SECOND // often
    passed = sum(not quota.exceeded(NOW + k * period) for k in range(often * seconds))
    assert passed <= rate * (seconds + BURST) + 1
    assert passed >= min(often * seconds, rate * seconds)


def test_the_usual_rate_never_exceeds_the_quota():
    for row in TABLE:
        quota = Quota(row.rate)
        assert not any(quota.exceeded(NOW + k * (2 * SECOND // row.rate)) for k in range(20 * row.rate))


def test_messages_buffered_during_a_freeze_pass():
    quota = Quota(ROWS["status"].rate)
    assert not any(quota.exceeded(NOW) for _ in range(10 * 15))  # 15 s of statuses


def test_a_clock_that_is_set_back_does_not_close_a_key():
    quota = Quota(10)
    assert not quota.exceeded(NOW)
    assert not quota.exceeded(NOW - 3600 * SECOND)


def test_a_flood_is_dropped_and_counted():
    inbox = Inbox(POSE)
    for k in range(20_000):
        inbox.accept(encode(Pose(NOW + k, "world", (0.0, 0.0, 1.0))), attachment(k, NOW, US, POSE), NOW + k * 10_000)
    assert inbox.rejected[OVER_QUOTA] == pytest.approx(20_000 - 1000 * (BURST + 0.2), rel=0.01)


def test_a_message_that_is_too_large_is_not_decoded():
    inbox = Inbox(Key("status", "uav1"))
    assert inbox.accept(b"x" * 60_000, attachment(0, NOW, US, Key("status", "uav1")), NOW) is None
    assert inbox.rejected == {OVER_QUOTA: 1}


def test_whatever_a_process_knows_of_itself_its_status_fits_the_quota():
    counts = tuple((f"a_rather_long_swarm_name/kinematics/telemetry {k} older than the last", k) for k in range(500))
    data = encode(status("x" * 5000, counts, tuple(f"process{k}" for k in range(1000))))
    assert len(data) <= ROWS["status"].largest
    told = decode(Status, data)
    assert sum(count for _, count in told.rejected) == sum(range(500))
    assert told.rejected[0][1] == 499
    assert len(told.report.detail) == LONGEST_TEXT


def test_names_that_are_too_long_are_shortened():
    long = ("é" * 200, 3)
    told = status(rejected=(long,), links=("x" * 300,))
    told = decode(Status, encode(told._replace(report=told.report._replace(counts=(long,)))))
    assert told.report.counts == told.rejected == (("é" * 126 + "...", 3),)


def test_of_more_reasons_than_a_status_gives_the_first_are_kept_each_shortened():
    reasons = tuple(Reason(str(k), "x" * 300, "y" * 300) for k in range(MOST_REASONS + 1))
    told = status("x" * 300)
    data = encode(told._replace(report=told.report._replace(reasons=reasons)))
    assert len(data) <= ROWS["status"].largest
    assert [(one.code, len(one.text), len(one.remedy)) for one in decode(Status, data).report.reasons] == [
        (str(k), LONGEST_TEXT, LONGEST_TEXT) for k in range(MOST_REASONS)
    ]


def test_a_report_in_one_line_has_the_detail_and_each_reason_with_its_remedy():
    reasons = (Reason("firmware", "SDK 20"), Reason("IMU", "a tilt", "put it level"))
    assert Report("grounded", reasons=reasons).line == "SDK 20; a tilt: put it level"
    assert Report("hold", "why").line == "why"


def test_a_small_status_is_left_as_it_is():
    told = status("waits", (("a", 1),), ("gateway",))
    assert decode(Status, encode(told)) == told


def test_a_status_with_a_text_that_is_too_long_is_malformed():
    own, forged = (pack("<I", size + 1) + b"x" * size + b"\0" for size in (LONGEST_TEXT, LONGEST_TEXT + 8))
    data = encode(status("x" * LONGEST_TEXT))
    assert own in data
    with pytest.raises(MessageError, match="more than 256 characters"):
        decode(Status, data.replace(own, forged))
