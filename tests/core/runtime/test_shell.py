import asyncio
import threading
from types import SimpleNamespace

import pytest
from flockwire_core.process.cores import Ground
from flockwire_core.runtime import shell as module
from flockwire_core.runtime.shell import Shell
from flockwire_core.wire.keys import Key
from flockwire_core.wire.status import Report


class Plain(Ground):
    period = 0.01

    def report(self, now):
        return Report("")


class OfFrames(Plain):
    def due(self, key):
        return True


class OfRareFrames(OfFrames):
    period = 0.2  # ticks come too rarely for a status


class Following(Plain):
    def __init__(self):
        super().__init__()
        self.triggers = frozenset({Key("pose", "uav1")})


class Idle:
    def __init__(self, period, tick, lock):
        pass

    def start(self):
        pass

    def postpone(self, ticks):
        pass


class Session:
    def __init__(self):
        self.flushed, self.taken_over = [], 0

    def take_over_batches(self):
        self.taken_over += 1
        return lambda: self.flushed.append(True)

    def newest(self, key):
        return SimpleNamespace(inbox=SimpleNamespace(key=key), message=lambda now: None)

    def prompt(self, key, wakeup):
        return self.newest(key)

    def publish(self, messages):
        pass


def started(monkeypatch, core, plan, direct, requests=()):
    monkeypatch.setattr(module, "Ticker", Idle)
    timed = SimpleNamespace(keys=requests, step=lambda now: ())
    swarm_clock = SimpleNamespace(lock=threading.Lock(), timekeeping=timed, prompts=[])

    async def start():
        session = Session()
        shell = Shell(core, plan, "gateway", session, swarm_clock, None, None)
        shell.start(direct)
        shell._tick(0, 0)
        return shell._stepper, session

    return asyncio.run(start())


@pytest.mark.sources  # its core is of Python
@pytest.mark.parametrize(
    ("core", "direct", "apart"),
    [(OfFrames, True, True), (OfFrames, False, False), (Plain, True, False), (OfRareFrames, True, False)],
)
def test_poses_that_leave_when_the_step_is_over_wait_for_neither_status_nor_batch(
    monkeypatch, make_plan, core, direct, apart
):
    stepper, session = started(monkeypatch, core(), make_plan(), direct)
    assert stepper.reports_at_ticks is apart
    assert bool(session.taken_over) is bool(session.flushed) is apart


@pytest.mark.sources  # its core is of Python
@pytest.mark.parametrize(
    ("core", "direct", "requests", "postpones"),
    [
        pytest.param(Following, True, (), True, id="poses make it step at once"),
        pytest.param(Following, False, (), False, id="other input too"),
        pytest.param(Following, True, (Key("time_reply", "uav1"),), False, id="a clock to correct"),
        pytest.param(Plain, True, (), False, id="ticks make it step"),
    ],
)
def test_ticks_that_would_do_nothing_are_postponed(monkeypatch, make_plan, core, direct, requests, postpones):
    stepper, _ = started(monkeypatch, core(), make_plan(), direct, requests)
    assert (stepper.postpone is not None) is postpones
