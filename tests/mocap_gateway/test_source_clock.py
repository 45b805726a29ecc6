from itertools import pairwise
from random import Random

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_mocap.source_clock import SLOPE_BLOCKS, SourceClock, lower_hull
from hypothesis import given
from hypothesis import strategies as st

BOOT = 1_700_000_000 * SECOND  # local time when the source's clock shows 0
MILLI = SECOND // 1000
FLOOR = MILLI // 5  # the smallest delay of the network


def run(clock, *, seconds, drift=0.0, seed=1, begin=0, rate=100, delay=None):
    """Feed a clock; return (error, age) of each mapped stamp in ns: error against the time of sending."""
    dice, results = Random(seed), []
    delay = delay or (lambda source: FLOOR + round(dice.expovariate(1 / MILLI)))
    for k in range(seconds * rate):
        source = begin + k * SECOND // rate
        sent = BOOT + source + round(drift * source)
        now = sent + delay(source)
        mapped = clock.update(source, now)
        results.append((mapped - sent, now - mapped))
    return results


def test_the_first_stamp_is_when_it_arrives():
    clock = SourceClock()
    assert clock.local(5) == 5
    assert clock.update(1000, BOOT) == BOOT
    assert clock.local(2000) == BOOT + 1000


@pytest.mark.parametrize("drift", [0.0, 50e-6, -50e-6, 200e-6])
def test_stamps_are_true_to_the_smallest_delay_and_drift_is_followed(drift):
    clock = SourceClock()
    results = run(clock, seconds=120, drift=drift)
    settled = results[2 * SLOPE_BLOCKS * 100 :]
    assert all(abs(error - FLOOR) < MILLI // 5 for error, _ in settled)
    passed = clock.local(120 * 10**9) - clock.local(119 * 10**9)
    assert passed / 10**9 - 1.0 == pytest.approx(drift, abs=5e-6)
    assert clock.steps == 0


def test_before_the_drift_is_known_the_error_is_what_it_makes_in_that_time():
    results = run(SourceClock(), seconds=SLOPE_BLOCKS, drift=50e-6)
    assert all(abs(error - FLOOR) < MILLI for error, _ in results[100:])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("drift", [-100e-6, 100e-6])
def test_nothing_is_captured_after_it_has_arrived(seed, drift):
    assert all(age >= 0 for _, age in run(SourceClock(), seconds=40, drift=drift, seed=seed))


def test_a_stall_that_ends_makes_no_stale_frame_fresh():
    clock = SourceClock()
    run(clock, seconds=30, delay=lambda source: FLOOR)
    until = 33 * SECOND  # what is sent in 3 s comes at once at their end
    stalled = run(clock, seconds=3, begin=30 * SECOND, delay=lambda source: until - source + FLOOR)
    assert all(abs(error - FLOOR) < MILLI for error, _ in stalled)
    assert all(abs(error - FLOOR) < MILLI for error, _ in run(clock, seconds=30, begin=33 * SECOND))
    assert clock.steps == 0


@pytest.mark.parametrize("begin", [0, 500 * SECOND])
def test_a_source_that_restarts_is_followed(begin):
    clock = SourceClock()
    run(clock, seconds=20, begin=100 * SECOND, delay=lambda source: FLOOR)
    shift = 100 * SECOND if begin == 0 else -380 * SECOND  # local time continues while the source's clock jumps
    results = run(clock, seconds=5, begin=begin, delay=lambda source: FLOOR + 20 * SECOND + shift)
    expected = FLOOR + 20 * SECOND + shift
    assert clock.steps == 1
    assert all(error == pytest.approx(expected, abs=MILLI) for error, _ in results[150:])


def test_a_clock_that_is_known_to_have_been_set_back_is_followed_once():
    clock, back, now = SourceClock(), 3 * SECOND // 10, BOOT + 30 * SECOND + FLOOR
    run(clock, seconds=30, delay=lambda source: FLOOR)
    for late in (0, MILLI):  # two bodies show it
        assert clock.update(30 * SECOND - back, now + late, set_back=True) == now
    assert clock.steps == 1
    later = run(clock, seconds=90, begin=30 * SECOND, delay=lambda source: FLOOR + back)
    assert all(abs(age) < MILLI for _, age in later)


def test_a_queue_that_stays_full_for_long_makes_no_stale_frame_fresh():
    clock, queue = SourceClock(), 3 * SECOND // 10
    run(clock, seconds=30, delay=lambda source: FLOOR)
    held = run(clock, seconds=5, begin=30 * SECOND, delay=lambda source: FLOOR + queue)
    assert all(age > 0.99 * queue for _, age in held)
    assert clock.steps == 0


def test_an_earlier_stamp_can_be_mapped_too():
    clock = SourceClock()
    run(clock, seconds=20, delay=lambda source: FLOOR)
    now = clock.local(20 * SECOND)
    assert clock.local(20 * SECOND - 4 * MILLI) == pytest.approx(now - 4 * MILLI, abs=1000)


@given(st.lists(st.integers(-1000, 1000), min_size=2, max_size=30))
def test_the_lower_hull_lies_under_all_points(heights):
    points = list(enumerate(heights))
    hull = lower_hull(points)
    assert (hull[0], hull[-1]) == (points[0], points[-1])
    for (a, at_a), (b, at_b) in pairwise(hull):
        assert all((y - at_a) * (b - a) >= (at_b - at_a) * (x - a) for x, y in points if a <= x <= b)
