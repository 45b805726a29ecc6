"""One direction of a link, in a time that the test sets."""

import pytest
from flockwire_lab.network import Conditions
from flockwire_lab.relay.relay import END, MOST_HELD, Direction, Stream


@pytest.fixture
def direction():
    return Direction("uav1 > uav2", lambda: None)


def test_bytes_continue_at_once_when_nothing_is_wrong(direction):
    stream = Stream(direction)
    stream.take(b"a", 1.0)
    stream.take(b"b", 1.0)
    assert stream.due(1.0) == [b"a", b"b"]
    assert stream.next_arrival() is None


def test_a_cut_holds_all_until_it_is_restored_as_often(direction):
    stream = Stream(direction)
    direction.disturb(None)
    direction.disturb(None)
    stream.take(b"a", 1.0)
    direction.restore(None)
    assert stream.due(9.0) == []
    assert stream.next_arrival() is None
    assert stream.size == 1
    direction.restore(None)
    stream.take(b"b", 9.0)
    stream.take(END, 9.0)
    assert stream.due(9.0) == [b"a", b"b", END]
    assert stream.size == 0


def test_a_cut_holds_what_was_on_its_way_too(direction):
    stream = Stream(direction)
    direction.disturb(Conditions(0.5, 0.0))
    stream.take(b"a", 1.0)
    direction.disturb(None)
    assert stream.due(2.0) == []
    direction.restore(None)
    assert stream.due(2.0) == [b"a"]


def test_a_delay_holds_each_byte_for_as_long(direction):
    stream = Stream(direction)
    direction.disturb(Conditions(0.5, 0.0))
    stream.take(b"a", 1.0)
    stream.take(b"b", 1.25)
    assert stream.due(1.49) == []
    assert stream.next_arrival() == 1.5
    assert stream.due(1.5) == [b"a"]
    assert stream.next_arrival() == 1.75


def test_nothing_overtakes_when_a_delay_ends(direction):
    stream = Stream(direction)
    direction.disturb(Conditions(0.5, 0.0))
    stream.take(b"a", 1.0)
    direction.restore(Conditions(0.5, 0.0))
    stream.take(b"b", 1.1)
    assert stream.due(1.49) == []
    assert stream.due(1.5) == [b"a", b"b"]


def test_of_two_delays_the_later_counts_until_it_is_lifted(direction):
    stream = Stream(direction)
    direction.disturb(Conditions(0.5, 0.0))
    direction.disturb(Conditions(0.25, 0.0))
    stream.take(b"a", 1.0)
    direction.restore(Conditions(0.25, 0.0))
    stream.take(b"b", 2.0)
    assert stream.due(1.25) == [b"a"]
    assert stream.next_arrival() == 2.5


def test_jitter_stays_within_its_bounds_and_keeps_the_order(direction):
    stream = Stream(direction)
    direction.disturb(Conditions(0.25, 0.5))
    arrivals = []
    for k in range(200):
        stream.take(bytes([k]), float(k))
        arrivals.append(stream.next_arrival() - k)
        assert stream.due(k + 0.75) == [bytes([k])]
    assert 0.25 <= min(arrivals) < 0.3
    assert 0.7 < max(arrivals) <= 0.75
    for k in range(200):
        stream.take(bytes([k]), 1000.0)
    assert stream.due(1001.0) == [bytes([k]) for k in range(200)]


def test_a_stream_is_full_until_enough_was_passed_on(direction):
    stream = Stream(direction)
    direction.disturb(None)
    stream.take(bytes(MOST_HELD - 1), 1.0)
    assert not stream.full
    stream.take(b"a", 1.0)
    assert stream.full
    direction.restore(None)
    stream.due(1.0)
    assert not stream.full


def test_every_change_is_reported():
    told = []
    direction = Direction("uav1 > uav2", lambda: told.append(direction.passable))
    direction.disturb(None)
    direction.restore(None)
    direction.disturb(Conditions(0.1, 0.0))
    direction.restore(Conditions(0.1, 0.0))
    assert told == [False, True, True, True]
