"""A law whose steps take longer than the control period is named, in real and in virtual time."""

from __future__ import annotations

import sys
from collections.abc import Callable
from itertools import count

import pytest
from flockwire_agent.extended_law import ExtendedLaw
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import TAKES, Stopwatch
from flockwire_core.process.stepping import StatusPublisher, StepCounts
from flockwire_core.process.timekeeping import timekeeping
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import LAW_SLOW, Report, Status
from flockwire_lab.process import NO_RESOURCES
from flockwire_lab.world import World

MS = 1_000_000
NAMED = TAKES.format(step=30.0, period=10.0)


class Slow(ExtendedLaw):
    """The extended law in a user's module."""


def measured(steps: list[int]) -> Stopwatch:
    """Return a stopwatch of 10 ms that has measured steps of so many ms."""
    times = iter([time for step in steps for time in (0, step * MS)])
    stopwatch = Stopwatch(lambda: next(times), 0.01)
    for _ in steps:
        stopwatch.begin()
        stopwatch.end()
    return stopwatch


def test_only_a_mean_above_the_period_is_a_reason() -> None:
    assert measured([]).reason() is None
    assert measured([1, 25, 1]).reason() is None
    slow = measured([29, 31])
    reason = slow.reason()
    assert reason is not None
    assert (reason.code, reason.text) == (LAW_SLOW, NAMED)
    assert slow.reason() is None  # no step since


def test_the_status_of_a_real_agent_names_it(make_plan: Callable[..., Plan]) -> None:
    published: list[Status] = []
    plan = make_plan()
    status = StatusPublisher(
        "world",
        "uav1",
        lambda messages: published.extend(message for _, message in messages),  # type: ignore[misc]
        lambda _: NO_RESOURCES,
        timekeeping(plan, "uav1", lambda _: None),
        lambda _: None,
    )
    status.stopwatch = measured([30])
    for second in (1, 2):
        status.update(second * SECOND, Report("hold", "why"), StepCounts(), ())
    assert [one.report.line for one in published] == [f"why; {NAMED}", "why"]


def test_virtual_time_names_it_after_the_flight_and_not_in_it(
    make_swarm: Callable[..., Swarm], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "slow_law", sys.modules[__name__])
    changes = {"control.law": "slow_law:Slow", "graph.edges": [[0, 1]]}
    drones = [{"id": i, "start": [1.0 * i, 0.0, 0.0]} for i in (0, 1)]
    swarm = make_swarm({**changes, "drones": drones})
    flown = []
    for step in (1, 30):
        clock = count(0, step * MS)
        monkeypatch.setattr("flockwire_core.clock.monotonic", lambda clock=clock: next(clock))
        payloads: list[bytes] = []
        world = World(swarm, 0, 3.0, tap=lambda published, seen=payloads: seen.append(published.sample.payload))
        flown.append((world.run(), payloads))
    assert [outcome.slow for outcome, _ in flown] == [(), (f"uav1: {NAMED}",)]
    assert flown[0][1] == flown[1][1]
