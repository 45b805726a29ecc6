"""Who waits for the router says so once, and ends when interrupted, or when there is nothing left to wait for."""

import asyncio
import os
import signal
import time
from functools import partial

import pytest
from flockwire_core.runtime import session as sessions
from flockwire_core.runtime.session import RouterAbsentError
from flockwire_operator.console.command import serve
from flockwire_operator.station import identify, processes, watching
from flockwire_operator.station.conduct import conduct
from flockwire_operator.station.connecting import UNANSWERED, connected
from flockwire_operator.station.teleop import steer
from flockwire_operator.station.terminal.interrupts import Interrupts
from simulated_children import Processes

TRY = 0.02  # s that an attempt to reach the router takes
SOON = 10.0  # s


class Router:
    """A router that answers the attempt number `answers`, never without one; counts attempts and open sessions."""

    def __init__(self):
        self.answers, self.attempts, self.open = 0, 0, 0

    def __call__(self, *_):
        self.attempts += 1
        time.sleep(TRY)
        if self.attempts != self.answers:
            raise RouterAbsentError
        self.open += 1
        return self

    def close(self):
        self.open -= 1


@pytest.fixture
def router(monkeypatch):
    router = Router()
    monkeypatch.setattr(sessions, "Session", router)
    return router


@pytest.fixture
def plan(make_plan):
    return make_plan({"network.mode": "router", "leader.kind": "teleoperated", "leader.trajectory": None})


def run(coroutine):
    async def soon():
        async with asyncio.timeout(SOON):
            return await coroutine

    return asyncio.run(soon())


def test_it_waits_until_the_router_answers_and_reports_it_once(router, plan, capsys):
    router.answers = 4
    assert run(connected(plan, "operator", None, Interrupts())) is router
    assert capsys.readouterr().err == f"flockwire: waits for the router at {plan.endpoints['router']}\n"


def test_a_router_that_answers_at_once_is_no_news(router, plan, capsys):
    router.answers = 1
    assert run(connected(plan, "operator", None, Interrupts())) is router
    assert capsys.readouterr().err == ""


def test_it_ends_when_there_is_nothing_left_to_wait_for(router, plan):
    assert run(connected(plan, "operator", None, Interrupts(), hopeless=lambda: router.attempts > 2)) is None


def test_a_session_that_opens_while_its_opener_is_cancelled_is_closed(router, plan):
    router.answers = 1

    async def cancel():
        opening = asyncio.create_task(connected(plan, "operator", None, Interrupts()))
        await asyncio.sleep(TRY / 4)
        opening.cancel()
        with pytest.raises(asyncio.CancelledError):
            await opening

    run(cancel())
    assert (router.attempts, router.open) == (1, 0)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize(
    ("command", "result"),
    [
        (partial(conduct, duration=1.0, out=None, headless=True), UNANSWERED),
        (partial(serve, address="127.0.0.1", port=0), False),
        (steer, False),
    ],
)
def test_an_interrupt_ends_each_command_while_it_waits(router, plan, tmp_path, command, result, number):
    async def interrupt():
        asyncio.get_running_loop().call_later(3 * TRY, os.kill, os.getpid(), number)
        return await command(plan, tmp_path)

    assert run(interrupt()) == result


def test_who_identifies_a_drone_stops_waiting_when_the_router_died(router, plan, tmp_path, monkeypatch):
    children = Processes()
    children.dead.append("router")
    monkeypatch.setattr(processes, "Children", lambda *_: children)
    monkeypatch.setattr(processes, "busy_endpoint", lambda *_: "")
    core = run(identify.excite(plan, tmp_path / "mine.toml", tmp_path, 1, tmp_path))
    assert (core.failure, core.responses) == ("router ended unexpectedly (signal SIGKILL)", {})


def test_a_table_that_is_shown_once_does_not_wait_for_long(router, plan, tmp_path, monkeypatch):
    monkeypatch.setattr(watching, "LOOK_TIME", 0.1)
    assert run(watching.watch(plan, tmp_path, once=True)) == plan.started


def test_a_live_table_waits_until_it_is_interrupted(router, plan, tmp_path, monkeypatch):
    monkeypatch.setattr(watching, "LOOK_TIME", 0.1)
    monkeypatch.setattr(watching, "foreground", lambda stream: True)
    began = time.monotonic()

    async def interrupt():
        asyncio.get_running_loop().call_later(0.3, os.kill, os.getpid(), signal.SIGINT)
        return await watching.watch(plan, tmp_path, once=False)

    assert run(interrupt()) == plan.started
    assert time.monotonic() - began > 0.3
