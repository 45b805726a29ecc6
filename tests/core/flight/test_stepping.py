"""Deadlines of periodic tasks."""

from __future__ import annotations

import pytest
from flockwire.flight.stepping import is_due, next_deadline

PERIOD = 100


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
