from collections import Counter
from random import Random

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.gateway import Gateway
from flockwire_core.wire.keys import MISSION
from flockwire_mocap.streamed import MOST_NAMED, MOST_SENDERS, FrameSequence, StreamedSource
from flockwire_mocap.tracking import ReportedBody, SourceState, TrackerFrame

NOW = 1_790_000_000 * SECOND
MS = SECOND // 1000
LEVEL = (0.0, 0.0, 0.0, 1.0)
NEXT, BEHIND = True, False


def body(identity, x=0.0, tracked=True):
    return ReportedBody(identity, f"uav{identity}", (x, 0.0, 1.0), LEVEL, tracked)


def frame(number, captured, *bodies, transmitted=None):
    return TrackerFrame(number, captured, captured if transmitted is None else transmitted, bodies)


def streamed(trouble="", missing=0, **options):
    gateway = Gateway(source="natnet", natnet={"up_axis": "y"}, rate_hz=100)
    source = StreamedSource(gateway, trouble, **options)
    source.counts["frames missing"] = missing
    return source


def test_the_stamp_is_the_exposure_on_the_gateways_clock():
    source = streamed()
    source.arrived(frame(1, 5000 * MS, body(1), transmitted=5008 * MS), NOW)
    source.take(NOW)
    source.arrived(frame(2, 5010 * MS, body(1), transmitted=5018 * MS), NOW + 13 * MS)  # 3 ms late on the way
    (found,) = source.take(NOW + 13 * MS)
    assert found.captured == NOW + 2 * MS
    assert found.bodies[0].position == (0.0, -1.0, 0.0)


def test_a_latency_that_the_stamps_do_not_have_is_subtracted():
    source = streamed(latency=0.008)
    source.arrived(frame(1, 5000 * MS, body(1)), NOW)
    assert source.take(NOW)[0].captured == NOW - 8 * MS


def test_of_what_comes_faster_than_it_is_taken_the_newest_counts():
    source = streamed()
    source.arrived(frame(1, 0, body(1, 1.0), body(2, 1.0)), NOW)
    source.arrived(frame(2, 10 * MS, body(1, 2.0)), NOW + 10 * MS)
    first, second = source.take(NOW + 10 * MS)
    assert [(b.name, b.position[0]) for b in first.bodies] == [("uav2", 1.0)]
    assert [(b.name, b.position[0]) for b in second.bodies] == [("uav1", 2.0)]
    assert (source.take(NOW), source.complete()) == ([], False)


def test_a_body_that_is_there_twice_is_nowhere_and_counted():
    source = streamed()
    source.arrived(frame(1, 0, body(1, 1.0), body(1, 2.0), body(2)), NOW)
    (found,) = source.take(NOW)
    assert {b.name: b.tracked for b in found.bodies} == {"uav1": False, "uav2": True}
    assert source.state(NOW).counts == (("uav1 twice in a frame", 1),)


def test_of_many_bodies_that_are_there_twice_the_first_are_named():
    source = streamed()
    for k in range(MOST_NAMED + 100):
        source.arrived(frame(k, k * MS, body(k), body(k)), NOW)
    counts = source.state(NOW).counts
    assert counts[:2] == (("uav0 twice in a frame", 1), ("uav1 twice in a frame", 1))
    assert (counts[-1], len(counts)) == (("others twice in a frame", 100), MOST_NAMED + 1)


@pytest.mark.parametrize("awaited", [None, {"uav1": 1, "uav2": 2}])
def test_whole_frames_are_complete_and_single_reports_with_the_last(awaited):
    source = streamed(awaited=awaited)
    source.arrived(frame(1, 0, body(1)), NOW)
    assert source.complete() == (awaited is None)
    source.arrived(frame(1, 0, body(7)), NOW)  # nobody waits for it
    assert source.complete() == (awaited is None)
    source.arrived(frame(2, 0, body(2)), NOW + MS)
    assert source.complete()


