"""A flight of lab/bench/separation/wrong_airframes.toml, and one of lab/bench/settling.py."""

from pathlib import Path

import pytest
import settling
from flockwire_lab.study.file import Study, load_study
from flockwire_lab.study.flight import Task, fly
from flockwire_lab.study.variation import swarm_table
from settling import IDEAL

SEPARATION = Path(__file__).parents[3] / "lab/bench/separation"
STRONG_IN_WIND = 3  # the last point of the grid


@pytest.mark.long
def test_airframes_that_are_not_the_model_keep_formation_in_wind():
    plan = load_study(SEPARATION / "wrong_airframes.toml", {"duration": 20.0}, Study)
    found = fly(Task(plan, swarm_table(SEPARATION / "five_tello.toml"), STRONG_IN_WIND, 0))
    assert (found.failed, found.reason) == ((), "")
    assert found.figures["formation_tail_m"] < 0.06


@pytest.mark.long
def test_free_places_are_reached_sooner_than_those_of_ranks():
    rank, free = (settling.fly(way, 5, IDEAL, 1) for way in ("by rank", "free"))
    assert free.allowed <= rank.allowed
    assert free.settled < rank.settled
    assert free.settled < 2.0 * free.allowed
