"""A process that asks for swarm time, against a gateway's clock."""

from __future__ import annotations

from itertools import pairwise

import pytest
from flockwire_core.control.clock_offset import DRIFT
from flockwire_core.domain.time import SECOND, TimeReply
from flockwire_core.loading import parse_swarm
from flockwire_core.process.corrected_clock import SLEW, CorrectedClock
from flockwire_core.process.timekeeping import UNKNOWN
from flockwire_core.wire.keys import TIME_REPLY, Key
from flockwire_core.wire.plan import Plan

START = 1_790_000_000 * SECOND
TICK, DELAY = SECOND // 50, SECOND // 1000
TABLE = {
    "name": "two",
    "formation": {"kind": "circle", "radius": 1.5},
    "graph": {"edges": [[0, 1]]},
    "drones": [{"id": 0, "start": [0.0, 0.0, 0.0]}, {"id": 1, "start": [1.5, 0.0, 0.0], "host": "far"}],
    "hosts": {"near": {}, "far": {}},
}


class Host:
    """Runs the clock of uav1; the gateway answers after DELAY each way unless it is `silent`."""

    def __init__(self) -> None:
        self.corrections = [0]
        self.kept = CorrectedClock(Plan(parse_swarm(TABLE, "two")), "uav1", self.corrections.append)
        self.true, self.offset, self.silent = START, 0, False

    @property
    def now(self) -> int:
        return self.true + self.offset + self.corrections[-1]

    @property
    def error(self) -> float:
        return abs(self.now - self.true) / SECOND

    def run(self, seconds: float) -> int:
        """Go on for `seconds`; return how many requests were made."""
        asked = 0
        for _ in range(round(seconds * SECOND / TICK)):
            self.true += TICK
            for _, request in self.kept.step(self.now):
                asked += 1
                if not self.silent:
                    there = self.true + DELAY
                    self.true += 2 * DELAY
                    reply = TimeReply(there, "world", request.stamp, there)
                    self.kept.receive(Key(TIME_REPLY, "uav1"), reply, self.now)
        return asked


@pytest.fixture
def host() -> Host:
    return Host()


@pytest.mark.parametrize("offset", [-300, -1, 0, 1, 300])
def test_a_clock_that_is_off_is_corrected_within_a_second(host: Host, offset: int) -> None:
    host.offset = offset * SECOND
    host.run(1.0)
    assert host.error < 0.002


@pytest.mark.parametrize("step", [-300, 300])
def test_a_clock_that_is_set_asks_again_and_is_corrected(host: Host, step: int) -> None:
    host.run(30.0)
    host.offset += step * SECOND
    assert host.run(10.0) > 5
    assert host.error < 0.002


def test_the_bound_grows_with_the_age_of_what_it_is_based_on(host: Host) -> None:
    host.run(10.0)
    before = host.kept.figures(host.now)[1]
    host.silent = True
    host.run(600.0)
    assert host.kept.figures(host.now)[1] == pytest.approx(before + 600.0 * DRIFT, rel=0.05)


def test_a_small_error_is_corrected_slowly(host: Host) -> None:
    host.run(30.0)
    host.offset += SECOND // 100
    before = len(host.corrections)
    host.run(10.0)
    changes = [abs(b - a) for a, b in pairwise(host.corrections[before - 1 :])]
    assert sum(changes) > 0.008 * SECOND
    assert max(changes) <= SLEW * (TICK + 2 * DELAY) + 1
    assert host.error < 0.002


def test_a_reply_that_was_not_asked_for_sets_nothing(host: Host) -> None:
    for k in range(1, 50):
        ahead = host.now + 10 * SECOND
        reply = TimeReply(ahead, "world", host.now - k * DELAY, ahead)
        host.kept.receive(Key(TIME_REPLY, "uav1"), reply, host.now)
    assert host.kept.figures(host.now) == (0.0, UNKNOWN)