def test_it_reports_what_the_connection_lacks_and_restarts_of_the_trackers_clock():
    source = streamed("no answer", missing=3)
    source.arrived(frame(1, 5 * SECOND, body(1)), NOW)
    source.arrived(frame(2, 900 * SECOND, body(1)), NOW + MS)
    assert source.state(NOW) == SourceState(
        "no answer", (("frames missing", 3), ("steps of the clock of the tracker", 1))
    )
    assert source.triggers == {MISSION}


@pytest.mark.parametrize("ahead", [0.2, 1.1, -0.9, -20.0])
def test_the_stamps_of_one_sender_never_move_the_poses_of_another(ahead):
    source = streamed()
    for k in range(300):
        now = NOW + k * 10 * MS
        source.arrived(frame(k, now - 7 * SECOND, body(1)), now, "driver")
        if k > 100:
            stamp = now + round(ahead * SECOND)
            source.arrived(frame(k, stamp, body(2)), now, "another")
        captured = {b.identity: f.captured for f in source.take(now) for b in f.bodies}
        assert set(captured.values()) == {now}
    assert source.state(now).counts == ()


def test_endless_senders_take_no_memory_and_no_pose():
    source = streamed()
    for k in range(3 * MOST_SENDERS):
        source.arrived(frame(k, k, body(2)), NOW + k * MS, f"{k}")
        source.arrived(frame(k, k * MS, body(1)), NOW + k * MS, "driver")
        assert {f.captured for f in source.take(NOW) for b in f.bodies if b.identity == 1} == {NOW + k * MS}
    assert len(source._clocks) == MOST_SENDERS


def arrivals(*numbers):
    counts = Counter()
    sequence = FrameSequence(counts)
    return counts, [sequence.arrived(number) for number in numbers]


def test_a_stream_may_begin_anywhere():
    counts, seen = arrivals(4711, 4712, 4713)
    assert seen == [NEXT] * 3
    assert not any(counts.values())


def test_gaps_repetitions_and_late_frames():
    counts, seen = arrivals(1, 2, 5, 5, 4, 4, 6)
    assert seen == [NEXT, NEXT, NEXT, BEHIND, BEHIND, BEHIND, NEXT]
    assert (counts["frames missing"], counts["frames repeated"], counts["frames late"]) == (1, 2, 1)


def test_a_stream_restarts_with_its_second_frame():
    counts, seen = arrivals(5000, 5001, 1, 2, 2, 3)
    assert seen == [NEXT, NEXT, BEHIND, NEXT, BEHIND, NEXT]
    assert (counts["stream restarts"], counts["frames missing"], counts["frames late"]) == (1, 0, 1)


def test_a_recording_that_is_played_in_a_loop():
    counts, seen = arrivals(*(list(range(100)) * 5))
    assert seen.count(NEXT) == 500 - 4
    assert (counts["stream restarts"], counts["frames missing"]) == (4, 0)


def test_a_straggler_begins_nothing():
    counts, seen = arrivals(*range(100, 200), 120, 200, 121, 201)
    assert seen[-4:] == [BEHIND, NEXT, BEHIND, NEXT]
    assert (counts["stream restarts"], counts["frames missing"]) == (0, 0)


def test_a_frozen_stream_is_repeated_not_restarted():
    counts, seen = arrivals(7, *[7] * 100)
    assert seen == [NEXT] + [BEHIND] * 100
    assert counts["stream restarts"] == 0


@pytest.mark.parametrize("seed", range(10))
def test_all_frames_that_were_sent_are_accounted_for(seed):
    dice, counts = Random(seed), Counter()
    sequence = FrameSequence(counts)
    arriving = []
    for number in range(1000):
        arriving += [number] * dice.choices([0, 1, 2], [5, 90, 5])[0]
    for k in range(0, len(arriving) - 1, 7):
        arriving[k], arriving[k + 1] = arriving[k + 1], arriving[k]
    results = [sequence.arrived(number) for number in arriving]
    repeated, late = counts["frames repeated"], counts["frames late"]
    assert len(arriving) == results.count(NEXT) + repeated + late
    lost_inside = (max(arriving) - arriving[0] + 1) - len({n for n in arriving if n >= arriving[0]})
    missing = counts["frames missing"]
    assert abs(missing - lost_inside) <= 1  # a frame before the first is late without having been missing
