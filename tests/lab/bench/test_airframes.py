"""A flight of lab/bench/airframes.py, and one of lab/bench/settling.py."""

import airframes
import pytest
import settling
from settling import IDEAL


@pytest.mark.long
def test_airframes_that_are_strong_and_slow_keep_formation_in_wind(monkeypatch):
    monkeypatch.setattr(airframes, "DURATION", 20.0)
    found = airframes.fly(airframes.CASES["strong and slow, wind"], 2.4, "extended", 0)
    assert found.failure == ""
    assert found.drones >= 0.4
    assert found.obstacles >= 0.3
    assert found.tail < 0.06


@pytest.mark.long
def test_free_places_are_reached_sooner_than_those_of_ranks():
    rank, free = (settling.fly(way, 5, IDEAL, 1) for way in ("by rank", "free"))
    assert free.allowed <= rank.allowed
    assert free.settled < rank.settled
    assert free.settled < 2.0 * free.allowed
