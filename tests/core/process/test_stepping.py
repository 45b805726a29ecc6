"""Deadlines of periodic tasks, and which poses make a core step."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise
from random import Random
from typing import NamedTuple

import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.process.cores import Ground
from flockwire_core.process.stepping import StatusPublisher, StepCounts, Stepper, is_due, next_deadline, tick_period
from flockwire_core.process.timekeeping import timekeeping
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.inbox import Inbox
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Report, Status
from flockwire_lab.process import NO_RESOURCES

pytestmark = pytest.mark.sources  # its swarm time and inputs are of Python
PERIOD = 100
MS = SECOND // 1000
T0 = 1_790_000_000 * SECOND
POSE = Key("pose", "uav1")
StepsOf = Callable[[Iterable[int], int], list[int]]


@pytest.mark.parametrize(
    ("now", "following"),
    [
        pytest.param(1000, 1100, id="in time"),
        pytest.param(995, 1100, id="a little early"),
        pytest.param(1099, 1100, id="late"),
        pytest.param(1100, 1200, id="a whole period late"),
        pytest.param(5000, 5100, id="far too late: nothing is made up for"),
        pytest.param(200, 300, id="the clock was set back"),
    ],
)
def test_the_next_deadline(now: int, following: int) -> None:
    assert next_deadline(1000, now, PERIOD) == following


@pytest.mark.parametrize(("now", "due"), [(1000, True), (999, False), (900, False), (899, True), (5000, True)])
def test_a_task_is_due_at_its_deadline_and_when_the_clock_was_set_back(now: int, due: bool) -> None:
    assert is_due(1000, now, PERIOD) is due


class Pose(NamedTuple):
    """What a trigger brings here."""

    stamp: int


class Source:
    """An input of which the next message is `stamp`."""

    def __init__(self) -> None:
        self.inbox = Inbox(POSE)
        self.stamp = 0

    def message(self, now: int) -> Pose:
        """Return the message that has come."""
        return Pose(self.stamp + self.inbox.ahead)  # as an inbox does


class Counting(Ground):
    """A core of 100 Hz that each pose may make step, and counts its steps."""

    def __init__(self) -> None:
        super().__init__()
        self.triggers = frozenset({POSE})
        self.period = 0.01
        self.steps: list[int] = []

    def step(self, now: int) -> tuple[()]:
        """Count."""
        self.steps.append(now)
        return ()

    def report(self, now: int) -> Report:
        """Return nothing of interest."""
        return Report("")


class Repeating(Counting):
    """One that publishes a pose at each step."""

    def step(self, now: int) -> tuple[tuple[Key, Pose]]:
        """Publish one."""
        super().step(now)
        return ((POSE, Pose(now)),)


class Framing(Counting):
    """One whose poses are parts of a frame, which every third one completes."""

    def due(self, key: Key) -> bool:
        """Return whether the frame is complete."""
        self.parts = getattr(self, "parts", 0) + 1
        return self.parts % 3 == 0


class AlwaysKnown:
    """Swarm time of a process beside the gateway."""

    keys: frozenset[Key] = frozenset()

    def step(self, now: int) -> tuple[()]:
        """Ask nobody."""
        return ()

    def follow(self, _: object) -> None:
        """Correct no clock."""


@pytest.fixture(name="stepper_of")
def stepper_of_fixture(make_swarm: Callable[[], Swarm]) -> Callable[[Counting], Stepper]:
    """Return what makes the stepper of a core."""
    return lambda core: Stepper(core, make_swarm().name, (), (), lambda _: None, AlwaysKnown(), None)


@pytest.fixture(name="steps_of")
def steps_of_fixture(stepper_of: Callable[[Counting], Stepper]) -> StepsOf:
    """Return what tells when a core of 100 Hz steps, to which poses of these stamps come 2 ms late, until some time."""

    def steps_of(stamps: Iterable[int], until: int) -> list[int]:
        core, source = Counting(), Source()
        stepper, period = stepper_of(core), nanoseconds(tick_period(core))
        due = T0 + 13 * MS

        def tick(now: int) -> None:
            nonlocal due
            while due <= now:
                stepper.tick(0, 0, due)
                due += period

        for source.stamp in sorted(stamps):
            tick(source.stamp + 2 * MS)
            stepper.arrived(source, source.stamp + 2 * MS)
        tick(until)
        return core.steps

    return steps_of


def test_a_core_whose_triggers_are_parts_of_a_frame_steps_when_it_is_complete(
    stepper_of: Callable[[Counting], Stepper],
) -> None:
    core, source = Framing(), Source()
    stepper = stepper_of(core)
    for k in range(9):
        source.stamp = T0 + k // 3 * 10 * MS
        stepper.arrived(source, T0 + k * 4 * MS)
    assert core.steps == [T0 + k * 4 * MS for k in (2, 5, 8)]


def poses(rate: float, seconds: float, jitter: Callable[[int], float] = lambda _: 0.0) -> list[int]:
    """Return stamps `rate` times a second, each late by `jitter(k)` ms."""
    return [T0 + round(k * SECOND / rate + jitter(k) * MS) for k in range(round(rate * seconds))]


@pytest.mark.parametrize("rate", [100.1, 120, 150, 180, 200, 240, 360, 500])
@pytest.mark.parametrize("spread", [0.0, 1.0])
def test_poses_that_come_faster_make_a_core_step_at_its_rate(steps_of: StepsOf, rate: float, spread: float) -> None:
    noise = Random(3)
    steps = steps_of(sorted(poses(rate, 20.0, lambda _: noise.gauss(0.0, spread))), T0 + 20 * SECOND)
    assert len(steps) == pytest.approx(2000, abs=2)
    assert max(b - a for a, b in pairwise(steps)) < (10 + 1000 / rate + 10 * spread) * MS


@pytest.mark.parametrize(
    "jitter",
    [
        pytest.param(lambda _, noise: noise.gauss(0.0, 1.0), id="1 ms either way"),
        pytest.param(lambda _, noise: noise.uniform(0.0, 9.9), id="late by up to a period"),
        pytest.param(lambda k, _: 9.0 if k == 0 else 0.0, id="only the first one late"),
        pytest.param(lambda k, _: 9.0 if k % 7 == 0 else 0.0, id="each seventh late"),
    ],
)
def test_of_poses_at_the_cores_rate_each_makes_a_step(
    steps_of: StepsOf, jitter: Callable[[int, Random], float]
) -> None:
    noise = Random(5)
    stamps = poses(100, 20.0, lambda k: jitter(k, noise))
    assert stamps == sorted(stamps)
    assert len(steps_of(stamps, T0 + 20 * SECOND)) == 2000


@pytest.mark.parametrize("rate", [50, 60, 83])
def test_of_slower_poses_each_makes_a_step_and_the_watchdog_none(steps_of: StepsOf, rate: int) -> None:
    noise = Random(7)
    assert len(steps_of(poses(rate, 20.0, lambda _: noise.gauss(0.0, 1.0)), T0 + 20 * SECOND)) == rate * 20


def test_after_a_gap_the_next_pose_makes_a_step_and_all_after_it(steps_of: StepsOf) -> None:
    stamps = [*poses(100, 1.0), *(T0 + SECOND + 9 * MS + k * 10 * MS for k in range(100))]
    assert len(steps_of(stamps, T0 + 2 * SECOND)) == 200


def test_without_poses_the_watchdog_makes_the_steps(steps_of: StepsOf) -> None:
    steps = steps_of(poses(100, 1.0), T0 + 3 * SECOND)[100:]
    assert 20 * MS < steps[0] - T0 - SECOND + 10 * MS <= 40 * MS
    assert {b - a for a, b in pairwise(steps)} == {40 * MS}


def test_the_watchdogs_first_step_is_20_to_40_ms_after_the_last_pose_came(steps_of: StepsOf) -> None:
    steps = steps_of(poses(100, 1.0), T0 + 3 * SECOND)[100:]
    assert 20 * MS < steps[0] - (T0 + 992 * MS) <= 40 * MS  # the last pose is of 0.99 s, and 2 ms late
    assert {b - a for a, b in pairwise(steps)} == {40 * MS}


def test_after_poses_that_end_just_after_a_gap_the_watchdog_is_not_later(steps_of: StepsOf) -> None:
    last = T0 + 1030 * MS
    steps = steps_of([*poses(100, 1.0), last - 10 * MS, last], last + SECOND)
    assert 20 * MS < min(step for step in steps if step > last + 2 * MS) - (last + 2 * MS) <= 40 * MS


def test_a_clock_that_is_set_back_takes_no_time_back_and_delays_no_step(
    make_swarm: Callable[[], Swarm],
) -> None:
    """The core's time goes on; what comes in and goes out is moved to it, and back to swarm time."""
    core, source, published = Repeating(), Source(), list[int]()
    stepper = Stepper(
        core, make_swarm().name, (), (source,), lambda messages: published.extend(m.stamp for _, m in messages),
        AlwaysKnown(), None,
    )  # fmt: skip
    stamps = [*poses(100, 1.0), *(stamp - 60 * SECOND for stamp in poses(100, 1.0))]
    for source.stamp in stamps:
        stepper.arrived(source, source.stamp)
    assert len(core.steps) == 200
    assert core.steps == sorted(core.steps)
    assert core.steps[-1] - core.steps[0] == pytest.approx(2 * SECOND, abs=SECOND // 10)
    assert published[-1] == pytest.approx(stamps[-1], abs=SECOND // 10)


def test_a_status_has_its_order_in_swarm_time(make_plan: Callable[..., Plan]) -> None:
    published: list[Status] = []
    plan = make_plan()
    status = StatusPublisher(
        "world", "uav1", lambda messages: published.extend(message for _, message in messages),  # type: ignore[misc]
        lambda _: NO_RESOURCES, timekeeping(plan, "uav1", lambda _: None), lambda _: None,
    )  # fmt: skip
    ahead = 60 * SECOND
    order = Mission(T0, "world", "start", T0 + SECOND)
    status.update(T0 + ahead, Report("hold", mission=order.shift(ahead)), StepCounts(), (), ahead)
    assert (published[0].stamp, published[0].report.mission) == (T0, order)
