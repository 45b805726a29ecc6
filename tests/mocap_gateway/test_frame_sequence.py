from collections import Counter
from random import Random

import pytest
from flockwire_mocap.frame_sequence import FrameSequence

NEXT, BEHIND = True, False


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
