"""What a link does to messages: delay, jitter, loss, reordering, cuts, and chance that depends on nothing else."""

from __future__ import annotations

from random import Random
from statistics import fmean

import pytest
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO
from flockwire_core.wire.keys import ROWS
from flockwire_lab.network import HELD_BACK, Conditions, Sample, VirtualLink
from flockwire_lab.rare import Rare, RareBranches
from flockwire_lab.virtual_time import Scheduler

COUNT = 5000
PERIOD = SECOND // 100
RARE_COUNT = 2000


def carry(link_of, count: int = COUNT, kind: str = "pose", during=lambda k, link: None) -> list[tuple[int, int]]:
    """Send numbered messages a hundred a second; returns (number, ns on the way) in the order of arrival."""
    scheduler, arrived = Scheduler(0), []
    link = link_of(scheduler, lambda load: arrived.extend((place, scheduler.now) for place, _ in load))

    def send(number: int) -> None:
        during(number, link)
        link.load.append((number, Sample(ROWS[kind], Pose(0, "", ZERO), 0, 0, b"", False)))
        link.depart()

    for number in range(count):
        scheduler.at(number * PERIOD, send, number)
    scheduler.run(10**15)
    return [(number, at - number * PERIOD) for number, at in arrived]


def link_with(ends=("uav1", "uav2"), seed=0, **conditions):
    return lambda scheduler, deliver: VirtualLink(ends, Conditions(**conditions), seed, scheduler, deliver)


def test_an_ideal_link_delays_exactly() -> None:
    assert carry(link_with(delay=0.0003), 50) == [(k, 300_000) for k in range(50)]


def test_jitter_is_spread_evenly_and_keeps_the_order() -> None:
    arrived = carry(link_with(delay=0.002, jitter=0.008))
    assert [number for number, _ in arrived] == list(range(COUNT))
    delays = [delay / SECOND for _, delay in arrived]
    assert min(delays) >= 0.002
    assert max(delays) <= 0.010
    assert fmean(delays) == pytest.approx(0.006, abs=0.0002)


def test_jitter_longer_than_the_period_keeps_the_order_too() -> None:
    arrived = carry(link_with(jitter=0.05))
    assert [number for number, _ in arrived] == list(range(COUNT))


def test_loss_takes_its_share_of_single_messages() -> None:
    arrived = carry(link_with(loss=0.2))
    assert len(arrived) / COUNT == pytest.approx(0.8, abs=0.02)


def test_events_are_late_but_never_lost() -> None:
    arrived = carry(link_with(loss=0.5), 400, "mission")
    assert sorted(number for number, _ in arrived) == list(range(400))
    assert sum(delay > 0 for _, delay in arrived) / 400 == pytest.approx(0.5, abs=0.1)


def test_reordering_lets_later_messages_overtake() -> None:
    arrived = carry(link_with(reordering=0.1))
    late = [delay for _, delay in arrived if delay]
    assert len(arrived) == COUNT
    assert len(late) / COUNT == pytest.approx(0.1, abs=0.02)
    assert max(late) <= HELD_BACK * SECOND
    numbers = [number for number, _ in arrived]
    assert numbers != sorted(numbers)


def test_a_cut_link_lets_nothing_through_until_every_cut_is_restored() -> None:
    def during(number: int, link: VirtualLink) -> None:
        if number in (10, 15):
            link.disturb(None)
        if number in (20, 30):
            link.restore(None)

    arrived = carry(link_with(delay=0.001), 50, during=during)
    assert [number for number, _ in arrived] == [*range(10), *range(30, 50)]


def test_conditions_hold_until_they_are_lifted() -> None:
    bad = Conditions(delay=0.03)

    def during(number: int, link: VirtualLink) -> None:
        if number == 10:
            link.disturb(bad)
        if number == 20:
            link.restore(bad)

    arrived = carry(link_with(delay=0.001), 40, during=during)
    assert [number for number, _ in arrived] == list(range(40))
    delays = dict(arrived)
    assert delays[9] == delays[39] == 1_000_000
    assert delays[15] == 30_000_000


def test_a_link_draws_by_seed_and_ends_alone() -> None:
    one = carry(link_with(loss=0.5, jitter=0.001), 200)
    assert carry(link_with(loss=0.5, jitter=0.001), 200) == one
    assert carry(link_with(seed=1, loss=0.5, jitter=0.001), 200) != one
    assert carry(link_with(ends=("uav2", "uav1"), loss=0.5, jitter=0.001), 200) != one


def rare_link(rare: Rare):
    branches = RareBranches(rare, Random(0))
    ends, conditions = ("uav1", "uav2"), Conditions(delay=0.001)
    return lambda scheduler, deliver: VirtualLink(ends, conditions, 0, scheduler, deliver, branches)


def test_some_messages_are_late_and_later_ones_wait_for_them() -> None:
    arrived = carry(rare_link(Rare(late_messages=0.01, late_by=0.3)), RARE_COUNT)
    assert [number for number, _ in arrived] == list(range(RARE_COUNT))
    delays = [delay / SECOND for _, delay in arrived]
    assert 0.0 < sum(delay > 0.001 for delay in delays) < RARE_COUNT / 2
    assert 0.15 < max(delays) <= 0.301


def test_a_link_closes_as_an_order_departs_and_opens_again() -> None:
    rare = Rare(closed_links=0.1, closed_for=0.3)
    arrived = [number for number, _ in carry(rare_link(rare), RARE_COUNT, "mission")]
    lost = sorted(set(range(RARE_COUNT)) - set(arrived))
    assert lost
    assert len(lost) < RARE_COUNT
    assert arrived[-1] > RARE_COUNT - 40
    assert len(carry(rare_link(rare), RARE_COUNT, "pose")) == RARE_COUNT  # nothing but an order closes it
