"""Flights whose links and timers take rare branches on purpose; the links alone: test_network.py."""

from __future__ import annotations

from random import Random

from flockwire_core.domain.time import SECOND
from flockwire_lab.process import Published
from flockwire_lab.rare import TIMER_WITHIN, Rare
from flockwire_lab.world import EPOCH, World


def flown(make_plan, rare: Rare | None, seed: int = 0) -> list[tuple[int, str, bytes]]:
    published: list[tuple[int, str, bytes]] = []

    def take(one: Published) -> None:
        published.append((one.at, one.topic, one.sample.payload))

    world = World(make_plan().swarm, seed, 1.0, tap=take, rare=rare)
    world.scheduler.run(EPOCH + SECOND)
    return published


def test_a_flight_with_rare_branches_is_another_one_and_the_same_again(make_plan) -> None:
    usual, timers = flown(make_plan, None), Rare(late_timers=0.05)
    assert flown(make_plan, Rare()) == usual  # no share, no branch
    late = flown(make_plan, timers)
    assert late != usual
    assert flown(make_plan, timers) == late


def test_a_late_timer_is_late_by_little_and_its_steps_are_skipped(make_plan) -> None:
    world = World(make_plan().swarm, 0, 1.0, rare=Rare(late_timers=0.02))
    process = world.processes["kinematics"]
    world.scheduler.run(EPOCH + SECOND)
    assert process._stepper is not None
    counts = process._stepper._counts
    assert 0 < counts.skipped < TIMER_WITHIN * SECOND / process._period * counts.steps


def test_each_flight_draws_its_own_branches() -> None:
    drawn = [Rare.drawn(Random(seed)) for seed in range(200)]
    for share in (0, 2, 3):
        values = [rare[share] for rare in drawn]
        assert 60 < sum(value > 0.0 for value in values) < 140
        assert max(values) <= 0.5
