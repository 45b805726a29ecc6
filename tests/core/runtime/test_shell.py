import asyncio
import threading
from types import SimpleNamespace

import pytest
from flockwire.process.cores import Ground
from flockwire.runtime import shell as module
from flockwire.runtime.shell import Shell
from flockwire.wire.status import Report


class Plain(Ground):
    period = 0.01

    def report(self, now):
        return Report("")


class OfFrames(Plain):
    def due(self, key):
        return True


class OfRareFrames(OfFrames):
    period = 0.2  # ticks come too rarely for a status


class Idle:
    def __init__(self, period, tick):
        pass

    def start(self):
        pass


@pytest.mark.parametrize(
    ("core", "direct", "apart"),
    [(OfFrames, True, True), (OfFrames, False, False), (Plain, True, False), (OfRareFrames, True, False)],
)
def test_poses_that_leave_when_the_step_is_over_wait_for_neither_status_nor_batch(
    monkeypatch, make_plan, core, direct, apart
):
    monkeypatch.setattr(module, "Ticker", Idle)
    flushed, taken, plan = [], [], make_plan()
    session = SimpleNamespace(
        publish=lambda messages: None,
        take_over_batches=lambda: taken.append(True) or (lambda: flushed.append(True)),
        newest=lambda key: SimpleNamespace(inbox=SimpleNamespace(key=key), message=lambda now: None),
    )
    session.prompt = lambda key, wakeup: session.newest(key)
    timed = SimpleNamespace(keys=(), step=lambda now: ())
    swarm_clock = SimpleNamespace(lock=threading.Lock(), timekeeping=timed, prompts=[])

    async def started():
        shell = Shell(core(), plan, "gateway", session, swarm_clock, None, None)
        shell.start(direct)
        shell._tick(0, 0)
        return shell._stepper.reports_at_ticks

    assert asyncio.run(started()) is apart
    assert bool(taken) is bool(flushed) is apart
