"""Frames end where they should, whoever reports in any order, and no drone waits long for dead ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from random import Random

import pytest
from flockwire_core.domain.time import nanoseconds
from flockwire_mocap.completeness import MISSED_FRAMES, Completeness
from hypothesis import given
from hypothesis import strategies as st

PERIOD = 0.01
TOGETHER = {0: 0.0, 1: 0.0001, 2: 0.0002, 3: 0.0003, 4: 0.0004}  # s into the period: one process reports all
ROUNDS = 60


class Reports:
    """Bodies that report once a period, each at its time in it; `frames` has (s, body) of those that complete one."""

    def __init__(self, count: int = 5) -> None:
        self.completeness = Completeness(range(count), PERIOD)
        self.rounds = 0
        self.frames: list[tuple[float, int]] = []

    def run(
        self, phases: Mapping[int, float], rounds: int = 1, without: Iterable[int] = (), jitter: float = 0.0
    ) -> list[tuple[float, int]]:
        """Have all but those `without` report for some rounds; returns the frames in them."""
        chance, before, silent = Random(1), len(self.frames), set(without)
        begin, self.rounds = self.rounds, self.rounds + rounds
        reports = [
            ((begin + k) * PERIOD + phase + jitter * chance.random(), body)
            for k in range(rounds)
            for body, phase in phases.items()
            if body not in silent
        ]
        for t, body in sorted(reports):
            if self.completeness.report(body, nanoseconds(t)):
                self.frames.append((t, body))
        return self.frames[before:]


def test_a_frame_is_complete_when_all_have_reported() -> None:
    assert [body for _, body in Reports().run(TOGETHER, 3)] == [4, 4, 4]


@given(st.permutations(range(5)))
def test_whatever_the_order_of_one_process_no_frame_ends_within_it_for_long(order: list[int]) -> None:
    phases = {body: 1e-4 * place for place, body in enumerate(order)}
    frames = Reports().run(phases, 20)
    assert [body for _, body in frames[3:]] == [order[-1]] * len(frames[3:])
    assert len(frames) >= 18


@pytest.mark.parametrize("dead", range(5))
def test_one_that_dies_delays_a_few_frames_only(dead: int) -> None:
    reports = Reports()
    reports.run(TOGETHER, 10)
    assert len(reports.run(TOGETHER, MISSED_FRAMES + 1, without=[dead])) >= 1
    after = reports.run(TOGETHER, ROUNDS, without=[dead])
    assert {body for _, body in after} == {3 if dead == 4 else 4}
    assert len(after) == ROUNDS


@pytest.mark.parametrize("dead", [{0, 1, 2, 3}, {1, 2, 3, 4}, {2, 4}])
def test_several_may_die_at_once_and_come_back(dead: set[int]) -> None:
    reports = Reports()
    reports.run(TOGETHER, 10)
    reports.run(TOGETHER, MISSED_FRAMES + 1, without=dead)
    assert len(reports.run(TOGETHER, ROUNDS, without=dead)) == ROUNDS
    reports.run(TOGETHER, 2)
    assert [body for _, body in reports.run(TOGETHER, ROUNDS)] == [4] * ROUNDS


def test_one_that_never_reported_is_not_waited_for() -> None:
    reports = Reports()
    reports.run(TOGETHER, MISSED_FRAMES + 1, without=[4])
    assert len(reports.run(TOGETHER, ROUNDS, without=[4])) == ROUNDS


def test_after_a_common_silence_the_first_frame_is_whole() -> None:
    reports = Reports()
    reports.run(TOGETHER, 10)
    reports.rounds += 500
    assert [body for _, body in reports.run(TOGETHER, 3)] == [4, 4, 4]


@pytest.mark.parametrize("lost", range(4))
def test_a_lost_report_delays_no_other(lost: int) -> None:
    reports = Reports()
    reports.run(TOGETHER, 10)
    assert [body for _, body in reports.run(TOGETHER, 1, without=[lost])] == [4]
    assert [body for _, body in reports.run(TOGETHER, 3)] == [4, 4, 4]


def test_a_lost_last_report_costs_one_frame() -> None:
    reports = Reports()
    reports.run(TOGETHER, 10)
    assert reports.run(TOGETHER, 1, without=[4]) == []
    assert [body for _, body in reports.run(TOGETHER, 3)] == [4, 4, 4]


@given(st.lists(st.floats(0.0, 0.99), min_size=2, max_size=30))
def test_several_processes_with_times_of_their_own_have_a_frame_a_period(shares: list[float]) -> None:
    reports = Reports(len(shares))
    phases = {body: PERIOD * share for body, share in enumerate(shares)}
    reports.run(phases, 4)
    frames = reports.run(phases, 20)
    assert len(frames) >= 19
    assert all(abs(later[0] - earlier[0] - PERIOD) < 1e-9 for earlier, later in pairwise(frames))


def test_one_of_several_processes_dies_and_the_others_keep_their_rate() -> None:
    apart = {0: 0.0, 1: 0.002, 2: 0.004, 3: 0.006, 4: 0.008}
    reports = Reports()
    reports.run(apart, 10, jitter=0.0008)
    for dead in (4, 1):
        reports.run(apart, MISSED_FRAMES + 2, without=[dead], jitter=0.0008)
        assert len(reports.run(apart, ROUNDS, without=[dead], jitter=0.0008)) >= 0.95 * ROUNDS
        reports.run(apart, 4, jitter=0.0008)


def test_a_clock_that_is_set_stops_no_frames() -> None:
    reports = Reports()
    for jump in (100, -600, 3):
        reports.run(TOGETHER, 10)
        reports.rounds += jump
        reports.run(TOGETHER, 1)
        assert len(reports.run(TOGETHER, ROUNDS)) == ROUNDS
