"""`flockwire identify` on a host whose clock is off, and where nobody tells the time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator

import pytest
from flockwire_core import clock
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_operator.station.excitation import PATIENCE, Axis, ExcitationStage
from flockwire_operator.station.identify import begun


class Gateway:
    """The gateway's time, by which this host is `behind` s; None: it is not told."""

    def __init__(self, behind: float | None) -> None:
        self._behind = behind

    async def wait_for_time(self, ended: asyncio.Event, seconds: float, idle: Callable[[], None]) -> None:
        if self._behind is not None:
            clock.correct(nanoseconds(self._behind))
            return
        while not ended.is_set():
            idle()
            await asyncio.sleep(0)


@pytest.fixture(autouse=True)
def own_clock() -> Iterator[None]:
    """Leave the clock as it was."""
    yield
    clock.correct(0)


@pytest.mark.parametrize("behind", [-5.0, 5.0, 2.0 * PATIENCE])
def test_it_begins_by_swarm_time(make_swarm: Callable, behind: float) -> None:
    core = asyncio.run(begun(Gateway(behind), make_swarm(), 1, (Axis.UP,), bool))
    core.step(clock.now() + SECOND)
    assert (core.stage, core.failure) == (ExcitationStage.WAITING, "")
    core.step(clock.now() + nanoseconds(PATIENCE + 1.0))
    assert core.failure


def test_it_does_not_wait_for_swarm_time_when_that_is_hopeless(make_swarm: Callable) -> None:
    core = asyncio.run(asyncio.wait_for(begun(Gateway(None), make_swarm(), 1, (Axis.UP,), lambda: True), 5.0))
    assert core.stage is ExcitationStage.WAITING
